//! The cure model of a resin whose working curve changes with the gray level.

use lamp_stack::Length;

use super::model::{CureError, CureModel, ModelError, check_reach};
use super::plausible::{self, Plausible};
use super::units::{Dose, GrayLevel, Intensity, Quantity};
use super::working_curve::WorkingCurve;

/// A straight line `at_zero + rise x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StraightLine<T> {
    /// The value at zero.
    pub at_zero: T,
    /// The increase for one unit of `x`.
    pub rise: T,
}

impl<T: Quantity> StraightLine<T> {
    fn at(self, x: f64) -> T {
        T::of(self.at_zero.number() + self.rise.number() * x)
    }

    /// Checks the line of a parameter, given the keys of its numbers.
    ///
    /// With `E_c` and `D_p` that rise, the cure depth rises with the gray level wherever
    /// anything cures: `D_p` does, `G I_0 t / E_c(G)` does where `E_c(0) > 0`, and its
    /// logarithm is above zero there.
    fn check(
        self,
        range: Plausible<T>,
        at_zero: &'static str,
        rise: &'static str,
    ) -> Result<(), ModelError> {
        range.check(at_zero, self.at_zero)?;
        let no_fall = self.rise.number() >= 0.0 && self.rise.number().is_finite();
        if no_fall { Ok(()) } else { Err(ModelError::Falls(rise)) }
    }

    /// Returns the line over a unit that is `times` as large.
    fn over(self, times: f64) -> Self {
        Self { rise: T::of(self.rise.number() * times), ..self }
    }
}

/// The lines of `E_c` and `D_p`, over the gray level or the intensity.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ParameterLines {
    critical_dose: StraightLine<Dose>,
    penetration_depth: StraightLine<Length>,
}

impl ParameterLines {
    fn new(
        critical_dose: StraightLine<Dose>,
        penetration_depth: StraightLine<Length>,
    ) -> Result<Self, ModelError> {
        critical_dose.check(plausible::DOSE, "critical-dose.at-zero", "critical-dose.rise")?;
        penetration_depth.check(
            plausible::DEPTH,
            "penetration-depth.at-zero",
            "penetration-depth.rise",
        )?;
        Ok(Self { critical_dose, penetration_depth })
    }

    fn at(&self, x: f64) -> WorkingCurve {
        WorkingCurve::of_checked(self.critical_dose.at(x), self.penetration_depth.at(x))
    }
}

/// Returns a light in the units that a line's rise is for: W/cm², as in 002
/// eq. 36 to 38, whose slope of 18.31 ms is 18.31 mJ/cm² for each.
fn watts_per_cm2(light: Intensity) -> f64 {
    light.mw_per_cm2() / 1000.0
}

/// The working curve as a function of the intensity, for a dimmed lamp (002 eq. 36) or a
/// gray image (eq. 37 and 38).
///
/// # Guarantees
/// Every intensity has a working curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntensityLines(ParameterLines);

impl IntensityLines {
    /// Creates the lines of `E_c` and `D_p`, whose rise is for each W/cm².
    ///
    /// # Errors
    /// Returns an error if a line starts at no more than zero, or falls.
    pub fn new(
        critical_dose: StraightLine<Dose>,
        penetration_depth: StraightLine<Length>,
    ) -> Result<Self, ModelError> {
        ParameterLines::new(critical_dose, penetration_depth).map(Self)
    }

    /// Returns the working curve under a light.
    pub fn at(&self, light: Intensity) -> WorkingCurve {
        self.0.at(watts_per_cm2(light))
    }

    /// Returns the same lines over the gray levels of a lamp: `I = G I_0`
    /// (002 eq. 34).
    pub fn under(&self, lamp: Intensity) -> GrayCurve {
        let watts = watts_per_cm2(lamp);
        GrayCurve(ParameterLines {
            // A line a + b I over I = G I_0 is a + (b I_0) G over the gray level.
            critical_dose: self.0.critical_dose.over(watts),
            penetration_depth: self.0.penetration_depth.over(watts),
        })
    }
}

/// The working curve of each gray level: `C_d = D_p(G) ln(G I_0 t / E_c(G))`
/// (002 eq. 39 and 40), where `I_0 t` is the dose of white.
///
/// As a [`CureModel`], its doses are doses of full white.
///
/// # Guarantees
/// Every gray level has a working curve, and a whiter one cures deeper
/// wherever anything cures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrayCurve(ParameterLines);

