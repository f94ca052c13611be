//! Joins and copies packed stacks without coding their images again.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::blocks::Packer;
use super::frame::{FramePage, IndexEntry, KEY_FRAME, START_BYTES, head_of, part};
use super::read::{PackFrame, Unpacker};
use super::write::{PackLevel, PackedSink};
use crate::codec::tiff::{ByteSource, Format, Page};
use crate::error::{PageFault, StackError};
use crate::files::input::Pages;
use crate::files::join::{JoinError, JoinedPages, in_stack, survey};
use crate::files::output::Destination;
use crate::layer::check::{CheckChain, OpenLine};
use crate::layer::page_info::{PageInfo, StackInfo};
use crate::limits::Limits;

/// Joins packed stacks as [`join`](fn@crate::join) does, and writes them as a packed stack: images
/// are copied as they are coded, texts and their checks are made anew. Images are not decoded.
///
/// Of ranges that start at multiples of [`KEY_LAYERS`](super::KEY_LAYERS), packed with the same
/// level, the result has the bytes of the whole packed at once.
///
/// # Errors
/// Returns an error in the same cases as [`join`](fn@crate::join) and its iterator, if a stack is not
/// packed, or if writing fails. No file then appears under the final name.
pub fn join_packed(
    stacks: &[PathBuf],
    to: Destination,
    format: Format,
    level: PackLevel,
) -> Result<(), JoinError> {
    // Two readers go side by side: one has the texts, the other the images as they are packed.
    let mut pages =
        JoinedPages::new(stacks.to_vec(), survey(stacks)?, Arc::new(|_, _| {})).without_images();
    let mut joined = FrameRewriter::new(to, format, level)?;
    for path in stacks {
        let failed = |source| in_stack(path, source);
        let mut frames = RawFrames::open(path).map_err(failed)?;
        while let Some(frame) = frames.next().map_err(failed)? {
            let line = |_| {
                let (page, origin) = pages.next().ok_or(StackError::Changed).map_err(failed)??;
                let info = PageInfo { stack: origin.stack, ..page.info().clone() };
                line_of(&page, &info).map_err(failed)
            };
            let lines = (0..frame.page_count()).map(line).collect::<Result<_, _>>()?;
            joined.push(frame, lines)?;
        }
    }
    Ok(joined.finish()?)
}

/// Copies a packed stack, with the metadata that `change` makes of what the stack's first page
/// says of it: images are copied as they are coded, texts and their checks are made anew.
///
/// The result has the bytes of the changed layers packed with the same level.
///
/// # Errors
/// Returns an error if the stack cannot be read or is not packed, or if writing fails. No file then
/// appears under the final name.
pub fn copy_packed(
    stack: &Path,
    to: Destination,
    level: PackLevel,
    change: impl Fn(StackInfo) -> StackInfo,
) -> Result<(), StackError> {
    let mut frames = RawFrames::open(stack)?;
    let mut pages = Pages::open(stack)?.without_images();
    let mut copied = FrameRewriter::new(to, frames.unpacker.format(), level)?;
    while let Some(frame) = frames.next()? {
        let line = |_| {
            // Fewer pages than the frames have: the file was written to between both readings.
            let page = pages.next().ok_or(StackError::Changed)??;
            let of_stack = page.info().stack.clone().map(&change);
            line_of(&page, &PageInfo { stack: of_stack, ..page.info().clone() })
        };
        let lines = (0..frame.page_count()).map(line).collect::<Result<_, _>>()?;
        copied.push(frame, lines)?;
    }
    copied.finish()
}

/// Returns a page's line with other metadata.
fn line_of(page: &Page, info: &PageInfo) -> Result<OpenLine, StackError> {
    let check = page.image_check().ok_or(StackError::Changed)?;
    Ok(OpenLine::new(info, page.header().pitch, check, None))
}

/// The frames of a packed file, as they are.
struct RawFrames {
    unpacker: Unpacker,
    source: ByteSource,
}

impl RawFrames {
    fn open(path: &Path) -> Result<Self, StackError> {
        let file = BufReader::with_capacity(1 << 18, File::open(path)?);
        let mut source = ByteSource::File { file, position: 0 };
        let start = source.read_up_to(0, START_BYTES)?;
        match start.split_last() {
            Some((&format, signature)) if *signature == super::SIGNATURE => {
                Ok(Self { unpacker: Unpacker::new(format), source })
            }
            _ => Err(StackError::Malformed { page: 0, fault: PageFault::Packed("signature") }),
        }
    }

    fn next(&mut self) -> Result<Option<PackFrame>, StackError> {
        let frame = self.unpacker.read_frame(&mut self.source, &Limits::default(), true)?;
        // Nothing decodes these images, so their check alone finds damage.
        frame.map(PackFrame::checked).transpose()
    }
}

/// Writes frames with new lines. It holds one back, because the last page says so.
struct FrameRewriter {
    sink: PackedSink,
    chain: CheckChain,
    level: PackLevel,
    held: Option<(PackFrame, Vec<OpenLine>)>,
}

impl FrameRewriter {
    fn new(to: Destination, format: Format, level: PackLevel) -> Result<Self, StackError> {
        Ok(Self {
            sink: PackedSink::new(to, format)?,
            chain: CheckChain::default(),
            level,
            held: None,
        })
    }

    fn push(&mut self, frame: PackFrame, lines: Vec<OpenLine>) -> Result<(), StackError> {
        match self.held.replace((frame, lines)) {
            Some(before) => self.write(before, false),
            None => Ok(()),
        }
    }

    fn finish(mut self) -> Result<(), StackError> {
        let last = self.held.take().ok_or(StackError::NoLayers)?;
        self.write(last, true)?;
        self.sink.finish()
    }

    fn write(
        &mut self,
        (frame, lines): (PackFrame, Vec<OpenLine>),
        ends_stack: bool,
    ) -> Result<(), StackError> {
        let count = lines.len();
        let lines = lines
            .iter()
            .enumerate()
            .map(|(k, line)| self.chain.close(line, ends_stack && k + 1 == count).into_bytes());
        let lines: Vec<_> = lines.collect();
        let (kind, shapes, images) = frame.into_parts();
        let pages = shapes.into_iter().zip(lines).map(|(shape, line)| FramePage { shape, line });
        let pages: Vec<_> = pages.collect();
        let mut packer = Packer::new(self.level.of_head());
        let bytes = part(kind, count as u32, &head_of(&pages), &images, &mut packer);
        let is_key = kind == KEY_FRAME;
        let entry = IndexEntry { is_key, pages: count as u32, bytes: bytes.len() as u64 };
        self.sink.push(entry, &bytes)
    }
}
