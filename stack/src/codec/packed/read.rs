//! Reads the pages of packed stacks, in order or by their number.

use std::collections::VecDeque;
use std::sync::Arc;

use rayon::prelude::*;

use super::blocks::unpack;
use super::frame::{
    END, FRAME, FramePage, INDEX, IndexEntry, KEY_FRAME, NOTICE, PartHeader, START_BYTES, cost,
    entries_of, most_bytes, pages_of, streams_of,
};
use super::image::{ImageFacts, decode};
use crate::codec::tiff::{ByteSource, Format, Page};
use crate::error::{PageFault, StackError};
use crate::image::Image;
use crate::layer::check::PageLine;
use crate::limits::Limits;
use crate::text::one_line;

/// Frames are decoded together up to this cost: 32 MiB of changes and rows.
const TOGETHER_COST: u64 = 8 << 20;
/// The most bytes of the reason of a stage that gave up.
const MOST_NOTICE: u32 = 1 << 16;

/// Reads a packed stack behind its signature.
#[derive(Debug)]
pub(crate) struct Unpacker {
    format: Format,
    /// Where the next frame starts.
    offset: u64,
    /// The number of pages in the frames before it.
    pages: u32,
    /// The last layer of the frames before it.
    last: Option<u32>,
    /// The frames before it, from the stack's first.
    frames: Vec<IndexEntry>,
    /// The frame read behind the decoded frames.
    ahead: Option<Result<Option<PackFrame>, StackError>>,
    /// The last image of the frames that were decoded.
    below: Option<Arc<Image>>,
    /// Pages that are decoded, and the number of the first.
    ready: VecDeque<Result<Page, StackError>>,
    first_ready: u32,
    /// Set once pages are read by their number: they stay ready then.
    by_number: bool,
}

/// A frame whose images are still packed.
#[derive(Debug)]
pub(super) struct PackFrame {
    header: PartHeader,
    first_page: u32,
    pages: Vec<(FramePage, PageLine)>,
    images: Vec<u8>,
}

impl Unpacker {
    /// Starts behind the signature and the byte of the format.
    pub(crate) fn new(format: u8) -> Self {
        Self {
            format: if format == 1 { Format::Classic } else { Format::Big },
            offset: START_BYTES,
            pages: 0,
            last: None,
            frames: Vec::new(),
            ahead: None,
            below: None,
            ready: VecDeque::new(),
            first_ready: 0,
            by_number: false,
        }
    }

    /// Returns the format of the TIFF that was packed.
    pub(crate) fn format(&self) -> Format {
        self.format
    }

    /// Returns the next page, or `None` behind the last. Without `images`, it cannot be decoded.
    pub(crate) fn next(
        &mut self,
        source: &mut ByteSource,
        limits: &Limits,
        images: bool,
    ) -> Result<Option<Page>, StackError> {
        if self.ready.is_empty() {
            self.read_ahead(source, limits, images)?;
        }
        self.first_ready += 1;
        self.ready.pop_front().transpose()
    }

    /// Returns a page of a file by its number.
    pub(crate) fn page(
        &mut self,
        number: u32,
        source: &mut ByteSource,
        limits: &Limits,
    ) -> Result<Option<Page>, StackError> {
        if !self.by_number {
            self.by_number = true;
            self.frames = self.index(source, limits)?;
            self.ready.clear();
        }
        let mut first = 0;
        // The key frame of the page, and where that starts.
        let mut key = (0, START_BYTES, 0);
        let mut offset = START_BYTES;
        for (frame, entry) in self.frames.iter().enumerate() {
            if entry.is_key {
                key = (first, offset, frame);
            }
            first += entry.pages;
            offset += entry.bytes;
            if number < first {
                break;
            }
        }
        // Pages of the same key frame are ready: reading on from there reaches the page, too.
        let is_ahead = (key.0..=number).contains(&self.first_ready) && !self.ready.is_empty();
        if !is_ahead {
            (self.pages, self.offset) = (key.0, key.1);
            (self.below, self.ahead) = (None, None);
            self.ready.clear();
            self.first_ready = key.0;
        }
        while number - self.first_ready >= self.ready.len() as u32 {
            self.first_ready += self.ready.len() as u32;
            self.ready.clear();
            self.read_ahead(source, limits, true)?;
            if self.ready.is_empty() {
                return Ok(None);
            }
        }
        match &self.ready[(number - self.first_ready) as usize] {
            Ok(page) => Ok(Some(page.clone())),
            Err(_) => {
                // An error cannot be copied, so it goes out; the next call reads its frame again.
                let mut ready = std::mem::take(&mut self.ready);
                ready.swap_remove_front((number - self.first_ready) as usize).transpose()
            }
        }
    }

