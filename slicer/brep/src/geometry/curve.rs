//! Evaluates curves of edges: points, derivatives, nearest points and polylines.

use std::f64::consts::TAU;

use super::chain::CurveChain;
use super::spline::SplineCurve;
use super::surface_curve::SurfaceCurve;
use crate::vector::{Axes, Vec3, along, distance, dot, scale, sub};

/// A curve in space, in millimeters, with the parameter of ISO 10303-42.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Curve {
    Line {
        point: Vec3,
        direction: Vec3,
    },
    /// A circle has two equal radii.
    Ellipse {
        axes: Axes,
        radii: [f64; 2],
    },
    Hyperbola {
        axes: Axes,
        half_axes: [f64; 2],
    },
    Parabola {
        axes: Axes,
        focal: f64,
    },
    Spline(SplineCurve),
    Chain(CurveChain),
    OnSurface(Box<SurfaceCurve>),
}

/// The greatest number of steps of the search for the nearest point.
const MAX_STEPS: usize = 30;

impl Curve {
    /// Returns the point and the derivative at `t`.
    pub(crate) fn at(&self, t: f64) -> [Vec3; 2] {
        let in_axes = |axes: &Axes, p: Vec3, d: Vec3| [axes.point(p), axes.direction(d)];
        match self {
            Self::Line { point, direction } => [along(*point, *direction, t), *direction],
            Self::Ellipse { axes, radii: [a, b] } => {
                let (sin, cos) = t.sin_cos();
                in_axes(axes, [a * cos, b * sin, 0.0], [-a * sin, b * cos, 0.0])
            }
            Self::Hyperbola { axes, half_axes: [a, b] } => {
                let (sinh, cosh) = (t.sinh(), t.cosh());
                in_axes(axes, [a * cosh, b * sinh, 0.0], [a * sinh, b * cosh, 0.0])
            }
            Self::Parabola { axes, focal } => in_axes(
                axes,
                [focal * t * t, 2.0 * focal * t, 0.0],
                [2.0 * focal * t, 2.0 * focal, 0.0],
            ),
            Self::Spline(spline) => spline.at(t),
            Self::Chain(chain) => chain.at(t),
            Self::OnSurface(curve) => curve.at(t),
        }
    }

    /// Returns the same curve in the other direction.
    pub(crate) fn reversed(self) -> Self {
        match self {
            Self::Line { point, direction } => {
                Self::Line { point, direction: scale(direction, -1.0) }
            }
            Self::Ellipse { axes, radii } => Self::Ellipse { axes: axes.turned(), radii },
            Self::Hyperbola { axes, half_axes } => {
                Self::Hyperbola { axes: axes.turned(), half_axes }
            }
            Self::Parabola { axes, focal } => Self::Parabola { axes: axes.turned(), focal },
            Self::Spline(spline) => Self::Spline(spline.reversed()),
            Self::Chain(chain) => Self::Chain(chain.reversed()),
            Self::OnSurface(curve) => Self::OnSurface(Box::new(curve.reversed())),
        }
    }

    /// Returns the range of the parameter, if it is bounded.
    pub(crate) fn domain(&self) -> Option<[f64; 2]> {
        match self {
            Self::Ellipse { .. } => Some([0.0, TAU]),
            Self::Spline(spline) => Some(spline.knots.domain()),
            Self::Chain(chain) => Some(chain.domain()),
            Self::OnSurface(_) => Some(SurfaceCurve::DOMAIN),
            _ => None,
        }
    }

    /// Returns the parameters between which the curve is smooth.
    pub(super) fn breaks(&self) -> Option<Vec<f64>> {
        match self {
            Self::Spline(spline) => Some(spline.knots.breaks()),
            Self::Chain(chain) => Some(chain.breaks()),
            Self::OnSurface(curve) => Some(curve.breaks()),
            _ => None,
        }
    }

    /// Returns the period of a closed curve's parameter.
    pub(crate) fn period(&self) -> Option<f64> {
        match self {
            Self::Ellipse { .. } => Some(TAU),
            _ => {
                let [start, end] = self.domain()?;
                let apart = distance(self.at(start)[0], self.at(end)[0]);
                // The ends decide: the reader does not use the flag of closed curves.
                (apart < 1e-6).then_some(end - start)
            }
        }
    }

    /// Returns parameters between which the curve bends little.
    pub(crate) fn samples(&self) -> Vec<f64> {
        let parts = |breaks: &[f64], n: usize| -> Vec<f64> {
            let within = |pair: &[f64]| -> Vec<f64> {
                let [a, b] = [pair[0], pair[1]];
                (0..n).map(|k| a + (b - a) * k as f64 / n as f64).collect()
            };
            breaks.windows(2).flat_map(within).chain(breaks.last().copied()).collect()
        };
        match self {
            Self::Ellipse { .. } => parts(&[0.0, TAU], 16),
            _ => self.breaks().map_or(vec![-1.0, 0.0, 1.0], |breaks| parts(&breaks, 8)),
        }
    }

