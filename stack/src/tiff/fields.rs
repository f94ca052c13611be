//! The values of a page's directory, and the page they describe.

use std::collections::HashMap;

use super::page::{Compression, Page};
use super::tags::{
    BITS_PER_SAMPLE, BLACK_IS_ZERO, COMPRESSION, FILL_ORDER, IMAGE_DESCRIPTION, IMAGE_LENGTH,
    IMAGE_WIDTH, LONG, LONG8, ORIENTATION, PACK_BITS, PER_CENTIMETRE, PER_INCH, PHOTOMETRIC,
    RATIONAL, RESOLUTION_UNIT, ROWS_PER_STRIP, SAMPLES_PER_PIXEL, SHORT, STRIP_BYTE_COUNTS,
    STRIP_OFFSETS, T6, TILE_OFFSETS, UNCOMPRESSED, WHITE_IS_ZERO, X_RESOLUTION, type_size,
};
use crate::error::StackError;
use crate::layer::PageInfo;
use crate::length::Dpi;

/// Images are at most this wide and high: columns and their sums fit in 32
/// bits with room to spare.
const LARGEST_SIDE: u64 = 1 << 26;

/// The tags that are looked at.
pub(super) const KNOWN: [u16; 15] = [
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
    RESOLUTION_UNIT,
    TILE_OFFSETS,
];

/// The values of a page's directory.
pub(super) struct Fields {
    pub(super) page: u32,
    pub(super) little_endian: bool,
    /// By tag: the field's type and bytes.
    pub(super) values: HashMap<u16, (u16, Vec<u8>)>,
}

impl Fields {
    pub(super) fn numbers(&self, tag: u16) -> Result<Vec<u64>, StackError> {
        let (kind, bytes) = self
            .values
            .get(&tag)
            .ok_or_else(|| malformed(self.page, format!("it lacks tag {tag}")))?;
        match *kind {
            SHORT | LONG | LONG8 => Ok(bytes
                .chunks_exact(type_size(*kind) as usize)
                .map(|value| number(value, self.little_endian))
                .collect()),
            kind => Err(malformed(self.page, format!("its tag {tag} has type {kind}"))),
        }
    }

    fn number(&self, tag: u16) -> Result<u64, StackError> {
        let first = self.numbers(tag)?.first().copied();
        first.ok_or_else(|| malformed(self.page, format!("its tag {tag} is empty")))
    }

    pub(super) fn number_or(&self, tag: u16, default: u64) -> Result<u64, StackError> {
        if self.values.contains_key(&tag) { self.number(tag) } else { Ok(default) }
    }

    fn side(&self, tag: u16) -> Result<u32, StackError> {
        match self.number(tag)? {
            side @ 1..=LARGEST_SIDE => Ok(side as u32),
            side => Err(malformed(self.page, format!("it claims a side of {side} pixels"))),
        }
    }

    fn dpi(&self) -> Option<Dpi> {
        let (kind, bytes) = self.values.get(&X_RESOLUTION)?;
        let [num, den] = [bytes.get(..4)?, bytes.get(4..8)?].map(|b| number(b, self.little_endian));
        let value = num as f64 / den as f64;
        match self.number_or(RESOLUTION_UNIT, PER_INCH).ok()? {
            _ if *kind != RATIONAL => None,
            PER_INCH => Dpi::new(value),
            PER_CENTIMETRE => Dpi::new(value * 2.54),
            _ => None,
        }
    }

    fn info(&self) -> PageInfo {
        self.values
            .get(&IMAGE_DESCRIPTION)
            .and_then(|(_, text)| PageInfo::parse(text.split(|&byte| byte == 0).next()?))
            .unwrap_or(PageInfo { index: self.page, ..PageInfo::default() })
    }

    /// The page without its strips.
    pub(super) fn page(&self) -> Result<Page, StackError> {
        let unsupported = |what: String| StackError::Unsupported { page: self.page, what };
        if self.values.contains_key(&TILE_OFFSETS) {
            return Err(unsupported("a tiled image".to_owned()));
        }
        let samples = self.number_or(SAMPLES_PER_PIXEL, 1)?;
        let gray = match self.number_or(BITS_PER_SAMPLE, 1)? {
            1 if samples == 1 => false,
            8 if samples == 1 => true,
            bits => return Err(unsupported(format!("an image of {samples} x {bits} bits"))),
        };
        let compression = match self.number_or(COMPRESSION, UNCOMPRESSED)? {
            UNCOMPRESSED => Compression::Uncompressed,
            T6 if !gray => Compression::G4,
            PACK_BITS => Compression::PackBits,
            other => return Err(unsupported(format!("TIFF compression {other}"))),
        };
        let white_is_zero = match self.number(PHOTOMETRIC)? {
            WHITE_IS_ZERO => true,
            BLACK_IS_ZERO => false,
            other => return Err(unsupported(format!("photometric interpretation {other}"))),
        };
        match self.number_or(ORIENTATION, 1)? {
            1 => {}
            other => return Err(unsupported(format!("orientation {other}"))),
        }
        let height = self.side(IMAGE_LENGTH)?;
        Ok(Page {
            number: self.page,
            info: self.info(),
            dpi: self.dpi(),
            width: self.side(IMAGE_WIDTH)?,
            height,
            gray,
            white_is_zero,
            compression,
            rows_per_strip: self
                .number_or(ROWS_PER_STRIP, u64::from(height))?
                .clamp(1, u64::from(height)) as u32,
            strips: Vec::new(),
        })
    }
}

pub(super) fn malformed(page: u32, what: impl Into<String>) -> StackError {
    StackError::Malformed { page, what: what.into() }
}

/// An unsigned number of up to 8 bytes.
pub(super) fn number(bytes: &[u8], little_endian: bool) -> u64 {
    let step = |number: u64, &byte: &u8| number << 8 | u64::from(byte);
    if little_endian { bytes.iter().rev().fold(0, step) } else { bytes.iter().fold(0, step) }
}
