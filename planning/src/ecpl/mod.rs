//! Exposures of round parts on a glass, by the kinetics of the resin and of oxygen (003).

mod bitmap;
mod cells;
mod diffusion;
mod doubts;
mod exposure;
mod joint;
mod lamplight;
mod plan;
mod profile;
mod reactor;
mod seed;
mod setting;
mod simulation;

pub use bitmap::NotRound;
pub use cells::{Cells, Shape};
pub use exposure::{Exposure, NoExposure};
pub use plan::{Method, PlanError, Planned, plan};
pub use profile::{Profile, Wanted};
pub use reactor::{Chamber, Reaction};
pub use setting::{Setting, SettingError};
pub use simulation::Simulation;
