//! The cure model of a resin whose penetration depth changes once it is solid.

use lamp_stack::Length;

use super::model::{CureError, CureModel, DepthRange, ModelError};
use super::plausible;
use super::units::Dose;
use super::working_curve::WorkingCurve;

/// The cure model with separate penetration depths of the liquid (`D_pL`) and the
/// solid (`D_pS`): `z = D_pS ln(D_pL/D_pS (E/E_c - 1) + 1)` (000
/// eq. 3.8 and 3.9, 003 eq. 2).
///
/// If both depths agree it is the Jacobs working curve; if the solid is almost clear,
/// the depth grows in proportion to the dose.
///
/// # Guarantees
/// All numbers are above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoDepth {
    critical_dose: Dose,
    liquid_depth: Length,
    solid_depth: Length,
    depths: DepthRange,
}

impl TwoDepth {
    /// Creates the model of a critical dose `E_c` and the penetration depths of liquid
    /// and solid. It holds for `depths`.
    ///
    /// # Errors
    /// Returns an error if a number is not above zero, or `depths` is empty.
    pub fn new(
        critical_dose: Dose,
        liquid_depth: Length,
        solid_depth: Length,
        depths: DepthRange,
    ) -> Result<Self, ModelError> {
        plausible::DOSE.check("critical-dose", critical_dose)?;
        plausible::DEPTH.check("liquid-depth", liquid_depth)?;
        plausible::SOLID_DEPTH.check("solid-depth", solid_depth)?;
        let begins = depths.from.um() >= 0.0 && depths.from.um().is_finite();
        if !begins || depths.to.is_some_and(|to| !(to > depths.from && to.um().is_finite())) {
            return Err(ModelError::NoDepths);
        }
        Ok(Self { critical_dose, liquid_depth, solid_depth, depths })
    }

    /// Returns the same equation for every depth.
    #[must_use]
    pub fn for_all_depths(self) -> Self {
        Self { depths: DepthRange::ALL, ..self }
    }

    /// Returns the critical dose `E_c`.
    pub fn critical_dose(&self) -> Dose {
        self.critical_dose
    }

    /// Returns the penetration depth of the liquid, `D_pL`.
    pub fn liquid_depth(&self) -> Length {
        self.liquid_depth
    }

    /// Returns the penetration depth of the solid, `D_pS`.
    pub fn solid_depth(&self) -> Length {
        self.solid_depth
    }
}

impl From<WorkingCurve> for TwoDepth {
    /// Returns the same curve: liquid and solid have one penetration depth.
    fn from(curve: WorkingCurve) -> Self {
        let (critical_dose, depth) = (curve.critical_dose(), curve.penetration_depth());
        let depths = DepthRange::ALL;
        Self { critical_dose, liquid_depth: depth, solid_depth: depth, depths }
    }
}

impl CureModel for TwoDepth {
    fn depth(&self, dose: Dose) -> Length {
        let above = dose.mj_per_cm2() / self.critical_dose.mj_per_cm2() - 1.0;
        let cures = above > 0.0;
        if !cures {
            // NaN also ends here.
            return Length::default();
        }
        let [liquid, solid] = [self.liquid_depth.um(), self.solid_depth.um()];
        // ln(1 + x): D_pL/D_pS of 3e-6 (000 appendix E) would drown beside 1.
        Length::from_um(solid * (liquid / solid * above).ln_1p())
    }

    /// 000 eq. 3.10.
    fn dose(&self, depth: Length) -> Result<Dose, CureError> {
        self.depths.check(depth)?;
        if depth.um() == 0.0 {
            return Ok(Dose::default());
        }
        let [liquid, solid] = [self.liquid_depth.um(), self.solid_depth.um()];
        // exp(x) - 1 in one step, as the logarithm above: for an almost clear solid x is far below
        // rounding of 1.
        let above = solid / liquid * (depth.um() / solid).exp_m1();
        let dose = self.critical_dose.mj_per_cm2() * (above + 1.0);
        if dose.is_finite() {
            Ok(Dose::from_mj_per_cm2(dose))
        } else {
            Err(CureError::NoDose(depth))
        }
    }

