//! Fits a straight line to points by least squares.

use super::FitError;
use super::student_t::t_95;

/// The least-squares line through points, with its 95% intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LineFit {
    mean_x: f64,
    mean_y: f64,
    /// The number of points.
    pub(super) points: usize,
    /// Whether all y are the same.
    level: bool,
    /// The rise of y for one x.
    pub(super) slope: f64,
    /// The share of the scatter of y that the line explains.
    pub(super) r2: f64,
    /// The squared half width of the 95% interval of `mean_y`, and of the slope.
    mean_half2: f64,
    slope_half2: f64,
}

impl LineFit {
    /// Fits points (x, y).
    ///
    /// # Errors
    /// Returns an error if there are fewer than three points, or all have one x.
    pub(super) fn new(points: &[(f64, f64)]) -> Result<Self, FitError> {
        if points.len() < 3 {
            return Err(FitError::TooFew { points: points.len(), needed: 3 });
        }
        let n = points.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
        let (mean_x, mean_y) = (mean(|p| p.0), mean(|p| p.1));
        let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
            points.iter().map(|&(x, y)| of(x - mean_x, y - mean_y)).sum()
        };
        let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
        // Compared exactly: by rounding, the sum of squares need not be zero.
        if points.iter().all(|point| point.0 == points[0].0) {
            return Err(FitError::TooFewDoses { doses: 1, needed: 2 });
        }
        let slope = xy / xx;
        // Of sums about the means, the line goes through both means.
        let left = sum(&|x, y| (y - slope * x).powi(2));
        // Slope and mean take two degrees of freedom.
        let half2 = t_95(points.len() - 2).powi(2) * left / (n - 2.0);
        let r2 = if yy > 0.0 { 1.0 - left / yy } else { 0.0 };
        Ok(Self {
            points: points.len(),
            level: points.iter().all(|point| point.1 == points[0].1),
            mean_x,
            mean_y,
            slope,
            r2,
            mean_half2: half2 / n,
            slope_half2: half2 / xx,
        })
    }

    /// Returns half the width of the slope's 95% interval.
    pub(super) fn slope_half(&self) -> f64 {
        self.slope_half2.sqrt()
    }

    /// Returns the line's y.
    pub(super) fn at(&self, x: f64) -> f64 {
        self.mean_y + self.slope * (x - self.mean_x)
    }

    /// Returns half the width of the 95% interval of the line's y.
    pub(super) fn half_at(&self, x: f64) -> f64 {
        (self.mean_half2 + self.slope_half2 * (x - self.mean_x).powi(2)).sqrt()
    }

    /// Checks that the line rises by more than its interval. `unit` is the slope's.
    pub(super) fn rising(self, unit: &'static str) -> Result<Self, FitError> {
        let (slope, half) = (self.slope, self.slope_half());
        if self.level {
            Err(FitError::Level(self.mean_y))
        } else if slope > half {
            Ok(self)
        } else if slope < -half {
            Err(FitError::Falls { slope, unit })
        } else {
            Err(FitError::Scatters { slope, half, unit })
        }
    }

    /// Returns the x where a rising line is zero, and the ends of its 95% interval by Fieller's
    /// theorem: every x at which the interval of y holds zero. Unlike the delta method's interval,
    /// this one is exact, and lopsided.
    pub(super) fn zero(&self) -> [f64; 3] {
        let (a, b) = (self.mean_y, self.slope);
        // (a + b u)² = mean_half2 + slope_half2 u², with u = x - mean_x.
        let square = b * b - self.slope_half2;
        let root = (self.mean_half2 * square + a * a * self.slope_half2).sqrt();
        [-a / b, (-a * b - root) / square, (-a * b + root) / square].map(|u| u + self.mean_x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [(f64, f64); 6] =
        [(1.0, 2.1), (2.0, 3.9), (3.0, 6.2), (4.0, 7.8), (5.0, 10.1), (7.0, 13.7)];

    #[test]
    fn it_agrees_with_another_program() {
        // scipy.stats.linregress and t.ppf.
        let line = LineFit::new(&POINTS).unwrap();
        assert!((line.slope - 1.950000000000).abs() < 1e-9);
        assert!((line.at(0.0) - 0.150000000000).abs() < 1e-9);
        assert!((line.r2 - 0.998480756246).abs() < 1e-9);
        assert!((line.slope_half() - 0.105593597716).abs() < 1e-9);
        assert!((line.half_at(0.0) - 0.439621204251).abs() < 1e-9);
    }

    #[test]
    fn the_zero_lies_where_the_band_ends() {
        let line = LineFit::new(&POINTS).unwrap().rising("").unwrap();
        let [zero, low, high] = line.zero();
        assert!(low < zero && zero < high);
        assert!(line.at(zero).abs() < 1e-12);
        assert!((line.at(low) + line.half_at(low)).abs() < 1e-12);
        assert!((line.at(high) - line.half_at(high)).abs() < 1e-12);
    }

    #[test]
    fn exact_points_leave_no_doubt() {
        let line = LineFit::new(&[(1.0, 1.0), (2.0, 3.0), (3.0, 5.0)]).unwrap();
        assert_eq!((line.slope, line.r2, line.slope_half()), (2.0, 1.0, 0.0));
        assert_eq!(line.zero(), [0.5, 0.5, 0.5]);
    }

    #[test]
    fn what_does_not_rise_for_sure_is_refused() {
        let refused = |points: &[(f64, f64)]| {
            LineFit::new(points).and_then(|line| line.rising("um")).unwrap_err()
        };
        assert_eq!(refused(&POINTS[..2]), FitError::TooFew { points: 2, needed: 3 });
        let one = [(1.0, 1.0), (1.0, 2.0), (1.0, 3.0)];
        assert_eq!(refused(&one), FitError::TooFewDoses { doses: 1, needed: 2 });
        let falls = [(1.0, 3.0), (2.0, 2.0), (3.0, 0.9)];
        assert!(matches!(refused(&falls), FitError::Falls { .. }));
        let level = [(1.0, 3.0), (2.0, 5.0), (3.0, 3.1)];
        assert!(matches!(refused(&level), FitError::Scatters { .. }));
        let flat = [(1.0, 3.0), (2.0, 3.0), (3.0, 3.0)];
        assert_eq!(refused(&flat), FitError::Level(3.0));
    }
}
