//! What exposes a chamber: light, blur, pixels and times of the display, and the resin.

use lamp_grayscale::resin::{ExposureTime, Intensity, Kinetics};
use thiserror::Error;

use super::cells::{Cells, ChamberShape};
use crate::projector::{Projector, SpreadOf};

/// The longest step of a display: 003's resin cures its part in some 20 s.
const LONGEST_DISPLAY_S: f64 = 2.0;

/// The longest step of the reaction, in seconds. Heights are then within 0.1 µm of those of
/// steps ten times as short.
const LONGEST_STEP_S: f64 = 0.025;

/// About how wide a cell is, in micrometres: half as much moves heights by less than 0.1 µm.
const WIDTH_UM: f64 = 4.0;

/// About how high a cell is, in micrometres.
const HEIGHT_UM: f64 = 1.0;

/// The cells of the largest chamber.
const MOST_CELLS: f64 = 4e6;

/// Oxygen matters that comes in so many seconds.
const OXYGEN_S: f64 = 40.0;

/// What exposes a chamber, and what is in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KineticSetting {
    /// The rates of the resin.
    pub kinetics: Kinetics,
    /// The light of a wide white field on the glass.
    pub light: Intensity,
    /// The standard deviation of the blur, in micrometres.
    pub sigma_um: f64,
    /// The side of a pixel on the glass, in micrometres.
    pub pixel_um: f64,
    /// Pixels from the middle of the display to its nearest side.
    pub pixels: u32,
    /// The display's step: times are multiples of it.
    pub step: ExposureTime,
    /// From one glass of the chamber to the other, in micrometres.
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
    /// The projector does not tell of a chamber.
    #[error("it does not say how high the resin is: add [chamber] to its file")]
    NoChamber,
    /// The blur is below zero, or not finite.
    #[error("the blur must be zero or more")]
    Blur,
    /// A step of the display that is too coarse for any plan.
    #[error(
        "the display's step is {0}: {LONGEST_DISPLAY_S} s is the most that parts can be planned with"
    )]
    LongStep(ExposureTime),
    /// Cells of a useful size would be too many.
    #[error("a chamber of {wide_um:.0} x {deep_um:.0} um is too large to compute")]
    TooLarge {
        /// How far it would have to reach from the axis.
        wide_um: f64,
        /// Its height.
        deep_um: f64,
    },
}

impl KineticSetting {
    /// Takes the numbers of a projector and of its resin.
    ///
    /// # Errors
    /// Returns an error if the projector spreads light otherwise than by a Gaussian, or does not
    /// tell how high its chamber is.
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
    /// Returns an error that names the number otherwise.
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

    /// Returns a step of the reaction, in seconds: whole ones make up the display's, or the other
    /// way round.
    pub(super) fn seconds(&self) -> f64 {
        let step = self.step.ms() / 1000.0;
        if step > LONGEST_STEP_S {
            step / (step / LONGEST_STEP_S).ceil()
        } else {
            step * (LONGEST_STEP_S / step + 1e-9).floor()
        }
    }

    /// Returns the cells of a chamber for what lies within `radius_um` of the axis.
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
