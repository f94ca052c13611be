//! Reads stacks from a file, a folder of pages or a stream.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::check::ChainReader;
use crate::error::StackError;
use crate::layer::Layer;
use crate::limits::Limits;
use crate::ordered::map_in_order;
use crate::picture_page::PictureFormat;
use crate::tiff::{Format, Page, PageHeader, PageReader};

/// An iterator over the pages of a stack, bottom first.
#[derive(Debug)]
pub struct Pages {
    source: Source,
    limits: Limits,
    count: u32,
    /// The number of pages that the first page states.
    stated: Option<u32>,
    last_whole: Option<u32>,
    /// `None` if checks are ignored.
    chain: Option<ChainReader>,
    images: bool,
    ended: bool,
}

#[derive(Debug)]
enum Source {
    /// A file or a stream.
    One(PageReader),
    /// A folder: the unread files, last first.
    Folder(Vec<PathBuf>),
}

impl Pages {
    /// Opens a TIFF file, a picture file, or a folder of single-page TIFF files or of pictures
    /// of one format. Files of a folder are ordered by name, with numbers in names compared as
    /// numbers.
    ///
    /// # Errors
    /// Returns an error if the input cannot be read or is of no such format, or if a folder
    /// holds pages of several.
    pub fn open(path: &Path) -> Result<Self, StackError> {
        let source = if path.is_dir() {
            let files = page_files(path)?;
            if files.is_empty() {
                return Err(StackError::NoPages);
            }
            Source::Folder(files)
        } else {
            Source::One(PageReader::from_file(File::open(path)?)?)
        };
        Ok(Self::new(source))
    }

    /// Reads an open TIFF or picture file from its start.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read or is of no such format.
    pub fn from_file(file: File) -> Result<Self, StackError> {
        Ok(Self::new(Source::One(PageReader::from_file(file)?)))
    }

    /// Reads a stack from a stream, such as standard input.
    ///
    /// # Errors
    /// Returns an error if the stream is empty or is neither a TIFF nor a picture.
    pub fn from_stream(stream: impl Read + Send + 'static) -> Result<Self, StackError> {
        Ok(Self::new(Source::One(PageReader::from_stream(stream)?)))
    }

    fn new(source: Source) -> Self {
        Self {
            source,
            limits: Limits::default(),
            count: 0,
            stated: None,
            last_whole: None,
            chain: Some(ChainReader::default()),
            images: true,
            ended: false,
        }
    }

    /// Replaces the default limits of the reader.
    pub fn with_limits(self, limits: Limits) -> Self {
        let source = match self.source {
            Source::One(reader) => Source::One(reader.with_limits(limits)),
            folder @ Source::Folder(_) => folder,
        };
        Self { source, limits, ..self }
    }

    /// Returns the format of a TIFF, or of the one that was packed; [`Format::Big`] of others.
    pub fn format(&self) -> Format {
        match &self.source {
            Source::One(reader) => reader.format(),
            Source::Folder(_) => Format::Big,
        }
    }

    /// Returns the format that [`write_packed`](crate::write_packed) was given, of a packed stack.
    pub fn packed_format(&self) -> Option<Format> {
        match &self.source {
            Source::One(reader) => reader.packed_format(),
            Source::Folder(_) => None,
        }
    }

    /// Returns the layers in order, decoded on all threads.
    pub fn layers(self) -> impl Iterator<Item = Result<Layer, StackError>> {
        map_in_order(self, Page::decode)
    }

    /// Ignores the checks of pages: images and texts that another program has changed are taken
    /// as they are.
    pub fn without_checks(self) -> Self {
        Self { chain: None, ..self }
    }

    /// Returns what the pages say without their images, in order. Data is passed over.
    pub fn headers(self) -> impl Iterator<Item = Result<PageHeader, StackError>> {
        self.without_images().map(|page| page.map(|page| page.header()))
    }

    /// Passes over the data of images: the pages cannot be decoded.
    pub(crate) fn without_images(mut self) -> Self {
        self.images = false;
        self.source = match self.source {
            Source::One(reader) => Source::One(reader.without_images()),
            folder @ Source::Folder(_) => folder,
        };
        self
    }

    /// Returns where the next page is, if there may be one.
    pub(crate) fn next_place(&self) -> Option<PagePlace> {
        match &self.source {
            Source::One(reader) => Some(PagePlace::Offset(reader.next_place())),
            Source::Folder(files) => files.last().cloned().map(PagePlace::File),
        }
    }

    fn next_page(&mut self) -> Option<Result<Page, StackError>> {
        match &mut self.source {
            Source::One(reader) => reader.next(),
            Source::Folder(files) => {
                let file = files.pop()?;
                let page = self.page_of_file(&file);
                Some(page.map_err(|source| {
                    let file = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
                    StackError::InFile { file, source: Box::new(source) }
                }))
            }
        }
    }

    /// Reads the single page of a folder's file.
    fn page_of_file(&self, file: &Path) -> Result<Page, StackError> {
        let reader = PageReader::from_file(File::open(file)?)?;
        let reader = reader.with_limits(self.limits).numbered(self.count, self.last_whole);
        only_page(if self.images { reader } else { reader.without_images() })
    }

