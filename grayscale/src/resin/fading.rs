//! How light fades in a resin, for doses that add up.

use lamp_stack::{FadingLevels, Length};

use super::gray_curve::{GrayCurve, StraightLine};
use super::model::ModelError;
use super::units::{Dose, ExposureTime, GrayLevel, Intensity};
use super::working_curve::WorkingCurve;

/// The shares of the critical dose that exposures of each gray level leave in the resin below; the
/// shares add up (002 section 3.4.8 a).
///
/// A level `G` brings `G I_0 t / E_c(G)` critical doses to the surface, which fade by e over its
/// own `D_p(G)` (002 eq. 28, 39 and 40). So an exposure alone cures exactly to the depth of its
/// working curve; resin is cured where the shares of all exposures that reach it sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FadingLight {
    light: Intensity,
    curve: GrayCurve,
}

impl FadingLight {
    /// Creates the light of a lamp in a resin whose working curve changes with the gray level.
    pub fn new(light: Intensity, curve: GrayCurve) -> Self {
        Self { light, curve }
    }

    /// Creates the light of a lamp in a resin with one working curve.
    ///
    /// # Errors
    /// Returns an error if a number of the curve is not above zero.
    pub fn of_curve(light: Intensity, curve: WorkingCurve) -> Result<Self, ModelError> {
        let critical_dose = StraightLine { at_zero: curve.critical_dose(), rise: Dose::default() };
        let depth = StraightLine { at_zero: curve.penetration_depth(), rise: Length::default() };
        Ok(Self { light, curve: GrayCurve::new(critical_dose, depth)? })
    }

    /// Returns the light of full white, `I_0`.
    pub fn light(&self) -> Intensity {
        self.light
    }

    /// Returns the critical doses that an exposure brings to the surface.
    pub fn share(&self, gray: GrayLevel, time: ExposureTime) -> f64 {
        // 002 eq. 34 and 27: a gray level passes its share of the light.
        let dose = self.light * time * gray;
        // Doses of different levels have different critical ones (002 eq. 40): as shares of their
        // own they can be added.
        dose.mj_per_cm2() / self.curve.at(gray).critical_dose().mj_per_cm2()
    }

    /// Returns the light that each gray level leaves in an exposure, for slicing.
    pub fn levels(&self, time: ExposureTime) -> FadingLevels {
        FadingLevels::new(|gray| {
            let gray = GrayLevel::clamped(gray);
            (self.share(gray, time), self.penetration_depth(gray))
        })
    }

    /// Returns the depth over which the light of a gray level fades by e.
    pub fn penetration_depth(&self, gray: GrayLevel) -> Length {
        self.curve.at(gray).penetration_depth()
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Catalogued;

    use super::*;
    use crate::material::Material;

    #[test]
    fn one_exposure_cures_as_deep_as_its_working_curve() {
        for name in ["lamp-suspension", "zsg-amber"] {
            let material = Material::builtin(name).unwrap();
            let (resin, fading) = (material.resin().unwrap(), material.fading().unwrap());
            let time = resin.exposure_time(Length::from_um(100.0), 1.3).unwrap();
            for level in [60, 128, 200, 255] {
                let gray = GrayLevel::from_u8(level);
                let share = fading.share(gray, time);
                let depth = (fading.penetration_depth(gray).um() * share.ln()).max(0.0);
                let alone = resin.depth(gray, time).um();
                assert!((depth - alone).abs() < 1e-9, "{name} {level}: {depth} {alone}");
            }
        }
    }
}
