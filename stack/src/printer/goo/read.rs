//! Reads the pages of GOO files, in order or by their number.

use crate::codec::compression::Compression;
use crate::codec::tiff::{ByteSource, Page, PanelPage};
use crate::error::{PageFault, StackError, malformed};
use crate::layer::page_info::{PageInfo, StackInfo};
use crate::limits::Limits;
use crate::printer::fault::PrinterFault;
use crate::printer::goo::header::{
    GooHeader, GooLayer, LAYER_BYTES, NUMBER_BYTES, NUMBERS_AT, TEXT_BYTES, TEXTS_AT, footer,
};
use crate::printer::goo::{MAGIC, VERSION, rle};
use crate::printer::panel::{orientation, pitch};
use crate::printer::total::{PAUSE, ReadHeight};

/// Reads a GOO file behind its first eight bytes.
#[derive(Debug)]
pub(crate) struct GooReader {
    version: [u8; 4],
    header: Option<GooHeader>,
    next: Cursor,
    /// Where each layer is, once pages are read by their number.
    index: Option<Vec<Cursor>>,
}

/// The place of a layer, and what came before it.
#[derive(Clone, Copy, Debug)]
struct Cursor {
    number: u32,
    offset: u64,
    height: ReadHeight,
}

impl GooReader {
    /// Returns whether a file that starts with these bytes is a GOO file, of any version.
    pub(crate) fn is_start(start: &[u8]) -> bool {
        matches!(start, [b'V', b'0'..=b'9', b'.', b'0'..=b'9', rest @ ..] if rest == &MAGIC[..4])
    }

    /// Starts behind the eight bytes.
    pub(crate) fn new(start: &[u8]) -> Self {
        let version = [start[0], start[1], start[2], start[3]];
        let next = Cursor { number: 0, offset: 0, height: ReadHeight::default() };
        Self { version, header: None, next, index: None }
    }

    /// Returns the next page, or `None` behind the last. Without `images`, it cannot be decoded.
    pub(crate) fn next(
        &mut self,
        source: &mut ByteSource,
        limits: &Limits,
        images: bool,
    ) -> Result<Option<Page>, StackError> {
        let header = self.header(source)?;
        if self.next.number == header.layers {
            let last = header.layers.checked_sub(1);
            let wanted = footer();
            let end = read(source, self.next.offset, wanted.len() as u64, last)?;
            return if end == wanted { Ok(None) } else { Err(PrinterFault::Damaged("end").into()) };
        }
        let (page, next) = read_layer(&header, self.next, source, limits, images)?;
        self.next = next;
        Ok(Some(page))
    }

    /// Returns a page of a file by its number.
    pub(crate) fn page(
        &mut self,
        number: u32,
        source: &mut ByteSource,
        limits: &Limits,
    ) -> Result<Option<Page>, StackError> {
        let header = self.header(source)?;
        if self.index.is_none() {
            // Layers state their length, so their numbers lead from one to the next.
            let mut at = self.first(&header);
            let mut index = Vec::new();
            for _ in 0..header.layers {
                index.push(at);
                match place_of(&header, at, source) {
                    Ok((_, _, next)) => at = next,
                    // A file that is cut off has the layers before.
                    Err(_) => break,
                }
            }
            self.index = Some(index);
        }
        let at = self.index.as_ref().and_then(|index| index.get(number as usize).copied());
        at.map(|at| Ok(read_layer(&header, at, source, limits, true)?.0)).transpose()
    }

    fn first(&self, header: &GooHeader) -> Cursor {
        Cursor { number: 0, offset: header.layers_at, height: ReadHeight::default() }
    }

    fn header(&mut self, source: &mut ByteSource) -> Result<GooHeader, StackError> {
        if let Some(header) = &self.header {
            return Ok(header.clone());
        }
        if self.version != *VERSION {
            let found = self.version.escape_ascii().to_string();
            return Err(PrinterFault::Version { found, read: "V3.0" }.into());
        }
        // The eight bytes before them are read already, and a stream goes forward.
        let texts = read(source, 8, TEXTS_AT - 8 + TEXT_BYTES, None)?;
        if texts[..4] != MAGIC[4..] {
            return Err(PrinterFault::Damaged("header").into());
        }
        let numbers = read(source, NUMBERS_AT, NUMBER_BYTES, None)?;
        let header = GooHeader::new(&texts[4..], &numbers)?;
        self.next = self.first(&header);
        Ok(self.header.insert(header).clone())
    }
}

/// Reads exactly `length` bytes; a file without them is cut off behind the layer `last_whole`.
fn read(
    source: &mut ByteSource,
    offset: u64,
    length: u64,
    last_whole: Option<u32>,
) -> Result<Vec<u8>, StackError> {
    let bytes = source.read_up_to(offset, length)?;
    if (bytes.len() as u64) < length { Err(StackError::CutOff { last_whole }) } else { Ok(bytes) }
}

/// Reads a layer's numbers. Returns them, its metadata and the place of the next layer.
fn place_of(
    header: &GooHeader,
    at: Cursor,
    source: &mut ByteSource,
) -> Result<(GooLayer, PageInfo, Cursor), StackError> {
    let Cursor { number, offset, mut height } = at;
    let numbers = read(source, offset, LAYER_BYTES, number.checked_sub(1))?;
    let layer = GooLayer::new(&numbers, header.is_little_endian)?;
    let step = if header.has_steps { layer.step } else { header.record.step(number) };
    let mut info = height.info(&header.record, number, layer.top_mm, step)?;
    if layer.pauses {
        info.other.insert(PAUSE.to_owned(), true.into());
    }
    // A delimiter of two bytes follows the image.
    let offset = offset + LAYER_BYTES + u64::from(layer.bytes) + 2;
    Ok((layer, info, Cursor { number: number + 1, offset, height }))
}

fn read_layer(
    header: &GooHeader,
    at: Cursor,
    source: &mut ByteSource,
    limits: &Limits,
    images: bool,
) -> Result<(Page, Cursor), StackError> {
    let (layer, mut info, next) = place_of(header, at, source)?;
    let record = &header.record;
    let size = record.panel_px;
    let fault = |fault| malformed(at.number, fault);
    if let Some(side) = size.into_iter().find(|side| *side > limits.side) {
        return Err(fault(PageFault::Side(side.into())));
    }
    // A chunk has a pixel, and at most two bytes for each; a few more are magic.
    let most = 2 * u64::from(size[0]) * u64::from(size[1]) + 16;
    if u64::from(layer.bytes) > most {
        return Err(fault(PageFault::PieceBytes(layer.bytes.into())));
    }
    let last = at.number.checked_sub(1);
    let data = read(source, at.offset + LAYER_BYTES, layer.bytes.into(), last)?;
    if at.number == 0 {
        let mut stack = StackInfo { layers: Some(header.layers), ..StackInfo::default() };
        stack.set_print_record(record);
        info.stack = Some(stack);
    }
    let page = PanelPage {
        number: at.number,
        info,
        pitch: pitch(record),
        size,
        gray: rle::is_gray(&data).map_err(fault)?,
        orientation: orientation(record.mirrored),
        compression: Compression::Goo,
    };
    Ok((Page::of_panel(page, *limits, data, images), next))
}
