//! Builds and finds the programs.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// The folder of programs that are built already, as seen from the workspace's folder.
const PROGRAMS: &str = "LAMP_PROGRAMS";

/// Returns the path of a binary of `lamp-cli`: in the folder `LAMP_PROGRAMS` if that is set, or
/// else built from the current sources, once a process.
///
/// # Panics
/// Panics with the compiler's message if the build fails.
pub fn bin(name: &str) -> PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| match std::env::var_os(PROGRAMS) {
        Some(folder) => workspace_root().join(folder),
        None => {
            build();
            profile_dir()
        }
    });
    folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

/// Returns the folder of the workspace's `Cargo.toml`.
pub fn workspace_root() -> &'static Path {
    // By name, not by `..`: a member may be a link to a folder elsewhere.
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent();
    root.expect("this package is a folder of the workspace")
}

/// Returns cargo's target folder.
pub fn target_dir() -> PathBuf {
    folder_above(&profile_dir())
}

/// `target/debug` or `target/release`: a test runs as `target/debug/deps/x`.
fn profile_dir() -> PathBuf {
    let test = std::env::current_exe().expect("a test knows its path");
    folder_above(&folder_above(&test))
}

fn folder_above(path: &Path) -> PathBuf {
    path.parent().expect("tests run in target/<profile>/deps").to_owned()
}

/// Builds the binaries with the profile of this test. Cargo does so itself only for
/// tests of the package that contains them.
///
/// Also chooses this package, so that shared crates keep the features of its tests and are not
/// built again: its `Cargo.toml` has the features that other packages ask for.
fn build() {
    let folder = profile_dir();
    let profile = match folder.file_name().and_then(|name| name.to_str()) {
        Some("debug") | None => "dev",
        Some(name) => name,
    };
    let features = if cfg!(feature = "occt") { "lamp-cli/occt" } else { "" };
    let built = Command::new(env!("CARGO"))
        .args(["build", "--package", "lamp-cli", "--package", "lamp-tests", "--bins"])
        .args(["--profile", profile])
        .args(["--features", features, "--target-dir"])
        .arg(target_dir())
        .current_dir(workspace_root())
        .output()
        .expect("cargo starts");
    let stderr = String::from_utf8_lossy(&built.stderr);
    assert!(built.status.success(), "the binaries do not build:\n{stderr}");
}
