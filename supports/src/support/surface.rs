//! The surface of a part: where rays enter it, and how smooth it is there.

use lamp_slicing::brep::vector::{Vec3, add, cross, dot, length, scale, sub, unit};
use lamp_slicing::{FacetIndex, PlacedFacet};
use rstar::primitives::{GeomWithData, Line};
use rstar::{AABB, RTree, RTreeObject, SelectionFunction};

use super::avoided_facets::AvoidedFacets;

/// Edges where the surface turns by more are creases; smoother ones stand for a curve.
const CREASE: f64 = std::f64::consts::FRAC_PI_6;

/// The surface of a part in its place.
#[derive(Debug)]
pub struct Surface {
    facets: FacetIndex,
    /// Whether facets are clockwise seen from outside: mirrored, or inside out.
    is_turned: bool,
    /// The facets that no support may touch.
    avoided: AvoidedFacets,
}

impl Surface {
    /// Takes the facets of a part. All facets are needed to decide which side is inside.
    pub fn new(facets: FacetIndex) -> Self {
        // Far from the origin, rounding would drown the differences that make the volume.
        let middle = facets.min();
        let mut volume = 0.0;
        facets.for_each(|facet, _| {
            let [a, b, c] = facet.map(|corner| sub(corner, middle));
            // Six times the volume of a tetrahedron; the sum is negative if facets are clockwise.
            volume += dot(a, cross(b, c));
        });
        Self { facets, is_turned: volume < 0.0, avoided: AvoidedFacets::default() }
    }

    /// Sets the facets that no support may touch: corners in millimeters, in the part's place.
    #[must_use]
    pub fn avoiding(self, facets: Vec<[Vec3; 3]>) -> Self {
        Self { avoided: AvoidedFacets::new(facets), ..self }
    }

    /// Returns whether a facet to avoid is at most as far from a segment or point.
    pub(super) fn is_avoided(&self, segment: [Vec3; 2], distance_mm: f64) -> bool {
        self.avoided.are_within(segment, distance_mm)
    }

    /// Returns the surface in a box.
    pub(super) fn near(&self, low: Vec3, high: Vec3) -> NearSurface {
        // The index has heights in micrometers, all else is in millimeters.
        let found = self.facets.between(low[2] * 1000.0, high[2] * 1000.0);
        let facets = found.iter().map(|(facet, _)| self.corners(facet));
        NearSurface::new(facets.filter_map(NearFacet::new), &AABB::from_corners(low, high))
    }

    /// Returns the corners in millimeters, counter-clockwise seen from outside.
    fn corners(&self, facet: &PlacedFacet) -> [Vec3; 3] {
        // Adding zero turns -0 into 0, so that equal corners have equal bits.
        let [a, b, c] = facet.map(|[x, y, um]| [x + 0.0, y + 0.0, um / 1000.0 + 0.0]);
        if self.is_turned { [a, c, b] } else { [a, b, c] }
    }
}

/// The facets in a box, and the edges between them.
#[derive(Debug)]
pub(super) struct NearSurface {
    facets: RTree<NearFacet>,
    edges: RTree<GeomWithData<Line<Vec3>, EdgeTurn>>,
}

#[derive(Clone, Copy, Debug)]
struct NearFacet {
    corners: [Vec3; 3],
    /// It points outwards.
    normal: Vec3,
    /// The largest curvature across a side that is no crease, in 1/mm.
    curvature: f64,
}

/// How the surface turns at an edge.
#[derive(Clone, Copy, Debug)]
enum EdgeTurn {
    /// By more than 30°, or the edge is not between two facets.
    Crease,
    /// Evenly, with this curvature in 1/mm.
    Smooth(f64),
}

/// Where a ray enters the part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Contact {
    pub(super) at_mm: Vec3,
    pub(super) length_mm: f64,
    pub(super) normal: Vec3,
    /// The curvature of the facet.
    curvature: f64,
}

