//! The records that strips and fields have on their pages.

use serde::{Deserialize, Serialize};

use super::PageRecord;

/// The place of a strip's page on its build.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct StripRecord {
    /// The strip, from 0.
    pub number: u32,
    /// The number of strips.
    pub of: u32,
    /// The strip's first column on the build, and the column after its last.
    pub columns: [u32; 2],
    /// The bits of a pixel of the build.
    pub bits: u32,
}

impl PageRecord for StripRecord {
    const KEY: &'static str = "strip";
}

/// The place of a field's page on its build.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct FieldRecord {
    /// The row of fields, from 0 at the top.
    pub row: u32,
    /// The column of fields, from 0 at the left.
    pub column: u32,
    /// The number of rows and of columns of fields.
    pub of: [u32; 2],
    /// The field's first column on the build, and the column after its last.
    pub columns: [u32; 2],
    /// The field's first row on the build, from the top, and the row after its last.
    pub rows: [u32; 2],
    /// The bits of a pixel of the build.
    pub bits: u32,
}

impl PageRecord for FieldRecord {
    const KEY: &'static str = "field";
}
