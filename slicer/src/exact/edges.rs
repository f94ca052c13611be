//! Finds curved B-rep edges, which facets follow by chords, and points on their curves.
//!
//! An edge is where the surfaces of two faces meet, so its points are found on both at once.

use lamp_brep::Jet;
use lamp_brep::vector::{Vec3, add, cross, distance, dot, length, scale, sub, unit};
use lamp_stack::Grouped;
use rayon::prelude::*;

use super::curved_edge::{CurvedEdge, CurvedEdges, EdgePoint};
use super::placed::PlacedSurfaces;
use crate::facet::PlacedFacet;

/// Curves nearer to their chords than this are straight, in millimeters.
const STRAIGHT_MM: f64 = 1e-7;
/// Surfaces that meet at a smaller sine are tangent: both are at the same distance from the facets
/// along their edge, and their intersection is not defined.
const TANGENT: f64 = 1e-3;
/// The least cosine between a chord and its curve: below it, the chord follows the curve too
/// loosely.
const LOOSE: f64 = 0.5;
/// The greatest distance of a curve from its chord, in tolerances of the tessellation.
const NEAR: f64 = 2.0;
const MAX_STEPS: usize = 12;
/// The greatest number of steps of a search between two points.
const MAX_HALVES: usize = 60;
/// The distance below which points of both surfaces are the same, in millimeters.
const SAME_MM: f64 = 1e-10;
/// The distance accepted after the last step, in millimeters: rounding may allow no better.
const SAME_AT_LAST_MM: f64 = 1e-7;
/// The facets examined at once.
const BATCH: usize = 1024;

impl PlacedSurfaces {
    /// Returns the curved edges between facets. The first call examines every facet.
    pub(super) fn curved_edges(&self) -> &CurvedEdges {
        self.curved_edges.get_or_init(|| CurvedEdges::find(self))
    }
}

impl CurvedEdges {
    pub(super) fn find(surfaces: &PlacedSurfaces) -> Self {
        let all = curved_edges(surfaces);
        let by_facet = Grouped::new(surfaces.mesh().facets.len(), || {
            let numbered = (0u32..).zip(&all);
            numbered.flat_map(|(k, edge)| edge.facets.map(|facet| (facet as usize, k)))
        });
        Self { all, by_facet }
    }

    /// Returns whether a point of a face's surface lies on the face, if a facet near it has a
    /// curved edge of the face there.
    pub(super) fn holds(
        &self,
        surfaces: &PlacedSurfaces,
        face: u32,
        facet: u32,
        at_mm: Vec3,
    ) -> Option<bool> {
        let corners = surfaces.facet(facet).corners.into_iter();
        let around = corners.flat_map(|corner| surfaces.facets_by_point().group(corner as usize));
        let edges = around.flat_map(|facet| self.by_facet.group(*facet as usize));
        let sides = edges.filter_map(|&edge| {
            let edge = &self.all[edge as usize];
            let side = edge.faces(surfaces).iter().position(|other| *other == face)?;
            Some((edge.away_mm(surfaces, at_mm)?, edge, side))
        });
        let (_, edge, side) = sides.min_by(|a, b| a.0.total_cmp(&b.0))?;
        edge.holds(surfaces, side, at_mm)
    }
}

/// Finds the curved edges between facets.
fn curved_edges(surfaces: &PlacedSurfaces) -> Vec<CurvedEdge> {
    // Most facets are within one face, which their points show without a search for neighbors.
    let is_shared = shared_points(surfaces);
    let count = surfaces.mesh().facets.len();
    let starts: Vec<usize> = (0..count).step_by(BATCH).collect();
    let of_batch = |start: usize| {
        let facets = start as u32..count.min(start + BATCH) as u32;
        facets.flat_map(|facet| of_facet(surfaces, facet, &is_shared)).collect::<Vec<_>>()
    };
    starts.into_par_iter().flat_map_iter(of_batch).collect()
}

/// Returns the curved edges that a facet shares with later ones.
fn of_facet<'a>(
    surfaces: &'a PlacedSurfaces,
    number: u32,
    is_shared: &'a [bool],
) -> impl Iterator<Item = CurvedEdge> + 'a {
    let corners = surfaces.facet(number).corners;
    (0..3).filter_map(move |k| {
        let side = [corners[k], corners[(k + 1) % 3]];
        if side.iter().any(|&point| !is_shared[point as usize]) {
            return None;
        }
        let other = other_side(surfaces, number, side).filter(|&other| other > number)?;
        CurvedEdge::between(surfaces, [number, other], side)
    })
}

