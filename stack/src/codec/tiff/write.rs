//! Encodes layers as pages and writes pages to a stream.

use std::fs::File;
use std::io::{BufWriter, IntoInnerError, Write};

use serde::{Deserialize, Serialize};

use super::page::{Page, PassedCode};
use super::tags::{
    ASCII, BITS_PER_SAMPLE, BLACK_IS_ZERO, COMPRESSION, DEFLATE, FILL_ORDER, IMAGE_DESCRIPTION,
    IMAGE_LENGTH, IMAGE_WIDTH, LONG, LONG8, NEW_SUBFILE_TYPE, ORIENTATION, PACK_BITS, PER_INCH,
    PHOTOMETRIC, PLANAR_CONFIGURATION, RATIONAL, RESOLUTION_UNIT, ROWS_PER_STRIP,
    SAMPLES_PER_PIXEL, SHORT, STRIP_BYTE_COUNTS, STRIP_OFFSETS, T6, T6_OPTIONS, X_RESOLUTION,
    Y_RESOLUTION,
};
use crate::codec::compression::Compression;
use crate::codec::{deflate, g4};
use crate::error::{GAVE_UP, StackError};
use crate::files::durable::close;
use crate::files::page_folder::PageFile;
use crate::image::Image;
use crate::layer::Layer;
use crate::layer::check::{CheckChain, CodeCheck, OpenLine};
use crate::pitch::Pitch;

/// The variant of TIFF to write.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// BigTIFF, with 64-bit offsets: any size.
    #[default]
    Big,
    /// Classic TIFF, with 32-bit offsets: at most 4 GiB.
    Classic,
}

impl Format {
    fn header(self) -> &'static [u8] {
        match self {
            // The first directory follows the header: at 16, or at 8.
            Self::Big => &[b'I', b'I', 43, 0, 8, 0, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0],
            Self::Classic => &[b'I', b'I', 42, 0, 8, 0, 0, 0],
        }
    }

    /// Appends an offset, count or link in the format's width.
    fn put_word(self, out: &mut Vec<u8>, word: u64) {
        match self {
            Self::Big => out.extend_from_slice(&word.to_le_bytes()),
            Self::Classic => out.extend_from_slice(&(word as u32).to_le_bytes()),
        }
    }

    fn word_size(self) -> usize {
        match self {
            Self::Big => 8,
            Self::Classic => 4,
        }
    }
}

/// An encoded layer whose place in the file is not known yet. Encoding is the costly part
/// of writing and does not depend on other pages.
#[derive(Clone, Debug)]
pub struct EncodedPage {
    index: u32,
    width: u32,
    height: u32,
    compression: Compression,
    pitch: Option<Pitch>,
    line: OpenLine,
    strip: Vec<u8>,
}

impl EncodedPage {
    /// Encodes a layer: a mask as G4, a gray mask as Deflate. An unchanged image keeps the strip
    /// and the check that it was read with.
    pub fn new(layer: &Layer) -> Self {
        let (compression, strip) = match (&*layer.image, layer.image.strip()) {
            (_, Some(strip)) => (strip.compression, strip.bytes.to_vec()),
            (Image::Mask(mask), None) => (Compression::G4, g4::encode(mask)),
            (Image::Gray(gray), None) => (Compression::Deflate, deflate::encode(gray)),
        };
        let code = CodeCheck::of(&layer.image, &strip);
        Self {
            index: layer.info.index,
            width: layer.image.width(),
            height: layer.image.height(),
            compression,
            pitch: layer.pitch,
            line: OpenLine::new(&layer.info, layer.pitch, layer.image.check(), Some(code)),
            strip,
        }
    }

    /// Passes a page on with its strip and its checks, [if it may](Page::passed).
    ///
    /// # Panics
    /// Panics if the page has no strip.
    pub(crate) fn passed(mut page: Page, passed: PassedCode) -> Self {
        let PassedCode { compression, image, code } = passed;
        let [width, height] = page.size();
        Self {
            index: page.info.index,
            width,
            height,
            compression,
            pitch: page.pitch,
            line: OpenLine::new(&page.info, page.pitch, image, Some(code)),
            strip: page.pieces.pop().expect("pages that pass have a strip"),
        }
    }

