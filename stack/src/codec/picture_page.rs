//! Reads BMP, PNM, JPEG, WebP and GIF files as pages, and says which pictures are gray.

use std::io::Cursor;
use std::sync::{Mutex, PoisonError};

use image::codecs::bmp::BmpDecoder;
use image::codecs::gif::GifDecoder;
use image::codecs::jpeg::JpegDecoder;
use image::codecs::pnm::PnmDecoder;
use image::codecs::webp::WebPDecoder;
use image::{AnimationDecoder, ColorType, ExtendedColorType, ImageDecoder, ImageError};

use crate::codec::picture_fault::{PictureFault, check_runs, gray_level};
use crate::codec::picture_format::PictureFormat;
use crate::codec::png_page::Header;
use crate::error::{PageFault, UnsupportedFeature};
use crate::image::Image;
use crate::image::gray::GrayMask;
use crate::length::has_square_pixels;
use crate::limits::Limits;
use crate::text::one_line;

/// Reads the header of a picture.
pub(crate) fn header(
    format: PictureFormat,
    file: &[u8],
    limits: &Limits,
) -> Result<Header, PictureFault> {
    let (width, height) = decoder(format, &mut Cursor::new(file), limits)?.dimensions();
    if let Some(resolutions) = resolutions(format, file)
        // Both resolutions are whole numbers, each rounded by itself.
        && !has_square_pixels(resolutions, 1.0)
    {
        return Err(PictureFault::Rectangular(resolutions));
    }
    Ok(Header { width, height, gray: true, pitch: None, line: None })
}

/// Decodes a picture: to a mask if its file has one bit a pixel, black or white, otherwise to a
/// gray mask.
pub(crate) fn decode(
    format: PictureFormat,
    file: &[u8],
    limits: &Limits,
) -> Result<Image, PictureFault> {
    let mut reader = Cursor::new(file);
    let decoder = decoder(format, &mut reader, limits)?;
    let (width, _) = decoder.dimensions();
    let are_bits = match format {
        // The decoder widens pixels, and does not state their number of bits in the file.
        PictureFormat::Bmp => bits_of_bmp(file) == 1,
        _ => decoder.original_color_type() == ExtendedColorType::L1,
    };
    // Decoders hold all pixels, so decoders in many threads could take much memory.
    static ONE_LARGE_PICTURE: Mutex<()> = Mutex::new(());
    let is_large = decoder.total_bytes() > LARGE_PICTURE_BYTES;
    // The lock guards no data, so a panic of its holder spoils nothing.
    let _turn = is_large.then(|| ONE_LARGE_PICTURE.lock().unwrap_or_else(PoisonError::into_inner));
    let samples = usize::from(decoder.color_type().channel_count());
    let pixels = match format {
        // The decoder's own pixels do not show whether other frames follow.
        PictureFormat::Gif => {
            drop(decoder);
            only_frame(file, limits)?
        }
        _ => {
            let mut pixels = vec![0; decoder.total_bytes() as usize];
            decoder.read_image_boxed(&mut pixels).map_err(|error| unread(format, &error))?;
            pixels
        }
    };
    // A PNM file may have several images behind each other.
    if format == PictureFormat::Pnm && !rest(&reader).trim_ascii().is_empty() {
        return Err(PictureFault::Unsupported(UnsupportedFeature::SeveralImages));
    }
    let gray = gray_mask(&pixels, samples, width, limits.runs)?;
    let mask = if are_bits { gray.to_mask() } else { None };
    Ok(mask.map_or(Image::Gray(gray), Image::Mask))
}

/// Larger pictures, in bytes of their pixels, are decoded one at a time.
const LARGE_PICTURE_BYTES: u64 = 32 << 20;

/// Opens a picture that keeps to the limits.
fn decoder<'a>(
    format: PictureFormat,
    file: &'a mut Cursor<&[u8]>,
    limits: &Limits,
) -> Result<Box<dyn ImageDecoder + 'a>, PictureFault> {
    let unread = |error| unread(format, &error);
    if is_cut_off(format, file.get_ref()) {
        return Err(unread_because(format, "it is cut off"));
    }
    let mut decoder: Box<dyn ImageDecoder> = match format {
        PictureFormat::Bmp => Box::new(BmpDecoder::new(file).map_err(unread)?),
        PictureFormat::Gif => Box::new(GifDecoder::new(file).map_err(unread)?),
        PictureFormat::Jpeg => Box::new(JpegDecoder::new(file).map_err(unread)?),
        PictureFormat::Pnm => Box::new(PnmDecoder::new(file).map_err(unread)?),
        PictureFormat::WebP => {
            let decoder = WebPDecoder::new(file).map_err(unread)?;
            if decoder.has_animation() {
                return Err(PictureFault::Unsupported(UnsupportedFeature::SeveralImages));
            }
            Box::new(decoder)
        }
    };
    let (width, height) = decoder.dimensions();
    let side = width.max(height);
    if side > limits.side || width.min(height) == 0 {
        return Err(PictureFault::Malformed(PageFault::Side(side.into())));
    }
    // The size is a claim of the header, and decoders allocate all of it.
    if decoder.total_bytes() > limits.picture_bytes {
        let bytes = decoder.total_bytes();
        return Err(PictureFault::Malformed(PageFault::PictureBytes(bytes)));
    }
    match decoder.color_type() {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => {}
        _ => return Err(PictureFault::Unsupported(UnsupportedFeature::SixteenBits)),
    }
    decoder.set_limits(memory_limits(limits)).map_err(unread)?;
    Ok(decoder)
}

