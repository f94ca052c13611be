//! Writes archives.

use std::io::{self, Write};

use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::error::StackError;
use crate::printer::archive::png::encode_levels;
use crate::printer::archive::{klipper, nanodlp, sl1, uvj};
use crate::printer::total::PrintLayer;
use crate::printer::write::{CodedLayer, Print, PrinterFile, PrinterFormat, PrinterWriter};

/// Writes an archive: its images as they come, then its texts.
pub(crate) struct ArchiveWriter {
    zip: ZipWriter<PrinterFile>,
    format: PrinterFormat,
    /// The part's name, which the names of some images begin with.
    part: String,
    layers: Vec<PrintLayer>,
}

/// Returns the failure to write, as it came from the disk.
fn failed(error: ZipError) -> StackError {
    match error {
        ZipError::Io(error) => error.into(),
        error => io::Error::other(error).into(),
    }
}

impl ArchiveWriter {
    pub(crate) fn new(out: PrinterFile, format: PrinterFormat, part: &str) -> Self {
        Self { zip: ZipWriter::new(out), format, part: part.to_owned(), layers: Vec::new() }
    }

    fn put(
        &mut self,
        name: &str,
        bytes: &[u8],
        method: CompressionMethod,
    ) -> Result<(), StackError> {
        // The options have no date: the same stack gives the same bytes.
        let options = SimpleFileOptions::default().compression_method(method);
        self.zip.start_file(name, options).map_err(failed)?;
        Ok(self.zip.write_all(bytes)?)
    }

    fn put_text(&mut self, name: &str, text: &str) -> Result<(), StackError> {
        self.put(name, text.as_bytes(), CompressionMethod::Deflated)
    }

    fn put_picture(
        &mut self,
        name: &str,
        size: [u32; 2],
        print: &Print<'_>,
    ) -> Result<(), StackError> {
        let picture = encode_levels(&print.view.draw(size), size);
        self.put(name, &picture, CompressionMethod::Stored)
    }
}

impl PrinterWriter for ArchiveWriter {
    fn push(&mut self, added: &PrintLayer, coded: &CodedLayer) -> Result<(), StackError> {
        let number = self.layers.len() as u32;
        let name = match self.format {
            PrinterFormat::NanoDlp => nanodlp::image_name(number),
            PrinterFormat::Sl1 => sl1::image_name(&sl1::job_name(&self.part), number),
            PrinterFormat::Klipper => klipper::image_name(number),
            _ => uvj::image_name(number),
        };
        self.layers.push(*added);
        // It is packed already.
        self.put(&name, &coded.code, CompressionMethod::Stored)
    }

    fn finish(mut self: Box<Self>, print: &Print<'_>) -> Result<(), StackError> {
        match self.format {
            PrinterFormat::NanoDlp => {
                for (name, text) in nanodlp::texts(print) {
                    self.put_text(name, &text.to_string())?;
                }
                self.put_picture(nanodlp::PICTURE, [800, 480], print)?;
            }
            PrinterFormat::Sl1 => {
                for (name, text) in sl1::texts(print) {
                    self.put_text(name, &text)?;
                }
                for [width, height] in [[400, 400], [800, 480]] {
                    let name = format!("thumbnail/thumbnail{width}x{height}.png");
                    self.put_picture(&name, [width, height], print)?;
                }
            }
            PrinterFormat::Klipper => {
                let layers = std::mem::take(&mut self.layers);
                self.put(klipper::MARK, &[], CompressionMethod::Stored)?;
                let gcode = klipper::gcode(print, &layers);
                self.put_text(&klipper::gcode_name(&self.part), &gcode)?;
                for (name, size) in klipper::PICTURES {
                    self.put_picture(name, size, print)?;
                }
            }
            _ => {
                let layers = std::mem::take(&mut self.layers);
                self.put_text(uvj::CONFIG, &uvj::text(print, &layers))?;
                for (name, size) in uvj::PICTURES {
                    self.put_picture(name, size, print)?;
                }
            }
        }
        Ok(self.zip.finish().map_err(failed)?.flush()?)
    }
}
