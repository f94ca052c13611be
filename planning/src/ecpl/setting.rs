//! The exposure of a chamber: light, blur, pixels and times of the display, and the resin.

use lamp_grayscale::resin::{ExposureTime, Intensity, Kinetics};
use thiserror::Error;

use super::cells::{Cells, ChamberShape};
use crate::projector::{Projector, SpreadOf};

/// The longest step of a display: 003's resin cures its part in some 20 s.
const LONGEST_DISPLAY_S: f64 = 2.0;

/// The longest step of the reaction, in seconds. Heights are then within 0.1 µm of the heights at a
/// tenth of this step.
const LONGEST_STEP_S: f64 = 0.025;

/// About the width of a cell, in micrometers: half of it changes heights by less than 0.1 µm.
const WIDTH_UM: f64 = 4.0;

/// About the height of a cell, in micrometers.
const HEIGHT_UM: f64 = 1.0;

/// The number of cells of the largest chamber.
const MOST_CELLS: f64 = 4e6;

/// Oxygen that arrives within this many seconds matters.
const OXYGEN_S: f64 = 40.0;

/// The light on a chamber, and the resin in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KineticSetting {
    /// The rates of the resin.
    pub kinetics: Kinetics,
    /// The light of a wide white field on the glass.
    pub light: Intensity,
    /// The standard deviation of the blur, in micrometers.
    pub sigma_um: f64,
    /// The side of a pixel on the glass, in micrometers.
    pub pixel_um: f64,
    /// The pixels from the middle of the display to its nearest side.
    pub pixels: u32,
    /// The display's step: times are multiples of it.
    pub step: ExposureTime,
    /// The distance between the two glasses of the chamber, in micrometers.
    pub chamber_um: f64,
}

/// Why a setting exposes nothing.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SettingError {
    /// A number is not above zero, or not finite.
    #[error("{0} must be above zero")]
    NotPositive(&'static str),
    /// The projector's light spreads over a cone.
    #[error("its light spreads over a cone: kinetics need `sigma` in [spread]")]
    Cone,
    /// The projector has no chamber.
    #[error("it does not state how high the resin is: add [chamber] to its file")]
    NoChamber,
    /// The blur is below zero, or not finite.
    #[error("the blur must be zero or more")]
    Blur,
    /// The step of the display is too coarse for any plan.
    #[error(
        "the display's step is {0}: {LONGEST_DISPLAY_S} s is the most that parts can be planned with"
    )]
    LongStep(ExposureTime),
    /// Cells of a useful size would be too many.
    #[error("a chamber of {wide_um:.0} x {deep_um:.0} um is too large to compute")]
    TooLarge {
        /// The radius that it would need.
        wide_um: f64,
        /// Its height.
        deep_um: f64,
    },
}

impl KineticSetting {
    /// Takes the numbers of a projector and of its resin.
    ///
    /// # Errors
    /// Returns an error if the projector does not spread light by a Gaussian, or does not state the
    /// height of its chamber.
    pub fn of(projector: &Projector, kinetics: Kinetics) -> Result<Self, SettingError> {
        let SpreadOf::Gaussian(sigma) = projector.spread() else {
            return Err(SettingError::Cone);
        };
        let chamber = projector.chamber.as_ref().ok_or(SettingError::NoChamber)?;
        Ok(Self {
            kinetics,
            light: projector.irradiance(),
            sigma_um: sigma.um(),
            pixel_um: projector.pitch.value.um(),
            pixels: projector.display.columns.min(projector.display.rows) / 2,
            step: projector.step.value,
            chamber_um: chamber.value.um(),
        })
    }

    /// Checks that the numbers are possible.
    ///
    /// # Errors
    /// Returns an error that names the impossible number.
    pub fn check(&self) -> Result<(), SettingError> {
        for (number, what) in [
            (self.light.mw_per_cm2(), "the light"),
            (self.pixel_um, "the pixel"),
            (f64::from(self.pixels), "the display's size"),
            (self.step.ms(), "the display's step"),
            (self.chamber_um, "the chamber's height"),
        ] {
            if !(number > 0.0 && number.is_finite()) {
                return Err(SettingError::NotPositive(what));
            }
        }
        if self.step.ms() > 1000.0 * LONGEST_DISPLAY_S {
            return Err(SettingError::LongStep(self.step));
        }
        if self.sigma_um >= 0.0 && self.sigma_um.is_finite() {
            Ok(())
        } else {
            Err(SettingError::Blur)
        }
    }

    /// Returns the step of the reaction, in seconds: a whole number of them makes up the display's
    /// step, or the other way round.
    pub(super) fn seconds(&self) -> f64 {
        let step = self.step.ms() / 1000.0;
        if step > LONGEST_STEP_S {
            step / (step / LONGEST_STEP_S).ceil()
        } else {
            step * (LONGEST_STEP_S / step + 1e-9).floor()
        }
    }

    /// Returns the cells of a chamber for everything up to `radius_um` from the axis.
    pub(super) fn cells(&self, radius_um: f64) -> Result<Cells, SettingError> {
        let um2_per_s = 1e12 * self.kinetics.oxygen_diffusion.m2_per_s();
        let wide_um = radius_um + 4.0 * self.sigma_um + (um2_per_s * OXYGEN_S).sqrt();
        let deep_um = self.chamber_um;
        let [across, deep] = [wide_um / WIDTH_UM, deep_um / HEIGHT_UM].map(f64::ceil);
        if (across * deep).is_nan() || across * deep > MOST_CELLS {
            return Err(SettingError::TooLarge { wide_um, deep_um });
        }
        Ok(Cells {
            shape: ChamberShape::Round,
            across: across as usize,
            deep: deep as usize,
            width_um: WIDTH_UM,
            height_um: deep_um / deep,
        })
    }
}
