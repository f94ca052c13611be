//! Writes GOO files.

use std::io::{Seek, SeekFrom, Write};

use crate::error::StackError;
use crate::printer::goo::header::{NUMBER_BYTES, NUMBERS_AT, PREVIEWS, footer, header, layer};
use crate::printer::total::PrintLayer;
use crate::printer::write::{CodedLayer, Print, PrinterFile, PrinterWriter};

/// Writes a GOO file, whose header is known last.
pub(crate) struct GooWriter {
    out: PrinterFile,
}

impl GooWriter {
    pub(crate) fn new(mut out: PrinterFile) -> Result<Self, StackError> {
        out.seek(SeekFrom::Start(NUMBERS_AT + NUMBER_BYTES))?;
        Ok(Self { out })
    }
}

impl PrinterWriter for GooWriter {
    fn push(&mut self, added: &PrintLayer, coded: &CodedLayer) -> Result<(), StackError> {
        Ok(self.out.write_all(&layer(added, &coded.code))?)
    }

    fn finish(mut self: Box<Self>, print: &Print<'_>) -> Result<(), StackError> {
        self.out.write_all(&footer())?;
        let previews = PREVIEWS.map(|side| print.view.draw([side, side]));
        self.out.seek(SeekFrom::Start(0))?;
        self.out.write_all(&header(print.record, print.totals, previews))?;
        Ok(self.out.flush()?)
    }
}
