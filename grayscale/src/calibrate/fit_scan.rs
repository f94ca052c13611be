//! Fits the spread of light along and across a scan to measured lines and gaps.

use std::fmt;

use lamp_stack::Length;
use serde::{Deserialize, Serialize};

use super::least_squares;
use super::matrix::inverse;
use super::measurements::LinePoint;
use super::student_t::t_95;
use super::{Estimate, FitError};
use crate::material::SpreadNumbers;
use crate::resin::{CuredLineWidth, Dose, cured_line};

/// The direction in which a width is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScanDirection {
    /// Across the scan, along x: the line runs along the scan.
    Across,
    /// Along the scan, along y: the line runs across it.
    Along,
}

lamp_stack::named!(ScanDirection { Across = "across", Along = "along" });

/// The kind of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineKind {
    /// A white line on black.
    Line,
    /// A black gap in wide white.
    Gap,
}

lamp_stack::named!(LineKind { Line = "line", Gap = "gap" });

impl fmt::Display for LinesOf {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "lines and gaps measured {} the scan", self.0)
    }
}

/// The lines of a direction, for messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinesOf(pub ScanDirection);

/// The spread of light, found from lines and gaps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanFit {
    /// `σ` across the scan.
    pub across: Estimate<Length>,
    /// `σ` along the scan.
    pub along: Estimate<Length>,
    /// `E_c`, the dose at the surface from which on lines cure.
    pub critical_dose: Estimate<Dose>,
    /// The share of the scatter of growth, the width after curing less the image's, that the model
    /// explains.
    pub r2: f64,
    /// The number of points.
    pub points: usize,
    model: SpreadModel,
}

/// The fewest lines and gaps of a direction.
const LEAST_LINES: usize = 3;
/// The widest interval: from the value over e to e times the value.
const WIDEST_LOG: f64 = 1.0;

/// The least share of the scatter that the model must explain: below it, other things made the widths.
const LEAST_R2: f64 = 0.5;

/// Fits `σ` across and along the scan, and the dose that cures, to the widths of lines and gaps by
/// nonlinear least squares: a line cures where its light, `E/2 (erf((w/2 - x) / √2 σ) + erf((w/2 +
/// x) / √2 σ))`, is at least `E_c`; a gap stays open where that light of a white gap is missing from
/// `E`, and less than `E_c` is left (002 section 3.4.2.1).
///
/// Intervals come from the covariance, by Student's t, on a logarithmic scale.
///
/// # Errors
/// Returns an error if there are fewer than three lines of a direction, or all have one width, kind
/// and dose, if nothing fits, or if the lines do not show a number.
pub fn fit_scan(points: &[LinePoint]) -> Result<ScanFit, FitError> {
    ScanDirection::ALL.into_iter().try_for_each(|direction| check(points, direction))?;
    let model = SpreadModel::starts(points)
        .into_iter()
        .filter_map(|start| start.fitted(points))
        .min_by(|a, b| a.squares(points).total_cmp(&b.squares(points)))
        .ok_or(FitError::NoScanFit)?;
    let left = model.squares(points);
    let times = t_95(points.len() - 3).powi(2) * left / (points.len() - 3) as f64;
    let (matrix, _) = model.normal(points);
    // Light that does not spread has no place on a logarithmic scale.
    let spread = inverse(matrix).ok_or(FitError::NoScanFit)?;
    let half = |of: usize| (spread[of][of] * times).max(0.0).sqrt();
    let names = ["the spread across the scan", "the spread along the scan", "the critical dose"];
    let units = ["um", "um", "mJ/cm2"];
    for (of, value) in model.numbers().into_iter().enumerate() {
        if half(of).is_nan() || half(of) >= WIDEST_LOG {
            let [low, high] = [-half(of), half(of)].map(|half| value * half.exp());
            return Err(FitError::VagueLines { what: names[of], low, high, unit: units[of] });
        }
    }
    let [across, along, critical] = model.numbers();
    let growth = |point: &LinePoint| point.cured.um() - point.drawn.um();
    let mean = points.iter().map(growth).sum::<f64>() / points.len() as f64;
    let scatter: f64 = points.iter().map(|point| (growth(point) - mean).powi(2)).sum();
    let r2 = if scatter > 0.0 { 1.0 - left / scatter } else { 0.0 };
    if r2 < LEAST_R2 {
        return Err(FitError::NoScanFit);
    }
    // Lines much wider than light spreads all grow by z σ, so one dose shows the product alone.
    let is_one_dose = points.iter().all(|point| point.dose == points[0].dose);
    let narrowest = points.iter().map(|point| point.drawn.um()).fold(f64::INFINITY, f64::min);
    if let Some(of) =
        [across, along].iter().position(|sigma| is_one_dose && narrowest > 3.0 * sigma)
    {
        let (high, unit) = (narrowest / 3.0, units[of]);
        return Err(FitError::VagueLines { what: names[of], low: 0.0, high, unit });
    }
    Ok(ScanFit {
        across: estimate(across, half(0)),
        along: estimate(along, half(1)),
        critical_dose: estimate(critical, half(2)),
        r2,
        points: points.len(),
        model,
    })
}

