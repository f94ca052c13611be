//! Exposures of round parts on a glass, by the kinetics of the resin and of oxygen (003).

mod bitmap;
mod cells;
mod diffusion;
mod doubts;
mod exposure;
mod fit;
mod joint;
mod lamplight;
mod plan;
mod profile;
mod reactor;
mod samples;
mod seed;
mod setting;
mod simulation;
mod strips;

pub use bitmap::NotRound;
pub use cells::{Cells, ChamberShape};
pub use exposure::{NoExposure, RingExposure};
pub use fit::{CuredStrip, FittedRate, KineticFit, KineticFitError, KineticRate, fit_kinetics};
pub use plan::{Method, RingPlan, RingPlanError, plan};
pub use profile::{Profile, WantedProfile};
pub use reactor::{Chamber, Reaction};
pub use samples::{KineticPoint, KineticSize, LONGEST_MS, kinetic_points};
pub use setting::{KineticSetting, SettingError};
pub use simulation::RingSimulation;
