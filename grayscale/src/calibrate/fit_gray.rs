//! Fits the working curve over the gray level to measured cure depths.

use lamp_stack::Length;

use super::fit_curve::{CurveFit, fit_curve};
use super::measurements::DepthPoint;
use super::regression::LineFit;
use super::significant::round_significant;
use super::{Estimate, FitError, PointGroup};
use crate::material::{CurveLines, GivenLine};
use crate::resin::{Dose, GrayLevel, Quantity};

/// The working curve over the gray level, found from measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct GrayFit {
    /// The working curve of each level, from the darkest.
    pub levels: Vec<LevelFit>,
    /// `E_c(G)`.
    pub critical_dose: LineEstimate<Dose>,
    /// `D_p(G)`.
    pub penetration_depth: LineEstimate<Length>,
}

/// The working curve of a gray level, over the dose that arrives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelFit {
    /// The gray level.
    pub gray: GrayLevel,
    /// Its curve.
    pub curve: CurveFit,
}

/// A straight line over the gray level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineEstimate<T> {
    /// The value at level 0.
    pub at_zero: Estimate<T>,
    /// The rise from black to white; zero if the line was `levelled`.
    pub rise: Estimate<T>,
    /// The negative rise of a line that falls by no more than its interval. The line is then
    /// the mean, since the model takes no falling line.
    pub levelled: Option<T>,
    /// The share of the scatter that the line explains.
    pub r2: f64,
}

/// Fits the lines `E_c(G)` and `D_p(G)` (002 eq. 40): the working curve of each gray
/// level first, then a straight line through the curves' numbers.
///
/// A line whose fall is within its interval is kept level.
///
/// # Errors
/// Returns an error if there are fewer than three levels, a level has no working curve, or
/// a line falls by more than its interval or begins at zero or less.
pub fn fit_gray(points: &[DepthPoint]) -> Result<GrayFit, FitError> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.gray.get().total_cmp(&b.gray.get()));
    let fit = |group: &[DepthPoint]| {
        let gray = group[0].gray;
        let curve = fit_curve(group);
        curve
            .map(|curve| LevelFit { gray, curve })
            .map_err(|error| error.within(PointGroup::Gray(gray)))
    };
    let levels: Vec<LevelFit> =
        sorted.chunk_by(|a, b| a.gray == b.gray).map(fit).collect::<Result<_, _>>()?;
    if levels.len() < 3 {
        return Err(FitError::TooFewLevels(levels.len()));
    }
    let doses = levels.iter().map(|level| (level.gray, level.curve.critical_dose.value));
    let depths = levels.iter().map(|level| (level.gray, level.curve.penetration_depth.value));
    let critical_dose = line(doses, "the critical dose")?;
    let penetration_depth = line(depths, "the penetration depth")?;
    Ok(GrayFit { critical_dose, penetration_depth, levels })
}

fn line<T: Quantity>(
    values: impl Iterator<Item = (GrayLevel, T)>,
    what: &'static str,
) -> Result<LineEstimate<T>, FitError> {
    let unit = T::UNIT;
    let values: Vec<_> = values.map(|(gray, value)| (gray.get(), value.number())).collect();
    let fit = LineFit::new(&values)?;
    let (rise, half) = (fit.slope, fit.slope_half());
    if rise < -half {
        return Err(FitError::GrayFalls { what, fall: -rise, half, unit });
    }
    let line = if rise < 0.0 {
        // The sloped line's interval reaches farther than the level one's.
        let mean = values.iter().map(|value| value.1).sum::<f64>() / values.len() as f64;
        LineEstimate {
            at_zero: Estimate::new(mean, mean - fit.half_at(0.0), mean + fit.half_at(0.0)),
            rise: Estimate::new(0.0, rise - half, rise + half),
            levelled: Some(T::of(rise)),
            r2: 0.0,
        }
    } else {
        LineEstimate {
            at_zero: Estimate::even(fit.at(0.0), fit.half_at(0.0)),
            rise: Estimate::even(rise, half),
            levelled: None,
            r2: fit.r2,
        }
    };
    let at_zero = line.at_zero.value.number();
    if at_zero > 0.0 { Ok(line) } else { Err(FitError::GrayBegins { what, at_zero, unit }) }
}

impl GrayFit {
    /// Returns the lines for a material file. Their intervals stand in the source, as lines
    /// have no other place for them.
    pub fn lines(&self, source: &str) -> CurveLines {
        CurveLines {
            critical_dose: given(&self.critical_dose, source),
            penetration_depth: given(&self.penetration_depth, source),
        }
    }
}