impl NearFacet {
    /// Returns `None` for a facet without area.
    fn new(corners: [Vec3; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let normal = unit(cross(sub(b, a), sub(c, a)))?;
        Some(Self { corners, normal, curvature: 0.0 })
    }

    /// Returns how far a ray runs until it enters the part here.
    fn entered(&self, origin: Vec3, direction: Vec3) -> Option<f64> {
        let [a, b, c] = self.corners.map(|corner| sub(corner, origin));
        let facing = dot(self.normal, direction);
        // The ray leaves the part here, or passes along the facet.
        if facing >= 0.0 {
            return None;
        }
        // The ray passes on the same side of all three sides (Möller and Trumbore).
        let sides = [(a, b), (b, c), (c, a)];
        let is_met = sides.iter().all(|&(a, b)| dot(cross(a, b), direction) <= 0.0);
        // Where the ray meets the plane: normal · (far direction) = normal · a.
        let far = dot(self.normal, a) / facing;
        (is_met && far > 0.0).then_some(far)
    }

    /// Returns how far its third corner lies from a side.
    fn height(&self, side: usize) -> f64 {
        let [a, b, c] = [0, 1, 2].map(|k| self.corners[(side + k) % 3]);
        let along = sub(b, a);
        length(cross(along, sub(c, a))) / length(along)
    }
}

impl RTreeObject for NearFacet {
    type Envelope = AABB<Vec3>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_points(&self.corners)
    }
}

impl NearSurface {
    fn new(facets: impl Iterator<Item = NearFacet>, within: &AABB<Vec3>) -> Self {
        let meets = |box_mm: &AABB<Vec3>| rstar::Envelope::intersects(box_mm, within);
        let mut facets: Vec<_> = facets.filter(|facet| meets(&facet.envelope())).collect();
        let of_facet = |k: usize| (0..3).map(move |side| (k, side));
        let sides = (0..facets.len()).flat_map(of_facet);
        let mut sides: Vec<_> =
            sides.map(|(facet, side)| (key(&facets[facet], side), facet, side)).collect();
        sides.sort_unstable();
        let mut edges = Vec::new();
        for sides in sides.chunk_by(|a, b| a.0 == b.0) {
            let (_, facet, side) = sides[0];
            let corners = facets[facet].corners;
            let line = Line::new(corners[side], corners[(side + 1) % 3]);
            // Beyond the box the other facet may be missing.
            if !meets(&line.envelope()) {
                continue;
            }
            let turn = match *sides {
                [(_, a, of_a), (_, b, of_b)] => turn((&facets[a], of_a), (&facets[b], of_b)),
                _ => EdgeTurn::Crease,
            };
            if let EdgeTurn::Smooth(curvature) = turn {
                for &(_, facet, _) in sides {
                    facets[facet].curvature = facets[facet].curvature.max(curvature);
                }
            }
            edges.push(GeomWithData::new(line, turn));
        }
        Self { facets: RTree::bulk_load(facets), edges: RTree::bulk_load(edges) }
    }

    /// Returns where a ray first enters the part; `direction` is a unit vector.
    pub(super) fn entered(&self, origin: Vec3, direction: Vec3) -> Option<Contact> {
        let ray = RaySelection { origin, direction };
        let met = self.facets.locate_with_selection_function(ray);
        let met = met.filter_map(|facet| Some((facet.entered(origin, direction)?, facet)));
        let (length_mm, facet) = met.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let at_mm = add(origin, scale(direction, length_mm));
        Some(Contact { at_mm, length_mm, normal: facet.normal, curvature: facet.curvature })
    }

    /// Returns whether a crease is nearer to a point.
    pub(super) fn has_crease_within(&self, point: Vec3, distance_mm: f64) -> bool {
        let mut edges = self.edges.locate_within_distance(point, distance_mm * distance_mm);
        edges.any(|edge| matches!(edge.data, EdgeTurn::Crease))
    }

    /// Returns the largest curvature around a contact, in 1/mm.
    pub(super) fn curvature(&self, contact: &Contact, radius_mm: f64) -> f64 {
        let edges = self.edges.locate_within_distance(contact.at_mm, radius_mm * radius_mm);
        let curvatures = edges.filter_map(|edge| match edge.data {
            EdgeTurn::Smooth(curvature) => Some(curvature),
            EdgeTurn::Crease => None,
        });
        curvatures.fold(contact.curvature, f64::max)
    }
}

/// Returns the bits of a side's ends in order, which its facets share.
fn key(facet: &NearFacet, side: usize) -> [[u64; 3]; 2] {
    let ends = [side, (side + 1) % 3].map(|k| facet.corners[k].map(f64::to_bits));
    if ends[0] <= ends[1] { ends } else { [ends[1], ends[0]] }
}

