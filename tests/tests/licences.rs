//! `lamp --licenses` has the notices of what is in the program: no crate is missing, and none is
//! there that is not.

use std::collections::BTreeSet;
use std::process::Command;

use lamp_tests::{Scratch, note, workspace_root};

/// The crates in `lamp`, as lines `name version (licence)`; none where cargo does not have their
/// sources and cannot fetch them.
fn crates() -> Option<BTreeSet<String>> {
    // The systems that the notices are written for.
    let targets = std::fs::read_to_string(workspace_root().join("cli/licences/targets"));
    let targets = targets.expect("the file is there");
    let tree = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--package", "lamp-cli", "--edges", "normal,no-proc-macro"])
        .args(targets.split_whitespace().flat_map(|target| ["--target", target]))
        .args(["--prefix", "none", "--format", "{p}|{l}"])
        .current_dir(workspace_root())
        .output()
        .expect("cargo starts");
    if !tree.status.success() {
        return None;
    }
    let text = String::from_utf8(tree.stdout).expect("names are text");
    let mut crates = BTreeSet::new();
    // Crates that the tree has twice are marked so; crates of the workspace have their path.
    for line in text.lines().map(|line| line.trim_end_matches(" (*)")) {
        let Some((package, licence)) = line.split_once('|') else { continue };
        if let Some((name, version)) = package.split_once(" v")
            && !version.contains('(')
        {
            crates.insert(format!("{name} {version} ({licence})"));
        }
    }
    Some(crates)
}

/// The lines at the heads of the notices of crates: after each rule, down to a blank line.
fn noticed(text: &str) -> BTreeSet<String> {
    let rule = "-".repeat(80);
    let mut lines = text.lines();
    let mut found = BTreeSet::new();
    while lines.by_ref().any(|line| line == rule) {
        found.extend(lines.by_ref().take_while(|line| !line.is_empty()).map(str::to_owned));
    }
    // The letters and the page's libraries have their addresses behind them.
    found.into_iter().filter(|line| line.ends_with(')')).collect()
}

#[test]
fn each_crate_in_the_program_has_its_notice() {
    let scratch = Scratch::new();
    let printed = scratch.run("lamp --licenses").succeeds();
    let text = String::from_utf8(printed.stdout).unwrap();
    let noticed = noticed(&text);
    assert!(noticed.len() > 100, "{noticed:?}");
    let Some(crates) = crates() else {
        note("cargo does not have all sources: the licences are not compared with Cargo.lock");
        return;
    };
    let missing: Vec<_> = crates.difference(&noticed).collect();
    let idle: Vec<_> = noticed.difference(&crates).collect();
    assert!(
        missing.is_empty() && idle.is_empty(),
        "run cli/licences/update: without a notice {missing:?}, not in the program {idle:?}"
    );
}

#[test]
fn licences_are_printed_in_either_spelling() {
    let scratch = Scratch::new();
    let printed = scratch.run("lamp --licenses").succeeds().stdout;
    for words in ["lamp --licences", "lamp --licenses info", "lamp --quiet --licences man pages"] {
        assert!(scratch.run(words).succeeds().stdout == printed, "{words}");
    }
    let text = String::from_utf8(printed).unwrap();
    for part in ["lamp 0.", "Roboto", "OpenSeadragon", "three.js", "Apache License", "Copyright"] {
        assert!(text.contains(part), "{part}");
    }
    let of_page = scratch.run("lamp view --licenses").succeeds().stdout;
    assert!(String::from_utf8(of_page).unwrap().starts_with("OpenSeadragon"));
}
