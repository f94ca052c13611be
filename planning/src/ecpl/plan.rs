//! Plans bitmaps and times for a round part.

use lamp_grayscale::resin::ExposureTime;
use thiserror::Error;

use super::exposure::RingExposure;
use super::profile::{Profile, WantedProfile};
use super::setting::{KineticSetting, SettingError};
use super::simulation::RingSimulation;
use super::{joint, seed};

/// Pixels that a plan may light beyond the part's edge, for the columns that see the edge.
const BEYOND: f64 = 1.0;

/// How to plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// The times of all rings of pixels at once.
    #[default]
    Joint,
    /// Bitmap after bitmap, as 003 does.
    Seed,
}

lamp_stack::named!(Method { Joint = "joint", Seed = "seed" });

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum RingPlanError {
    /// The setting exposes nothing.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A height is not a number, infinite or below zero.
    #[error("the height {radius_um:.1} um from the axis is not a number of zero or more")]
    NoHeight {
        /// Where.
        radius_um: f64,
    },
    /// The part is empty.
    #[error("there is nothing to cure: no middle of a column of cells has a height above zero")]
    Empty,
    /// The part is higher than the chamber.
    #[error("the target is {wanted_um:.1} um high, the chamber only {chamber_um:.1} um")]
    TooHigh {
        /// The part's height.
        wanted_um: f64,
        /// The chamber's.
        chamber_um: f64,
    },
    /// The part is wider than the display.
    #[error("the target reaches {wanted_um:.1} um from its axis, the light only {lit_um:.1} um")]
    TooWide {
        /// The part's radius.
        wanted_um: f64,
        /// Half of the display's shorter side.
        lit_um: f64,
    },
    /// No bitmap would improve the part.
    #[error("the target is too small for pixels of {pixel_um:.2} um that are white for {step}")]
    TooSmall {
        /// The side of a pixel.
        pixel_um: f64,
        /// The display's step.
        step: ExposureTime,
    },
    /// The best plan is no nearer to the part than an empty chamber.
    #[error(
        "the best bitmaps cure {cured_um:.1} um where {wanted_um:.1} um are wanted, which is no \
         better than nothing: light spreads too far, or cures too much in the display's step of {step}"
    )]
    NoBetter {
        /// The height that they cure.
        cured_um: f64,
        /// The height that is wanted.
        wanted_um: f64,
        /// The display's step.
        step: ExposureTime,
    },
    /// A plan without light.
    #[error("no bitmap shows anything: give at least one white pixel")]
    Dark,
    /// A time that the display cannot keep.
    #[error("bitmap {bitmap} is shown for {time}: the display's step is {step}")]
    TooShort {
        /// The number of the bitmap, from 1.
        bitmap: usize,
        /// Its time.
        time: ExposureTime,
        /// The display's step.
        step: ExposureTime,
    },
    /// A plan that would take too long to follow.
    #[error("the bitmaps take {seconds:.0} s together: an hour is the most")]
    TooLong {
        /// The sum of their times.
        seconds: f64,
    },
    /// A ring beyond the display.
    #[error("bitmap {bitmap} reaches {reach} pixels from the middle, the display only {pixels}")]
    BeyondDisplay {
        /// The number of the bitmap, from 1.
        bitmap: usize,
        /// The pixels from the middle to the end of its light.
        reach: u32,
        /// The pixels from the middle to the nearest side of the display.
        pixels: u32,
    },
    /// The light is too weak.
    #[error("{seconds:.0} s of light cure {cured_um:.1} um, the target is {wanted_um:.1} um high")]
    TooDim {
        /// The longest time.
        seconds: f64,
        /// The height that it cures.
        cured_um: f64,
        /// The wanted height.
        wanted_um: f64,
    },
    /// Nobody wants the plan anymore.
    #[error("the search was stopped")]
    Stopped,
}

/// Bitmaps and times, and the profile that they cure.
#[derive(Clone, Debug)]
pub struct RingPlan {
    /// The chamber.
    pub simulation: RingSimulation,
    /// The part, at the columns of the chamber.
    pub wanted: WantedProfile,
    /// The bitmaps in order.
    pub exposures: Vec<RingExposure>,
    /// The profile that they cure.
    pub cured: Profile,
}

