//! Reads and writes the stack format: a multipage TIFF that needs only one pass.
//!
//! Each page's directory precedes its data, and offsets only increase:
//!
//! ```text
//! header | directory 0, texts, strip 0 | directory 1, texts, strip 1 | ...
//! ```
//!
//! Each part starts on an 8-byte boundary. The last directory's link is zero; a stack
//! without that zero was cut off. TIFFs of other writers are read too: strips and tiles, in
//! several compressions and all orientations.
//!
//! Sources: TIFF 6.0; for BigTIFF, the AWare Systems description of the
//! format that libtiff reads.

mod fields;
mod layout;
mod page;
mod read;
mod source;
mod tags;
mod tiles;
mod unpack;
mod write;

pub(crate) use page::{PackedShape, PanelPage, PassedCode};
pub use page::{Page, PageHeader};
pub use read::PageReader;
pub(crate) use source::ByteSource;
pub use write::{EncodedPage, Format, PageWriter};
