//! The images of archives: PNGs, to runs and from runs.

use png::{BitDepth, ColorType, Decoder};

use crate::codec::bits::byte_runs;
use crate::codec::deflate;
use crate::codec::picture_fault::{PictureFault, check_runs};
use crate::codec::png_page;
use crate::error::PageFault;
use crate::image::Image;
use crate::image::frame::Frame;
use crate::image::gray::GrayMask;
use crate::limits::Limits;
use crate::pitch::Pitch;

/// Encodes an image as an 8-bit gray PNG, whatever it is: printers know no other.
///
/// The cost grows with the image's runs: a row's filter byte is a black pixel before it.
pub(crate) fn encode(image: &Image, pitch: Option<Pitch>) -> Vec<u8> {
    let [width, height] = [image.width(), image.height()];
    let framed = Frame { left: -1, top: 0, width: width + 1, height };
    let data = deflate::encode(&image.to_gray().framed(framed));
    let mut file = png_page::SIGNATURE.to_vec();
    let header = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[8, 0, 0, 0, 0]].concat();
    put_chunk(&mut file, b"IHDR", &header);
    if let Some(pitch) = pitch {
        let [x, y] = pitch.per_metre().map(u32::to_be_bytes);
        put_chunk(&mut file, b"pHYs", &[&x[..], &y, &[1]].concat());
    }
    put_chunk(&mut file, b"IDAT", &data);
    put_chunk(&mut file, b"IEND", &[]);
    file
}

/// Encodes rows of gray levels as a PNG.
pub(crate) fn encode_levels(levels: &[u8], [width, height]: [u32; 2]) -> Vec<u8> {
    let mut image = GrayMask::new(width);
    for row in levels.chunks_exact(width as usize).take(height as usize) {
        image.push_runs(row.iter().map(|level| (1, *level))).expect("a row has its width");
    }
    encode(&Image::Gray(image), None)
}

fn put_chunk(file: &mut Vec<u8>, kind: &[u8; 4], data: &[u8]) {
    // The length counts the data alone, the CRC covers the kind, too (PNG, section 5.3).
    file.extend_from_slice(&(data.len() as u32).to_be_bytes());
    let start = file.len();
    file.extend_from_slice(kind);
    file.extend_from_slice(data);
    let crc = crc32fast::hash(&file[start..]);
    file.extend_from_slice(&crc.to_be_bytes());
}

/// A PNG's statements before its image.
pub(crate) struct PngShape {
    pub(crate) size: [u32; 2],
    is_gray: bool,
    is_rgb: bool,
}

/// Reads the start of a PNG.
pub(crate) fn shape(file: &[u8], limits: &Limits) -> Result<PngShape, PictureFault> {
    let mut decoder = Decoder::new(std::io::Cursor::new(file));
    decoder.set_ignore_iccp_chunk(true);
    let reader = decoder.read_info()?;
    let info = reader.info();
    if let Some(side) = [info.width, info.height].into_iter().find(|side| *side > limits.side) {
        return Err(PictureFault::Malformed(PageFault::Side(side.into())));
    }
    let is_plain = !info.interlaced && info.bit_depth == BitDepth::Eight && info.trns.is_none();
    Ok(PngShape {
        size: [info.width, info.height],
        is_gray: is_plain && info.color_type == ColorType::Grayscale,
        is_rgb: is_plain && info.color_type == ColorType::Rgb,
    })
}

impl PngShape {
    /// Returns whether each pixel's red, green and blue are three pixels of a panel beside each
    /// other, which has this many columns.
    pub(crate) fn is_of_triples(&self, columns: u32) -> bool {
        self.is_rgb && self.size[0] == columns.div_ceil(3) && columns > self.size[0]
    }
}

/// Decodes an image of a panel of this size. Without gray levels it is a mask.
pub(crate) fn decode(file: &[u8], size: [u32; 2], limits: &Limits) -> Result<Image, PictureFault> {
    let shape = shape(file, limits)?;
    let by_runs = || shape.is_gray.then(|| decode_runs(file, size, limits)).flatten();
    let image = if shape.is_of_triples(size[0]) {
        Image::Gray(decode_triples(file, size[0], limits)?)
    } else if let Some(image) = by_runs() {
        Image::Gray(image)
    } else {
        png_page::decode(file, limits)?
    };
    Ok(match image {
        Image::Gray(gray) => gray.to_mask().map_or(Image::Gray(gray), Image::Mask),
        mask @ Image::Mask(_) => mask,
    })
}

