//! The surface of a stack, from runs.
//!
//! A stack is divided into cubic cells. The share of a cell that is white comes from the runs of
//! the layers in it, and the surface runs where that share is a half: naive surface nets
//! (S. Gibson, *Constrained elastic surface nets*, MICCAI 1998), as `fast-surface-nets` makes them.

mod cells;
mod nets;
mod pinches;
mod planes;
mod scale;

use lamp_stack::Length;
use thiserror::Error;

pub use cells::{CellGrid, MAX_CELLS, SurfaceOptions};

/// The surface of a stack, as triangles.
///
/// # Guarantees
/// It is closed and a manifold: each edge has two triangles, which run it in opposite ways, and the
/// triangles at a vertex are one fan. Where cells touch along an edge or at a corner alone, a cell
/// between them is white, too. Triangles run counter-clockwise seen from outside.
#[derive(Clone, Debug, PartialEq)]
pub struct StackSurface {
    /// The unit of coordinates.
    pub unit: SurfaceUnit,
    /// The vertices, x to the right, y to the back and z up, in part coordinates.
    pub vertices: Vec<[f32; 3]>,
    /// The direction out of the part at each vertex, of length one.
    pub normals: Vec<[f32; 3]>,
    /// The vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// The unit of a surface's coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceUnit {
    /// Millimeters.
    Millimetres,
    /// Pixels, where the stack does not state its resolution and heights. A layer is then as thick
    /// as a pixel is wide, and the lower left corner of the image is at zero.
    Pixels,
}

/// The first bytes of a surface for the page.
const MAGIC: &[u8; 4] = b"LSRF";
/// The version of their form.
const VERSION: u32 = 1;

impl StackSurface {
    /// Returns the corners of each triangle.
    pub fn facets(&self) -> impl ExactSizeIterator<Item = [[f32; 3]; 3]> + '_ {
        self.triangles.iter().map(|triangle| triangle.map(|vertex| self.vertices[vertex as usize]))
    }

    /// Returns the surface as the viewer's page reads it: `LSRF`, version, numbers of vertices and
    /// triangles, vertices, normals and triangles, all little-endian and of four bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        // The viewer's limit of triangles keeps both numbers far below 2^32.
        let head = [VERSION, self.vertices.len() as u32, self.triangles.len() as u32];
        let places = self.vertices.iter().chain(&self.normals).flatten();
        let mut bytes =
            // The head has 16 bytes, a vertex with its normal 24, a triangle 12.
            Vec::with_capacity(16 + 24 * self.vertices.len() + 12 * self.triangles.len());
        bytes.extend_from_slice(MAGIC);
        bytes.extend(head.into_iter().flat_map(u32::to_le_bytes));
        bytes.extend(places.flat_map(|place| place.to_le_bytes()));
        bytes.extend(self.triangles.iter().flatten().flat_map(|vertex| vertex.to_le_bytes()));
        bytes
    }
}

/// A stack without a surface.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// The heights of layers do not go up.
    #[error("layer {layer}: its z and thickness do not place it above the layer before it")]
    Heights {
        /// The layer's index.
        layer: u32,
    },
    /// Images of layers do not lie above each other.
    #[error("layer {layer} differs in resolution or origin from the layers before it")]
    Unlike {
        /// The layer's index.
        layer: u32,
    },
    /// A layer's image is larger than its page said.
    #[error("layer {layer} is larger than its page said before")]
    Grown {
        /// The layer's index.
        layer: u32,
    },
    /// No cell is white enough.
    #[error(
        "there is no surface: all is black, or thinner than half a cell{}",
        .cell.map(|side| format!(" of {}", side.to_whole_nm())).unwrap_or_default()
    )]
    Nothing {
        /// The side of a cell, if the stack states its resolution.
        cell: Option<Length>,
    },
    /// The surface has too many triangles.
    #[error("the surface has more than {most} triangles")]
    TooManyTriangles {
        /// The limit.
        most: usize,
    },
}

#[cfg(test)]
mod tests;
