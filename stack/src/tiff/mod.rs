//! The stack format: a multipage TIFF that is written and read in one pass.
//!
//! Each page's directory stands before its data, and offsets only grow:
//!
//! ```text
//! header | directory 0, texts, strip 0 | directory 1, texts, strip 1 | ...
//! ```
//!
//! Everything starts on an 8-byte boundary. The last directory's link is
//! zero; a stack without that zero was cut off.
//!
//! Sources: TIFF 6.0; for BigTIFF, the AWare Systems description of the
//! format that libtiff reads.

mod fields;
mod page;
mod read;
mod source;
mod tags;
mod write;

pub use page::{Compression, Page};
pub use read::PageReader;
pub use write::{EncodedPage, Format, PageWriter};
