//! Codes images: against the layer below, by themselves, or as a kept strip.

use super::blocks::packed_len;
use super::levels::{self, Split};
use super::rows::{self, Reference};
use super::streams::{Cursor, Streams};
use crate::codec::bits::{bit_transitions, bits as bits_of_row, byte_runs};
use crate::codec::g4;
use crate::codec::tiff::PackedShape;
use crate::image::Image;
use crate::image::mask::Mask;
use crate::layer::LayerImage;
use crate::limits::MAX_RUNS;

/// How an image is coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// Rows against the rows of the layer below.
    Below,
    /// Rows against the rows above them.
    Above,
    /// A strip in T.6.
    Strip,
    /// Pixels of one bit.
    Bits,
}

/// A coded image.
#[derive(Clone, Debug)]
pub(super) struct CodedImage {
    pub(super) mode: Mode,
    pub(super) streams: Streams,
}

/// The most bytes of a strip that is kept, except for bytes that its image may need.
const MOST_KEPT: usize = 1 << 14;

/// Codes an image. `below` is the image of the layer below, if it has the same size and kind.
pub(super) fn encode(image: &LayerImage, below: Option<&Image>) -> CodedImage {
    let (mask, strip) = match &**image {
        Image::Mask(mask) => (mask, image.strip().map(|strip| &strip.bytes)),
        Image::Gray(gray) => return encode_gray(&Split::of(gray), below),
    };
    // A strip with far more bytes than its image needs is coded anew.
    let most = MOST_KEPT + 4 * (mask.change_count() + mask.height() as usize);
    // Our own codes can be made again from the image; only others must be kept.
    let own = strip.filter(|strip| strip.len() <= most && ***strip != *g4::encode(mask));
    if let Some(strip) = own {
        return kept(strip.to_vec());
    }
    let by_rows = |reference, mode| {
        let mut streams = Streams::default();
        rows::encode(mask, reference, 2, &mut streams);
        CodedImage { mode, streams }
    };
    let coded = match below {
        Some(Image::Mask(below)) => by_rows(Reference::Below(below), Mode::Below),
        _ => by_rows(Reference::Above, Mode::Above),
    };
    // Edges that are where they were expected take a third of that.
    if 2 * coded.streams.len() < mask.change_count() + mask.height() as usize {
        return coded;
    }
    let others = [
        (coded.mode == Mode::Below).then(|| by_rows(Reference::Above, Mode::Above)),
        is_dense(mask).then(|| bits(mask)),
        Some(kept(strip.map_or_else(|| g4::encode(mask), |strip| strip.to_vec()))),
    ];
    let all = std::iter::once(coded).chain(others.into_iter().flatten());
    all.min_by_key(|coded| packed_len(&coded.streams)).expect("there is one")
}

fn kept(strip: Vec<u8>) -> CodedImage {
    let mut streams = Streams::default();
    super::numbers::put(&mut streams.rows, strip.len() as u64);
    streams.strips = strip;
    CodedImage { mode: Mode::Strip, streams }
}

/// Returns whether changes are so close to each other that few pixels separate them.
fn is_dense(mask: &Mask) -> bool {
    let bytes = u64::from(mask.height()) * u64::from(mask.width().div_ceil(8));
    bytes < 4 * mask.change_count() as u64
}

fn bits(mask: &Mask) -> CodedImage {
    let rows = mask.rows().flat_map(|row| bits_of_row(row, mask.width()));
    let streams = Streams { strips: rows.collect(), ..Streams::default() };
    CodedImage { mode: Mode::Bits, streams }
}