/// Returns, for each point, whether it belongs to several faces.
fn shared_points(surfaces: &PlacedSurfaces) -> Vec<bool> {
    let mesh = surfaces.mesh();
    let mut first_face = vec![None; mesh.points.len()];
    let mut is_shared = vec![false; mesh.points.len()];
    for facet in &mesh.facets {
        for point in facet.corners.map(|point| point as usize) {
            is_shared[point] |= *first_face[point].get_or_insert(facet.face) != facet.face;
        }
    }
    is_shared
}

/// Returns the facet of another face on the other side of a facet's side, if it is the only one
/// there.
fn other_side(surfaces: &PlacedSurfaces, number: u32, [p, q]: [u32; 2]) -> Option<u32> {
    let has_side = |other: &u32| {
        let corners = surfaces.facet(*other).corners;
        *other != number && corners.contains(&q)
    };
    let mut others = surfaces.facets_by_point().group(p as usize).iter().copied().filter(has_side);
    let other = others.next().filter(|_| others.next().is_none())?;
    let is_flat = surfaces.is_flat(number) && surfaces.is_flat(other);
    (!is_flat && surfaces.facet(other).face != surfaces.facet(number).face).then_some(other)
}

impl CurvedEdge {
    /// Returns the edge between two facets, unless it is straight or their surfaces are
    /// tangent.
    fn between(surfaces: &PlacedSurfaces, facets: [u32; 2], points: [u32; 2]) -> Option<Self> {
        let corner_of = |facet: u32, point: u32| {
            surfaces.facet(facet).corners.iter().position(|corner| *corner == point)
        };
        let mut uv = [[[0.0; 2]; 2]; 2];
        let mut placed = [[0.0; 3]; 2];
        let mut at = [[0.0; 3]; 2];
        for (end, point) in points.into_iter().enumerate() {
            for (side, facet) in facets.into_iter().enumerate() {
                let corner = corner_of(facet, point)?;
                uv[end][side] = surfaces.facet(facet).uv[corner];
                if side == 0 {
                    let facet_in_place: PlacedFacet = surfaces.placed_facet(facet);
                    placed[end] = facet_in_place[corner];
                    at[end] = surfaces.corners(facet)[corner];
                }
            }
        }
        let way = sub(at[1], at[0]);
        let end = |k: usize| {
            let faces = facets.map(|facet| surfaces.facet(facet).face);
            let jets = both_jets(surfaces, faces, uv[k]);
            let slope = slope(&jets, way)?;
            Some(EdgePoint { at_mm: at[k], uv: uv[k], share: k as f64, slope })
        };
        let ends = [end(0)?, end(1)?];
        // The height of a parabola is a quarter of the slope at its ends.
        let is_curved = |end: &EdgePoint| length(sub(end.slope, way)) > 4.0 * STRAIGHT_MM;
        if !ends.iter().any(is_curved) {
            return None;
        }
        let mut edge = Self { facets, ends, chord: placed, turns: [None; 3] };
        edge.turns = [0, 1, 2].map(|axis| edge.turn(surfaces, axis));
        Some(edge)
    }

    /// Returns the vector from the chord's start to its end.
    fn way(&self) -> Vec3 {
        sub(self.ends[1].at_mm, self.ends[0].at_mm)
    }

    /// Returns the faces on both sides.
    pub(super) fn faces(&self, surfaces: &PlacedSurfaces) -> [u32; 2] {
        self.facets.map(|facet| surfaces.facet(facet).face)
    }

    /// Returns the distance of a point from the chord, if its projection is on the chord.
    fn away_mm(&self, surfaces: &PlacedSurfaces, at_mm: Vec3) -> Option<f64> {
        let (way, off) = (self.way(), sub(at_mm, self.ends[0].at_mm));
        let share = dot(off, way) / dot(way, way);
        let away_mm = distance(off, scale(way, share));
        let is_near = away_mm < NEAR * surfaces.tolerance_mm();
        ((0.0..=1.0).contains(&share) && is_near).then_some(away_mm)
    }

    /// Returns whether a point of the surface on one side is on the face there, and not beyond the
    /// curve.
    fn holds(&self, surfaces: &PlacedSurfaces, side: usize, at_mm: Vec3) -> Option<bool> {
        let way = self.way();
        let share = dot(sub(at_mm, self.ends[0].at_mm), way) / dot(way, way);
        let beside = self.meet_across(surfaces, share)?;
        Some(self.is_inwards(surfaces, side, &beside, sub(at_mm, beside.at_mm)))
    }

