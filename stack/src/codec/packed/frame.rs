//! Frames, the index behind them, and the other parts of a packed file.

use super::blocks::{self, Packer};
use super::image::{ImageFacts, Mode};
use super::numbers;
use super::streams::Streams;
use super::{FRAME_COST, KEY_LAYERS, MOST_ROWS};
use crate::limits::Limits;

/// The bytes before the first frame: the signature and the format of the TIFF.
pub(super) const START_BYTES: u64 = 9;
/// The last bytes of a packed stack, after the length of the index.
pub(super) const END: [u8; 4] = *b"PMAL";

/// The kind of a part of the file, by its first byte.
pub(super) const INDEX: u8 = 0;
pub(super) const KEY_FRAME: u8 = 1;
pub(super) const FRAME: u8 = 2;
pub(super) const NOTICE: u8 = 3;

/// The header of a part of the file: its kind, a count (of pages in a frame, of frames in an
/// index), three sizes in bytes and two checks, each in four bytes, low byte first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PartHeader {
    pub(super) kind: u8,
    pub(super) count: u32,
    /// The head as it stands in the file.
    pub(super) head_packed: u32,
    /// The head before it was packed.
    pub(super) head: u32,
    /// The packed images.
    pub(super) images: u32,
    /// The CRC-32 of the packed images.
    pub(super) images_crc: u32,
    /// The CRC-32 of the fields above and the packed head.
    pub(super) head_crc: u32,
}

impl PartHeader {
    pub(super) const BYTES: u64 = 25;

    pub(super) fn of(bytes: &[u8]) -> Option<Self> {
        let (&kind, fields) = bytes.split_first()?;
        let fields: &[[u8; 4]; 6] = fields.as_chunks::<4>().0.first_chunk()?;
        let [count, head_packed, head, images, images_crc, head_crc] =
            fields.map(u32::from_le_bytes);
        Some(Self { kind, count, head_packed, head, images, images_crc, head_crc })
    }

    fn bytes(&self) -> Vec<u8> {
        let Self { kind, count, head_packed, head, images, images_crc, head_crc } = *self;
        let fields = [count, head_packed, head, images, images_crc, head_crc];
        [&[kind][..], fields.map(u32::to_le_bytes).as_flattened()].concat()
    }

    /// Returns the CRC-32 that `head_crc` must be.
    pub(super) fn crc(&self, packed_head: &[u8]) -> u32 {
        let fields = self.bytes();
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(&fields[..fields.len() - 4]);
        hasher.update(packed_head);
        hasher.finalize()
    }

    /// Returns the number of bytes of the whole part.
    pub(super) fn part_bytes(&self) -> u64 {
        Self::BYTES + u64::from(self.head_packed) + u64::from(self.images)
    }
}

/// Puts a part together.
pub(super) fn part(
    kind: u8,
    count: u32,
    head: &[u8],
    images: &[u8],
    packer: &mut Packer,
) -> Vec<u8> {
    let packed = packer.pack(head);
    let size = |bytes: &[u8]| u32::try_from(bytes.len()).expect("a frame ends far below 4 GiB");
    let mut header = PartHeader {
        kind,
        count,
        head_packed: size(&packed),
        head: size(head),
        images: size(images),
        images_crc: crc32fast::hash(images),
        head_crc: 0,
    };
    header.head_crc = header.crc(&packed);
    [&header.bytes(), &packed, images].concat()
}

/// A page of a frame: its line and the facts of its image.
#[derive(Clone, Debug)]
pub(super) struct FramePage {
    pub(super) shape: ImageFacts,
    pub(super) line: Vec<u8>,
}

/// Bits of the byte that a page's entry starts with; the lowest two are its mode.
const GRAY: u8 = 4;
/// The size differs from the size of the page before.
const OTHER_SIZE: u8 = 8;

/// Returns the head of a frame: an entry for each page, then their lines.
pub(super) fn head_of(pages: &[FramePage]) -> Vec<u8> {
    let mut out = Vec::new();
    // No image has a side of 0, so the first page states its size.
    let mut size = [0; 2];
    for FramePage { shape, line } in pages {
        let mode = match shape.mode {
            Mode::Below => 0,
            Mode::Above => 1,
            Mode::Strip => 2,
            Mode::Bits => 3,
        };
        let is_other = shape.size != size;
        let flag = |is_set: bool, bit| if is_set { bit } else { 0 };
        out.push(mode | flag(shape.gray, GRAY) | flag(is_other, OTHER_SIZE));
        if is_other {
            size = shape.size;
            size.iter().for_each(|&side| numbers::put(&mut out, side.into()));
        }
        numbers::put(&mut out, shape.changes.into());
        numbers::put(&mut out, line.len() as u64);
    }
    pages.iter().for_each(|page| out.extend_from_slice(&page.line));
    out
}

