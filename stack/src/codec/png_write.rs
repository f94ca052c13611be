//! Writes layers and pictures as PNG files.

use std::io::{self, Write};

use png::{
    BitDepth, ColorType, Compression, Encoder, EncodingError, Filter, PixelDimensions, Unit,
};
use serde_json::json;

use crate::codec::bits::bits;
use crate::codec::png_page::{DESCRIPTION, EXACT_DPI};
use crate::error::StackError;
use crate::files::page_folder::{PageFile, PageFolder};
use crate::files::temporary::FolderBeside;
use crate::image::Image;
use crate::image::gray::gray_runs;
use crate::layer::Layer;
use crate::layer::check::{CheckChain, OpenLine};
use crate::length::Dpi;
use crate::ordered::map_in_order;
use crate::pitch::Pitch;

/// Writes layers as a folder of PNGs named like `layer_00812.png`, encoded on all threads.
/// The folder gets its name when it is complete.
///
/// # Errors
/// Returns the first error among the layers, or an error if the folder cannot be written.
pub fn write_png_folder<E>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    folder: FolderBeside,
) -> Result<(), E>
where
    E: From<StackError> + Send,
{
    let mut pages = PageFolder::new(folder);
    for page in map_in_order(layers, |layer: Layer| Ok(PngPage::new(&layer)?)) {
        pages.push(page?)?;
    }
    Ok(pages.finish()?)
}

/// Encodes a layer as a PNG: 1-bit for a mask, 8-bit for a gray mask. A `tEXt` chunk with
/// the keyword `Description` holds the page's JSON line.
///
/// The `pHYs` chunk has whole pixels per meter. If these cannot express the resolution, the
/// JSON line ends with it, as `"dpi":72.25`, or as `"dpi":[72.25,72]` along x and y.
///
/// # Errors
/// Returns an error if the image has no pixels.
pub fn png_of_layer(layer: &Layer) -> Result<Vec<u8>, StackError> {
    Ok(PngPage::new(layer)?.bytes(&mut CheckChain::default(), true))
}

/// A layer encoded as a PNG without its line, which depends on the pages before it.
struct PngPage {
    index: u32,
    png: Vec<u8>,
    line: OpenLine,
}

/// The end of a PNG's first chunk, the header: the signature has 8 bytes, the chunk 25.
const HEADER_END: usize = 33;

impl PngPage {
    fn new(layer: &Layer) -> Result<Self, StackError> {
        Ok(Self {
            index: layer.info.index,
            png: png_of_image(&layer.image, layer.pitch)?,
            line: line(layer),
        })
    }
}

impl PageFile for PngPage {
    fn name(&self) -> String {
        format!("layer_{:05}.png", self.index)
    }

    /// Returns the PNG with its line in a chunk after the header.
    fn bytes(&self, chain: &mut CheckChain, is_last: bool) -> Vec<u8> {
        let line = chain.close(&self.line, is_last);
        let body = [b"tEXt", DESCRIPTION.as_bytes(), &[0], line.as_bytes()].concat();
        // The length counts the data alone, the CRC covers the type, too (PNG, section 5.3).
        let length = (body.len() - 4) as u32;
        let crc = crc32fast::hash(&body);
        // Before the image's data, so that readers find the line without decoding.
        let (header, rest) = self.png.split_at(HEADER_END);
        [header, &length.to_be_bytes(), &body, &crc.to_be_bytes(), rest].concat()
    }
}

fn png_of_image(image: &Image, pitch: Option<Pitch>) -> io::Result<Vec<u8>> {
    let mut png = Vec::new();
    let mut encoder = Encoder::new(&mut png, image.width(), image.height());
    // Most rows equal the row above. Better compression saves a third of the bytes but takes
    // twenty times as long.
    encoder.set_compression(Compression::Fast);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_filter(Filter::Up);
    encoder.set_pixel_dims(pitch.map(pixel_dims));
    match image {
        Image::Mask(mask) => {
            encoder.set_depth(BitDepth::One);
            write_rows(encoder, mask.rows().map(|row| bits(row, mask.width())))?;
        }
        Image::Gray(gray) => {
            let levels = gray.rows().map(|row| {
                let mut levels = vec![0; gray.width() as usize];
                for (start, end, level) in gray_runs(row, gray.width()) {
                    levels[start as usize..end as usize].fill(level);
                }
                levels
            });
            write_rows(encoder, levels)?;
        }
    }
    Ok(png)
}

/// Writes rows of `width` 8-bit levels as a PNG.
///
/// # Errors
/// Returns an error if writing fails or the number of rows is not `height`.
pub fn write_gray_png(
    out: impl Write,
    width: u32,
    height: u32,
    rows: impl Iterator<Item = Vec<u8>>,
) -> io::Result<()> {
    write_picture(out, [width, height], ColorType::Grayscale, rows)
}

/// Writes rows of `width` pixels of 8-bit red, green and blue levels as a PNG.
///
/// # Errors
/// Returns an error in the same cases as [`write_gray_png`].
pub fn write_rgb_png(
    out: impl Write,
    width: u32,
    height: u32,
    rows: impl Iterator<Item = Vec<u8>>,
) -> io::Result<()> {
    write_picture(out, [width, height], ColorType::Rgb, rows)
}

