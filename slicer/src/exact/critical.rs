//! Defines the places where the contours of sections may turn back or meet.

/// The places where the contours of any section may have extrema or meet.
#[derive(Debug)]
pub(super) struct CriticalPoints {
    pub(super) candidates: Vec<CandidateFacet>,
    pub(super) saddles: Vec<Saddle>,
}

/// A curved facet whose surface may have extrema.
#[derive(Debug)]
pub(super) struct CandidateFacet {
    pub(super) facet: u32,
    /// The x components of the normals at the corners.
    pub(super) normal_x: [f64; 3],
    pub(super) low_mm: f64,
    pub(super) high_mm: f64,
    /// Whether the surface may be level over the facet.
    pub(super) may_be_level: bool,
}

/// Extrema closer than this, in millimeters, are the same.
pub(super) const SAME_MM: f64 = 1e-6;

/// A point where a surface is level and bends both ways.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Saddle {
    /// The point, in millimeters.
    pub(super) at_mm: [f64; 3],
    pub(super) facet: u32,
    pub(super) uv: [f64; 2],
    /// Whether the part is below.
    pub(super) is_above: bool,
    /// The surface here is z* + (a dx^2 + 2 b dx dy + c dy^2) / 2.
    pub(super) form: [f64; 3],
    /// The derivatives of u and v with respect to x and y.
    pub(super) uv_by: [[f64; 2]; 2],
}