/// Decodes a mask of at most this many changes from its bits.
fn decode_bits([width, height]: [u32; 2], changes: usize, from: &mut Cursor<'_>) -> Option<Mask> {
    let bytes = width.div_ceil(8) as usize;
    let (rows, rest) = from.strips.split_at_checked(bytes.checked_mul(height as usize)?)?;
    from.strips = rest;
    let (mut mask, mut runs) = (Mask::without_rows(width), Vec::new());
    for row in rows.chunks(bytes) {
        byte_runs(row, &mut runs);
        mask.push(&bit_transitions(&runs, width));
        if mask.change_count() > changes {
            return None;
        }
    }
    Some(mask)
}

fn encode_gray(image: &Split, below: Option<&Image>) -> CodedImage {
    let below = match below {
        Some(Image::Gray(below)) => Some(Split::of(below)),
        _ => None,
    };
    let code = |below: Option<&Split>| {
        let mut streams = Streams::default();
        rows::encode(&image.columns, Split::reference(below), 1, &mut streams);
        levels::encode(image, below, &mut streams);
        let mode = if below.is_some() { Mode::Below } else { Mode::Above };
        CodedImage { mode, streams }
    };
    let coded = code(below.as_ref());
    // More than two bytes a change are the mark of noise, which its own rows may predict better.
    if below.is_none() || coded.streams.len() < 2 * image.levels.len() {
        return coded;
    }
    let alone = code(None);
    if packed_len(&alone.streams) < packed_len(&coded.streams) { alone } else { coded }
}

/// The facts of an image before it is decoded.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImageFacts {
    pub(super) mode: Mode,
    pub(super) gray: bool,
    pub(super) size: [u32; 2],
    /// The number of its changes.
    pub(super) changes: u32,
}

impl From<ImageFacts> for PackedShape {
    fn from(ImageFacts { gray, size, .. }: ImageFacts) -> Self {
        Self { size, gray }
    }
}

impl ImageFacts {
    /// Returns whether an image may be coded against another.
    pub(super) fn is_like(&self, image: &Image) -> bool {
        self.size == [image.width(), image.height()] && self.gray == matches!(image, Image::Gray(_))
    }
}

/// Decodes an image and its strip, if it was kept. Returns `None` if it is damaged.
pub(super) fn decode(
    shape: &ImageFacts,
    below: Option<&Image>,
    from: &mut Cursor<'_>,
) -> Option<(Image, Option<Vec<u8>>)> {
    let changes = usize::try_from(shape.changes).ok().filter(|&changes| changes <= MAX_RUNS)?;
    let below = match shape.mode {
        Mode::Below => Some(below.filter(|below| shape.is_like(below))?),
        Mode::Above => None,
        Mode::Strip => {
            let length = usize::try_from(super::numbers::take(&mut from.rows)?).ok()?;
            let (strip, rest) = from.strips.split_at_checked(length)?;
            from.strips = rest;
            let [width, height] = shape.size;
            let mut mask = Mask::without_rows(width);
            g4::decode_rows(strip, width, height, changes, &mut mask).ok()?;
            let is_right = mask.change_count() == changes && !shape.gray;
            return is_right.then(|| (mask.into(), Some(strip.to_vec())));
        }
        Mode::Bits => {
            let mask = decode_bits(shape.size, changes, from)?;
            let is_right = mask.change_count() == changes && !shape.gray;
            return is_right.then(|| (mask.into(), None));
        }
    };
    let image: Image = match below {
        Some(Image::Gray(below)) => {
            let below = Split::of(below);
            let columns = Split::reference(Some(&below));
            let columns = rows::decode(shape.size, changes, columns, 1, from)?;
            levels::decode(&columns, Some(&below), from)?.into()
        }
        None if shape.gray => {
            let columns = rows::decode(shape.size, changes, Reference::Above, 1, from)?;
            levels::decode(&columns, None, from)?.into()
        }
        Some(Image::Mask(below)) => {
            rows::decode(shape.size, changes, Reference::Below(below), 2, from)?.into()
        }
        None => rows::decode(shape.size, changes, Reference::Above, 2, from)?.into(),
    };
    (image.change_count() == changes).then_some((image, None))
}