/// Decodes the red, green and blue of each pixel as three pixels beside each other.
fn decode_triples(file: &[u8], columns: u32, limits: &Limits) -> Result<GrayMask, PictureFault> {
    let mut decoder = Decoder::new(std::io::Cursor::new(file));
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info()?;
    let mut gray = GrayMask::new(columns);
    let mut runs = Vec::new();
    while let Some(row) = reader.next_row()? {
        // The last pixel may have more than the panel.
        byte_runs(&row.data()[..columns as usize], &mut runs);
        gray.push_runs(runs.iter().copied()).expect("a row is as long as the width");
        check_runs(gray.change_count(), limits.runs)?;
    }
    Ok(gray)
}

/// Decodes an image whose rows have no filter and whose copies are of the byte before, as
/// [`encode`] writes it, at the cost of its runs; `None` for others, sound or not.
fn decode_runs(file: &[u8], [width, height]: [u32; 2], limits: &Limits) -> Option<GrayMask> {
    let data = only_data(file)?;
    let row_bytes = u64::from(width) + 1;
    let runs = deflate::runs(data, row_bytes * u64::from(height))?;
    let mut gray = GrayMask::new(width);
    let mut row: Vec<(u32, u8)> = Vec::new();
    // The byte before a row is its filter.
    let mut left = width + 1;
    for (mut length, level) in runs {
        while length > 0 {
            if left == width + 1 {
                if level != 0 {
                    return None;
                }
                (left, length) = (width, length - 1);
                continue;
            }
            let part = length.min(left);
            row.push((part, level));
            (left, length) = (left - part, length - part);
            if left == 0 {
                gray.push_runs(row.drain(..)).ok()?;
                left = width + 1;
                if gray.change_count() > limits.runs {
                    return None;
                }
            }
        }
    }
    (gray.height() == height).then_some(gray)
}

/// Returns the data of a PNG that has it in one chunk, if that chunk is whole.
fn only_data(file: &[u8]) -> Option<&[u8]> {
    let mut rest = file.strip_prefix(&png_page::SIGNATURE)?;
    let mut data = None;
    while let Some((length, more)) = rest.split_first_chunk() {
        let length = u32::from_be_bytes(*length) as usize;
        let body = more.get(..length.checked_add(4)?)?;
        let crc = more.get(length + 4..length + 8)?;
        if body.starts_with(b"IDAT") {
            if data.is_some() || crc != crc32fast::hash(body).to_be_bytes() {
                return None;
            }
            data = Some(&body[4..]);
        }
        rest = &more[length + 8..];
    }
    data
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{arbitrary_gray, arbitrary_mask};

    fn check(image: &Image) {
        let file = encode(image, None);
        let size = [image.width(), image.height()];
        let limits = Limits::default();
        // The decoder of any PNG is the referee.
        let levels = |image: &Image| image.to_gray().into_owned();
        assert_eq!(levels(&png_page::decode(&file, &limits).unwrap()), levels(image));
        assert_eq!(decode_runs(&file, size, &limits).as_ref(), Some(&levels(image)));
        let decoded = decode(&file, size, &limits).unwrap();
        assert_eq!(levels(&decoded), levels(image));
        assert_eq!(matches!(decoded, Image::Mask(_)), levels(image).to_mask().is_some());
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
    }

    #[test]
    fn three_colors_are_three_pixels_of_a_panel() {
        let rows = [[1, 0, 200, 255, 0, 9], [0, 0, 0, 0, 7, 0]];
        let mut file = Vec::new();
        crate::write_rgb_png(&mut file, 2, 2, rows.iter().map(|row| row.to_vec())).unwrap();
        for columns in [5u32, 6] {
            let image = decode(&file, [columns, 2], &Limits::default()).unwrap();
            assert_eq!(image.width(), columns);
            for (row, levels) in (0..).zip(rows) {
                for (column, level) in (0..columns).zip(levels) {
                    assert_eq!(image.level(column, row), level);
                }
            }
        }
    }
}
