//! A stack as several files of some of its layers each.

use std::fs::{self, File};
use std::io::BufWriter;
use std::num::NonZeroU32;
use std::ops::Range;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::error::StackError;
use crate::layer::{Layer, StackInfo};
use crate::ordered::map_in_order;
use crate::temporary::FolderBeside;
use crate::tiff::{EncodedPage, Format, PageWriter};

/// Why a stack cannot be split.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SplitError {
    /// It lacks layers, which is to be mended before its parts go their ways.
    #[error("layer {layer} stands behind layer {before}: the stack lacks what is between them")]
    Gap {
        /// The layer behind the gap.
        layer: u32,
        /// The one before it.
        before: u32,
    },
    /// It has no layer where it is to be split.
    #[error("no file can start with layer {cut}: the stack has layers {first} to {last}")]
    NoCut {
        /// Where it was to be split.
        cut: u32,
        /// The stack's first layer.
        first: u32,
        /// Its last.
        last: u32,
    },
}

/// Where a stack is split.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SplitPoints {
    /// Behind so many layers each; the last file takes what is left.
    Every(NonZeroU32),
    /// Before each of these layers, which go up.
    At(Vec<u32>),
}

impl SplitPoints {
    /// The layers of the file that starts with layer `first`.
    fn file_from(&self, first: u32) -> Range<u32> {
        let end = match self {
            Self::Every(layers) => first.saturating_add(layers.get()),
            Self::At(cuts) => cuts.iter().copied().find(|&cut| cut > first).unwrap_or(u32::MAX),
        };
        first..end
    }
}

/// Writes layers as a folder of stacks, `layers_00500-00999.tif` each, every
/// one whole in itself. [`join`](crate::join) makes the one stack of them
/// again. The folder gets its name when it is whole.
///
/// # Errors
/// The first error among the layers; where a layer does not follow the one
/// before it, or a cut is at no layer; where the folder cannot be written: it
/// must not exist, or be empty.
pub fn write_split<E>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    cuts: &SplitPoints,
    folder: &Path,
    format: Format,
) -> Result<(), E>
where
    E: From<StackError> + From<SplitError> + Send,
{
    let mut folder = Folder { temporary: FolderBeside::over_nothing(folder)?, format, open: None };
    let mut plan = Plan { cuts, stack: None, first: 0, last: None, file: 0..0 };
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

/// Which layer goes into which file.
struct Plan<'a> {
    cuts: &'a SplitPoints,
    /// What the first layer says of the stack.
    stack: Option<StackInfo>,
    first: u32,
    last: Option<u32>,
    /// The layers of the file that is being filled.
    file: Range<u32>,
}

impl Plan<'_> {
    /// Whether a layer is the first of its file; it then says what the file is.
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
        match cuts.iter().find(|&&cut| cut <= first || cut > last) {
            Some(&cut) => Err(SplitError::NoCut { cut, first, last }),
            None => Ok(()),
        }
    }
}

/// The folder with the file that is being written.
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

    /// Ends the file, and names it after its layers.
    fn close(&mut self) -> Result<(), StackError> {
        if let Some(OpenFile { pages, first, last }) = self.open.take() {
            pages.finish()?;
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
        Ok(self.temporary.persist()?)
    }

    /// The path of the file that is being written: its last layer is not
    /// known yet.
    fn unnamed(&self) -> PathBuf {
        self.temporary.path().join("layers.tif")
    }
}