    /// Checks that a page follows the page before it.
    fn check(&mut self, page: &Page) -> Result<(), StackError> {
        let info = page.info();
        let layer = info.index;
        if self.count == 0 {
            self.stated = info.stack.as_ref().and_then(|stack| stack.layers);
        }
        if matches!(self.source, Source::Folder(_)) {
            // The first page of ours states the stack.
            let follows = match self.last_whole {
                Some(last) => last.checked_add(1) == Some(layer),
                None => info.stack.is_some() || info.z_um.is_none(),
            };
            if !follows {
                return Err(StackError::MissingPage { layer });
            }
        }
        match self.last_whole {
            Some(before) if layer <= before => Err(StackError::Order { layer, before }),
            before => match &mut self.chain {
                Some(chain) => {
                    page.follow(chain, before).map_err(|fault| StackError::Check { layer, fault })
                }
                None => Ok(()),
            },
        }
    }

    /// Checks that no page is missing behind the last.
    fn check_end(&self) -> Result<(), StackError> {
        let (Some(last), Some(chain)) = (self.last_whole, &self.chain) else { return Ok(()) };
        if chain.is_open() {
            return Err(StackError::EndedEarly { last });
        }
        match self.stated {
            Some(stated) if self.count < stated => {
                Err(StackError::MissingPages { found: self.count, stated })
            }
            _ => Ok(()),
        }
    }
}

impl Iterator for Pages {
    type Item = Result<Page, StackError>;

    /// Returns the next page, or `None` after an error.
    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let page = match self.next_page() {
            Some(page) => page.and_then(|page| self.check(&page).map(|()| page)),
            None => {
                self.ended = true;
                return self.check_end().err().map(Err);
            }
        };
        match page {
            Ok(page) => {
                self.count += 1;
                self.last_whole = Some(page.info().index);
                Some(Ok(if self.chain.is_some() { page } else { page.without_check() }))
            }
            Err(error) => {
                self.ended = true;
                Some(Err(error))
            }
        }
    }
}

/// Where a page is.
pub(crate) enum PagePlace {
    /// The offset of its directory in the stack's file, or its number in a packed one.
    Offset(u64),
    /// A file of the stack's folder.
    File(PathBuf),
}

/// Reads the page of a folder's file, which must have one alone.
pub(crate) fn only_page(mut reader: PageReader) -> Result<Page, StackError> {
    let page = reader.next().unwrap_or(Err(StackError::Empty))?;
    if reader.is_at_end() { Ok(page) } else { Err(StackError::SeveralPages) }
}

/// Lists the pages of a folder, last name first: its TIFFs or PNGs, or where there are none its
/// other pictures.
pub(crate) fn page_files(folder: &Path) -> Result<Vec<PathBuf>, StackError> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        files.extend(page_format(&path).map(|format| (format, path)));
    }
    let is_usual = |format: &str| matches!(format, "TIFF" | "PNG");
    if files.iter().any(|(format, _)| is_usual(format)) {
        files.retain(|(format, _)| is_usual(format));
    }
    if let Some(pair) = files.windows(2).find(|pair| pair[0].0 != pair[1].0) {
        let mut formats = [pair[0].0, pair[1].0];
        formats.sort_unstable();
        return Err(StackError::MixedPages { formats });
    }
    let mut files: Vec<PathBuf> = files.into_iter().map(|(_, path)| path).collect();
    files.sort_by_cached_key(|path| name_key(&path.to_string_lossy()));
    files.reverse();
    Ok(files)
}

/// Returns the format of a folder's file by its name, if it is one of pages.
fn page_format(file: &Path) -> Option<&'static str> {
    let extension = file.extension()?.to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "tif" | "tiff" => Some("TIFF"),
        "png" => Some("PNG"),
        extension => PictureFormat::of_extension(extension).map(PictureFormat::name),
    }
}

/// Splits a name into pairs of a text and the number after it, so that `page10` sorts after
/// `page9`.
fn name_key(name: &str) -> Vec<(String, u64)> {
    let mut pieces = vec![(String::new(), 0u64)];
    let mut in_number = false;
    for c in name.chars() {
        if in_number && !c.is_ascii_digit() {
            pieces.push((String::new(), 0));
        }
        in_number = c.is_ascii_digit();
        let (text, number) = pieces.last_mut().expect("there is a first piece");
        match c.to_digit(10) {
            Some(digit) => *number = number.saturating_mul(10).saturating_add(digit.into()),
            None => text.push(c),
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let mut names = [
            "p10.tif",
            "p9.tif",
            "p100.tif",
            "a.tif",
            "p9b.tif",
            "layer_100000.tif",
            "layer_99999.tif",
        ];
        names.sort_by_cached_key(|name| name_key(name));
        assert_eq!(
            names,
            [
                "a.tif",
                "layer_99999.tif",
                "layer_100000.tif",
                "p9.tif",
                "p9b.tif",
                "p10.tif",
                "p100.tif"
            ]
        );
    }
}
