//! What can be wrong with a stack.

use std::io;

use thiserror::Error;

use crate::g4::G4Error;

/// Why a stack cannot be read or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StackError {
    /// Nothing arrived at all.
    #[error("the input is empty: no stack arrived")]
    Empty,
    /// The first bytes are those of no TIFF and no PNG.
    #[error("this is not a TIFF stack or a PNG (it starts with bytes {start:02x?})")]
    NotTiff {
        /// The first bytes of the input.
        start: Vec<u8>,
    },
    /// The input ends before its last page's end.
    #[error("the stack is cut off: {}; run the stage that wrote it again", last_whole_text(*.last_whole))]
    CutOff {
        /// The last layer that arrived whole.
        last_whole: Option<u32>,
    },
    /// A page's directory or data contradicts itself, or passes a limit.
    #[error("page {page}: {fault}")]
    Malformed {
        /// The page, from 0.
        page: u32,
        /// What is wrong.
        fault: PageFault,
    },
    /// A page is valid but not of a kind that is read here.
    #[error(
        "page {page}: {feature} is not read here; save it as a 1-bit or an 8-bit gray TIFF first, with any lossless compression"
    )]
    Unsupported {
        /// The page, from 0.
        page: u32,
        /// The feature in question.
        feature: UnsupportedFeature,
    },
    /// A TIFF whose parts stand in an order that a stream cannot follow.
    #[error(
        "page {page}: its parts do not follow each other, so it cannot be read from a pipe; give the file's name instead"
    )]
    NotForward {
        /// The page, from 0.
        page: u32,
    },
    /// A strip that does not decode.
    #[error("layer {layer}")]
    Strip {
        /// The layer's index.
        layer: u32,
        /// What is wrong with its codes.
        source: G4Error,
    },
    /// A file of a folder that cannot be read.
    #[error("{file}")]
    InFile {
        /// The file's name.
        file: String,
        /// What is wrong with it.
        source: Box<StackError>,
    },
    /// Layers that do not go up.
    #[error("layer {layer} stands behind layer {before}: a stack's layers go up")]
    Order {
        /// The layer that is out of order.
        layer: u32,
        /// The one before it.
        before: u32,
    },
    /// A folder without pages.
    #[error("the folder holds no .tif or .png page")]
    NoPages,
    /// A folder of pages of both kinds.
    #[error(
        "the folder holds .tif and .png pages: keep those that are the stack, and move the others away"
    )]
    MixedPages,
    /// A page is missing from a folder.
    #[error("the folder lacks a page: layer {layer} does not follow what was before it")]
    MissingPage {
        /// The layer behind the gap.
        layer: u32,
    },
    /// A file of a folder that is a stack of its own.
    #[error("it has several pages: the files of a folder have one page each")]
    SeveralPages,
    /// The stack does not fit a classic TIFF.
    #[error(
        "the stack passes 4 GiB at layer {layer}: a classic TIFF cannot hold it, write a BigTIFF"
    )]
    PastClassic {
        /// The layer that does not fit.
        layer: u32,
    },
    /// A stack must have at least one layer.
    #[error("there is no layer to write")]
    NoLayers,
    /// A folder of pages is to be written where something stands already.
    #[error(
        "a folder of pages is not written over what is there: remove it or choose another name"
    )]
    Exists,
    /// Reading or writing failed.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// What is wrong with a page.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PageFault {
    /// A TIFF field is missing.
    #[error("it lacks tag {0}")]
    NoTag(u16),
    /// A TIFF field has no value.
    #[error("its tag {0} is empty")]
    EmptyTag(u16),
    /// A TIFF field is not of a type that its tag may have.
    #[error("its tag {tag} has type {kind}")]
    TagType {
        /// The field's tag.
        tag: u16,
        /// The number of its type.
        kind: u16,
    },
    /// A TIFF field is larger than the reader's limits.
    #[error("its tag {tag} claims {bytes} bytes")]
    TagBytes {
        /// The field's tag.
        tag: u16,
        /// Its size.
        bytes: u64,
    },
    /// A TIFF directory has more entries than the reader's limits.
    #[error("its directory claims {0} entries")]
    Entries(u64),
    /// The links of a TIFF lead back to a page.
    #[error("its directory was met before: the links form a loop")]
    Loop,
    /// A width or height is zero or past the reader's limits, in pixels.
    #[error("it claims a side of {0} pixels")]
    Side(u64),
    /// TIFF knows no such orientation.
    #[error("there is no orientation {0}")]
    Orientation(u64),
    /// An image is too wide to exchange its rows and columns, in pixels.
    #[error("it claims {0} columns, too many to turn it upright")]
    TooWideToTurn(u32),
    /// There are not as many strips or tiles as the image's size makes.
    #[error("it has {found} {pieces} where its size makes {wanted}")]
    PieceCount {
        /// `strips` or `tiles`.
        pieces: &'static str,
        /// How many the directory lists.
        found: usize,
        /// How many there should be.
        wanted: u64,
    },
    /// The strips or tiles are larger than any coding makes them, in bytes.
    #[error("its strips claim {0} bytes, more than its pixels can take")]
    PieceBytes(u64),
    /// Strips or tiles share bytes.
    #[error("its strips overlap")]
    Overlap,
    /// A `strip` or `tile` ends before its last row.
    #[error("a {0} is shorter than its rows")]
    TooShort(&'static str),
    /// A `strip` or `tile` is not what its compression makes.
    #[error("a {0} does not decode: it is damaged")]
    Damaged(&'static str),
    /// The image has more runs than the reader's limits.
    #[error("it has more runs than an image may have")]
    TooManyRuns,
    /// A PNG does not decode.
    #[error("its PNG is damaged: {0}")]
    Png(png::DecodingError),
    /// A PNG has bytes that belong to no chunk.
    #[error("its PNG has bytes between its chunks")]
    PngGap,
    /// A PNG is larger than the reader's limits, in bytes.
    #[error("its PNG has more than {0} bytes")]
    PngBytes(u64),
    /// A PNG's palette lacks an entry that a pixel names.
    #[error("its palette has no entry {0}")]
    PaletteEntry(u8),
}

/// A feature of TIFF or PNG that is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum UnsupportedFeature {
    /// A TIFF in colour.
    #[error("an RGB image")]
    Rgb,
    /// A TIFF with a palette.
    #[error("an image with a palette")]
    Palette,
    /// Another photometric interpretation of TIFF.
    #[error("photometric interpretation {0}")]
    Photometric(u64),
    /// Pixels of another size.
    #[error("an image of {samples} x {bits} bits")]
    PixelBits {
        /// Samples a pixel.
        samples: u64,
        /// Bits a sample.
        bits: u64,
    },
    /// Samples that are no unsigned numbers.
    #[error("sample format {0}")]
    SampleFormat(u64),
    /// Group 3 data that may hold pixels without a code.
    #[error("Group 3 with its uncompressed mode")]
    UncompressedMode,
    /// JPEG data.
    #[error("JPEG in a TIFF")]
    Jpeg,
    /// Another compression of TIFF.
    #[error("TIFF compression {0}")]
    Compression(u64),
    /// A predictor that these pixels are not read with.
    #[error("predictor {predictor} of {bits}-bit pixels")]
    Predictor {
        /// Its number in TIFF.
        predictor: u64,
        /// Bits a pixel.
        bits: u8,
    },
    /// An interlaced PNG.
    #[error("an interlaced PNG")]
    Interlaced,
    /// A PNG with an alpha channel or a transparent colour.
    #[error("a PNG with transparency")]
    Transparency,
    /// A PNG with 16 bits a sample.
    #[error("a PNG of 16 bits")]
    SixteenBits,
    /// A PNG in colour.
    #[error("a PNG in colour")]
    PngColour,
    /// A PNG with a palette that is not gray.
    #[error("a PNG with a palette of colours")]
    PngPalette,
}

fn last_whole_text(last_whole: Option<u32>) -> String {
    match last_whole {
        Some(layer) => format!("the last whole layer is {layer}"),
        None => "not one layer is whole".to_owned(),
    }
}
