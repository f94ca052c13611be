//! Locates points of surfaces: their facet, by walking from facet to facet, and their
//! parameters.

use lamp_brep::vector::{Vec3, add, distance, dot, scale, sub};

use super::facet_point::{FacetPoint, RowContact};
use super::placed::PlacedSurfaces;
use super::solve::{WantedPoint, solve};

/// The greatest distance of a point from its facet, in tolerances of the tessellation.
const NEAR: f64 = 2.0;
/// The greatest number of facets that a walk visits.
const MAX_FACETS: usize = 256;
/// The greatest number of faces through which a contour is followed: a face and its neighbors.
const MAX_FACES: usize = 3;

impl PlacedSurfaces {
    /// Returns the facet below a point of a surface, walking from another facet. Returns `None` if
    /// the walk ends farther away than the distance of surfaces from their facets.
    pub(super) fn facet_below(&self, facet: u32, point: Vec3) -> Option<u32> {
        let away = |facet: u32| (self.distance_to(facet, point), facet);
        let mut nearest = away(facet);
        for _ in 0..MAX_FACETS {
            // Around corners, not only across sides: the next facet may touch this one in a point.
            let corners = self.facet(nearest.1).corners.into_iter();
            let around = corners.flat_map(|corner| self.facets_by_point().group(corner as usize));
            let next = around
                .map(|&facet| away(facet))
                .fold(nearest, |a, b| if b.0 < a.0 { b } else { a });
            if next.0 >= nearest.0 {
                break;
            }
            nearest = next;
        }
        (nearest.0 < NEAR * self.tolerance_mm()).then_some(nearest.1)
    }

    /// Returns whether a point is within the surface's distance of a facet.
    pub(super) fn is_below(&self, facet: u32, point: Vec3) -> bool {
        self.distance_to(facet, point) < NEAR * self.tolerance_mm()
    }

    fn distance_to(&self, facet: u32, point: Vec3) -> f64 {
        let [s, t] = self.chart(facet).shares_of(point);
        let [a, b, c] = self.corners(facet);
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
            let foot = add(a, add(scale(sub(b, a), s), scale(sub(c, a), t)));
            return distance(foot, point);
        }
        let to_side = |(p, q): (Vec3, Vec3)| {
            let (way, to) = (sub(q, p), sub(point, p));
            // Facets at a pole may have a side without length.
            let part = (dot(to, way) / dot(way, way).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            distance(add(p, scale(way, part)), point)
        };
        [(a, b), (b, c), (c, a)].map(to_side).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Finds a row's two crossings of a contour from estimates of both, the left one first.
    pub(super) fn locate_pair(&self, estimates: [FacetPoint; 2]) -> RowContact {
        match estimates.map(|estimate| self.locate_crossing(estimate)) {
            [Some(left), Some(right)] => {
                let is_pair = left.at_mm[0] <= right.at_mm[0] && left.enters != right.enters;
                if is_pair { RowContact::Pair([left, right]) } else { RowContact::Unknown }
            }
            [Some(one), None] | [None, Some(one)] => RowContact::OneSide(one),
            [None, None] => RowContact::Unknown,
        }
    }

    /// Returns a facet for which a rule holds: this one, or a neighboring one.
    fn facet_around(&self, facet: u32, is_wanted: impl Fn(u32) -> bool) -> Option<u32> {
        let corners = self.facet(facet).corners.into_iter();
        let around = corners.flat_map(|corner| self.facets_by_point().group(corner as usize));
        [facet].into_iter().chain(around.copied()).find(|&facet| is_wanted(facet))
    }

    /// Finds a row's crossing of a contour, and the facet below.
    fn locate_crossing(&self, mut point: FacetPoint) -> Option<FacetPoint> {
        // If the contour continues on another face, search on that face's surface.
        for _ in 0..MAX_FACES {
            let face = self.facet(point.facet).face;
            let wanted = WantedPoint { uv: point.uv, known_mm: [point.at_mm[1], point.at_mm[2]] };
            let (uv, jet) = solve(self, face, [1, 2], &[wanted])[0]?;
            let facet = self.facet_below(point.facet, jet.point)?;
            let is_there = self.curved_edges().holds(self, face, facet, jet.point);
            let is_on_face = |facet: u32| self.facet(facet).face == face;
            if is_there.unwrap_or(is_on_face(facet)) {
                let facet = self.facet_around(facet, is_on_face)?;
                let at_mm = [jet.point[0], point.at_mm[1], point.at_mm[2]];
                let enters = self.normal(facet, &jet)?[0] < 0.0;
                return Some(FacetPoint { facet, uv, at_mm, enters, is_exact: true });
            }
            let facet = self.facet_around(facet, |facet| !is_on_face(facet))?;
            (point.facet, point.uv) = (facet, self.chart(facet).uv_at(jet.point));
        }
        None
    }
}
