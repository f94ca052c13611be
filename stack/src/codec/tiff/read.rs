//! Reads pages from a stream or a file.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::fs::File;
use std::io::{BufReader, Read};

use super::fields::{Fields, KNOWN, number};
use super::page::Page;
use super::source::ByteSource;
use super::tags::{
    BYTE, FILL_ORDER, LONG, MASK, NEW_SUBFILE_TYPE, OLD_REDUCED, REDUCED, SHORT, SUB_IFDS,
    SUBFILE_TYPE, type_size,
};
use super::write::{AbortNotice, Format};
use crate::codec::compression::Compression;
use crate::codec::packed::{self, Unpacker};
use crate::codec::picture_format::PictureFormat;
use crate::codec::picture_page;
use crate::codec::png_page;
use crate::error::{PageFault, StackError, malformed};
use crate::files::file_format::{FORMAT_BYTES, FileFormat};
use crate::limits::Limits;
use crate::note::ImagesBeside;
use crate::printer::archive::read::ArchiveReader;
use crate::printer::ctb::read::CtbReader;
use crate::printer::fault::PrinterFault;
use crate::printer::goo::read::GooReader;
use crate::text::one_line;

/// Reads pages in order from a stream (forward only) or a file (parts in any order). A
/// PNG or another picture file is a single page.
#[derive(Debug)]
pub struct PageReader {
    source: ByteSource,
    limits: Limits,
    kind: FileKind,
    /// Whether the data of images is read, too.
    images: bool,
    big: bool,
    little_endian: bool,
    /// The offset of the next directory; 0 after the last page.
    next: u64,
    number: u32,
    last_whole: Option<u32>,
    /// The images passed over.
    beside: ImagesBeside,
    /// Whether a layer was read.
    has_layer: bool,
    /// The offsets of the directories read, to detect a loop of links.
    seen: HashSet<u64>,
}

/// Returns the error of an input that starts with these bytes and is no stack.
fn not_tiff(start: Vec<u8>, mut source: ByteSource) -> StackError {
    let size = source.length().ok().flatten();
    // The bytes only help to name the format, so a failure here does not count.
    let more = source.read_up_to(start.len() as u64, (FORMAT_BYTES - start.len()) as u64);
    let bytes = [&start[..], &more.unwrap_or_default()].concat();
    // Without its size, a text that ends early is whole.
    let size = size.or((bytes.len() < FORMAT_BYTES).then_some(bytes.len() as u64));
    StackError::NotTiff { format: FileFormat::of_start(&bytes, size), start }
}

impl PageReader {
    /// Reads from a stream, such as standard input.
    ///
    /// # Errors
    /// Returns an error if the stream is empty or does not start as a TIFF or a picture.
    pub fn from_stream(stream: impl Read + Send + 'static) -> Result<Self, StackError> {
        let stream = BufReader::with_capacity(1 << 18, Box::new(stream) as Box<dyn Read + Send>);
        Self::new(ByteSource::Stream { stream, position: 0 })
    }

    /// Reads from a file.
    ///
    /// # Errors
    /// Returns an error if the file is empty or does not start as a TIFF or a picture.
    pub fn from_file(file: File) -> Result<Self, StackError> {
        Self::new(ByteSource::File { file: BufReader::with_capacity(1 << 18, file), position: 0 })
    }

    /// Replaces the default limits of the reader.
    pub fn with_limits(self, limits: Limits) -> Self {
        Self { limits: limits.within_images(), ..self }
    }

