//! No arrow between crates goes back: each may depend only on crates of the floors below.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// All crates of the workspace, from the ground floor up. A crate may use crates of lower floors,
/// and no crate of its own floor.
const FLOORS: &[&[&str]] = &[
    &["lamp-stack", "lamp-brep"],
    &["lamp-brep-occt", "lamp-fixtures"],
    &["lamp-slicing"],
    &["lamp-adaptive", "lamp-grayscale", "lamp-fix", "lamp-offset", "lamp-machine"],
    &["lamp-build", "lamp-planning", "lamp-supports"],
    &["lamp-edit", "lamp-view", "lamp-plots", "lamp-gantry"],
    &["lamp-pipeline"],
    &["lamp-batch"],
    &["lamp-slicer"],
    &["lamp-cli"],
    &["lamp-python"],
    // Crates that test the others. Nothing is built on them.
    &["lamp-truck-fixtures", "lamp-tests", "lamp-benches"],
];

/// Returns the floor of a crate, if it is one of the workspace.
fn floor(name: &str) -> Option<usize> {
    FLOORS.iter().position(|floor| floor.contains(&name))
}

/// Returns the crates of the workspace, as cargo reads them without a network.
fn packages() -> Vec<Value> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests lie in the workspace");
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let output = Command::new(cargo)
        .args(["metadata", "--offline", "--no-deps", "--format-version", "1"])
        .current_dir(root)
        .output()
        .expect("cargo runs tests, so it is there");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().expect("metadata lists packages").clone()
}

/// Returns the crates of the workspace that a package needs, except for its own tests.
fn needs(package: &Value) -> impl Iterator<Item = &str> {
    let all = package["dependencies"].as_array().into_iter().flatten();
    // Crates of the workspace have paths; the kinds are null, `build` and `dev`.
    let of_workspace = all.filter(|needed| needed["path"].is_string() && needed["kind"] != "dev");
    of_workspace.filter_map(|needed| needed["name"].as_str())
}

#[test]
fn crates_depend_on_lower_floors_only() {
    let packages = packages();
    let names: Vec<&str> = packages.iter().filter_map(|package| package["name"].as_str()).collect();
    let mut faults = Vec::new();
    for (package, name) in packages.iter().zip(&names) {
        let Some(above) = floor(name) else {
            faults.push(format!("{name} stands on no floor"));
            continue;
        };
        for needed in needs(package) {
            if floor(needed).is_none_or(|below| below >= above) {
                faults.push(format!("{name} depends on {needed}, which is on no lower floor"));
            }
        }
    }
    let gone = FLOORS.iter().copied().flatten().filter(|name| !names.contains(name));
    faults.extend(gone.map(|name| format!("there is no crate {name}")));
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn arrows_are_seen() {
    let packages = packages();
    let of = |name: &str| -> Vec<String> {
        let package = packages.iter().find(|package| package["name"] == name);
        needs(package.unwrap()).map(str::to_owned).collect()
    };
    assert_eq!(of("lamp-build"), ["lamp-machine", "lamp-offset", "lamp-stack"]);
    assert_eq!(of("lamp-stack"), [""; 0]);
}
