//! Fits one working curve whose numbers are lines over a third quantity to all points at once.

use super::matrix::{dot, inverse, product};
use super::regression::LineFit;
use super::student_t::t_95;
use super::{FitError, least_squares};

/// A measured depth, at a logarithm of the dose and an `x` over which the curve's numbers change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LinePoint {
    pub(super) x: f64,
    pub(super) log_dose: f64,
    pub(super) depth: f64,
}

/// The numbers of the curve `(d + d' x) (ln E - ln(c + c' x))`: `c`, `c'`, `d`, `d'`.
pub(super) type CurveCoefficients = [f64; 4];

/// The positions in [`CurveCoefficients`] where the lines of the critical dose and of the
/// penetration depth begin.
pub(super) const CRITICAL_DOSE: usize = 0;
pub(super) const PENETRATION_DEPTH: usize = 2;

/// The curve that fits points best, and how precisely they determine its numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CurveLinesFit {
    pub(super) numbers: CurveCoefficients,
    /// The numbers' covariance, times the square of Student's t.
    spread: [[f64; 4]; 4],
    /// The share of the depths' scatter that the curve explains.
    pub(super) r2: f64,
}

impl CurveLinesFit {
    /// Fits the numbers that are `free` by nonlinear least squares; the others are zero.
    ///
    /// # Errors
    /// Returns an error if there are too few points for the numbers, if depths do not rise with the
    /// dose, or if the points do not determine all numbers.
    pub(super) fn new(points: &[LinePoint], free: [bool; 4]) -> Result<Self, FitError> {
        let needed = 1 + free.iter().filter(|free| **free).count();
        if points.len() < needed {
            return Err(FitError::TooFew { points: points.len(), needed });
        }
        let curve: Vec<_> = points.iter().map(|p| (p.log_dose, p.depth)).collect();
        // Depths may fall with the dose where they rise much more with x, but then they say little.
        let line = LineFit::new(&curve)?.rising("um for each e-fold of dose")?;
        // Both lines level: the working curve of all points together.
        let start = [line.zero()[0].exp(), 0.0, line.slope, 0.0];
        let numbers = fitted(start, points, free).ok_or(FitError::NoLines)?;
        let mean = curve.iter().map(|point| point.1).sum::<f64>() / curve.len() as f64;
        let scatter: f64 = curve.iter().map(|point| (point.1 - mean).powi(2)).sum();
        let squares = squares(&numbers, points);
        // `needed` is one more than there are free numbers.
        let freedom = points.len() + 1 - needed;
        let times = t_95(freedom).powi(2) * squares / freedom as f64;
        let matrix = normal(&numbers, points, free).0;
        let covariance = inverse(matrix).ok_or(FitError::NoLines)?;
        let spread = std::array::from_fn(|i| {
            std::array::from_fn(|j| if free[i] && free[j] { covariance[i][j] * times } else { 0.0 })
        });
        Ok(Self { numbers, spread, r2: 1.0 - squares / scatter })
    }

    /// Returns half the width of the 95% interval of a number.
    pub(super) fn half(&self, number: usize) -> f64 {
        self.spread[number][number].max(0.0).sqrt()
    }

    /// Returns the depth at an x and a logarithm of the dose, and half the width of its 95%
    /// interval. It is below zero up to the critical dose.
    pub(super) fn depth(&self, x: f64, log_dose: f64) -> [f64; 2] {
        let (depth, slopes) = at(&self.numbers, x, log_dose);
        [depth, dot(&slopes, &product(&self.spread, &slopes)).max(0.0).sqrt()]
    }
}

/// Returns the depth, and its derivatives over the numbers.
fn at(
    &[c, c_rise, d, d_rise]: &CurveCoefficients,
    x: f64,
    log_dose: f64,
) -> (f64, CurveCoefficients) {
    let (critical, penetration) = (c + c_rise * x, d + d_rise * x);
    let folds = log_dose - critical.ln();
    // d/dc of (d + d' x)(ln E - ln(c + c' x)).
    let by_critical = -penetration / critical;
    (penetration * folds, [by_critical, by_critical * x, folds, folds * x])
}

/// Returns the sum of squared residuals, infinite where a critical dose is not above zero.
fn squares(numbers: &CurveCoefficients, points: &[LinePoint]) -> f64 {
    let residual = |p: &LinePoint| p.depth - at(numbers, p.x, p.log_dose).0;
    let sum: f64 = points.iter().map(|point| residual(point).powi(2)).sum();
    if sum.is_finite() { sum } else { f64::INFINITY }
}