/// Writes pictures of 8-bit levels as an animated PNG that repeats without end.
///
/// Programs that know no animations show the first picture.
///
/// # Errors
/// Returns an error if writing fails, if there is no picture or if one has not the size
/// `[width, height]`.
pub fn write_gray_animation(
    out: impl Write,
    [width, height]: [u32; 2],
    per_second: u16,
    pictures: impl ExactSizeIterator<Item = Vec<u8>>,
) -> io::Result<()> {
    noting_failures(out, |out| {
        let mut encoder = Encoder::new(out, width, height);
        // Zero plays are plays without end.
        encoder.set_animated(pictures.len() as u32, 0)?;
        encoder.set_frame_delay(1, per_second)?;
        let mut writer = encoder.write_header()?;
        for picture in pictures {
            writer.write_image_data(&picture)?;
        }
        writer.finish()
    })
}

fn write_picture(
    out: impl Write,
    [width, height]: [u32; 2],
    color: ColorType,
    rows: impl Iterator<Item = Vec<u8>>,
) -> io::Result<()> {
    noting_failures(out, |out| {
        let mut encoder = Encoder::new(out, width, height);
        encoder.set_color(color);
        write_rows(encoder, rows)
    })
}

/// Encodes a PNG, and returns the failure of its writer as it is.
fn noting_failures<W: Write>(
    out: W,
    encode: impl FnOnce(&mut ErrorKeepingWriter<W>) -> Result<(), EncodingError>,
) -> io::Result<()> {
    let mut out = ErrorKeepingWriter { out, failed: None };
    let written = encode(&mut out);
    written.map_err(io::Error::from).and_then(|()| out.flush()).map_err(|error| match out.failed {
        Some(kind) => io::Error::new(kind, error.to_string()),
        None => error,
    })
}

/// Writes the image row by row, so that a large image takes little memory.
fn write_rows(
    encoder: Encoder<'_, impl Write>,
    rows: impl Iterator<Item = Vec<u8>>,
) -> Result<(), EncodingError> {
    let mut writer = encoder.write_header()?;
    let mut pixels = writer.stream_writer()?;
    for row in rows {
        pixels.write_all(&row)?;
    }
    pixels.finish()?;
    writer.finish()
}

fn pixel_dims(pitch: Pitch) -> PixelDimensions {
    let [xppu, yppu] = pitch.per_metre();
    PixelDimensions { xppu, yppu, unit: Unit::Meter }
}

/// Returns the page's JSON line in ASCII, because readers of `tEXt` disagree on other bytes.
fn line(layer: &Layer) -> OpenLine {
    let mut info = layer.info.clone();
    let is_lost = |dpi: Dpi| Dpi::from_per_metre(dpi.per_metre()) != Some(dpi);
    if let Some(pitch) = layer.pitch.filter(|pitch| is_lost(pitch.x) || is_lost(pitch.y)) {
        info.other.insert(EXACT_DPI.to_owned(), json!(pitch));
    }
    OpenLine::new(&info, layer.pitch, layer.image.check(), None).into_ascii()
}

/// A writer that keeps the I/O error, which the encoder's own errors do not contain.
struct ErrorKeepingWriter<W> {
    out: W,
    failed: Option<io::ErrorKind>,
}

impl<W: Write> Write for ErrorKeepingWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes).inspect_err(|error| self.failed = Some(error.kind()))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush().inspect_err(|error| self.failed = Some(error.kind()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::png_page;
    use crate::layer::check::PageLine;
    use crate::{Limits, Mask, PageInfo, StackInfo};

    fn layer(dpi: f64, part: &str) -> Layer {
        let stack = StackInfo { part: part.to_owned(), ..StackInfo::default() };
        let info = PageInfo { index: 3, stack: Some(stack), ..PageInfo::default() };
        Layer { info, pitch: Pitch::of_dpi(dpi), image: Mask::black(8, 1).into() }
    }

    #[test]
    fn the_line_has_the_resolution_only_where_it_would_be_lost() {
        let stated =
            |dpi| line_of_file(&layer(dpi, "cube")).split_once("\"check\"").unwrap().0.to_owned();
        assert!(!stated(1500.0).contains("dpi"));
        assert_eq!(stated(72.25), stated(72.0) + "\"dpi\":72.25,");
    }

    fn line_of_file(layer: &Layer) -> String {
        CheckChain::default().close(&line(layer), true)
    }

    #[test]
    fn the_line_is_ascii_and_reads_back() {
        let layer = layer(1500.0, "Лопатка 葉 🔥 é");
        let line = line_of_file(&layer);
        assert!(line.is_ascii());
        assert_eq!(PageLine::parse(line.as_bytes()).unwrap().info, layer.info);
    }

    #[test]
    fn every_resolution_and_line_read_back() {
        for dpi in [1.0, 72.25, 203.2, 1500.0, 99_999.999] {
            // Values that another program may store under the key.
            for own in [None, Some(0.5), Some(1500.0)] {
                let mut layer = layer(dpi, "cube");
                layer.info.other.extend(own.map(|dpi| ("dpi".to_owned(), dpi.into())));
                let header =
                    png_page::header(&png_of_layer(&layer).unwrap(), &Limits::default()).unwrap();
                assert_eq!(header.pitch, layer.pitch);
                // A page that needs the key overwrites it.
                if own.is_none() || dpi.fract() == 0.0 || dpi == 203.2 {
                    assert_eq!(header.line.unwrap().info, layer.info, "{dpi} {own:?}");
                }
            }
        }
    }

    #[test]
    fn an_image_without_pixels_is_no_png() {
        let image = Image::Mask(Mask::black(0, 0));
        let layer = Layer { image: image.into(), ..layer(1500.0, "cube") };
        assert!(png_of_layer(&layer).is_err());
    }
}
