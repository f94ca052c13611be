//! Each package links its tests once, and none of their files is forgotten.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use lamp_tests::workspace_root;
use serde_json::Value;

/// The test programs besides their package's own. Its `Cargo.toml` has the reasons.
const ALONE: [&str; 4] = ["check_memory", "false_headers", "occt_files", "real_files"];

/// A package's folder of tests, and the names and first files of its test programs.
struct Package {
    name: String,
    tests: PathBuf,
    programs: Vec<(String, PathBuf)>,
}

fn packages() -> Vec<Package> {
    let metadata = Command::new(env!("CARGO"))
        .args(["metadata", "--offline", "--no-deps", "--format-version", "1"])
        .current_dir(workspace_root())
        .output()
        .expect("cargo starts");
    let metadata: Value = serde_json::from_slice(&metadata.stdout).expect("cargo prints JSON");
    let text = |value: &Value| value.as_str().expect("a text").to_owned();
    let list = |value: &Value| value.as_array().expect("a list").clone();
    let program = |target: Value| {
        let is_test = target["kind"][0] == "test";
        is_test.then(|| (text(&target["name"]), text(&target["src_path"]).into()))
    };
    let package = |package: Value| Package {
        name: text(&package["name"]),
        tests: Path::new(&text(&package["manifest_path"])).with_file_name("tests"),
        programs: list(&package["targets"]).into_iter().filter_map(program).collect(),
    };
    list(&metadata["packages"]).into_iter().map(package).collect()
}

/// Adds a file of Rust and the files that its lines `mod x;` name; `folder` has its modules.
fn add_with_modules(file: PathBuf, folder: &Path, found: &mut BTreeSet<PathBuf>) {
    let text = fs::read_to_string(&file).expect("a file of a test program");
    found.insert(file);
    for line in text.lines() {
        let line = line.trim_start_matches("pub(crate) ").trim_start_matches("pub(super) ");
        let Some(name) = line.strip_prefix("mod ").and_then(|line| line.strip_suffix(';')) else {
            continue;
        };
        let inner = folder.join(name);
        let files = [inner.with_extension("rs"), inner.join("mod.rs")];
        if let Some(file) = files.into_iter().find(|file| file.exists()) {
            add_with_modules(file, &inner, found);
        }
    }
}

/// Adds the files of Rust in a folder, if it is there.
fn add_files(folder: &Path, found: &mut BTreeSet<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.expect("a readable folder").path();
        if path.is_dir() {
            add_files(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.insert(path);
        }
    }
}

#[test]
fn no_file_is_forgotten() {
    for Package { name, tests, programs } in packages() {
        let (mut there, mut compiled) = (BTreeSet::new(), BTreeSet::new());
        add_files(&tests, &mut there);
        for (_, file) in programs {
            let folder = file.parent().expect("a file is in a folder").to_owned();
            add_with_modules(file, &folder, &mut compiled);
        }
        let forgotten: Vec<_> = there.difference(&compiled).collect();
        assert!(forgotten.is_empty(), "{name}: no test program has {forgotten:?}");
    }
}

#[test]
fn each_package_links_its_tests_once() {
    for Package { name, programs, .. } in packages() {
        let others = programs.iter().filter(|(program, _)| !ALONE.contains(&program.as_str()));
        let others: Vec<_> = others.map(|(_, file)| file).collect();
        assert!(
            others.len() <= 1,
            "{name}: make modules of one test program out of {others:?}, with `autotests = false`"
        );
    }
}
