//! Measures facets: their sides, boxes and areas.

use crate::kernel::{BrepFacet, Tessellation};
use crate::vector::{Vec3, cross, sub};

pub(crate) fn bounds(mesh: &Tessellation, facets: &[BrepFacet]) -> [Vec3; 2] {
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for corner in facets.iter().flat_map(|facet| mesh.corners(facet)) {
        for k in 0..3 {
            bounds[0][k] = bounds[0][k].min(corner[k]);
            bounds[1][k] = bounds[1][k].max(corner[k]);
        }
    }
    bounds
}

/// Returns the facet's normal; its length is twice the facet's area.
pub(crate) fn doubled(mesh: &Tessellation, facet: &BrepFacet) -> Vec3 {
    let [a, b, c] = mesh.corners(facet);
    cross(sub(b, a), sub(c, a))
}

/// Returns a facet's edges, as pairs of points.
pub(crate) fn sides(facet: &BrepFacet) -> [[u32; 2]; 3] {
    let [a, b, c] = facet.corners;
    [[a, b], [b, c], [c, a]]
}

/// The greatest accepted distance of edges and facets from their surface, as a part of the body's
/// longest side.
pub(crate) const MOST_OFF: f64 = 1e-3;
