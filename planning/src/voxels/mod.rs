//! Chooses the gray level of each pixel from the doses of all layers together (001).
//!
//! Layers are planned a few at a time, from the light down: the light that they get from above is
//! known then, and the plan looks ahead at the layers below. In each layer, tiles near the part's
//! surfaces are planned together with their surroundings. A second pass, from the bottom up, adds
//! up the prices of doses, which gives a bound that no plan costs less than.

mod block;
mod bound;
mod descent;
mod levels;
mod measure;
mod options;
mod outcome;
mod plan;
mod roles;
mod search_sums;
mod setting;
mod unplanned;

pub use options::{DOSE_MARGIN, Options, Sources, VoxelObjective, Window};
pub use outcome::{DoseHistogram, GapAt, LayerOutcome, Outcome, VoxelCounts, VoxelTally};
pub use plan::{VOXELS_CODE, VoxelPlan, VoxelPlanError, most_memory, plan};
