//! Defines the trait of a B-rep kernel, and the facets and surface points that it returns.

use crate::color::Color;
use crate::error::BrepError;
use crate::notice::Notice;

/// A point of a surface, in millimeters, and its first derivatives. Kernels in other
/// languages write it as nine numbers in this order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Jet {
    /// The point.
    pub point: [f64; 3],
    /// The derivative along u.
    pub du: [f64; 3],
    /// The derivative along v.
    pub dv: [f64; 3],
}

/// A model read by a kernel: placed bodies, in millimeters.
///
/// Faces are numbered across all bodies. Each has a surface with the same number.
pub trait KernelModel: Send + Sync {
    /// Returns the bodies in the file's order. A body placed twice appears twice.
    fn bodies(&self) -> &[Body];

    /// Returns a face by its number.
    ///
    /// # Panics
    /// Panics if there is no such face.
    fn face(&self, face: u32) -> FaceInfo;

    /// Returns the color of a face; `None` if the file gives it none, or the kernel does not know.
    ///
    /// # Panics
    /// May panic if there is no such face.
    fn color(&self, _face: u32) -> Option<Color> {
        None
    }

    /// Returns the name of the file's length unit, for reports.
    fn unit(&self) -> &str;

    /// Returns the uncertainty of lengths that the file states, in millimeters.
    fn uncertainty_mm(&self) -> Option<f64> {
        None
    }

    /// Returns the contents of the file besides the bodies, and parts that are not read as they
    /// stand.
    fn notices(&self) -> &[Notice] {
        &[]
    }

    /// Returns the number of edges that bound only one face, so that facets cannot close there; 0
    /// if the kernel does not know.
    fn free_edges(&self) -> usize {
        0
    }

    /// Returns the longest side of the box of the vertices, in millimeters; 0 if the kernel
    /// does not know.
    fn longest_mm(&self) -> f64 {
        0.0
    }

    /// Tessellates the faces into facets at most `chord_mm` from their surfaces, joined
    /// along their edges.
    ///
    /// Faces that fail are left out and reported as findings. Call
    /// [`check`](crate::check) to see whether bodies are closed.
    ///
    /// # Errors
    /// Returns an error if the chord is not a positive length, or there would be too
    /// many facets.
    fn tessellate(&self, chord_mm: f64) -> Result<Tessellation, BrepError>;

    /// Evaluates a face's surface at many parameters at once.
    ///
    /// Parameters may lie outside the face, and outside the domain where the surface
    /// can be continued. Parameters of closed surfaces are periodic. Jets are NaN where
    /// there is no surface.
    ///
    /// # Panics
    /// Panics if the face does not exist, or the lists differ in length.
    fn evaluate(&self, face: u32, uv: &[[f64; 2]], jets: &mut [Jet]);
}

/// A body and its faces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Body {
    /// The name from the file, or the name of its product; may be empty.
    pub name: String,
    /// The indices of its faces.
    pub faces: std::ops::Range<u32>,
}

/// A face's properties for reports.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceInfo {
    /// The kind of its surface: `plane`, `cylinder`, `B-spline`.
    pub kind: &'static str,
    /// The entity's number in the file, such as 12 for `#12`; 0 if unknown.
    pub entity: u64,
    /// Whether its surface is closed both ways, so that only the direction of its loops shows which
    /// side of them is the face.
    pub is_closed: bool,
    /// The least and the greatest corner of the surface's control points, in
    /// millimeters, if it has any. They enclose the surface.
    pub control_box_mm: Option<[[f64; 3]; 2]>,
}

/// A triangle of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrepFacet {
    /// The indices of its corners, counterclockwise seen from outside.
    pub corners: [u32; 3],
    /// The corners' parameters on the face's surface. A point on a seam or at a pole
    /// has several.
    pub uv: [[f64; 2]; 3],
    /// The index of its face.
    pub face: u32,
}

impl BrepFacet {
    /// Turns the facet over.
    pub(crate) fn turn_over(&mut self) {
        self.corners.swap(1, 2);
        self.uv.swap(1, 2);
    }
}

