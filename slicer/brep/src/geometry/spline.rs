//! Rational B-splines: basis functions, curves and surfaces.

use crate::vector::{Vec3, distance};

/// The highest degree that is read.
pub(crate) const MOST_DEGREE: usize = 25;

/// Knots and degree along one parameter.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Knots {
    degree: usize,
    /// Each as often as it counts, never falling.
    knots: Vec<f64>,
}

/// The basis functions at a parameter that are not zero, and their derivatives.
struct Basis {
    /// The first control point that counts.
    first: usize,
    values: [f64; MOST_DEGREE + 1],
    slopes: [f64; MOST_DEGREE + 1],
}

impl Knots {
    /// Knots for `count` control points; nothing if they do not fit or fall.
    pub(crate) fn new(degree: usize, knots: Vec<f64>, count: usize) -> Option<Self> {
        let fits = (1..=MOST_DEGREE).contains(&degree)
            && count > degree
            && knots.len() == count + degree + 1
            && knots.iter().all(|knot| knot.is_finite())
            && knots.windows(2).all(|pair| pair[0] <= pair[1])
            && knots[degree] < knots[count];
        fits.then_some(Self { degree, knots })
    }

    /// Where the spline begins and ends.
    pub(crate) fn domain(&self) -> [f64; 2] {
        [self.knots[self.degree], self.knots[self.knots.len() - 1 - self.degree]]
    }

    /// The knots backwards: for control points that are turned over.
    fn reversed(&self) -> Self {
        let [start, end] = self.domain();
        let knots = self.knots.iter().rev().map(|knot| start + end - knot).collect();
        Self { degree: self.degree, knots }
    }