    /// Returns the parameter of the point nearest to `p`.
    pub(crate) fn project(&self, p: Vec3) -> f64 {
        match self {
            Self::Line { point, direction } => {
                dot(sub(p, *point), *direction) / dot(*direction, *direction)
            }
            Self::Ellipse { axes, radii: [a, b] } => {
                let [x, y, _] = axes.local(p);
                // Exact on a circle. On an ellipse it is a start.
                let t = (y / b).atan2(x / a);
                if a == b { t } else { self.nearer(p, t) }
            }
            Self::Hyperbola { axes, half_axes } => {
                // y alone determines a point of the branch, so it gives a start near the foot.
                self.nearer(p, (axes.local(p)[1] / half_axes[1]).asinh())
            }
            Self::Parabola { axes, focal } => self.nearer(p, axes.local(p)[1] / (2.0 * focal)),
            Self::Chain(chain) => chain.project(p),
            Self::Spline(_) | Self::OnSurface(_) => {
                let far = |t: &f64| distance(self.at(*t)[0], p);
                let nearer = |a: &f64, b: &f64| far(a).total_cmp(&far(b));
                let samples = self.samples();
                let nearest = samples.iter().copied().min_by(nearer).unwrap_or(0.0);
                let found = self.nearer(p, nearest);
                // A closed curve continues beyond its end at its start.
                match (self.period(), samples.as_slice()) {
                    (Some(_), &[first, .., last]) if nearest == first => {
                        let other = self.nearer(p, last);
                        if nearer(&other, &found).is_lt() { other } else { found }
                    }
                    _ => found,
                }
            }
        }
    }

    /// Searches for the foot of `p` from a start; returns the start if that diverges.
    fn nearer(&self, p: Vec3, start: f64) -> f64 {
        let clamp = |t: f64| match (self, self.domain()) {
            (Self::Spline(_) | Self::OnSurface(_), Some([low, high])) => t.clamp(low, high),
            _ => t,
        };
        let (mut t, mut best) = (start, (distance(self.at(start)[0], p), start));
        for _ in 0..MAX_STEPS {
            let [at, slope] = self.at(t);
            // Gauss-Newton: the foot on the tangent, without second derivatives.
            let step = dot(sub(p, at), slope) / dot(slope, slope);
            let next = clamp(t + step);
            if !next.is_finite() || (next - t).abs() <= 1e-15 * t.abs().max(1.0) {
                break;
            }
            t = next;
            let apart = distance(self.at(t)[0], p);
            if apart < best.0 {
                best = (apart, t);
            }
        }
        best.1
    }

    /// Returns the curve between two parameters as points, including both ends, whose
    /// polyline is within `chord_mm` of it.
    pub(crate) fn polyline(&self, [from, to]: [f64; 2], chord_mm: f64) -> Vec<Vec3> {
        let mut breaks = vec![from];
        match (self, self.breaks()) {
            (Self::Line { .. }, _) => {}
            (_, Some(knots)) => {
                let [start, end] = [knots[0], knots[knots.len() - 1]];
                // Closed curves may pass their seam.
                let turns = [-1.0, 0.0, 1.0].map(|turn| turn * (end - start));
                let all = turns.iter().flat_map(|turn| knots.iter().map(move |k| k + turn));
                let (low, high) = (from.min(to), from.max(to));
                let margin = 1e-9 * (end - start);
                let mut within: Vec<f64> =
                    all.filter(|k| (low + margin..high - margin).contains(k)).collect();
                within.sort_by(f64::total_cmp);
                within.dedup_by(|a, b| (*a - *b).abs() < margin);
                if from > to {
                    within.reverse();
                }
                breaks.extend(within);
            }
            _ => breaks.extend([0.25, 0.5, 0.75].map(|part| from + (to - from) * part)),
        }
        breaks.push(to);
        let mut points = vec![self.place(from)];
        for pair in breaks.windows(2) {
            // 2^16 pieces at most, if the curve is not finite and never becomes straight.
            self.bend([pair[0], pair[1]], chord_mm, 16, &mut points);
        }
        points
    }

    /// Returns the point at `t`, also past the seam of a closed spline.
    pub(crate) fn place(&self, t: f64) -> Vec3 {
        match (self, self.domain()) {
            (Self::Spline(_) | Self::Chain(_) | Self::OnSurface(_), Some([start, end]))
                if t < start || t > end =>
            {
                self.at(start + (t - start).rem_euclid(end - start))[0]
            }
            _ => self.at(t)[0],
        }
    }

