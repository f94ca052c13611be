//! The vocabulary that every stage of LAMP shares.
//!
//! A layer image is never pixels here but runs: each row of a [`Mask`] is the
//! sorted list of columns where the colour toggles. A [`Layer`] is an image
//! and what is known of it; a stack is a file, folder or stream of layers,
//! bottom first, in TIFF or PNG. A stage is a function from layers to layers.
//!
//! ```
//! use lamp_stack::{Destination, Format, Layer, Mask, PageInfo, Pages, write_stack};
//! # fn main() -> Result<(), lamp_stack::StackError> {
//! // Two rows: `.##.` and `....`.
//! let mask = Mask::new(4, vec![0, 2, 2], vec![1, 3]).unwrap();
//! let layer = Layer { info: PageInfo::default(), dpi: None, image: mask.into() };
//!
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("one.tif");
//! let layers = std::iter::once(Ok::<_, lamp_stack::StackError>(layer.clone()));
//! write_stack(layers, Destination::File(path.clone()), Format::Big)?;
//!
//! let read: Vec<Layer> = Pages::open(&path)?.layers().collect::<Result<_, _>>()?;
//! assert_eq!(read, [layer]);
//! # Ok(())
//! # }
//! ```

mod bits;
mod boxes;
mod catalogue;
mod check;
mod combine;
mod compression;
mod counting_sort;
mod coverage;
mod deflate;
mod depth_levels;
mod difference;
mod digest;
mod durable;
mod error;
mod fading_levels;
mod file_format;
mod find;
mod folder_list;
mod frame;
pub mod g4;
mod gray;
mod image;
mod indexed;
mod input;
mod join;
mod layer;
mod leftovers;
mod length;
mod limits;
mod mask;
mod named;
mod note;
mod ordered;
mod orientation;
mod output;
mod packbits;
mod packed;
mod page_folder;
mod page_info;
mod page_names;
mod pairing;
mod passing;
mod picture_fault;
mod picture_format;
mod picture_page;
mod plain_text;
mod png_page;
mod png_write;
mod record;
mod runs;
pub mod sets;
mod shell;
mod split;
mod strut;
mod temporary;
#[cfg(test)]
mod testing;
mod text;
mod threshold;
mod tiff;
mod totals;
mod verify;

pub use boxes::{WhiteBox, largest_boxes};
pub use catalogue::{Builtin, CatalogueError, Catalogued, nonempty_text};
pub use check::CheckFault;
pub use combine::{Combine, Op, combine_rows};
pub use compression::Compression;
pub use counting_sort::{Grouped, KeyCounts, UnfinishedGroups};
pub use coverage::mean_levels;
pub use depth_levels::{DepthLevels, LevelSteps};
pub use difference::{Difference, Overlaid};
pub use digest::{digest_of, digest_of_digests, digest_of_range, open_ending, sealed, unsealed};
pub use durable::{close, skip_sync, sync};
pub use error::{PageFault, StackError, UnsupportedFeature};
pub use fading_levels::FadingLevels;
pub use file_format::{FORMAT_BYTES, FileFormat, PartFormat};
pub use find::{STACK_ENDINGS, is_stack_name, stacks_in};
pub use folder_list::FOLDER_LIST;
pub use frame::{Frame, place_row};
pub use gray::{GrayMask, LevelChange, gray_runs};
pub use image::Image;
pub use indexed::IndexedStack;
pub use input::Pages;
pub use join::{JoinError, join};
pub use layer::{Layer, LayerImage};
pub use leftovers::remove_leftovers;
pub use length::{Dpi, Length, LengthError, Size};
pub use limits::{Limits, MAX_RUNS, MAX_SIDE};
pub use mask::{Mask, MaskBuilder, white_in_both, white_in_row, white_runs};
pub use named::{Named, UnknownName};
pub use note::{ImagesBeside, PageGap, StackNote};
pub use ordered::{MemorySize, map_in_order, take_batch};
pub use orientation::{Orientation, OrientationError};
pub use output::{Destination, write_stack};
pub use packed::{KEY_LAYERS, PackLevel, copy_packed, join_packed, write_packed};
pub use page_info::{PageInfo, StackInfo};
pub use pairing::{Pairing, PairingError, Section, shift_between};
pub use passing::PassingLayer;
pub use picture_format::PictureFormat;
pub use plain_text::PlainText;
pub use png_write::{
    png_of_layer, write_gray_animation, write_gray_png, write_png_folder, write_rgb_png,
};
pub use record::{
    BuildRecord, BuiltPart, BuiltParts, CompensateRecord, DitherRecord, FixRecord, FixedBand,
    PageRecord, SliceRecord, StripRecord,
};
pub use runs::{Change, Pixel, RunError, RunImage};
pub use shell::{file_word, quoted, words};
pub use split::{SplitError, SplitPoints, write_split};
pub use strut::Strut;
pub use temporary::{FileBeside, FolderBeside, PrivateFile, remove_temporaries};
pub use text::{line_of, one_line};
pub use tiff::{EncodedPage, Format, Page, PageHeader, PageReader, PageWriter};
pub use totals::{NumberRange, StackTotals};
pub use verify::{LayerFault, VerifyError, verify};
