//! Facets that supports must not touch, and how far away they are.

use lamp_slicing::brep::vector::{Vec3, along, cross, dot, length, sub, unit};
use rstar::{AABB, RTree, RTreeObject};

use super::fit::distance_mm;

/// Facets that no support may touch.
#[derive(Debug, Default)]
pub(super) struct AvoidedFacets(RTree<AvoidedFacet>);

/// The corners of a facet in millimeters.
#[derive(Clone, Copy, Debug)]
struct AvoidedFacet([Vec3; 3]);

impl RTreeObject for AvoidedFacet {
    type Envelope = AABB<Vec3>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_points(&self.0)
    }
}

impl AvoidedFacets {
    pub(super) fn new(facets: Vec<[Vec3; 3]>) -> Self {
        Self(RTree::bulk_load(facets.into_iter().map(AvoidedFacet).collect()))
    }

    /// Returns whether a facet is at most as far from a segment, or from a point if its ends are
    /// equal.
    pub(super) fn are_within(&self, segment: [Vec3; 2], distance_mm: f64) -> bool {
        let [a, b] = segment;
        let low = [0, 1, 2].map(|k| a[k].min(b[k]) - distance_mm);
        let high = [0, 1, 2].map(|k| a[k].max(b[k]) + distance_mm);
        let near = self.0.locate_in_envelope_intersecting(AABB::from_corners(low, high));
        near.into_iter().any(|AvoidedFacet(facet)| to_facet_mm(segment, facet) <= distance_mm)
    }
}

/// Returns the least distance between a segment and a facet.
///
/// Apart, they are nearest at an end of the segment or at a side of the facet.
fn to_facet_mm([a, b]: [Vec3; 2], facet: &[Vec3; 3]) -> f64 {
    let [p, q, r] = *facet;
    let sides = [[p, q], [q, r], [r, p]];
    let to_sides =
        sides.map(|side| to_segment_mm([a, b], side)).into_iter().fold(f64::MAX, f64::min);
    // A facet without area is its sides.
    let Some(normal) = unit(cross(sub(q, p), sub(r, p))) else { return to_sides };
    let is_over = |point: Vec3| {
        let is_inside =
            |[from, to]: [Vec3; 2]| dot(cross(sub(to, from), sub(point, from)), normal) >= 0.0;
        sides.into_iter().all(is_inside)
    };
    let heights = [a, b].map(|point| dot(sub(point, p), normal));
    if heights[0] * heights[1] < 0.0 {
        let share = heights[0] / (heights[0] - heights[1]);
        if is_over(along(a, sub(b, a), share)) {
            return 0.0;
        }
    }
    let over = [a, b].into_iter().zip(heights).filter(|(point, _)| is_over(*point));
    over.map(|(_, height)| height.abs()).fold(to_sides, f64::min)
}

/// Returns the least distance between two segments, each of which may be a point.
fn to_segment_mm([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> f64 {
    let to_point = |point: Vec3, [from, to]: [Vec3; 2]| {
        let way = sub(to, from);
        let share = dot(sub(point, from), way) / dot(way, way);
        // The share is not a number if the segment is a point.
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        length(sub(point, along(from, way, share)))
    };
    if a == b {
        to_point(a, [c, d])
    } else if c == d {
        to_point(c, [a, b])
    } else {
        distance_mm([a, b], [c, d])
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Tries many points of the facet and the segment.
    fn sampled_mm([a, b]: [Vec3; 2], [p, q, r]: [Vec3; 3], steps: u32) -> f64 {
        let share = |step: u32| f64::from(step) / f64::from(steps);
        let mut least = f64::MAX;
        for i in 0..=steps {
            for j in 0..=steps - i {
                let point = along(along(p, sub(q, p), share(i)), sub(r, p), share(j));
                for k in 0..=steps {
                    least = least.min(length(sub(point, along(a, sub(b, a), share(k)))));
                }
            }
        }
        least
    }

    fn point() -> impl Strategy<Value = Vec3> {
        // Whole numbers too, for facets and segments that touch, lie level or have no area.
        let number = prop_oneof![-3.0..3.0f64, (-3..4i8).prop_map(f64::from)];
        [number.clone(), number.clone(), number]
    }

    #[test]
    fn distances_have_closed_forms() {
        let facet = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        for (a, b, expected) in [
            // Above the inside, through it, above a corner, beside a side.
            ([1.0, 1.0, 2.0], [1.0, 1.0, 2.0], 2.0),
            ([1.0, 1.0, 2.0], [1.0, 1.0, -1.0], 0.0),
            ([-3.0, 0.0, 4.0], [-3.0, 0.0, 4.0], 5.0),
            ([4.0, 4.0, -1.0], [4.0, 4.0, 1.0], 8f64.sqrt()),
            ([-2.0, 1.0, 1.0], [5.0, 1.0, 1.0], 1.0),
        ] {
            assert!((to_facet_mm([a, b], &facet) - expected).abs() < 1e-12, "{a:?} {b:?}");
        }
        let avoided = AvoidedFacets::new(vec![facet]);
        assert!(avoided.are_within([[1.0, 1.0, 0.25]; 2], 0.25));
        assert!(!avoided.are_within([[1.0, 1.0, 0.26]; 2], 0.25));
        // The box around both meets it, and the corner does not.
        assert!(!avoided.are_within([[-0.2, -0.2, 0.0]; 2], 0.25));
        assert!(!AvoidedFacets::default().are_within([[0.0; 3]; 2], 1e9));
        // A facet that is a point, as damaged meshes have.
        assert!(AvoidedFacets::new(vec![[[1.0; 3]; 3]]).are_within([[1.0, 1.0, 0.5]; 2], 0.5));
    }

    proptest! {
        #[test]
        fn distances_are_the_least_of_many_points(
            ends in [point(), point()], facet in [point(), point(), point()], is_point in any::<bool>(),
        ) {
            let segment = if is_point { [ends[0]; 2] } else { ends };
            const STEPS: u32 = 24;
            let (found, sampled) = (to_facet_mm(segment, &facet), sampled_mm(segment, facet, STEPS));
            // Each side has at most this length, and samples divide it into so many pieces.
            let off = 3.0 * 108f64.sqrt() / f64::from(STEPS);
            prop_assert!(found <= sampled + 1e-9 && found >= sampled - off, "{found} {sampled}");
        }

        #[test]
        fn an_index_of_facets_misses_none(
            ends in [point(), point()], distance in 0.0..2.0f64,
            facets in prop::collection::vec([point(), point(), point()], 0..40),
        ) {
            let each = facets.iter().any(|facet| to_facet_mm(ends, facet) <= distance);
            prop_assert_eq!(AvoidedFacets::new(facets).are_within(ends, distance), each);
        }
    }
}
