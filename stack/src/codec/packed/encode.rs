//! Turns layers into frames, on all threads.

use std::sync::Arc;

use super::blocks::Packer;
use super::frame::{FRAME, FramePage, IndexEntry, KEY_FRAME, cost, head_of, part};
use super::image::{CodedImage, ImageFacts, encode};
use super::streams::Streams;
use super::write::PackLevel;
use super::{FRAME_BYTES, FRAME_COST, KEY_LAYERS, MOST_ROWS};
use crate::error::{PageFault, StackError};
use crate::image::Image;
use crate::layer::Layer;
use crate::layer::check::{CheckChain, OpenLine};
use crate::ordered::MemorySize;

/// A layer, and the one below if its image may be coded against that.
pub(super) struct Pair {
    layer: Arc<Layer>,
    below: Option<Arc<Layer>>,
}

impl MemorySize for Pair {
    fn bytes(&self) -> usize {
        self.layer.bytes()
    }
}

/// Pairs each layer with the one below.
pub(super) fn pairs<E: From<StackError>>(
    layers: impl Iterator<Item = Result<Layer, E>>,
) -> impl Iterator<Item = Result<Pair, E>> {
    let mut below: Option<Arc<Layer>> = None;
    layers.enumerate().map(move |(page, layer)| {
        let layer = Arc::new(layer?);
        let height = layer.image.height();
        if height > MOST_ROWS {
            let fault = PageFault::TooTallToPack(height);
            return Err(StackError::Malformed { page: page as u32, fault }.into());
        }
        let before = below.replace(Arc::clone(&layer));
        // By the layer's index, not the page: ranges cut there then join to the bytes of the whole.
        let is_key = layer.info.index.is_multiple_of(KEY_LAYERS);
        let below = before.filter(|below| !is_key && is_alike(&below.image, &layer.image));
        Ok(Pair { layer, below })
    })
}

fn is_alike(image: &Image, other: &Image) -> bool {
    image.width() == other.width()
        && image.height() == other.height()
        && matches!(image, Image::Gray(_)) == matches!(other, Image::Gray(_))
}

/// A coded layer whose frame is not known yet.
pub(super) struct CodedLayer {
    is_key: bool,
    shape: ImageFacts,
    line: OpenLine,
    streams: Streams,
}

impl CodedLayer {
    pub(super) fn new(pair: &Pair) -> Self {
        let Layer { info, pitch, image } = &*pair.layer;
        let below = pair.below.as_ref().map(|below| &*below.image);
        let CodedImage { mode, streams } = encode(image, below);
        let shape = ImageFacts {
            mode,
            gray: matches!(**image, Image::Gray(_)),
            size: [image.width(), image.height()],
            changes: image.change_count() as u32,
        };
        let line = OpenLine::new(info, *pitch, image.check(), None);
        Self { is_key: pair.below.is_none(), shape, line, streams }
    }
}

/// A frame that is not packed yet.
#[derive(Default)]
pub(super) struct OpenFrame {
    is_key: bool,
    pages: Vec<FramePage>,
    streams: Streams,
}

impl MemorySize for OpenFrame {
    fn bytes(&self) -> usize {
        self.streams.len()
    }
}

impl OpenFrame {
    /// Packs the frame, and returns its entry of the index and its bytes.
    pub(super) fn pack(&self, level: PackLevel) -> (IndexEntry, Vec<u8>) {
        let cost = cost(self.pages.iter().map(|page| &page.shape));
        let images = Packer::new(level.of_images(cost, &self.streams)).pack_streams(&self.streams);
        let mut packer = Packer::new(level.of_head());
        let kind = if self.is_key { KEY_FRAME } else { FRAME };
        let pages = self.pages.len() as u32;
        let bytes = part(kind, pages, &head_of(&self.pages), &images, &mut packer);
        (IndexEntry { is_key: self.is_key, pages, bytes: bytes.len() as u64 }, bytes)
    }

    /// Returns whether the frame takes another layer.
    fn takes(&self, layer: &CodedLayer) -> bool {
        let shapes = self.pages.iter().map(|page| &page.shape);
        !layer.is_key
            && self.pages.len() < KEY_LAYERS as usize
            && self.streams.len() < FRAME_BYTES
            && cost(shapes.chain([&layer.shape])) <= FRAME_COST
    }
}

/// Gathers layers into frames. The last layer's line says that it is the last.
pub(super) struct Frames<I> {
    layers: I,
    chain: CheckChain,
    /// The layer that starts the next frame.
    held: Option<CodedLayer>,
}

impl<I> Frames<I> {
    pub(super) fn new(layers: I) -> Self {
        Self { layers, chain: CheckChain::default(), held: None }
    }
}

impl<E, I: Iterator<Item = Result<CodedLayer, E>>> Frames<I> {
    fn next_frame(&mut self) -> Result<Option<OpenFrame>, E> {
        if self.held.is_none() {
            self.held = self.layers.next().transpose()?;
        }
        let mut frame = OpenFrame::default();
        while let Some(layer) = self.held.take() {
            // The line must say whether the layer is the last, which only the next one shows.
            self.held = self.layers.next().transpose()?;
            frame.is_key |= layer.is_key;
            frame.streams.append(&layer.streams);
            let line = self.chain.close(&layer.line, self.held.is_none()).into_bytes();
            frame.pages.push(FramePage { shape: layer.shape, line });
            if self.held.as_ref().is_some_and(|next| !frame.takes(next)) {
                break;
            }
        }
        Ok((!frame.pages.is_empty()).then_some(frame))
    }
}

impl<E, I: Iterator<Item = Result<CodedLayer, E>>> Iterator for Frames<I> {
    type Item = Result<OpenFrame, E>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_frame().transpose()
    }
}