/// Returns how the surface turns at the edge that sides of two facets share.
///
/// Where facets stand for a curve, each turns against the next by its width times the curvature.
fn turn((a, of_a): (&NearFacet, usize), (b, of_b): (&NearFacet, usize)) -> EdgeTurn {
    // Exact for small angles, unlike the arc cosine.
    let angle = length(cross(a.normal, b.normal)).atan2(dot(a.normal, b.normal));
    let width = f64::midpoint(a.height(of_a), b.height(of_b));
    if angle > CREASE { EdgeTurn::Crease } else { EdgeTurn::Smooth(angle / width) }
}

/// Selects the boxes that a ray passes through.
struct RaySelection {
    origin: Vec3,
    direction: Vec3,
}

impl SelectionFunction<NearFacet> for RaySelection {
    fn should_unpack_parent(&self, envelope: &AABB<Vec3>) -> bool {
        let (low, high) = (envelope.lower(), envelope.upper());
        // The ray must be between all three pairs of planes at once (Kay and Kajiya 1986).
        let (mut from, mut to) = (0.0f64, f64::INFINITY);
        for k in 0..3 {
            let (start, along) = (self.origin[k], self.direction[k]);
            // 0 / 0 would be NaN where the ray starts on a plane of the box.
            if along == 0.0 {
                if start < low[k] || start > high[k] {
                    return false;
                }
                continue;
            }
            let [a, b] = [low[k], high[k]].map(|side| (side - start) / along);
            from = from.max(a.min(b));
            to = to.min(a.max(b));
        }
        from <= to
    }

    fn should_unpack_leaf(&self, leaf: &NearFacet) -> bool {
        self.should_unpack_parent(&leaf.envelope())
    }
}

#[cfg(test)]
mod tests {
    use lamp_slicing::{Facet, Part, Placement, Units};

    use super::*;

    fn near(facets: Vec<Facet>, placement: &Placement) -> NearSurface {
        let part = Part::from_facets("part", facets);
        let facets = FacetIndex::new(part, placement, Units::Millimetres).unwrap();
        Surface::new(facets).near([-50.0; 3], [50.0; 3])
    }

    const DOWN: Vec3 = [0.0, 0.0, -1.0];

    #[test]
    fn rays_enter_where_the_surface_faces_them() {
        // 20 mm high, with a hole of 10 mm along z.
        let cube = lamp_fixtures::cube_with_hole(20.0, 5.0, 2_000).facets;
        let mirrored = Placement::default().scaled([-1.0, 1.0, 1.0]);
        for placement in [Placement::default(), mirrored] {
            let cube = near(cube.clone(), &placement);
            let top = cube.entered([7.0, 1.0, 30.0], DOWN).unwrap();
            assert!(
                (top.length_mm - 10.0).abs() < 1e-9 && top.normal == [0.0, 0.0, 1.0],
                "{top:?}"
            );
            // From inside it leaves first.
            assert_eq!(cube.entered([7.0, 1.0, 5.0], DOWN), None);
            assert_eq!(cube.entered([0.0, 0.0, 30.0], DOWN), None);
            let slanted = unit([1.0, 0.0, -1.0]).unwrap();
            let wall = cube.entered([0.0, 0.0, 15.0], slanted).unwrap();
            assert!((wall.length_mm - 50f64.sqrt()).abs() < 0.01, "{wall:?}");
            // In the plane of a side, along its edges.
            assert!(cube.entered([10.0, 10.0, 30.0], DOWN).is_some());
        }
    }

    #[test]
    fn edges_are_creases_or_curves() {
        let cube =
            near(lamp_fixtures::cube_with_hole(20.0, 5.0, 2_000).facets, &Placement::default());
        // The rim of the hole at x = 5.
        assert!(cube.has_crease_within([5.6, 0.0, 20.0], 0.61));
        assert!(!cube.has_crease_within([5.6, 0.0, 20.0], 0.58));
        let wall = cube.entered([0.0, 0.1, 10.1], [1.0, 0.0, 0.0]).unwrap();
        let curvature = cube.curvature(&wall, 0.25);
        assert!((curvature - 0.2).abs() < 0.01, "{curvature}");
        assert!(!cube.has_crease_within(wall.at_mm, 0.5));
        let top = cube.entered([7.5, 0.0, 25.0], DOWN).unwrap();
        assert_eq!(cube.curvature(&top, 0.25), 0.0);
    }

    #[test]
    fn edges_of_one_facet_are_creases() {
        let alone = vec![[[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0f32]]];
        let alone = near(alone, &Placement::default());
        assert!(alone.has_crease_within([3.0, 0.4, 0.0], 0.5));
        assert!(!alone.has_crease_within([3.0, 3.0, 0.0], 0.5));
    }
}
