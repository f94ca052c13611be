//! Crates are built once for the programs and for all tests: both choose the same features.

use std::collections::BTreeSet;
use std::process::Command;

use lamp_tests::workspace_root;

/// Returns the crates that a choice of packages builds, each with its features.
fn crates_of(chosen: &[&str]) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--prefix", "none", "--format", "{p} {f}"])
        .args(chosen)
        .current_dir(workspace_root())
        .output()
        .expect("cargo runs tests, so it is there");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let crates = String::from_utf8(output.stdout).expect("names are text");
    // A crate that was named already has a star.
    crates.lines().map(|line| line.trim_end_matches(" (*)").to_owned()).collect()
}

#[test]
fn programs_are_built_with_the_features_of_the_workspace() {
    let of_workspace = crates_of(&["--workspace"]);
    let of_programs = crates_of(&["-p", "lamp-cli", "-p", "lamp-tests", "--edges", "normal,build"]);
    let others: Vec<_> = of_programs.difference(&of_workspace).collect();
    // Their features belong into tests/Cargo.toml.
    assert!(others.is_empty(), "the workspace builds these crates otherwise: {others:#?}");
}
