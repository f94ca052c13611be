//! Writes stacks as the files of printers.

use std::fmt::{self, Display};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::Arc;

use crate::error::StackError;
use crate::files::output::Destination;
use crate::files::stack_format::StackFormat;
use crate::files::temporary::FileBeside;
use crate::image::Image;
use crate::layer::Layer;
use crate::layer::page_info::{PageInfo, StackInfo};
use crate::limits::MAX_SIDE;
use crate::ordered::map_in_order;
use crate::pitch::Pitch;
use crate::printer::archive::write::ArchiveWriter;
use crate::printer::ctb::write::CtbWriter;
use crate::printer::fault::PrinterFault;
use crate::printer::goo::write::GooWriter;
use crate::printer::panel::orientation;
use crate::printer::preview::{Covered, TopView};
use crate::printer::total::{PrintLayer, PrintTotals};
use crate::record::{PrintRecord, PrintStep};

/// A format of the files of printers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PrinterFormat {
    /// Elegoo's GOO, version 3.
    Goo,
    /// NanoDLP's plates.
    NanoDlp,
    /// Prusa's SL1 and SL1S.
    Sl1,
    /// UVtools' own format, for any printer.
    Uvj,
    /// CTB of printers with Chitu boards.
    Ctb,
    /// Archives for printers that Klipper drives.
    Klipper,
}

impl PrinterFormat {
    /// All formats.
    pub const ALL: [Self; 6] =
        [Self::Goo, Self::NanoDlp, Self::Sl1, Self::Uvj, Self::Ctb, Self::Klipper];

    /// Returns the name of the format in options.
    pub fn name(self) -> &'static str {
        self.endings().first().unwrap_or(&"klipper")
    }

    /// Returns the endings of the names of its files, in small letters. Files for Klipper have the
    /// ending of all ZIP archives.
    pub fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Goo => &["goo"],
            Self::NanoDlp => &["nanodlp"],
            Self::Sl1 => &["sl1", "sl1s"],
            Self::Uvj => &["uvj"],
            Self::Ctb => &["ctb"],
            Self::Klipper => &[],
        }
    }

    /// Returns whether its files are ZIP archives.
    pub fn is_zip(self) -> bool {
        matches!(self, Self::NanoDlp | Self::Sl1 | Self::Uvj | Self::Klipper)
    }

    /// Explains why a file cannot be opened, if its name promises a printer's file.
    pub(crate) fn explain(path: &Path, error: StackError) -> StackError {
        match (error, StackFormat::of_name(path)) {
            (StackError::NotTiff { .. }, Some(StackFormat::Printer(format))) => {
                PrinterFault::NotAsNamed(format).into()
            }
            (error, _) => error,
        }
    }

    /// Returns the most columns and rows that a file can state.
    fn most_side(self) -> u32 {
        match self {
            Self::Goo => super::goo::header::MOST_SIDE,
            Self::NanoDlp | Self::Sl1 | Self::Uvj | Self::Ctb | Self::Klipper => MAX_SIDE,
        }
    }

    /// Checks that a file can state the layer, which was added to `totals`.
    fn check(
        self,
        record: &PrintRecord,
        totals: &PrintTotals,
        added: &PrintLayer,
        layer: u32,
    ) -> Result<(), PrinterFault> {
        let format = self.noun();
        if matches!(self, Self::Goo | Self::Uvj) {
            return Ok(());
        }
        let unstated = |what| Err(PrinterFault::Unstated { format, what });
        if matches!(self, Self::Ctb | Self::Klipper) {
            let [up, down] = [added.step.lift_mm, added.step.retract_mm].map(|mm| mm[0] + mm[1]);
            return match (record.mirrored, (up - down).abs() < 1e-6) {
                ([_, true], _) if self == Self::Ctb => unstated("a panel mirrored top to bottom"),
                (_, false) => unstated("a way back that is not as long as the lift"),
                _ => Ok(()),
            };
        }
        if !totals.is_even {
            return Err(PrinterFault::Uneven { format, layer });
        }
        let usual = record.step(totals.layers - 1);
        // Times in milliseconds, which pages have, are rounded.
        let is_usual = (usual.exposure_s - added.step.exposure_s).abs() < 1e-6
            && PrintStep { exposure_s: usual.exposure_s, ..added.step } == usual;
        if !is_usual {
            return Err(PrinterFault::OwnStep { format, layer });
        }
        match self {
            Self::NanoDlp if record.mirrored[1] => unstated("a panel mirrored top to bottom"),
            Self::Sl1 if record.first_layers > 1 => unstated("more than one first layer"),
            _ => Ok(()),
        }
    }
}

