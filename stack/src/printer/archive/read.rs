//! Reads the pages of archives, in order or by their number.

use std::fmt;
use std::fs::File;
use std::io::{BufReader, Read, Seek};

use zip::ZipArchive;
use zip::result::ZipError;

use crate::codec::compression::Compression;
use crate::codec::tiff::{Page, PanelPage};
use crate::error::{PageFault, StackError, malformed};
use crate::layer::page_info::{PageInfo, StackInfo};
use crate::limits::Limits;
use crate::printer::archive::{Plate, klipper, nanodlp, png, sl1, uvj};
use crate::printer::fault::PrinterFault;
use crate::printer::panel::pitch;
use crate::printer::total::{PAUSE, ReadHeight};

/// The most bytes of a text: layers take a few hundred each.
const MOST_TEXT: u64 = 64 << 20;
/// The bytes at a PNG's start that have its size, if its image is passed over.
const PNG_START: u64 = 1 << 16;

/// A ZIP archive.
pub(crate) struct Archive {
    files: ZipArchive<BufReader<File>>,
}

impl From<ZipError> for PrinterFault {
    fn from(error: ZipError) -> Self {
        Self::Archive(error.to_string())
    }
}

impl Archive {
    /// Returns the names of its files, in order; a name that is no UTF-8 is replaced in part.
    pub(crate) fn names(&self) -> impl Iterator<Item = String> {
        self.files.file_names_raw().map(|name| String::from_utf8_lossy(name).into_owned())
    }

    fn number(&self, name: &str) -> Option<usize> {
        self.names().position(|it| it == name)
    }

    /// Reads a text, if there is one of this name.
    pub(crate) fn text(&mut self, name: &str) -> Result<Option<Vec<u8>>, StackError> {
        let Some(number) = self.number(name) else { return Ok(None) };
        let bytes = self.bytes(number, MOST_TEXT + 1)?;
        if bytes.len() as u64 > MOST_TEXT {
            let problem = format!("it has more than {MOST_TEXT} bytes");
            return Err(PrinterFault::Text { file: name.to_owned(), problem }.into());
        }
        Ok(Some(bytes))
    }

    /// Reads up to `most` bytes of a file.
    fn bytes(&mut self, number: usize, most: u64) -> Result<Vec<u8>, StackError> {
        let file = self.files.by_index(number).map_err(PrinterFault::from)?;
        let mut bytes = Vec::new();
        let read = file.take(most).read_to_end(&mut bytes);
        read.map_err(|error| PrinterFault::Archive(error.to_string()))?;
        Ok(bytes)
    }
}

/// Reads a printer's file that is an archive.
pub(crate) struct ArchiveReader {
    archive: Archive,
    plate: Plate,
    infos: Vec<PageInfo>,
    next: u32,
}

impl fmt::Debug for ArchiveReader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ArchiveReader").field("plate", &self.plate).finish_non_exhaustive()
    }
}

impl ArchiveReader {
    /// Returns whether a file that starts with these bytes is a ZIP archive.
    pub(crate) fn is_start(start: &[u8]) -> bool {
        start.starts_with(b"PK\x03\x04")
    }

    /// Opens an archive, or returns `None` if it is no printer's.
    pub(crate) fn new(mut file: File) -> Result<Option<Self>, StackError> {
        file.rewind()?;
        let Ok(files) = ZipArchive::new(BufReader::new(file)) else { return Ok(None) };
        let mut archive = Archive { files };
        let plate = match () {
            () if archive.number(nanodlp::PLATE).is_some() => nanodlp::read(&mut archive)?,
            () if archive.number(sl1::CONFIG).is_some() => sl1::read(&mut archive)?,
            () if archive.number(uvj::CONFIG).is_some() => uvj::read(&mut archive)?,
            () if klipper::is_one(&archive) => klipper::read(&mut archive)?,
            () => return Ok(None),
        };
        let record = &plate.record;
        let mut height = ReadHeight::default();
        let layers = (0..).zip(&plate.layers);
        let infos = layers.map(|(index, it)| {
            let mut info = height.info(record, index, it.top_mm, it.step)?;
            if it.pauses {
                info.other.insert(PAUSE.to_owned(), true.into());
            }
            Ok::<_, PrinterFault>(info)
        });
        let infos = infos.collect::<Result<Vec<_>, _>>()?;
        Ok(Some(Self { archive, plate, infos, next: 0 }))
    }

