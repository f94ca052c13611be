//! Writes packed stacks.

use std::fmt::Display;
use std::io::{BufWriter, Write};
use std::ops::RangeInclusive;

use super::SIGNATURE;
use super::blocks::Packer;
use super::encode::{CodedLayer, Frames, OpenFrame, Pair, pairs};
use super::frame::{IndexEntry, NOTICE, index, part};
use super::streams::Streams;
use crate::codec::tiff::Format;
use crate::error::{GAVE_UP, StackError};
use crate::files::output::Destination;
use crate::files::temporary::FileBeside;
use crate::layer::Layer;
use crate::ordered::map_in_order;

/// How hard zstd tries to make a packed stack small: a level from 1 to 19, or by default as high as
/// costs little compared with the coding of the images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PackLevel(Option<i32>);

/// By default, the level of masks whose edges are where they are expected, and of other frames:
/// zstd has less to do with few bytes, and finds more in the bytes of noise and gray levels.
const LEVEL_OF_EDGES: i32 = 3;
const LEVEL_OF_OTHERS: i32 = 6;
/// The most and fewest changes and rows that take a byte where a mask's edges are expected.
const CHANGES_A_BYTE: RangeInclusive<u64> = 3..=8;

impl PackLevel {
    /// Returns the level, if it is from 1 to 19.
    pub fn new(level: i32) -> Option<Self> {
        (1..=19).contains(&level).then_some(Self(Some(level)))
    }

    /// Returns zstd's level for images of this many changes and rows that are coded as these
    /// streams.
    pub(super) fn of_images(self, cost: u64, streams: &Streams) -> i32 {
        let changes_a_byte = cost / streams.len().max(1) as u64;
        let are_edges = streams.levels.is_empty() && CHANGES_A_BYTE.contains(&changes_a_byte);
        self.0.unwrap_or(if are_edges { LEVEL_OF_EDGES } else { LEVEL_OF_OTHERS })
    }

    /// Returns zstd's level for the head of a frame.
    pub(super) fn of_head(self) -> i32 {
        self.0.unwrap_or(LEVEL_OF_OTHERS)
    }
}

/// Writes layers as a packed stack, coding them on all threads. `format` is the format of the TIFF
/// which [`Pages::packed_format`](crate::Pages::packed_format) of the packed stack will name.
///
/// ```
/// use lamp_stack::{Destination, Format, Layer, Mask, PackLevel, PageInfo, Pages, StackError};
/// # fn main() -> Result<(), StackError> {
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("one.lamp");
/// let mask = Mask::new(4, vec![0, 2, 2], vec![1, 3]).unwrap();
/// let layer = Layer { info: PageInfo::default(), pitch: None, image: mask.into() };
///
/// let layers = std::iter::once(Ok::<_, StackError>(layer.clone()));
/// let to = Destination::File(path.clone());
/// lamp_stack::write_packed(layers, to, Format::Big, PackLevel::default())?;
///
/// let read: Vec<Layer> = Pages::open(&path)?.layers().collect::<Result<_, _>>()?;
/// assert_eq!(read, [layer]);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// Returns the first error among the layers, or an error if writing fails, the destination is a
/// folder, or an image is too tall. No file then appears under the final name; a stream ends with
/// the reason, so that its reader fails with that sentence.
pub fn write_packed<E>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    to: Destination,
    format: Format,
    level: PackLevel,
) -> Result<(), E>
where
    E: From<StackError> + Display + Send,
{
    let mut sink = PackedSink::new(to, format)?;
    let coded = map_in_order(pairs(layers), |pair: Pair| Ok(CodedLayer::new(&pair)));
    for frame in map_in_order(Frames::new(coded), |frame: OpenFrame| Ok(frame.pack(level))) {
        match frame {
            Ok((entry, bytes)) => sink.push(entry, &bytes)?,
            Err(error) => {
                sink.abandon(&error);
                return Err(error);
            }
        }
    }
    Ok(sink.finish()?)
}

/// The file or stream that is being written.
pub(super) struct PackedSink {
    out: BufWriter<Box<dyn Write>>,
    temporary: Option<FileBeside>,
    entries: Vec<IndexEntry>,
}

impl PackedSink {
    pub(super) fn new(to: Destination, format: Format) -> Result<Self, StackError> {
        let (out, temporary): (Box<dyn Write>, _) = match to {
            Destination::Stream(out) => (out, None),
            Destination::File(path) => {
                let temporary = FileBeside::new(&path)?;
                (Box::new(temporary.file()), Some(temporary))
            }
            Destination::Folder(_) => return Err(StackError::PackedFolder),
        };
        let mut out = BufWriter::with_capacity(1 << 18, out);
        out.write_all(&SIGNATURE)?;
        out.write_all(&[u8::from(format == Format::Classic)])?;
        Ok(Self { out, temporary, entries: Vec::new() })
    }

    pub(super) fn push(&mut self, entry: IndexEntry, frame: &[u8]) -> Result<(), StackError> {
        self.entries.push(entry);
        Ok(self.out.write_all(frame)?)
    }

    /// Ends a stream with the reason; removes a file.
    pub(super) fn abandon(mut self, reason: &impl Display) {
        if self.temporary.is_none() {
            let reason = reason.to_string();
            // Through several stages, the first reason goes on alone.
            let first = reason.rsplit(GAVE_UP).next().unwrap_or(&reason);
            let notice = part(NOTICE, 0, first.as_bytes(), &[], &mut Packer::new(1));
            // Only the original error is reported.
            let _ = self.out.write_all(&notice).and_then(|()| self.out.flush());
        }
    }

    pub(super) fn finish(mut self) -> Result<(), StackError> {
        if self.entries.is_empty() {
            return Err(StackError::NoLayers);
        }
        self.out.write_all(&index(&self.entries, &mut Packer::new(1)))?;
        self.out.flush()?;
        // All writers to the file must be gone before it gets its name.
        drop(self.out);
        if let Some(temporary) = self.temporary {
            temporary.persist()?;
        }
        Ok(())
    }
}
