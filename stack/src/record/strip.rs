//! The record that `strips` leaves on pages.

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
