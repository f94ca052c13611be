//! Interprets the values of a page's directory.

use std::collections::BTreeMap;

use super::layout::PageLayout;
use super::page::Page;
use super::tags::{
    BITS_PER_SAMPLE, BLACK_IS_ZERO, BYTE, COMPRESSION, DEFLATE, DOUBLE, FILL_ORDER, FLOAT, IFD,
    IFD8, IMAGE_DESCRIPTION, IMAGE_LENGTH, IMAGE_WIDTH, LONG, LONG8, LZW, MODIFIED_HUFFMAN,
    OLD_DEFLATE, ORIENTATION, PACK_BITS, PER_CENTIMETRE, PER_INCH, PHOTOMETRIC,
    PLANAR_CONFIGURATION, PREDICTOR, RATIONAL, RESOLUTION_UNIT, ROWS_PER_STRIP, SAMPLE_FORMAT,
    SAMPLES_PER_PIXEL, SBYTE, SHORT, SLONG, SLONG8, SRATIONAL, SSHORT, STRIP_BYTE_COUNTS,
    STRIP_OFFSETS, T4, T4_OPTIONS, T6, T6_OPTIONS, TILE_BYTE_COUNTS, TILE_LENGTH, TILE_OFFSETS,
    TILE_WIDTH, TWO_DIMENSIONAL, UNCOMPRESSED, UNCOMPRESSED_MODE, WHITE_IS_ZERO, X_RESOLUTION,
    Y_RESOLUTION, type_size,
};
use crate::codec::compression::Compression;
use crate::error::{PageFault, StackError, UnsupportedFeature, malformed};
use crate::image::orientation::Orientation;
use crate::layer::check::{CheckFault, PageLine};
use crate::length::has_square_pixels;
use crate::limits::Limits;
use crate::pitch::Pitch;

/// The tags whose values are read.
pub(super) const KNOWN: [u16; 24] = [
    IMAGE_WIDTH,
    IMAGE_LENGTH,
    BITS_PER_SAMPLE,
    COMPRESSION,
    PHOTOMETRIC,
    FILL_ORDER,
    IMAGE_DESCRIPTION,
    STRIP_OFFSETS,
    ORIENTATION,
    SAMPLES_PER_PIXEL,
    ROWS_PER_STRIP,
    STRIP_BYTE_COUNTS,
    X_RESOLUTION,
    Y_RESOLUTION,
    PLANAR_CONFIGURATION,
    RESOLUTION_UNIT,
    T4_OPTIONS,
    T6_OPTIONS,
    PREDICTOR,
    TILE_WIDTH,
    TILE_LENGTH,
    TILE_OFFSETS,
    TILE_BYTE_COUNTS,
    SAMPLE_FORMAT,
];

/// The values of a page's directory.
pub(super) struct Fields {
    pub(super) page: u32,
    pub(super) little_endian: bool,
    pub(super) limits: Limits,
    /// The type and bytes of each field, by tag.
    pub(super) values: BTreeMap<u16, (u16, Vec<u8>)>,
}

impl Fields {
    pub(super) fn numbers(&self, tag: u16) -> Result<Vec<u64>, StackError> {
        let (kind, bytes) =
            self.values.get(&tag).ok_or_else(|| malformed(self.page, PageFault::NoTag(tag)))?;
        match *kind {
            // Some writers use other types than the tag's; libtiff takes them, too. A negative
            // number reads as one that is too large.
            BYTE | SHORT | LONG | LONG8 | SBYTE | SSHORT | SLONG | SLONG8 | IFD | IFD8 => Ok(bytes
                .chunks_exact(type_size(*kind) as usize)
                .map(|value| number(value, self.little_endian))
                .collect()),
            kind => Err(malformed(self.page, PageFault::TagType { tag, kind })),
        }
    }

    fn number(&self, tag: u16) -> Result<u64, StackError> {
        let first = self.numbers(tag)?.first().copied();
        first.ok_or_else(|| malformed(self.page, PageFault::EmptyTag(tag)))
    }

    pub(super) fn number_or(&self, tag: u16, default: u64) -> Result<u64, StackError> {
        if self.values.contains_key(&tag) { self.number(tag) } else { Ok(default) }
    }

    fn side(&self, tag: u16) -> Result<u32, StackError> {
        match self.number(tag)? {
            side if (1..=self.limits.side.into()).contains(&side) => Ok(side as u32),
            side => Err(malformed(self.page, PageFault::Side(side))),
        }
    }

