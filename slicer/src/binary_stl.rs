//! Defines the layout of binary STL files: a header, the count of facets, and a record for each
//! facet.

use crate::facet::Facet;

/// Header and count of a binary STL.
pub(crate) const HEADER_BYTES: u64 = 84;

/// A facet of a binary STL: normal, three corners, attributes.
pub(crate) const FACET_BYTES: usize = 50;

/// Returns the number of facets that a binary file declares.
pub(crate) fn declared_count(start: &[u8]) -> Option<u32> {
    start.get(80..84).map(|count| u32::from_le_bytes(count.try_into().unwrap()))
}

/// Returns the number of facets of a binary file that starts with these bytes, if its size fits
/// that number.
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