    fn new(mut source: ByteSource) -> Result<Self, StackError> {
        let mut start = source.read_up_to(0, 8)?;
        if start.is_empty() {
            return Err(StackError::Empty);
        }
        let kind = match FileKind::of_start(&start) {
            FileKind::Packed(_) => {
                let format = source.read_up_to(8, 1)?;
                let format = format.first().ok_or(StackError::CutOff { last_whole: None })?;
                FileKind::Packed(Box::new(Unpacker::new(*format)))
            }
            FileKind::Tiff if ArchiveReader::is_start(&start) => {
                let file = source.file()?.ok_or(PrinterFault::Piped("a ZIP archive"))?;
                let archive = ArchiveReader::new(file)?;
                archive.map_or(FileKind::Tiff, |archive| FileKind::Archive(Box::new(archive)))
            }
            FileKind::Tiff if CtbReader::is_start(&start) => {
                FileKind::Ctb(Box::new(CtbReader::new(&mut source, &start)?))
            }
            kind => kind,
        };
        let (little_endian, big) = match start.as_slice() {
            [b'I', b'I', 42, 0, ..] => (true, false),
            [b'M', b'M', 0, 42, ..] => (false, false),
            [b'I', b'I', 43, 0, ..] => (true, true),
            [b'M', b'M', 0, 43, ..] => (false, true),
            _ if !matches!(kind, FileKind::Tiff) => (false, false),
            // The signature of a TIFF or a PNG is cut off.
            [b'I']
            | [b'I', b'I']
            | [b'I', b'I', 42 | 43]
            | [b'M']
            | [b'M', b'M']
            | [b'M', b'M', 0] => {
                return Err(StackError::CutOff { last_whole: None });
            }
            start
                if png_page::SIGNATURE.starts_with(start)
                    || packed::SIGNATURE.starts_with(start) =>
            {
                return Err(StackError::CutOff { last_whole: None });
            }
            _ => return Err(not_tiff(start, source)),
        };
        let next = if matches!(kind, FileKind::Tiff) {
            // BigTIFF has the size of offsets before the first link.
            if big {
                start = source.read_up_to(8, 8)?;
            } else {
                start.drain(..4.min(start.len()));
            }
            if start.len() < if big { 8 } else { 4 } {
                return Err(StackError::CutOff { last_whole: None });
            }
            number(&start, little_endian)
        } else {
            // Not zero, which would mean that no page follows.
            start.len() as u64
        };
        Ok(Self {
            source,
            limits: Limits::default(),
            kind,
            images: true,
            big,
            little_endian,
            next,
            number: 0,
            last_whole: None,
            beside: ImagesBeside::default(),
            has_layer: false,
            seen: HashSet::new(),
        })
    }

    /// Passes over the data of images: the pages cannot be decoded.
    pub(crate) fn without_images(self) -> Self {
        Self { source: self.source.reading_little_ahead(), images: false, ..self }
    }

    /// Returns where [`at_place`](Self::at_place) finds the next page: the offset of its
    /// directory, or in a packed stack or a printer's file its number.
    pub(crate) fn next_place(&self) -> u64 {
        match self.kind {
            FileKind::Packed(_) | FileKind::Goo(_) | FileKind::Ctb(_) | FileKind::Archive(_) => {
                self.number.into()
            }
            _ => self.next,
        }
    }

    /// Reads the page of a file at a place.
    pub(crate) fn at_place(&mut self, place: u64) -> Result<Option<Page>, StackError> {
        match &mut self.kind {
            FileKind::Packed(unpacker) => {
                return unpacker.page(place as u32, &mut self.source, &self.limits);
            }
            FileKind::Goo(goo) => return goo.page(place as u32, &mut self.source, &self.limits),
            FileKind::Ctb(ctb) => return ctb.page(place as u32, &mut self.source, &self.limits),
            FileKind::Archive(archive) => return archive.page(place as u32, &self.limits, true),
            _ => {}
        }
        // A page that is asked for again is no loop.
        self.seen.clear();
        self.next = place;
        self.next().transpose()
    }

    /// Returns the format of the TIFF that was packed, of a packed stack.
    pub(crate) fn packed_format(&self) -> Option<Format> {
        match &self.kind {
            FileKind::Packed(unpacker) => Some(unpacker.format()),
            _ => None,
        }
    }

    /// Numbers the pages from `first`, after the layer `last_whole`, for a folder's later files.
    pub(crate) fn numbered(mut self, first: u32, last_whole: Option<u32>) -> Self {
        self.number_from(first, last_whole);
        self
    }

    /// Numbers the pages from `first`, after the layer `last_whole`.
    pub(crate) fn number_from(&mut self, first: u32, last_whole: Option<u32>) {
        self.number = first;
        self.last_whole = last_whole;
    }

    /// Returns the images passed over, which are no layers.
    pub(crate) fn beside(&self) -> &ImagesBeside {
        &self.beside
    }

    /// Returns the format of a TIFF, or of the one that was packed.
    pub(crate) fn format(&self) -> Format {
        match &self.kind {
            FileKind::Packed(unpacker) => unpacker.format(),
            FileKind::Tiff if !self.big => Format::Classic,
            _ => Format::Big,
        }
    }

