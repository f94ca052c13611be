//! The vocabulary that every stage of LAMP shares.
//!
//! A layer image is never pixels here but runs: each row of a [`Mask`] is the
//! sorted list of columns where the color toggles. A [`Layer`] is an image
//! and what is known of it; a stack is a file, folder or stream of layers,
//! bottom first, in TIFF or PNG. A stage is a function from layers to layers.
//!
//! ```
//! use lamp_stack::{Destination, Format, Layer, Mask, PageInfo, Pages, write_stack};
//! # fn main() -> Result<(), lamp_stack::StackError> {
//! // Two rows: `.##.` and `....`.
//! let mask = Mask::new(4, vec![0, 2, 2], vec![1, 3]).unwrap();
//! let layer = Layer { info: PageInfo::default(), pitch: None, image: mask.into() };
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

mod catalogue;
mod codec;
mod cone;
mod counting_sort;
mod depth_levels;
mod digest;
mod error;
mod fading_levels;
mod files;
mod image;
mod layer;
mod length;
mod limits;
mod named;
mod note;
mod ordered;
mod pitch;
mod plain_text;
mod printer;
mod record;
mod shell;
mod significant;
mod strut;
#[cfg(test)]
mod testing;
mod text;
mod toml_document;

pub use catalogue::{Builtin, CatalogueError, Catalogued, nonempty_text};
pub use codec::compression::Compression;
pub use codec::g4;
pub use codec::packed::{KEY_LAYERS, PackLevel, copy_packed, join_packed, write_packed};
pub use codec::picture_format::PictureFormat;
pub use codec::png_write::{
    png_of_layer, write_gray_animation, write_gray_png, write_png_folder, write_rgb_png,
};
pub use codec::tiff::{EncodedPage, Format, Page, PageHeader, PageReader, PageWriter};
pub use cone::Cone;
pub use counting_sort::{Grouped, KeyCounts, UnfinishedGroups};
pub use depth_levels::{DepthLevels, LevelSteps};
pub use digest::{digest_of, digest_of_digests, digest_of_range, open_ending, sealed, unsealed};
pub use error::{PageFault, StackError, UnsupportedFeature};
pub use fading_levels::FadingLevels;
pub use files::contours::{ContourError, ContourFormat, write_contours};
pub use files::durable::{close, skip_sync, sync};
pub use files::file_format::{FORMAT_BYTES, FileFormat, PartFormat};
pub use files::find::{is_stack_name, stacks_in};
pub use files::folder_list::FOLDER_LIST;
pub use files::indexed::{FileStamp, IndexedStack};
pub use files::input::Pages;
pub use files::join::{JoinError, join};
pub use files::leftovers::remove_leftovers;
pub use files::output::{Destination, write_stack};
pub use files::split::{SplitError, SplitPoints, write_split};
pub use files::stack_format::{STACK_ENDINGS, StackFormat};
pub use files::temporary::{FileBeside, FolderBeside, PrivateFile, remove_temporaries};
pub use files::verify::{LayerFault, VerifyError, verify};
pub use image::Image;
pub use image::boxes::{WhiteBox, largest_boxes};
pub use image::combine::{Combine, Op, combine_rows};
pub use image::coverage::{mean_levels, mean_levels_of_bands};
pub use image::difference::{Difference, Overlaid};
pub use image::frame::{Frame, place_row};
pub use image::gray::{GrayMask, LevelChange, gray_runs};
pub use image::mask::{Mask, MaskBuilder, white_in_both, white_in_row, white_runs};
pub use image::orientation::{Orientation, OrientationError};
pub use image::outline::Outline;
pub use image::runs::{Change, Pixel, RunError, RunImage};
pub use image::sets;
pub use layer::check::CheckFault;
pub use layer::page_info::{PageInfo, StackInfo};
pub use layer::pairing::{Pairing, PairingError, Section, shift_between};
pub use layer::passing::PassingLayer;
pub use layer::totals::{NumberRange, StackTotals};
pub use layer::{Layer, LayerImage};
pub use length::{Dpi, Length, LengthError, Size};
pub use limits::{Limits, MAX_RUNS, MAX_SIDE};
pub use named::{Named, UnknownName};
pub use note::{ImagesBeside, PageGap, StackNote};
pub use ordered::{MemorySize, map_in_order, take_batch};
pub use pitch::{NotSquare, Pitch};
pub use plain_text::PlainText;
pub use printer::fault::PrinterFault;
pub use printer::write::{PrinterFormat, write_printer_file};
pub use record::{
    BuildRecord, BuiltPart, BuiltParts, CellsRecord, CompensateRecord, DitherRecord, FieldRecord,
    FixRecord, FixedBand, PageRecord, PrintRecord, PrintStep, SliceRecord, StripRecord,
};
pub use shell::{file_word, quoted, words};
pub use significant::{format_significant, round_significant, to_nm};
pub use strut::{FlowSection, Strut, StrutSection};
pub use text::{line_of, one_line};
pub use toml_document::{TomlError, TomlStep, read_toml};

/// The font of plots and labels: Roboto Regular, with the letters that they need.
pub static FONT: &[u8] = include_bytes!("../fonts/roboto-subset.ttf");