    /// Decodes the next frames, as many as together take little memory.
    fn read_ahead(
        &mut self,
        source: &mut ByteSource,
        limits: &Limits,
        images: bool,
    ) -> Result<(), StackError> {
        let mut frames: Vec<PackFrame> = Vec::new();
        let mut room = TOGETHER_COST;
        // The frames behind a key frame are for one thread.
        let mut threads = if self.by_number { 1 } else { rayon::current_num_threads() };
        loop {
            let next = match self.ahead.take() {
                Some(ahead) => ahead,
                None => self.read_frame(source, limits, images),
            };
            match next {
                Ok(Some(frame)) => {
                    let cost = cost(frame.pages.iter().map(|page| &page.0.shape));
                    // The first frame is taken whatever it costs.
                    if !frames.is_empty() {
                        threads -= usize::from(frame.header.kind == KEY_FRAME);
                        if cost > room || threads == 0 || !images {
                            self.ahead = Some(Ok(Some(frame)));
                            break;
                        }
                    }
                    room = room.saturating_sub(cost);
                    frames.push(frame);
                }
                Err(error) if frames.is_empty() => return Err(error),
                // Pages before an error are whole, and come first.
                end => {
                    if !frames.is_empty() {
                        self.ahead = Some(end);
                    }
                    break;
                }
            }
        }
        if images {
            self.decode(frames, limits);
        } else {
            let pages = frames.into_iter().flat_map(|frame| frame.undecoded(*limits));
            self.ready.extend(pages.map(Ok));
        }
        Ok(())
    }

    /// Decodes frames on all threads, those behind a key frame one after the other.
    fn decode(&mut self, frames: Vec<PackFrame>, limits: &Limits) {
        let mut groups: Vec<(Option<Arc<Image>>, Vec<PackFrame>)> = Vec::new();
        for frame in frames {
            match groups.last_mut() {
                Some((_, group)) if frame.header.kind != KEY_FRAME => group.push(frame),
                None if frame.header.kind != KEY_FRAME => {
                    groups.push((self.below.take(), vec![frame]));
                }
                _ => groups.push((None, vec![frame])),
            }
        }
        let decoded: Vec<_> = groups
            .into_par_iter()
            .map(|(mut below, group)| {
                let mut pages = Vec::new();
                for frame in group {
                    frame.decode(&mut below, *limits, &mut pages);
                    // The next images are coded against the one that is missing.
                    if matches!(pages.last(), Some(Err(_))) {
                        break;
                    }
                }
                (pages, below)
            })
            .collect();
        for (pages, below) in decoded {
            self.ready.extend(pages);
            self.below = below;
        }
    }