fn estimate<T: crate::resin::Quantity>(value: f64, half: f64) -> Estimate<T> {
    Estimate::new(value, value / half.exp(), value * half.exp())
}

fn check(points: &[LinePoint], direction: ScanDirection) -> Result<(), FitError> {
    let of = |point: &&LinePoint| point.direction == direction;
    let lines: Vec<_> = points.iter().filter(of).collect();
    if lines.len() < LEAST_LINES {
        return Err(FitError::TooFewLines {
            lines: LinesOf(direction),
            count: lines.len(),
            needed: LEAST_LINES,
        });
    }
    let is_like_first = |line: &&LinePoint| {
        (line.kind, line.drawn, line.dose) == (lines[0].kind, lines[0].drawn, lines[0].dose)
    };
    if lines.iter().all(is_like_first) {
        return Err(FitError::EqualLines(LinesOf(direction)));
    }
    Ok(())
}

impl ScanFit {
    /// Returns how wide a line or a gap is after curing: zero for one that does not cure, or closes.
    pub fn width(&self, line: &LinePoint) -> Length {
        Length::from_um(self.model.width(line).map_or(0.0, |(width, _)| width))
    }

    /// Returns the numbers for a material file.
    pub fn numbers(&self, source: &str) -> SpreadNumbers {
        SpreadNumbers {
            sigma: None,
            sigma_across: Some(self.across.given(source)),
            sigma_along: Some(self.along.given(source)),
            critical_dose: Some(self.critical_dose.given(source)),
            pixel: None,
        }
    }
}

/// Both `σ` in um and `E_c` in mJ/cm², as logarithms: all are above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SpreadModel {
    logs: [f64; 3],
}

impl SpreadModel {
    /// Returns the most promising places to search from. Under one `E_c`, each `σ` has its own lines.
    fn starts(points: &[LinePoint]) -> Vec<Self> {
        let least = |of: fn(&LinePoint) -> f64| points.iter().map(of).fold(f64::INFINITY, f64::min);
        let (width, dose) =
            (least(|point| point.drawn.um()), least(|point| point.dose.mj_per_cm2()));
        let sigmas = [0.1, 0.2, 0.4, 0.8, 1.6, 3.2].map(|times: f64| (times * width).ln());
        let doses = [0.05, 0.15, 0.3, 0.5, 0.7, 0.9].map(|share: f64| (share * dose).ln());
        let [across, along] = ScanDirection::ALL.map(|direction| {
            let of = |point: &&LinePoint| point.direction == direction;
            points.iter().filter(of).copied().collect::<Vec<_>>()
        });
        let mut starts = doses.map(|dose| {
            let best = |lines: &[LinePoint]| {
                let left = |sigma: f64| Self { logs: [sigma, sigma, dose] }.squares(lines);
                sigmas.into_iter().min_by(|a, b| left(*a).total_cmp(&left(*b)))
            };
            let sigma = |lines| best(lines).expect("there are widths to begin with");
            Self { logs: [sigma(&across), sigma(&along), dose] }
        });
        starts.sort_by(|a, b| a.squares(points).total_cmp(&b.squares(points)));
        starts[..3].to_vec()
    }

    fn numbers(&self) -> [f64; 3] {
        self.logs.map(f64::exp)
    }

