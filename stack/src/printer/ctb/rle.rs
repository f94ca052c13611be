//! The run lengths of a CTB file's image, to runs and from runs.
//!
//! A level has seven bits. A byte below 128 is one pixel of that level; otherwise a length follows
//! its lower bits, whose first byte begins with as many ones as bytes follow it. Runs go on from
//! one row to the next.

use crate::error::PageFault;
use crate::image::Image;
use crate::printer::runs::{for_each_run, image_of};

/// The longest run of one length.
const LONGEST: u64 = (1 << 28) - 1;

/// Encodes an image. Levels lose their lowest bit.
pub(crate) fn encode(image: &Image) -> Vec<u8> {
    let mut out = Vec::new();
    let (mut code, mut length) = (0, 0);
    for_each_run(image, |more, level| {
        if level >> 1 != code && more > 0 {
            put(&mut out, length, code);
            (code, length) = (level >> 1, 0);
        }
        length += u64::from(more);
    });
    put(&mut out, length, code);
    out
}

fn put(out: &mut Vec<u8>, mut length: u64, code: u8) {
    while length > 0 {
        let part = length.min(LONGEST) as u32;
        length -= u64::from(part);
        if part == 1 {
            out.push(code);
            continue;
        }
        out.push(code | 0x80);
        let (mark, more) = match part {
            0..=0x7F => (0, 0),
            0x80..=0x3FFF => (0x80, 1),
            0x4000..=0x1F_FFFF => (0xC0, 2),
            _ => (0xE0, 3),
        };
        let bytes = part.to_be_bytes();
        out.push(bytes[3 - more] | mark);
        out.extend_from_slice(&bytes[4 - more..]);
    }
}

/// Returns the level of a code: 0 is black, and 127 is white.
fn level_of(code: u8) -> u8 {
    if code == 0 { 0 } else { code << 1 | 1 }
}

/// Returns the lengths and levels of the runs.
fn runs(mut bytes: &[u8]) -> impl Iterator<Item = Result<(u32, u8), PageFault>> + '_ {
    let run = move || {
        let mut byte = || bytes.split_off_first().copied();
        let first = byte()?;
        let level = level_of(first & 0x7F);
        if first & 0x80 == 0 {
            return Some(Ok((1, level)));
        }
        let mut length = || {
            let first = byte()?;
            let more = first.leading_ones().min(4);
            if more == 4 {
                return None;
            }
            let start = u32::from(first & (0x7F >> more));
            (0..more).try_fold(start, |length, _| Some(length << 8 | u32::from(byte()?)))
        };
        Some(length().map(|length| (length, level)).ok_or(DAMAGED))
    };
    std::iter::from_fn(run)
}

const DAMAGED: PageFault = PageFault::RunLengths("one of them is damaged or cut off");