/// The facets of all bodies.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tessellation {
    /// All points, in millimeters. Neighboring faces share the points of their edge.
    pub points: Vec<[f64; 3]>,
    /// The facets, by body and face.
    pub facets: Vec<BrepFacet>,
    /// Triangles with two corners at one pole, by face. They have no area in space, but
    /// they cover parameters of the face, which volume integrals need.
    pub tips: Vec<BrepFacet>,
    /// The faults found in faces.
    pub findings: Vec<BrepFinding>,
    /// The greatest distance of facets from their surfaces, in millimeters.
    pub chord_mm: f64,
}

impl Tessellation {
    /// Returns a facet's corners.
    pub fn corners(&self, facet: &BrepFacet) -> [[f64; 3]; 3] {
        facet.corners.map(|corner| self.points[corner as usize])
    }

    /// Returns the facets of a range of faces.
    pub fn of_faces(&self, faces: &std::ops::Range<u32>) -> &[BrepFacet] {
        of_faces(&self.facets, faces)
    }

    /// Returns the tips of a range of faces.
    pub(crate) fn tips_of_faces(&self, faces: &std::ops::Range<u32>) -> &[BrepFacet] {
        of_faces(&self.tips, faces)
    }
}

fn of_faces<'a>(facets: &'a [BrepFacet], faces: &std::ops::Range<u32>) -> &'a [BrepFacet] {
    // Facets are sorted by face, so two binary searches find a body's.
    let start = facets.partition_point(|facet| facet.face < faces.start);
    let end = facets.partition_point(|facet| facet.face < faces.end);
    &facets[start..end]
}

/// A fault and its face.
#[derive(Clone, Debug, PartialEq)]
pub struct BrepFinding {
    /// The index of the face.
    pub face: u32,
    /// The entity's number in the file.
    pub entity: u64,
    /// The fault.
    pub fault: FaceFault,
}

/// A fault of a face.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FaceFault {
    /// Its loops do not bound a region of its surface.
    #[error("its loops do not bound an area")]
    Unbounded,
    /// Its loops cross each other or themselves.
    #[error("its loops cross each other or themselves")]
    Crossing,
    /// It could not be tessellated, for another reason.
    #[error("no facets could be made from it")]
    Missing,
    /// A loop's edges do not follow each other.
    #[error("the edges of a loop do not follow each other")]
    Broken,
    /// An edge is off the surface.
    #[error("an edge lies {off_mm:.6} mm off its surface")]
    Off {
        /// The distance, in millimeters.
        off_mm: f64,
    },
    /// An edge was off the surface, and was moved to the intersection of its surfaces.
    #[error("an edge lay {off_mm:.6} mm off its surface; it was moved onto its surfaces")]
    Rebuilt {
        /// The distance, in millimeters.
        off_mm: f64,
    },
    /// Its loops go clockwise although they should not. The face was turned over to fit the loops.
    #[error("its sense contradicts its loops; the loops were followed")]
    Sense,
    /// A loop ran along an edge in the same direction as a neighbor's loop.
    #[error("a loop ran against its neighbors; it was reversed")]
    Contrary,
    /// Some of its edges were joined with edges of its neighbors.
    #[error("{joints} of its edges were joined, up to {off_mm:.6} mm apart")]
    Joined {
        /// The number of joints: ends of edges, or whole edges.
        joints: usize,
        /// The greatest gap, in millimeters.
        off_mm: f64,
    },
    /// It points inward where its neighbors point outward.
    #[error("it is inside out next to its neighbors; it was turned over")]
    Inverted,
    /// The shell that begins with it points the wrong way: out of a void, or into the body.
    #[error("its shell points the wrong way; it was turned over")]
    Shell,
    /// All faces of its body point inward.
    #[error("its body is inside out; the whole body was turned over")]
    InsideOut,
    /// It is too large, or bends too much, for the chord.
    #[error(
        "it would be divided into about {cells:.0} cells, which are too many; give a longer chord"
    )]
    Fine {
        /// The number of cells.
        cells: f64,
    },
    /// It bends too much for its facets to follow.
    #[error("facets lie {off_mm:.4} mm off its surface")]
    Coarse {
        /// The distance, in millimeters.
        off_mm: f64,
    },
}

impl FaceFault {
    /// Returns the distance of a fault, in millimeters, or 0 for faults without one.
    pub fn off_mm(&self) -> f64 {
        match self {
            Self::Off { off_mm }
            | Self::Rebuilt { off_mm }
            | Self::Joined { off_mm, .. }
            | Self::Coarse { off_mm } => *off_mm,
            _ => 0.0,
        }
    }
}
