//! Computes the volumes of bodies, by their facets and by their surfaces.

use std::collections::HashMap;

use crate::kernel::{Body, BrepFacet, Jet, KernelModel, Tessellation};
use crate::measure::sides;
use crate::vector::{Vec3, add, cross, dot, length, middle, scale, sub, unit};

/// Returns the volume that facets enclose, in cubic millimeters. `about` is a point near them.
pub(crate) fn facet_volume(mesh: &Tessellation, facets: &[BrepFacet], about: Vec3) -> f64 {
    let six = |facet: &BrepFacet| {
        let [a, b, c] = mesh.corners(facet).map(|corner| sub(corner, about));
        // The triple product is six times the tetrahedron from the origin to the facet. Its sign
        // removes the space outside the body.
        dot(a, cross(b, c))
    };
    facets.iter().map(six).sum::<f64>() / 6.0
}

/// Returns the volume that the surfaces of a body enclose, in cubic millimeters.
///
/// Each facet is bent into a patch of second degree: the middles of its sides move onto the
/// surface, and onto both surfaces where two faces meet. The patches close as the facets do,
/// and their error is of the fourth order in the facets' size.
pub(crate) fn surface_volume(
    kernel: &dyn KernelModel,
    mesh: &Tessellation,
    body: &Body,
    about: Vec3,
) -> f64 {
    let facets: Vec<BrepFacet> =
        [mesh.of_faces(&body.faces), mesh.tips_of_faces(&body.faces)].concat();
    let mut middles = middles(kernel, &facets);
    meet(mesh, &facets, &mut middles);
    let patch = |(facet, middles): (&BrepFacet, &[Jet; 3])| {
        let corners = mesh.corners(facet).map(|corner| sub(corner, about));
        six_volumes(corners, middles.map(|jet| sub(jet.point, about)))
    };
    facets.iter().zip(&middles).map(patch).sum::<f64>() / 6.0
}

/// Returns the points of the surface at the middles of the facets' sides.
fn middles(kernel: &dyn KernelModel, facets: &[BrepFacet]) -> Vec<[Jet; 3]> {
    let mut middles = Vec::with_capacity(facets.len());
    for of_face in facets.chunk_by(|a, b| a.face == b.face) {
        let half = |facet: &BrepFacet| {
            let [p, q, r] = facet.uv;
            [[p, q], [q, r], [r, p]].map(|[a, b]| [0, 1].map(|k| (a[k] + b[k]) / 2.0))
        };
        let at: Vec<[[f64; 2]; 3]> = of_face.iter().map(half).collect();
        let mut jets = vec![Jet::default(); 3 * at.len()];
        kernel.evaluate(of_face[0].face, at.as_flattened(), &mut jets);
        middles.extend(jets.as_chunks().0);
    }
    middles
}

/// Moves the middles of sides between two faces to the intersection of the faces' surfaces.
fn meet(mesh: &Tessellation, facets: &[BrepFacet], middles: &mut [[Jet; 3]]) {
    let mut waiting: HashMap<[u32; 2], (usize, usize)> = HashMap::new();
    for (number, facet) in facets.iter().enumerate() {
        // A tip's side at its pole has no length, and no neighbor.
        for (side, [a, b]) in sides(facet).into_iter().enumerate().filter(|(_, [a, b])| a != b) {
            let Some((other, of_other)) = waiting.remove(&[b, a]) else {
                waiting.insert([a, b], (number, side));
                continue;
            };
            if facets[other].face != facet.face {
                let ends = [a, b].map(|point| mesh.points[point as usize]);
                let jets = [middles[number][side], middles[other][of_other]];
                let place = meeting(ends, jets, mesh.chord_mm);
                middles[number][side].point = place;
                middles[other][of_other].point = place;
            }
        }
    }
}

/// Returns the point halfway between the ends of a side where the tangent planes of two surfaces
/// meet, or a point between the surfaces' points where the surfaces touch each other.
///
/// An edge is within the chord of its side, so the meeting point is at most some chords away, plus
/// the distance of the surfaces from the side. Surfaces that nearly touch, with an edge off one of
/// them, meet far away: that place would add a fin as long as this distance to both, in each side
/// of the edge.
fn meeting([start, end]: [Vec3; 2], jets: [Jet; 2], chord_mm: f64) -> Vec3 {
    let [p, q] = jets.map(|jet| jet.point);
    let between = middle(p, q);
    let normals = jets.map(|jet| unit(cross(jet.du, jet.dv)));
    let (Some(n), Some(m), Some(way)) = (normals[0], normals[1], unit(sub(end, start))) else {
        return between;
    };
    // Cramer's rule for three planes: both tangent planes, and the plane across the side through
    // its middle, whose offset is zero.
    let volume = dot(n, cross(m, way));
    let about = middle(start, end);
    let off = [dot(n, sub(p, about)), dot(m, sub(q, about))];
    let sum = add(scale(cross(m, way), off[0]), scale(cross(way, n), off[1]));
    let step = scale(sum, 1.0 / volume);
    let most = MOST_CHORDS * chord_mm + MOST_OFF * (off[0].abs() + off[1].abs());
    // Surfaces that nearly touch each other meet anywhere.
    let is_sure = volume.abs() > LEAST_SINE && length(step) < most.min(length(sub(end, start)));
    if is_sure { add(about, step) } else { between }
}

