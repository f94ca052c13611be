//! Writes stacks to a file, a folder of pages or a stream.

use std::fmt::Display;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use crate::check::Chain;
use crate::error::{GAVE_UP, StackError};
use crate::layer::Layer;
use crate::ordered::map_in_order;
use crate::temporary::{FileBeside, FolderBeside};
use crate::tiff::{EncodedPage, Format, PageWriter, file_of_page};

/// The place that a stack is written to.
pub enum Destination {
    /// One multipage file, written under a temporary name and renamed when complete.
    File(PathBuf),
    /// A folder of single-page files.
    Folder(FolderBeside),
    /// A stream, such as standard output.
    Stream(Box<dyn Write>),
}

/// Writes layers as a stack, encoding them on all threads.
///
/// # Errors
/// Returns the first error among the layers, or an error if writing fails. No file then
/// appears under the final name; a stream ends without its last page, and says why, so that its
/// reader fails with that sentence.
pub fn write_stack<E>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    to: Destination,
    format: Format,
) -> Result<(), E>
where
    E: From<StackError> + Display + Send,
{
    let mut sink = Sink::new(to, format)?;
    let pages =
        map_in_order(layers, |layer: Layer| Ok((layer.info.index, EncodedPage::new(&layer))));
    for page in pages {
        match page {
            Ok((index, page)) => sink.push(index, page)?,
            Err(error) => {
                sink.abandon(&error);
                return Err(error);
            }
        }
    }
    Ok(sink.finish()?)
}

enum Sink {
    File { pages: PageWriter<BufWriter<File>>, temporary: FileBeside },
    Folder(PageFolder),
    Stream(PageWriter<BufWriter<Box<dyn Write>>>),
}

/// The write buffer's size: usually enough for a whole layer per call.
const BUFFER_BYTES: usize = 1 << 18;

impl Sink {
    fn new(to: Destination, format: Format) -> Result<Self, StackError> {
        Ok(match to {
            Destination::Stream(out) => {
                Self::Stream(PageWriter::new(BufWriter::with_capacity(BUFFER_BYTES, out), format))
            }
            Destination::File(path) => {
                let mut temporary = FileBeside::new(&path)?;
                let out = BufWriter::with_capacity(BUFFER_BYTES, temporary.file().try_clone()?);
                Self::File { pages: PageWriter::new(out, format), temporary }
            }
            Destination::Folder(temporary) => {
                Self::Folder(PageFolder { temporary, format, chain: Chain::default(), held: None })
            }
        })
    }

    fn push(&mut self, index: u32, page: EncodedPage) -> Result<(), StackError> {
        match self {
            Self::Stream(pages) => pages.push(page),
            Self::File { pages, .. } => pages.push(page),
            Self::Folder(folder) => folder.push(index, page),
        }
    }

    /// Flushes all complete layers and the reason to a stream; removes files.
    fn abandon(self, reason: &impl Display) {
        if let Self::Stream(pages) = self {
            // Only the original error is reported.
            let reason = reason.to_string();
            let first = reason.rsplit(GAVE_UP).next().unwrap_or(&reason);
            let _ = pages.give_up(first);
        }
    }

    fn finish(self) -> Result<(), StackError> {
        match self {
            Self::Stream(pages) => drop(pages.finish()?),
            Self::File { pages, temporary } => {
                pages.finish()?;
                temporary.persist()?;
            }
            Self::Folder(folder) => folder.finish()?,
        }
        Ok(())
    }
}

/// A folder of single-page files. One page is held back, because the last one says so.
struct PageFolder {
    temporary: FolderBeside,
    format: Format,
    chain: Chain,
    held: Option<(u32, EncodedPage)>,
}

impl PageFolder {
    fn push(&mut self, index: u32, page: EncodedPage) -> Result<(), StackError> {
        match self.held.replace((index, page)) {
            Some((index, before)) => self.write(index, &before, false),
            None => Ok(()),
        }
    }

    fn write(&mut self, index: u32, page: &EncodedPage, last: bool) -> Result<(), StackError> {
        let path = self.temporary.path().join(format!("layer_{index:05}.tif"));
        let bytes = file_of_page(page, self.format, &mut self.chain, last);
        Ok(File::create_new(path)?.write_all(&bytes)?)
    }

    fn finish(mut self) -> Result<(), StackError> {
        let (index, page) = self.held.take().ok_or(StackError::NoLayers)?;
        self.write(index, &page, true)?;
        self.temporary.persist()
    }
}
