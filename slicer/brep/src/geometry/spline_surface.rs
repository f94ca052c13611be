//! Evaluates surfaces of rational B-splines.

use super::spline::{Knots, WeightedPoint, add_times, divided, divided_slope, inside};
use super::strips::PolynomialStrips;
use crate::kernel::Jet;
use crate::vector::{Vec3, distance};

/// A B-spline surface.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SplineSurface {
    pub(crate) u: Knots,
    pub(crate) v: Knots,
    /// The control points, by u and then v.
    pub(crate) points: Vec<WeightedPoint>,
    /// The number of points along v.
    columns: usize,
    /// The same surface as polynomials, unless its degrees are too high.
    strips: Option<PolynomialStrips>,
    /// The periods of u and v, where the surface is closed.
    pub(crate) periods: [Option<f64>; 2],
}

/// The greatest gap between the sides of a closed surface, in millimeters.
const CLOSED_MM: f64 = 1e-6;

impl SplineSurface {
    /// Returns a surface, or `None` if the number of points does not fit the knots.
    pub(crate) fn new(u: Knots, v: Knots, points: Vec<WeightedPoint>) -> Option<Self> {
        let [rows, columns] = [u.count(), v.count()];
        if points.len() != rows * columns {
            return None;
        }
        let strips = PolynomialStrips::new(&u, &v, &points);
        let periods = [None; 2];
        let mut surface = Self { u, v, points, columns, strips, periods };
        surface.periods = [0, 1].map(|axis| surface.period(axis));
        Some(surface)
    }

    fn period(&self, axis: usize) -> Option<f64> {
        let [first, last] = [false, true].map(|last| self.side(axis, last));
        let is_closed = first.iter().zip(&last).all(|(a, b)| distance(*a, *b) < CLOSED_MM);
        let [start, end] = if axis == 0 { self.u.domain() } else { self.v.domain() };
        // A side that is a single point is a pole, not a seam.
        (is_closed && !is_point(&first)).then_some(end - start)
    }

    /// Returns parameters spread over the surface.
    pub(crate) fn seeds(&self) -> Vec<[f64; 2]> {
        let [us, vs] = [&self.u, &self.v].map(Knots::samples);
        us.iter().flat_map(|&u| vs.iter().map(move |&v| [u, v])).collect()
    }

    /// Returns the point and the first derivatives.
    pub(crate) fn at(&self, uv: [f64; 2]) -> Jet {
        let mut jet = [Jet::default()];
        self.evaluate(&[uv], &mut jet);
        jet[0]
    }

    /// Evaluates many parameters at once.
    pub(super) fn evaluate(&self, uv: &[[f64; 2]], jets: &mut [Jet]) {
        match &self.strips {
            Some(strips) => strips.evaluate(uv, jets),
            None => jets.iter_mut().zip(uv).for_each(|(jet, &uv)| *jet = self.by_knots(uv)),
        }
    }

    /// Evaluates by the basis functions, at any degree.
    pub(super) fn by_knots(&self, [u, v]: [f64; 2]) -> Jet {
        let (along_u, along_v) = (self.u.basis(u), self.v.basis(v));
        let mut sums = [[0.0; 4]; 3];
        for i in 0..=self.u.degree() {
            let row = (along_u.first + i) * self.columns + along_v.first;
            let (mut value, mut slope) = ([0.0; 4], [0.0; 4]);
            for j in 0..=self.v.degree() {
                let control = &self.points[row + j];
                add_times(&mut value, control, along_v.values[j]);
                add_times(&mut slope, control, along_v.slopes[j]);
            }
            add_times(&mut sums[0], &value, along_u.values[i]);
            add_times(&mut sums[1], &value, along_u.slopes[i]);
            add_times(&mut sums[2], &slope, along_u.values[i]);
        }
        let (point, w) = (divided(&sums[0]), sums[0][3]);
        let slope = |sum| divided_slope(point, w, sum);
        Jet { point, du: slope(&sums[1]), dv: slope(&sums[2]) }
    }

    /// Moves parameters by periods into the domain, where the surface is closed.
    #[inline]
    pub(super) fn inside(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let u = inside(u, Some(self.u.domain()), self.periods[0]);
        let v = inside(v, Some(self.v.domain()), self.periods[1]);
        [u, v]
    }

