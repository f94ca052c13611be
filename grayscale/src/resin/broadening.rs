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

/// Returns how many times its own dose the lowest of `layers` equal layers gets at its top, light fading
/// by e over `penetration_depth`: `1 + q + q² + ...`, with `q = exp(-thickness/D_p)`, as `lamp cure` adds
/// doses up (002 section 3.4.8 a). `None` is any number of layers.
pub fn summed_doses(thickness: Length, penetration_depth: Length, layers: Option<u32>) -> f64 {
    let fades = -thickness.um() / penetration_depth.um();
    // expm1 keeps the digits of layers that are thin for the light.
    let all = layers.map_or(1.0, |layers| -(fades * f64::from(layers)).exp_m1());
    all / -fades.exp_m1()
}

#[cfg(test)]
mod tests {
    use lamp_stack::Catalogued;

    use super::*;
    use crate::SummedLine;
    use crate::material::Material;
    use crate::resin::WorkingCurve;

    #[test]
    fn doses_of_layers_sum_as_in_lamp_cure() {
        let material = Material::builtin("lamp-suspension").unwrap();
        let (thickness, depth) = (Length::from_um(100.0), material.white_depth().unwrap().unwrap());
        let time = material.resin().unwrap().exposure_time(thickness, 1.0).unwrap();
        for layers in [1, 2, 5, 30] {
            let mut line = SummedLine::new(material.fading().unwrap(), 1);
            for layer in 0..layers {
                let bottom = Length::from_um(1000.0 + 100.0 * f64::from(layer));
                line.expose(vec![(0, 1, 255)], bottom, thickness, time);
            }
            // White just cures the lowest layer; the sum cures D_p ln of itself deeper.
            let deeper = 1000.0 - line.cured(0.0)[0][0][0];
            let wanted = depth.um() * summed_doses(thickness, depth, Some(layers)).ln();
            assert!((deeper - wanted).abs() < 2e-3, "{layers}: {deeper} for {wanted}");
        }
        let many = summed_doses(thickness, depth, Some(1000));
        assert!((many / summed_doses(thickness, depth, None) - 1.0).abs() < 1e-12);
    }

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