/// Returns the normal equations: the products of the derivatives with each other and with the
/// residuals. A number that is not free keeps its value by a one on the diagonal.
fn normal(
    numbers: &CurveCoefficients,
    points: &[LinePoint],
    free: [bool; 4],
) -> ([[f64; 4]; 4], [f64; 4]) {
    let mut matrix =
        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j && !free[i]))));
    let mut vector = [0.0; 4];
    for point in points {
        let (depth, slopes) = at(numbers, point.x, point.log_dose);
        for i in (0..4).filter(|&i| free[i]) {
            vector[i] += slopes[i] * (point.depth - depth);
            for j in (0..4).filter(|&j| free[j]) {
                matrix[i][j] += slopes[i] * slopes[j];
            }
        }
    }
    (matrix, vector)
}

/// Improves numbers until no step helps.
fn fitted(
    numbers: CurveCoefficients,
    points: &[LinePoint],
    free: [bool; 4],
) -> Option<CurveCoefficients> {
    least_squares::fitted(
        numbers,
        |numbers| squares(numbers, points),
        |numbers| normal(numbers, points, free),
        |numbers, step: CurveCoefficients| std::array::from_fn(|i| numbers[i] + step[i]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [bool; 4] = [true; 4];

    fn points(numbers: CurveCoefficients, errors: &[f64]) -> Vec<LinePoint> {
        let doses = [400.0, 800.0, 1600.0_f64];
        let point = |i: usize| {
            let (x, log_dose) = ([0.2, 0.6, 1.0][i % 3], doses[i / 3 % 3].ln());
            LinePoint { x, log_dose, depth: at(&numbers, x, log_dose).0 + errors[i % errors.len()] }
        };
        (0..9).map(point).collect()
    }

    #[test]
    fn derivatives_are_differences() {
        let numbers = [100.0, 35.0, 190.0, 20.0];
        let slopes = at(&numbers, 0.4, 6.0).1;
        for i in 0..4 {
            let moved = |by: f64| {
                let mut moved = numbers;
                moved[i] += by;
                at(&moved, 0.4, 6.0).0
            };
            let difference = (moved(1e-4) - moved(-1e-4)) / 2e-4;
            assert!((slopes[i] - difference).abs() < 1e-6 * slopes[i].abs(), "{i}: {slopes:?}");
        }
    }

    /// The numbers and half widths, and the depth at x 0.4 and 1000 mJ/cm².
    const WANTED: [(f64, f64); 4] = [
        (98.403214, 8.377435),
        (40.526716, 12.402756),
        (190.293739, 7.307705),
        (26.338161, 10.697699),
    ];
    const DEPTH: (f64, f64) = (435.033013, 2.462970);

    #[test]
    fn it_agrees_with_another_program() {
        // scipy.optimize.curve_fit and t.ppf.
        let errors = [2.0, -1.5, 0.5, 3.0, -2.5, 1.0, -0.5, -2.0, 2.5];
        let fit = CurveLinesFit::new(&points([101.8, 35.6, 193.1, 22.1], &errors), ALL).unwrap();
        for (i, (value, half)) in WANTED.into_iter().enumerate() {
            assert!((fit.numbers[i] - value).abs() < 1e-5 * value.abs(), "{i}: {fit:?}");
            assert!((fit.half(i) - half).abs() < 1e-5 * half, "{i}: {} for {half}", fit.half(i));
        }
        let [depth, half] = fit.depth(0.4, 1000f64.ln());
        assert!((depth - DEPTH.0).abs() < 1e-4 && (half - DEPTH.1).abs() < 1e-4, "{depth} {half}");
    }

    #[test]
    fn numbers_that_are_not_free_are_zero() {
        let points = points([101.8, 35.6, 200.0, 0.0], &[0.0]);
        let fit = CurveLinesFit::new(&points, [true, true, true, false]).unwrap();
        assert!((fit.numbers[0] - 101.8).abs() < 1e-6 && (fit.numbers[1] - 35.6).abs() < 1e-6);
        assert_eq!((fit.numbers[3], fit.half(3)), (0.0, 0.0));
    }

    #[test]
    fn points_that_tell_no_lines_are_refused() {
        let all = points([101.8, 35.6, 193.1, 22.1], &[0.0]);
        assert_eq!(
            CurveLinesFit::new(&all[..4], ALL),
            Err(FitError::TooFew { points: 4, needed: 5 })
        );
        // A single x determines no rise.
        let one: Vec<_> = all.iter().map(|point| LinePoint { x: 0.5, ..*point }).collect();
        assert_eq!(CurveLinesFit::new(&one, ALL), Err(FitError::NoLines));
    }
}
