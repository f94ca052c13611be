//! Printers' files that are ZIP archives of PNGs and texts: NanoDLP, SL1, UVJ and Klipper.
//!
//! Sources: UVtools' description of the four in its readers and writers, and for NanoDLP
//! docs.nanodlp.com/manual/format. Each format's file has its own numbers.

pub(crate) mod klipper;
pub(crate) mod nanodlp;
pub(crate) mod png;
pub(crate) mod read;
pub(crate) mod sl1;
pub(crate) mod uvj;
pub(crate) mod write;

#[cfg(test)]
mod archive_tests;

use serde::de::DeserializeOwned;

use crate::error::StackError;
use crate::image::orientation::Orientation;
use crate::printer::fault::PrinterFault;
use crate::record::{PrintRecord, PrintStep};
use read::Archive;

/// The statements of an archive besides its images.
#[derive(Debug)]
pub(crate) struct Plate {
    pub(crate) record: PrintRecord,
    /// The part's name, if the file has one.
    pub(crate) part: String,
    /// The orientation that turns an image upright.
    pub(crate) orientation: Orientation,
    /// The layers, bottom first.
    pub(crate) layers: Vec<PlateLayer>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct PlateLayer {
    /// The number of its image in the archive.
    pub(crate) file: usize,
    /// The height of its top above the platform.
    pub(crate) top_mm: f64,
    pub(crate) step: PrintStep,
    /// Whether the printer waits for a person before it.
    pub(crate) pauses: bool,
}

/// Parses a JSON file of an archive.
fn json<T: DeserializeOwned>(archive: &mut Archive, name: &str) -> Result<Option<T>, StackError> {
    let Some(bytes) = archive.text(name)? else { return Ok(None) };
    let parsed = serde_json::from_slice(&bytes);
    let named = |error: serde_json::Error| PrinterFault::Text {
        file: name.to_owned(),
        problem: error.to_string(),
    };
    Ok(Some(parsed.map_err(named)?))
}

/// Returns the layers of images with the same thickness.
fn even_layers(
    files: Vec<usize>,
    thickness_um: f64,
    record: &PrintRecord,
) -> Result<Vec<PlateLayer>, PrinterFault> {
    if !(thickness_um > 0.0 && thickness_um.is_finite()) {
        return Err(PrinterFault::Damaged("layer thickness"));
    }
    let layer = |(number, file): (u32, usize)| PlateLayer {
        file,
        top_mm: (f64::from(number + 1) * thickness_um * 1e3).round() / 1e6,
        step: record.step(number),
        pauses: false,
    };
    Ok((0..).zip(files).map(layer).collect())
}

/// Rounds to a billionth, which a product of decimal numbers is meant to be.
fn rounded(number: f64) -> f64 {
    (number * 1e9).round() / 1e9
}