impl GrayCurve {
    /// Creates the lines of `E_c` and `D_p`, whose rise is from black to white.
    ///
    /// # Errors
    /// Returns an error if a line starts at no more than zero, or falls.
    pub fn new(
        critical_dose: StraightLine<Dose>,
        penetration_depth: StraightLine<Length>,
    ) -> Result<Self, ModelError> {
        ParameterLines::new(critical_dose, penetration_depth).map(Self)
    }

    /// Returns the working curve of a gray level, over the dose that arrives.
    pub fn at(&self, gray: GrayLevel) -> WorkingCurve {
        self.0.at(gray.get())
    }
}

impl CureModel for GrayCurve {
    fn depth(&self, dose: Dose) -> Length {
        self.at(GrayLevel::WHITE).depth(dose)
    }

    fn dose(&self, depth: Length) -> Result<Dose, CureError> {
        self.at(GrayLevel::WHITE).dose(depth)
    }

    fn gray_depth(&self, gray: GrayLevel, white: Dose) -> Length {
        self.at(gray).depth(white * gray)
    }

    // Halves the bracket from black to white until no number lies between, about 60
    // logarithms. A greater depth never gives a darker level, not even by rounding:
    // both searches take the same steps until they part.
    fn gray_for(&self, depth: Length, white: Dose) -> Result<GrayLevel, CureError> {
        self.depths().check(depth)?;
        check_reach(depth, self.depth(white))?;
        if depth.um() == 0.0 {
            return Ok(GrayLevel::BLACK);
        }
        // `low` cures less deep than asked for, `high` at least as deep.
        let [mut low, mut high] = [0.0, 1.0];
        loop {
            let middle = f64::midpoint(low, high);
            // No number lies between two neighbors: their midpoint is one of them.
            if middle <= low || middle >= high {
                return Ok(GrayLevel::clamped(high));
            }
            if self.gray_depth(GrayLevel::clamped(middle), white) < depth {
                low = middle;
            } else {
                high = middle;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resin::{ExposureTime, model_laws};

    fn dose_line(at_zero: f64, rise: f64) -> StraightLine<Dose> {
        let [at_zero, rise] = [at_zero, rise].map(Dose::from_mj_per_cm2);
        StraightLine { at_zero, rise }
    }

    fn depth_line(at_zero: f64, rise: f64) -> StraightLine<Length> {
        let [at_zero, rise] = [at_zero, rise].map(Length::from_um);
        StraightLine { at_zero, rise }
    }

    /// 002 eq. 40.
    fn lamp() -> GrayCurve {
        GrayCurve::new(dose_line(101.8, 35.6), depth_line(193.1, 22.1)).unwrap()
    }

    const I0: Intensity = Intensity::from_mw_per_cm2(1600.0);

    #[test]
    fn equation_40_at_the_levels_of_figure_63() {
        // D_p(G), E_c(G) and C_d after 600 ms, worked out with bc.
        for (g, dp, ec, um) in [
            (0.2, 197.52, 108.92, 111.970474),
            (0.4, 201.94, 116.04, 241.663131),
            (0.5, 204.15, 119.60, 283.693631),
            (1.0, 215.20, 137.40, 418.356742),
        ] {
            let gray = GrayLevel::new(g).unwrap();
            let curve = lamp().at(gray);
            assert!((curve.penetration_depth().um() - dp).abs() < 1e-9, "{g}");
            assert!((curve.critical_dose().mj_per_cm2() - ec).abs() < 1e-9, "{g}");
            let white = I0 * ExposureTime::from_ms(600.0);
            let found = lamp().gray_depth(gray, white);
            assert!((found.um() - um).abs() < 1e-6, "{g}: {found}");
            let back = lamp().gray_for(found, white).unwrap();
            assert!((back.get() - g).abs() < 1e-12, "{back:?}");
        }
    }

    #[test]
    fn equations_36_to_38() {
        let watts = |w: f64| Intensity::from_mw_per_cm2(1000.0 * w);
        // Eq. 36 with the D_p that stays; eq. 37 and 38.
        let dimmed = IntensityLines::new(dose_line(109.0, 18.31), depth_line(211.0, 0.0)).unwrap();
        let gray = IntensityLines::new(dose_line(103.7, 19.6), depth_line(194.8, 11.3)).unwrap();
        for (w, of_dimmed, of_gray, dp) in [
            (0.512, 118.37472, 113.7352, 200.5856),
            (0.896, 125.40576, 121.2616, 204.9248),
            (1.6, 138.296, 135.06, 212.88),
        ] {
            let curve = dimmed.at(watts(w));
            assert!((curve.critical_dose().mj_per_cm2() - of_dimmed).abs() < 1e-9, "{w}");
            assert_eq!(curve.penetration_depth().um(), 211.0);
            let curve = gray.at(watts(w));
            assert!((curve.critical_dose().mj_per_cm2() - of_gray).abs() < 1e-9, "{w}");
            assert!((curve.penetration_depth().um() - dp).abs() < 1e-9, "{w}");
            // The same under the lamp's gray level.
            let level = GrayLevel::new(w / 1.6).unwrap();
            let same = gray.under(I0).at(level);
            let [a, b] = [same, curve].map(|c| c.critical_dose().mj_per_cm2());
            assert!((a - b).abs() < 1e-9);
            let [a, b] = [same, curve].map(|c| c.penetration_depth().um());
            assert!((a - b).abs() < 1e-9);
        }
    }

    #[test]
    fn it_keeps_the_laws() {
        model_laws::hold(&lamp(), 0.001..=3000.0);
        // Flat lines are the working curve.
        let flat = GrayCurve::new(dose_line(131.5, 0.0), depth_line(211.0, 0.0)).unwrap();
        model_laws::hold(&flat, 0.001..=3000.0);
        let white = Dose::from_mj_per_cm2(320.0);
        let curve = flat.at(GrayLevel::WHITE);
        for um in [1.0, 50.0, 187.0] {
            let [a, b] = [
                flat.gray_for(Length::from_um(um), white).unwrap(),
                curve.gray_for(Length::from_um(um), white).unwrap(),
            ];
            assert!((a.get() - b.get()).abs() < 1e-12, "{um}: {a:?} {b:?}");
        }
    }

    #[test]
    fn levels_rise_with_the_depth_without_a_break() {
        let white = I0 * ExposureTime::from_ms(200.0);
        let deepest = lamp().depth(white);
        let level = |i: i32| {
            let um = deepest.um() * f64::from(i) / 20_000.0;
            lamp().gray_for(Length::from_um(um), white).unwrap().get()
        };
        let levels: Vec<f64> = (1..=20_000).map(level).collect();
        assert!(levels.windows(2).all(|pair| pair[0] < pair[1]));
        // The level that only just cures: E_c(G) = G I_0 t.
        let least = 101.8 / (320.0 - 35.6);
        assert!(levels[0] > least && levels[0] < least + 1e-4, "{}", levels[0]);
        assert!((levels[19_999] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_depth_that_no_gray_level_cures_is_an_error() {
        let depth = Length::from_um(100.0);
        // 80 ms at 1.6 W/cm² are 128 mJ/cm²: below E_c even of white.
        for (ms, deepest) in [(80.0, 0.0), (120.0, 72.005703)] {
            let white = I0 * ExposureTime::from_ms(ms);
            let Err(CureError::TooDeep { depth: of, deepest: um }) = lamp().gray_for(depth, white)
            else {
                panic!("{ms} ms cure {depth}");
            };
            assert_eq!(of, depth);
            assert!((um.um() - deepest).abs() < 1e-6, "{um}");
        }
        let white = I0 * ExposureTime::from_ms(600.0);
        for um in [-1.0, f64::NAN, f64::INFINITY] {
            let error = lamp().gray_for(Length::from_um(um), white);
            assert!(matches!(error, Err(CureError::NotADepth(_))), "{um}");
        }
    }

    #[test]
    fn lines_that_fall_make_no_model() {
        let fine = (dose_line(101.8, 35.6), depth_line(193.1, 22.1));
        for (dose, depth, error) in [
            (dose_line(0.0, 1.0), fine.1, ModelError::NotPositive("critical-dose.at-zero")),
            (dose_line(1.0, -0.1), fine.1, ModelError::Falls("critical-dose.rise")),
            (fine.0, depth_line(-1.0, 9.0), ModelError::NotPositive("penetration-depth.at-zero")),
            (fine.0, depth_line(1.0, f64::NAN), ModelError::Falls("penetration-depth.rise")),
        ] {
            assert_eq!(GrayCurve::new(dose, depth), Err(error));
            assert_eq!(IntensityLines::new(dose, depth), Err(error));
        }
    }
}