    /// Adds the points of a piece without its first, halving the piece while it bends too
    /// much.
    fn bend(&self, [a, b]: [f64; 2], chord_mm: f64, depth: usize, points: &mut Vec<Vec3>) {
        let (p, q) = (self.place(a), self.place(b));
        // An S-shaped piece may have its middle on the chord, but not its quarters.
        let straight = |part: f64| {
            let x = self.place(a + (b - a) * part);
            let d = sub(q, p);
            let long = dot(d, d);
            let t = if long > 0.0 { (dot(sub(x, p), d) / long).clamp(0.0, 1.0) } else { 0.0 };
            distance(x, along(p, d, t)) <= chord_mm
        };
        let is_line = matches!(self, Self::Line { .. });
        if is_line || depth == 0 || [0.25, 0.5, 0.75].into_iter().all(straight) {
            points.push(q);
        } else {
            let middle = (a + b) / 2.0;
            self.bend([a, middle], chord_mm, depth - 1, points);
            self.bend([middle, b], chord_mm, depth - 1, points);
        }
    }
}

/// Returns the parameters of an edge from `start` to `end` on its curve, along it or
/// against it.
pub(crate) fn edge_range(curve: &Curve, start: Vec3, end: Vec3, forward: bool) -> [f64; 2] {
    let is_loop = distance(start, end) < 1e-9;
    let (mut from, mut to) = (curve.project(start), curve.project(end));
    if let Some(period) = curve.period() {
        let tiny = 1e-9 * period;
        if is_loop {
            to = if forward { from + period } else { from - period };
        } else {
            // On a closed curve, equal ends mean a full turn.
            let way = if forward { to - from } else { from - to }.rem_euclid(period);
            let way = if way < tiny { period } else { way };
            to = if forward { from + way } else { from - way };
        }
    } else if is_loop && let Some([low, high]) = curve.domain() {
        // Both ends project to one parameter, so an open curve would lose its whole length.
        [from, to] = if forward { [low, high] } else { [high, low] };
    }
    [from, to]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::spline::{Knots, weighted};
    use crate::vector::length;

    fn circle() -> Curve {
        Curve::Ellipse { axes: Axes::WORLD, radii: [5.0; 2] }
    }

    #[test]
    fn an_arc_goes_the_way_its_edge_goes() {
        let (a, b) = ([5.0, 0.0, 0.0], [0.0, 5.0, 0.0]);
        for (forward, start, end, turn) in [
            (true, a, b, 0.25),
            (true, b, a, 0.75),
            (false, a, b, -0.75),
            (false, b, a, -0.25),
            (true, a, a, 1.0),
            (false, a, a, -1.0),
            (true, a, scale(a, -1.0), 0.5),
        ] {
            let [from, to] = edge_range(&circle(), start, end, forward);
            assert!((to - from - turn * TAU).abs() < 1e-12, "{forward} {start:?} {end:?}");
        }
    }

    #[test]
    fn a_polyline_keeps_to_its_chord() {
        for chord_mm in [0.1, 0.01, 0.001] {
            let points = circle().polyline([1.0, 4.0], chord_mm);
            let sag = |pair: &[Vec3]| {
                5.0 - length(scale([0, 1, 2].map(|k| pair[0][k] + pair[1][k]), 0.5))
            };
            let worst = points.windows(2).map(sag).fold(0.0, f64::max);
            assert!(worst <= chord_mm && worst > chord_mm / 5.0, "{worst}");
        }
    }

    #[test]
    fn a_point_before_the_seam_of_a_closed_spline_is_found() {
        let place = |k: usize| [3.0, 0.0, 0.0, -3.0][k % 4];
        let control = |k: usize| weighted([place(k), place(k + 3), 0.0], 1.0);
        let knots = Knots::new(3, (0..11).map(|k| f64::from(k) - 3.0).collect(), 7).unwrap();
        let spline = SplineCurve { knots, points: (0..7).map(control).collect() };
        let curve = Curve::Spline(spline);
        assert_eq!(curve.period(), Some(4.0));
        for t in [0.01, 1.3, 3.96, 3.999] {
            assert!((curve.project(curve.at(t)[0]) - t).abs() < 1e-9, "{t}");
        }
    }

    #[test]
    fn projection_finds_the_parameter() {
        let ellipse = Curve::Ellipse { axes: Axes::WORLD, radii: [5.0, 2.0] };
        let hyperbola = Curve::Hyperbola { axes: Axes::WORLD, half_axes: [3.0, 2.0] };
        let parabola = Curve::Parabola { axes: Axes::WORLD, focal: 1.5 };
        for curve in [circle(), ellipse, hyperbola, parabola] {
            for t in [-1.4, -0.2, 0.0, 0.9, 2.0] {
                assert!((curve.project(curve.at(t)[0]) - t).abs() < 1e-12, "{curve:?} {t}");
                let back = curve.clone().reversed();
                assert!(distance(back.at(-t)[0], curve.at(t)[0]) < 1e-12);
                assert!(distance(back.at(-t)[1], scale(curve.at(t)[1], -1.0)) < 1e-12);
            }
        }
    }
}
