//! The working curve of stereolithography.

use lamp_stack::Length;

use super::model::{CureError, CureModel, ModelError};
use super::plausible;
use super::units::Dose;

/// The Jacobs working curve `C_d = D_p ln(E / E_c)` (002 eq. 30).
///
/// ```
/// use lamp_grayscale::resin::{CureModel, Dose, WorkingCurve};
/// use lamp_stack::Length;
///
/// let curve = WorkingCurve::new(Dose::from_mj_per_cm2(131.5), Length::from_um(211.0))?;
/// let depth = curve.depth(Dose::from_mj_per_cm2(320.0));
/// assert_eq!(depth.um().round(), 188.0);
/// # Ok::<(), lamp_grayscale::resin::ModelError>(())
/// ```
///
/// # Guarantees
/// Both numbers are above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkingCurve {
    critical_dose: Dose,
    penetration_depth: Length,
}

impl WorkingCurve {
    /// Creates the curve of a critical dose `E_c` and a penetration depth `D_p`, which 002
    /// calls the sensitivity.
    ///
    /// # Errors
    /// Returns an error if either is not above zero.
    pub fn new(critical_dose: Dose, penetration_depth: Length) -> Result<Self, ModelError> {
        plausible::DOSE.check("critical-dose", critical_dose)?;
        plausible::DEPTH.check("penetration-depth", penetration_depth)?;
        Ok(Self { critical_dose, penetration_depth })
    }

    /// Creates the curve of numbers that a model has checked.
    pub(super) const fn of_checked(critical_dose: Dose, penetration_depth: Length) -> Self {
        Self { critical_dose, penetration_depth }
    }

    /// Returns the dose at which the resin begins to gel, `E_c`.
    pub const fn critical_dose(&self) -> Dose {
        self.critical_dose
    }

    /// Returns the depth over which the dose falls to 1/e, `D_p`.
    pub const fn penetration_depth(&self) -> Length {
        self.penetration_depth
    }
}

impl CureModel for WorkingCurve {
    fn depth(&self, dose: Dose) -> Length {
        let ratio = dose.mj_per_cm2() / self.critical_dose.mj_per_cm2();
        // NaN also ends here.
        let cured = if ratio > 1.0 { ratio.ln() } else { 0.0 };
        Length::from_um(self.penetration_depth.um() * cured)
    }

    fn dose(&self, depth: Length) -> Result<Dose, CureError> {
        self.depths().check(depth)?;
        // The equation would give E_c, where resin just gels. Nothing is wanted, so that no light
        // is needed.
        if depth.um() == 0.0 {
            return Ok(Dose::default());
        }
        // 002 eq. 29, solved for the dose at the surface: E = E_c exp(C_d / D_p).
        let times = (depth.um() / self.penetration_depth.um()).exp();
        let dose = self.critical_dose.mj_per_cm2() * times;
        if dose.is_finite() {
            Ok(Dose::from_mj_per_cm2(dose))
        } else {
            Err(CureError::NoDose(depth))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resin::model_laws;

    fn curve(mj: f64, um: f64) -> WorkingCurve {
        WorkingCurve::new(Dose::from_mj_per_cm2(mj), Length::from_um(um)).unwrap()
    }

    #[test]
    fn points_of_the_working_curve() {
        // 002 section 3.3.5: D_p is the slope over ln E and E_c the intercept.
        let lamp = curve(131.5, 211.0);
        let um = |mj| lamp.depth(Dose::from_mj_per_cm2(mj)).um();
        assert_eq!(um(131.5), 0.0);
        assert_eq!(um(100.0), 0.0);
        assert_eq!(um(f64::NAN), 0.0);
        assert!((um(131.5 * std::f64::consts::E) - 211.0).abs() < 1e-9);
        // Its exposures of 200 ms and 1200 ms, worked out with bc.
        assert!((um(320.0) - 187.645284).abs() < 1e-6, "{}", um(320.0));
        assert!((um(1920.0) - 565.706532).abs() < 1e-6, "{}", um(1920.0));
        // Section 3.4.4: two decades of dose are D_p ln 100.
        let clear = curve(39.4, 638.51);
        let um = clear.depth(Dose::from_mj_per_cm2(3940.0)).um();
        assert!((um - 2940.447215).abs() < 1e-6, "{um}");
    }

    #[test]
    fn it_keeps_the_laws() {
        for curve in [curve(131.5, 211.0), curve(39.4, 638.51), curve(8.9, 122.0)] {
            model_laws::hold(&curve, 0.001..=3000.0);
        }
    }

    #[test]
    fn what_no_dose_cures_is_an_error() {
        let lamp = curve(131.5, 211.0);
        let dose = |um| lamp.dose(Length::from_um(um));
        assert_eq!(dose(-1.0), Err(CureError::NotADepth(Length::from_um(-1.0))));
        assert!(matches!(dose(f64::NAN), Err(CureError::NotADepth(_))));
        assert!(matches!(dose(f64::INFINITY), Err(CureError::NotADepth(_))));
        assert_eq!(dose(1e6), Err(CureError::NoDose(Length::from_um(1e6))));
    }

    #[test]
    fn nonsense_makes_no_curve() {
        let make = |mj, um| WorkingCurve::new(Dose::from_mj_per_cm2(mj), Length::from_um(um));
        for mj in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(make(mj, 211.0), Err(ModelError::NotPositive("critical-dose")));
            assert_eq!(make(131.5, mj), Err(ModelError::NotPositive("penetration-depth")));
        }
    }
}
