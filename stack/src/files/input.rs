//! Reads stacks from a file, a folder of pages or a stream.

use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::codec::tiff::{Format, Page, PageHeader, PageReader};
use crate::error::StackError;
use crate::files::page_names::PageFiles;
use crate::layer::Layer;
use crate::layer::check::ChainReader;
use crate::limits::Limits;
use crate::note::{ImagesBeside, StackNote};
use crate::ordered::map_in_order;
use crate::printer::write::PrinterFormat;
use crate::record::{FieldRecord, StripRecord};

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
    /// The doubts that names in a folder raise, until the first page shows whether its text proves
    /// more.
    doubts: Vec<StackNote>,
    /// Images of a folder's files that are no layers.
    beside: ImagesBeside,
    notes: Vec<StackNote>,
    listener: Option<Listener>,
}

/// Takes notes as they are found.
struct Listener(Box<dyn FnMut(StackNote) + Send>);

impl fmt::Debug for Listener {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Listener")
    }
}

#[derive(Debug)]
enum Source {
    /// A file or a stream.
    One(Box<PageReader>),
    /// A folder: the unread files, last first.
    Folder(Vec<PathBuf>),
}

impl Pages {
    /// Opens a TIFF file, a picture file, or a folder of single-page TIFF files or of pictures of
    /// one format. Files of a folder are ordered by name, with numbers in names compared as
    /// numbers. Pictures without the names of pages are left out, with a [note](Self::notes).
    ///
    /// # Errors
    /// Returns an error if the input cannot be read or is of no such format, or if a folder
    /// holds pages of several formats, or two with one number.
    pub fn open(path: &Path) -> Result<Self, StackError> {
        if !path.is_dir() {
            return Self::from_file(File::open(path)?)
                .map_err(|error| PrinterFormat::explain(path, error));
        }
        let PageFiles { mut files, doubts, left_out } = PageFiles::of(path)?;
        if files.is_empty() {
            return Err(StackError::NoPages);
        }
        files.reverse();
        Ok(Self { doubts, notes: left_out, ..Self::new(Source::Folder(files)) })
    }

    /// Reads an open TIFF or picture file from its start.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read or is of no such format.
    pub fn from_file(file: File) -> Result<Self, StackError> {
        Ok(Self::new(Source::One(Box::new(PageReader::from_file(file)?))))
    }

    /// Reads a stack from a stream, such as standard input.
    ///
    /// # Errors
    /// Returns an error if the stream is empty or is neither a TIFF nor a picture.
    pub fn from_stream(stream: impl Read + Send + 'static) -> Result<Self, StackError> {
        Ok(Self::new(Source::One(Box::new(PageReader::from_stream(stream)?))))
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
            doubts: Vec::new(),
            beside: ImagesBeside::default(),
            notes: Vec::new(),
            listener: None,
        }
    }

    /// Has `listener` take the notes, each as it is found, instead of [`Self::notes`].
    pub fn with_listener(mut self, mut listener: impl FnMut(StackNote) + Send + 'static) -> Self {
        // Notes on a folder's names came before the listener.
        self.notes.drain(..).for_each(&mut listener);
        Self { listener: Some(Listener(Box::new(listener))), ..self }
    }

    /// Returns the notes on what was found besides the layers so far, unless a listener took them.
    /// Only the end of the stack completes them.
    pub fn notes(&self) -> &[StackNote] {
        &self.notes
    }

    fn note(&mut self, note: StackNote) {
        match &mut self.listener {
            Some(Listener(listener)) => listener(note),
            None => self.notes.push(note),
        }
    }

    /// Replaces the default limits of the reader.
    pub fn with_limits(self, limits: Limits) -> Self {
        let source = match self.source {
            Source::One(reader) => Source::One(Box::new(reader.with_limits(limits))),
            // The files of a folder get their limits as they are opened.
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

    /// Returns the headers of the pages, without images, in order. Data is passed over.
    pub fn headers(self) -> impl Iterator<Item = Result<PageHeader, StackError>> {
        self.without_images().map(|page| page.map(|page| page.header()))
    }

    /// Passes over the data of images: the pages cannot be decoded.
    pub(crate) fn without_images(mut self) -> Self {
        self.images = false;
        self.source = match self.source {
            Source::One(reader) => Source::One(Box::new(reader.without_images())),
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
    fn page_of_file(&mut self, file: &Path) -> Result<Page, StackError> {
        let reader = PageReader::from_file(File::open(file)?)?;
        let reader = reader.with_limits(self.limits).numbered(self.count, self.last_whole);
        let mut reader = if self.images { reader } else { reader.without_images() };
        let page = only_page(&mut reader);
        self.beside.add(reader.beside());
        page
    }

    /// Notes the doubts that names raise, unless the first page has a text of ours, which says
    /// which layers there are.
    fn note_doubts(&mut self, first: &Page) {
        let info = first.info();
        let is_ours = info.stack.is_some() || info.z_um.is_some() || first.image_check().is_some();
        for doubt in std::mem::take(&mut self.doubts) {
            if !is_ours {
                self.note(doubt);
            }
        }
    }

    /// Notes the images of TIFFs that are no layers.
    fn note_images(&mut self) {
        let mut beside = self.beside;
        if let Source::One(reader) = &self.source {
            beside.add(reader.beside());
        }
        if beside.count() > 0 {
            self.note(StackNote::Images(beside));
        }
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
                // Strips of one layer each look like its pages.
                return Err(match is_part_of_layer(page) {
                    true => StackError::PartsOfLayers,
                    false => StackError::MissingPage { layer },
                });
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
                self.note_images();
                return self.check_end().err().map(Err);
            }
        };
        match page {
            Ok(page) => {
                if self.count == 0 {
                    self.note_doubts(&page);
                }
                self.count += 1;
                self.last_whole = Some(page.info().index);
                // With its check, the page would still be compared when it is decoded.
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
pub(crate) fn only_page(reader: &mut PageReader) -> Result<Page, StackError> {
    let page = reader.next().unwrap_or(Err(StackError::Empty))?;
    match reader.next() {
        None => Ok(page),
        Some(_) if is_part_of_layer(&page) => Err(StackError::PartsOfLayers),
        Some(_) => Err(StackError::SeveralPages),
    }
}

/// Returns whether a page is a strip's or a field's.
fn is_part_of_layer(page: &Page) -> bool {
    page.info().has_record::<StripRecord>() || page.info().has_record::<FieldRecord>()
}
