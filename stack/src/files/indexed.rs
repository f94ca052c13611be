//! Reads the pages of a stack in any order.

use std::fs::{self, File, Metadata};
use std::io::Seek;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

use crate::codec::tiff::{Page, PageHeader, PageReader};
use crate::error::StackError;
use crate::files::input::{PagePlace, Pages, only_page};
use crate::layer::Layer;
use crate::note::StackNote;
use crate::printer::write::PrinterFormat;

/// A stack whose pages can be read in any order, from several threads.
///
/// ```
/// # fn main() -> Result<(), lamp_stack::StackError> {
/// use lamp_stack::{Destination, Format, IndexedStack, Layer, Mask, PageInfo, write_stack};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("two.tif");
/// let layers = (0..2).map(|index| Layer {
///     info: PageInfo { index, ..PageInfo::default() },
///     pitch: None,
///     image: Mask::black(4, index + 1).into(),
/// });
/// write_stack(layers.map(Ok::<_, lamp_stack::StackError>), Destination::File(path.clone()), Format::Big)?;
///
/// let stack = IndexedStack::open(&path)?;
/// assert_eq!(stack.headers().len(), 2);
/// assert_eq!(stack.layer(1)?.image.height(), 2);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct IndexedStack {
    headers: Vec<PageHeader>,
    end: Option<StackError>,
    notes: Vec<StackNote>,
    source: IndexedSource,
}

#[derive(Debug)]
enum IndexedSource {
    File(Box<FileSource>),
    /// The files of a folder.
    Folder(Vec<(PathBuf, FileStamp)>),
}

#[derive(Debug)]
struct FileSource {
    reader: Mutex<PageReader>,
    /// The same file, to look at while another thread reads.
    file: File,
    stamp: FileStamp,
    /// Where the reader finds the pages.
    places: Vec<u64>,
}

impl IndexedStack {
    /// Opens a stack as [`Pages::open`] does, and reads the text of its pages; images are passed
    /// over. A stack that is cut off or damaged has the pages before the damage, and [`Self::end`]
    /// says why no more follow.
    ///
    /// # Errors
    /// Returns an error if not even the first page can be read.
    pub fn open(path: &Path) -> Result<Self, StackError> {
        if path.is_dir() {
            return Self::read(Pages::open(path)?, |places| {
                let files = places.into_iter().filter_map(|place| match place {
                    PagePlace::File(file) => Some(file),
                    PagePlace::Offset(_) => None,
                });
                let stamped = files.map(|file| {
                    let stamp = FileStamp::of(&fs::metadata(&file)?);
                    Ok((file, stamp))
                });
                Ok(IndexedSource::Folder(stamped.collect::<Result<_, StackError>>()?))
            });
        }
        Self::from_file(File::open(path)?).map_err(|error| PrinterFormat::explain(path, error))
    }

    /// Reads an open file from its start, as [`Self::open`] does.
    ///
    /// # Errors
    /// Returns an error if not even the first page can be read.
    pub fn from_file(file: File) -> Result<Self, StackError> {
        let stamp = FileStamp::of(&file.metadata()?);
        // The file may have been read before it came here.
        (&file).rewind()?;
        Self::read(Pages::from_file(file.try_clone()?)?, |places| {
            let places = places.into_iter().filter_map(|place| match place {
                PagePlace::Offset(offset) => Some(offset),
                PagePlace::File(_) => None,
            });
            // A clone shares its position with the file, which reading has moved.
            (&file).rewind()?;
            let reader = Mutex::new(PageReader::from_file(file.try_clone()?)?);
            let places = places.collect();
            Ok(IndexedSource::File(Box::new(FileSource { reader, file, stamp, places })))
        })
    }

    fn read(
        pages: Pages,
        source: impl FnOnce(Vec<PagePlace>) -> Result<IndexedSource, StackError>,
    ) -> Result<Self, StackError> {
        let mut pages = pages.without_images();
        let (mut headers, mut places, mut end) = (Vec::new(), Vec::new(), None);
        loop {
            let place = pages.next_place();
            match pages.next() {
                Some(Ok(page)) => {
                    headers.push(page.header());
                    places.extend(place);
                }
                Some(Err(error)) if headers.is_empty() => return Err(error),
                // Also where the files are at an end, and the stack is not.
                Some(Err(error)) => end = Some(error),
                None => break,
            }
        }
        Ok(Self { headers, end, notes: pages.notes().to_vec(), source: source(places)? })
    }

    /// Returns the headers of the pages, bottom first: at least one.
    pub fn headers(&self) -> &[PageHeader] {
        &self.headers
    }

    /// Returns why no pages follow the last, if that is not the stack's end.
    pub fn end(&self) -> Option<&StackError> {
        self.end.as_ref()
    }

    /// Returns the notes on what was found besides the layers.
    pub fn notes(&self) -> &[StackNote] {
        &self.notes
    }

    /// Returns the stack if it is not cut off or damaged.
    ///
    /// # Errors
    /// Returns why no pages follow the last, if that is not the stack's end.
    pub fn into_whole(self) -> Result<Self, StackError> {
        match self.end {
            Some(end) => Err(end),
            None => Ok(self),
        }
    }