    fn read_page(&mut self) -> Result<Option<Page>, StackError> {
        let (page, next) = match &mut self.kind {
            FileKind::Packed(unpacker) => {
                match unpacker.next(&mut self.source, &self.limits, self.images)? {
                    Some(page) => (page, self.next),
                    None => return Ok(None),
                }
            }
            FileKind::Goo(goo) => match goo.next(&mut self.source, &self.limits, self.images)? {
                Some(page) => (page, self.next),
                None => return Ok(None),
            },
            FileKind::Ctb(ctb) => match ctb.next(&mut self.source, &self.limits, self.images)? {
                Some(page) => (page, self.next),
                None => return Ok(None),
            },
            FileKind::Archive(archive) => match archive.next(&self.limits, self.images)? {
                Some(page) => (page, self.next),
                None => return Ok(None),
            },
            FileKind::Tiff => match self.read_tiff_page()? {
                Some(page) => page,
                None if self.has_layer => return Ok(None),
                None => return Err(StackError::NoLayerImage(self.beside)),
            },
            FileKind::Png => (self.read_png()?, 0),
            FileKind::Picture { format, start } => {
                let (format, start) = (*format, start.clone());
                (self.read_picture(format, start)?, 0)
            }
        };
        self.next = next;
        self.number += 1;
        self.last_whole = Some(page.info.index);
        self.has_layer = true;
        Ok(Some(page))
    }

    /// Reads the next page that is a layer and the link after it.
    fn read_tiff_page(&mut self) -> Result<Option<(Page, u64)>, StackError> {
        while self.next != 0 {
            if !self.seen.insert(self.next) {
                return Err(malformed(self.number, PageFault::Loop));
            }
            let (entries, next) = self.read_directory()?;
            if self.is_beside(&entries) {
                self.next = next;
                continue;
            }
            let fields = self.read_values(&entries)?;
            if let Some(reason) = fields.description().and_then(given_up) {
                return Err(StackError::GivenUp { reason });
            }
            return Ok(Some((self.read_pieces(&fields, next)?, next)));
        }
        Ok(None)
    }

    /// Counts the images that are no layers: the image of a directory, or the images below it.
    fn is_beside(&mut self, entries: &[DirectoryEntry]) -> bool {
        let value = |tag| {
            let entry = entries.iter().find(|entry| entry.tag == tag)?;
            let is_number = matches!(entry.kind, BYTE | SHORT | LONG) && entry.count == 1;
            let value = entry.value.get(..type_size(entry.kind) as usize)?;
            is_number.then(|| number(value, self.little_endian))
        };
        let kind = value(NEW_SUBFILE_TYPE).unwrap_or(0);
        let is_mask = kind & MASK != 0;
        let is_reduced = kind & REDUCED != 0 || value(SUBFILE_TYPE) == Some(OLD_REDUCED);
        if is_mask {
            self.beside.masks += 1;
        } else if is_reduced {
            self.beside.reduced += 1;
        } else if let Some(below) = entries.iter().find(|entry| entry.tag == SUB_IFDS) {
            self.beside.sub_images = self.beside.sub_images.saturating_add(below.count);
        }
        is_mask || is_reduced
    }

    /// Reads exactly `length` bytes at `offset`.
    fn read(&mut self, offset: u64, length: u64) -> Result<Vec<u8>, StackError> {
        if !self.source.reaches(offset) {
            return Err(StackError::NotForward { page: self.number });
        }
        let bytes = self.source.read_up_to(offset, length)?;
        if (bytes.len() as u64) < length {
            return Err(StackError::CutOff { last_whole: self.last_whole });
        }
        Ok(bytes)
    }

    /// Reads the directory's entries and the link to the next directory.
    fn read_directory(&mut self) -> Result<(Vec<DirectoryEntry>, u64), StackError> {
        let (count_size, entry_size, word) = if self.big { (8, 20, 8) } else { (2, 12, 4) };
        let count = number(&self.read(self.next, count_size)?, self.little_endian);
        if count > self.limits.directory_entries {
            return Err(malformed(self.number, PageFault::Entries(count)));
        }
        let bytes = self.read(self.next + count_size, count * entry_size + word)?;
        let (entries, link) = bytes.split_at((count * entry_size) as usize);
        let entries = entries
            .chunks_exact(entry_size as usize)
            .map(|entry| DirectoryEntry {
                tag: number(&entry[..2], self.little_endian) as u16,
                kind: number(&entry[2..4], self.little_endian) as u16,
                count: number(&entry[4..4 + word as usize], self.little_endian),
                value: entry[4 + word as usize..].to_vec(),
            })
            .collect();
        Ok((entries, number(link, self.little_endian)))
    }

