//! Exposure planners: what to expose, so that the doses of all layers together cure the part.
//!
//! - [`Light`] is the model that the planners share: what a pixel of a layer adds to the dose of
//!   each voxel, from a material's numbers.
//! - [`Blur`] spreads the light of an image sideways.

mod blur;
mod doses;
mod light;
mod resin_light;
mod section;
pub mod solver;
mod spool;
mod tiled;
pub mod voxels;
mod wide;

pub use blur::{Blur, Real};
pub use light::{IntensityOf, LayerLight, LayerTime, Light, LightError, SampleHeight};
pub use resin_light::NoLight;
pub use section::DoseSection;
