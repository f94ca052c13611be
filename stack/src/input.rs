//! Where stacks come from: a file, a folder of pages, a stream.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::StackError;
use crate::layer::{Layer, PageInfo};
use crate::ordered::map_in_order;
use crate::tiff::{Page, PageReader};

/// The pages of a stack, bottom first.
#[derive(Debug)]
pub struct Pages {
    reader: PageReader,
    /// The files of a folder that are still to be read, last first.
    files: Vec<PathBuf>,
    in_folder: bool,
    /// How many pages a folder should have, where its first page says so.
    expected: Option<u32>,
    count: u32,
    last_whole: Option<u32>,
}

impl Pages {
    /// Opens a TIFF file, or a folder of TIFF files (in the order of their
    /// names).
    ///
    /// # Errors
    /// Where nothing can be read there, or it is not a TIFF.
    pub fn open(path: &Path) -> Result<Self, StackError> {
        if !path.is_dir() {
            return Ok(Self::of(PageReader::from_file(File::open(path)?)?));
        }
        let mut files = page_files(path)?;
        let first = files.pop().ok_or(StackError::NoPages)?;
        let mut pages = Self::of(PageReader::from_file(File::open(first)?)?);
        pages.files = files;
        pages.in_folder = true;
        Ok(pages)
    }

    /// Reads a stack as it arrives, such as from standard input.
    ///
    /// # Errors
    /// Where nothing arrives, or it is not a TIFF.
    pub fn from_stream(stream: impl Read + Send + 'static) -> Result<Self, StackError> {
        Ok(Self::of(PageReader::from_stream(stream)?))
    }

    fn of(reader: PageReader) -> Self {
        Self {
            reader,
            files: Vec::new(),
            in_folder: false,
            expected: None,
            count: 0,
            last_whole: None,
        }
    }

    /// The pages' layers, decoded on all threads, in order.
    pub fn layers(self) -> impl Iterator<Item = Result<Layer, StackError>> {
        map_in_order(self, Page::decode)
    }

    fn next_page(&mut self) -> Result<Option<Page>, StackError> {
        loop {
            if let Some(page) = self.reader.next() {
                let page = page?;
                if self.in_folder && !self.reader.is_at_end() {
                    return Err(StackError::SeveralPages { page: self.count });
                }
                if self.in_folder && !self.follows(page.info()) {
                    return Err(StackError::MissingPage { layer: page.info().index });
                }
                return Ok(Some(page));
            }
            match self.files.pop() {
                Some(file) => {
                    self.reader = PageReader::from_file(File::open(file)?)?.numbered(self.count);
                }
                None if self.expected.is_some_and(|expected| self.count < expected) => {
                    self.expected = None;
                    return Err(StackError::CutOff { last_whole: self.last_whole });
                }
                None => return Ok(None),
            }
        }
    }

    /// Whether a folder's page can be the next. The first of ours states the
    /// stack.
    fn follows(&self, info: &PageInfo) -> bool {
        match self.last_whole {
            Some(last) => info.index == last + 1,
            None => info.stack.is_some() || info.z_um.is_none(),
        }
    }
}

impl Iterator for Pages {
    type Item = Result<Page, StackError>;

    /// The next page; nothing good follows an error.
    fn next(&mut self) -> Option<Self::Item> {
        let page = self.next_page().transpose()?;
        match &page {
            Ok(page) => {
                if self.count == 0 && self.in_folder {
                    self.expected = page.info().stack.as_ref().and_then(|stack| stack.layers);
                }
                self.count += 1;
                self.last_whole = Some(page.info().index);
            }
            Err(_) => self.files.clear(),
        }
        Some(page)
    }
}

/// The TIFF files of a folder, last name first.
fn page_files(folder: &Path) -> Result<Vec<PathBuf>, StackError> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        if matches!(extension.as_deref(), Some("tif" | "tiff")) {
            files.push(path);
        }
    }
    files.sort();
    files.reverse();
    Ok(files)
}
