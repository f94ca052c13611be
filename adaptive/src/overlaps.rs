//! The rows in which facets lie above each other within a layer, found once for a whole part.
//!
//! Elsewhere facets by themselves give layers completely
//! ([`HeightTable`](crate::table::HeightTable)), and a search that tries layers from many heights
//! need not meet them with rows each time. Slabs much higher than a layer show where this holds:
//! rows meet each facet about once.

use std::cell::RefCell;
use std::sync::Arc;

use lamp_stack::Grouped;
use rayon::prelude::*;

use crate::layered_part::{LayeredPart, Rise};
use crate::row_cuts::{CutRows, RowCuts};
use crate::sweep::RowsAdd;
use crate::swept_layer::{SweptLayer, SweptSection};
use crate::table::HeightTable;

/// A slab is at least so many layers high.
const LAYERS_PER_SLAB: f64 = 4.0;

/// And at least so many facets.
const FACETS_PER_SLAB: f64 = 2.0;

/// Slabs reach farther by this much on either side, far more than rounding.
const MARGIN_UM: f64 = 0.01;

/// The number of rows that are worked on at once. It does not follow the threads, so that sums do
/// not depend on them.
const ROWS_PER_CHUNK: usize = 64;

/// Fewer lines than this are not worth several threads.
const MANY_LINES: usize = 16_384;

/// A row in which facets do not give layers completely.
#[derive(Clone, Copy, Debug)]
struct OverlapRow {
    row: u32,
    /// The parts of the slab's height where they do not.
    parts: Parts,
}

/// Some of the 64 equal parts of a height.
#[derive(Clone, Copy, Debug, Default)]
struct Parts(u64);

impl Parts {
    /// Returns the parts that a range meets. All heights are in micrometers.
    fn of(range: [f64; 2], [bottom_um, top_um]: [f64; 2]) -> Self {
        let part = |height: f64| (64.0 * (height - bottom_um) / (top_um - bottom_um)) as u32;
        let [first, last] = range.map(|height| part(height).min(63));
        Self((u64::MAX >> (63 - last)) & (u64::MAX << first))
    }

    fn add(&mut self, other: Self) {
        self.0 |= other.0;
    }

    fn meets(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}

/// By slab, the rows in which facets do not give layers up to some thickness completely.
#[derive(Debug)]
pub(crate) struct OverlapRows {
    reach_um: f64,
    slab_um: f64,
    slabs: Vec<Vec<OverlapRow>>,
}

impl OverlapRows {
    /// Looks at a closed part for layers up to `reach_um` thick.
    pub(crate) fn new(part: &LayeredPart, reach_um: f64, mean_facet_um: f64) -> Self {
        let [bottom_um, top_um] = part.heights_um();
        let slab_um = (LAYERS_PER_SLAB * reach_um).max(FACETS_PER_SLAB * mean_facet_um);
        let count = ((top_um - bottom_um) / slab_um).ceil().max(1.0) as usize;
        let mut rows = Self { reach_um, slab_um, slabs: Vec::new() };
        let slabs = 0..count;
        rows.slabs = slabs.into_par_iter().map(|slab| rows.of_slab(part, slab)).collect();
        rows
    }

    pub(crate) fn reach_um(&self) -> f64 {
        self.reach_um
    }

    /// Returns the slab that holds layers from a height on.
    fn slab_of(&self, part: &LayeredPart, bottom_um: f64) -> usize {
        let slab = (bottom_um - part.heights_um()[0]) / self.slab_um;
        (slab as usize).min(self.slabs.len() - 1)
    }

    /// Returns the heights of all layers from a slab.
    fn heights(&self, part: &LayeredPart, slab: usize) -> [f64; 2] {
        let bottom_um = part.heights_um()[0] + slab as f64 * self.slab_um;
        [bottom_um - MARGIN_UM, bottom_um + self.slab_um + self.reach_um + MARGIN_UM]
    }

    fn of_slab(&self, part: &LayeredPart, slab: usize) -> Vec<OverlapRow> {
        let heights = self.heights(part, slab);
        let mut cuts = RowCuts::default();
        let mut met = 0..0;
        for (facet, body) in part.facets().between(heights[0], heights[1]) {
            let Some(facet) = part.row_facet(&facet) else { continue };
            let rows = facet.rows();
            met = if met.is_empty() {
                rows
            } else {
                met.start.min(rows.start)..met.end.max(rows.end)
            };
            cuts.add_facet(&facet, part.rule().name_of(body), [0, u32::MAX], heights);
        }
        let mut of_rows = CutRows::new(&cuts, met.start, met.len());
        let mut sweep = part.sweep(RowsAdd::Differences);
        let untold = |(place, row): (usize, u32)| {
            let (toggles, slopes) = of_rows.sorted_row(place);
            let mut parts = Parts::default();
            sweep.untold(toggles, slopes, self.reach_um, |range| {
                parts.add(Parts::of(range.map(|height| heights[0] + height), heights));
            });
            parts.meets(Parts(u64::MAX)).then_some(OverlapRow { row, parts })
        };
        met.enumerate().filter_map(untold).collect()
    }
}

/// A facet's line in a row, from its long to one of its short edges.
#[derive(Clone, Copy, Debug, Default)]
struct RowLine {
    ends: [[f64; 2]; 2],
    is_flipped: bool,
    body: u32,
}

/// The lines of a slab, by the place of their row.
#[derive(Debug)]
struct SlabLines {
    slab: usize,
    by_row: Grouped<RowLine>,
}

/// The differences of layers from the sums of single facets.
#[derive(Debug)]
pub(crate) struct Overlaps<'a> {
    part: &'a LayeredPart,
    rows: Arc<OverlapRows>,
    /// The lines of the last slab asked about: layers are asked about from the bottom up.
    lines: RefCell<SlabLines>,
}

