//! Writes stacks to a file, a folder of pages or a stream.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use crate::error::StackError;
use crate::layer::Layer;
use crate::ordered::map_in_order;
use crate::temporary::{FileBeside, FolderBeside};
use crate::tiff::{EncodedPage, Format, PageWriter};

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
/// appears under the final name; a stream lacks its last page link, so that its reader notices.
pub fn write_stack<E>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    to: Destination,
    format: Format,
) -> Result<(), E>
where
    E: From<StackError> + Send,
{
    let mut sink = Sink::new(to, format)?;
    let pages =
        map_in_order(layers, |layer: Layer| Ok((layer.info.index, EncodedPage::new(&layer))));
    for page in pages {
        match page {
            Ok((index, page)) => sink.push(index, page)?,
            Err(error) => {
                sink.abandon();
                return Err(error);
            }
        }
    }
    Ok(sink.finish()?)
}

enum Sink {
    File { pages: PageWriter<BufWriter<File>>, temporary: FileBeside },
    Folder { temporary: FolderBeside, format: Format, empty: bool },
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
            Destination::Folder(temporary) => Self::Folder { temporary, format, empty: true },
        })
    }

    fn push(&mut self, index: u32, page: EncodedPage) -> Result<(), StackError> {
        match self {
            Self::Stream(pages) => pages.push(page),
            Self::File { pages, .. } => pages.push(page),
            Self::Folder { temporary, format, empty, .. } => {
                let name = format!("layer_{index:05}.tif");
                let file = File::create_new(temporary.path().join(name))?;
                let mut pages = PageWriter::new(BufWriter::new(file), *format);
                pages.push(page)?;
                pages.finish()?;
                *empty = false;
                Ok(())
            }
        }
    }

    /// Flushes all complete layers to a stream; removes files.
    fn abandon(self) {
        if let Self::Stream(pages) = self {
            // Only the original error is reported.
            let _ = pages.cut_off();
        }
    }

    fn finish(self) -> Result<(), StackError> {
        match self {
            Self::Stream(pages) => drop(pages.finish()?),
            Self::File { pages, temporary } => {
                pages.finish()?;
                temporary.persist()?;
            }
            Self::Folder { empty: true, .. } => return Err(StackError::NoLayers),
            Self::Folder { temporary, .. } => temporary.persist()?,
        }
        Ok(())
    }
}
