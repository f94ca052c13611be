//! Moves points of facets onto the exact surfaces.

use lamp_brep::Jet;

use super::facet_point::FacetPoint;
use super::placed::PlacedSurfaces;
use super::solve::{WantedPoint, solve};

/// The greatest move across the surface, in tolerances of the tessellation: one for the
/// facet's distance, one for the difference of the normals.
const MAX_MOVE: f64 = 2.0;
/// A surface whose normal is smaller than this along the axis may face either way.
const LEVEL: f64 = 1e-6;
/// The greatest distance of a point outside its facet, in facets.
const MAX_BEYOND: f64 = 1.0;

/// Moves points along an axis, 0 for x or 2 for z, to where the surfaces have the other two
/// coordinates, by Newton's method from the facets' parameters.
///
/// A point stays on its facet, and is not exact, if the method diverges, if the solution
/// belongs to another facet or to the other side of the part, or if it moves across the
/// surface by more than twice the tessellation's tolerance. (Along a row that grazes the
/// surface, the same error is a longer move.) The number of points stays the same, so rows
/// stay balanced.
///
/// # Panics
/// Panics if a point's facet does not exist.
pub fn polish(surfaces: &PlacedSurfaces, axis: usize, points: &mut [FacetPoint]) {
    let known = if axis == 0 { [1, 2] } else { [0, 1] };
    let face = |point: &&mut FacetPoint| surfaces.facet(point.facet).face;
    let mut points: Vec<&mut FacetPoint> = points.iter_mut().collect();
    // Grouped by face, since kernels evaluate many points of one face at once.
    if !points.is_sorted_by_key(face) {
        points.sort_by_key(face);
    }
    for points in points.chunk_by_mut(|a, b| face(a) == face(b)) {
        let wanted = |point: &&mut FacetPoint| WantedPoint {
            uv: point.uv,
            known_mm: known.map(|axis| point.at_mm[axis]),
        };
        let wanted: Vec<WantedPoint> = points.iter().map(wanted).collect();
        let found = solve(surfaces, face(&points[0]), known, &wanted);
        for (point, found) in points.iter_mut().zip(found) {
            let Some((uv, jet)) = found else { continue };
            point.is_exact = is_same_point(surfaces, axis, point, uv, &jet);
            if point.is_exact {
                (point.uv, point.at_mm[axis]) = (uv, jet.point[axis]);
            }
        }
    }
}

/// Returns whether a solution is the facet's point, and not another crossing of the same
/// row.
fn is_same_point(
    surfaces: &PlacedSurfaces,
    axis: usize,
    point: &FacetPoint,
    uv: [f64; 2],
    jet: &Jet,
) -> bool {
    // At a pole the surface has no normal.
    let outwards = surfaces.normal(point.facet, jet).map_or(0.0, |normal| normal[axis]);
    let is_other_side = outwards.abs() > LEVEL && (outwards < 0.0) != point.enters;
    // At a pole, facets are so narrow that a point may move past several of them.
    let is_on_face = || {
        let below = surfaces.facet_below(point.facet, jet.point);
        below.is_some_and(|below| surfaces.facet(below).face == surfaces.facet(point.facet).face)
    };
    let by_mm = jet.point[axis] - point.at_mm[axis];
    // The move along the axis times the cosine is the move across the surface.
    let is_too_far = by_mm.abs() * outwards.abs() > MAX_MOVE * surfaces.tolerance_mm();
    let is_near_facet = || is_near(&surfaces.facet(point.facet).uv, uv);
    !is_other_side && !is_too_far && (is_near_facet() || is_on_face())
}

/// Returns whether parameters are on a facet or near it.
fn is_near([p, q, r]: &[[f64; 2]; 3], uv: [f64; 2]) -> bool {
    let double = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let whole = double(*p, *q, *r);
    let parts = [double(uv, *q, *r), double(*p, uv, *r), double(*p, *q, uv)];
    // Barycentric coordinates. Dividing removes the sense of the facet in parameters.
    parts.iter().all(|part| part / whole >= -MAX_BEYOND)
}
