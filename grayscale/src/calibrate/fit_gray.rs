//! Fits the working curve over the gray level to measured cure depths.

use lamp_stack::{Length, round_significant};

use super::curve_lines::{CRITICAL_DOSE, CurveLinesFit, LinePoint, PENETRATION_DEPTH};
use super::extent::Extent;
use super::fit_curve::{CurveFit, fit_curve};
use super::measurements::DepthPoint;
use super::{Estimate, FitError};
use crate::material::{CurveLines, GivenLine};
use crate::resin::{Dose, GrayLevel, Quantity};

/// The working curve over the gray level, found from measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct GrayFit {
    /// The points of each level, from the darkest.
    pub levels: Vec<LevelFit>,
    /// `E_c(G)`.
    pub critical_dose: LineEstimate<Dose>,
    /// `D_p(G)`.
    pub penetration_depth: LineEstimate<Length>,
    /// The share of the depths' scatter that the lines explain.
    pub r2: f64,
    extent: Option<Extent>,
    lines: CurveLinesFit,
}

/// The working curve of a gray level alone, over the dose that arrives, to compare with the lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelFit {
    /// The gray level.
    pub gray: GrayLevel,
    /// The number of its points.
    pub points: usize,
    /// Its own curve, if its points determine one.
    pub curve: Option<CurveFit>,
}

/// A straight line over the gray level, or over the lamp's light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineEstimate<T> {
    /// The value in the dark.
    pub at_zero: Estimate<T>,
    /// The rise from black to white, or for each W/cm²; zero if the line was `levelled`.
    pub rise: Estimate<T>,
    /// The negative rise of a line that falls by no more than its interval. The line is then
    /// kept level, since the model takes no falling line.
    pub levelled: Option<T>,
}

/// Fits the lines `E_c(G)` and `D_p(G)` (002 eq. 40) to the points of all levels at once, by
/// nonlinear least squares.
///
/// A line whose fall is within its interval is kept level. Intervals come from the covariance of
/// the fit, by Student's t; the interval of a level line is as wide as the interval of the line
/// that falls.
///
/// # Errors
/// Returns an error if there are fewer than three levels or too few points to determine the lines,
/// or if a line falls by more than its interval or begins at zero or less.
pub fn fit_gray(points: &[DepthPoint]) -> Result<GrayFit, FitError> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.gray.get().total_cmp(&b.gray.get()));
    let level = |group: &[DepthPoint]| LevelFit {
        gray: group[0].gray,
        points: group.len(),
        // A level alone may have too few points: the lines are fitted to all levels together.
        curve: fit_curve(group).ok(),
    };
    let levels: Vec<LevelFit> = sorted.chunk_by(|a, b| a.gray == b.gray).map(level).collect();
    if levels.len() < 3 {
        return Err(FitError::TooFewLevels(levels.len()));
    }
    let point = |p: &DepthPoint| LinePoint {
        x: p.gray.get(),
        log_dose: p.arriving().mj_per_cm2().ln(),
        depth: p.depth.um(),
    };
    let points: Vec<_> = sorted.iter().map(point).collect();
    let (sloped, lines) = rising_lines(&points)?;
    Ok(GrayFit {
        critical_dose: line(&sloped, &lines, CRITICAL_DOSE, "the critical dose")?,
        penetration_depth: line(&sloped, &lines, PENETRATION_DEPTH, "the penetration depth")?,
        r2: lines.r2,
        extent: Extent::of_depths(&sorted),
        levels,
        lines,
    })
}

/// Returns the lines of the best fit; lines that would fall are kept level.
fn rising_lines(points: &[LinePoint]) -> Result<(CurveLinesFit, CurveLinesFit), FitError> {
    let sloped = CurveLinesFit::new(points, [true; 4])?;
    let (mut lines, mut free) = (sloped, [true; 4]);
    // With one line level, the other may fall.
    while let Some(falls) =
        [CRITICAL_DOSE, PENETRATION_DEPTH].into_iter().find(|line| lines.numbers[line + 1] < 0.0)
    {
        free[falls + 1] = false;
        lines = CurveLinesFit::new(points, free)?;
    }
    Ok((sloped, lines))
}

