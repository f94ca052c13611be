//! Shared by the end-to-end tests: the binaries, a folder to run them in, and golden
//! images.
//!
//! The tests run the real `lamp`, `slice`, `fix`, `dither` and `tile`, which are built
//! first so that they are never stale. Tests contain command lines as users type them:
//!
//! ```no_run
//! use lamp_fixtures::Sample;
//! use lamp_tests::Scratch;
//!
//! let scratch = Scratch::new();
//! scratch.part("cube.stl", Sample::Cube, 64);
//! scratch.run("slice cube.stl --dpi 100 | fix | dither | tile --mesh none > build.tif").succeeds();
//! assert_eq!(scratch.layers("build.tif").len(), 200);
//! ```

mod binaries;
mod golden;
pub mod hostile;
mod images;
mod referees;
mod schemas;
mod scratch;
mod viewing;

pub use binaries::{bin, target_dir, workspace_root};
pub use golden::{Change, Golden, Shade, difference};
pub use images::{at_least, differing, edited, stripped, with_soft_edges};
pub use referees::{Packed, ask, ask_python, packed, packed_mask, plain_pages};
pub use scratch::{
    OWN_SETTINGS, Ran, Scratch, ends_white, mask, masks, read_stack, write_gray_ramp,
};
pub use viewing::{Answer, Viewing};

use std::io::Write;
use std::path::PathBuf;

use lamp_fixtures::{Mesh, sphere};

/// Returns a ball of few facets, each met by many rows and planes. It is tilted because
/// no plane meets a level edge.
pub fn tilted_ball() -> Mesh {
    let ([sin_x, cos_x], [sin_y, cos_y]) = ([0.6, 0.8], [0.28, 0.96]);
    sphere(6.0, 600).map(|[x, y, z]| {
        let (y, z) = (cos_x * y - sin_x * z, sin_x * y + cos_x * z);
        [cos_y * x + sin_y * z, y, cos_y * z - sin_y * x]
    })
}

/// Returns a folder of other programs' models or images (`stl` or `tiff`) in `../shared/data` next
/// to the workspace, if it exists.
pub fn shared_data(kind: &str) -> Option<PathBuf> {
    let folder = workspace_root().parent()?.join("shared/data").join(kind);
    folder.is_dir().then_some(folder)
}

/// Prints a line even if the test passes, such as the reason for a skip. The test
/// harness captures only the output of `println!` and its like.
pub fn note(line: &str) {
    // A closed stream is no failure of the test.
    let _ = writeln!(std::io::stderr().lock(), "note: {line}");
    // `.ci/run` lists them at its end.
    if let Some(path) = std::env::var_os("LAMP_NOTES") {
        let file = std::fs::OpenOptions::new().append(true).create(true).open(path);
        let _ = file.and_then(|mut file| file.write_all(format!("{line}\n").as_bytes()));
    }
}
