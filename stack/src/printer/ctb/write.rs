//! Writes CTB files.

use std::io::{Seek, SeekFrom, Write};

use crate::error::StackError;
use crate::printer::ctb::tables::{LAYER_BYTES, PREVIEWS, Places, numbers, row};
use crate::printer::fault::PrinterFault;
use crate::printer::total::PrintLayer;
use crate::printer::write::{CodedLayer, Print, PrinterFile, PrinterWriter};
use crate::record::PrintRecord;

/// Writes a CTB file, whose tables stand before the images and are known last.
pub(crate) struct CtbWriter {
    out: PrinterFile,
    places: Places,
    layers: u32,
    rows: Vec<u8>,
    /// Where the next layer begins.
    at: u64,
}

impl CtbWriter {
    /// Starts a file for a number of layers.
    pub(crate) fn new(
        mut out: PrinterFile,
        layers: u32,
        record: &PrintRecord,
    ) -> Result<Self, StackError> {
        let places = Places::new(layers, &record.printer);
        out.seek(SeekFrom::Start(places.end))?;
        Ok(Self { out, places, layers, rows: Vec::new(), at: places.end })
    }
}

impl PrinterWriter for CtbWriter {
    fn push(&mut self, added: &PrintLayer, coded: &CodedLayer) -> Result<(), StackError> {
        let at = self.at + LAYER_BYTES;
        let row = row(added, at, coded.code.len());
        self.out.write_all(&numbers(&row, &added.step, coded.code.len()))?;
        self.out.write_all(&coded.code)?;
        self.rows.extend_from_slice(&row);
        self.at = at + coded.code.len() as u64;
        Ok(())
    }

    fn finish(mut self: Box<Self>, print: &Print<'_>) -> Result<(), StackError> {
        let (stated, layers) = (self.layers, print.totals.layers);
        if stated != layers {
            return Err(PrinterFault::OtherCount { stated, layers }.into());
        }
        let previews = PREVIEWS.map(|side| print.view.draw(side));
        self.out.seek(SeekFrom::Start(0))?;
        self.out.write_all(&self.places.start(print.record, print.totals, previews))?;
        self.out.write_all(&self.rows)?;
        Ok(self.out.flush()?)
    }
}
