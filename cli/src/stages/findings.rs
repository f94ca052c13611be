//! What the stages of a part find on the way.

use std::collections::BTreeSet;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::edit::unused_text;
use crate::fix_report::FixReport;
use crate::mesh_report::Counts;

/// What stages found in a range of layers, or in several.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RangeFindings {
    /// Layers that were made.
    pub(crate) layers: usize,
    /// Rows that did not balance when the part was sliced, and layers that have some.
    pub(crate) stray_rows: usize,
    pub(crate) stray_layers: usize,
    /// Bands of rows that were corrected, and those that were left by the last `fix`.
    pub(crate) bands_corrected: usize,
    pub(crate) bands_left: usize,
    pub(crate) pixels_corrected: u64,
    /// Where the first band is that was left.
    pub(crate) first_left: Option<String>,
    /// Whether the sliced layers had no white pixel.
    pub(crate) is_blank: bool,
    /// Edits that were made in no layer: the stage's place and the edit's number.
    pub(super) unused_edits: BTreeSet<(usize, usize)>,
    /// What was said of the part, and of ranges.
    pub(super) of_part: Vec<String>,
    pub(super) of_range: Vec<String>,
}

impl RangeFindings {
    pub(super) fn new(counts: Counts, is_blank: bool) -> Self {
        let Counts { layers, stray_layers, stray_rows, .. } = counts;
        Self { layers, stray_layers, stray_rows, is_blank, ..Self::default() }
    }

    /// Adds what a `fix` found.
    pub(super) fn add_fixed(&mut self, report: &FixReport) {
        self.bands_corrected += report.corrected();
        self.pixels_corrected += report.pixels();
        self.bands_left = report.left();
        self.first_left = report.first_left().map(ToOwned::to_owned);
    }

    /// Says of which range remarks are.
    pub(super) fn of(mut self, range: &Range<u32>) -> Self {
        for line in &mut self.of_range {
            *line = format!("layers {} to {}: {line}", range.start, range.end - 1);
        }
        self
    }

    /// Joins what was found in two ranges of a part, the lower first.
    pub(crate) fn joined(mut self, mut other: Self) -> Self {
        self.layers += other.layers;
        self.stray_rows += other.stray_rows;
        self.stray_layers += other.stray_layers;
        self.bands_corrected += other.bands_corrected;
        self.bands_left += other.bands_left;
        self.pixels_corrected += other.pixels_corrected;
        self.first_left = self.first_left.or(other.first_left);
        self.is_blank &= other.is_blank;
        self.unused_edits.retain(|edit| other.unused_edits.contains(edit));
        other.of_part.retain(|line| !self.of_part.contains(line));
        self.of_part.append(&mut other.of_part);
        self.of_range.append(&mut other.of_range);
        self
    }

    /// Returns what is to be said, once all ranges are joined.
    pub(crate) fn notes(&self) -> Vec<String> {
        let blank = self.is_blank.then(|| "slice: no layer has a white pixel".to_owned());
        let unused =
            self.unused_edits.iter().map(|(_, edit)| format!("edit: {}", unused_text(*edit)));
        let said = self.of_part.iter().chain(&self.of_range).cloned();
        said.chain(blank).chain(unused).collect()
    }
}
