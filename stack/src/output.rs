//! Where stacks go: a file, a folder of pages, a stream.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::{NamedTempFile, TempDir};

use crate::error::StackError;
use crate::layer::Layer;
use crate::ordered::map_in_order;
use crate::tiff::{EncodedPage, Format, PageWriter};

/// Where a stack is to be written.
pub enum Destination {
    /// One multipage file. It is written beside its name and renamed when it
    /// is whole.
    File(PathBuf),
    /// A folder of one-page files, made in the same way. The folder must not
    /// exist, or be empty.
    Folder(PathBuf),
    /// A stream, such as standard output.
    Stream(Box<dyn Write>),
}

/// Writes layers as a stack, encoding them on all threads.
///
/// # Errors
/// The first error among the layers, or where writing fails. Nothing then
/// stands under the final name; a stream is left without its last link, so
/// that its reader knows.
pub fn write_stack<E>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    to: Destination,
    format: Format,
) -> Result<(), E>
where
    E: From<StackError> + Send,
{
    let mut sink = Sink::new(to, format)?;
    for page in
        map_in_order(layers, |layer| Ok::<_, E>((layer.info.index, EncodedPage::new(&layer))))
    {
        let (index, page) = page?;
        sink.push(index, page)?;
    }
    Ok(sink.finish()?)
}

/// A new file beside `path` that gets this name only when it is complete,
/// and is gone if that never happens.
///
/// # Errors
/// Where no file can be made in that folder.
pub fn file_beside(path: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    set_mode(&mut builder, 0o666);
    let folder = folder_of(path)?;
    builder.prefix(&hidden_prefix(path)).suffix(".part").tempfile_in(folder)
}

fn folder_beside(path: &Path) -> io::Result<TempDir> {
    let mut builder = tempfile::Builder::new();
    set_mode(&mut builder, 0o777);
    let folder = folder_of(path)?;
    builder.prefix(&hidden_prefix(path)).suffix(".part").tempdir_in(folder)
}

enum Sink {
    File { pages: PageWriter<BufWriter<File>>, temporary: NamedTempFile, path: PathBuf },
    Folder { temporary: TempDir, path: PathBuf, format: Format, empty: bool },
    Stream(PageWriter<BufWriter<Box<dyn Write>>>),
}

/// Enough that a layer or more goes out with one call.
const BUFFER_BYTES: usize = 1 << 18;

impl Sink {
    fn new(to: Destination, format: Format) -> Result<Self, StackError> {
        Ok(match to {
            Destination::Stream(out) => {
                Self::Stream(PageWriter::new(BufWriter::with_capacity(BUFFER_BYTES, out), format))
            }
            Destination::File(path) => {
                let temporary = file_beside(&path)?;
                let out = BufWriter::with_capacity(BUFFER_BYTES, temporary.reopen()?);
                Self::File { pages: PageWriter::new(out, format), temporary, path }
            }
            Destination::Folder(path) => {
                if path.exists() && !is_empty_folder(&path) {
                    return Err(StackError::Exists);
                }
                Self::Folder { temporary: folder_beside(&path)?, path, format, empty: true }
            }
        })
    }

    fn push(&mut self, index: u32, page: EncodedPage) -> Result<(), StackError> {
        match self {
            Self::Stream(pages) => pages.push(page),
            Self::File { pages, .. } => pages.push(page),
            Self::Folder { temporary, format, empty, .. } => {
                let file = File::create(temporary.path().join(format!("layer_{index:05}.tif")))?;
                let mut pages = PageWriter::new(BufWriter::new(file), *format);
                pages.push(page)?;
                pages.finish()?;
                *empty = false;
                Ok(())
            }
        }
    }

    fn finish(self) -> Result<(), StackError> {
        match self {
            Self::Stream(pages) => drop(pages.finish()?),
            Self::File { pages, temporary, path } => {
                pages.finish()?;
                temporary.persist(path).map_err(|e| e.error)?;
            }
            Self::Folder { empty: true, .. } => return Err(StackError::NoLayers),
            Self::Folder { temporary, path, .. } => {
                fs::rename(temporary.path(), path)?;
                // The folder has another name now: there is nothing to remove.
                let _ = temporary.keep();
            }
        }
        Ok(())
    }
}

fn is_empty_folder(path: &Path) -> bool {
    fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none())
}

/// The folder that `path` is to stand in.
fn folder_of(path: &Path) -> io::Result<&Path> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if folder.is_dir() {
        return Ok(folder);
    }
    let message = format!("there is no folder {}: make it first", folder.display());
    Err(io::Error::new(io::ErrorKind::NotFound, message))
}

/// How hidden names beside `path` start.
fn hidden_prefix(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    format!(".{name}.")
}

/// Gives the permissions that other programs' new files have (the umask
/// applies), not those of private temporary files.
fn set_mode(builder: &mut tempfile::Builder<'_, '_>, mode: u32) {
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode));
    #[cfg(not(unix))]
    let _ = (builder, mode);
}