    /// Reads the values of the known fields, in the order of their offsets, because a stream
    /// cannot go back.
    fn read_values(&mut self, entries: &[DirectoryEntry]) -> Result<Fields, StackError> {
        let mut fields = Fields {
            page: self.number,
            little_endian: self.little_endian,
            limits: self.limits,
            values: BTreeMap::new(),
        };
        let mut distant = Vec::new();
        let mut seen = BTreeSet::new();
        // Of several entries of one tag, the first counts, as in libtiff.
        let first = |entry: &&DirectoryEntry| KNOWN.contains(&entry.tag) && seen.insert(entry.tag);
        for entry in entries.iter().filter(first) {
            let length = entry.count.saturating_mul(type_size(entry.kind));
            if length > self.limits.field_bytes {
                let fault = PageFault::TagBytes { tag: entry.tag, bytes: length };
                return Err(malformed(self.number, fault));
            }
            if length <= entry.value.len() as u64 {
                let value = entry.value[..length as usize].to_vec();
                fields.values.insert(entry.tag, (entry.kind, value));
            } else {
                distant.push((number(&entry.value, self.little_endian), length, entry));
            }
        }
        distant.sort_by_key(|value| value.0);
        for (offset, length, entry) in distant {
            fields.values.insert(entry.tag, (entry.kind, self.read(offset, length)?));
        }
        Ok(fields)
    }

    fn read_pieces(&mut self, fields: &Fields, next: u64) -> Result<Page, StackError> {
        let mut page = fields.page()?;
        let mut places = fields.places(&page.layout)?;
        self.find_lengths(&mut places, &page, next)?;
        let bytes = places.iter().fold(0u64, |sum, (_, length)| sum.saturating_add(*length));
        if bytes > page.layout.most_bytes() {
            return Err(malformed(self.number, PageFault::PieceBytes(bytes)));
        }
        page.data_bytes = bytes;
        let count = places.len();
        page.layout
            .check_unwritten(places.iter().filter(|place| **place == (0, 0)).count(), &self.limits)
            .map_err(|fault| malformed(self.number, fault))?;
        // A piece without a place was not written: its pixels are zero.
        let places = places.into_iter().enumerate().filter(|(_, place)| *place != (0, 0));
        let mut places: Vec<_> = places.collect();
        if !self.images {
            return self.skip_pieces(&places).map(|()| page);
        }
        page.pieces = vec![Vec::new(); count];
        // Offsets in increasing order can be read from a stream.
        places.sort_by_key(|(_, (offset, _))| *offset);
        // FillOrder 2: the first pixel is in the lowest bit.
        let reversed = fields.number_or(FILL_ORDER, 1)? == 2;
        let mut end = 0;
        for (i, (offset, length)) in places {
            // Overlapping strips could take more memory than the file's size.
            if offset < end {
                return Err(malformed(self.number, PageFault::Overlap));
            }
            end = offset.saturating_add(length);
            let mut piece = self.read(offset, length)?;
            if reversed {
                piece.iter_mut().for_each(|byte| *byte = byte.reverse_bits());
            }
            page.pieces[i] = piece;
        }
        Ok(page)
    }

    /// Finds the lengths that a directory does not state: for plain pixels by their number, for
    /// others up to the next data in the file.
    fn find_lengths(
        &self,
        places: &mut [(u64, u64)],
        page: &Page,
        next: u64,
    ) -> Result<(), StackError> {
        if places.iter().all(|&(offset, length)| length > 0 || offset == 0) {
            return Ok(());
        }
        let mut starts: Vec<u64> = places.iter().map(|(offset, _)| *offset).collect();
        starts.extend([self.next, next]);
        if page.compression() != Compression::Uncompressed {
            let end = self.source.length()?;
            starts.push(end.ok_or(StackError::NotForward { page: self.number })?);
        }
        starts.sort_unstable();
        let stated = places.iter().fold(0u64, |sum, (_, length)| sum.saturating_add(*length));
        // Guessed lengths together stay within what any coding needs.
        let mut most = page.layout.most_bytes().saturating_sub(stated);
        for (i, (offset, length)) in places.iter_mut().enumerate() {
            if *length > 0 || *offset == 0 {
                continue;
            }
            *length = match page.compression() {
                Compression::Uncompressed => page.layout.plain_bytes(i, page.is_gray()),
                _ => {
                    let end = starts.get(starts.partition_point(|start| *start <= *offset));
                    end.ok_or(StackError::CutOff { last_whole: self.last_whole })? - *offset
                }
            };
            *length = (*length).min(most);
            most -= *length;
        }
        Ok(())
    }

