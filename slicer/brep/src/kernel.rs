//! The trait of a B-rep kernel, and the facets and surfaces that slicing needs of it.

use crate::error::BrepError;

/// A point of a surface, in millimetres, and its first derivatives: nine numbers in
/// this order, so that a kernel in another language can write them.
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

/// A model as a kernel has read it: bodies in their places, in millimetres.
///
/// Faces are numbered across all bodies. Each lies on a surface of its own,
/// which has the face's number.
pub trait Kernel: Send + Sync {
    /// Returns the bodies, in the file's order; a body that is placed twice is there
    /// twice.
    fn bodies(&self) -> &[Body];

    /// Returns a face by its number.
    ///
    /// # Panics
    /// Panics if there is no such face.
    fn face(&self, face: u32) -> FaceInfo;

    /// Returns the name of the file's length unit, for reports.
    fn unit(&self) -> &str;

    /// Returns the uncertainty of lengths that the file states, in millimetres.
    fn uncertainty_mm(&self) -> Option<f64> {
        None
    }

    /// Makes the faces into facets at most `chord_mm` from their surfaces, joined
    /// along their edges.
    ///
    /// Faces that could not be made into facets are missing, and among the findings:
    /// whether bodies are closed is for [`check`](crate::check) to say.
    ///
    /// # Errors
    /// Returns an error if the chord is not a positive length, or there would be too many
    /// facets.
    fn tessellate(&self, chord_mm: f64) -> Result<Tessellation, BrepError>;

    /// Evaluates a face's surface at many parameters at once.
    ///
    /// Parameters may lie beyond the face, and outside the surface's domain as far
    /// as it goes on there; those of closed surfaces come again. Where there is no
    /// surface, numbers are NaN.
    ///
    /// # Panics
    /// Panics if there is no such face, or the lists differ in length.
    fn evaluate(&self, face: u32, uv: &[[f64; 2]], jets: &mut [Jet]);
}

/// A body and its faces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Body {
    /// The name that the file gives it, or else its product; may be empty.
    pub name: String,
    /// The numbers of its faces.
    pub faces: std::ops::Range<u32>,
}

/// A face's properties for reports.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceInfo {
    /// The kind of its surface: `plane`, `cylinder`, `B-spline`.
    pub kind: &'static str,
    /// The entity of the file, such as 12 for `#12`; 0 where it is not known.
    pub entity: u64,
    /// The least and the greatest corner of its surface's control points, in
    /// millimetres, if it has some: nothing of the surface lies outside.
    pub control_box_mm: Option<[[f64; 3]; 2]>,
}

/// A triangle of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Its corners among the points, counter-clockwise seen from outside.
    pub corners: [u32; 3],
    /// The corners' parameters on the face's surface. Along a seam or around a pole
    /// the same point has several.
    pub uv: [[f64; 2]; 3],
    /// The face.
    pub face: u32,
}

/// Bodies as facets.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tessellation {
    /// All points, in millimetres. Faces that meet share those of their edge.
    pub points: Vec<[f64; 3]>,
    /// The facets, body after body and face after face.
    pub facets: Vec<Facet>,
    /// Triangles with two corners at one pole, face after face: they have no area
    /// in space, and are no facets, but their parameters belong to the faces.
    pub tips: Vec<Facet>,
    /// The faults found in faces.
    pub findings: Vec<Finding>,
    /// The greatest distance of facets from their surfaces, in millimetres.
    pub chord_mm: f64,
}

impl Tessellation {
    /// Returns a facet's corners.
    pub fn corners(&self, facet: &Facet) -> [[f64; 3]; 3] {
        facet.corners.map(|corner| self.points[corner as usize])
    }

    /// Returns the facets of some faces.
    pub fn of_faces(&self, faces: &std::ops::Range<u32>) -> &[Facet] {
        of_faces(&self.facets, faces)
    }

    /// Returns the tips of some faces.
    pub(crate) fn tips_of_faces(&self, faces: &std::ops::Range<u32>) -> &[Facet] {
        of_faces(&self.tips, faces)
    }
}

fn of_faces<'a>(facets: &'a [Facet], faces: &std::ops::Range<u32>) -> &'a [Facet] {
    let start = facets.partition_point(|facet| facet.face < faces.start);
    let end = facets.partition_point(|facet| facet.face < faces.end);
    &facets[start..end]
}

/// Something wrong with a face.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The face's number.
    pub face: u32,
    /// The entity of the file.
    pub entity: u64,
    /// The fault.
    pub fault: Fault,
}

/// A fault of a face.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// Its loops do not bound a piece of its surface.
    #[error("its loops bound nothing")]
    Unbounded,
    /// Its loops cross each other or themselves.
    #[error("its loops cross each other or themselves")]
    Crossing,
    /// No facets could be made of it, for another reason.
    #[error("no facets could be made of it")]
    Missing,
    /// A loop's edges do not follow each other.
    #[error("the edges of a loop do not follow each other")]
    Broken,
    /// An edge lies off the surface.
    #[error("an edge lies {off_mm:.6} mm off its surface")]
    Off {
        /// The distance, in millimetres.
        off_mm: f64,
    },
    /// Its loops go clockwise where they should not; they were followed, and the
    /// face turned over.
    #[error("its sense is against its loops; the loops were followed")]
    Sense,
    /// Edges that it gives apart from its neighbours were joined with theirs.
    #[error("{joints} of its edges were joined, up to {off_mm:.6} mm apart")]
    Joined {
        /// The number of joints: ends of edges, or whole edges.
        joints: usize,
        /// The greatest gap, in millimetres.
        off_mm: f64,
    },
    /// It points inwards where its neighbours point outwards.
    #[error("it is inside out beside its neighbours; it was turned over")]
    Inverted,
    /// All faces of its body point inwards.
    #[error("its body is inside out; all of it was turned over")]
    InsideOut,
    /// It is too large for the chord, or bends too much.
    #[error("it takes about {cells:.0} cells of facets; give a longer chord")]
    Fine {
        /// The number of cells.
        cells: f64,
    },
    /// It bends more than the facets could follow.
    #[error("facets lie {off_mm:.4} mm off its surface")]
    Coarse {
        /// The distance, in millimetres.
        off_mm: f64,
    },
}

impl Fault {
    /// Returns how far something is off, in millimetres, or 0 for other faults.
    pub fn off_mm(&self) -> f64 {
        match self {
            Self::Off { off_mm } | Self::Joined { off_mm, .. } | Self::Coarse { off_mm } => *off_mm,
            _ => 0.0,
        }
    }
}