    /// Returns points along the side of the domain where u (axis 0) or v (axis 1) is least or
    /// greatest. Evaluates the surface, because the control points are on the side only if its
    /// knots are clamped.
    pub(crate) fn side(&self, axis: usize, last: bool) -> Vec<Vec3> {
        let (fixed, free) = if axis == 0 { (&self.u, &self.v) } else { (&self.v, &self.u) };
        let fixed = fixed.domain()[usize::from(last)];
        let at = |t: f64| self.at(if axis == 0 { [fixed, t] } else { [t, fixed] }).point;
        free.samples().into_iter().map(at).collect()
    }

    /// Returns whether a side of the domain is one point.
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
    use crate::geometry::spline::weighted;
    use crate::vector::length;

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
            let Jet { du, dv, .. } = surface.at([u, v]);
            // One-sided at a knot, where the second derivative jumps.
            let h = 1e-6;
            let difference = |a: Jet, b: Jet| [0, 1, 2].map(|k| (a.point[k] - b.point[k]) / h);
            let (here, sign) = (surface.at([u, v]), if u < 1.0 { 1.0 } else { -1.0 });
            let along_u = difference(surface.at([u + sign * h, v]), here).map(|d| d * sign);
            let along_v = difference(surface.at([u, v + h]), here);
            assert!(distance(du, along_u) < 2e-4 && distance(dv, along_v) < 2e-4);
        }
        let side = surface.side(1, true);
        let ends = [[0.0, 2.0], [1.0, 2.0]].map(|uv| surface.at(uv).point);
        assert_eq!([side[0], side[side.len() - 1]], ends);
    }

    /// Returns a pseudorandom number from 0 to 1.
    fn any(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns knots of random spacing and multiplicity, with ends clamped or not.
    fn any_knots(state: &mut u64) -> Knots {
        let degree = 1 + (any(state) * 7.0) as usize;
        let (is_even, is_clamped) = (any(state) < 0.3, any(state) < 0.7);
        let mut knots = vec![0.0; if is_clamped { degree + 1 } else { 1 }];
        let mut at = 0.0;
        for _ in 0..8 + 2 * degree {
            at += if is_even { 1.0 } else { 10_f64.powf(-2.0 * any(state)) };
            let times =
                if any(state) < 0.7 { 1 } else { 1 + (any(state) * degree as f64) as usize };
            knots.extend(std::iter::repeat_n(at, times));
        }
        if is_clamped {
            knots.extend(std::iter::repeat_n(at + 0.5, degree + 1));
        }
        let count = knots.len() - degree - 1;
        Knots::new(degree, knots, count).unwrap()
    }

    /// Returns a surface through a box of 200 mm, with or without weights.
    fn any_surface(state: &mut u64, is_rational: bool) -> SplineSurface {
        let (u, v) = (any_knots(state), any_knots(state));
        let control = |_| {
            let p = [0, 1, 2].map(|_| 200.0 * any(state) - 100.0);
            weighted(p, if is_rational { 0.75 + any(state) / 2.0 } else { 1.0 })
        };
        let points = (0..u.count() * v.count()).map(control).collect();
        SplineSurface::new(u, v, points).unwrap()
    }

    /// Returns a random parameter, sometimes a knot or slightly outside the domain.
    fn any_parameter(state: &mut u64, knots: &Knots) -> f64 {
        let ([low, high], breaks) = (knots.domain(), knots.breaks());
        match any(state) {
            x if x < 0.1 => breaks[(any(state) * breaks.len() as f64) as usize],
            x if x < 0.2 => low - 0.1 * x * (breaks[1] - low),
            x if x < 0.3 => high + 0.2 * (x - 0.2) * (high - breaks[breaks.len() - 2]),
            _ => low + (high - low) * any(state),
        }
    }

    #[test]
    fn polynomials_agree_with_the_basis_functions() {
        let mut state = 7;
        for number in 0..300 {
            let surface = any_surface(&mut state, number % 2 == 0);
            assert!(surface.strips.is_some());
            let mut place = |_| [&surface.u, &surface.v].map(|t| any_parameter(&mut state, t));
            let places: Vec<[f64; 2]> = (0..100).map(&mut place).collect();
            let mut jets = vec![Jet::default(); places.len()];
            surface.evaluate(&places, &mut jets);
            for (jet, &uv) in jets.iter().zip(&places) {
                let by_knots = surface.by_knots(uv);
                let off = distance(jet.point, by_knots.point);
                assert!(off < 1e-13 * 100.0, "{number} {uv:?}: {off:e}");
                for (a, b) in [(jet.du, by_knots.du), (jet.dv, by_knots.dv)] {
                    let off = distance(a, b);
                    assert!(off < 1e-11 * length(b).max(100.0), "{number} {uv:?}: {off:e}");
                }
            }
        }
    }
}
