//! Plans the time of each layer, which sets the platform's speed during exposure (004).
//!
//! Every layer's image stays unchanged; its light passes through to the layers below, and adds to
//! their doses. [`plan`] finds the times with the least error, and bounds the error of any others.

mod columns;
mod dose_curve;
mod feasible;
mod gather;
mod hinge;
mod part;
mod plan;
mod simulation;
mod tally;
#[cfg(test)]
pub(crate) mod testing;
mod times_table;

pub(crate) use dose_curve::DoseGrid;
pub use feasible::{Platform, PlatformError, Speed};
pub(crate) use gather::LightField;
pub use part::{PartError, PartPages, TimedLayer, TimedPart};
pub(crate) use plan::times_of;
pub use plan::{SPEED_CODE, SearchStage, SpeedOptions, SpeedPlan, SpeedPlanError, plan};
pub use simulation::{MOST_SPEED_MEMORY, Simulation};
pub use tally::{DOSE_BINS, LIGHT_SHARES, Tally, Wrong};
pub use times_table::{recorded_ms, times_table};
