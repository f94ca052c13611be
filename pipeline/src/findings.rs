//! Findings of the stages of a part.

use std::collections::BTreeSet;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::edit::unchanged_text;
use crate::fix_report::FixReport;
use crate::slice::Counts;

/// Findings of stages in a range of layers, or in several.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RangeFindings {
    /// Layers that were made.
    pub layers: usize,
    /// Rows that did not balance when the part was sliced.
    pub stray_rows: usize,
    /// Layers with such rows.
    pub stray_layers: usize,
    /// Bands of rows that were corrected.
    pub bands_corrected: usize,
    /// Bands that the last `fix` left as they were.
    pub bands_left: usize,
    /// Pixels that were changed.
    pub pixels_corrected: u64,
    /// The place of the first band left.
    pub first_left: Option<String>,
    /// Whether the sliced layers had no white pixel.
    pub is_blank: bool,
    /// Edits that were made in no layer: the stage's place and the edit's number.
    pub(crate) unused_edits: BTreeSet<(usize, usize)>,
    /// Edits that changed no pixel, also because they were made in no layer.
    pub(crate) unchanged_edits: BTreeSet<(usize, usize)>,
    /// Lines about the part.
    pub of_part: Vec<String>,
    /// Lines about ranges.
    pub(crate) of_range: Vec<String>,
}

impl RangeFindings {
    /// Begins with the counts of slicing.
    pub fn new(counts: Counts, is_blank: bool) -> Self {
        let Counts { layers, stray_layers, stray_rows, .. } = counts;
        Self { layers, stray_layers, stray_rows, is_blank, ..Self::default() }
    }

    /// Adds the findings of a `fix`.
    pub(crate) fn add_fixed(&mut self, report: &FixReport) {
        self.bands_corrected += report.corrected();
        self.pixels_corrected += report.pixels();
        // A later `fix` sees the bands that an earlier one left, so the last count holds.
        self.bands_left = report.left();
        self.first_left = report.first_left().map(ToOwned::to_owned);
    }

    /// Names the range of remarks.
    pub(crate) fn of(mut self, range: &Range<u32>) -> Self {
        for line in &mut self.of_range {
            *line = format!("layers {} to {}: {line}", range.start, range.end - 1);
        }
        self
    }

    /// Joins the findings in two ranges of a part, the lower first.
    pub fn joined(mut self, mut other: Self) -> Self {
        self.layers += other.layers;
        self.stray_rows += other.stray_rows;
        self.stray_layers += other.stray_layers;
        self.bands_corrected += other.bands_corrected;
        self.bands_left += other.bands_left;
        self.pixels_corrected += other.pixels_corrected;
        self.first_left = self.first_left.or(other.first_left);
        self.is_blank &= other.is_blank;
        // An edit that one range uses is used.
        self.unused_edits.retain(|edit| other.unused_edits.contains(edit));
        self.unchanged_edits.retain(|edit| other.unchanged_edits.contains(edit));
        // Every range opens the part, and finds the same about it.
        other.of_part.retain(|line| !self.of_part.contains(line));
        self.of_part.append(&mut other.of_part);
        self.of_range.append(&mut other.of_range);
        self
    }

    /// Returns the messages, once all ranges are joined.
    pub fn notes(&self) -> Vec<String> {
        let blank = self.is_blank.then(|| "slice: no layer has a white pixel".to_owned());
        let unchanged = self.unchanged_edits.iter().map(|edit| {
            format!("edit: {}", unchanged_text(edit.1, self.unused_edits.contains(edit)))
        });
        let said = self.of_part.iter().chain(&self.of_range).cloned();
        said.chain(blank).chain(unchanged).collect()
    }
}