    /// Reads a page by its position from the bottom.
    ///
    /// # Errors
    /// Returns an error if the page cannot be read, or if its file has changed.
    ///
    /// # Panics
    /// Panics if there are not as many pages.
    pub fn page(&self, position: usize) -> Result<Page, StackError> {
        let before = position.checked_sub(1).map(|before| self.headers[before].info.index);
        let number = position as u32;
        match &self.source {
            IndexedSource::File(source) => {
                source.stamp.check(&source.file.metadata()?)?;
                // A reader that panicked is sent to an offset, too.
                let mut reader = source.reader.lock().unwrap_or_else(PoisonError::into_inner);
                reader.number_from(number, before);
                reader.at_place(source.places[position])?.ok_or(StackError::Changed)
            }
            IndexedSource::Folder(files) => {
                let (path, stamp) = &files[position];
                let file = File::open(path)?;
                // The open file counts: its name may be another file's by now.
                stamp.check(&file.metadata()?)?;
                only_page(&mut PageReader::from_file(file)?.numbered(number, before))
            }
        }
    }

    /// Reads and decodes a page by its position from the bottom.
    ///
    /// # Errors
    /// Returns an error if the page cannot be read or decoded, or if its file has changed.
    ///
    /// # Panics
    /// Panics if there are not as many pages.
    pub fn layer(&self, position: usize) -> Result<Layer, StackError> {
        self.page(position)?.decode()
    }
}

/// The facts that show whether a file was written to: its size, and the time of the last change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileStamp {
    bytes: u64,
    modified: Option<SystemTime>,
}

impl FileStamp {
    /// Returns the stamp of a file as it is.
    pub fn of(file: &Metadata) -> Self {
        Self { bytes: file.len(), modified: file.modified().ok() }
    }

    fn check(&self, file: &Metadata) -> Result<(), StackError> {
        if *self == Self::of(file) { Ok(()) } else { Err(StackError::Changed) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::mask_of;
    use crate::{Destination, FolderBeside, Format, PageInfo, write_stack};

    fn layers() -> Vec<Layer> {
        let layer = |index| Layer {
            info: PageInfo { index, ..PageInfo::default() },
            pitch: None,
            image: mask_of(90, [&[index, 40][..], &[3, 50 + index]]).into(),
        };
        (0..5).map(layer).collect()
    }

    fn written(to: Destination) {
        write_stack(layers().into_iter().map(Ok::<_, StackError>), to, Format::Big).unwrap();
    }

    #[test]
    fn pages_are_read_in_any_order() {
        let folder = tempfile::tempdir().unwrap();
        let (file, pages) = (folder.path().join("a.tif"), folder.path().join("pages"));
        written(Destination::File(file.clone()));
        written(Destination::Folder(FolderBeside::over_nothing(&pages).unwrap()));
        for path in [file, pages] {
            let stack = IndexedStack::open(&path).unwrap();
            assert!(stack.end().is_none());
            for position in [3, 0, 4, 4, 1, 2] {
                assert_eq!(stack.layer(position).unwrap().image, layers()[position].image);
                assert_eq!(stack.headers()[position].info.index, position as u32);
            }
        }
    }

    #[test]
    fn a_stack_cut_off_keeps_its_first_layers() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.tif");
        written(Destination::File(path.clone()));
        let bytes = fs::read(&path).unwrap();
        for length in [bytes.len() - 9, bytes.len() / 2, bytes.len() / 4, 16, 9] {
            fs::write(&path, &bytes[..length]).unwrap();
            match IndexedStack::open(&path) {
                Ok(stack) => {
                    let whole = stack.headers().len();
                    assert!(matches!(stack.end(), Some(StackError::CutOff { .. })), "{length}");
                    assert_eq!(stack.layer(whole - 1).unwrap().image, layers()[whole - 1].image);
                    assert!(stack.into_whole().is_err());
                }
                Err(error) => assert!(matches!(error, StackError::CutOff { .. }), "{error}"),
            }
        }
    }

    #[test]
    fn a_folder_without_its_last_pages_is_cut_off() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pages");
        written(Destination::Folder(FolderBeside::over_nothing(&path).unwrap()));
        for (last, left) in [("layer_00004.tif", 4), ("layer_00003.tif", 3)] {
            fs::remove_file(path.join(last)).unwrap();
            let stack = IndexedStack::open(&path).unwrap();
            assert_eq!(stack.headers().len(), left);
            assert!(matches!(stack.end(), Some(StackError::EndedEarly { .. })));
            assert!(stack.into_whole().is_err());
        }
    }

    #[test]
    fn a_file_that_changes_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.tif");
        written(Destination::File(path.clone()));
        let stack = IndexedStack::open(&path).unwrap();
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert!(matches!(stack.layer(4), Err(StackError::Changed)));
        // A file that takes the name of the one that was opened does not disturb it.
        fs::write(&path, &bytes).unwrap();
        let stack = IndexedStack::open(&path).unwrap();
        fs::remove_file(&path).unwrap();
        fs::write(&path, b"other").unwrap();
        assert_eq!(stack.layer(4).unwrap().image, layers()[4].image);
    }
}