    /// Returns the pitch of the pixels as they are stored, if it is stated with a unit.
    ///
    /// Refuses pixels whose width differs from their height where their size is not known: the
    /// numbers alone still give the ratio of width to height.
    fn pitch(&self, is_ours: bool) -> Result<Option<Pitch>, StackError> {
        let Some(across) = self.resolution(X_RESOLUTION) else { return Ok(None) };
        let down = self.resolution(Y_RESOLUTION).unwrap_or(across);
        let numbers = [across, down].map(|[num, den]| num / den);
        let is_square = has_square_pixels(numbers, 0.0);
        // Other programs round.
        let down = if is_square && !is_ours { across } else { down };
        // Inches are the default (TIFF 6.0, section 8, ResolutionUnit).
        let scale = match self.number_or(RESOLUTION_UNIT, PER_INCH) {
            Ok(PER_INCH) => Some([1.0, 1.0]),
            Ok(PER_CENTIMETRE) => Some([254.0, 100.0]),
            _ => None,
        };
        let pitch = scale.and_then(|[by, of]| {
            // Products of whole numbers are exact, so the pitch is exact, too.
            Pitch::of_two_dpi([across, down].map(|[num, den]| num * by / (den * of)))
        });
        match numbers {
            [across, down] if pitch.is_none() && !is_square => {
                Err(StackError::RectangularPixels { page: self.page, across, down })
            }
            _ => Ok(pitch),
        }
    }

    /// Returns a resolution as a fraction, in any of the types that libtiff reads.
    fn resolution(&self, tag: u16) -> Option<[f64; 2]> {
        let (kind, bytes) = self.values.get(&tag)?;
        let size = type_size(*kind) as usize;
        let long = |bytes: &[u8]| number(bytes, self.little_endian) as u32;
        let first = bytes.get(..size).filter(|_| size > 0)?;
        Some(match *kind {
            // 0/0 makes NaN, which is no resolution.
            RATIONAL => [&first[..4], &first[4..]].map(|part| long(part).into()),
            SRATIONAL => [&first[..4], &first[4..]].map(|part| (long(part) as i32).into()),
            FLOAT => [f32::from_bits(long(first)).into(), 1.0],
            DOUBLE => [f64::from_bits(number(first, self.little_endian)), 1.0],
            _ => [self.number(tag).ok()? as f64, 1.0],
        })
    }

    /// Returns the text of the page's description, if it has one.
    pub(super) fn description(&self) -> Option<&[u8]> {
        let (_, text) = self.values.get(&IMAGE_DESCRIPTION)?;
        // A field of ASCII may hold several texts, each ended by NUL (TIFF 6.0, section 2).
        text.split(|&byte| byte == 0).next()
    }

    fn line(&self) -> PageLine {
        self.description().and_then(PageLine::parse).unwrap_or_else(|| PageLine::without(self.page))
    }

    /// Returns the page without the data of its strips or tiles.
    pub(super) fn page(&self) -> Result<Page, StackError> {
        let gray = self.is_gray()?;
        let compression = self.compression(gray)?;
        // Programs disagree on images without this tag: libtiff's zero is white, GDAL's black.
        let white_is_zero = match self.number(PHOTOMETRIC)? {
            WHITE_IS_ZERO => true,
            BLACK_IS_ZERO => false,
            2 => return Err(self.unsupported(UnsupportedFeature::Rgb)),
            3 => return Err(self.unsupported(UnsupportedFeature::Palette)),
            other => {
                return Err(self.unsupported(UnsupportedFeature::Photometric(other)));
            }
        };
        let tag = self.number_or(ORIENTATION, 1)?;
        let orientation = Orientation::of_tiff_tag(tag)
            .ok_or_else(|| malformed(self.page, PageFault::Orientation(tag)))?;
        let (width, height) = (self.side(IMAGE_WIDTH)?, self.side(IMAGE_LENGTH)?);
        if orientation.is_across() && width > self.limits.rows_from_columns {
            return Err(malformed(self.page, PageFault::TooWideToTurn(width)));
        }
        let PageLine { info, check } = self.line();
        // Other programs use these fields, and would see another image than the checked one.
        if check.is_some() && !self.is_as_we_write() {
            let (layer, fault) = (info.index, CheckFault::Directory);
            return Err(StackError::Check { layer, fault });
        }
        let pitch = self.pitch(check.is_some())?;
        Ok(Page {
            number: self.page,
            limits: self.limits,
            info,
            check,
            pitch: pitch.map(|pitch| if orientation.is_across() { pitch.turned() } else { pitch }),
            width,
            gray,
            white_is_zero,
            orientation,
            compression,
            differences: self.has_differences(compression)?,
            layout: self.layout(width, height)?,
            pieces: Vec::new(),
            data_bytes: 0,
            image: None,
        })
    }

