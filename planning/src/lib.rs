//! Exposure planners: choose the light so that the doses of all layers together cure the part.
//!
//! - [`Light`] is the model that the planners share: the dose that a pixel of a layer adds to each
//!   voxel, from a material's numbers.
//! - [`Blur`] spreads the light of an image sideways.
//! - [`speed`] plans the time of each layer, [`learn`] corrects it after every print.
//! - [`print_sim`] prints on a simulated machine, and measures the print.
//! - [`cure_section`] computes the resin that a stack cures along a vertical section.
//! - Planners on a fixed glass start from a [`projector`] and a [`target`], and write a
//!   [`PlanFolder`].

mod bitmaps;
mod blur;
mod coarse;
pub mod column;
pub mod cure_section;
mod doses;
pub mod ecpl;
pub mod learn;
mod light;
mod numeric;
mod plan_folder;
pub mod print_sim;
pub mod projector;
mod region;
mod resin_light;
mod section;
pub mod solver;
pub mod speed;
mod spool;
pub mod target;
mod tiled;
pub mod voxels;
mod wide;

pub use bitmaps::{MirrorSeconds, ShownBitmap};
pub use blur::{Blur, Real};
pub use light::{IntensityOf, LayerLight, LayerTime, Light, LightError, SampleHeight};
pub use plan_folder::{PlanFolder, PlanFolderError, PlanPages};
pub use region::RegionDoses;
pub use resin_light::NoLight;
pub use section::DoseSection;
