//! Writes stacks as the files of printers.

use std::fmt::{self, Display};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::Arc;

use crate::error::StackError;
use crate::files::output::Destination;
use crate::files::temporary::FileBeside;
use crate::image::Image;
use crate::layer::Layer;
use crate::layer::page_info::{PageInfo, StackInfo};
use crate::ordered::map_in_order;
use crate::printer::fault::PrinterFault;
use crate::printer::goo::write::GooWriter;
use crate::printer::panel::orientation;
use crate::printer::preview::{Covered, TopView};
use crate::printer::total::{PrintLayer, PrintTotals};
use crate::record::PrintRecord;

/// A format of the files of printers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PrinterFormat {
    /// Elegoo's GOO, version 3.
    Goo,
}

impl PrinterFormat {
    /// All formats, and the endings of the names of their files.
    pub const ALL: [(Self, &'static [&'static str]); 1] = [(Self::Goo, &["goo"])];

    /// Returns the format that a file's name ends in.
    pub fn of_name(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
        let found = Self::ALL.iter().find(|(_, endings)| endings.contains(&&*ending));
        found.map(|(format, _)| *format)
    }

    /// Returns the most columns and rows that a file can state.
    fn most_side(self) -> u32 {
        match self {
            Self::Goo => super::goo::header::MOST_SIDE,
        }
    }
}

impl Display for PrinterFormat {
    /// Formats as a name with an article, such as `a GOO file`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl PrinterFormat {
    fn name(self) -> &'static str {
        match self {
            Self::Goo => "a GOO file",
        }
    }
}

/// The file that is being written.
pub(super) type PrinterFile = BufWriter<Arc<File>>;

/// What the files of all formats state at their end, or once they are whole.
pub(super) struct Print<'a> {
    pub(super) record: &'a PrintRecord,
    pub(super) totals: &'a PrintTotals,
    pub(super) view: &'a TopView,
}

/// A layer that is coded.
pub(super) struct CodedLayer {
    pub(super) info: PageInfo,
    pub(super) size: [u32; 2],
    pub(super) code: Vec<u8>,
    covered: Covered,
    /// White pixels, and gray ones in part.
    exposed_px: f64,
}

impl CodedLayer {
    fn new(layer: &Layer, format: PrinterFormat, mirrored: [bool; 2]) -> Self {
        let image = &*layer.image;
        let turned = (mirrored != [false; 2])
            .then(|| image.oriented(orientation(mirrored)).expect("a mirrored image has its runs"));
        let code = match format {
            PrinterFormat::Goo => super::goo::rle::encode(turned.as_ref().unwrap_or(image)),
        };
        Self {
            info: layer.info.clone(),
            size: [image.width(), image.height()],
            code,
            covered: Covered::of(image),
            exposed_px: exposed(image),
        }
    }
}

fn exposed(image: &Image) -> f64 {
    match image {
        Image::Mask(mask) => mask.white_pixels() as f64,
        Image::Gray(_) => {
            let of_run =
                |(start, end, level): (u32, u32, u8)| u64::from(end - start) * u64::from(level);
            let of_row = |row| image.runs(row).map(of_run).sum::<u64>();
            (0..image.height()).map(of_row).sum::<u64>() as f64 / 255.0
        }
    }
}

/// Writes layers as a printer's file, coding them on all threads.
///
/// Which printer it is for, and how that exposes, is in the
/// [`PrintRecord`] of the stack, which goes with the first layer.
///
/// # Errors
/// Returns the first error among the layers, or an error if writing fails, if there is no such
/// record, if an image is not of the panel's size, or if the layers are more than the printer or
/// the format takes. No file then appears under the final name.
pub fn write_printer_file<E>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    to: Destination,
    format: PrinterFormat,
) -> Result<(), E>
where
    E: From<StackError> + Display + Send,
{
    let Destination::File(path) = to else {
        return Err(StackError::from(PrinterFault::NotAFile(format.name())).into());
    };
    let mut layers = layers.peekable();
    let first = match layers.next_if(Result::is_err) {
        Some(error) => return error.map(drop),
        None => layers.peek().and_then(|layer| layer.as_ref().ok()),
    };
    let record = first.map(|layer| record_of(layer, format)).ok_or(StackError::NoLayers)??;
    let temporary = FileBeside::new(&path).map_err(StackError::from)?;
    let out = BufWriter::with_capacity(1 << 18, temporary.file());
    let mut file = match format {
        PrinterFormat::Goo => GooWriter::new(out)?,
    };
    let (mut totals, mut view) = (PrintTotals::default(), TopView::new());
    let mirrored = record.mirrored;
    for layer in map_in_order(layers, |layer: Layer| Ok(CodedLayer::new(&layer, format, mirrored)))
    {
        let layer = layer?;
        check_size(&layer, &record).map_err(StackError::from)?;
        let added = totals.add(&record, &layer.info, layer.exposed_px).map_err(StackError::from)?;
        view.add(&layer.covered);
        file.push(&added, &layer)?;
    }
    file.finish(&Print { record: &record, totals: &totals, view: &view })?;
    Ok(temporary.persist().map_err(StackError::from)?)
}

/// Returns how the printer exposes the stack, checked against the format.
fn record_of(first: &Layer, format: PrinterFormat) -> Result<PrintRecord, StackError> {
    let stack = first.info.stack.as_ref();
    let record = stack.and_then(StackInfo::print_record).ok_or(PrinterFault::NoPanel)?;
    let most = format.most_side();
    if record.panel_px.iter().any(|side| *side > most) {
        return Err(PrinterFault::Side { format: format.name(), most }.into());
    }
    Ok(record)
}

fn check_size(layer: &CodedLayer, record: &PrintRecord) -> Result<(), PrinterFault> {
    if layer.size == record.panel_px {
        return Ok(());
    }
    Err(PrinterFault::Size {
        layer: layer.info.index,
        size: layer.size,
        printer: record.printer.clone(),
        panel: record.panel_px,
    })
}

/// The writer of a format.
pub(super) trait PrinterWriter {
    /// Adds the next layer.
    fn push(&mut self, added: &PrintLayer, layer: &CodedLayer) -> Result<(), StackError>;

    /// Writes what is known only behind the last layer.
    fn finish(self, print: &Print<'_>) -> Result<(), StackError>;
}
