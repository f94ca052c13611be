//! Evaluates rational B-splines: basis functions and curves.

use crate::vector::Vec3;

/// The highest supported degree.
pub(crate) const MAX_DEGREE: usize = 25;

/// Knots and degree along one parameter.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Knots {
    degree: usize,
    /// The knots in ascending order, repeated by multiplicity.
    knots: Vec<f64>,
}

/// The basis functions that are not zero at a parameter, and their derivatives.
pub(super) struct BasisValues<const MOST: usize> {
    /// The first control point that affects it.
    pub(super) first: usize,
    pub(super) values: [f64; MOST],
    pub(super) slopes: [f64; MOST],
}

impl Knots {
    /// Returns knots for `count` control points, or `None` if their number is wrong or they
    /// descend.
    pub(crate) fn new(degree: usize, knots: Vec<f64>, count: usize) -> Option<Self> {
        let fits = (1..=MAX_DEGREE).contains(&degree)
            && count > degree
            && knots.len() == count + degree + 1
            && knots.iter().all(|knot| knot.is_finite())
            && knots.windows(2).all(|pair| pair[0] <= pair[1])
            && knots[degree] < knots[count];
        fits.then_some(Self { degree, knots })
    }

    /// Returns the range of the parameter.
    pub(crate) fn domain(&self) -> [f64; 2] {
        [self.knots[self.degree], self.knots[self.knots.len() - 1 - self.degree]]
    }

    /// Returns the knots in reverse, for reversed control points.
    fn reversed(&self) -> Self {
        let [start, end] = self.domain();
        let knots = self.knots.iter().rev().map(|knot| start + end - knot).collect();
        Self { degree: self.degree, knots }
    }

    /// Returns the distinct knots of the domain.
    pub(crate) fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.knots[self.degree..self.knots.len() - self.degree].to_vec();
        breaks.dedup();
        breaks
    }

    pub(super) fn degree(&self) -> usize {
        self.degree
    }

    /// Returns all knots, repeated by multiplicity.
    pub(super) fn list(&self) -> &[f64] {
        &self.knots
    }

    /// Returns the number of control points.
    pub(super) fn count(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// Returns parameters between which the spline bends little.
    pub(super) fn samples(&self) -> Vec<f64> {
        let breaks = self.breaks();
        // A spline of few pieces gets more samples in each, so that a search has a start near every
        // bend.
        let parts = (2 * self.degree).min(6).max(24 / breaks.len());
        let within = |pair: &[f64]| {
            let [a, b] = [pair[0], pair[1]];
            (0..parts).map(move |k| a + (b - a) * k as f64 / parts as f64).collect::<Vec<_>>()
        };
        breaks.windows(2).flat_map(within).chain(breaks.last().copied()).collect()
    }

    /// Returns the index of the last knot at or before `t` with a greater one after it.
    pub(super) fn span(&self, t: f64) -> usize {
        let [start, end] = self.domain();
        if t >= end {
            // Pieces are half-open; the last one also has its end.
            self.knots.partition_point(|&knot| knot < end) - 1
        } else {
            self.knots.partition_point(|&knot| knot <= t.max(start)) - 1
        }
    }

    /// Returns the basis at `t`; outside the domain, the first or last piece is continued (*The
    /// NURBS Book*, algorithms A2.1 to A2.3).
    pub(super) fn basis(&self, t: f64) -> BasisValues<{ MAX_DEGREE + 1 }> {
        let (p, k, span) = (self.degree, &self.knots, self.span(t));
        let mut values = [0.0; MAX_DEGREE + 1];
        let mut slopes = [0.0; MAX_DEGREE + 1];
        values[0] = 1.0;
        for degree in 1..=p {
            if degree == p {
                // The derivatives follow from the basis of one degree less.
                let mut left = 0.0;
                for r in 0..degree {
                    // *The NURBS Book*, equation 2.7. The span is not empty, and each width
                    // includes it.
                    let width = k[span + r + 1] - k[span + r + 1 - degree];
                    let part = degree as f64 * values[r] / width;
                    slopes[r] = left - part;
                    left = part;
                }
                slopes[degree] = left;
            }
            let mut saved = 0.0;
            for r in 0..degree {
                let (low, high) = (k[span + r + 1 - degree], k[span + r + 1]);
                let part = values[r] / (high - low);
                values[r] = saved + (high - t) * part;
                saved = (t - low) * part;
            }
            values[degree] = saved;
        }
        BasisValues { first: span - p, values, slopes }
    }
}

