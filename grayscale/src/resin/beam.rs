//! The depth and width that a Gaussian beam cures.

use lamp_stack::Length;

use super::model::{CureModel, ModelError};
use super::plausible;
use super::units::{Dose, GrayLevel};
use super::working_curve::WorkingCurve;

/// A beam whose light falls off as `exp(-2 y²/W_o²)` with the distance `y` from its center (002 eq.
/// 41), as a laser beam does and nearly one projected pixel. Adjacent pixels are adjacent beams
/// (002 figure 69).
///
/// # Guarantees
/// The width is above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussianBeam {
    width: Length,
}

impl GaussianBeam {
    /// Creates the beam of a Gaussian width `W_o`, twice the standard deviation.
    ///
    /// # Errors
    /// Returns an error if the width is not above zero.
    pub fn new(width: Length) -> Result<Self, ModelError> {
        plausible::SPREAD.check("beam-width", width)?;
        Ok(Self { width })
    }

    /// Returns the share of the light, and so of the dose, that arrives at a
    /// distance from the center (002 eq. 41 and 42).
    pub fn share(&self, y: Length) -> GrayLevel {
        // The exponent has 2 where a standard deviation would have 1/2: W_o is two of them.
        let share = (-2.0 * (y.um() / self.width.um()).powi(2)).exp();
        GrayLevel::clamped(share)
    }

    /// Returns the dose at a distance `y` from the center and a depth `z`, in a
    /// resin that absorbs by Beer and Lambert; `peak` is the dose at the center
    /// of the surface (002 eq. 43, whose left side says `z = 0` by mistake).
    pub fn dose(&self, peak: Dose, y: Length, z: Length, resin: &WorkingCurve) -> Dose {
        let through = (-z.um() / resin.penetration_depth().um()).exp();
        let at_surface = peak * self.share(y);
        Dose::from_mj_per_cm2(at_surface.mj_per_cm2() * through)
    }

    /// Returns the depth that cures at a distance from the center: `z* = D_p
    /// ln(E/E_c) - 2 D_p y²/W_o²` (002 eq. 44), or zero if that is below zero.
    pub fn cure_depth(&self, peak: Dose, y: Length, resin: &WorkingCurve) -> Length {
        resin.depth(peak * self.share(y))
    }

    /// Returns the width of the cured line at the surface, from edge to edge:
    /// `W_gauss = W_o √2 √ln(E/E_c)` (002 eq. 45); zero up to the critical dose.
    ///
    /// For a ceramic suspension, eq. 46 is the same with fitted numbers: `F_1` as
    /// the beam's width and `E_Hincz` as the critical dose.
    pub fn cured_width(&self, peak: Dose, critical: Dose) -> Length {
        let ratio = peak.mj_per_cm2() / critical.mj_per_cm2();
        // NaN also ends here.
        let log = if ratio > 1.0 { ratio.ln() } else { 0.0 };
        // Where the dose of eq. 42 falls to E_c, y² = W_o² ln(E/E_c) / 2, and the line is 2 y wide.
        Length::from_um(self.width.um() * (2.0 * log).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn mj(dose: f64) -> Dose {
        Dose::from_mj_per_cm2(dose)
    }

    const fn um(length: f64) -> Length {
        Length::from_um(length)
    }

    fn lamp() -> WorkingCurve {
        WorkingCurve::new(mj(131.5), um(211.0)).unwrap()
    }

    fn beam() -> GaussianBeam {
        GaussianBeam::new(um(17.0)).unwrap()
    }

    #[test]
    fn equation_45() {
        // Worked out with bc.
        for (dose, width) in
            [(131.5, 0.0), (320.0, 22.672088), (600.0, 29.620253), (1920.0, 39.365728)]
        {
            let found = beam().cured_width(mj(dose), mj(131.5)).um();
            assert!((found - width).abs() < 1e-5, "{dose}: {found}");
        }
        for dose in [0.0, 131.4, f64::NAN] {
            assert_eq!(beam().cured_width(mj(dose), mj(131.5)).um(), 0.0);
        }
    }

    #[test]
    fn the_surface_is_cured_as_wide_as_the_depth_is_above_zero() {
        let peak = mj(500.0);
        let half = beam().cured_width(peak, mj(131.5)).um() / 2.0;
        let depth = |y| beam().cure_depth(peak, um(y), &lamp()).um();
        assert!(depth(half - 1e-6) > 0.0);
        assert_eq!(depth(half + 1e-6), 0.0);
        // Eq. 44: a parabola, deepest at the center.
        assert_eq!(depth(0.0), lamp().depth(peak).um());
        let parabola = depth(0.0) - 2.0 * 211.0 * (5.0_f64 / 17.0).powi(2);
        assert!((depth(5.0) - parabola).abs() < 1e-9);
        assert_eq!(depth(5.0), depth(-5.0));
    }

    #[test]
    fn the_profile_is_where_the_dose_is_the_critical_one() {
        let peak = mj(500.0);
        for y in [0.0, 3.0, 10.0] {
            let z = beam().cure_depth(peak, um(y), &lamp());
            let dose = beam().dose(peak, um(y), z, &lamp());
            assert!((dose.mj_per_cm2() - 131.5).abs() < 1e-9, "{y}: {dose}");
        }
        // Half the width W_o away there is 1/√e of the light.
        assert!((beam().share(um(8.5)).get() - (-0.5_f64).exp()).abs() < 1e-12);
    }

    #[test]
    fn more_dose_cures_wider_and_deeper() {
        // Figure 68.
        let doses = [140.0, 200.0, 400.0, 2000.0].map(mj);
        let widths = doses.map(|dose| beam().cured_width(dose, mj(131.5)));
        let depths = doses.map(|dose| beam().cure_depth(dose, um(1.0), &lamp()));
        assert!(widths.is_sorted_by(|a, b| a < b) && depths.is_sorted_by(|a, b| a < b));
        // Eq. 46: the resin's own scattering widens the beam.
        let scattered = GaussianBeam::new(um(60.0)).unwrap();
        assert!(scattered.cured_width(doses[1], mj(131.5)) > widths[1]);
    }

    #[test]
    fn a_beam_has_a_width() {
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(GaussianBeam::new(um(wrong)), Err(ModelError::NotPositive("beam-width")));
        }
    }
}
