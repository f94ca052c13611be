//! Neutral density filters in front of the lamp.

use super::units::Intensity;

/// The optical density of a filter, equal at all wavelengths: `OD = log10(I_o/I)`
/// (002 eq. 35).
///
/// By this equation the filters of 0.3 and 0.5 in 002 pass 50.1% and 31.6% of
/// 1600 mW/cm²: 802 and 506 mW/cm². 002 itself continues with 896 and 512 mW/cm².
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct OpticalDensity(f64);

impl OpticalDensity {
    /// Returns the density `od` if it is zero or more.
    pub fn new(od: f64) -> Option<Self> {
        // A filter passes no more light than it gets.
        (od >= 0.0 && od.is_finite()).then_some(Self(od))
    }

    /// Returns the density of a filter that passes `passed` of `light`; `None` if that is
    /// more than `light`, or no light at all.
    pub fn of(light: Intensity, passed: Intensity) -> Option<Self> {
        Self::new((light.mw_per_cm2() / passed.mw_per_cm2()).log10())
    }

    /// Returns the density as a number.
    pub const fn get(self) -> f64 {
        self.0
    }

    /// Returns the part of a light that passes.
    pub fn pass(self, light: Intensity) -> Intensity {
        Intensity::from_mw_per_cm2(light.mw_per_cm2() * 10.0_f64.powf(-self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_filters_of_section_3_3_8() {
        let lamp = Intensity::from_mw_per_cm2(1600.0);
        // 50.1% and 31.6%; worked out with bc.
        for (od, mw) in [(0.0, 1600.0), (0.3, 801.899574), (0.5, 505.964426)] {
            let filter = OpticalDensity::new(od).unwrap();
            let passed = filter.pass(lamp);
            assert!((passed.mw_per_cm2() - mw).abs() < 1e-6, "{od}: {passed}");
            let found = OpticalDensity::of(lamp, passed).unwrap();
            assert!((found.get() - od).abs() < 1e-12);
        }
        // The number that 002 continues with belongs to another filter.
        let printed = OpticalDensity::of(lamp, Intensity::from_mw_per_cm2(896.0)).unwrap();
        assert!((printed.get() - 0.251812).abs() < 1e-6);
    }

    #[test]
    fn a_filter_adds_no_light() {
        let [dim, bright] = [1.0, 2.0].map(Intensity::from_mw_per_cm2);
        assert_eq!(OpticalDensity::of(dim, bright), None);
        assert_eq!(OpticalDensity::of(dim, Intensity::default()), None);
        for od in [-0.1, f64::NAN, f64::INFINITY] {
            assert_eq!(OpticalDensity::new(od), None);
        }
    }
}
