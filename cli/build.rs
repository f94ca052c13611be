//! Notes what `lamp --version` says of the build: its commit, target and features.

use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

fn main() {
    println!("cargo::rustc-env=LAMP_TARGET={}", env::var("TARGET").expect("cargo sets it"));
    let occt = env::var_os("CARGO_FEATURE_OCCT").is_some();
    println!("cargo::rustc-env=LAMP_FEATURES={}", if occt { "occt" } else { "none" });
    println!("cargo::rerun-if-env-changed=LAMP_COMMIT");
    println!("cargo::rerun-if-changed=build.rs");
    // A program for tests need not be built again after each commit.
    let is_release = env::var("PROFILE").is_ok_and(|profile| profile == "release");
    let given = env::var("LAMP_COMMIT").ok();
    let commit = given.or_else(|| is_release.then(commit).flatten());
    let commit = commit.unwrap_or_else(|| "unknown".to_owned());
    println!("cargo::rustc-env=LAMP_COMMIT_OF_BUILD={commit}");
    compile_for_musl();
    gather_pages();
}

/// Writes the pages of the book as a list of names and texts, for `lamp help`.
fn gather_pages() {
    // Where links cannot be made, `docs` is a file that names the folder.
    let manifest = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let folders = [manifest.join("docs"), manifest.join("../docs")];
    let folder = folders.iter().find(|folder| folder.is_dir()).expect("the book is there");
    println!("cargo::rerun-if-changed={}", folder.display());
    let files = fs::read_dir(folder).expect("the book can be read");
    let mut pages: Vec<_> = files.map(|file| file.expect("its pages can be read").path()).collect();
    pages.sort();
    let mut list = String::from("&[");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    for page in pages.iter().filter(|page| page.extension().is_some_and(|ending| ending == "md")) {
        let name = page.file_stem().and_then(OsStr::to_str).expect("it has a name");
        match name {
            "SUMMARY" => {
                fs::copy(page, out.join("SUMMARY.md")).expect("a file can be written");
            }
            // It shows another file.
            "benchmarks" => {}
            _ => writeln!(list, "({name:?}, include_str!({page:?})),").expect("text takes all"),
        }
    }
    fs::write(out.join("pages.rs"), list + "]").expect("a file can be written");
}

/// Compiles what programs that are linked with musl need: its allocator and copies are slow.
fn compile_for_musl() {
    println!("cargo::rerun-if-changed=c/musl.c");
    if env::var("CARGO_CFG_TARGET_ENV").is_ok_and(|env| env == "musl") {
        let mut build = cc::Build::new();
        // A compiler that knows these functions would have them call themselves.
        build.file("c/musl.c").define("LAMP_MIMALLOC", None).opt_level(2).flag("-fno-builtin");
        build.flag_if_supported("-fno-tree-loop-distribute-patterns");
        // Linked whole, so that they come before musl's.
        build.link_lib_modifier("+whole-archive").compile("lamp_musl");
    }
}

/// Returns the commit of the checkout and its day; a package of a registry has none.
fn commit() -> Option<String> {
    let git = |words: &[&str]| {
        let output = Command::new("git").args(words).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_owned())
    };
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    println!("cargo::rerun-if-changed={log}");
    // The checkout around a package that is unpacked elsewhere is another project's.
    git(&["ls-files", "--error-unmatch", "build.rs"])?;
    git(&["log", "-1", "--abbrev=8", "--format=%h %cs"])
}