    /// Returns the width of a line after curing and its slopes over the logarithms.
    fn width(&self, line: &LinePoint) -> Option<(f64, [f64; 3])> {
        let [across, along, critical] = self.numbers();
        let (sigma, axis) = match line.direction {
            ScanDirection::Across => (across, 0),
            ScanDirection::Along => (along, 1),
        };
        let share = critical / line.dose.mj_per_cm2();
        let (threshold, sign) = match line.kind {
            LineKind::Line => (share, 1.0),
            LineKind::Gap => (1.0 - share, -1.0),
        };
        let CuredLineWidth { width, by_sigma, by_threshold } =
            cured_line(line.drawn.um(), sigma, threshold)?;
        let mut slopes = [0.0, 0.0, sign * share * by_threshold];
        slopes[axis] = sigma * by_sigma;
        Some((width, slopes))
    }

    /// Returns the sum of squared residuals. Lines that do not cure are zero wide.
    fn squares(&self, points: &[LinePoint]) -> f64 {
        let width = |line| self.width(line).map_or(0.0, |(width, _)| width);
        let sum: f64 = points.iter().map(|line| (line.cured.um() - width(line)).powi(2)).sum();
        if sum.is_nan() { f64::INFINITY } else { sum }
    }

    /// Returns the normal equations.
    fn normal(&self, points: &[LinePoint]) -> ([[f64; 3]; 3], [f64; 3]) {
        let (mut matrix, mut vector) = ([[0.0; 3]; 3], [0.0; 3]);
        for line in points {
            let Some((width, slopes)) = self.width(line) else { continue };
            for i in 0..3 {
                vector[i] += slopes[i] * (line.cured.um() - width);
                for j in 0..3 {
                    matrix[i][j] += slopes[i] * slopes[j];
                }
            }
        }
        (matrix, vector)
    }