    /// Returns whether fields that other programs need, but we do not, are as we write them.
    fn is_as_we_write(&self) -> bool {
        // The page's check has the values of both.
        let is_stated = |tag| self.values.contains_key(&tag);
        is_stated(X_RESOLUTION) == is_stated(Y_RESOLUTION)
            && matches!(self.number_or(PLANAR_CONFIGURATION, 1), Ok(1))
            && matches!(self.number_or(T6_OPTIONS, 0), Ok(0))
    }

    fn is_gray(&self) -> Result<bool, StackError> {
        let samples = self.number_or(SAMPLES_PER_PIXEL, 1)?;
        let gray = match self.number_or(BITS_PER_SAMPLE, 1)? {
            1 if samples == 1 => false,
            8 if samples == 1 => true,
            bits => return Err(self.unsupported(UnsupportedFeature::PixelBits { samples, bits })),
        };
        match self.number_or(SAMPLE_FORMAT, 1)? {
            // Unsigned or undefined (TIFF 6.0, section 19, SampleFormat).
            1 | 4 => Ok(gray),
            other => Err(self.unsupported(UnsupportedFeature::SampleFormat(other))),
        }
    }

    fn compression(&self, gray: bool) -> Result<Compression, StackError> {
        Ok(match self.number_or(COMPRESSION, UNCOMPRESSED)? {
            UNCOMPRESSED => Compression::Uncompressed,
            MODIFIED_HUFFMAN if !gray => Compression::ModifiedHuffman,
            T4 if !gray => match self.number_or(T4_OPTIONS, 0)? {
                options if options & UNCOMPRESSED_MODE != 0 => {
                    return Err(self.unsupported(UnsupportedFeature::UncompressedMode));
                }
                options if options & TWO_DIMENSIONAL != 0 => Compression::Group3TwoDimensional,
                _ => Compression::Group3,
            },
            T6 if !gray => Compression::G4,
            LZW => Compression::Lzw,
            DEFLATE | OLD_DEFLATE => Compression::Deflate,
            PACK_BITS => Compression::PackBits,
            6 | 7 => return Err(self.unsupported(UnsupportedFeature::Jpeg)),
            other => return Err(self.unsupported(UnsupportedFeature::Compression(other))),
        })
    }

    /// Returns whether pixels are stored as differences from the pixel before. The tag applies
    /// only to LZW and Deflate.
    fn has_differences(&self, compression: Compression) -> Result<bool, StackError> {
        match self.number_or(PREDICTOR, 1)? {
            1 => Ok(false),
            _ if !matches!(compression, Compression::Lzw | Compression::Deflate) => Ok(false),
            2 => Ok(true),
            predictor => Err(self.unsupported(UnsupportedFeature::Predictor(predictor))),
        }
    }

    fn layout(&self, width: u32, height: u32) -> Result<PageLayout, StackError> {
        if self.values.contains_key(&TILE_WIDTH) {
            let tile = (self.side(TILE_WIDTH)?, self.side(TILE_LENGTH)?);
            return Ok(PageLayout::tiles(width, height, tile));
        }
        // Zero rows stand for all of them, as 2^32 - 1 does.
        let rows = match self.number_or(ROWS_PER_STRIP, 0)? {
            0 => height,
            rows => rows.min(height.into()) as u32,
        };
        Ok(PageLayout::strips(width, height, rows))
    }

    /// Returns the offset and length in bytes of each strip or tile. The length is 0 where the
    /// directory does not state it.
    pub(super) fn places(&self, layout: &PageLayout) -> Result<Vec<(u64, u64)>, StackError> {
        // Some writers list tiles under the tags of strips, which libtiff reads as one.
        let tags = match layout.tiled && self.values.contains_key(&TILE_OFFSETS) {
            true => (TILE_OFFSETS, TILE_BYTE_COUNTS),
            false => (STRIP_OFFSETS, STRIP_BYTE_COUNTS),
        };
        let offsets = self.numbers(tags.0)?;
        let counts = match self.values.contains_key(&tags.1) {
            true => self.numbers(tags.1)?,
            false => vec![0; offsets.len()],
        };
        let wanted = layout.count();
        if offsets.len() as u64 != wanted || counts.len() as u64 != wanted {
            let pieces = if layout.tiled { "tiles" } else { "strips" };
            let found = offsets.len();
            return Err(malformed(self.page, PageFault::PieceCount { pieces, found, wanted }));
        }
        Ok(offsets.into_iter().zip(counts).collect())
    }

    fn unsupported(&self, feature: UnsupportedFeature) -> StackError {
        StackError::Unsupported { page: self.page, feature }
    }
}

/// Returns an unsigned number of up to 8 bytes.
pub(super) fn number(bytes: &[u8], little_endian: bool) -> u64 {
    let step = |number: u64, &byte: &u8| number << 8 | u64::from(byte);
    if little_endian { bytes.iter().rev().fold(0, step) } else { bytes.iter().fold(0, step) }
}