/// Returns whether the image has another level than black and white.
pub(crate) fn is_gray(bytes: &[u8]) -> Result<bool, PageFault> {
    for run in runs(bytes) {
        let (length, level) = run?;
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
    image_of(runs(bytes), size, is_gray, most_runs)
}

/// Encrypts an image with a file's key, or decrypts it.
pub(crate) fn crypt(bytes: &mut [u8], key: u32, layer: u32) {
    if key == 0 {
        return;
    }
    let step = key.wrapping_mul(0x2D83_CDAC).wrapping_add(0xD8A8_3423);
    let mut mask = layer.wrapping_mul(0x1E15_30CD).wrapping_add(0xEC3D_47CD).wrapping_mul(step);
    for four in bytes.chunks_mut(4) {
        for (byte, mask) in four.iter_mut().zip(mask.to_le_bytes()) {
            *byte ^= mask;
        }
        mask = mask.wrapping_add(step);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::image::mask::Mask;
    use crate::printer::testing::levels;
    use crate::testing::{arbitrary_gray, arbitrary_mask, mask_of};

    const MOST: usize = 1 << 20;

    /// The levels of all pixels, as the format's description has them.
    fn pixels(bytes: &[u8]) -> Vec<u8> {
        let (mut pixels, mut at) = (Vec::new(), 0);
        while at < bytes.len() {
            let code = bytes[at] & 127;
            let mut length = 1;
            if bytes[at] >= 128 {
                let rest = &bytes[at + 1..];
                let number = |digits: &[u8], lead: u8| {
                    digits.iter().skip(1).fold(usize::from(digits[0] - lead), |sum, digit| {
                        256 * sum + usize::from(*digit)
                    })
                };
                let (bytes, value) = match rest[0] {
                    0..128 => (1, number(&rest[..1], 0)),
                    128..192 => (2, number(&rest[..2], 128)),
                    192..224 => (3, number(&rest[..3], 192)),
                    _ => (4, number(&rest[..4], 224)),
                };
                at += bytes;
                length = value;
            }
            at += 1;
            pixels.extend(std::iter::repeat_n(if code == 0 { 0 } else { 2 * code + 1 }, length));
        }
        pixels
    }

    fn check(image: &Image) {
        let bytes = encode(image);
        // The lowest bit is lost, and above black it is one.
        let kept: Vec<u8> =
            levels(image).iter().map(|&level| if level < 2 { 0 } else { level | 1 }).collect();
        assert_eq!(pixels(&bytes), kept);
        let gray = is_gray(&bytes).unwrap();
        let read = decode(&bytes, [image.width(), image.height()], gray, MOST).unwrap();
        assert_eq!(levels(&read), kept);
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
            bytes in prop::collection::vec(any::<u8>(), 0..40), width in 1u32..40, height in 1u32..40,
        ) {
            let gray = is_gray(&bytes);
            let image = decode(&bytes, [width, height], gray.unwrap_or(true), MOST);
            if let Ok(image) = image {
                prop_assert_eq!(pixels(&bytes), levels(&image));
            }
        }

        #[test]
        fn encryption_undoes_itself(
            bytes in prop::collection::vec(any::<u8>(), 0..40), key: u32, layer: u32,
        ) {
            let mut other = bytes.clone();
            crypt(&mut other, key, layer);
            crypt(&mut other, key, layer);
            prop_assert_eq!(other, bytes);
        }
    }

    #[test]
    fn lengths_have_up_to_28_bits() {
        for rows in [1u32, 7, 8, 1000, 130_000] {
            let bytes = encode(&Image::Mask(mask_of(17, vec![&[0u32][..]; rows as usize])));
            assert!(bytes.len() <= 5, "{bytes:?}");
            check(&Image::Mask(mask_of(17, vec![&[0u32][..]; rows as usize])));
        }
        assert_eq!(encode(&Image::Mask(Mask::black(1 << 15, 1 << 14))).len(), 5 + 5 + 2);
    }

    #[test]
    fn damage_is_named() {
        let good = encode(&Image::Mask(mask_of(8, [&[1u32, 5][..]])));
        let fault = |bytes: &[u8], size| decode(bytes, size, false, 9).unwrap_err().to_string();
        assert!(fault(&good, [8, 2]).contains("shorter"));
        assert!(fault(&good, [7, 1]).contains("longer"));
        assert!(fault(&[0xFF], [8, 1]).contains("cut off"));
        assert!(fault(&[0xFF, 0xF0, 0, 0, 0, 0], [8, 1]).contains("damaged"));
        assert!(fault(&[], [8, 1]).contains("shorter"));
    }

    /// The first bytes of the mask of a key, by hand: step = key * a + b, mask = (layer * c + d) * step.
    #[test]
    fn the_mask_follows_the_description() {
        let (key, layer) = (7u64, 3u64);
        let step = (key * 0x2d83_cdac + 0xd8a8_3423) % (1 << 32);
        let mask = (layer * 0x1e15_30cd + 0xec3d_47cd) % (1 << 32) * step % (1 << 32);
        let mut bytes = [0; 6];
        crypt(&mut bytes, 7, 3);
        let second = ((mask + step) % (1 << 32)) as u32;
        let wanted = [(mask as u32).to_le_bytes(), second.to_le_bytes()].concat();
        assert_eq!(bytes, wanted[..6]);
    }
}
