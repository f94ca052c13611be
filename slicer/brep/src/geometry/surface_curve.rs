//! Evaluates curves on surfaces, given in the surfaces' parameters.

use super::chain::Link;
use super::surface::Surface;
use crate::vector::{Vec3, along, scale};

/// A curve on a surface. Its parameter goes from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SurfaceCurve {
    surface: Surface,
    /// Its parameters on the surface are the x and y of this, scaled.
    link: Link,
    /// The surface's parameters per x and y.
    scale: [f64; 2],
}

/// The least number of parts in which a curve is searched.
const PARTS: usize = 4;

impl SurfaceCurve {
    pub(crate) const DOMAIN: [f64; 2] = [0.0, 1.0];

    pub(crate) fn new(surface: Surface, link: Link, scale: [f64; 2]) -> Self {
        Self { surface, link, scale }
    }

    /// Returns the point and the derivative at `t`.
    pub(crate) fn at(&self, t: f64) -> [Vec3; 2] {
        let Link { curve, range: [from, to] } = &self.link;
        let inner = from + (to - from) * t;
        let [x, y, _] = curve.place(inner);
        let [dx, dy, _] = scale(curve.at(inner)[1], to - from);
        let [by_x, by_y] = self.scale;
        let jet = self.surface.at([x * by_x, y * by_y]);
        // The chain rule: S_u u' + S_v v'.
        [jet.point, along(scale(jet.du, dx * by_x), jet.dv, dy * by_y)]
    }

    /// Returns the same curve in the other direction.
    pub(crate) fn reversed(mut self) -> Self {
        self.link.range.reverse();
        self
    }

    /// Returns the parameters between which the curve is smooth, except where the surface
    /// is not.
    pub(crate) fn breaks(&self) -> Vec<f64> {
        let Link { curve, range: [from, to] } = &self.link;
        let inner = curve.breaks().unwrap_or_default().into_iter();
        // A line in parameters may be a whole circle or a helix in space.
        let parts = (0..=PARTS).map(|k| k as f64 / PARTS as f64);
        let inner = inner.map(|t| (t - from) / (to - from));
        let mut breaks: Vec<f64> =
            parts.chain(inner.filter(|part| (1e-9..1.0 - 1e-9).contains(part))).collect();
        breaks.sort_by(f64::total_cmp);
        breaks.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        breaks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Curve;
    use crate::vector::{Axes, distance};

    #[test]
    fn a_straight_line_on_a_cylinder_is_a_helix() {
        let line = Curve::Line { point: [10.0, -1.0, 0.0], direction: [0.6, 0.8, 0.0] };
        let surface = Surface::Cylinder { axes: Axes::WORLD, radius: 3.0 };
        let degree = 1f64.to_radians();
        let link = Link { curve: line, range: [0.0, 500.0] };
        let helix = SurfaceCurve::new(surface, link, [degree, 2.0]);
        for t in [0.0, 0.3, 1.0] {
            let angle = (10.0 + 300.0 * t) * degree;
            let (sin, cos) = angle.sin_cos();
            let [point, slope] = helix.at(t);
            assert!(distance(point, [3.0 * cos, 3.0 * sin, 2.0 * (400.0 * t - 1.0)]) < 1e-11);
            let turn = 900.0 * degree;
            assert!(distance(slope, [-turn * sin, turn * cos, 800.0]) < 1e-11);
            let curve = Curve::OnSurface(Box::new(helix.clone()));
            assert!((curve.project(point) - t).abs() < 1e-9, "{t}");
            assert!(distance(curve.reversed().at(1.0 - t)[0], point) < 1e-12);
        }
    }
}
