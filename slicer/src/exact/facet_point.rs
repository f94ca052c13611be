//! Defines points of facets that are moved onto surfaces, and pairs of these points.

/// A point of a facet to be moved along an axis, x or z, to the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacetPoint {
    /// The index of the facet in the tessellation.
    pub facet: u32,
    /// The point's parameters on the facet's surface.
    pub uv: [f64; 2],
    /// The point, in millimeters.
    pub at_mm: [f64; 3],
    /// Whether the axis enters the part here, according to the facet.
    pub enters: bool,
    /// Whether the point was found on the surface.
    pub is_exact: bool,
}

impl FacetPoint {
    /// Returns a point that is still on its facet.
    pub fn new(facet: u32, uv: [f64; 2], at_mm: [f64; 3], enters: bool) -> Self {
        Self { facet, uv, at_mm, enters, is_exact: false }
    }
}

/// A row's crossings near an extremum or a saddle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RowContact {
    /// Two crossings of the contour, the left one first.
    Pair([FacetPoint; 2]),
    /// At least one crossing on one side; on the other side, the contour may turn again.
    OneSide(FacetPoint),
    /// No crossing.
    Nothing,
    /// Unknown: no point of the surface was found.
    Unknown,
}
