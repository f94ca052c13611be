//! Reads STL files, and writes parts as binary ones.

use std::io::{self, BufReader, Write};
use std::sync::Arc;

use stl_io::{Normal, Triangle, Vertex};

use crate::ascii;
use crate::error::SliceError;
use crate::facet::Facet;
use crate::part::{Facets, Part};
use crate::part_file::PartFile;

/// Header and count of a binary STL.
pub(crate) const HEADER_BYTES: u64 = 84;
/// A facet of a binary STL: normal, three corners, attributes.
pub(crate) const FACET_BYTES: usize = 50;

/// Opens an STL file that starts with these bytes, binary or ASCII. Which one it is
/// follows from its size and content: many binary files begin with `solid`, too.
///
/// # Errors
/// Returns an error if it is neither, contradicts itself or cannot be read.
pub(crate) fn open(file: &Arc<PartFile>, start: &[u8]) -> Result<Facets, SliceError> {
    let size = file.size();
    if let Some(count) = binary_facets(size, start) {
        return Ok(Facets::Binary { file: file.clone(), count });
    }
    match declared_count(start) {
        _ if ascii::looks_ascii(start, start.len() as u64 == size) => {
            Ok(Facets::Memory(Arc::new(ascii::read(BufReader::new(file.reader()))?)))
        }
        Some(declared) => Err(SliceError::Count { declared, size }),
        None => Err(SliceError::NotStl { size }),
    }
}

/// Returns the number of facets that a binary file says to have.
fn declared_count(start: &[u8]) -> Option<u32> {
    start.get(80..84).map(|count| u32::from_le_bytes(count.try_into().unwrap()))
}

/// Returns the number of facets of a binary file that starts with these bytes, if its size is that
/// of one.
pub(crate) fn binary_facets(size: u64, start: &[u8]) -> Option<usize> {
    let count = declared_count(start)?;
    let is_size = HEADER_BYTES + FACET_BYTES as u64 * u64::from(count) == size;
    is_size.then_some(count as usize)
}

/// Returns the corners of a binary facet.
#[inline]
pub(crate) fn parse(record: &[u8; FACET_BYTES]) -> Facet {
    let number = |at: usize| {
        f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
    };
    let corner = |at| [number(at), number(at + 4), number(at + 8)];
    [corner(12), corner(24), corner(36)]
}

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

/// Writes facets as binary STL.
///
/// # Errors
/// Returns an error if `out` fails.
pub fn write_stl(
    facets: impl ExactSizeIterator<Item = Facet>,
    mut out: impl Write,
) -> io::Result<()> {
    stl_io::write_stl(&mut out, facets.map(|facet| triangle(&facet)))
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