impl Display for PrinterFormat {
    /// Formats as a name with an article, such as `a GOO file`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.noun())
    }
}

impl PrinterFormat {
    fn noun(self) -> &'static str {
        match self {
            Self::Goo => "a GOO file",
            Self::NanoDlp => "a NanoDLP file",
            Self::Sl1 => "an SL1 file",
            Self::Uvj => "a UVJ file",
            Self::Ctb => "a CTB file",
            Self::Klipper => "an archive for Klipper",
        }
    }
}

/// The file that is being written.
pub(crate) type PrinterFile = BufWriter<Arc<File>>;

/// The facts that files of all formats state once all layers are known.
pub(crate) struct Print<'a> {
    /// The part's name.
    pub(crate) part: &'a str,
    pub(crate) record: &'a PrintRecord,
    pub(crate) totals: &'a PrintTotals,
    pub(crate) view: &'a TopView,
}

/// A layer that is coded.
pub(crate) struct CodedLayer {
    pub(crate) info: PageInfo,
    pub(crate) size: [u32; 2],
    pub(crate) code: Vec<u8>,
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
            PrinterFormat::Ctb => super::ctb::rle::encode(turned.as_ref().unwrap_or(image)),
            _ => super::archive::png::encode(turned.as_ref().unwrap_or(image), layer.pitch),
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
        return Err(StackError::from(PrinterFault::NotAFile(format.noun())).into());
    };
    let mut layers = layers.peekable();
    let first = match layers.next_if(Result::is_err) {
        Some(error) => return error.map(drop),
        None => layers.peek().and_then(|layer| layer.as_ref().ok()),
    };
    let first = first.ok_or(StackError::NoLayers)?;
    let record = record_of(first, format)?;
    let stack = first.info.stack.as_ref();
    let part = stack.map(|stack| stack.part.clone()).unwrap_or_default();
    let stack_layers = stack.and_then(|stack| stack.layers);
    let temporary = FileBeside::new(&path).map_err(StackError::from)?;
    let out = BufWriter::with_capacity(1 << 18, temporary.file());
    let mut file: Box<dyn PrinterWriter> = match format {
        PrinterFormat::Goo => Box::new(GooWriter::new(out)?),
        PrinterFormat::Ctb => {
            let layers = stack_layers.ok_or(PrinterFault::NoCount(format.noun()));
            Box::new(CtbWriter::new(out, layers.map_err(StackError::from)?, &record)?)
        }
        _ => Box::new(ArchiveWriter::new(out, format, &part)),
    };
    let aspect = first.pitch.map_or(1.0, Pitch::aspect);
    let (mut totals, mut view) = (PrintTotals::default(), TopView::new(aspect));
    let mirrored = record.mirrored;
    for layer in map_in_order(layers, |layer: Layer| Ok(CodedLayer::new(&layer, format, mirrored)))
    {
        let layer = layer?;
        check_size(&layer, &record).map_err(StackError::from)?;
        let added = totals.add(&record, &layer.info, layer.exposed_px).map_err(StackError::from)?;
        let checked = format.check(&record, &totals, &added, layer.info.index);
        checked.map_err(StackError::from)?;
        view.add(&layer.covered);
        file.push(&added, &layer)?;
    }
    file.finish(&Print { part: &part, record: &record, totals: &totals, view: &view })?;
    Ok(temporary.persist().map_err(StackError::from)?)
}

/// Returns how the printer exposes the stack, checked against the format.
fn record_of(first: &Layer, format: PrinterFormat) -> Result<PrintRecord, StackError> {
    let stack = first.info.stack.as_ref();
    let record = stack.and_then(StackInfo::print_record).ok_or(PrinterFault::NoPanel)?;
    let most = format.most_side();
    if record.panel_px.iter().any(|side| *side > most) {
        return Err(PrinterFault::Side { format: format.noun(), most }.into());
    }
    // The printer moves as the file says, even if that is not at all.
    let states_moves =
        matches!(format, PrinterFormat::Goo | PrinterFormat::Ctb | PrinterFormat::Klipper);
    if states_moves && !(record.first.moves() && record.normal.moves()) {
        let (format, printer) = (format.noun(), record.printer);
        return Err(PrinterFault::NoMoves { format, printer }.into());
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
pub(crate) trait PrinterWriter {
    /// Adds the next layer.
    fn push(&mut self, added: &PrintLayer, layer: &CodedLayer) -> Result<(), StackError>;

    /// Writes what is known only behind the last layer.
    fn finish(self: Box<Self>, print: &Print<'_>) -> Result<(), StackError>;
}