    /// Reads the next frame, or `None` at the index.
    pub(super) fn read_frame(
        &mut self,
        source: &mut ByteSource,
        limits: &Limits,
        images: bool,
    ) -> Result<Option<PackFrame>, StackError> {
        let (header, head) = self.read_part(source, self.offset, limits)?;
        let damaged = |what| malformed(self.pages, what);
        match header.kind {
            KEY_FRAME | FRAME => {}
            INDEX => {
                let entries = entries_of(&header, &head).ok_or_else(|| damaged("index"))?;
                // The index must name the frames that were read, or one is missing or doubled.
                if entries != self.frames {
                    return Err(damaged("index"));
                }
                let end = [&(header.part_bytes() as u32).to_le_bytes()[..], &END].concat();
                let from = self.offset + header.part_bytes();
                // One byte more shows whether the file ends there.
                let found = source.read_up_to(from, end.len() as u64 + 1)?;
                return match found == end {
                    true => Ok(None),
                    false if end.starts_with(&found) => Err(self.cut_off()),
                    false => Err(damaged("end")),
                };
            }
            NOTICE if header.head <= MOST_NOTICE => {
                let text = unpack(&head, header.head as usize).ok_or_else(|| damaged("notice"))?;
                let reason = one_line(&String::from_utf8_lossy(&text));
                return Err(StackError::GivenUp { reason });
            }
            _ => return Err(damaged("frame")),
        }
        // No image lies below to code this one against.
        if header.kind == FRAME && self.pages == 0 {
            return Err(damaged("frame"));
        }
        let pages = pages_of(&header, &head, limits).ok_or_else(|| damaged("frame"))?;
        if u64::from(header.images) > most_bytes(&pages) {
            return Err(damaged("frame"));
        }
        let at = self.offset + PartHeader::BYTES + u64::from(header.head_packed);
        let packed = if images {
            let packed = source.read_up_to(at, header.images.into())?;
            if packed.len() < header.images as usize {
                return Err(self.cut_off());
            }
            packed
        } else if source.skip(at, header.images.into())? {
            Vec::new()
        } else {
            return Err(self.cut_off());
        };
        let first_page = self.pages;
        let numbers = first_page..;
        let pages: Vec<_> = pages
            .into_iter()
            .zip(numbers)
            .map(|(page, number)| {
                let line = PageLine::parse(&page.line).unwrap_or_else(|| PageLine::without(number));
                (page, line)
            })
            .collect();
        self.last = pages.last().map(|(_, line)| line.info.index);
        self.offset += header.part_bytes();
        self.pages = self.pages.saturating_add(header.count);
        if !self.by_number {
            let is_key = header.kind == KEY_FRAME;
            let bytes = header.part_bytes();
            self.frames.push(IndexEntry { is_key, pages: header.count, bytes });
        }
        Ok(Some(PackFrame { header, first_page, pages, images: packed }))
    }

    /// Reads the header and the packed head of a part.
    fn read_part(
        &self,
        source: &mut ByteSource,
        offset: u64,
        limits: &Limits,
    ) -> Result<(PartHeader, Vec<u8>), StackError> {
        let damaged = || malformed(self.pages, "frame");
        let bytes = source.read_up_to(offset, PartHeader::BYTES)?;
        if bytes.len() as u64 != PartHeader::BYTES {
            return Err(self.cut_off());
        }
        let header = PartHeader::of(&bytes).ok_or_else(damaged)?;
        let most = limits.field_bytes.saturating_mul(super::KEY_LAYERS.into());
        if u64::from(header.head_packed) > most {
            return Err(damaged());
        }
        let length = u64::from(header.head_packed);
        let head = source.read_up_to(offset + PartHeader::BYTES, length)?;
        if (head.len() as u64) < length {
            return Err(self.cut_off());
        }
        if header.crc(&head) != header.head_crc {
            return Err(damaged());
        }
        Ok((header, head))
    }

    /// Returns the frames of a file: from its index, or if it has none, by going through them.
    fn index(
        &self,
        source: &mut ByteSource,
        limits: &Limits,
    ) -> Result<Vec<IndexEntry>, StackError> {
        if let Some(entries) = self.stored_index(source, limits)? {
            return Ok(entries);
        }
        let (mut entries, mut offset) = (Vec::new(), START_BYTES);
        while let Ok((header, _)) = self.read_part(source, offset, limits) {
            if !matches!(header.kind, KEY_FRAME | FRAME) {
                break;
            }
            let bytes = header.part_bytes();
            entries.push(IndexEntry {
                is_key: header.kind == KEY_FRAME,
                pages: header.count,
                bytes,
            });
            offset += bytes;
        }
        Ok(entries)
    }

