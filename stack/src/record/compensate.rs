//! The record that `compensate` leaves on pages.

use serde::{Deserialize, Serialize};

use super::PageRecord;

/// How a page was changed against what curing and firing do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CompensateRecord {
    /// The least and the greatest distance, in micrometers, by which edges moved inwards.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inwards_um: Option<[f64; 2]>,
    /// The number of walls that were too thin, and became lines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thin_walls: Option<usize>,
    /// The number of places that were lost.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub losses: Option<usize>,
    /// The shares by which firing shrinks the part along the rows and the columns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shrinkage: Option<[f64; 2]>,
}

impl PageRecord for CompensateRecord {
    const KEY: &'static str = "compensate";
}

impl CompensateRecord {
    /// Returns whether edges moved.
    pub fn moves(&self) -> bool {
        self.inwards_um.is_some_and(|by| by.iter().any(|&by| by != 0.0))
    }
}