    /// The knots of the domain, each once.
    pub(crate) fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.knots[self.degree..self.knots.len() - self.degree].to_vec();
        breaks.dedup();
        breaks
    }

    /// How many control points there are.
    fn count(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// Parameters between which the spline bends little.
    fn samples(&self) -> Vec<f64> {
        let breaks = self.breaks();
        let parts = (2 * self.degree).min(6).max(24 / breaks.len());
        let within = |pair: &[f64]| {
            let [a, b] = [pair[0], pair[1]];
            (0..parts).map(move |k| a + (b - a) * k as f64 / parts as f64).collect::<Vec<_>>()
        };
        breaks.windows(2).flat_map(within).chain(breaks.last().copied()).collect()
    }

    /// The basis at `t`; beyond the domain, that of the last piece continued
    /// (algorithms A2.1 to A2.3 of *The NURBS Book*).
    fn basis(&self, t: f64) -> Basis {
        let (p, k) = (self.degree, &self.knots);
        let [start, end] = self.domain();
        let span = if t >= end {
            k.partition_point(|&knot| knot < end) - 1
        } else {
            k.partition_point(|&knot| knot <= t.max(start)) - 1
        };
        let mut values = [0.0; MOST_DEGREE + 1];
        let mut slopes = [0.0; MOST_DEGREE + 1];
        values[0] = 1.0;
        for degree in 1..=p {
            if degree == p {
                // The slopes follow from the basis of one degree less.
                let mut left = 0.0;
                for r in 0..degree {
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
        Basis { first: span - p, values, slopes }
    }
}

/// A control point times its weight, and the weight.
pub(crate) type Weighted = [f64; 4];

/// A point with its weight.
pub(crate) fn weighted(p: Vec3, w: f64) -> Weighted {
    [p[0] * w, p[1] * w, p[2] * w, w]
}

fn add_times(sum: &mut Weighted, p: &Weighted, by: f64) {
    sum.iter_mut().zip(p).for_each(|(sum, p)| *sum += p * by);
}

/// The point, and the derivative of a quotient.
fn divided(p: &Weighted) -> Vec3 {
    [p[0] / p[3], p[1] / p[3], p[2] / p[3]]
}

fn divided_slope(p: Vec3, w: f64, slope: &Weighted) -> Vec3 {
    [0, 1, 2].map(|k| (slope[k] - slope[3] * p[k]) / w)
}

/// A B-spline curve.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SplineCurve {
    pub(crate) knots: Knots,
    pub(crate) points: Vec<Weighted>,
}

impl SplineCurve {
    /// The same curve, followed the other way.
    pub(crate) fn reversed(mut self) -> Self {
        self.knots = self.knots.reversed();
        self.points.reverse();
        self
    }

    /// The point and the derivative at `t`.
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

/// A B-spline surface.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SplineSurface {
    pub(crate) u: Knots,
    pub(crate) v: Knots,
    /// Row by row: those of one u beside each other.
    pub(crate) points: Vec<Weighted>,
    /// How many points there are along v.
    columns: usize,
    /// After which lengths u and v come again, where the surface is closed.
    pub(crate) periods: [Option<f64>; 2],
}

/// How far apart the sides of a closed surface may lie, in millimetres.
const CLOSED_MM: f64 = 1e-6;

impl SplineSurface {
    /// A surface; nothing if there are not as many points as the knots say.
    pub(crate) fn new(u: Knots, v: Knots, points: Vec<Weighted>) -> Option<Self> {
        let [rows, columns] = [u.count(), v.count()];
        if points.len() != rows * columns {
            return None;
        }
        let mut surface = Self { u, v, points, columns, periods: [None; 2] };
        surface.periods = [0, 1].map(|axis| surface.period(axis));
        Some(surface)
    }

    fn period(&self, axis: usize) -> Option<f64> {
        let [first, last] = [false, true].map(|last| self.side(axis, last));
        let is_closed = first.iter().zip(&last).all(|(a, b)| distance(*a, *b) < CLOSED_MM);
        let [start, end] = if axis == 0 { self.u.domain() } else { self.v.domain() };
        // A side that is one point meets itself without being closed.
        (is_closed && !is_point(&first)).then_some(end - start)
    }

    /// Parameters all over the surface.
    pub(crate) fn seeds(&self) -> Vec<[f64; 2]> {
        let [us, vs] = [&self.u, &self.v].map(Knots::samples);
        us.iter().flat_map(|&u| vs.iter().map(move |&v| [u, v])).collect()
    }

    /// The point and the derivatives along u and v.
    pub(crate) fn at(&self, u: f64, v: f64) -> [Vec3; 3] {
        let (along_u, along_v) = (self.u.basis(u), self.v.basis(v));
        let mut sums = [[0.0; 4]; 3];
        for i in 0..=self.u.degree {
            let row = (along_u.first + i) * self.columns + along_v.first;
            let (mut value, mut slope) = ([0.0; 4], [0.0; 4]);
            for j in 0..=self.v.degree {
                let control = &self.points[row + j];
                add_times(&mut value, control, along_v.values[j]);
                add_times(&mut slope, control, along_v.slopes[j]);
            }
            add_times(&mut sums[0], &value, along_u.values[i]);
            add_times(&mut sums[1], &value, along_u.slopes[i]);
            add_times(&mut sums[2], &slope, along_u.values[i]);
        }
        let p = divided(&sums[0]);
        let w = sums[0][3];
        [p, divided_slope(p, w, &sums[1]), divided_slope(p, w, &sums[2])]
    }

    /// Points all along a side of the domain: where u (axis 0) or v (axis 1) is
    /// least or greatest. Knots need not be as often there as the side's control
    /// points would take.
    pub(crate) fn side(&self, axis: usize, last: bool) -> Vec<Vec3> {
        let (fixed, free) = if axis == 0 { (&self.u, &self.v) } else { (&self.v, &self.u) };
        let fixed = fixed.domain()[usize::from(last)];
        let at = |t: f64| if axis == 0 { self.at(fixed, t)[0] } else { self.at(t, fixed)[0] };
        free.samples().into_iter().map(at).collect()
    }

    /// Whether a side of the domain is one point.
    pub(crate) fn is_pole(&self, axis: usize, last: bool) -> bool {
        is_point(&self.side(axis, last))
    }
}

fn is_point(side: &[Vec3]) -> bool {
    side.iter().all(|p| distance(*p, side[0]) < CLOSED_MM)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::length;

    /// A quarter of a circle of radius 2, exactly.
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
    fn slopes_of_a_surface_are_those_of_its_points() {
        let u = Knots::new(2, vec![0.0, 0.0, 0.0, 0.4, 1.0, 1.0, 1.0], 4).unwrap();
        let v = Knots::new(3, vec![0.0, 0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 2.0], 4).unwrap();
        let control = |k: usize| {
            let (i, j) = ((k / 4) as f64, (k % 4) as f64);
            weighted([i, j, (i * 1.3 + j * j * 0.4).sin()], 1.0 + 0.1 * i)
        };
        let surface = SplineSurface::new(u, v, (0..16).map(control).collect()).unwrap();
        assert_eq!(surface.periods, [None; 2]);
        for (u, v) in [(0.0, 0.0), (0.4, 1.0), (0.7, 1.9), (1.0, 2.0)] {
            let [_, du, dv] = surface.at(u, v);
            // One-sided at a knot, where the second derivative jumps.
            let h = 1e-6;
            let difference =
                |a: [Vec3; 3], b: [Vec3; 3]| [0, 1, 2].map(|k| (a[0][k] - b[0][k]) / h);
            let (here, sign) = (surface.at(u, v), if u < 1.0 { 1.0 } else { -1.0 });
            let along_u = difference(surface.at(u + sign * h, v), here).map(|d| d * sign);
            let along_v = difference(surface.at(u, v + h), here);
            assert!(distance(du, along_u) < 2e-4 && distance(dv, along_v) < 2e-4);
        }
        let side = surface.side(1, true);
        assert_eq!(
            (side[0], side.last()),
            (surface.at(0.0, 2.0)[0], Some(&surface.at(1.0, 2.0)[0]))
        );
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
