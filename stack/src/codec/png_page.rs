//! Reads a PNG file as a page, converting rows to runs as they are decoded.

use std::io::Cursor;

use png::{BitDepth, ColorType, Decoder, Info, PixelDimensions, Reader, Unit};

use crate::codec::bits::{bit_transitions, byte_runs};
use crate::codec::picture_fault::{PictureFault, check_runs, gray_level};
use crate::error::{PageFault, UnsupportedFeature};
use crate::image::Image;
use crate::image::gray::GrayMask;
use crate::image::mask::Mask;
use crate::layer::check::PageLine;
use crate::length::{Dpi, has_square_pixels};
use crate::limits::Limits;
use crate::pitch::Pitch;

/// The first bytes of every PNG.
pub(crate) const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// The keyword of the text chunk that holds a page's JSON line.
pub(crate) const DESCRIPTION: &str = "Description";

/// The JSON key of the resolution, used if whole pixels per meter cannot express it.
pub(crate) const EXACT_DPI: &str = "dpi";

/// The properties of a PNG's image, from the chunks before its data.
pub(crate) struct Header {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) gray: bool,
    pub(crate) pitch: Option<Pitch>,
    pub(crate) line: Option<PageLine>,
}

impl From<png::DecodingError> for PictureFault {
    fn from(error: png::DecodingError) -> Self {
        Self::Malformed(PageFault::Png(error))
    }
}

/// A decoder of a PNG's rows.
type PngRows<'a> = Reader<Cursor<&'a [u8]>>;

/// Reads the chunks before the image data.
pub(crate) fn header(file: &[u8], limits: &Limits) -> Result<Header, PictureFault> {
    let (reader, samples) = open(file, limits)?;
    let info = reader.info();
    let mut line = description(info).and_then(|text| PageLine::parse(text.as_bytes()));
    Ok(Header {
        width: info.width,
        height: info.height,
        gray: !samples.are_bits(),
        pitch: pitch(info, line.as_mut())?,
        line,
    })
}

/// Decodes the image.
pub(crate) fn decode(file: &[u8], limits: &Limits) -> Result<Image, PictureFault> {
    let (reader, samples) = open(file, limits)?;
    if samples.are_bits() {
        decode_mask(reader, &samples, limits.runs)
    } else {
        decode_gray(reader, &samples, limits.runs)
    }
}

fn decode_mask(
    mut reader: PngRows<'_>,
    samples: &Samples,
    max_runs: usize,
) -> Result<Image, PictureFault> {
    let width = reader.info().width;
    let mut mask = Mask::without_rows(width);
    let mut runs = Vec::new();
    while let Some(row) = reader.next_row()? {
        byte_runs(row.data(), &mut runs);
        mask.push(&bit_transitions(&runs, width));
        // Checked after each row: a small file may expand to any number of runs.
        check_runs(mask.change_count(), max_runs)?;
    }
    // A palette may call white 0.
    Ok(Image::Mask(if samples.levels[0] == Some(0) { mask } else { mask.inverted() }))
}

fn decode_gray(
    mut reader: PngRows<'_>,
    samples: &Samples,
    max_runs: usize,
) -> Result<Image, PictureFault> {
    let width = reader.info().width;
    let mut gray = GrayMask::new(width);
    let (mut row_samples, mut runs) = (Vec::new(), Vec::new());
    while let Some(row) = reader.next_row()? {
        samples.unpack(row.data(), width, &mut row_samples)?;
        byte_runs(&row_samples, &mut runs);
        for (_, sample) in &mut runs {
            *sample = match samples.levels.get(usize::from(*sample)) {
                Some(Some(level)) => *level,
                Some(None) => return Err(PictureFault::Unsupported(UnsupportedFeature::Colour)),
                None => return Err(PictureFault::Malformed(PageFault::PaletteEntry(*sample))),
            };
        }
        gray.push_runs(runs.iter().copied()).expect("a row is as long as the width");
        check_runs(gray.change_count(), max_runs)?;
    }
    Ok(Image::Gray(gray))
}

fn open<'a>(file: &'a [u8], limits: &Limits) -> Result<(PngRows<'a>, Samples), PictureFault> {
    let mut decoder = Decoder::new(Cursor::new(file));
    // A profile decides no gray level here, so a broken one must not refuse the page.
    decoder.set_ignore_iccp_chunk(true);
    let reader = decoder.read_info()?;
    let info = reader.info();
    let side = info.width.max(info.height);
    if side > limits.side {
        return Err(PictureFault::Malformed(PageFault::Side(side.into())));
    }
    // An interlaced image comes in seven passes, not in rows from the top (PNG, section 8).
    if info.interlaced {
        return Err(PictureFault::Unsupported(UnsupportedFeature::Interlaced));
    }
    if info.animation_control.is_some_and(|animation| animation.num_frames > 1) {
        return Err(PictureFault::Unsupported(UnsupportedFeature::SeveralImages));
    }
    let samples = Samples::of(info)?;
    Ok((reader, samples))
}