/// Plans a round part of `radius_um`, whose height at each distance from its axis is given in
/// micrometers. The search asks `is_stopped` in each round whether to end without a plan.
///
/// # Errors
/// Returns an error if a height is impossible, the part does not fit the chamber or the display,
/// the light does not cure it, or the search is stopped.
pub fn plan(
    setting: KineticSetting,
    radius_um: f64,
    height_um: impl Fn(f64) -> f64,
    method: Method,
    is_stopped: impl Fn() -> bool,
) -> Result<RingPlan, RingPlanError> {
    setting.check()?;
    let lit_um = f64::from(setting.pixels) * setting.pixel_um;
    if radius_um.is_nan() || radius_um > lit_um {
        return Err(RingPlanError::TooWide { wanted_um: radius_um, lit_um });
    }
    let pixels = (radius_um / setting.pixel_um + BEYOND).ceil().min(f64::from(setting.pixels));
    let simulation = RingSimulation::new(setting, pixels as u32, radius_um)?;
    let wanted = WantedProfile::new(simulation.reaction().cells(), &height_um);
    wanted.check(&simulation)?;
    let exposures = match method {
        Method::Joint => joint::plan(&simulation, &wanted, &is_stopped)?,
        Method::Seed => seed::plan(&simulation, &wanted, &is_stopped),
    };
    if is_stopped() {
        return Err(RingPlanError::Stopped);
    }
    if exposures.is_empty() {
        return Err(RingPlanError::TooSmall { pixel_um: setting.pixel_um, step: setting.step });
    }
    // Prepared from the bitmaps alone, as by any later reader: the same heights to the last bit.
    let simulation = RingSimulation::of_plan(setting, &exposures, radius_um)?;
    let wanted = WantedProfile::new(simulation.reaction().cells(), height_um);
    let cured = simulation.cure(&exposures);
    let nothing = Profile { heights_um: vec![0.0; cured.heights_um.len()], ..cured.clone() };
    if wanted.rms_um(&cured) >= wanted.rms_um(&nothing) {
        let (cured_um, wanted_um) = (cured.highest_um(), wanted.highest_um());
        return Err(RingPlanError::NoBetter { cured_um, wanted_um, step: setting.step });
    }
    Ok(RingPlan { simulation, wanted, exposures, cured })
}

/// The longest plan, in seconds.
const LONGEST_S: f64 = 3600.0;

impl RingSimulation {
    /// Prepares a chamber for a plan, and for a part of `radius_um`, zero if there is no part.
    ///
    /// # Errors
    /// Returns an error if nothing is shown, a time is below the display's step, a ring is outside
    /// the display, all bitmaps take more than an hour, or the setting is impossible.
    pub fn of_plan(
        setting: KineticSetting,
        plan: &[RingExposure],
        radius_um: f64,
    ) -> Result<Self, RingPlanError> {
        setting.check()?;
        for (bitmap, exposure) in (1..).zip(plan) {
            let (time, step, reach) = (exposure.time, setting.step, exposure.reach());
            // Times that were written as decimals may be short of a step by rounding.
            if time.ms().is_nan() || time.ms() < step.ms() * (1.0 - 1e-9) {
                return Err(RingPlanError::TooShort { bitmap, time, step });
            }
            if reach > setting.pixels {
                return Err(RingPlanError::BeyondDisplay { bitmap, reach, pixels: setting.pixels });
            }
        }
        let seconds = plan.iter().map(|exposure| exposure.time.ms()).sum::<f64>() / 1000.0;
        if seconds > LONGEST_S {
            return Err(RingPlanError::TooLong { seconds });
        }
        match plan.iter().map(RingExposure::reach).max() {
            None | Some(0) => Err(RingPlanError::Dark),
            Some(pixels) => Ok(Self::new(setting, pixels, radius_um)?),
        }
    }
}

impl WantedProfile {
    fn check(&self, simulation: &RingSimulation) -> Result<(), RingPlanError> {
        let cells = simulation.reaction().cells();
        let possible = |height: f64| height >= 0.0 && height.is_finite();
        if let Some(x) = self.heights_um.iter().position(|&height| !possible(height)) {
            return Err(RingPlanError::NoHeight { radius_um: cells.middle_um(x) });
        }
        let (wanted_um, chamber_um) = (self.highest_um(), simulation.setting().chamber_um);
        if wanted_um == 0.0 {
            return Err(RingPlanError::Empty);
        }
        if wanted_um > chamber_um {
            return Err(RingPlanError::TooHigh { wanted_um, chamber_um });
        }
        Ok(())
    }
}
