//! CTB files of printers with Chitu boards, unencrypted.
//!
//! ```text
//! header | previews | tables of the print | table of layers | layer: numbers, run lengths | ...
//! ```
//!
//! All numbers are little-endian. Tables are where addresses say. Versions 2 to 5 are read, and
//! version 4 is written: version 3 and up have the moves of each layer.
//!
//! Source: UVtools' description in its reader and writer (`ChituboxFile.cs`), after
//! github.com/cbiffle/catibo (doc/cbddlp-ctb.adoc).

pub(crate) mod read;
pub(crate) mod rle;
pub(crate) mod tables;
pub(crate) mod write;

#[cfg(test)]
mod ctb_tests;

/// The first four bytes of versions 2 and 3.
pub(crate) const MAGIC: u32 = 0x12FD_0086;
/// The first four bytes of versions 4 and 5.
pub(crate) const MAGIC_4: u32 = 0x12FD_0106;
/// The first four bytes of an encrypted file.
pub(crate) const MAGIC_ENCRYPTED: u32 = 0x12FD_0107;
/// The first four bytes of the older format whose levels are several images.
pub(crate) const MAGIC_CBDDLP: u32 = 0x12FD_0019;