/// The least sine of the angle between surfaces that meet.
const LEAST_SINE: f64 = 0.05;

/// The greatest distance between a side and the meeting point of its surfaces, in chords, and as a
/// multiple of their distance from the side.
const MOST_CHORDS: f64 = 4.0;
const MOST_OFF: f64 = 2.0;

/// Quadrature points of a triangle, and their weights (Strang and Fix, six points,
/// exact to the fourth degree).
const GAUSS: [([f64; 2], f64); 6] = {
    const A: f64 = 0.445_948_490_915_965;
    const B: f64 = 0.091_576_213_509_771;
    const W: f64 = 0.223_381_589_678_011;
    const V: f64 = 0.109_951_743_655_322;
    [
        ([A, A], W),
        ([A, 1.0 - 2.0 * A], W),
        ([1.0 - 2.0 * A, A], W),
        ([B, B], V),
        ([B, 1.0 - 2.0 * B], V),
        ([1.0 - 2.0 * B, B], V),
    ]
};

/// Returns six times the volume between the origin and a patch, by Gauss's theorem: a third
/// of the flux of the position vector, which is of the fourth degree.
fn six_volumes(corners: [Vec3; 3], middles: [Vec3; 3]) -> f64 {
    let nodes = [corners[0], corners[1], corners[2], middles[0], middles[1], middles[2]];
    let mixed = |shares: [f64; 6]| {
        nodes.iter().zip(shares).fold([0.0; 3], |sum, (node, share)| add(sum, scale(*node, share)))
    };
    let flux = |[s, t]: [f64; 2]| {
        let r = 1.0 - s - t;
        // Quadratic shape functions of a triangle with six nodes.
        let place = mixed([
            r * (2.0 * r - 1.0),
            s * (2.0 * s - 1.0),
            t * (2.0 * t - 1.0),
            4.0 * r * s,
            4.0 * s * t,
            4.0 * t * r,
        ]);
        // The derivative of r (2r - 1): r falls as s or t rises.
        let first = 1.0 - 4.0 * r;
        let along_s = mixed([first, 4.0 * s - 1.0, 0.0, 4.0 * (r - s), 4.0 * t, -4.0 * t]);
        let along_t = mixed([first, 0.0, 4.0 * t - 1.0, -4.0 * s, 4.0 * s, 4.0 * (r - t)]);
        dot(place, cross(along_s, along_t))
    };
    // Weights add up to 1 over an area of 1/2, so their sum is twice the flux, and the
    // volume is a third of the flux: the result is six volumes.
    GAUSS.iter().map(|(at, weight)| weight * flux(*at)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::distance;

    /// A plane through a point, tilted by an angle about the x axis.
    fn leaning(point: Vec3, degrees: f64) -> Jet {
        let (s, c) = degrees.to_radians().sin_cos();
        Jet { point, du: [1.0, 0.0, 0.0], dv: [0.0, c, s] }
    }

    #[test]
    fn surfaces_meet_near_the_side_or_between() {
        let side = [[0.0; 3], [1.0, 0.0, 0.0]];
        let at = |jets: [Jet; 2]| meeting(side, jets, 0.001);
        let near = |a: Vec3, b: Vec3| distance(a, b) < 1e-12;
        // The edge bulges by a chord in the plane that both surfaces share there: found, also at 4
        // degrees.
        for degrees in [4.0f64, 30.0, 90.0] {
            let edge = [0.5, 0.001, 0.0];
            let on = [0.2, 0.001 + degrees.to_radians().cos(), degrees.to_radians().sin()];
            let place = at([leaning([0.7, 0.4, 0.0], 0.0), leaning(on, degrees)]);
            assert!(near(place, edge), "{degrees}: {place:?}");
        }
        // An edge 0.05 mm off one of two surfaces that meet at a right angle: the surfaces are
        // right.
        let right = at([leaning([0.5, 0.0, 0.0], 0.0), leaning([0.5, 0.05, 0.0], 90.0)]);
        assert!(near(right, [0.5, 0.05, 0.0]), "{right:?}");
        // The same at 4 degrees: they meet 0.7 mm from the edge, too far to be meaningful.
        let flat = at([leaning([0.5, 0.0, 0.0], 0.0), leaning([0.5, 0.0, 0.05], 4.0)]);
        assert!(near(flat, [0.5, 0.0, 0.025]), "{flat:?}");
    }
}
