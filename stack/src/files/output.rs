//! Writes stacks to a file, a folder of pages or a stream.

use std::fmt::Display;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;
use std::sync::Arc;

use crate::codec::tiff::{EncodedPage, Format, PageWriter};
use crate::error::StackError;
use crate::files::page_folder::PageFolder;
use crate::files::temporary::{FileBeside, FolderBeside};
use crate::ordered::{MemorySize, map_in_order};

/// The place that a stack is written to.
pub enum Destination {
    /// One multipage file, written under a temporary name and renamed when complete.
    File(PathBuf),
    /// A folder of single-page files.
    Folder(FolderBeside),
    /// A stream, such as standard output.
    Stream(Box<dyn Write>),
}

/// Writes layers, [decoded](crate::Layer) or [not](crate::PassingLayer), as a stack, encoding them
/// on all threads.
///
/// # Errors
/// Returns the first error among the layers, or an error if writing fails. No file then
/// appears under the final name; a stream ends without its last page, and says why, so that its
/// reader fails with that sentence.
pub fn write_stack<L, E>(
    layers: impl Iterator<Item = Result<L, E>>,
    to: Destination,
    format: Format,
) -> Result<(), E>
where
    L: Into<EncodedPage> + MemorySize + Send,
    E: From<StackError> + Display + Send,
{
    let mut sink = Sink::new(to, format)?;
    for page in map_in_order(layers, |layer: L| Ok(layer.into())) {
        match page {
            Ok(page) => sink.push(page)?,
            Err(error) => {
                sink.abandon(&error);
                return Err(error);
            }
        }
    }
    Ok(sink.finish()?)
}

enum Sink {
    File { pages: PageWriter<BufWriter<Arc<File>>>, temporary: FileBeside },
    Folder { pages: PageFolder<(EncodedPage, Format)>, format: Format },
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
                let temporary = FileBeside::new(&path)?;
                let out = BufWriter::with_capacity(BUFFER_BYTES, temporary.file());
                Self::File { pages: PageWriter::new(out, format), temporary }
            }
            Destination::Folder(folder) => Self::Folder { pages: PageFolder::new(folder), format },
        })
    }

    fn push(&mut self, page: EncodedPage) -> Result<(), StackError> {
        match self {
            Self::Stream(pages) => pages.push(page),
            Self::File { pages, .. } => pages.push(page),
            Self::Folder { pages, format } => pages.push((page, *format)),
        }
    }

    /// Flushes all complete layers and the reason to a stream; removes files.
    fn abandon(self, reason: &impl Display) {
        if let Self::Stream(pages) = self {
            // Only the original error is reported.
            let _ = pages.give_up(&reason.to_string());
        }
    }

    fn finish(self) -> Result<(), StackError> {
        match self {
            Self::Stream(pages) => drop(pages.finish()?),
            Self::File { pages, temporary } => {
                drop(pages.finish()?);
                temporary.persist()?;
            }
            Self::Folder { pages, .. } => pages.finish()?,
        }
        Ok(())
    }
}
