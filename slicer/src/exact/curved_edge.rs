//! Curved B-rep edges, which facets follow by chords.

use lamp_brep::vector::Vec3;
use lamp_stack::Grouped;

/// The curved edges of a part.
#[derive(Debug)]
pub(super) struct CurvedEdges {
    pub(super) all: Vec<CurvedEdge>,
    /// The edges at each facet.
    pub(super) by_facet: Grouped<u32>,
}

/// A side that facets of two faces share, where the faces meet along a curve.
#[derive(Debug)]
pub(super) struct CurvedEdge {
    /// The facets on both sides. The first one's corners come in the chord's direction.
    pub(super) facets: [u32; 2],
    /// The curve's points at the chord's ends.
    pub(super) ends: [EdgePoint; 2],
    /// The chord's ends as the facets have them: x and y in millimeters, z in micrometers.
    pub(super) chord: [[f64; 3]; 2],
    /// The curve's extremum along each axis, if there is one between the ends.
    pub(super) turns: [Option<EdgePoint>; 3],
}

/// A point of an edge's curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgePoint {
    pub(super) at_mm: Vec3,
    /// Its parameters on the surface of each side.
    pub(super) uv: [[f64; 2]; 2],
    /// Its place along the chord, 0 to 1.
    pub(super) share: f64,
    /// The derivative of the point by its share.
    pub(super) slope: Vec3,
}
