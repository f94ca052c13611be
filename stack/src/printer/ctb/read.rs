//! Reads the pages of CTB files, in order or by their number.

use crate::codec::compression::Compression;
use crate::codec::tiff::{ByteSource, Page, PanelPage};
use crate::error::{PageFault, StackError, malformed};
use crate::layer::page_info::{PageInfo, StackInfo};
use crate::limits::Limits;
use crate::printer::ctb::tables::{
    HEADER_BYTES, Header, LAYER_BYTES, PRINT_BYTES, ROW_BYTES, Row, SLICER_BYTES, Slicer,
    VERSION_4_BYTES, record,
};
use crate::printer::ctb::{MAGIC, MAGIC_4, MAGIC_CBDDLP, MAGIC_ENCRYPTED, rle};
use crate::printer::fault::PrinterFault;
use crate::printer::panel::{orientation, pitch};
use crate::printer::total::ReadHeight;
use crate::record::PrintRecord;

/// Reads a CTB file.
#[derive(Debug)]
pub(crate) struct CtbReader {
    record: PrintRecord,
    key: u32,
    layers: Vec<(Row, PageInfo)>,
    next: u32,
}

impl CtbReader {
    /// Returns whether a file that starts with these bytes is a CTB file, or of a related format.
    pub(crate) fn is_start(start: &[u8]) -> bool {
        magic(start)
            .is_some_and(|magic| [MAGIC, MAGIC_4, MAGIC_CBDDLP, MAGIC_ENCRYPTED].contains(&magic))
    }

    /// Reads all tables of a file, which start so.
    pub(crate) fn new(source: &mut ByteSource, start: &[u8]) -> Result<Self, StackError> {
        let found = match magic(start) {
            Some(MAGIC_ENCRYPTED) => Some("encrypted"),
            Some(MAGIC_CBDDLP) => Some("CBDDLP"),
            _ => None,
        };
        if let Some(found) = found {
            let read = "CTB 2 to 5, unencrypted,";
            return Err(PrinterFault::Version { found: found.to_owned(), read }.into());
        }
        // Tables lie before and behind the images that they are of.
        if source.file()?.is_none() {
            return Err(PrinterFault::Piped("a CTB file").into());
        }
        let header = Header::new(&exactly(source, 0, HEADER_BYTES)?)?;
        let print = exactly(source, header.print_at.into(), PRINT_BYTES)?;
        let slicer = match header.slicer_at {
            0 => Slicer::default(),
            at => Slicer::new(&exactly(source, at.into(), SLICER_BYTES)?),
        };
        let version_4 = match slicer.version_4_at {
            at @ 1.. if header.version >= 4 => Some(exactly(source, at.into(), VERSION_4_BYTES)?),
            _ => None,
        };
        let name = exactly(source, slicer.name_at.into(), slicer.name_bytes.into())?;
        let name = String::from_utf8_lossy(&name).trim_matches(['\0', ' ']).to_owned();
        let mut record = record(&header, &print, &slicer, version_4.as_deref(), name);
        let rows = exactly(source, header.layers_at.into(), ROW_BYTES * u64::from(header.layers))?;
        let mut height = ReadHeight::default();
        let mut layers = Vec::with_capacity(header.layers as usize);
        for (number, bytes) in (0..).zip(rows.chunks_exact(ROW_BYTES as usize)) {
            let row = Row::new(bytes);
            let numbers = match slicer.has_steps && header.has_layer_numbers() {
                true => {
                    let at =
                        row.at.checked_sub(LAYER_BYTES).ok_or(PrinterFault::Damaged("layer"))?;
                    let bytes = source.read_up_to(at, LAYER_BYTES)?;
                    // A file that is cut off has the layers before.
                    if (bytes.len() as u64) < LAYER_BYTES {
                        break;
                    }
                    Some(bytes)
                }
                false => None,
            };
            let step = row.step(record.step(number), numbers.as_deref(), header.version);
            if number == 0 && record.first_layers > 0 {
                // The tables of the print lack some of its numbers.
                record.first = step;
            }
            layers.push((row, height.info(&record, number, row.top_mm, step)?));
        }
        if layers.is_empty() && header.layers > 0 {
            return Err(StackError::CutOff { last_whole: None });
        }
        if !(record.first.is_finite() && record.normal.is_finite()) {
            return Err(PrinterFault::Damaged("table of the print").into());
        }
        if let Some((_, first)) = layers.first_mut() {
            let mut stack = StackInfo { layers: Some(header.layers), ..StackInfo::default() };
            stack.set_print_record(&record);
            first.stack = Some(stack);
        }
        Ok(Self { record, key: header.key, layers, next: 0 })
    }

    /// Returns the next page, or `None` behind the last. Without `images`, it cannot be decoded.
    pub(crate) fn next(
        &mut self,
        source: &mut ByteSource,
        limits: &Limits,
        images: bool,
    ) -> Result<Option<Page>, StackError> {
        let page = self.page_at(self.next, source, limits, images)?;
        self.next += 1;
        Ok(page)
    }

    /// Returns a page by its number.
    pub(crate) fn page(
        &mut self,
        number: u32,
        source: &mut ByteSource,
        limits: &Limits,
    ) -> Result<Option<Page>, StackError> {
        self.page_at(number, source, limits, true)
    }

    fn page_at(
        &self,
        number: u32,
        source: &mut ByteSource,
        limits: &Limits,
        images: bool,
    ) -> Result<Option<Page>, StackError> {
        let Some((row, info)) = self.layers.get(number as usize) else {
            let stated = self.layers.first().and_then(|(_, info)| info.stack.as_ref()?.layers);
            let is_cut = stated.is_some_and(|stated| number < stated);
            let last_whole = number.checked_sub(1);
            return if is_cut { Err(StackError::CutOff { last_whole }) } else { Ok(None) };
        };
        let size = self.record.panel_px;
        let fault = |fault| malformed(number, fault);
        if let Some(side) = size.into_iter().find(|side| *side > limits.side) {
            return Err(fault(PageFault::Side(side.into())));
        }
        // A pixel takes at most two bytes: its level, and a length of one.
        if u64::from(row.bytes) > 2 * u64::from(size[0]) * u64::from(size[1]) {
            return Err(fault(PageFault::PieceBytes(row.bytes.into())));
        }
        let mut data = source.read_up_to(row.at, row.bytes.into())?;
        if data.len() < row.bytes as usize {
            return Err(StackError::CutOff { last_whole: number.checked_sub(1) });
        }
        rle::crypt(&mut data, self.key, number);
        let page = PanelPage {
            number,
            info: info.clone(),
            pitch: pitch(&self.record),
            size,
            gray: rle::is_gray(&data).map_err(fault)?,
            orientation: orientation(self.record.mirrored),
            compression: Compression::Ctb,
        };
        Ok(Some(Page::of_panel(page, *limits, data, images)))
    }
}

fn magic(start: &[u8]) -> Option<u32> {
    start.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))
}

/// Reads exactly `length` bytes of the tables.
fn exactly(source: &mut ByteSource, at: u64, length: u64) -> Result<Vec<u8>, StackError> {
    let bytes = source.read_up_to(at, length)?;
    match bytes.len() as u64 == length {
        true => Ok(bytes),
        false => Err(StackError::CutOff { last_whole: None }),
    }
}