/// A control point times its weight, then the weight.
pub(crate) type WeightedPoint = [f64; 4];

/// Returns a point times its weight, then the weight.
pub(crate) fn weighted(p: Vec3, w: f64) -> WeightedPoint {
    [p[0] * w, p[1] * w, p[2] * w, w]
}

pub(super) fn add_times(sum: &mut WeightedPoint, p: &WeightedPoint, by: f64) {
    sum.iter_mut().zip(p).for_each(|(sum, p)| *sum += p * by);
}

/// Divides by the weight.
pub(super) fn divided(p: &WeightedPoint) -> Vec3 {
    [p[0] / p[3], p[1] / p[3], p[2] / p[3]]
}

pub(super) fn divided_slope(p: Vec3, w: f64, slope: &WeightedPoint) -> Vec3 {
    // The quotient rule for A / w, whose value is p.
    [0, 1, 2].map(|k| (slope[k] - slope[3] * p[k]) / w)
}

/// A B-spline curve.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SplineCurve {
    pub(crate) knots: Knots,
    pub(crate) points: Vec<WeightedPoint>,
}

impl SplineCurve {
    /// Returns the same curve in the other direction.
    pub(crate) fn reversed(mut self) -> Self {
        self.knots = self.knots.reversed();
        self.points.reverse();
        self
    }

    /// Returns the point and the derivative at `t`.
    pub(crate) fn at(&self, t: f64) -> [Vec3; 2] {
        let basis = self.knots.basis(t);
        let (mut point, mut slope) = ([0.0; 4], [0.0; 4]);
        for k in 0..=self.knots.degree {
            let control = &self.points[basis.first + k];
            add_times(&mut point, control, basis.values[k]);
            add_times(&mut slope, control, basis.slopes[k]);
        }
        let p = divided(&point);
        [p, divided_slope(p, point[3], &slope)]
    }
}

/// Moves a periodic parameter into the domain.
pub(super) fn inside(t: f64, domain: Option<[f64; 2]>, period: Option<f64>) -> f64 {
    match (domain, period) {
        (Some([low, high]), Some(period)) if t < low || t > high => {
            low + (t - low).rem_euclid(period)
        }
        _ => t,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::{distance, length};

    /// Returns an exact quarter of a circle of radius 2.
    fn quarter() -> SplineCurve {
        let w = std::f64::consts::FRAC_1_SQRT_2;
        SplineCurve {
            knots: Knots::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], 3).unwrap(),
            points: vec![
                weighted([2.0, 0.0, 0.0], 1.0),
                weighted([2.0, 2.0, 0.0], w),
                weighted([0.0, 2.0, 0.0], 1.0),
            ],
        }
    }

    #[test]
    fn a_rational_quarter_is_a_circle() {
        let curve = quarter();
        for k in 0..=10 {
            let t = f64::from(k) / 10.0;
            let [p, d] = curve.at(t);
            assert!((length(p) - 2.0).abs() < 1e-14);
            let step = 1e-6;
            let by_difference =
                [0, 1, 2].map(|k| (curve.at(t + step)[0][k] - curve.at(t - step)[0][k]) / 2e-6);
            assert!(distance(d, by_difference) < 1e-8, "{d:?} {by_difference:?}");
            assert!(distance(curve.clone().reversed().at(1.0 - t)[0], p) < 1e-14);
        }
    }

    #[test]
    fn knots_that_do_not_fit_are_refused() {
        let knots = |list: &[f64], count| Knots::new(1, list.to_vec(), count);
        assert!(knots(&[0.0, 0.0, 1.0, 1.0], 2).is_some());
        assert!(knots(&[0.0, 0.0, 1.0, 1.0], 3).is_none());
        assert!(knots(&[0.0, 2.0, 1.0, 1.0], 2).is_none());
        assert!(knots(&[0.0, 1.0, 1.0, 1.0], 2).is_none());
        assert!(knots(&[0.0, f64::NAN, 1.0, 1.0], 2).is_none());
        assert!(Knots::new(0, vec![0.0, 1.0, 1.0], 2).is_none());
        assert!(Knots::new(26, vec![0.0; 60], 33).is_none());
    }
}
