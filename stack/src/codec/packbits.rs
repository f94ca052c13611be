//! Encodes gray images as PackBits and decodes PackBits to runs of bytes.
//!
//! Source: TIFF 6.0, section 9.

use crate::image::gray::{GrayMask, LevelChange, gray_runs};

/// Encodes a gray mask, each row separately, as TIFF requires.
pub(crate) fn encode(image: &GrayMask) -> Vec<u8> {
    let mut out = Vec::new();
    for changes in image.rows() {
        encode_row(&mut out, changes, image.width());
    }
    out
}

fn encode_row(out: &mut Vec<u8>, changes: &[LevelChange], width: u32) {
    let mut column = 0;
    for (start, end, level) in gray_runs(changes, width) {
        put_run(out, start - column, 0);
        put_run(out, end - start, level);
        column = end;
    }
    put_run(out, width - column, 0);
}

/// Appends `length` bytes of `level`, always as repeats: these take two bytes per 128
/// pixels, and gray pixels that differ from both neighbors are rare.
fn put_run(out: &mut Vec<u8>, mut length: u32, level: u8) {
    while length > 0 {
        let part = length.min(128);
        // A repeat count of n is written as 1 - n.
        out.extend_from_slice(&[1u8.wrapping_sub(part as u8), level]);
        length -= part;
    }
}

/// An iterator over the runs `(length, byte)` of packed data. It ends where the data ends,
/// even within a packet.
pub(crate) struct Runs<'a> {
    data: &'a [u8],
    /// The number of unread bytes of the current literal.
    literal: usize,
}

impl<'a> Runs<'a> {
    pub(crate) fn new(data: &'a [u8]) -> Self {
        Self { data, literal: 0 }
    }

    fn byte(&mut self) -> Option<u8> {
        self.data.split_off_first().copied()
    }
}

impl Iterator for Runs<'_> {
    type Item = (u32, u8);

    fn next(&mut self) -> Option<(u32, u8)> {
        while self.literal == 0 {
            match self.byte()? {
                header @ 0..=127 => self.literal = usize::from(header) + 1,
                // -128 is no operation (TIFF 6.0, section 9).
                128 => {}
                // A header of -n repeats the byte n + 1 times (TIFF 6.0, section 9).
                header => return Some((257 - u32::from(header), self.byte()?)),
            }
        }
        self.literal -= 1;
        Some((1, self.byte()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packed_row_unpacks() {
        let mut image = GrayMask::new(1000);
        image.push_runs([(300, 0), (1, 9), (1, 8), (400, 255)]).unwrap();
        let packed = encode(&image);
        let bytes: Vec<u8> = Runs::new(&packed)
            .flat_map(|(length, byte)| std::iter::repeat_n(byte, length as usize))
            .collect();
        assert_eq!(bytes.len(), 1000);
        assert_eq!((bytes[299], bytes[300], bytes[301], bytes[302]), (0, 9, 8, 255));
        assert_eq!((bytes[701], bytes[702]), (255, 0));
    }

    #[test]
    fn the_example_of_the_specification_unpacks() {
        // The last packet of the specification's example, cut short.
        let packed = [0xFE, 0xAA, 2, 0x80, 0, 0x2A, 0xFD, 0xAA, 0x80, 3, 0x80, 0];
        let runs: Vec<_> = Runs::new(&packed).collect();
        let literal = [(1, 0x80), (1, 0), (1, 0x2A)];
        assert_eq!(runs, [&[(3, 0xAA)], &literal[..], &[(4, 0xAA)], &literal[..2]].concat());
    }
}
