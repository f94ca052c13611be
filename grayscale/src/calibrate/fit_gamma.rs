//! Fits how much light a gray level passes to measured cure depths.

use lamp_stack::{Length, round_significant};

use super::extent::Extent;
use super::matrix::{inverse, product};
use super::measurements::DepthPoint;
use super::student_t::t_95;
use super::{Estimate, FitError, given_number};
use crate::material::{CurveNumbers, GivenNumber};
use crate::resin::{Dose, GrayLevel, plausible};

/// The exponent of light over the gray level, and the working curve behind it, found from films.
#[derive(Clone, Debug, PartialEq)]
pub struct GammaFit {
    /// `γ`: its value, and the ends of its interval.
    pub gamma: [f64; 3],
    /// `E_c`.
    pub critical_dose: Estimate<Dose>,
    /// `D_p`.
    pub penetration_depth: Estimate<Length>,
    /// The share of the depths' scatter that the model explains.
    pub r2: f64,
    /// The number of points.
    pub points: usize,
    extent: Option<Extent>,
}

/// The fewest films: one more than numbers.
const FEWEST: usize = 4;
/// The fewest gray levels: two would hide that light is no power of them.
const FEWEST_LEVELS: usize = 3;

/// Fits `C_d = D_p ln(E G^γ / E_c)`, with the dose of white `E` and the gray level `G` (001 eq. 10), by
/// linear regression of the depth on the logarithms of dose and level.
///
/// The interval of `D_p` is the slope's, by Student's t. The intervals of `γ` and `E_c` come from Fieller's
/// theorem, and are not symmetric.
///
/// # Errors
/// Returns an error if there are too few points, doses or levels, if the depth does not clearly rise with
/// the dose and the level, or if the critical dose is not plausible.
pub fn fit_gamma(points: &[DepthPoint]) -> Result<GammaFit, FitError> {
    if points.len() < FEWEST {
        return Err(FitError::TooFew { points: points.len(), needed: FEWEST });
    }
    let distinct = |of: fn(&DepthPoint) -> f64| {
        let mut all: Vec<f64> = points.iter().map(of).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all.len()
    };
    if distinct(|point| point.gray.get()) < FEWEST_LEVELS {
        return Err(FitError::TooFewLevels(distinct(|point| point.gray.get())));
    }
    let doses = distinct(|point| point.dose.mj_per_cm2());
    if doses < 2 {
        return Err(FitError::TooFewDoses { doses, needed: 2 });
    }
    let count = points.len() as f64;
    let row = |point: &DepthPoint| {
        [point.dose.mj_per_cm2().ln(), point.gray.get().ln(), point.depth.um()]
    };
    let rows: Vec<[f64; 3]> = points.iter().map(row).collect();
    let means: [f64; 3] =
        std::array::from_fn(|k| rows.iter().map(|row| row[k]).sum::<f64>() / count);
    let sum = |i: usize, j: usize| -> f64 {
        rows.iter().map(|row| (row[i] - means[i]) * (row[j] - means[j])).sum()
    };
    // Where each dose has one level, neither has a slope of its own.
    let spread = inverse([[sum(0, 0), sum(0, 1)], [sum(0, 1), sum(1, 1)]]);
    let spread = spread.ok_or(FitError::NoLines)?;
    let [rise, of_gray] = product(&spread, &[sum(0, 2), sum(1, 2)]);
    let misses = rows
        .iter()
        .map(|row| row[2] - means[2] - rise * (row[0] - means[0]) - of_gray * (row[1] - means[1]));
    let left: f64 = misses.map(|miss| miss * miss).sum();
    let times2 = t_95(points.len() - 3).powi(2) * left / (count - 3.0);
    let [rise2, both, gray2] = [spread[0][0], spread[0][1], spread[1][1]].map(|it| it * times2);
    let half = rise2.sqrt();
    let unit = "um for each e-fold of dose";
    if rise < -half {
        return Err(FitError::Falls { slope: rise, unit });
    }
    if rise <= half {
        return Err(FitError::Scatters { slope: rise, half, unit });
    }
    let gamma = ratio([of_gray, rise], [gray2, both, rise2]);
    if gamma[1] <= 0.0 {
        let (what, half, unit) = ("gamma", gamma[0] - gamma[1], "as an exponent");
        return Err(FitError::Vague { what, value: gamma[0], half, unit });
    }
    // White cures nothing where the plane meets zero.
    let white = [of_gray * means[1] - means[2], rise];
    let white2 = [times2 / count + means[1] * means[1] * gray2, means[1] * both, rise2];
    let [critical, low, high] = ratio(white, white2).map(|log| (log + means[0]).exp());
    if !plausible::DOSE.contains(&Dose::from_mj_per_cm2(critical)) {
        return Err(FitError::NoCriticalDose(critical));
    }
    let passed = |point: &DepthPoint| {
        let dose = point.dose.mj_per_cm2() * point.gray.get().powf(gamma[0]);
        DepthPoint { dose: Dose::from_mj_per_cm2(round_significant(dose, 6)), ..*point }
    };
    let all = sum(2, 2);
    Ok(GammaFit {
        gamma,
        critical_dose: Estimate::new(critical, low, high),
        penetration_depth: Estimate::even(rise, half),
        r2: if all > 0.0 { 1.0 - left / all } else { 0.0 },
        points: points.len(),
        extent: Extent::of_depths(&points.iter().map(passed).collect::<Vec<_>>()),
    })
}

