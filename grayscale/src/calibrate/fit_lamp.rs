//! Fits the working curve over the lamp's light to measured cure depths.

use lamp_stack::Length;

use super::curve_lines::{CRITICAL_DOSE, CurveLinesFit, LinePoint, PENETRATION_DEPTH};
use super::extent::Extent;
use super::fit_gray::{LineEstimate, given, line};
use super::measurements::LampPoint;
use super::{Estimate, FitError};
use crate::material::{CurveNumbers, DimmedLines, GivenRange};
use crate::resin::{Dose, Intensity};

/// The working curve over the lamp's light, found from measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct LampFit {
    /// The lights and the number of points under each, from the weakest.
    pub lights: Vec<(Intensity, usize)>,
    /// `E_c(I)`, at no light and its rise for each W/cm².
    pub critical_dose: LineEstimate<Dose>,
    /// `D_p`, of all lights.
    pub penetration_depth: Estimate<Length>,
    /// The share of the depths' scatter that the curve explains.
    pub r2: f64,
    extent: Option<Extent>,
    lines: CurveLinesFit,
}

/// Fits `C_d = D_p ln(E/E_c(I))` with a line `E_c(I)` (002 eq. 36) and one penetration depth to the
/// films under all lights at once, by nonlinear least squares.
///
/// Intervals are computed as in [`fit_gray`](super::fit_gray), and a line that falls is treated
/// alike.
///
/// # Errors
/// Returns an error if there are fewer than two lights or too few points, or if the line falls by
/// more than its interval or begins at zero or less.
pub fn fit_lamp(points: &[LampPoint]) -> Result<LampFit, FitError> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.lamp.mw_per_cm2().total_cmp(&b.lamp.mw_per_cm2()));
    let lights: Vec<_> = sorted
        .chunk_by(|a, b| a.lamp == b.lamp)
        .map(|group| (group[0].lamp, group.len()))
        .collect();
    if lights.len() < 2 {
        return Err(FitError::TooFewLights(lights.len()));
    }
    let point = |p: &LampPoint| LinePoint {
        // 002 eq. 36 is over W/cm².
        x: p.lamp.mw_per_cm2() / 1000.0,
        log_dose: p.film.arriving().mj_per_cm2().ln(),
        depth: p.film.depth.um(),
    };
    let points: Vec<_> = sorted.iter().map(point).collect();
    let sloped = CurveLinesFit::new(&points, [true, true, true, false])?;
    let falls = sloped.numbers[CRITICAL_DOSE + 1] < 0.0;
    let lines =
        // The model takes no falling line (`StraightLine`): it is kept level, if its fall is within
        // the interval.
        if falls { CurveLinesFit::new(&points, [true, false, true, false])? } else { sloped };
    let half = lines.half(PENETRATION_DEPTH);
    let films: Vec<_> = sorted.iter().map(|point| point.film).collect();
    Ok(LampFit {
        lights,
        critical_dose: line(&sloped, &lines, CRITICAL_DOSE, "the critical dose")?,
        penetration_depth: Estimate::even(lines.numbers[PENETRATION_DEPTH], half),
        r2: lines.r2,
        extent: Extent::of_depths(&films),
        lines,
    })
}

impl LampFit {
    /// Returns the depth of a dose under a light, with its 95% interval. It is below zero up to
    /// the critical dose.
    pub fn depth(&self, lamp: Intensity, dose: Dose) -> Estimate<Length> {
        let [depth, half] = self.lines.depth(lamp.mw_per_cm2() / 1000.0, dose.mj_per_cm2().ln());
        Estimate::even(depth, half)
    }

    /// Returns `E_c` under a light.
    pub fn critical_dose_at(&self, lamp: Intensity) -> Dose {
        let [at_zero, rise] = [self.critical_dose.at_zero, self.critical_dose.rise];
        let watts = lamp.mw_per_cm2() / 1000.0;
        Dose::from_mj_per_cm2(at_zero.value.mj_per_cm2() + rise.value.mj_per_cm2() * watts)
    }

