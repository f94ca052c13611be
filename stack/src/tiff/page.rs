//! Pages to layers.

use crate::error::StackError;
use crate::gray::GrayMask;
use crate::layer::{Image, Layer, PageInfo};
use crate::length::Dpi;
use crate::mask::{MOST_RUNS, MaskBuilder};
use crate::ordered::Held;
use crate::tiff::fields::malformed;
use crate::{g4, packbits};

/// How a page's strips are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    /// Not at all.
    Uncompressed,
    /// CCITT Group 4.
    G4,
    /// Apple's run lengths.
    PackBits,
}

/// One page as it stands in the file, not yet decoded.
#[derive(Clone, Debug)]
pub struct Page {
    pub(super) number: u32,
    pub(super) info: PageInfo,
    pub(super) dpi: Option<Dpi>,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) gray: bool,
    pub(super) white_is_zero: bool,
    pub(super) compression: Compression,
    pub(super) rows_per_strip: u32,
    pub(super) strips: Vec<Vec<u8>>,
}

impl Held for Page {
    fn bytes(&self) -> usize {
        // A code of four bits, about what they take, makes four bytes.
        8 * self.strip_bytes() as usize + 4 * self.height as usize
    }
}

impl Page {
    /// What the page's JSON line says (only the page's number, if it has none).
    pub fn info(&self) -> &PageInfo {
        &self.info
    }

    /// How the strips are compressed.
    pub fn compression(&self) -> Compression {
        self.compression
    }

    /// How many bytes the strips take.
    pub fn strip_bytes(&self) -> u64 {
        self.strips.iter().map(|strip| strip.len() as u64).sum()
    }

    /// Decodes the page.
    ///
    /// # Errors
    /// Where a strip does not decode to the size that the directory states.
    pub fn decode(mut self) -> Result<Layer, StackError> {
        let image = if self.gray { self.decode_gray()? } else { self.decode_mask()? };
        Ok(Layer { info: self.info, dpi: self.dpi, image })
    }

    fn decode_mask(&mut self) -> Result<Image, StackError> {
        let mut mask = MaskBuilder::new(self.width);
        // A transition takes about four bits, a row at least one.
        let bytes = self.strip_bytes() as usize;
        mask.reserve(bytes.saturating_mul(8).min(self.height as usize), bytes.saturating_mul(2));
        for (strip, rows) in self.strips.iter().zip(self.strip_heights()) {
            if self.compression == Compression::G4 {
                g4::decode_rows(strip, self.width, rows, &mut mask)
                    .map_err(|source| StackError::Strip { layer: self.info.index, source })?;
            } else {
                self.unpack(strip, self.width.div_ceil(8), rows, |row| {
                    mask.push_checked(&bit_transitions(row, self.width));
                    mask.transition_count() <= MOST_RUNS
                })?;
            }
        }
        let mask = mask.finish();
        Ok(Image::Mask(if self.white_is_zero {
            mask.inverted()
        } else if self.compression == Compression::G4 && self.strips.len() == 1 {
            mask.with_strip(self.strips.remove(0))
        } else {
            mask
        }))
    }

    fn decode_gray(&self) -> Result<Image, StackError> {
        let mut gray = GrayMask::new(self.width);
        let flip = if self.white_is_zero { 0xFF } else { 0 };
        for (strip, rows) in self.strips.iter().zip(self.strip_heights()) {
            self.unpack(strip, self.width, rows, |row| {
                let levels = row.iter().map(|&(length, byte)| (length, byte ^ flip));
                gray.push_runs(levels).expect("rows are cut to the width");
                gray.change_count() <= MOST_RUNS
            })?;
        }
        Ok(Image::Gray(gray))
    }

    /// How many rows each strip holds.
    pub(super) fn strip_heights(&self) -> impl Iterator<Item = u32> {
        let (whole, height) = (self.rows_per_strip, self.height);
        (0..height.div_ceil(whole)).map(move |i| whole.min(height - i * whole))
    }

    /// Gives each row of an uncompressed or PackBits strip as runs of bytes,
    /// until `each` has enough.
    fn unpack(
        &self,
        strip: &[u8],
        row_bytes: u32,
        rows: u32,
        each: impl FnMut(&[(u32, u8)]) -> bool,
    ) -> Result<(), StackError> {
        let cut = if self.compression == Compression::PackBits {
            cut_rows(packbits::Runs::new(strip), row_bytes, rows, each)
        } else {
            cut_rows(strip.iter().map(|&byte| (1, byte)), row_bytes, rows, each)
        };
        let whole =
            cut.ok_or_else(|| malformed(self.number, "its strip is shorter than its rows"))?;
        if whole {
            Ok(())
        } else {
            Err(malformed(self.number, "it has more runs than an image may have"))
        }
    }
}

/// Cuts runs into `rows` rows of `row_bytes` and gives each, until one is said
/// to be enough; `None` where the runs end early.
fn cut_rows(
    mut runs: impl Iterator<Item = (u32, u8)>,
    row_bytes: u32,
    rows: u32,
    mut each: impl FnMut(&[(u32, u8)]) -> bool,
) -> Option<bool> {
    let (mut length, mut byte) = (0, 0);
    let mut row = Vec::new();
    for _ in 0..rows {
        row.clear();
        let mut room = row_bytes;
        while room > 0 {
            if length == 0 {
                (length, byte) = runs.next()?;
            }
            let part = length.min(room);
            match row.last_mut() {
                Some((length, before)) if *before == byte => *length += part,
                _ => row.push((part, byte)),
            }
            length -= part;
            room -= part;
        }
        if !each(&row) {
            return Some(false);
        }
    }
    Some(true)
}

/// The transitions of a row of bits, given as runs of bytes.
fn bit_transitions(row: &[(u32, u8)], width: u32) -> Vec<u32> {
    let mut transitions = Vec::new();
    let (mut column, mut before) = (0, 0u8);
    for &(length, byte) in row {
        // Inside a run of 00 or FF nothing toggles.
        let visited = if matches!(byte, 0 | 0xFF) { 1 } else { length };
        for start in (column..).step_by(8).take(visited as usize) {
            let toggles = byte ^ (byte >> 1 | before << 7);
            let toggled = (0..8).filter(|bit| toggles << bit & 0x80 != 0);
            transitions.extend(toggled.map(|bit| start + bit));
            before = byte;
        }
        column += 8 * length;
    }
    transitions.truncate(transitions.partition_point(|&column| column < width));
    transitions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_become_transitions() {
        let row = [(1, 0b0110_0001), (2, 0xFF), (2, 0b1010_1010), (1, 0)];
        let expected = [1, 3, 7, 25, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39];
        assert_eq!(bit_transitions(&row, 48), expected);
        assert_eq!(bit_transitions(&row, 26), [1, 3, 7, 25]);
    }
}
