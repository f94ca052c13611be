//! The run lengths of a GOO file's image, to runs and from runs.
//!
//! An image is a magic byte, chunks, and a checksum. The first byte of a chunk has its kind in the
//! upper two bits:
//!
//! | bits | pixels |
//! |---|---|
//! | `00` | black |
//! | `01` | of the level in the next byte |
//! | `10` | of the level before, plus or minus the lowest four bits |
//! | `11` | white |
//!
//! Except in kind `10`, the next two bits count the bytes that follow with the upper bits of the
//! length, and the lowest four are its lowest. In kind `10` they are the sign of the difference,
//! and whether a byte with the length follows. Chunks run on from one row to the next.

use crate::error::PageFault;
use crate::image::Image;
use crate::image::mask::Mask;
use crate::printer::runs::{for_each_run, image_of};

const MAGIC: u8 = 0x55;
/// The longest run of a chunk.
const LONGEST: u64 = (1 << 28) - 1;

/// Encodes an image.
pub(crate) fn encode(image: &Image) -> Vec<u8> {
    let mut out = Encoder { bytes: vec![MAGIC], level: 0, length: 0 };
    for_each_run(image, |length, level| out.put(length, level));
    out.finish()
}

struct Encoder {
    bytes: Vec<u8>,
    /// The run that may go on.
    level: u8,
    length: u64,
}

impl Encoder {
    fn put(&mut self, length: u32, level: u8) {
        if level != self.level && length > 0 {
            self.flush();
            self.level = level;
        }
        self.length += u64::from(length);
    }

    fn flush(&mut self) {
        while self.length > 0 {
            let part = self.length.min(LONGEST) as u32;
            self.length -= u64::from(part);
            let more = match part {
                0..=0xF => 0,
                0x10..=0xFFF => 1,
                0x1000..=0xF_FFFF => 2,
                _ => 3,
            };
            let kind = match self.level {
                0 => 0b00,
                0xFF => 0b11,
                _ => 0b01,
            };
            self.bytes.push((kind << 6) | ((more as u8) << 4) | (part & 0xF) as u8);
            if kind == 0b01 {
                self.bytes.push(self.level);
            }
            self.bytes.extend_from_slice(&(part >> 4).to_be_bytes()[4 - more..]);
        }
    }

    fn finish(mut self) -> Vec<u8> {
        self.flush();
        self.bytes.push(checksum(&self.bytes[1..]));
        self.bytes
    }
}

fn checksum(chunks: &[u8]) -> u8 {
    !chunks.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte))
}

/// The runs `(length, level)` of chunks; it ends with `None` inside a chunk that is cut off.
struct Chunks<'a> {
    bytes: &'a [u8],
    level: u8,
}

impl Chunks<'_> {
    fn byte(&mut self) -> Option<u8> {
        self.bytes.split_off_first().copied()
    }

    fn next(&mut self) -> Option<(u32, u8)> {
        let first = self.byte()?;
        let low = first & 0xF;
        let length = match first >> 6 {
            0b10 => {
                self.level = match first & 0x20 {
                    0 => self.level.wrapping_add(low),
                    _ => self.level.wrapping_sub(low),
                };
                if first & 0x10 == 0 { 1 } else { self.byte()?.into() }
            }
            kind => {
                self.level = match kind {
                    0b00 => 0,
                    0b01 => self.byte()?,
                    _ => 0xFF,
                };
                let mut upper = 0u32;
                for _ in 0..(first >> 4) & 3 {
                    upper = (upper << 8) | u32::from(self.byte()?);
                }
                (upper << 4) | u32::from(low)
            }
        };
        Some((length, self.level))
    }
}

/// Returns the chunks of an image's bytes, of an empty image too.
fn chunks(bytes: &[u8]) -> Result<Chunks<'_>, PageFault> {
    // Some writers leave an empty layer without chunks.
    let Some((&[magic], rest)) = bytes.split_first_chunk() else {
        return Ok(Chunks { bytes: &[], level: 0 });
    };
    let (chunks, sum) =
        rest.split_last().map_or((rest, None), |(sum, chunks)| (chunks, Some(*sum)));
    if magic != MAGIC || sum.is_some_and(|sum| sum != checksum(chunks)) {
        return Err(PageFault::RunLengths("their checksum does not match"));
    }
    Ok(Chunks { bytes: chunks, level: 0 })
}

