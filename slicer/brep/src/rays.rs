//! Sends rays through the facets of a body to find what its faces enclose.
//!
//! Tessellation decides which side of a loop is the face; this module does not share that choice. A
//! ray from outside must enter the body, leave it, enter it again, and so on.

use crate::kernel::{BrepFacet, Tessellation};
use crate::vector::{Vec3, cross, dot, sub, unit};

/// The direction of all rays. Faces of parts are rarely parallel to it.
const DIRECTION: Vec3 = [0.434_057, 0.263_211, 0.861_573];

/// A point of a facet through which a ray goes, by the shares of its corners.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayPoint {
    /// The index of the facet.
    pub(crate) facet: usize,
    pub(crate) shares: [f64; 3],
}

/// The shares at which to send rays, in order, until a ray meets no edge.
// Not quite a third each: rays through the middles of a symmetric part's facets meet its edges.
pub(crate) const SHARES: [[f64; 3]; 4] = [
    [0.334_1, 0.332_7, 0.333_2],
    [0.521_3, 0.237_9, 0.240_8],
    [0.187_1, 0.601_3, 0.211_6],
    [0.243_7, 0.151_9, 0.604_4],
];

/// The place where a ray meets a facet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayHit {
    /// The distance along the ray, in millimeters.
    pub(crate) depth_mm: f64,
    /// The index of the facet.
    pub(crate) facet: usize,
    /// The cosine between the ray and the facet's normal, negative where the ray enters.
    pub(crate) cosine: f64,
}

/// The axes as rays see them, the last one along the rays.
fn axes() -> [Vec3; 3] {
    let along = unit(DIRECTION).unwrap_or([0.0, 0.0, 1.0]);
    let first = unit(cross(along, [1.0, 0.0, 0.0])).unwrap_or([0.0, 1.0, 0.0]);
    [first, cross(along, first), along]
}

/// Returns twice the area of a facet as rays see it, negative where they enter.
pub(crate) fn seen_mm2(mesh: &Tessellation, facet: &BrepFacet) -> f64 {
    let [a, b, c] = mesh.corners(facet);
    dot(cross(sub(b, a), sub(c, a)), axes()[2])
}

/// Returns the places where each ray meets facets, in order.
pub(crate) fn hits(
    mesh: &Tessellation,
    facets: &[BrepFacet],
    rays: &[RayPoint],
) -> Vec<Vec<RayHit>> {
    let axes = axes();
    let seen = |facet: &BrepFacet| mesh.corners(facet).map(|p| axes.map(|axis| dot(axis, p)));
    let point = |ray: &RayPoint| {
        let corners = seen(&facets[ray.facet]);
        [0, 1].map(|k| (0..3).map(|n| ray.shares[n] * corners[n][k]).sum::<f64>())
    };
    // Sorted, so that each facet finds the rays that may meet it.
    let mut points: Vec<([f64; 2], usize)> = rays.iter().map(point).zip(0..).collect();
    points.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
    let mut hits = vec![Vec::new(); rays.len()];
    for (number, facet) in facets.iter().enumerate() {
        let corners = seen(facet);
        let low = corners.iter().map(|p| p[0]).fold(f64::INFINITY, f64::min);
        let high = corners.iter().map(|p| p[0]).fold(f64::NEG_INFINITY, f64::max);
        let first = points.partition_point(|(p, _)| p[0] < low);
        for (p, ray) in points[first..].iter().take_while(|(p, _)| p[0] <= high) {
            if let Some(depth_mm) = depth_mm(&corners, *p) {
                let [a, b, c] = corners;
                let cosine = unit(cross(sub(b, a), sub(c, a))).map_or(0.0, |normal| normal[2]);
                hits[*ray].push(RayHit { depth_mm, facet: number, cosine });
            }
        }
    }
    hits.iter_mut().for_each(|hits| hits.sort_by(|a, b| a.depth_mm.total_cmp(&b.depth_mm)));
    hits
}

/// Returns the depth at which a ray meets a triangle, if it does.
fn depth_mm(corners: &[Vec3; 3], p: [f64; 2]) -> Option<f64> {
    let side = |k: usize| {
        let (q, r) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    };
    let sides = [0, 1, 2].map(side);
    // Strict: a ray exactly through an edge misses both facets. Then its hits do not add up, and
    // another ray replaces it.
    let is_met = sides.iter().all(|x| *x > 0.0) || sides.iter().all(|x| *x < 0.0);
    // The areas of the three parts are the point's barycentric coordinates.
    let weighted: f64 = (0..3).map(|k| sides[k] * corners[k][2]).sum();
    is_met.then(|| weighted / sides.iter().sum::<f64>())
}