    /// Returns whether a direction from a point of the curve leads onto the face on one side.
    pub(super) fn is_inwards(
        &self,
        surfaces: &PlacedSurfaces,
        side: usize,
        from: &EdgePoint,
        way: Vec3,
    ) -> bool {
        let face = self.faces(surfaces)[side];
        let mut jets = [Jet::default()];
        surfaces.evaluate(face, &from.uv[side..=side], &mut jets);
        // Seen from outside, the first side's face is on the left of the curve.
        let left = surfaces.normal(self.facets[side], &jets[0]).map(|out| cross(out, from.slope));
        let inwards = left.map_or(0.0, |left| dot(left, way));
        if side == 0 { inwards >= 0.0 } else { inwards <= 0.0 }
    }

    /// Finds the curve's extremum along an axis, if its ends rise in different directions.
    fn turn(&self, surfaces: &PlacedSurfaces, axis: usize) -> Option<EdgePoint> {
        let rise = |point: &EdgePoint| point.slope[axis];
        let is_level = |point: &EdgePoint| rise(point).abs() < STRAIGHT_MM;
        if self.ends.iter().any(is_level)
            || (rise(&self.ends[0]) < 0.0) == (rise(&self.ends[1]) < 0.0)
        {
            return None;
        }
        self.search(surfaces, &self.ends, rise, STRAIGHT_MM)
    }

    /// Finds where the curve passes a level along an axis, between two of its points on
    /// both sides of the level.
    pub(super) fn passing(
        &self,
        surfaces: &PlacedSurfaces,
        axis: usize,
        level_mm: f64,
        between: &[EdgePoint; 2],
    ) -> Option<EdgePoint> {
        let [from, to] = between.map(|end| end.share);
        let is_between = |found: &EdgePoint| (from - 1e-9..=to + 1e-9).contains(&found.share);
        let mut normal = [0.0; 3];
        normal[axis] = 1.0;
        let seed = self.share_at(axis, level_mm, between);
        let found = self.meet(surfaces, seed, normal, level_mm).filter(is_between);
        found.or_else(|| {
            self.search(surfaces, between, |point| point.at_mm[axis] - level_mm, SAME_MM)
        })
    }

    /// Returns the approximate share at which a cubic through two points passes a level along an
    /// axis.
    pub(super) fn share_at(&self, axis: usize, level_mm: f64, [a, b]: &[EdgePoint; 2]) -> f64 {
        let width = b.share - a.share;
        let (low, high) = (a.at_mm[axis] - level_mm, b.at_mm[axis] - level_mm);
        let mut t = (low / (low - high)).clamp(0.0, 1.0);
        // A few Newton steps are enough for a start.
        for _ in 0..3 {
            let [value, slope] = cubic(axis, width, [a, b], t);
            let next = t - (value - level_mm) / slope;
            t = if (0.0..=1.0).contains(&next) { next } else { t };
        }
        a.share + t * width
    }

    /// Returns a coordinate of a cubic through the curve's ends.
    pub(super) fn about(&self, axis: usize, share: f64) -> f64 {
        cubic(axis, 1.0, [&self.ends[0], &self.ends[1]], share)[0]
    }

    /// Finds the point between two others where a function is zero, to within `near` of it,
    /// by the Illinois method.
    fn search(
        &self,
        surfaces: &PlacedSurfaces,
        between: &[EdgePoint; 2],
        of: impl Fn(&EdgePoint) -> f64,
        near: f64,
    ) -> Option<EdgePoint> {
        let [mut a, mut b] = between.map(|end| (end.share, of(&end)));
        let mut found = None;
        for _ in 0..MAX_HALVES {
            let share = (a.0 * b.1 - b.0 * a.1) / (b.1 - a.1);
            let point = self.meet_across(surfaces, share)?;
            let value = of(&point);
            found = Some(point);
            if value.abs() < near || (b.0 - a.0).abs() < 1e-14 {
                break;
            }
            if (value < 0.0) == (b.1 < 0.0) {
                // Halving the value of an end that stays keeps false position from creeping.
                a.1 *= 0.5;
            } else {
                a = b;
            }
            b = (share, value);
        }
        found
    }

    /// Finds the curve's point opposite a point of the chord.
    fn meet_across(&self, surfaces: &PlacedSurfaces, share: f64) -> Option<EdgePoint> {
        let way = self.way();
        let normal = unit(way)?;
        let level = dot(normal, self.ends[0].at_mm) + share * length(way);
        self.meet(surfaces, share, normal, level)
    }

