//! Compares the poses in which a part can be built, by its mesh alone.
//!
//! Slicing a part in each of some hundred poses takes hours. What decides between them (islands,
//! pits, overhangs, size) is told by heights and facets in milliseconds; only the best need
//! images.
//!
//! Source: 002 section 4.3, which repeats the search for islands for different orientations and
//! takes the one with the least.

mod measure;
mod pareto;
mod pose;

pub use measure::{PoseFacts, PoseLimits, measure};
pub use pareto::pareto;
pub use pose::{Pose, poses};
