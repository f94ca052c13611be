//! Holds a model in memory: placed bodies, faces, edges and vertices, in millimetres.

use crate::geometry::{Curve, Surface};
use crate::kernel::{Body, Notice};
use crate::vector::Vec3;

/// All bodies of a file.
#[derive(Debug, Default)]
pub(crate) struct BrepModel {
    pub(crate) bodies: Vec<Body>,
    pub(crate) faces: Vec<Face>,
    pub(crate) edges: Vec<BrepEdge>,
    pub(crate) vertices: Vec<Vec3>,
    /// What the file holds besides.
    pub(crate) notices: Vec<Notice>,
    /// The name of the file's length unit.
    pub(crate) unit: String,
    /// The uncertainty of lengths that the file states, in millimetres.
    pub(crate) uncertainty_mm: Option<f64>,
}

/// A piece of a surface.
#[derive(Debug)]
pub(crate) struct Face {
    /// The entity's number in the file.
    pub(crate) entity: u64,
    pub(crate) surface: Surface,
    /// Whether its loops go counter-clockwise seen against the surface's normal.
    pub(crate) along_normal: bool,
    /// Whether the surface's normal points out of the body.
    pub(crate) outwards: bool,
    pub(crate) loops: Vec<Loop>,
}

/// A piece of a face's boundary.
#[derive(Debug)]
pub(crate) enum Loop {
    /// A single point, such as the tip of a cone.
    Vertex(usize),
    /// Edges by number, each with whether the loop follows it from its start.
    Edges(Vec<(usize, bool)>),
}

/// A piece of a curve between two vertices.
#[derive(Debug)]
pub(crate) struct BrepEdge {
    pub(crate) curve: Curve,
    /// The numbers of its first and last vertex.
    pub(crate) ends: [usize; 2],
    /// Whether it follows the curve's direction.
    pub(crate) forward: bool,
}
