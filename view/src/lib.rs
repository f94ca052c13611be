//! A local web viewer of stacks: tiles of any scale come straight from runs.

mod assets;
mod surface;

pub use assets::{Asset, asset, licences};
pub use surface::{CellGrid, MAX_CELLS, Surface, SurfaceError, SurfaceOptions, SurfaceUnit};