    /// Returns the lines for a material file.
    pub fn lines(&self, source: &str) -> DimmedLines {
        DimmedLines {
            critical_dose: given(&self.critical_dose, source),
            penetration_depth: Some(self.penetration_depth.given(source)),
            lights: GivenRange::of(self.lights.iter().map(|light| light.0)),
        }
    }

    /// Returns the working curve of the brightest light for a material file that has none.
    pub fn brightest(&self, source: &str) -> CurveNumbers {
        let lamp = self.lights[self.lights.len() - 1].0;
        let critical = self.critical_dose_at(lamp).mj_per_cm2();
        // The band of the depth meets zero by the slope of the curve there.
        let [_, half] = self.lines.depth(lamp.mw_per_cm2() / 1000.0, critical.ln());
        // A depth off by `half` is a dose off by half / D_p e-folds (002 eq. 30).
        let folds = (half / self.penetration_depth.value.um()).exp();
        let source = format!("{source}; at {} mW/cm2", lamp.mw_per_cm2());
        CurveNumbers {
            critical_dose: Estimate::new(critical, critical / folds, critical * folds)
                .given(&source),
            penetration_depth: self.penetration_depth.given(&source),
            measured: self.extent.map(|extent| extent.measured(&source)),
        }
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;

    use super::super::DepthPoint;
    use super::super::made_up::share_held;
    use super::*;
    use crate::resin::GrayLevel;

    /// Films of 002 eq. 36 under the lights of its filters, measured to `spread` um.
    fn films(spread: f64, seed: u64) -> Vec<LampPoint> {
        let mut noise = SplitMix(seed);
        let mut films = Vec::new();
        for mw in [512.0, 896.0, 1600.0] {
            for mj in [320.0, 480.0, 640.0, 960.0, 1280.0, 1920.0_f64] {
                let critical = 109.0 + 18.31 * mw / 1000.0;
                let um = 211.0 * (mj / critical).ln() + spread * noise.normal();
                films.push(LampPoint {
                    lamp: Intensity::from_mw_per_cm2(mw),
                    film: DepthPoint {
                        gray: GrayLevel::WHITE,
                        dose: Dose::from_mj_per_cm2(mj),
                        depth: Length::from_um(um),
                    },
                });
            }
        }
        films
    }

    #[test]
    fn exact_films_give_equation_36_back() {
        let fit = fit_lamp(&films(0.0, 1)).unwrap();
        let near = |found: f64, wanted: f64| assert!((found - wanted).abs() < 1e-6, "{found}");
        near(fit.critical_dose.at_zero.value.mj_per_cm2(), 109.0);
        near(fit.critical_dose.rise.value.mj_per_cm2(), 18.31);
        near(fit.penetration_depth.value.um(), 211.0);
        near(fit.critical_dose_at(Intensity::from_mw_per_cm2(896.0)).mj_per_cm2(), 125.40576);
        let lines = fit.lines("a test");
        let lights = lines.lights.unwrap();
        assert_eq!((lights.from.mw_per_cm2(), lights.to.mw_per_cm2()), (512.0, 1600.0));
        assert_eq!(fit.brightest("a test").critical_dose.value.mj_per_cm2(), 138.296);
    }

    #[test]
    fn of_100_intervals_95_hold_the_truth() {
        let fits = (0..2000).map(|seed| fit_lamp(&films(1.0, seed << 20)));
        let held = share_held(fits, |fit| {
            let critical = fit.brightest("a test").critical_dose;
            let half = critical.plus_minus.unwrap().mj_per_cm2();
            [
                fit.critical_dose.at_zero.holds(Dose::from_mj_per_cm2(109.0)),
                fit.critical_dose.rise.holds(Dose::from_mj_per_cm2(18.31)),
                fit.penetration_depth.holds(Length::from_um(211.0)),
                (critical.value.mj_per_cm2() - 138.296).abs() <= half,
            ]
        });
        // 95% +- 1.5% is three standard deviations of 2000 trials.
        assert!(held.iter().all(|share| (share - 0.95).abs() < 0.0147), "{held:?}");
    }

    #[test]
    fn one_light_tells_no_line() {
        let films = films(1.0, 3);
        assert_eq!(fit_lamp(&films[..6]), Err(FitError::TooFewLights(1)));
    }
}
