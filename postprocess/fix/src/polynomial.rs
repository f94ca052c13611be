//! Polynomials through the crossings of a contour.
//!
//! Points are (row, column), the nearest to where the curve is wanted first.

/// The distance in pixels of a good fit from a point: a transition is a crossing rounded to
/// whole pixels, and the curve has some error of its own.
const ROUNDING: f64 = 0.6;
/// A parabola through fewer points shows the rounding rather than the slope.
const MIN_PARABOLA: usize = 6;

/// Returns the slope of a contour at the first of its points, in columns per row: of a parabola
/// through as many points as it fits, or of a straight line if these are few.
pub(super) fn slope(points: &[(f64, f64)]) -> f64 {
    let longest = |degree: usize| {
        (degree + 2..=points.len())
            .rev()
            .map(|n| (n, fit(&points[..n], degree)))
            .find(|(n, fit)| points[..*n].iter().all(|&point| fit.misses(point) < ROUNDING))
    };
    match longest(2) {
        Some((n, fit)) if n >= MIN_PARABOLA => fit.slope,
        _ => match (longest(1), points) {
            (Some((_, fit)), _) => fit.slope,
            (None, [first, second, ..]) => (second.1 - first.1) / (second.0 - first.0),
            (None, _) => 0.0,
        },
    }
}

/// Returns the value at a row of a parabola fitted to the points by least squares, or of a
/// straight line if there are fewer than four.
pub(super) fn parabola(points: &[(f64, f64)], row: f64) -> f64 {
    match points.len() {
        0 => 0.0,
        1 => points[0].1,
        n => fit(points, if n < 4 { 1 } else { 2 }).at(row),
    }
}

/// Returns the value at a row of the cubic from one point to another with these slopes there.
pub(super) fn hermite(
    from: (f64, f64),
    from_slope: f64,
    to: (f64, f64),
    to_slope: f64,
    row: f64,
) -> f64 {
    let length = to.0 - from.0;
    let chord = (to.1 - from.1) / length;
    // The slope at a corner or a tip says little about the far end, and would make the curve
    // overshoot.
    let most = 3.0 * chord.abs() + 4.0;
    let [from_slope, to_slope] = [from_slope, to_slope].map(|slope| slope.clamp(-most, most));
    let t = (row - from.0) / length;
    let (t2, t3) = (t * t, t * t * t);
    (2.0 * t3 - 3.0 * t2 + 1.0) * from.1
        + (t3 - 2.0 * t2 + t) * length * from_slope
        + (3.0 * t2 - 2.0 * t3) * to.1
        + (t3 - t2) * length * to_slope
}

/// A polynomial of second degree in the distance from the row of its first point.
struct Quadratic {
    from: f64,
    value: f64,
    slope: f64,
    bend: f64,
}

impl Quadratic {
    fn at(&self, row: f64) -> f64 {
        let d = row - self.from;
        self.value + d * (self.slope + d * self.bend)
    }

    fn misses(&self, point: (f64, f64)) -> f64 {
        (self.at(point.0) - point.1).abs()
    }
}

/// Fits a polynomial of degree 1 or 2 by least squares: the normal equations by Cramer's rule.
/// There must be more points than the degree, in different rows.
fn fit(points: &[(f64, f64)], degree: usize) -> Quadratic {
    let from = points[0].0;
    // Sums of powers of the rows, and of columns times these powers.
    let (mut s, mut v) = ([0.0; 5], [0.0; 3]);
    for &(row, value) in points {
        let d = row - from;
        let powers = [1.0, d, d * d, d * d * d, d * d * d * d];
        s.iter_mut().zip(powers).for_each(|(sum, power)| *sum += power);
        v.iter_mut().zip(powers).for_each(|(sum, power)| *sum += value * power);
    }
    if degree == 1 {
        let determinant = s[0] * s[2] - s[1] * s[1];
        let value = (v[0] * s[2] - v[1] * s[1]) / determinant;
        let slope = (s[0] * v[1] - s[1] * v[0]) / determinant;
        return Quadratic { from, value, slope, bend: 0.0 };
    }
    let columns = [[s[0], s[1], s[2]], [s[1], s[2], s[3]], [s[2], s[3], s[4]]];
    let [value, slope, bend] = std::array::from_fn(|which| {
        let mut replaced = columns;
        replaced[which] = v;
        determinant(&replaced) / determinant(&columns)
    });
    Quadratic { from, value, slope, bend }
}

fn determinant([a, b, c]: &[[f64; 3]; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The points of a contour, rounded as pixels are.
    fn points(contour: impl Fn(f64) -> f64, rows: usize) -> Vec<(f64, f64)> {
        (0..rows).map(|row| (row as f64, contour(row as f64).round())).collect()
    }

    #[test]
    fn slopes_of_rounded_lines_and_parabolas_are_found() {
        for tilt in [-7.3, -0.4, 0.0, 0.13, 2.5] {
            let line = points(|row| 100.0 + tilt * row, 12);
            assert!((slope(&line) - tilt).abs() < 0.25, "{tilt}: {}", slope(&line));
            let bent = points(|row| 100.0 + tilt * row + 0.2 * row * row, 12);
            assert!((slope(&bent) - tilt).abs() < 0.35, "{tilt}: {}", slope(&bent));
        }
        assert_eq!(slope(&[(3.0, 5.0)]), 0.0);
        assert_eq!(slope(&[(3.0, 5.0), (2.0, 9.0)]), -4.0);
    }

    #[test]
    fn a_corner_behind_the_first_rows_does_not_bend_the_slope() {
        let corner = points(|row| 100.0 + if row < 6.0 { 0.0 } else { 30.0 * (row - 6.0) }, 12);
        assert!(slope(&corner).abs() < 0.2);
    }

    #[test]
    fn hermite_meets_points_and_slopes_and_is_exact_for_cubics() {
        let cubic = |x: f64| 2.0 + 0.5 * x - 0.1 * x * x + 0.01 * x * x * x;
        let derivative = |x: f64| 0.5 - 0.2 * x + 0.03 * x * x;
        let (a, b) = (2.0, 8.0);
        for row in [2.0, 3.5, 5.0, 7.0, 8.0] {
            let at = hermite((a, cubic(a)), derivative(a), (b, cubic(b)), derivative(b), row);
            assert!((at - cubic(row)).abs() < 1e-12);
        }
    }

    #[test]
    fn squares_of_widths_of_circles_and_wedges_are_parabolas() {
        let circle: Vec<_> =
            (0..6).map(|d| (d.into(), 400.0 - f64::from(10 - d).powi(2))).collect();
        assert!((parabola(&circle, -3.0) - (400.0 - 169.0)).abs() < 1e-9);
        let wedge: Vec<_> = (0..6).map(|d| (d.into(), f64::from(4 + 2 * d).powi(2))).collect();
        assert!((parabola(&wedge, -1.0) - 4.0).abs() < 1e-9);
    }
}