/// Reads the head of a frame. Returns `None` if it is damaged or passes a limit.
pub(super) fn pages_of(
    header: &PartHeader,
    packed_head: &[u8],
    limits: &Limits,
) -> Option<Vec<FramePage>> {
    // An entry is a byte and up to four numbers, far below 64 bytes, and a line.
    let most = u64::from(header.count).saturating_mul(limits.field_bytes + 64);
    if !(1..=KEY_LAYERS).contains(&header.count) || u64::from(header.head) > most {
        return None;
    }
    let head = blocks::unpack(packed_head, header.head as usize)?;
    let mut rest = &head[..];
    let mut pages = Vec::new();
    let mut size = [0; 2];
    for _ in 0..header.count {
        let flags = *rest.split_off_first()?;
        let mode = match flags & 3 {
            0 => Mode::Below,
            1 => Mode::Above,
            2 => Mode::Strip,
            _ => Mode::Bits,
        };
        if flags & OTHER_SIZE != 0 {
            size = [numbers::take_u32(&mut rest)?, numbers::take_u32(&mut rest)?];
        }
        let changes = numbers::take_u32(&mut rest)?;
        let length = numbers::take_u32(&mut rest)?;
        let shape = ImageFacts { mode, gray: flags & GRAY != 0, size, changes };
        let is_size = size.iter().all(|side| (1..=limits.side).contains(side));
        let is_short = u64::from(length) <= limits.field_bytes;
        if !is_size || size[1] > MOST_ROWS || changes as usize > limits.runs || !is_short {
            return None;
        }
        pages.push((shape, length as usize));
    }
    // An image alone may cost more, for nothing divides it.
    if pages.len() > 1 && cost(pages.iter().map(|page| &page.0)) > FRAME_COST {
        return None;
    }
    let mut with_lines = Vec::new();
    for (shape, length) in pages {
        let (line, after) = rest.split_at_checked(length)?;
        rest = after;
        with_lines.push(FramePage { shape, line: line.to_vec() });
    }
    rest.is_empty().then_some(with_lines)
}

/// Returns the changes and rows of images together.
pub(super) fn cost<'a>(shapes: impl Iterator<Item = &'a ImageFacts>) -> u64 {
    shapes.map(|shape| u64::from(shape.changes) + u64::from(shape.size[1])).sum()
}

/// Unpacks the images of a frame. Returns `None` if they are damaged.
pub(super) fn streams_of(
    header: &PartHeader,
    pages: &[FramePage],
    packed: &[u8],
) -> Option<Streams> {
    if crc32fast::hash(packed) != header.images_crc {
        return None;
    }
    let most = usize::try_from(most_bytes(pages)).ok()?;
    blocks::unpack_streams(packed, most)
}

/// Returns how many bytes the images of a frame may take, packed or not: a change takes at most a
/// token and three numbers of five bytes, a strip less.
pub(super) fn most_bytes(pages: &[FramePage]) -> u64 {
    16 * cost(pages.iter().map(|page| &page.shape)) + (1 << 16)
}

/// An entry of the index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct IndexEntry {
    pub(super) is_key: bool,
    pub(super) pages: u32,
    /// The number of bytes of the frame.
    pub(super) bytes: u64,
}

/// Returns the index and the end of the file.
pub(super) fn index(entries: &[IndexEntry], packer: &mut Packer) -> Vec<u8> {
    let mut head = Vec::new();
    for entry in entries {
        numbers::put(&mut head, u64::from(entry.pages) << 1 | u64::from(entry.is_key));
        numbers::put(&mut head, entry.bytes);
    }
    let count = u32::try_from(entries.len()).expect("a frame has a page, and pages are counted so");
    let mut out = part(INDEX, count, &head, &[], packer);
    let length = out.len() as u32;
    out.extend_from_slice(&length.to_le_bytes());
    out.extend_from_slice(&END);
    out
}

/// Reads the index. Returns `None` if it is damaged.
pub(super) fn entries_of(header: &PartHeader, packed_head: &[u8]) -> Option<Vec<IndexEntry>> {
    // Two numbers of at most ten bytes for each frame.
    if header.images != 0 || header.head > header.count.saturating_mul(20) {
        return None;
    }
    let head = blocks::unpack(packed_head, header.head as usize)?;
    let mut rest = &head[..];
    let mut entries = Vec::new();
    while !rest.is_empty() {
        let (pages, bytes) = (numbers::take(&mut rest)?, numbers::take(&mut rest)?);
        let (is_key, pages) = (pages & 1 == 1, u32::try_from(pages >> 1).ok()?);
        entries.push(IndexEntry { is_key, pages, bytes });
    }
    (entries.len() == header.count as usize).then_some(entries)
}
