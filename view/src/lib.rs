//! A local web viewer of stacks: tiles of any scale come straight from runs.

mod assets;

pub use assets::{Asset, asset, licences};
