//! GOO files, the format of Elegoo's printers, version 3.
//!
//! ```text
//! header: names, two previews, numbers | layer: numbers, run lengths | ... | footer
//! ```
//!
//! All numbers are big-endian; one printer's files have them little-endian.
//!
//! Sources: Elegoo's specification of the format (github.com/elegooofficial/GOO), and what UVtools
//! reads and writes where that is silent.

pub(crate) mod header;
pub(crate) mod read;
pub(crate) mod rle;
pub(crate) mod write;

#[cfg(test)]
mod goo_tests;

/// The first bytes of every file: the version, which may be another, and a fixed text.
pub(crate) const VERSION: &[u8; 4] = b"V3.0";
pub(crate) const MAGIC: &[u8; 8] = b"\x07\0\0\0DLP\0";
