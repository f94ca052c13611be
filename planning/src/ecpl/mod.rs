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
pub use cells::{Cells, ChamberShape};
pub use exposure::{NoExposure, RingExposure};
pub use plan::{Method, RingPlan, RingPlanError, plan};
pub use profile::{Profile, WantedProfile};
pub use reactor::{Chamber, Reaction};
pub use setting::{KineticSetting, SettingError};
pub use simulation::RingSimulation;