    /// Returns the index at the end of a file, if it is there.
    fn stored_index(
        &self,
        source: &mut ByteSource,
        limits: &Limits,
    ) -> Result<Option<Vec<IndexEntry>>, StackError> {
        let Some(end) = source.length()?.and_then(|length| length.checked_sub(8)) else {
            return Ok(None);
        };
        let bytes = source.read_up_to(end, 8)?;
        let Some((length, mark)) = bytes.split_first_chunk::<4>() else { return Ok(None) };
        let start = end.checked_sub(u32::from_le_bytes(*length).into());
        let Some(start) = start.filter(|_| *mark == END) else { return Ok(None) };
        let part = self.read_part(source, start, limits).ok();
        let part = part.filter(|(header, _)| header.kind == INDEX);
        let entries = part.and_then(|(header, head)| entries_of(&header, &head));
        // Frames reach from the file's start to the index.
        let reach = |entries: &Vec<IndexEntry>| {
            // The sizes in a damaged index may pass 64 bits.
            let bytes = entries.iter().map(|entry| u128::from(entry.bytes)).sum::<u128>();
            let pages = entries.iter().map(|entry| u64::from(entry.pages)).sum::<u64>();
            bytes + u128::from(START_BYTES) == u128::from(start) && pages <= u64::from(u32::MAX)
        };
        Ok(entries.filter(reach))
    }

    fn cut_off(&self) -> StackError {
        StackError::CutOff { last_whole: self.last }
    }
}

fn malformed(page: u32, part: &'static str) -> StackError {
    StackError::Malformed { page, fault: PageFault::Packed(part) }
}

impl PackFrame {
    pub(super) fn page_count(&self) -> usize {
        self.pages.len()
    }

    /// Returns the frame if its images are as they were written.
    pub(super) fn checked(self) -> Result<Self, StackError> {
        match crc32fast::hash(&self.images) == self.header.images_crc {
            true => Ok(self),
            false => Err(malformed(self.first_page, "images")),
        }
    }

    /// Returns its kind, the shapes of its images, and these as they are packed.
    pub(super) fn into_parts(self) -> (u8, Vec<ImageFacts>, Vec<u8>) {
        let shapes = self.pages.into_iter().map(|(page, _)| page.shape).collect();
        (self.header.kind, shapes, self.images)
    }

    /// Returns each page's part of the bytes of the packed images.
    fn shares(&self) -> Vec<u64> {
        let (bytes, count) = (u64::from(self.header.images), self.pages.len() as u64);
        // Differences of rounded sums, so that the shares add up to the bytes.
        (0..count).map(|page| bytes * (page + 1) / count - bytes * page / count).collect()
    }

    /// Returns the pages without their images.
    fn undecoded(self, limits: Limits) -> impl Iterator<Item = Page> {
        let shares = self.shares();
        let numbers = self.first_page..;
        self.pages.into_iter().zip(shares).zip(numbers).map(
            move |(((page, line), share), number)| {
                Page::of_packed(number, limits, &page.shape.into(), line, share, None, None)
            },
        )
    }

    /// Decodes the pages, the first against `below`, which becomes the last image.
    fn decode(
        self,
        below: &mut Option<Arc<Image>>,
        limits: Limits,
        to: &mut Vec<Result<Page, StackError>>,
    ) {
        let shares = self.shares();
        let Self { header, first_page, pages, images } = self;
        let (pages, lines): (Vec<_>, Vec<_>) = pages.into_iter().unzip();
        let Some(streams) = streams_of(&header, &pages, &images) else {
            to.push(Err(malformed(first_page, "images")));
            return;
        };
        let mut from = streams.cursor();
        if header.kind == KEY_FRAME {
            *below = None;
        }
        let count = pages.len();
        let numbers = first_page..;
        for (k, (((page, line), share), number)) in
            pages.iter().zip(lines).zip(shares).zip(numbers).enumerate()
        {
            let decoded = decode(&page.shape, below.as_deref(), &mut from);
            // Bytes that no image needed are damage.
            let decoded = decoded.filter(|_| k + 1 < count || from.is_at_end());
            let Some((image, strip)) = decoded else {
                to.push(Err(malformed(number, "image")));
                return;
            };
            let image = Arc::new(image);
            *below = Some(Arc::clone(&image));
            let shape = page.shape.into();
            to.push(Ok(Page::of_packed(number, limits, &shape, line, share, Some(image), strip)));
        }
    }
}
