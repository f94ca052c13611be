//! Compares the poses in which a part can be built, by its mesh alone.
//!
//! Slicing a part in each of some hundred poses takes hours. Heights and facets give the measures
//! that decide between poses (islands, pits, overhangs, size) in milliseconds; only the best need
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