    /// Passes over strips or tiles, in the order of their offsets. They must be there.
    fn skip_pieces(&mut self, places: &[(usize, (u64, u64))]) -> Result<(), StackError> {
        for &(_, (offset, length)) in places {
            if !self.source.reaches(offset) {
                return Err(StackError::NotForward { page: self.number });
            }
            if !self.source.skip(offset, length)? {
                return Err(StackError::CutOff { last_whole: self.last_whole });
            }
        }
        Ok(())
    }

    /// Reads the file up to its last chunk, as one page.
    fn read_png(&mut self) -> Result<Page, StackError> {
        let mut file = png_page::SIGNATURE.to_vec();
        loop {
            let head = self.read(file.len() as u64, 8)?;
            let (length, kind) = (number(&head[..4], false), &head[4..]);
            // The types of chunks are letters (PNG, section 5.3).
            if !kind.iter().all(u8::is_ascii_alphabetic) {
                return Err(malformed(self.number, PageFault::PngGap));
            }
            file.extend_from_slice(&head);
            let most = self.limits.png_bytes;
            if file.len() as u64 + length > most {
                return Err(malformed(self.number, PageFault::PngBytes(most)));
            }
            // The data and its checksum.
            let body = self.read(file.len() as u64, length + 4)?;
            file.extend_from_slice(&body);
            if kind == b"IEND" {
                break;
            }
        }
        let header =
            png_page::header(&file, &self.limits).map_err(|fault| fault.on(self.number))?;
        Ok(Page::of_picture(self.number, self.limits, Compression::Png, header, file))
    }

    /// Reads the rest of the file as one page.
    fn read_picture(
        &mut self,
        format: PictureFormat,
        mut file: Vec<u8>,
    ) -> Result<Page, StackError> {
        let most = self.limits.png_bytes;
        let rest = self.source.read_up_to(file.len() as u64, most)?;
        file.extend_from_slice(&rest);
        if file.len() as u64 > most {
            return Err(malformed(self.number, PageFault::PictureFileBytes(most)));
        }
        let header = picture_page::header(format, &file, &self.limits)
            .map_err(|fault| fault.on(self.number))?;
        let compression = Compression::Picture(format);
        Ok(Page::of_picture(self.number, self.limits, compression, header, file))
    }
}

/// The kind of a file by its first bytes.
#[derive(Debug)]
enum FileKind {
    /// A TIFF, or nothing that is read.
    Tiff,
    Png,
    Packed(Box<Unpacker>),
    Goo(Box<GooReader>),
    Ctb(Box<CtbReader>),
    Archive(Box<ArchiveReader>),
    /// Another picture, with its first bytes, which a stream gives only once.
    Picture {
        format: PictureFormat,
        start: Vec<u8>,
    },
}

impl FileKind {
    fn of_start(start: &[u8]) -> Self {
        match PictureFormat::of_start(start) {
            Some(format) => Self::Picture { format, start: start.to_owned() },
            None if start == png_page::SIGNATURE => Self::Png,
            None if start == packed::SIGNATURE => Self::Packed(Box::new(Unpacker::new(0))),
            None if GooReader::is_start(start) => Self::Goo(Box::new(GooReader::new(start))),
            None => Self::Tiff,
        }
    }
}

impl Iterator for PageReader {
    type Item = Result<Page, StackError>;

    /// Returns the next page, or `None` after an error.
    fn next(&mut self) -> Option<Self::Item> {
        if self.next == 0 {
            return None;
        }
        let page = self.read_page();
        if !matches!(page, Ok(Some(_))) {
            self.next = 0;
        }
        page.transpose()
    }
}

/// Returns the reason in the text of a page that a stage writes when it gives up.
fn given_up(text: &[u8]) -> Option<String> {
    // Nearly all texts are others: they are not parsed twice.
    if !text.starts_with(b"{\"gave_up\":") {
        return None;
    }
    let AbortNotice { gave_up } = serde_json::from_slice(text).ok()?;
    Some(one_line(&gave_up))
}

struct DirectoryEntry {
    tag: u16,
    kind: u16,
    count: u64,
    /// The value itself if it fits, otherwise its offset.
    value: Vec<u8>,
}
