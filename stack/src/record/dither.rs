//! The record that `dither` leaves on pages.

use serde::{Deserialize, Serialize};

use super::PageRecord;

/// The changes to a page's pixels by `dither`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum DitherRecord {
    /// A gray page became dots, by the method of this name.
    Dots(String),
    /// White inside the part became square cells.
    Cells(CellsRecord),
}

/// Square cells inside a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellsRecord {
    /// The name of the method by which the page's gray became dots; none if the page was a mask.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<String>,
    /// The side of a cell in micrometers.
    pub cell_um: f64,
    /// The share of white cells.
    pub cell_level: f64,
    /// The least distance of cells from surfaces in micrometers.
    pub cell_clearance_um: f64,
}

impl PageRecord for DitherRecord {
    const KEY: &'static str = "dither";
}
