//! The depth from which a resin cures wider, too.

use lamp_stack::Length;

use super::model::CureModel;
use super::units::Dose;

/// Returns the distance of a cured square's edges outside its image: `C_w =
/// (l_cured - l_o)/2` (002 eq. 60). It is below zero if the square shrank.
pub fn cure_width_of_square(cured: Length, nominal: Length) -> Length {
    Length::from_um((cured.um() - nominal.um()) / 2.0)
}

/// Returns the broadening depth `B_d = D_p^d ln(E_c^w/E_c^d)` (002 eq. 61): the
/// greatest depth that cures before edges grow. `width_critical` is `E_c^w`, the dose from
/// which they grow. Any cure model may stand in place of the working curve.
///
/// It is zero if edges grow before anything cures in depth, where eq. 61 is below zero.
pub fn broadening_depth(depth: &dyn CureModel, width_critical: Dose) -> Length {
    // 002 eq. 61 is the cure depth (eq. 30) of the dose at which edges begin to grow.
    depth.depth(width_critical)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resin::WorkingCurve;

    #[test]
    fn equation_60() {
        // 25 pixels of 1/1500 in that came out 450 um wide, and 420 um.
        let nominal = Length::from_um(25.0 * 25_400.0 / 1500.0);
        let width = |um| cure_width_of_square(Length::from_um(um), nominal).um();
        assert!((width(450.0) - 13.333333).abs() < 1e-6);
        assert!((width(420.0) + 1.666667).abs() < 1e-6);
    }

    #[test]
    fn equation_61_with_the_curve_of_figure_78() {
        let curve =
            WorkingCurve::new(Dose::from_mj_per_cm2(39.4), Length::from_um(638.51)).unwrap();
        let depth = |mj| broadening_depth(&curve, Dose::from_mj_per_cm2(mj)).um();
        // Worked out with bc.
        for (mj, um) in [(39.4, 0.0), (60.0, 268.543735), (80.0, 452.231615), (120.0, 711.125141)] {
            assert!((depth(mj) - um).abs() < 1e-5, "{mj}: {}", depth(mj));
        }
        assert_eq!(depth(20.0), 0.0);
    }
}
