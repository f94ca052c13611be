//! Images as bytes: the compressions of TIFF and PNG, and packed stacks.

pub(crate) mod bits;
pub(crate) mod compression;
pub(crate) mod deflate;
pub mod g4;
pub(crate) mod packbits;
pub(crate) mod packed;
pub(crate) mod picture_fault;
pub(crate) mod picture_format;
pub(crate) mod picture_page;
pub(crate) mod png_page;
pub(crate) mod png_write;
pub(crate) mod tiff;