    /// Finds the curve's point on a plane by Newton's method on both surfaces.
    fn meet(
        &self,
        surfaces: &PlacedSurfaces,
        seed: f64,
        normal: Vec3,
        level: f64,
    ) -> Option<EdgePoint> {
        let faces = self.faces(surfaces);
        let mut uv = [0, 1].map(|side| {
            let [from, to] = [0, 1].map(|end| self.ends[end].uv[side]);
            [0, 1].map(|k| from[k] + seed * (to[k] - from[k]))
        });
        for steps in 1..=MAX_STEPS {
            let jets = both_jets(surfaces, faces, uv);
            let [a, b] = jets.map(|jet| jet.point);
            let rise = level - dot(normal, a);
            let same_mm = if steps < MAX_STEPS { SAME_MM } else { SAME_AT_LAST_MM };
            if distance(a, b) < same_mm && rise.abs() < same_mm {
                return self.point(surfaces, &jets, uv);
            }
            let [na, nb] = jets.map(|jet| unit(cross(jet.du, jet.dv)));
            let (na, nb) = (na?, nb?);
            // Where both tangent planes meet the plane.
            let det = dot(na, cross(nb, normal));
            let across = scale(cross(normal, na), dot(nb, sub(b, a)));
            let target = add(a, scale(add(across, scale(cross(na, nb), rise)), 1.0 / det));
            for side in 0..2 {
                let by = parameters(&jets[side], sub(target, jets[side].point));
                uv[side] = [0, 1].map(|k| uv[side][k] + by[k]);
            }
            if !uv.iter().flatten().all(|t| t.is_finite()) {
                return None;
            }
        }
        None
    }

    /// Returns a point of both surfaces, if it is near the chord.
    fn point(
        &self,
        surfaces: &PlacedSurfaces,
        jets: &[Jet; 2],
        uv: [[f64; 2]; 2],
    ) -> Option<EdgePoint> {
        let (way, at_mm) = (self.way(), jets[0].point);
        let off = sub(at_mm, self.ends[0].at_mm);
        let share = dot(off, way) / dot(way, way);
        let is_near = distance(off, scale(way, share)) < NEAR * surfaces.tolerance_mm();
        let slope = slope(jets, way).filter(|_| is_near)?;
        Some(EdgePoint { at_mm, uv, share, slope })
    }
}

/// Returns the value and the slope of a cubic between two points at `t`, 0 to 1.
fn cubic(axis: usize, width: f64, [a, b]: [&EdgePoint; 2], t: f64) -> [f64; 2] {
    let (p, q) = (a.at_mm[axis], b.at_mm[axis]);
    let (m, n) = (width * a.slope[axis], width * b.slope[axis]);
    // Hermite's cubic, by its values and slopes at both ends.
    let (c, d) = (3.0 * (q - p) - 2.0 * m - n, 2.0 * (p - q) + m + n);
    [p + t * (m + t * (c + t * d)), m + t * (2.0 * c + t * 3.0 * d)]
}

fn both_jets(surfaces: &PlacedSurfaces, faces: [u32; 2], uv: [[f64; 2]; 2]) -> [Jet; 2] {
    let mut jets = [Jet::default(); 2];
    for side in 0..2 {
        surfaces.evaluate(faces[side], &uv[side..=side], &mut jets[side..=side]);
    }
    jets
}

/// Returns the direction of the curve where two surfaces meet, with a length that covers the whole
/// chord; `None` where they are tangent.
fn slope(jets: &[Jet; 2], way: Vec3) -> Option<Vec3> {
    let [na, nb] = jets.map(|jet| unit(cross(jet.du, jet.dv)));
    let across = cross(na?, nb?);
    let sine = length(across);
    let along = dot(across, way);
    let is_loose = along.abs() < LOOSE * sine * length(way);
    // Scaled so that its part along the chord is the chord itself.
    let slope = scale(across, dot(way, way) / along);
    (sine > TANGENT && !is_loose && slope.iter().all(|c| c.is_finite())).then_some(slope)
}

/// Returns the change of parameters that moves a point of a surface as far as possible along a
/// vector.
fn parameters(jet: &Jet, way: Vec3) -> [f64; 2] {
    // Least squares: the normal equations of u du + v dv = way.
    let (uu, uv, vv) = (dot(jet.du, jet.du), dot(jet.du, jet.dv), dot(jet.dv, jet.dv));
    let (u, v) = (dot(jet.du, way), dot(jet.dv, way));
    let det = uu * vv - uv * uv;
    [(u * vv - v * uv) / det, (v * uu - u * uv) / det]
}