/// Returns the memory that decoders may take besides the pixels.
fn memory_limits(limits: &Limits) -> image::Limits {
    let mut memory = image::Limits::default();
    memory.max_alloc = Some(2 * limits.picture_bytes);
    memory
}

/// Returns the pixels of a GIF, which must not be an animation.
fn only_frame(file: &[u8], limits: &Limits) -> Result<Vec<u8>, PictureFault> {
    let unread = |error| unread(PictureFormat::Gif, &error);
    let mut decoder = GifDecoder::new(Cursor::new(file)).map_err(unread)?;
    decoder.set_limits(memory_limits(limits)).map_err(unread)?;
    let mut frames = decoder.into_frames();
    let Some(frame) = frames.next().transpose().map_err(unread)? else {
        return Err(unread_because(PictureFormat::Gif, "it holds no image"));
    };
    match frames.next().transpose().map_err(unread)? {
        None => Ok(frame.into_buffer().into_raw()),
        Some(_) => Err(PictureFault::Unsupported(UnsupportedFeature::SeveralImages)),
    }
}

/// Returns the image of pixels of `samples` bytes each.
fn gray_mask(
    pixels: &[u8],
    samples: usize,
    width: u32,
    max_runs: usize,
) -> Result<GrayMask, PictureFault> {
    let mut gray = GrayMask::new(width);
    let mut levels = Vec::new();
    for row in pixels.chunks_exact(samples * width as usize) {
        levels.clear();
        for pixel in row.chunks_exact(samples) {
            levels.push((1, gray_level(pixel)?));
        }
        gray.push_runs(levels.iter().copied()).expect("a row is as long as the width");
        check_runs(gray.change_count(), max_runs)?;
    }
    Ok(gray)
}

/// Returns the bits of a pixel of a BMP, from one of its two kinds of headers.
fn bits_of_bmp(file: &[u8]) -> u8 {
    // A BITMAPCOREHEADER has 12 bytes, a BITMAPINFOHEADER and its successors have more.
    let is_old = file.get(14) == Some(&12);
    file.get(if is_old { 24 } else { 28 }).copied().unwrap_or(0)
}

/// Returns the resolution across and down, or only their ratio, as the file's header states it.
fn resolutions(format: PictureFormat, file: &[u8]) -> Option<[f64; 2]> {
    match format {
        PictureFormat::Bmp => {
            let is_old = file.get(14) == Some(&12);
            // Only the longer headers have XPelsPerMeter and YPelsPerMeter.
            let at = |from: usize| Some(i32::from_le_bytes(*file.get(from..)?.first_chunk()?));
            Some([at(38).filter(|_| !is_old)?.into(), at(42)?.into()])
        }
        PictureFormat::Jpeg => jfif_density(file),
        // The width of a pixel for its height is (n + 15) / 64 (GIF89a, section 18).
        PictureFormat::Gif => match *file.get(12)? {
            0 => None,
            n => Some([6400.0, 100.0 * (f64::from(n) + 15.0)]),
        },
        PictureFormat::Pnm | PictureFormat::WebP => None,
    }
}

/// Returns the density of a JPEG from its JFIF segment, if it has one.
fn jfif_density(file: &[u8]) -> Option<[f64; 2]> {
    let mut rest = file.get(2..)?;
    // Segments before the image's data (ITU-T T.81, annex B).
    while let [0xFF, marker @ 0xC0..=0xFE, high, low, ..] = *rest
        && marker != 0xDA
    {
        // A segment's length counts its own two bytes (ITU-T T.81, B.1.1.4).
        let segment = rest.get(4..2 + usize::from(u16::from_be_bytes([high, low])))?;
        if let (0xE0, [b'J', b'F', b'I', b'F', 0, _, _, unit, x1, x0, y1, y0, ..]) =
            (marker, segment)
        {
            let sides = [[*x1, *x0], [*y1, *y0]].map(|side| f64::from(u16::from_be_bytes(side)));
            // Without a unit the numbers are a ratio, which rounding does not excuse.
            return Some(if *unit == 0 { sides.map(|side| 1e4 * side) } else { sides });
        }
        rest = &rest[4 + segment.len()..];
    }
    None
}

/// Returns whether a file lacks its end in a way that its decoder does not notice: a JPEG decoder
/// fills missing data with gray.
fn is_cut_off(format: PictureFormat, file: &[u8]) -> bool {
    match format {
        PictureFormat::Jpeg => {
            // Zeros behind the end of the image are padding.
            let padding = file.iter().rev().take_while(|&&byte| byte == 0).count();
            !file[..file.len() - padding].ends_with(&[0xFF, 0xD9])
        }
        PictureFormat::WebP => {
            // The size in a RIFF header leaves out the header's first eight bytes.
            let claimed = file.get(4..8).and_then(|size| size.try_into().ok());
            claimed.is_none_or(|size| (file.len() as u64) < 8 + u64::from(u32::from_le_bytes(size)))
        }
        _ => false,
    }
}

fn rest<'a>(reader: &Cursor<&'a [u8]>) -> &'a [u8] {
    &reader.get_ref()[reader.position() as usize..]
}

fn unread(format: PictureFormat, error: &ImageError) -> PictureFault {
    unread_because(format, &error.to_string())
}

fn unread_because(format: PictureFormat, problem: &str) -> PictureFault {
    PictureFault::Malformed(PageFault::Picture { format, problem: one_line(problem) })
}