/// Returns the ratio of two numbers and its interval by Fieller's theorem: every ratio `r` for which the
/// interval of `p - r q` holds zero. `p2` and `q2` are the squares of half their intervals, and `both` is the
/// same of their covariance.
fn ratio([p, q]: [f64; 2], [p2, both, q2]: [f64; 3]) -> [f64; 3] {
    let (square, middle) = (q * q - q2, p * q - both);
    let root = (middle * middle - square * (p * p - p2)).max(0.0).sqrt();
    [p / q, (middle - root) / square, (middle + root) / square]
}

impl GammaFit {
    /// Returns the depth that a dose of white cures through a gray level. It is below zero where nothing
    /// cures.
    pub fn depth(&self, gray: GrayLevel, dose: Dose) -> Length {
        let passed = dose.mj_per_cm2().ln() + self.gamma[0] * gray.get().ln();
        let over = passed - self.critical_dose.value.mj_per_cm2().ln();
        Length::from_um(self.penetration_depth.value.um() * over)
    }

    /// Returns the exponent for a material file.
    pub fn gamma_number(&self, source: &str) -> GivenNumber {
        given_number(self.gamma, source)
    }

    /// Returns the working curve for a material file.
    pub fn curve(&self, source: &str) -> CurveNumbers {
        CurveNumbers {
            critical_dose: self.critical_dose.given(source),
            penetration_depth: self.penetration_depth.given(source),
            measured: self.extent.map(|extent| extent.measured(source)),
        }
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;

    use super::super::fit_curve;
    use super::super::made_up::share_held;
    use super::*;

    /// Depths of `D_p`, `E_c` and `γ` at levels and doses, each with an error in um.
    fn films(
        [depth, critical, gamma]: [f64; 3],
        doses: &[f64],
        mut error: impl FnMut() -> f64,
    ) -> Vec<DepthPoint> {
        let mut points = Vec::new();
        for gray in [1.0, 0.75, 0.5, 0.25] {
            for dose in doses {
                let um = depth * (dose * f64::powf(gray, gamma) / critical).ln() + error();
                points.push(DepthPoint {
                    gray: GrayLevel::new(gray).unwrap(),
                    dose: Dose::from_mj_per_cm2(*dose),
                    depth: Length::from_um(um),
                });
            }
        }
        points
    }

    const TRUTH: [f64; 3] = [125.0, 20.0, 1.8];
    const DOSES: [f64; 3] = [400.0, 800.0, 1600.0];

    #[test]
    fn exact_films_give_the_numbers_back() {
        let points = films(TRUTH, &DOSES, || 0.0);
        let fit = fit_gamma(&points).unwrap();
        assert!((fit.gamma[0] - 1.8).abs() < 1e-9 && fit.r2 > 1.0 - 1e-12, "{fit:?}");
        assert!((fit.critical_dose.value.mj_per_cm2() - 20.0).abs() < 1e-7, "{fit:?}");
        assert!((fit.penetration_depth.value.um() - 125.0).abs() < 1e-8, "{fit:?}");
        for point in &points {
            let off = fit.depth(point.gray, point.dose).um() - point.depth.um();
            assert!(off.abs() < 1e-7, "{point:?}: {off}");
        }
        // The doses that arrive, and their depths.
        let measured = fit.curve("a test").measured.unwrap();
        assert!((measured.doses.from.mj_per_cm2() - 400.0 * 0.25_f64.powf(1.8)).abs() < 1e-3);
        assert_eq!(measured.doses.to.mj_per_cm2(), 1600.0);
        // White films alone have this working curve.
        let white = fit_curve(&points[..3]).unwrap();
        assert!((white.penetration_depth.value.um() - 125.0).abs() < 1e-8);
    }

    #[test]
    fn of_100_intervals_95_hold_the_truth() {
        for spread in [5.0, 20.0] {
            let mut noise = SplitMix(9);
            let fits = std::iter::from_fn(|| {
                Some(fit_gamma(&films(TRUTH, &DOSES, || spread * noise.normal())))
            });
            let held = share_held(fits.take(4000), |fit| {
                [
                    (fit.gamma[1]..=fit.gamma[2]).contains(&1.8),
                    fit.critical_dose.holds(Dose::from_mj_per_cm2(20.0)),
                    fit.penetration_depth.holds(Length::from_um(125.0)),
                ]
            });
            // 95% +- 1% is three standard deviations of 4000 trials.
            assert!(held.iter().all(|share| (share - 0.95).abs() < 0.0104), "{spread}: {held:?}");
        }
    }

    #[test]
    fn films_that_show_too_little_are_refused() {
        let all = films(TRUTH, &DOSES, || 0.0);
        assert_eq!(fit_gamma(&all[..3]), Err(FitError::TooFew { points: 3, needed: 4 }));
        assert_eq!(fit_gamma(&all[..6]), Err(FitError::TooFewLevels(2)));
        let one = films(TRUTH, &DOSES[..1], || 0.0);
        assert_eq!(fit_gamma(&one), Err(FitError::TooFewDoses { doses: 1, needed: 2 }));
        // Each dose has a level of its own, in proportion.
        let mut paired = all.clone();
        for point in &mut paired {
            point.dose = Dose::from_mj_per_cm2(800.0 * point.gray.get());
        }
        assert_eq!(fit_gamma(&paired), Err(FitError::NoLines));
        let mut noise = SplitMix(2);
        let scattered = films([5.0, 20.0, 1.0], &DOSES, || 60.0 * noise.normal());
        assert!(fit_gamma(&scattered).is_err());
        let mut falls = all.clone();
        falls.iter_mut().for_each(|it| it.depth = Length::from_um(1000.0 - it.depth.um()));
        assert!(matches!(fit_gamma(&falls), Err(FitError::Falls { .. })));
        // Darker levels cure deeper.
        let mut turned = all;
        for point in &mut turned {
            let um = 125.0 * (point.dose.mj_per_cm2() / 20.0 / point.gray.get()).ln();
            point.depth = Length::from_um(um);
        }
        let error = fit_gamma(&turned).unwrap_err().to_string();
        assert!(error.starts_with("the points do not determine gamma: -1"), "{error}");
    }
}
