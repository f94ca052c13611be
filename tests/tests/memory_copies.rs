//! Checks the copies of memory of static programs (`cli/c/musl.c`) byte by byte, on any system that
//! has a C compiler and an x86-64 processor.

#![cfg(target_arch = "x86_64")]

use std::process::Command;

use lamp_tests::{Scratch, workspace_root};

/// Compares each function with a loop over bytes: random lengths around every bound of the code, places
/// that overlap in both directions, and bytes beside them that must stay.
const DRIVER: &str = r#"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
void *our_memcpy(void *, const void *, size_t);
void *our_memmove(void *, const void *, size_t);
int our_memcmp(const void *, const void *, size_t);
static unsigned char before[8192], after[8192], expected[8192];
static int sign(int x) { return (x > 0) - (x < 0); }
int main(void) {
    srand(7);
    for (int i = 0; i < 8192; i++) before[i] = rand();
    for (int round = 0; round < 400000; round++) {
        size_t n = round % 4 ? rand() % 280 : rand() % 3000;
        size_t from = rand() % 600, to = rand() % 600;
        memcpy(after, before, 8192);
        memcpy(expected, before, 8192);
        our_memmove(after + to, after + from, n);
        for (size_t i = 0; i < n; i++) expected[to + i] = before[from + i];
        if (memcmp(after, expected, 8192)) return printf("memmove %zu %zu %zu\n", to, from, n), 1;
        our_memcpy(after + 4096 + to, before + from, n);
        for (size_t i = 0; i < n; i++) expected[4096 + to + i] = before[from + i];
        if (memcmp(after, expected, 8192)) return printf("memcpy %zu %zu %zu\n", to, from, n), 1;
        memcpy(after, before, 8192);
        if (our_memcmp(after + from, before + from, n)) return printf("memcmp equal\n"), 1;
        if (n) {
            size_t at = from + rand() % n;
            after[at] ^= 1 + rand() % 255;
            int want = (int)after[at] - (int)before[at];
            if (sign(our_memcmp(after + from, before + from, n)) != sign(want))
                return printf("memcmp %zu %zu\n", from, n), 1;
        }
    }
    return 0;
}
"#;

#[test]
fn copies_and_comparisons_are_right_byte_by_byte() {
    let scratch = Scratch::new();
    let ours = std::fs::read_to_string(workspace_root().join("cli/c/musl.c")).unwrap();
    let mut ours = ours.replace("memcmp(", "our_memcmp(").replace("int bcmp(", "int our_bcmp(");
    for name in ["memcpy(", "memmove("] {
        ours = ours.replace(name, &format!("our_{name}"));
    }
    scratch.write("ours.c", ours.as_bytes());
    scratch.write("driver.c", DRIVER.as_bytes());
    let compile = Command::new("cc")
        .args(["-O2", "-fno-builtin", "-o", "driver", "driver.c", "ours.c"])
        .current_dir(&scratch)
        .output();
    // The crates that bring C have a compiler already; it may be called otherwise.
    let Ok(compiled) = compile else { return };
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let ran = Command::new(scratch.path("driver")).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stdout));
}
