//! Holds meshes of text formats, whose decimals are finer than the 32 bits of facets.

use std::sync::Arc;

use crate::facet::Facet;
use crate::piece::{Facets, Piece};

/// A mesh is far from the origin along an axis if the ratio of its greatest coordinate there to its
/// size is at least this. Vertices of nearer meshes are off by at most `size / 2^18`, 0.4 um of 100
/// mm.
const FAR: f64 = 64.0;

/// A mesh as in the text: vertices in decimals, and facets of vertex numbers.
#[derive(Debug, Default)]
pub(crate) struct DecimalMesh {
    vertices: Vec<[f64; 3]>,
    facets: Vec<[u32; 3]>,
}

impl DecimalMesh {
    pub(crate) fn add_vertex(&mut self, vertex: [f64; 3]) {
        self.vertices.push(vertex);
    }

    /// Returns the number of vertices so far.
    pub(crate) fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    /// Adds a facet of vertices that were added before.
    pub(crate) fn add_facet(&mut self, corners: [u32; 3]) {
        self.facets.push(corners);
    }

    /// Returns a piece with the facets in 32 bits. A mesh far from the origin is measured from its
    /// own corner, since rounding to 32 bits errs in proportion to the distance.
    pub(crate) fn into_piece(self) -> Piece {
        let offset = self.offset();
        let rounded = |number: u32| {
            let vertex = self.vertices[number as usize];
            std::array::from_fn(|axis| (vertex[axis] - offset[axis]) as f32)
        };
        let facets = self.facets.iter().map(|corners| corners.map(rounded)).collect::<Vec<Facet>>();
        Piece { offset, ..Piece::new(Facets::Memory(Arc::new(facets))) }
    }

    /// Returns the least coordinates of the mesh along axes where it is far away, and zero along
    /// the others.
    fn offset(&self) -> [f64; 3] {
        let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
        // Vertices that no facet uses may be anywhere.
        for vertex in self.facets.iter().flatten().map(|&number| self.vertices[number as usize]) {
            low = std::array::from_fn(|axis| low[axis].min(vertex[axis]));
            high = std::array::from_fn(|axis| high[axis].max(vertex[axis]));
        }
        offset_of(low, high)
    }
}

/// Returns the least coordinates of a box along axes where it is far away, and zero along the
/// others.
pub(crate) fn offset_of(low: [f64; 3], high: [f64; 3]) -> [f64; 3] {
    let size = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
    std::array::from_fn(|axis| {
        // Below zero if the box surrounds the origin.
        let nearest = low[axis].max(-high[axis]);
        if nearest.is_finite() && nearest > FAR * size { low[axis] } else { 0.0 }
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn piece(vertices: &[[f64; 3]]) -> (Vec<Facet>, [f64; 3]) {
        let mut mesh = DecimalMesh::default();
        vertices.iter().for_each(|vertex| mesh.add_vertex(*vertex));
        (0..vertices.len() as u32 - 2).for_each(|k| mesh.add_facet([k, k + 1, k + 2]));
        let piece = mesh.into_piece();
        let Facets::Memory(facets) = piece.facets else { panic!("they are in memory") };
        (facets.to_vec(), piece.offset)
    }

    #[test]
    fn near_meshes_are_rounded_as_they_are() {
        let vertices = [[383.9, 0.1, -0.3], [377.9, 4.0, 5.7], [380.0, 3.0, 0.0]];
        let (facets, offset) = piece(&vertices);
        assert_eq!((facets[0], offset), (vertices.map(|v| v.map(|c| c as f32)), [0.0; 3]));
    }

    #[test]
    fn damaged_numbers_stay_what_they_are() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let (facets, _) = piece(&[[bad; 3], [9e9, 0.0, 0.0], [9e9, 1.0, 0.0]]);
            assert!(facets[0][0].iter().all(|c| !c.is_finite()));
        }
    }

    proptest! {
        /// At 500 m, 32 bits alone are off by up to 0.015 mm.
        #[test]
        fn far_meshes_keep_their_shape(
            size in 0.01..100.0f64,
            far in prop::array::uniform3(-5e5..5e5f64),
            corners in prop::collection::vec(prop::array::uniform3(0.0..1.0f64), 3..20),
        ) {
            let place = |corner: &[f64; 3]| -> [f64; 3] {
                std::array::from_fn(|axis| far[axis] + size * corner[axis])
            };
            let vertices: Vec<_> = corners.iter().map(place).collect();
            let (facets, offset) = piece(&vertices);
            for (facet, corners) in facets.iter().zip(vertices.windows(3)) {
                for (rounded, vertex) in facet.iter().zip(corners) {
                    for axis in 0..3 {
                        let off = offset[axis] + f64::from(rounded[axis]) - vertex[axis];
                        prop_assert!(off.abs() <= size * (FAR + 1.0) / 2f64.powi(24) + 1e-10, "{off}");
                    }
                }
            }
        }
    }
}