impl<'a> Overlaps<'a> {
    pub(crate) fn new(part: &'a LayeredPart, rows: Arc<OverlapRows>) -> Self {
        let none = SlabLines { slab: usize::MAX, by_row: Grouped::new(0, std::iter::empty) };
        Self { part, rows, lines: RefCell::new(none) }
    }

    /// Returns the layers from one step to each of several rising thicknesses, in steps of a table
    /// of the part's.
    pub(crate) fn layers(
        &self,
        table: &HeightTable,
        bottom: usize,
        thicknesses: &[usize],
    ) -> Vec<SweptLayer> {
        let bottom_um = table.at(bottom);
        let told: Vec<_> = table.sections(bottom, thicknesses).collect();
        let planes: Vec<f64> = told.iter().map(|(_, section, _)| section.plane_um).collect();
        let rise = self.differences(bottom_um, &planes);
        let layer =
            |(k, (thickness_um, mut section, steepest)): (usize, (f64, SweptSection, f64))| {
                if let Some(rise) = &rise {
                    section.bottom_area += rise.bottom_area;
                    section.change.add(rise.changes[k]);
                }
                SweptLayer { steepest, ..section.swept(bottom_um, thickness_um, self.part.side()) }
            };
        told.into_iter().enumerate().map(layer).collect()
    }

    /// Returns the differences of layers, from a height to each of several planes above it, from
    /// the sums of facets, if there are any. Heights are in micrometers; planes' heights are above
    /// the bottom.
    fn differences(&self, bottom_um: f64, planes: &[f64]) -> Option<Rise> {
        let slab = self.rows.slab_of(self.part, bottom_um);
        let rows = &self.rows.slabs[slab];
        let z = [bottom_um, bottom_um + planes[planes.len() - 1]];
        // Parts of a slab's height are compared in one operation, and most rows are left out by it.
        let parts = Parts::of(z, self.rows.heights(self.part, slab));
        let is_met = |row: &OverlapRow| row.parts.meets(parts);
        if !rows.iter().any(is_met) {
            return None;
        }
        let mut known = self.lines.borrow_mut();
        if known.slab != slab {
            *known = SlabLines { slab, by_row: self.lines(slab) };
        }
        let lines = &known.by_row;
        let of_chunk = |(chunk, rows): (usize, &[OverlapRow])| {
            let first = chunk * ROWS_PER_CHUNK;
            let mut cuts = RowCuts::default();
            for (place, _) in (first..).zip(rows).filter(|(_, row)| is_met(row)) {
                for line in lines.group(place) {
                    cuts.add(place as u32, line.ends, line.is_flipped, line.body, z);
                }
            }
            self.part.rise(&cuts, first as u32, rows.len(), planes, RowsAdd::Differences)
        };
        // Both ways add the same chunks in the same order.
        if lines.items().len() < MANY_LINES {
            return rows.chunks(ROWS_PER_CHUNK).enumerate().map(of_chunk).reduce(Rise::and);
        }
        let rises: Vec<Rise> = rows.par_chunks(ROWS_PER_CHUNK).enumerate().map(of_chunk).collect();
        rises.into_iter().reduce(Rise::and)
    }

    /// Returns the lines in the rows of a slab.
    fn lines(&self, slab: usize) -> Grouped<RowLine> {
        let (part, rows) = (self.part, &self.rows.slabs[slab]);
        let heights = self.rows.heights(part, slab);
        let mut lines = Vec::new();
        for (facet, body) in part.facets().between(heights[0], heights[1]) {
            let Some(facet) = part.row_facet(&facet) else { continue };
            let (body, is_flipped) = (part.rule().name_of(body), facet.is_flipped());
            let met = facet.rows_between(heights);
            let first = rows.partition_point(|row| row.row < met.start);
            let rows = (first..).zip(&rows[first..]);
            for (place, row) in rows.take_while(|(_, row)| row.row < met.end) {
                facet.for_each_row(row.row..row.row + 1, |_, ends| {
                    lines.push((place, RowLine { ends, is_flipped, body }));
                });
            }
        }
        Grouped::new(rows.len(), || lines.iter().copied())
    }
}
