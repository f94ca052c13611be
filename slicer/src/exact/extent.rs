//! Finds the points where surfaces are level, and the surfaces' bounding box.

use lamp_brep::Jet;
use lamp_brep::vector::Vec3;

use super::placed::PlacedSurfaces;

/// The greatest number of facets searched per direction: all facets around a level ring have the
/// same height.
const MAX_FACETS: usize = 64;
const MAX_STEPS: usize = 30;
/// The step for differences, as a part of a facet.
pub(super) const DIFFERENCE: f64 = 1e-5;

/// A direction along an axis, or against it if `sign` is -1.
#[derive(Clone, Copy)]
pub(super) struct AxisDirection {
    axis: usize,
    sign: f64,
}

impl AxisDirection {
    pub(super) const UP: Self = Self { axis: 2, sign: 1.0 };

    fn along(self, vector: Vec3) -> f64 {
        self.sign * vector[self.axis]
    }
}

/// A point where a surface is perpendicular to a direction.
pub(super) struct LevelPoint {
    pub(super) uv: [f64; 2],
    pub(super) jet: Jet,
    /// The second derivatives of the height: uu, uv, vv.
    pub(super) bend: [f64; 3],
}

impl PlacedSurfaces {
    /// Returns the least and the greatest corner of the surfaces' box, in millimeters, or
    /// `None` if there are no facets.
    ///
    /// It equals the facets' box where surfaces end at a corner. Round surfaces and edges bulge
    /// beyond it.
    pub fn box_mm(&self) -> Option<[[f64; 3]; 2]> {
        if self.mesh().facets.is_empty() {
            return None;
        }
        let end =
            |sign: f64| [0, 1, 2].map(|axis| sign * self.end_mm(AxisDirection { axis, sign }));
        Some([end(-1.0), end(1.0)])
    }

    /// Returns the greatest extent of the surfaces in a direction, in millimeters.
    fn end_mm(&self, direction: AxisDirection) -> f64 {
        let top = |facet: u32| {
            let corners = self.corners(facet).map(|corner| direction.along(corner));
            corners.into_iter().fold(f64::MIN, f64::max)
        };
        let tops: Vec<f64> = (0..self.mesh().facets.len() as u32).map(top).collect();
        let of_facets = tops.iter().copied().fold(f64::MIN, f64::max);
        let mut near: Vec<u32> = (0u32..)
            .zip(&tops)
            .filter(|(_, top)| **top >= of_facets - self.tolerance_mm())
            .map(|(facet, _)| facet)
            .filter(|&facet| !self.is_flat(facet))
            .collect();
        near.sort_by(|&a, &b| tops[b as usize].total_cmp(&tops[a as usize]));
        near.truncate(MAX_FACETS);
        let levels = near.into_iter().filter_map(|facet| self.level_point(facet, direction));
        // A point farther out lies on the surface beyond its face.
        let most = of_facets + 2.0 * self.tolerance_mm();
        let edges = self.curved_edges().all.iter();
        let turns = edges.filter_map(|edge| edge.turns[direction.axis]);
        let points = levels.map(|level| level.jet.point).chain(turns.map(|turn| turn.at_mm));
        points
            .map(|point| direction.along(point))
            .filter(|end| *end <= most)
            .fold(of_facets, f64::max)
    }

    /// Finds the point where a facet's surface is level, by Newton's method with
    /// differences.
    pub(super) fn level_point(&self, facet: u32, direction: AxisDirection) -> Option<LevelPoint> {
        let uv = self.facet(facet).uv;
        let size = self.uv_size(facet);
        let by = size.map(|size| DIFFERENCE * size);
        let mut at = [0, 1].map(|k| uv.iter().map(|uv| uv[k]).sum::<f64>() / 3.0);
        for _ in 0..MAX_STEPS {
            let jets = self.jets(facet, at, by);
            // The difference of height over a facet's width along either parameter.
            let rise =
                |jet: &Jet| [direction.along(jet.du) * size[0], direction.along(jet.dv) * size[1]];
            let [g, gu, gv] = [rise(&jets[0]), rise(&jets[1]), rise(&jets[2])];
            // Both mixed derivatives are equal, except for the error of differences.
            let [a, b, d] = [gu[0] - g[0], (gu[1] - g[1] + gv[0] - g[0]) / 2.0, gv[1] - g[1]]
                .map(|bend| bend / DIFFERENCE);
            if g.iter().all(|g| g.abs() < 1e-11) {
                let bend = [a / size[0] / size[0], b / size[0] / size[1], d / size[1] / size[1]];
                let level = LevelPoint { uv: at, jet: jets[0], bend };
                return self.is_below(facet, jets[0].point).then_some(level);
            }
            // Along a level ring the bend is 0. A small one keeps the point in place.
            let least = 1e-9 * (a.abs() + d.abs());
            let (a, d) = (a - least, d - least);
            let det = a * d - b * b;
            let step = [(b * g[1] - d * g[0]) / det, (b * g[0] - a * g[1]) / det];
            // Four facets away, another facet finds the point.
            if !step.iter().all(|step| step.abs() < 4.0) {
                return None;
            }
            at = [0, 1].map(|k| at[k] + step[k] * size[k]);
        }
        None
    }
}