    fn depths(&self) -> DepthRange {
        self.depths
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::resin::{ExposureTime, Intensity, WorkingCurve, model_laws};

    fn model(mj: f64, liquid: f64, solid: f64) -> TwoDepth {
        let um = Length::from_um;
        TwoDepth::new(Dose::from_mj_per_cm2(mj), um(liquid), um(solid), DepthRange::ALL).unwrap()
    }

    #[test]
    fn it_is_the_equation() {
        // SL-5510 of 000 section 3.4.3.2 in eq. 3.8 as printed, by hand.
        let sl = model(4.0, 11.0, 15.0);
        for mj in [4.0, 8.0, 40.0, 400.0] {
            let z = 15.0 * (11.0 / 15.0 * mj / 4.0 + 1.0 - 11.0 / 15.0_f64).ln();
            let um = sl.depth(Dose::from_mj_per_cm2(mj)).um();
            assert!((um - z).abs() < 1e-9, "{mj}: {um} for {z}");
        }
        assert_eq!(sl.depth(Dose::from_mj_per_cm2(3.9)).um(), 0.0);
        // Eq. 3.10 as printed.
        let e = 4.0 * 15.0 / 11.0 * ((30.0 / 15.0_f64).exp() + 11.0 / 15.0 - 1.0);
        let dose = sl.dose(Length::from_um(30.0)).unwrap().mj_per_cm2();
        assert!((dose - e).abs() < 1e-9, "{dose} for {e}");
    }

    #[test]
    fn it_fits_the_points_that_appendix_a_lists() {
        // Appendix E's numbers are their least-squares fit: they leave hardly
        // more than the best line does, worked out apart from this code.
        let resin = model(11.593, 302.8253, 99995602.7076);
        let square = |(seconds, um): (f64, f64)| {
            let dose = Intensity::from_mw_per_cm2(0.2064) * ExposureTime::from_ms(1000.0 * seconds);
            (resin.depth(dose).um() - um).powi(2)
        };
        let squares: f64 = model_laws::APPENDIX_A.into_iter().map(square).sum();
        assert!((1346.2..1346.4).contains(&squares), "{squares}");
    }

    #[test]
    fn it_keeps_the_laws() {
        model_laws::hold(&model(4.0, 11.0, 15.0), 0.001..=300.0);
        model_laws::hold(&model(11.593, 302.8253, 99995602.7076), 0.001..=3000.0);
    }

    #[test]
    fn outside_its_depths_there_is_no_dose() {
        let depths = DepthRange { from: Length::from_um(180.0), to: Some(Length::from_um(620.0)) };
        let um = Length::from_um;
        let dose = Dose::from_mj_per_cm2(11.593);
        let model = TwoDepth::new(dose, um(302.8253), um(99995602.7076), depths).unwrap();
        for deep in [180.0, 620.0] {
            assert!(model.dose(um(deep)).is_ok());
        }
        for deep in [179.9, 620.1] {
            let outside = CureError::Outside { depth: um(deep), depths };
            assert_eq!(model.dose(um(deep)), Err(outside.clone()));
            assert_eq!(model.gray_for(um(deep), Dose::from_mj_per_cm2(1e3)), Err(outside));
        }
        // Nothing to cure is no shallow depth.
        assert_eq!(model.dose(um(0.0)), Ok(Dose::default()));
        let none = DepthRange { from: um(620.0), to: Some(um(180.0)) };
        assert_eq!(TwoDepth::new(dose, um(1.0), um(1.0), none), Err(ModelError::NoDepths));
    }

    proptest! {
        #[test]
        fn with_one_depth_it_is_the_working_curve(
            mj in 0.1..500.0f64, dp in 1.0..1000.0f64, times in 0.5..1e4f64,
        ) {
            let ec = Dose::from_mj_per_cm2(mj);
            let curve = WorkingCurve::new(ec, Length::from_um(dp)).unwrap();
            let (dose, model) = (Dose::from_mj_per_cm2(mj * times), model(mj, dp, dp));
            let [a, b] = [curve.depth(dose).um(), model.depth(dose).um()];
            prop_assert!((a - b).abs() <= 1e-9 * dp, "{} and {}", a, b);
        }
    }
}
