//! A vertical section through a finding, from the runs of one row or column of each layer.

use std::collections::BTreeMap;
use std::ops::Range;

use lamp_stack::{Mask, Pitch, white_runs};
use lamp_supports::{Findings, FoundPixels, Shown};

use super::raster::Raster;
use super::{EvidenceShade, around};
use crate::shades::Shade;

/// The most pixels across and up, and the most that a pixel of a layer becomes.
const MOST: [f64; 2] = [320.0, 320.0];
const MOST_ENLARGED: f64 = 8.0;
/// The length of the marks beside the shown layer.
const MARK: u32 = 6;

/// A section, filled layer by layer.
pub(super) struct SideView {
    /// Whether it runs along a row.
    pub(super) along_row: bool,
    /// The row or column.
    pub(super) at: u32,
    /// The pitch of what it shows, x across the picture.
    pub(super) pitch: Option<Pitch>,
    /// Columns or rows that it shows.
    window: Range<u32>,
    /// Bottom and top of each layer that it shows, in pixels across above the first of all.
    pub(super) heights: BTreeMap<u32, [f64; 2]>,
    /// The white of each layer within the window.
    white: BTreeMap<u32, Vec<Range<u32>>>,
}

impl SideView {
    pub(super) fn new(shown: &Shown, findings: &Findings) -> Self {
        let [width, height] = findings.size;
        let whole = &shown.whole;
        // Across the shorter side, which shows what holds a strip.
        let along_row = whole.columns.len() <= whole.rows.len();
        let (window, at) = match along_row {
            true => (around(&whole.columns, width), shown.at[1]),
            false => (around(&whole.rows, height), shown.at[0]),
        };
        let pitch = findings.pitch.map(|pitch| if along_row { pitch } else { pitch.turned() });
        let across_um = pitch.map(|pitch| pitch.x.pitch().um());
        let mut top = 0.0;
        let all: Vec<[f64; 2]> = findings
            .layers
            .iter()
            .map(|layer| {
                // Without both, a layer is as high as a pixel is wide.
                let high = layer.thickness_um.zip(across_um).map_or(1.0, |(um, pixel)| um / pixel);
                top += high;
                [top - high, top]
            })
            .collect();
        let of_layer = |layer: u32| all.get(layer as usize).copied().unwrap_or([top, top]);
        let [low, high] = [of_layer(shown.layers[0])[0], of_layer(shown.layers[1])[1]];
        // As high as wide, or a half more than the finding.
        let more = ((window.len() as f64 - (high - low)) / 2.0).max((high - low) / 4.0);
        let is_shown = |[bottom, top]: &[f64; 2]| *top > low - more && *bottom < high + more;
        let heights = (0..).zip(all).filter(|(_, ends)| is_shown(ends)).collect();
        Self { along_row, at, pitch, window, heights, white: BTreeMap::new() }
    }

    pub(super) fn needs(&self, position: u32) -> bool {
        self.heights.contains_key(&position)
    }

    pub(super) fn add(&mut self, position: u32, layer: &Mask) {
        if !self.needs(position) {
            return;
        }
        let window = &self.window;
        let runs = if self.along_row {
            let row = if self.at < layer.height() { layer.row(self.at) } else { &[] };
            let runs = white_runs(row, layer.width());
            let runs = runs.map(|(start, end)| start.max(window.start)..end.min(window.end));
            runs.filter(|run| !run.is_empty()).collect()
        } else {
            let white = window.clone().filter(|&row| layer.is_white(self.at, row));
            white.map(|row| row..row + 1).collect()
        };
        self.white.insert(position, runs);
    }

    /// Returns how many pixels of the picture a pixel of a layer has.
    pub(super) fn scale(&self) -> f64 {
        let [low, high] = self.ends();
        let [across, up] = [self.window.len() as f64, high - low];
        (MOST[0] / across.max(1.0)).min(MOST[1] / up.max(1.0)).min(MOST_ENLARGED)
    }

    fn ends(&self) -> [f64; 2] {
        let low = self.heights.values().next().map_or(0.0, |ends| ends[0]);
        [low, self.heights.values().next_back().map_or(low, |ends| ends[1])]
    }

    pub(super) fn draw(&self, shown: &Shown) -> Raster {
        let scale = self.scale();
        let [low, high] = self.ends();
        let size =
            [self.window.len() as f64, high - low].map(|side| (side * scale).ceil().max(1.0));
        let size = size.map(|side| side as u32);
        let mut raster = Raster::new(size, EvidenceShade::Black.color());
        for (&position, [bottom, top]) in &self.heights {
            let rows = [high - top, high - bottom].map(|down| (down * scale).round() as u32);
            // A thin layer shows in one row of the picture at least.
            let rows = rows[0]..rows[1].max(rows[0] + 1);
            for (columns, shade) in self.shades(position, shown) {
                let ends = [columns.start, columns.end]
                    .map(|at| f64::from(at - self.window.start) * scale);
                raster.fill(ends[0] as u32..ends[1].ceil() as u32, rows.clone(), shade.color());
            }
            if position == shown.layer {
                let mark = EvidenceShade::Place.color();
                raster.fill(0..MARK, rows.clone(), mark);
                raster.fill(size[0].saturating_sub(MARK)..size[0], rows, mark);
            }
        }
        raster
    }

    /// Returns what a layer has along the section, the last over the others.
    fn shades(&self, position: u32, shown: &Shown) -> Vec<(Range<u32>, EvidenceShade)> {
        let white = |position: u32| self.white.get(&position).map_or(&[][..], Vec::as_slice);
        let mut shades: Vec<_> =
            white(position).iter().map(|run| (run.clone(), EvidenceShade::White)).collect();
        if !(shown.layers[0]..=shown.layers[1]).contains(&position) {
            return shades;
        }
        let place = if self.along_row { &shown.whole.columns } else { &shown.whole.rows };
        let within = |at: u32, runs: &[Range<u32>]| runs.iter().any(|run| run.contains(&at));
        let below = position.checked_sub(1).map_or(&[][..], white);
        let is_found = |&at: &u32| {
            let here = within(at, white(position));
            match shown.pixels {
                FoundPixels::White | FoundPixels::All => here,
                FoundPixels::Black => !here,
                FoundPixels::Unheld => here && !within(at, below),
            }
        };
        let found = place.clone().filter(|at| self.window.contains(at)).filter(is_found);
        shades.extend(found.map(|at| (at..at + 1, EvidenceShade::Found)));
        shades
    }
}