/// Returns whether the image has another level than black and white.
pub(crate) fn is_gray(bytes: &[u8]) -> Result<bool, PageFault> {
    let mut chunks = chunks(bytes)?;
    while let Some((length, level)) = chunks.next() {
        if length > 0 && !matches!(level, 0 | 0xFF) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Decodes an image of this size, gray or not as [`is_gray`] says.
pub(crate) fn decode(
    bytes: &[u8],
    size: [u32; 2],
    is_gray: bool,
    most_runs: usize,
) -> Result<Image, PageFault> {
    let mut chunks = chunks(bytes)?;
    if chunks.bytes.is_empty() {
        return Ok(Image::Mask(Mask::black(size[0], size[1])));
    }
    let runs = std::iter::from_fn(|| {
        let is_end = chunks.bytes.is_empty();
        let cut = || PageFault::RunLengths("the last of them is cut off");
        (!is_end).then(|| chunks.next().ok_or_else(cut))
    });
    image_of(runs, size, is_gray, most_runs)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::printer::testing::levels;
    use crate::testing::{arbitrary_gray, arbitrary_mask, mask_of};

    const MOST: usize = 1 << 20;

    fn sealed(chunks: &[u8]) -> Vec<u8> {
        [&[MAGIC], chunks, &[checksum(chunks)]].concat()
    }

    /// The levels of all pixels, one after another, as the table of the module has it.
    fn pixels(chunks: &[u8]) -> Vec<u8> {
        let (mut pixels, mut at, mut level) = (Vec::new(), 0, 0u8);
        while at < chunks.len() {
            let first = chunks[at];
            at += 1;
            let length = if first >> 6 == 2 {
                let step = first % 16;
                level = if first & 32 == 0 {
                    level.wrapping_add(step)
                } else {
                    level.wrapping_sub(step)
                };
                if first & 16 == 0 {
                    1
                } else {
                    at += 1;
                    usize::from(chunks[at - 1])
                }
            } else {
                level = match first >> 6 {
                    0 => 0,
                    1 => {
                        at += 1;
                        chunks[at - 1]
                    }
                    _ => 255,
                };
                let bytes = usize::from(first / 16 % 4);
                let upper = chunks[at..at + bytes]
                    .iter()
                    .fold(0, |sum, byte| sum * 256 + usize::from(*byte));
                at += bytes;
                upper * 16 + usize::from(first % 16)
            };
            pixels.extend(std::iter::repeat_n(level, length));
        }
        pixels
    }

    fn check(image: &Image) {
        let bytes = encode(image);
        assert_eq!(pixels(&bytes[1..bytes.len() - 1]), levels(image));
        let size = [image.width(), image.height()];
        let gray = is_gray(&bytes).unwrap();
        let read = decode(&bytes, size, gray, MOST).unwrap();
        assert_eq!(levels(&read), levels(image));
        if let (Image::Mask(_), false) = (image, gray) {
            assert_eq!(&read, image);
        }
    }

    proptest! {
        #[test]
        fn images_are_read_back(mask in arbitrary_mask(), gray in arbitrary_gray()) {
            if mask.width() > 0 && mask.height() > 0 {
                check(&Image::Mask(mask));
            }
            if gray.height() > 0 {
                check(&Image::Gray(gray));
            }
        }

        #[test]
        fn any_bytes_are_an_image_or_an_error(
            chunks in prop::collection::vec(any::<u8>(), 0..60), width in 1u32..40, height in 1u32..40,
        ) {
            let bytes = sealed(&chunks);
            let gray = is_gray(&bytes).unwrap();
            let image = decode(&bytes, [width, height], gray, MOST).ok();
            if let Some(image) = image.filter(|_| !chunks.is_empty()) {
                prop_assert_eq!(pixels(&chunks), levels(&image));
            }
        }
    }

    #[test]
    fn every_kind_of_chunk_is_read() {
        // 3 black, 2 of level 9, 1 of 9 + 4, 4 of 13 - 8, 6 white.
        let bytes = sealed(&[0x03, 0x42, 9, 0x84, 0xB8, 4, 0xC6]);
        assert!(is_gray(&bytes).unwrap());
        let image = decode(&bytes, [8, 2], true, MOST).unwrap();
        assert_eq!(levels(&image), [0, 0, 0, 9, 9, 13, 5, 5, 5, 5, 255, 255, 255, 255, 255, 255]);
    }

    #[test]
    fn a_run_may_pass_many_rows_and_lengths_have_up_to_28_bits() {
        for rows in [1u32, 15, 4000, 70_000] {
            let white = mask_of(17, std::iter::repeat_n(&[0u32][..], rows as usize));
            let bytes = encode(&Image::Mask(white));
            assert!(bytes.len() <= 6, "{bytes:?}");
            check(&Image::Mask(mask_of(17, std::iter::repeat_n(&[0u32][..], rows as usize))));
        }
        assert_eq!(encode(&Image::Mask(Mask::black(1 << 15, 1 << 14))).len(), 2 + 8 + 1);
    }

    #[test]
    fn damage_is_named() {
        let good = encode(&Image::Mask(mask_of(8, [&[1u32, 5][..]])));
        let fault = |bytes: &[u8], size| decode(bytes, size, false, 9).unwrap_err().to_string();
        let mut other = good.clone();
        other[1] ^= 1;
        assert!(fault(&other, [8, 1]).contains("checksum"));
        assert!(is_gray(&other).is_err());
        assert!(fault(&good, [8, 2]).contains("shorter"));
        assert!(fault(&good, [7, 1]).contains("longer"));
        assert!(fault(&sealed(&[0x18]), [8, 1]).contains("cut off"));
        assert_eq!(decode(&[], [8, 1], false, 9).unwrap(), Image::Mask(Mask::black(8, 1)));
        let many = encode(&Image::Mask(mask_of(40, [&[1u32, 3, 5, 7, 9, 11, 13, 15, 17, 19][..]])));
        assert!(fault(&many, [40, 1]).contains("more runs"));
    }
}