    /// Returns the bytes of the page at offset `start`: directory, texts, strip and padding. The
    /// link is to the byte after them, or zero if the page ends the file.
    fn bytes(&self, description: &str, format: Format, start: u64, ends_file: bool) -> Vec<u8> {
        // The directory's length does not depend on offsets, so any offsets give it.
        let directory =
            |data, link| format.directory(self.fields(description, format, data), start, link);
        let data = start + directory(0, 0).len() as u64;
        let end = (data + self.strip.len() as u64).next_multiple_of(8);
        let mut bytes = directory(data, if ends_file { 0 } else { end });
        bytes.extend_from_slice(&self.strip);
        bytes.resize((end - start) as usize, 0);
        bytes
    }

    /// Returns the fields of the directory, in the order of their tags.
    fn fields(&self, description: &str, format: Format, data: u64) -> Vec<DirectoryField> {
        let short = |tag, value: u64| (tag, SHORT, 1, (value as u16).to_le_bytes().to_vec());
        let long = |tag, value: u32| (tag, LONG, 1, value.to_le_bytes().to_vec());
        let word = |tag, value: u64| match format {
            Format::Big => (tag, LONG8, 1, value.to_le_bytes().to_vec()),
            Format::Classic => long(tag, value as u32),
        };
        let rational = |tag, (num, den): (u32, u32)| {
            (tag, RATIONAL, 1, [num.to_le_bytes(), den.to_le_bytes()].concat())
        };
        let (is_gray, compression) = match self.compression {
            Compression::PackBits => (true, PACK_BITS),
            Compression::Deflate => (true, DEFLATE),
            _ => (false, T6),
        };
        let mut fields = vec![
            // A single page of a multipage image (TIFF 6.0, section 8, NewSubfileType).
            long(NEW_SUBFILE_TYPE, 2),
            long(IMAGE_WIDTH, self.width),
            long(IMAGE_LENGTH, self.height),
            short(BITS_PER_SAMPLE, if is_gray { 8 } else { 1 }),
            short(COMPRESSION, compression),
            short(PHOTOMETRIC, BLACK_IS_ZERO),
            short(FILL_ORDER, 1),
            text_field(description),
            word(STRIP_OFFSETS, data),
            short(ORIENTATION, 1),
            short(SAMPLES_PER_PIXEL, 1),
            long(ROWS_PER_STRIP, self.height),
            word(STRIP_BYTE_COUNTS, self.strip.len() as u64),
            short(PLANAR_CONFIGURATION, 1),
        ];
        if let Some(Pitch { x, y }) = self.pitch {
            fields.push(rational(X_RESOLUTION, x.to_rational()));
            fields.push(rational(Y_RESOLUTION, y.to_rational()));
            fields.push(short(RESOLUTION_UNIT, PER_INCH));
        }
        if !is_gray {
            fields.push(long(T6_OPTIONS, 0));
        }
        // Entries must stand in the order of their tags (TIFF 6.0, section 2).
        fields.sort_by_key(|field| field.0);
        fields
    }
}

impl From<Layer> for EncodedPage {
    fn from(layer: Layer) -> Self {
        Self::new(&layer)
    }
}

/// A field of a directory: its tag, type, number of values, and values.
type DirectoryField = (u16, u16, u64, Vec<u8>);

fn text_field(text: &str) -> DirectoryField {
    let text = [text.as_bytes(), &[0]].concat();
    (IMAGE_DESCRIPTION, ASCII, text.len() as u64, text)
}

impl Format {
    /// Returns a directory at offset `start` and the texts after it, padded to 8 bytes.
    fn directory(self, fields: Vec<DirectoryField>, start: u64, link: u64) -> Vec<u8> {
        let word = self.word_size();
        let count_size = if self == Self::Big { 8 } else { 2 };
        let size = count_size + fields.len() * (4 + 2 * word) + word;
        let mut out = (fields.len() as u64).to_le_bytes()[..count_size].to_vec();
        let mut texts: Vec<u8> = Vec::new();
        let texts_start = (start + size as u64).next_multiple_of(8);
        for (tag, kind, count, mut value) in fields {
            out.extend_from_slice(&tag.to_le_bytes());
            out.extend_from_slice(&kind.to_le_bytes());
            self.put_word(&mut out, count);
            // A value that fits stands in place of its offset, at the left (TIFF 6.0, section 2).
            if value.len() <= word {
                value.resize(word, 0);
                out.extend_from_slice(&value);
            } else {
                self.put_word(&mut out, texts_start + texts.len() as u64);
                value.resize(value.len().next_multiple_of(8), 0);
                texts.extend_from_slice(&value);
            }
        }
        self.put_word(&mut out, link);
        out.resize((texts_start - start) as usize, 0);
        out.extend_from_slice(&texts);
        out
    }
}

