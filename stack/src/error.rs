//! Defines the errors of reading and writing stacks.

use std::io;

use thiserror::Error;

use crate::codec::g4::G4Error;
use crate::codec::picture_format::PictureFormat;
use crate::files::contours::ContourError;
use crate::files::file_format::FileFormat;
use crate::files::folder_list::FOLDER_LIST;
use crate::layer::check::CheckFault;
use crate::note::ImagesBeside;
use crate::printer::fault::PrinterFault;

/// The words before the reason of a stage that gave up.
pub(crate) const GAVE_UP: &str = "the stage before gave up: ";

/// An error in reading or writing a stack.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StackError {
    /// The input is empty.
    #[error("the input is empty: no stack arrived")]
    Empty,
    /// The input starts as neither a TIFF nor a picture that is read.
    #[error(
        "this is neither a TIFF stack nor a picture{}",
        match format {
            Some(format) => format!(", but {format}"),
            None => format!(" (it starts with \"{}\")", start.escape_ascii()),
        }
    )]
    NotTiff {
        /// Its format, if that is known.
        format: Option<FileFormat>,
        /// The first bytes of the input.
        start: Vec<u8>,
    },
    /// The stack was written to, cut short or replaced after it was opened.
    #[error("the stack has changed since it was opened; open it again")]
    Changed,
    /// The input ends within a page.
    #[error("the stack is cut off: {}; run the stage that wrote it again", last_whole_text(*.last_whole))]
    CutOff {
        /// The last complete layer.
        last_whole: Option<u32>,
    },
    /// A page's directory or data is inconsistent or exceeds a limit.
    #[error("page {page}: {fault}")]
    Malformed {
        /// The page, from 0.
        page: u32,
        /// The fault.
        fault: PageFault,
    },
    /// A page is valid but uses an unsupported feature.
    #[error(
        "page {page}: {feature} is not read here; save it as a 1-bit or an 8-bit gray TIFF first, with any lossless compression"
    )]
    Unsupported {
        /// The page, from 0.
        page: u32,
        /// The feature.
        feature: UnsupportedFeature,
    },
    /// The pixels of a page are not square.
    #[error(
        "page {page}: its pixels are not square (its resolution is {across} across and {down} down), and their size is not read from it: resample the image to square pixels, or store it as a TIFF or PNG whose resolution has a unit"
    )]
    RectangularPixels {
        /// The page, from 0.
        page: u32,
        /// The resolution along rows, in the file's unit.
        across: f64,
        /// The resolution along columns, in the same unit.
        down: f64,
    },
    /// No image of a TIFF is a layer.
    #[error("it holds no layer, only {0}")]
    NoLayerImage(ImagesBeside),
    /// Two files of a folder have one page number.
    #[error(
        "{} and {} have the same page number: keep one of them in the folder", files[0], files[1]
    )]
    SamePage {
        /// The files' names.
        files: [String; 2],
    },
    /// The parts of a TIFF are in an order that cannot be read from a stream.
    #[error(
        "page {page}: its data is out of order, so it cannot be read from a pipe; give the file's name instead"
    )]
    NotForward {
        /// The page, from 0.
        page: u32,
    },
    /// A strip does not decode.
    #[error("layer {layer}")]
    Strip {
        /// The layer's index.
        layer: u32,
        /// The fault in its codes.
        source: G4Error,
    },
    /// A page is not as it was written.
    #[error("layer {layer}: {fault}")]
    Check {
        /// The layer's index.
        layer: u32,
        /// The difference.
        fault: CheckFault,
    },
    /// The stack ends, but its last page was not the last when it was written.
    #[error("the stack ends with layer {last}, but was written with more layers")]
    EndedEarly {
        /// The last layer.
        last: u32,
    },
    /// The stack has fewer pages than its first page states.
    #[error("the stack has {found} layers, but its first page states {stated}: pages are missing")]
    MissingPages {
        /// The number of pages.
        found: u32,
        /// The number that the first page states.
        stated: u32,
    },
    /// The stage that wrote the stream gave up and said why.
    #[error("{GAVE_UP}{reason}")]
    GivenUp {
        /// The sentence of that stage.
        reason: String,
    },
    /// A file of a folder, or a page of a stack that was named, cannot be read.
    #[error("{file}")]
    InFile {
        /// The file's name.
        file: String,
        /// The cause.
        source: Box<StackError>,
    },
    /// The layer indices do not increase.
    #[error("layer {layer} comes after layer {before}: a stack's layers must go up")]
    Order {
        /// The layer that is out of order.
        layer: u32,
        /// The layer before it in the file.
        before: u32,
    },
    /// A folder has no pages.
    #[error("the folder holds no page: no .tif, no .png and no other picture")]
    NoPages,
    /// A folder has pages of two formats.
    #[error(
        "the folder holds {} and {} pages: keep the pages of the stack, and move the others away", formats[0], formats[1]
    )]
    MixedPages {
        /// The formats' names.
        formats: [&'static str; 2],
    },
    /// A page is missing from a folder.
    #[error("the folder lacks a page: layer {layer} does not follow the layer before it")]
    MissingPage {
        /// The layer after the gap.
        layer: u32,
    },
    /// A file of a folder has several pages.
    #[error("it has several pages: the files of a folder have one page each")]
    SeveralPages,
    /// The files of a folder are strips or fields of a build.
    #[error(
        "the folder holds strips or fields of a build, not its layers: make one stack of them with \
         lamp join"
    )]
    PartsOfLayers,
    /// The stack does not fit a classic TIFF.
    #[error(
        "the stack passes 4 GiB at layer {layer}: a classic TIFF cannot hold it, write a BigTIFF"
    )]
    PastClassic {
        /// The layer that does not fit.
        layer: u32,
    },
    /// A contour file cannot be written.
    #[error(transparent)]
    Contours(#[from] ContourError),
    /// A printer's file cannot be read or written.
    #[error(transparent)]
    Printer(#[from] PrinterFault),
    /// A packed stack was to be written to a folder.
    #[error("a packed stack is one file, not a folder")]
    PackedFolder,
    /// There is no layer to write.
    #[error("there is no layer to write")]
    NoLayers,
    /// A page is a pipe or a device.
    #[error("{name} is a pipe or a device, not a page")]
    NoFile {
        /// Its name.
        name: String,
    },
    /// The output folder is not empty.
    #[error("it already exists and is not overwritten")]
    Exists,
    /// The folder to be replaced has no list of what this workspace wrote into it.
    #[error(
        "only files from an earlier run are replaced, and this folder has no {FOLDER_LIST} file"
    )]
    NotOurs,
    /// The folder to be replaced holds something that its list does not name.
    #[error("only files from an earlier run are replaced, and this folder holds {name}")]
    NotReplaceable {
        /// The name of such a file or folder.
        name: String,
    },
    /// Reading or writing failed.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// A fault in a page.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PageFault {
    /// A TIFF field is missing.
    #[error("it lacks tag {0}")]
    NoTag(u16),
    /// A TIFF field has no value.
    #[error("its tag {0} is empty")]
    EmptyTag(u16),
    /// A TIFF field has a type that its tag does not allow.
    #[error("its tag {tag} has type {kind}")]
    TagType {
        /// The field's tag.
        tag: u16,
        /// The number of its type.
        kind: u16,
    },
    /// A TIFF field exceeds the reader's limit.
    #[error("its tag {tag} claims {bytes} bytes")]
    TagBytes {
        /// The field's tag.
        tag: u16,
        /// Its size.
        bytes: u64,
    },
    /// A TIFF directory has more entries than the reader's limit.
    #[error("its directory claims {0} entries")]
    Entries(u64),
    /// The links of a TIFF's directories form a loop.
    #[error("its directory was read before: the links form a loop")]
    Loop,
    /// A width or height, in pixels, is zero or exceeds the reader's limit.
    #[error("it claims a side of {0} pixels")]
    Side(u64),
    /// The orientation is not one of TIFF's.
    #[error("there is no orientation {0}")]
    Orientation(u64),
    /// The image's width in pixels is too large to exchange rows and columns.
    #[error("it claims {0} columns, too many to turn it upright")]
    TooWideToTurn(u32),
    /// The number of strips or tiles does not match the image's size.
    #[error("it has {found} {pieces}, but its size needs {wanted}")]
    PieceCount {
        /// `strips` or `tiles`.
        pieces: &'static str,
        /// The number that the directory lists.
        found: usize,
        /// The number that the image's size requires.
        wanted: u64,
    },
    /// The strips or tiles have more bytes than any coding of the image needs.
    #[error("its strips claim {0} bytes, more than its pixels can take")]
    PieceBytes(u64),
    /// Strips or tiles without data make up more rows than the reader's limits.
    #[error("it claims {0} rows without data")]
    Unwritten(u64),
    /// Strips or tiles share bytes.
    #[error("its strips overlap")]
    Overlap,
    /// A `strip` or `tile` ends before its last row.
    #[error("a {0} ends before its rows do")]
    TooShort(&'static str),
    /// A `strip` or `tile` does not decompress.
    #[error("a {0} does not decode: it is damaged")]
    Damaged(&'static str),
    /// The image has more runs than the reader's limits.
    #[error("it has more runs than an image may have")]
    TooManyRuns,
    /// A part of a packed stack is damaged, or passes a reader's limit.
    #[error("its packed {0} is damaged")]
    Packed(&'static str),
    /// The run lengths of a printer's file are damaged.
    #[error("its run lengths are damaged: {0}")]
    RunLengths(&'static str),
    /// An image has more rows than a packed stack takes.
    #[error("its image has {0} rows, too many to pack: write a TIFF")]
    TooTallToPack(u32),
    /// A PNG does not decode.
    #[error("its PNG is damaged: {0}")]
    Png(png::DecodingError),
    /// A PNG has bytes that belong to no chunk.
    #[error("its PNG has bytes between its chunks")]
    PngGap,
    /// A PNG is larger than the reader's limit, in bytes.
    #[error("its PNG has more than {0} bytes")]
    PngBytes(u64),
    /// A picture cannot be decoded.
    #[error("its {format} cannot be read: {problem}")]
    Picture {
        /// The picture's format.
        format: PictureFormat,
        /// The decoder's message.
        problem: String,
    },
    /// A picture is larger than the reader's limit, in bytes.
    #[error("its picture has more than {0} bytes")]
    PictureFileBytes(u64),
    /// A picture's pixels take more bytes than the reader's limit.
    #[error(
        "its pixels take {0} bytes, too many for a format that is decoded at once: save it as a PNG or a TIFF"
    )]
    PictureBytes(u64),
    /// A PNG's palette lacks an entry that a pixel uses.
    #[error("its palette has no entry {0}")]
    PaletteEntry(u8),
}

/// An unsupported feature of TIFF or PNG.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum UnsupportedFeature {
    /// A TIFF in color.
    #[error("an RGB image")]
    Rgb,
    /// A TIFF with a palette.
    #[error("an image with a palette")]
    Palette,
    /// An unsupported photometric interpretation of TIFF.
    #[error("photometric interpretation {0}")]
    Photometric(u64),
    /// An unsupported number of samples or bits.
    #[error("an image with {samples} x {bits} bits")]
    PixelBits {
        /// Samples per pixel.
        samples: u64,
        /// Bits per sample.
        bits: u64,
    },
    /// Samples that are not unsigned integers.
    #[error("sample format {0}")]
    SampleFormat(u64),
    /// Group 3 data that may use the uncompressed mode.
    #[error("Group 3 with its uncompressed mode")]
    UncompressedMode,
    /// JPEG data.
    #[error("JPEG in a TIFF")]
    Jpeg,
    /// An unsupported compression of TIFF.
    #[error("TIFF compression {0}")]
    Compression(u64),
    /// An unsupported predictor of TIFF.
    #[error("predictor {0}")]
    Predictor(u64),
    /// An interlaced PNG.
    #[error("an interlaced PNG")]
    Interlaced,
    /// A picture with a pixel that is not opaque, or a PNG with a transparent color.
    #[error("a picture with transparency")]
    Transparency,
    /// A picture with 16 bits per sample.
    #[error("a 16-bit picture")]
    SixteenBits,
    /// A picture with a pixel that is not gray.
    #[error("a picture in color")]
    Colour,
    /// A picture file with several images, such as an animation.
    #[error("a picture file with several images")]
    SeveralImages,
}

fn last_whole_text(last_whole: Option<u32>) -> String {
    match last_whole {
        Some(layer) => format!("the last whole layer is {layer}"),
        None => "no layer is whole".to_owned(),
    }
}

/// Returns the error of a page with a fault.
pub(crate) fn malformed(page: u32, fault: PageFault) -> StackError {
    StackError::Malformed { page, fault }
}