fn given<T: Quantity>(line: &LineEstimate<T>, source: &str) -> GivenLine<T> {
    let unit = T::UNIT;
    let half = |estimate: &Estimate<T>| round_significant(estimate.plus_minus().number(), 3);
    let (zero, rise) = (half(&line.at_zero), half(&line.rise));
    GivenLine {
        at_zero: T::of(round_significant(line.at_zero.value.number(), 6)),
        rise: T::of(round_significant(line.rise.value.number(), 6)),
        source: format!("{source}; at-zero +- {zero} {unit}, rise +- {rise} {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;

    use super::super::made_up::share_held;
    use super::*;
    use crate::resin::{CureModel, GrayCurve, StraightLine};

    const LEVELS: [f64; 5] = [0.2, 0.4, 0.5, 0.8, 1.0];

    /// 002 eq. 40.
    fn lamp() -> GrayCurve {
        let [ec, ec_rise] = [101.8, 35.6].map(Dose::from_mj_per_cm2);
        let [dp, dp_rise] = [193.1, 22.1].map(Length::from_um);
        let critical_dose = StraightLine { at_zero: ec, rise: ec_rise };
        GrayCurve::new(critical_dose, StraightLine { at_zero: dp, rise: dp_rise }).unwrap()
    }

    /// The depths of a model with errors, at doses of three to twenty times 131.5 mJ/cm²
    /// divided by the level.
    fn points(depth: impl Fn(GrayLevel, Dose) -> f64, spread: f64, seed: u64) -> Vec<DepthPoint> {
        let mut noise = SplitMix(seed);
        let mut points = Vec::new();
        for gray in LEVELS.map(|g| GrayLevel::new(g).unwrap()) {
            for times in [3.0, 4.0, 6.0, 9.0, 13.0, 20.0] {
                let dose = Dose::from_mj_per_cm2(131.5 * times / gray.get());
                let depth = Length::from_um(depth(gray, dose) + spread * noise.normal());
                points.push(DepthPoint { gray, dose, depth });
            }
        }
        points
    }

    fn of_lamp(gray: GrayLevel, dose: Dose) -> f64 {
        lamp().gray_depth(gray, dose).um()
    }

    #[test]
    fn exact_points_give_equation_40_back() {
        let fit = fit_gray(&points(of_lamp, 0.0, 1)).unwrap();
        let near = |found: f64, wanted: f64| assert!((found - wanted).abs() < 1e-6, "{found}");
        near(fit.critical_dose.at_zero.value.mj_per_cm2(), 101.8);
        near(fit.critical_dose.rise.value.mj_per_cm2(), 35.6);
        near(fit.penetration_depth.at_zero.value.um(), 193.1);
        near(fit.penetration_depth.rise.value.um(), 22.1);
        assert_eq!(fit.levels.len(), LEVELS.len());
        near(fit.levels[0].curve.critical_dose.value.mj_per_cm2(), 108.92);
        let lines = fit.lines("a test");
        assert_eq!(lines.critical_dose.at_zero.mj_per_cm2(), 101.8);
        assert!(lines.critical_dose.source.starts_with("a test; at-zero +- "));
    }

    #[test]
    fn of_100_intervals_95_hold_the_truth() {
        let fits = (0..2000).map(|seed| fit_gray(&points(of_lamp, 1.0, seed << 20)));
        let held = share_held(fits, |fit| {
            [
                fit.critical_dose.at_zero.holds(Dose::from_mj_per_cm2(101.8)),
                fit.critical_dose.rise.holds(Dose::from_mj_per_cm2(35.6)),
                fit.penetration_depth.at_zero.holds(Length::from_um(193.1)),
                fit.penetration_depth.rise.holds(Length::from_um(22.1)),
            ]
        });
        // 95% +- 1.5% is three standard deviations of 2000 trials.
        assert!(held.iter().all(|share| (share - 0.95).abs() < 0.0147), "{held:?}");
    }

    #[test]
    fn a_line_that_might_be_level_is_kept_level() {
        // D_p falls by 2 um, which no such measurement can tell.
        let falls = |gray: GrayLevel, dose: Dose| {
            let arriving = dose.mj_per_cm2() * gray.get();
            (212.0 - 2.0 * gray.get()) * (arriving / (100.0 + 30.0 * gray.get())).ln()
        };
        let fit = fit_gray(&points(falls, 3.0, 5)).unwrap();
        let line = fit.penetration_depth;
        assert_eq!(line.rise.value.um(), 0.0);
        assert!(line.levelled.unwrap().um() < 0.0 && line.rise.holds(Length::from_um(-2.0)));
        assert!(line.at_zero.holds(Length::from_um(212.0)));
        assert!(fit.critical_dose.levelled.is_none());
    }

    #[test]
    fn a_line_that_falls_for_sure_is_refused() {
        let falls = |gray: GrayLevel, dose: Dose| {
            let arriving = dose.mj_per_cm2() * gray.get();
            (240.0 - 60.0 * gray.get()) * (arriving / 120.0).ln()
        };
        let error = fit_gray(&points(falls, 0.5, 5)).unwrap_err();
        let FitError::GrayFalls { fall, half, .. } = error else { panic!("{error}") };
        assert!((fall - 60.0).abs() < half && half < 10.0, "{error}");
    }

    #[test]
    fn three_levels_with_a_curve_each_are_the_least() {
        let all = points(of_lamp, 0.0, 1);
        assert_eq!(fit_gray(&all[..12]), Err(FitError::TooFewLevels(2)));
        let error = fit_gray(&all[..20]).unwrap_err().to_string();
        assert!(error.starts_with("gray level 0.8: 2 points are too few"), "{error}");
    }
}
