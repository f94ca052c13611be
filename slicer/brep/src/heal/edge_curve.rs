//! Measures distances to an edge's part of its curve.

use crate::geometry::Curve;
use crate::model::BrepEdge;
use crate::vector::{Vec3, distance};

/// The part of a curve that belongs to an edge.
pub(super) struct EdgeCurve<'a> {
    curve: &'a Curve,
    range: [f64; 2],
    pub(super) low: Vec3,
    pub(super) high: Vec3,
    tolerance_mm: f64,
}

impl<'a> EdgeCurve<'a> {
    pub(super) fn new(edge: &'a BrepEdge, range: [f64; 2], tolerance_mm: f64) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in edge.curve.polyline(range, tolerance_mm) {
            for k in 0..3 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        Self { curve: &edge.curve, range, low, high, tolerance_mm }
    }

    pub(super) fn apart(&self, p: Vec3) -> f64 {
        distance(self.curve.place(self.curve.project(p)), p)
    }

    /// Returns a point's place along the edge, from 0 to 1, or `None` if it is farther away than
    /// the tolerance.
    pub(super) fn part(&self, p: Vec3) -> Option<f64> {
        // A test of the box avoids most of the slow projections.
        // The box is around a polyline, which is itself within the tolerance of the curve.
        let near = 2.0 * self.tolerance_mm;
        if (0..3).any(|k| p[k] < self.low[k] - near || p[k] > self.high[k] + near) {
            return None;
        }
        let [from, to] = self.range;
        let mut t = self.curve.project(p);
        if let Some(period) = self.curve.period() {
            // The period's multiple nearest to the middle of the edge.
            let middle = (from + to) / 2.0;
            t -= ((t - middle) / period).round() * period;
        }
        let part = ((t - from) / (to - from)).clamp(0.0, 1.0);
        let at = self.curve.place(from + (to - from) * part);
        (distance(at, p) <= self.tolerance_mm).then_some(part)
    }

    /// Returns [`part`](Self::part) for a point farther than the tolerance from both ends.
    pub(super) fn inner_part(&self, p: Vec3) -> Option<f64> {
        let is_end = |t: f64| distance(self.curve.place(t), p) <= self.tolerance_mm;
        self.part(p).filter(|_| !self.range.into_iter().any(is_end))
    }
}
