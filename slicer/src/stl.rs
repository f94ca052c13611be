//! Writes parts as binary STL.

use std::io::{self, Write};

use stl_io::{Normal, Triangle, Vertex};

use crate::facet::Facet;
use crate::part::Part;

impl Part {
    /// Writes the facets as binary STL, in the file's units: those of exact surfaces
    /// in millimetres.
    ///
    /// # Errors
    /// Returns an error if the part cannot be read, or `out` fails.
    pub fn write_stl(&self, mut out: impl Write) -> io::Result<()> {
        let mut triangles = Vec::with_capacity(self.facet_count());
        for block in 0..self.block_count() {
            self.for_each_in_block(block, |facet| triangles.push(triangle(facet)))?;
        }
        stl_io::write_stl(&mut out, triangles.iter())
    }
}

fn triangle(facet: &Facet) -> Triangle {
    let [a, b, c] = facet.map(|corner| corner.map(f64::from));
    let [e, f] = [b, c].map(|to| [0, 1, 2].map(|k| to[k] - a[k]));
    let across = |i: usize, j: usize| e[i] * f[j] - e[j] * f[i];
    let normal = [across(1, 2), across(2, 0), across(0, 1)];
    let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
    // A facet without area has none.
    let per = if length > 0.0 { 1.0 / length } else { 0.0 };
    Triangle {
        normal: Normal::new(normal.map(|n| (n * per) as f32)),
        vertices: facet.map(Vertex::new),
    }
}