/// A PNG's encoding of gray levels.
struct Samples {
    /// Bits per sample, at most 8.
    bits: usize,
    /// Samples per pixel.
    channels: usize,
    /// The level of each sample value, or none for a palette's color.
    levels: Vec<Option<u8>>,
}

impl Samples {
    fn of(info: &Info<'_>) -> Result<Self, PictureFault> {
        if info.trns.is_some() {
            return Err(PictureFault::Unsupported(UnsupportedFeature::Transparency));
        }
        let bits = match info.bit_depth {
            BitDepth::Sixteen => {
                return Err(PictureFault::Unsupported(UnsupportedFeature::SixteenBits));
            }
            depth => depth as usize,
        };
        let highest = (1u32 << bits) - 1;
        let levels = match info.color_type {
            ColorType::Indexed => {
                let palette = info.palette.as_deref().unwrap_or_default();
                // A color that no pixel uses does no harm.
                palette.chunks(3).map(|entry| gray_level(entry).ok()).collect()
            }
            // 255 is a multiple of 1, 3, 15 and 255, so levels are exact.
            _ => (0..=highest).map(|sample| Some((sample * 255 / highest) as u8)).collect(),
        };
        Ok(Self { bits, channels: info.color_type.samples(), levels })
    }

    /// Returns whether the image is 1-bit, black and white.
    fn are_bits(&self) -> bool {
        let is_black_and_white =
            matches!(*self.levels, [Some(0), Some(255)] | [Some(255), Some(0)]);
        self.bits == 1 && is_black_and_white
    }

    /// Unpacks the samples of a row to a byte for each pixel.
    fn unpack(&self, row: &[u8], width: u32, samples: &mut Vec<u8>) -> Result<(), PictureFault> {
        samples.clear();
        if self.channels > 1 {
            for pixel in row.chunks_exact(self.channels) {
                samples.push(gray_level(pixel)?);
            }
            return Ok(());
        }
        let mask = 0xFF >> (8 - self.bits);
        for byte in row {
            samples.extend((0..8).step_by(self.bits).map(|b| byte >> (8 - self.bits - b) & mask));
        }
        // The last byte may hold samples beyond the width.
        samples.truncate(width as usize);
        Ok(())
    }
}

/// Returns the resolution: from the JSON line's key if it rounds to the same whole pixels
/// per meter (the key is then removed from the line), otherwise from these.
fn pitch(info: &Info<'_>, line: Option<&mut PageLine>) -> Result<Option<Pitch>, PictureFault> {
    let Some(PixelDimensions { xppu, yppu, unit }) = info.pixel_dims else { return Ok(None) };
    let sides = [xppu, yppu].map(f64::from);
    // Whole pixels a meter are rounded; a ratio is not.
    let is_square = has_square_pixels(sides, if unit == Unit::Meter { 1.0 } else { 0.0 });
    // Other programs round by more than we do.
    let is_ours = line.as_ref().is_some_and(|line| line.check.is_some());
    let pixels = [xppu, if is_square && !is_ours { xppu } else { yppu }];
    let whole = match (unit, pixels.map(Dpi::from_per_metre)) {
        (Unit::Meter, [Some(x), Some(y)]) => Some(Pitch { x, y }),
        _ if !is_square => return Err(PictureFault::Rectangular(sides)),
        // Other units give only the ratio of the sides.
        _ => None,
    };
    let stated = line.and_then(|line| {
        let other = &mut line.info.other;
        let pitch: Pitch = serde_json::from_value(other.get(EXACT_DPI)?.clone()).ok()?;
        let belongs = pitch.per_metre() == pixels && whole.is_some_and(|whole| whole != pitch);
        belongs.then(|| other.shift_remove(EXACT_DPI)).map(|_| pitch)
    });
    Ok(stated.or(whole))
}

/// Returns the description, if it comes before the image data.
fn description<'a>(info: &'a Info<'_>) -> Option<&'a str> {
    let latin = info.uncompressed_latin1_text.iter().find(|text| text.keyword == DESCRIPTION);
    latin.map(|text| text.text.as_str())
}