/// The text of the page that a stage writes when it gives up: it has no image.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AbortNotice {
    pub(super) gave_up: String,
}

/// Writes pages to a stream, forward only. It holds one page back, because only the last
/// page's link is zero.
#[derive(Debug)]
pub struct PageWriter<W> {
    out: W,
    format: Format,
    offset: u64,
    chain: CheckChain,
    held: Option<EncodedPage>,
}

impl PageWriter<BufWriter<File>> {
    /// Completes the stack as [`PageWriter::finish`] does, and closes its file.
    ///
    /// # Errors
    /// Returns an error if there is no page, or writing or closing fails.
    pub fn close(self) -> Result<(), StackError> {
        let file = self.finish()?.into_inner().map_err(IntoInnerError::into_error)?;
        Ok(close(file)?)
    }
}

impl<W: Write> PageWriter<W> {
    /// Creates a writer of a stack to `out`, which should be buffered.
    pub fn new(out: W, format: Format) -> Self {
        Self { out, format, offset: 0, chain: CheckChain::default(), held: None }
    }

    /// Adds a page.
    ///
    /// # Errors
    /// Returns an error if writing fails or a classic TIFF would exceed 4 GiB.
    pub fn push(&mut self, page: EncodedPage) -> Result<(), StackError> {
        match self.held.replace(page) {
            Some(before) => self.write(&before, false),
            None => Ok(()),
        }
    }

    /// Writes the last page, flushes the stream and returns it.
    ///
    /// # Errors
    /// Returns an error in the same cases as [`push`](Self::push), or if no page was pushed.
    pub fn finish(mut self) -> Result<W, StackError> {
        let last = self.held.take().ok_or(StackError::NoLayers)?;
        self.write(&last, true)?;
        self.out.flush()?;
        Ok(self.out)
    }

    /// Writes the page held back and a page that says why no other follows, with a link to
    /// nothing: all layers so far are complete, but readers see that the stack is cut off.
    ///
    /// # Errors
    /// Returns an error if writing fails.
    pub fn give_up(mut self, reason: &str) -> Result<(), StackError> {
        if let Some(last) = self.held.take() {
            self.write(&last, false)?;
        }
        self.start()?;
        // Through several stages, the first reason goes on alone.
        let first = reason.rsplit(GAVE_UP).next().unwrap_or(reason);
        let notice = AbortNotice { gave_up: first.to_owned() };
        let text = serde_json::to_string(&notice).expect("a text is valid JSON");
        let directory = |link| self.format.directory(vec![text_field(&text)], self.offset, link);
        let end = self.offset + directory(0).len() as u64;
        self.out.write_all(&directory(end))?;
        Ok(self.out.flush()?)
    }

    fn start(&mut self) -> Result<(), StackError> {
        if self.offset == 0 {
            self.out.write_all(self.format.header())?;
            self.offset = self.format.header().len() as u64;
        }
        Ok(())
    }

    fn write(&mut self, page: &EncodedPage, last: bool) -> Result<(), StackError> {
        self.start()?;
        let description = self.chain.close(&page.line, last);
        let bytes = page.bytes(&description, self.format, self.offset, last);
        self.offset += bytes.len() as u64;
        if self.format == Format::Classic && self.offset > u64::from(u32::MAX) {
            return Err(StackError::PastClassic { layer: page.index });
        }
        self.out.write_all(&bytes)?;
        Ok(())
    }
}

/// A page as a file of its own, in a format.
impl PageFile for (EncodedPage, Format) {
    fn name(&self) -> String {
        format!("layer_{:05}.tif", self.0.index)
    }

    fn bytes(&self, chain: &mut CheckChain, is_last: bool) -> Vec<u8> {
        let (page, format) = self;
        let header = format.header();
        let description = chain.close(&page.line, is_last);
        [header, &page.bytes(&description, *format, header.len() as u64, true)].concat()
    }
}