pub(super) fn line<T: Quantity>(
    sloped: &CurveLinesFit,
    lines: &CurveLinesFit,
    number: usize,
    what: &'static str,
) -> Result<LineEstimate<T>, FitError> {
    let unit = T::UNIT;
    let (fell, rise) = (sloped.numbers[number + 1], lines.numbers[number + 1]);
    let [half_at_zero, half] = [number, number + 1].map(|number| sloped.half(number));
    // A fall beyond its interval is no scatter: the model does not hold.
    if fell < -half {
        return Err(FitError::GrayFalls { what, fall: -fell, half, unit });
    }
    let at_zero = lines.numbers[number];
    let levelled = (rise == 0.0).then_some(fell.min(0.0));
    let line = LineEstimate {
        at_zero: Estimate::even(at_zero, half_at_zero),
        rise: match levelled {
            Some(fell) => Estimate::new(0.0, fell - half, (fell + half).max(0.0)),
            None => Estimate::even(rise, half),
        },
        levelled: levelled.map(T::of),
    };
    if at_zero > 0.0 { Ok(line) } else { Err(FitError::GrayBegins { what, at_zero, unit }) }
}

impl GrayFit {
    /// Returns the depth of a gray level after a dose of white, with its 95% interval. It is below
    /// zero up to the critical dose.
    pub fn depth(&self, gray: GrayLevel, white: Dose) -> Estimate<Length> {
        let [depth, half] = self.lines.depth(gray.get(), (white * gray).mj_per_cm2().ln());
        Estimate::even(depth, half)
    }

    /// Returns the lines for a material file. Their intervals stand in the source, as lines
    /// have no other place for them.
    pub fn lines(&self, source: &str) -> CurveLines {
        CurveLines {
            critical_dose: given(&self.critical_dose, source),
            penetration_depth: given(&self.penetration_depth, source),
            measured: self.extent.map(|extent| extent.measured(source)),
        }
    }
}

pub(super) fn given<T: Quantity>(line: &LineEstimate<T>, source: &str) -> GivenLine<T> {
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
        near(fit.levels[0].curve.unwrap().critical_dose.value.mj_per_cm2(), 108.92);
        let (gray, white) = (fit.levels[1].gray, Dose::from_mj_per_cm2(960.0));
        near(fit.depth(gray, white).value.um(), 241.663131);
        let lines = fit.lines("a test");
        assert_eq!(lines.critical_dose.at_zero.mj_per_cm2(), 101.8);
        assert!(lines.critical_dose.source.starts_with("a test; at-zero +- "));
    }

    #[test]
    fn of_100_intervals_95_hold_the_truth() {
        // Depths to 5 um, as in 002 section 3.3.5.
        for spread in [1.0, 5.0] {
            let fits = (0..2000).map(|seed| fit_gray(&points(of_lamp, spread, seed << 20)));
            let held = share_held(fits, |fit| {
                let (gray, white) = (fit.levels[2].gray, Dose::from_mj_per_cm2(700.0));
                [
                    fit.critical_dose.at_zero.holds(Dose::from_mj_per_cm2(101.8)),
                    fit.critical_dose.rise.holds(Dose::from_mj_per_cm2(35.6)),
                    fit.penetration_depth.at_zero.holds(Length::from_um(193.1)),
                    fit.penetration_depth.rise.holds(Length::from_um(22.1)),
                    fit.depth(gray, white).holds(Length::from_um(of_lamp(gray, white))),
                ]
            });
            // 95% +- 1.5% is three standard deviations of 2000 trials.
            assert!(held.iter().all(|share| (share - 0.95).abs() < 0.0147), "{spread}: {held:?}");
        }
    }

    #[test]
    fn all_points_tell_the_lines_more_sharply_than_lines_through_levels_curves() {
        // A line through three levels' own numbers, by Student's t of one degree.
        let levels = [0.2, 0.5, 1.0];
        let measured: Vec<_> = points(of_lamp, 5.0, 9)
            .into_iter()
            .filter(|point| levels.contains(&point.gray.get()))
            .collect();
        let fit = fit_gray(&measured).unwrap();
        let of_levels: Vec<_> = fit
            .levels
            .iter()
            .map(|level| (level.gray.get(), level.curve.unwrap().penetration_depth.value.um()))
            .collect();
        let through_levels = super::super::regression::LineFit::new(&of_levels).unwrap();
        let rise = fit.penetration_depth.rise.plus_minus().um();
        assert!(rise < through_levels.slope_half(), "{rise} {}", through_levels.slope_half());
    }

    #[test]
    fn a_line_that_might_be_level_is_kept_level() {
        // D_p falls by 2 um, which no such measurement can show.
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
    fn a_level_of_two_films_counts() {
        let all = points(of_lamp, 2.0, 1);
        assert_eq!(fit_gray(&all[..12]), Err(FitError::TooFewLevels(2)));
        let [few, more] = [&all[4..], &all[..]].map(|points| fit_gray(points).unwrap());
        assert_eq!((few.levels[0].points, few.levels[0].curve), (2, None));
        assert!(few.critical_dose.rise.holds(Dose::from_mj_per_cm2(35.6)));
        let half = |fit: &GrayFit| fit.critical_dose.rise.plus_minus().mj_per_cm2();
        assert!(half(&few) > half(&more));
    }
}
