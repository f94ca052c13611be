//! Holds a model in memory: placed bodies, faces, edges and vertices, in millimeters.

use crate::color::Color;
use crate::geometry::{Curve, Surface, edge_range};
use crate::kernel::Body;
use crate::notice::Notice;
use crate::vector::{Vec3, distance};

/// All bodies of a file.
#[derive(Debug, Default)]
pub(crate) struct BrepModel {
    pub(crate) bodies: Vec<Body>,
    pub(crate) faces: Vec<Face>,
    pub(crate) edges: Vec<BrepEdge>,
    pub(crate) vertices: Vec<Vec3>,
    /// Notices about the other contents of the file.
    pub(crate) notices: Vec<Notice>,
    /// The name of the file's length unit.
    pub(crate) unit: String,
    /// The uncertainty of lengths that the file states, in millimeters.
    pub(crate) uncertainty_mm: Option<f64>,
}

impl BrepModel {
    /// Returns the edges that bound only one face, in ascending order, except edges that are a
    /// single point.
    pub(crate) fn free_edges(&self) -> Vec<usize> {
        let mut uses = vec![0u32; self.edges.len()];
        for around in self.faces.iter().flat_map(|face| &face.loops) {
            if let Loop::Edges(edges) = around {
                edges.iter().for_each(|(edge, _)| uses[*edge] += 1);
            }
        }
        // An edge without length, as at a pole, has no second face.
        let is_free = |edge: &usize| uses[*edge] == 1 && !self.is_point(&self.edges[*edge]);
        (0..uses.len()).filter(is_free).collect()
    }

    /// Returns the ends and the middles of the edges of loops.
    pub(crate) fn points_of(&self, loops: &[Loop]) -> Vec<Vec3> {
        let edges = loops.iter().flat_map(|around| match around {
            Loop::Edges(edges) => edges.as_slice(),
            Loop::Vertex(_) => &[],
        });
        let of_edge = |(edge, _): &(usize, bool)| {
            let edge = &self.edges[*edge];
            let [start, end] = edge.ends.map(|vertex| self.vertices[vertex]);
            [start, end, self.middle(edge)]
        };
        edges.flat_map(of_edge).collect()
    }

    fn middle(&self, edge: &BrepEdge) -> Vec3 {
        let [start, end] = edge.ends.map(|vertex| self.vertices[vertex]);
        let [from, to] = edge_range(&edge.curve, start, end, edge.forward);
        edge.curve.place((from + to) / 2.0)
    }

    fn is_point(&self, edge: &BrepEdge) -> bool {
        let [start, end] = edge.ends.map(|vertex| self.vertices[vertex]);
        // A closed edge has equal ends too. Only its middle shows that it has a length.
        distance(start, end) < POINT_MM && distance(start, self.middle(edge)) < POINT_MM
    }
}

/// The length below which an edge is a single point, in millimeters.
const POINT_MM: f64 = 1e-6;

/// A piece of a surface.
#[derive(Debug)]
pub(crate) struct Face {
    /// The entity's number in the file.
    pub(crate) entity: u64,
    pub(crate) surface: Surface,
    /// Whether its loops go counterclockwise seen against the surface's normal.
    pub(crate) along_normal: bool,
    /// Whether the surface's normal points out of the body.
    pub(crate) outwards: bool,
    pub(crate) loops: Vec<Loop>,
    /// The index of the loop marked as the outer one, if exactly one is.
    pub(crate) outer: Option<usize>,
    pub(crate) color: Option<Color>,
}

/// A piece of a face's boundary.
#[derive(Debug)]
pub(crate) enum Loop {
    /// A single point, such as the tip of a cone.
    Vertex(usize),
    /// Edges by number, each with a flag: whether the loop follows it from its start.
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