    /// Returns the next page, or `None` behind the last. Without `images`, it cannot be decoded.
    pub(crate) fn next(
        &mut self,
        limits: &Limits,
        images: bool,
    ) -> Result<Option<Page>, StackError> {
        let page = self.page(self.next, limits, images)?;
        self.next += 1;
        Ok(page)
    }

    /// Returns a page by its number.
    pub(crate) fn page(
        &mut self,
        number: u32,
        limits: &Limits,
        images: bool,
    ) -> Result<Option<Page>, StackError> {
        let Some(layer) = self.plate.layers.get(number as usize) else { return Ok(None) };
        let most = if images { limits.png_bytes + 1 } else { PNG_START };
        let file = self.archive.bytes(layer.file, most)?;
        if file.len() as u64 > limits.png_bytes {
            return Err(malformed(number, PageFault::PngBytes(limits.png_bytes)));
        }
        let record = &self.plate.record;
        let shape = png::shape(&file, limits).map_err(|fault| fault.on(number))?;
        let is_panel = shape.size == record.panel_px
            || (shape.is_of_triples(record.panel_px[0]) && shape.size[1] == record.panel_px[1]);
        if !is_panel {
            let (size, panel) = (shape.size, record.panel_px);
            return Err(PrinterFault::OtherSize { layer: number, size, panel }.into());
        }
        let mut info = self.infos[number as usize].clone();
        if number == 0 {
            let layers = Some(self.plate.layers.len() as u32);
            let part = self.plate.part.clone();
            let mut stack = StackInfo { part, layers, ..StackInfo::default() };
            stack.set_print_record(record);
            info.stack = Some(stack);
        }
        let page = PanelPage {
            number,
            info,
            pitch: pitch(record),
            size: record.panel_px,
            // Only its pixels say whether it is gray; a mask is decoded as one.
            gray: true,
            orientation: self.plate.orientation,
            compression: Compression::PrinterPng,
        };
        Ok(Some(Page::of_panel(page, *limits, file, images)))
    }

    /// Returns the width and height of an image.
    fn size_of(archive: &mut Archive, file: usize) -> Result<[u32; 2], StackError> {
        let start = archive.bytes(file, PNG_START)?;
        Ok(png::shape(&start, &Limits::default()).map_err(|fault| fault.on(0))?.size)
    }
}

/// Returns the width and height of the first image.
pub(crate) fn first_size(archive: &mut Archive, files: &[usize]) -> Result<[u32; 2], StackError> {
    let first = files.first().ok_or(PrinterFault::Missing("an image".to_owned()))?;
    ArchiveReader::size_of(archive, *first)
}

/// Returns the numbers of the images that `index` gives a layer for, bottom first.
pub(crate) fn images(
    archive: &Archive,
    layers: u32,
    index: impl Fn(&str) -> Option<u32>,
    name: impl Fn(u32) -> String,
) -> Result<Vec<usize>, PrinterFault> {
    // An archive has at least its images, so a false count takes no memory.
    let mut found = vec![None; archive.files.len().min(layers as usize)];
    for (number, file) in archive.names().enumerate() {
        let Some(layer) = index(&file) else { continue };
        if layer >= layers {
            return Err(PrinterFault::MoreImages { stated: layers, layer });
        }
        if let Some(layer) = found.get_mut(layer as usize) {
            *layer = Some(number);
        }
    }
    let missing = (0..layers).find(|layer| found.get(*layer as usize).copied().flatten().is_none());
    match missing {
        Some(layer) => Err(PrinterFault::Missing(name(layer))),
        None => Ok(found.into_iter().flatten().collect()),
    }
}