    fn fitted(self, points: &[LinePoint]) -> Option<Self> {
        least_squares::fitted(
            self,
            |model| model.squares(points),
            |model| model.normal(points),
            |model, step: [f64; 3]| Self {
                // A step of a factor of e at the most: beyond, lines may all vanish.
                logs: std::array::from_fn(|of| model.logs[of] + step[of].clamp(-1.0, 1.0)),
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;

    use super::super::made_up::share_held;
    use super::*;

    const WIDTHS: [f64; 8] = [2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 20.0, 40.0];
    const PITCH: f64 = 25_400.0 / 1500.0;

    /// The width of a line by brute force: its light, a sum of error functions, on a grid of 1/2000
    /// of the spread.
    fn printed(kind: LineKind, drawn: f64, sigma: f64, share: f64) -> f64 {
        let erf = |at: f64| libm::erf(at / (2f64.sqrt() * sigma));
        let line = |x: f64| 0.5 * (erf(drawn / 2.0 - x) + erf(drawn / 2.0 + x));
        let is_inside = |x: f64| match kind {
            LineKind::Line => line(x) >= share,
            LineKind::Gap => 1.0 - line(x) < share,
        };
        let grid = sigma / 2000.0;
        let steps = ((drawn / 2.0 + 6.0 * sigma) / grid) as u32;
        let inside = (0..steps).filter(|&step| is_inside((f64::from(step) + 0.5) * grid)).count();
        2.0 * grid * inside as f64
    }

    /// The lines of `lamp target scan` that cured and gaps that stayed open, with errors.
    fn lines(
        [across, along, critical]: [f64; 3],
        doses: &[f64],
        widths: &[f64],
        mut error: impl FnMut() -> f64,
    ) -> Vec<LinePoint> {
        let mut points = Vec::new();
        for &dose in doses {
            for (direction, sigma) in
                [(ScanDirection::Across, across), (ScanDirection::Along, along)]
            {
                for kind in LineKind::ALL {
                    for drawn in widths.iter().map(|px| px * PITCH) {
                        let printed = printed(kind, drawn, sigma, critical / dose);
                        if printed > 0.0 {
                            points.push(LinePoint {
                                direction,
                                kind,
                                drawn: Length::from_um(drawn),
                                dose: Dose::from_mj_per_cm2(dose),
                                cured: Length::from_um(printed + error()),
                            });
                        }
                    }
                }
            }
        }
        points
    }

    fn values(fit: &ScanFit) -> [f64; 3] {
        [fit.across.value.um(), fit.along.value.um(), fit.critical_dose.value.mj_per_cm2()]
    }

    #[test]
    fn printed_lines_give_both_spreads_back() {
        // The last two lie far from equal spreads, where no start is near.
        for truth in [
            [30.0, 45.0, 100.0],
            [20.0, 20.0, 30.0],
            [55.0, 35.0, 120.0],
            [15.0, 160.0, 60.0],
            [220.0, 14.0, 40.0],
        ] {
            for doses in [&[200.0][..], &[150.0, 300.0]] {
                let fit = fit_scan(&lines(truth, doses, &WIDTHS, || 0.0)).unwrap();
                for (found, truth) in values(&fit).into_iter().zip(truth) {
                    // The referee's grid is 1/2000 of the spread.
                    assert!((found / truth - 1.0).abs() < 2e-3, "{found} of {truth}: {fit:?}");
                }
                assert!(fit.r2 > 0.999_99, "{fit:?}");
            }
        }
    }

    #[test]
    fn with_errors_the_intervals_hold_the_truth() {
        let truth = [30.0, 45.0, 100.0];
        let exact = lines(truth, &[200.0], &WIDTHS, || 0.0);
        let mut noise = SplitMix(41);
        let mut fit = || {
            let measured = |line: &LinePoint| LinePoint {
                cured: Length::from_um(line.cured.um() + 3.0 * noise.normal()),
                ..*line
            };
            fit_scan(&exact.iter().map(measured).collect::<Vec<_>>())
        };
        let fits: Vec<_> = (0..400).map(|_| fit()).collect();
        let held = share_held(fits.iter().cloned(), |fit| {
            let [across, along, critical] = truth;
            [
                fit.across.holds(Length::from_um(across)),
                fit.along.holds(Length::from_um(along)),
                fit.critical_dose.holds(Dose::from_mj_per_cm2(critical)),
            ]
        });
        // 1.1 % is a standard deviation here, and these are three.
        assert!(held.iter().all(|share| (0.917..=0.983).contains(share)), "{held:?}");
        // Lines of 34 um and more, measured to 3 um, show narrow light less well than wide light.
        for (of, most) in [0.12, 0.04, 0.012].into_iter().enumerate() {
            let off = fits.iter().map(|fit| values(fit.as_ref().unwrap())[of] / truth[of] - 1.0);
            let mut off: Vec<f64> = off.map(f64::abs).collect();
            off.sort_by(f64::total_cmp);
            assert!(off[380] < most, "number {of}: 95 % are off by less than {}", off[380]);
        }
    }

    #[test]
    fn lines_that_show_too_little_are_refused() {
        let truth = [30.0, 45.0, 100.0];
        let said = |points: &[LinePoint]| fit_scan(points).unwrap_err().to_string();
        let all = lines(truth, &[200.0], &WIDTHS, || 0.0);
        let across: Vec<_> =
            all.iter().filter(|line| line.direction == ScanDirection::Across).copied().collect();
        let few = said(&across);
        assert!(few.starts_with("0 lines and gaps measured along the scan are too few"), "{few}");
        assert!(said(&[]).starts_with("0 lines and gaps measured across the scan are too few"));
        let along: Vec<_> =
            all.iter().filter(|line| line.direction == ScanDirection::Along).copied().collect();
        let equal = said(&[&across[..], &[along[5]; 4]].concat());
        assert!(
            equal.starts_with("all lines and gaps measured along the scan are alike"),
            "{equal}"
        );
        // Of wide lines, only the product of spread and threshold is known.
        let mut noise = SplitMix(5);
        let wide = lines(truth, &[200.0], &[20.0, 30.0, 40.0], || noise.normal());
        assert!(!wide.is_empty());
        let vague = said(&wide);
        assert!(vague.contains("about as wide as light spreads"), "{vague}");
        let mut broken = all.clone();
        broken[3].cured = Length::from_um(f64::NAN);
        assert_eq!(fit_scan(&broken), Err(FitError::NoScanFit));
    }
}
