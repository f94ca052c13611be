//! What the end-to-end tests share: the binaries, a folder to run them in,
//! and the comparison of layers with golden images.
//!
//! The tests run the real `lamp`, `slice`, `fix`, `dither` and `tile`; they
//! are built first, so that they are never stale. A test reads as what people
//! type:
//!
//! ```
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
mod scratch;

pub use binaries::{bin, target_dir, workspace_root};
pub use golden::{Change, Golden, Shade, difference};
pub use images::{at_least, differing, edited, stripped, with_soft_edges};
pub use referees::{Packed, ask, ask_python, packed, packed_mask, plain_pages};
pub use scratch::{Ran, Scratch, ends_white, mask, masks, read_stack, write_gray_ramp};

use std::io::Write;
use std::path::PathBuf;

use lamp_fixtures::{Mesh, sphere};

/// Returns a ball of few facets, each of which many rows and planes meet;
/// tilted, for no plane meets an edge that lies level.
pub fn tilted_ball() -> Mesh {
    let ([sin_x, cos_x], [sin_y, cos_y]) = ([0.6, 0.8], [0.28, 0.96]);
    sphere(6.0, 600).map(|[x, y, z]| {
        let (y, z) = (cos_x * y - sin_x * z, sin_x * y + cos_x * z);
        [cos_y * x + sin_y * z, y, cos_y * z - sin_y * x]
    })
}

/// Returns a folder of models or images from elsewhere, `stl` or `tiff`:
/// `../shared/data` beside the workspace, where it exists.
pub fn shared_data(kind: &str) -> Option<PathBuf> {
    let folder = workspace_root().parent()?.join("shared/data").join(kind);
    folder.is_dir().then_some(folder)
}

/// Says a line that shows even where the test passes, such as why something
/// was skipped: the test harness only captures what `println!` and its like
/// write.
pub fn note(line: &str) {
    // Nobody may be listening; that is no failure of the test.
    let _ = writeln!(std::io::stderr().lock(), "note: {line}");
}
