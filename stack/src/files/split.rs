//! Splits a stack into several files of consecutive layers.

use std::fs::{self, File};
use std::io::BufWriter;
use std::num::NonZeroU32;
use std::ops::Range;
use std::path::PathBuf;

use thiserror::Error;

use crate::codec::tiff::{EncodedPage, Format, PageWriter};
use crate::error::StackError;
use crate::files::temporary::FolderBeside;
use crate::layer::Layer;
use crate::layer::page_info::StackInfo;
use crate::ordered::map_in_order;

/// An error that prevents splitting a stack.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SplitError {
    /// The stack lacks layers.
    #[error("layer {layer} follows layer {before}: the stack lacks the layers between them")]
    Gap {
        /// The layer after the gap.
        layer: u32,
        /// The layer before the gap.
        before: u32,
    },
    /// The stack has no layer at a requested cut.
    #[error("no file can start with layer {cut}: the stack has layers {first} to {last}")]
    NoCut {
        /// The requested cut.
        cut: u32,
        /// The stack's first layer.
        first: u32,
        /// The stack's last layer.
        last: u32,
    },
}

/// The layers at which a stack is split.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SplitPoints {
    /// Each file has this number of layers; the last may have fewer.
    Every(NonZeroU32),
    /// A new file starts at each of these layers, in increasing order.
    At(Vec<u32>),
}

impl SplitPoints {
    /// Returns the layers of the file that starts with layer `first`.
    fn file_from(&self, first: u32) -> Range<u32> {
        let end = match self {
            Self::Every(layers) => first.saturating_add(layers.get()),
            Self::At(cuts) => cuts.iter().copied().find(|&cut| cut > first).unwrap_or(u32::MAX),
        };
        first..end
    }
}

/// Writes layers as a folder of complete stacks named like `layers_00500-00999.tif`.
/// [`join`](fn@crate::join) restores the single stack. The folder gets its name when it is
/// complete.
///
/// # Errors
/// Returns the first error among the layers, or an error if layers are missing, a cut is at no
/// layer, or the folder cannot be written.
pub fn write_split<E>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    cuts: &SplitPoints,
    folder: FolderBeside,
    format: Format,
) -> Result<(), E>
where
    E: From<StackError> + From<SplitError> + Send,
{
    let mut folder = Folder { temporary: folder, format, open: None };
    let mut plan = FileAssignment { cuts, stack: None, first: 0, last: None, file: 0..0 };
    let placed = layers.map(|layer| {
        let mut layer = layer?;
        let starts_file = plan.place(&mut layer)?;
        Ok::<_, E>((layer, starts_file))
    });
    let pages = map_in_order(placed, |(layer, starts_file): (Layer, bool)| {
        Ok((layer.info.index, starts_file, EncodedPage::new(&layer)))
    });
    for page in pages {
        let (index, starts_file, page) = page?;
        folder.push(index, starts_file, page)?;
    }
    plan.check_cuts()?;
    Ok(folder.finish()?)
}

/// Assigns layers to files.
struct FileAssignment<'a> {
    cuts: &'a SplitPoints,
    /// The metadata of the whole stack, from its first layer.
    stack: Option<StackInfo>,
    first: u32,
    last: Option<u32>,
    /// The layers of the current file.
    file: Range<u32>,
}

impl FileAssignment<'_> {
    /// Returns whether a layer is the first of its file, and if so gives it the file's metadata.
    fn place(&mut self, layer: &mut Layer) -> Result<bool, SplitError> {
        let index = layer.info.index;
        match self.last.replace(index) {
            None => {
                self.first = index;
                self.stack = layer.info.stack.take();
            }
            Some(before) if before.checked_add(1) != Some(index) => {
                return Err(SplitError::Gap { layer: index, before });
            }
            Some(_) if self.file.contains(&index) => return Ok(false),
            Some(_) => {}
        }
        self.file = self.cuts.file_from(index);
        layer.info.stack = self.stack.clone().map(|stack| stack.of_range(self.first, &self.file));
        Ok(true)
    }

    fn check_cuts(&self) -> Result<(), SplitError> {
        let (SplitPoints::At(cuts), Some(last)) = (self.cuts, self.last) else { return Ok(()) };
        let first = self.first;
        // A cut at the first layer would leave a file without layers before it.
        match cuts.iter().find(|&&cut| cut <= first || cut > last) {
            Some(&cut) => Err(SplitError::NoCut { cut, first, last }),
            None => Ok(()),
        }
    }
}

/// The output folder and the file being written.
struct Folder {
    temporary: FolderBeside,
    format: Format,
    open: Option<OpenFile>,
}

struct OpenFile {
    pages: PageWriter<BufWriter<File>>,
    first: u32,
    last: u32,
}

impl Folder {
    fn push(&mut self, index: u32, starts_file: bool, page: EncodedPage) -> Result<(), StackError> {
        if starts_file {
            self.close()?;
            let out = BufWriter::with_capacity(1 << 18, File::create(self.unnamed())?);
            let pages = PageWriter::new(out, self.format);
            self.open = Some(OpenFile { pages, first: index, last: index });
        }
        let open = self.open.as_mut().expect("the first layer starts a file");
        open.last = index;
        open.pages.push(page)
    }

    /// Completes the file and names it after its layers.
    fn close(&mut self) -> Result<(), StackError> {
        if let Some(OpenFile { pages, first, last }) = self.open.take() {
            pages.close()?;
            let name = format!("layers_{first:05}-{last:05}.tif");
            fs::rename(self.unnamed(), self.temporary.path().join(name))?;
        }
        Ok(())
    }

    fn finish(mut self) -> Result<(), StackError> {
        if self.open.is_none() {
            return Err(StackError::NoLayers);
        }
        self.close()?;
        self.temporary.persist()
    }

    /// Returns the temporary path of the current file, whose last layer is not yet known.
    fn unnamed(&self) -> PathBuf {
        self.temporary.path().join("layers.tif")
    }
}
