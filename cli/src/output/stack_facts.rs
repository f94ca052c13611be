//! The facts of a stack as `info` and `verify` give them to scripts.

use lamp_stack::{Compression, NumberRange, Pitch, StackInfo, StackTotals};
use serde::Serialize;

use lamp_stack::to_nm;

/// The statements of a stack's pages.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct StackFacts<'a> {
    /// Name of the part or of its file.
    part: Option<&'a str>,
    /// Commands that made the stack, in their order.
    commands: &'a [String],
    /// Digest of the input from which the stack was made.
    digest: Option<&'a str>,
    /// Number of layers.
    layers: u64,
    /// Index of the first layer.
    first_layer: u32,
    /// Index of the last layer.
    last_layer: u32,
    /// Number of layers with gray images.
    gray_layers: u64,
    /// Width of the first image, in pixels.
    width_px: u32,
    /// Height of the first image, in pixels.
    height_px: u32,
    /// Whether all images have one size.
    one_size: bool,
    /// Resolution of the images.
    dpi: Option<Pitch>,
    /// Bottom of the first layer, in millimeters.
    bottom_mm: Option<f64>,
    /// Top of the last layer, in millimeters.
    top_mm: Option<f64>,
    /// Least and greatest thickness of a layer, in micrometers.
    thickness_um: Option<[f64; 2]>,
    /// Least and greatest exposure time of a layer, in milliseconds.
    exposure_ms: Option<[f64; 2]>,
    /// Sum of the exposure times, in seconds.
    exposure_s: Option<f64>,
    /// Pixels that are not black, in all layers.
    exposed_px: Option<u64>,
    /// Volume of the pixels that are not black, in cubic millimeters.
    volume_mm3: Option<f64>,
    /// Number of recorded stray rows.
    stray_rows: u64,
    /// Number of layers with recorded stray rows.
    stray_layers: u64,
    /// Size of the coded images, in bytes.
    data_bytes: u64,
    /// Codings of the images.
    compressions: Vec<&'static str>,
    /// Whether the pages carry checks.
    checks: bool,
}

impl<'a> StackFacts<'a> {
    pub(crate) fn new(totals: &'a StackTotals) -> Self {
        let (first, last) = (&totals.first, &totals.last);
        let stack = first.info.stack.as_ref();
        let text = |text: &'a String| (!text.is_empty()).then_some(text.as_str());
        let ends = |range: NumberRange| [range.least, range.greatest];
        Self {
            part: stack.and_then(|stack| text(&stack.part)),
            commands: stack.map_or(&[], |stack: &StackInfo| &stack.commands),
            digest: stack.and_then(|stack| text(&stack.digest)),
            layers: totals.pages,
            first_layer: first.info.index,
            last_layer: last.index,
            gray_layers: totals.gray_pages,
            width_px: first.size[0],
            height_px: first.size[1],
            one_size: totals.one_size,
            dpi: first.pitch,
            // To the nanometer: the digits beyond are rounding of sums.
            bottom_mm: first.info.z().map(|z| to_nm(z.mm())),
            top_mm: totals.top_mm().map(to_nm),
            thickness_um: totals.thickness_um.map(ends),
            exposure_ms: totals.exposure_ms.map(ends),
            exposure_s: totals.exposure_ms.map(|exposure| to_nm(exposure.sum / 1000.0)),
            exposed_px: totals.exposed_px,
            volume_mm3: totals.volume_mm3.map(to_nm),
            stray_rows: totals.stray_rows,
            stray_layers: totals.stray_layers,
            data_bytes: totals.data_bytes,
            compressions: totals.compressions.iter().map(|each| compression_name(*each)).collect(),
            checks: totals.has_checks(),
        }
    }
}

/// Returns a compression's usual name.
pub(crate) fn compression_name(compression: Compression) -> &'static str {
    match compression {
        Compression::Uncompressed => "uncompressed",
        Compression::ModifiedHuffman => "CCITT modified Huffman",
        Compression::Group3 => "CCITT Group 3",
        Compression::Group3TwoDimensional => "CCITT Group 3, two-dimensional",
        Compression::G4 => "CCITT Group 4",
        Compression::Lzw => "LZW",
        Compression::Deflate => "Deflate",
        Compression::PackBits => "PackBits",
        Compression::Png | Compression::PrinterPng => "PNG",
        Compression::Picture(format) => format.name(),
        Compression::Packed => "packed against the layer below",
        Compression::Goo => "run lengths of GOO",
        Compression::Ctb => "run lengths of CTB",
    }
}
