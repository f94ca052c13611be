//! Chooses gray levels down columns of pixels, for doses that add up.
//!
//! Let `b` be the underside below a pixel of a layer. The light of the layers above leaves a share
//! of the critical dose at `b`; the layer gets the level that makes up what lacks, at most white,
//! and at least the least level above black, so that outlines stay. From the top down, this takes
//! the least light away from white layers that leaves the underside where it is: light from low
//! layers weighs most there, so those are darkened first, and one layer of a column is in between.
//! All of the part above `b` has more than its dose at `b`, or is cured by its own white layer, so
//! it cures.
//!
//! Where the layers above are white up to the part's top, or as far up as light comes from, the
//! level follows from the depth alone. Depths are told within a layer; further down, they are those
//! of the layers below. What is below and above a row's pixels is carried from layer to layer
//! ([`below`](super::below), [`above`](super::above)), so that each layer is looked at a few times,
//! however far light reaches.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use lamp_stack::{GrayMask, Image, LevelChange};
use rayon::prelude::*;

use super::above::AboveRow;
use super::below::{Below, DEEP, push_below};
use super::print_through::{LevelsByDepth, PrintThrough};
use super::row_lists::RowLists;
use super::rows::{DepthRows, finished};

/// Rows that one thread takes at a time, through all layers.
const BAND_ROWS: u32 = 64;
/// A surface this far above the underside, as a share of the critical dose, is short of it.
const SHORT: f64 = 1e-3;

/// A layer whose levels are chosen.
pub(crate) struct ChosenLayer {
    pub(crate) image: Image,
    /// The pixels that even white does not cure down to the underside within the layer.
    pub(crate) short_px: u64,
}

/// The depths of some layers in a row, and which layers have the undersides below their pixels.
#[derive(Debug)]
pub(crate) struct Columns {
    /// The number of the first layer.
    first: usize,
    depths: VecDeque<DepthRows>,
    /// Those of each layer, by bands of rows.
    below: Vec<VecDeque<RowLists<Below>>>,
}

impl Columns {
    /// Starts with the number of the lowest layer.
    pub(crate) fn new(first: usize) -> Self {
        Self { first, depths: VecDeque::new(), below: Vec::new() }
    }

    /// Returns the first layer whose depths are not known yet.
    pub(crate) fn end(&self) -> usize {
        self.first + self.depths.len()
    }

    /// Adds the depths of the next layers above.
    pub(crate) fn extend(&mut self, light: &PrintThrough, depths: Vec<DepthRows>) {
        let (first, known) = (self.first, self.depths.len());
        self.depths.extend(depths);
        let Some(lowest) = self.depths.front() else { return };
        self.below.resize_with(lowest.height().div_ceil(BAND_ROWS) as usize, VecDeque::new);
        let depths = &self.depths;
        self.below.par_iter_mut().enumerate().for_each(|(band, of_layers)| {
            for (k, rows) in depths.iter().enumerate().skip(known) {
                let layer_below = k.checked_sub(1).map(|below| &of_layers[below]);
                let mut lists = layer_below.map_or_else(RowLists::default, RowLists::like);
                for (in_band, row) in (0..).zip(band_rows(band, rows)) {
                    let row_below = layer_below.map(|lists| lists.row(in_band));
                    lists.push_row(|list| push_below(light, first + k, rows, row, row_below, list));
                }
                of_layers.push_back(lists);
            }
        });
    }

    /// Forgets the layers below one.
    pub(crate) fn forget_below(&mut self, layer: usize) {
        let done = layer - self.first;
        self.depths.drain(..done);
        self.below.iter_mut().for_each(|of_layers| drop(of_layers.drain(..done)));
        self.first = layer;
    }

    /// Chooses the levels of some layers, given all below and above that count.
    pub(crate) fn choose(&self, light: &PrintThrough, layers: Range<usize>) -> Vec<ChosenLayer> {
        let around = |layer| Around::new(light, layer, light.end_above(layer).min(self.end()));
        let around: Vec<Around<'_>> = layers.clone().map(around).collect();
        let of_band = |band| BandChooser::new(self, light, band).choose(&around);
        let bands: Vec<_> = (0..self.below.len()).into_par_iter().map(of_band).collect();
        let whole = |k: usize| {
            let mut image = GrayMask::new(self.depths[layers.start - self.first].width());
            let mut short_px = 0;
            for band in &bands {
                let (rows, short_in_band) = &band[k];
                (0..rows.len()).for_each(|row| {
                    image.push_row(rows.row(row)).expect("levels change at increasing columns");
                });
                short_px += short_in_band;
            }
            ChosenLayer { image: finished(image), short_px }
        };
        (0..layers.len()).into_par_iter().map(whole).collect()
    }

    fn rows(&self, layer: usize) -> &DepthRows {
        &self.depths[layer - self.first]
    }
}

fn band_rows(band: usize, rows: &DepthRows) -> Range<u32> {
    let start = band as u32 * BAND_ROWS;
    start..rows.height().min(start + BAND_ROWS)
}

/// What all pixels of a layer have in common.
struct Around<'a> {
    light: &'a PrintThrough,
    layer: usize,
    /// The first layer above that does not count.
    end: usize,
    /// The levels under so many white layers, as far as they were asked for.
    by_depth: Vec<OnceLock<Arc<LevelsByDepth>>>,
}

impl<'a> Around<'a> {
    fn new(light: &'a PrintThrough, layer: usize, end: usize) -> Self {
        let by_depth = (layer..end).map(|_| OnceLock::new()).collect();
        Self { light, layer, end, by_depth }
    }

    /// Returns the levels under so many white layers.
    fn levels_under(&self, white: usize) -> &LevelsByDepth {
        self.by_depth[white].get_or_init(|| {
            let goes_on = self.end < self.light.len() && white + 1 == self.end - self.layer;
            self.light.levels_by_depth(self.layer, if goes_on { None } else { Some(white) })
        })
    }

    /// Returns the number of layers above that count.
    fn layers_above(&self) -> u32 {
        (self.end - 1 - self.layer) as u32
    }
}

/// Chooses the levels of a band of rows.
struct BandChooser<'a> {
    columns: &'a Columns,
    light: &'a PrintThrough,
    band: usize,
    column: ColumnLight,
    changes: LevelRow,
    short_px: u64,
}

/// The rows of a layer in a band, and their pixels that are short of the underside.
type ChosenRows = (RowLists<LevelChange>, u64);

impl<'a> BandChooser<'a> {
    fn new(columns: &'a Columns, light: &'a PrintThrough, band: usize) -> Self {
        let (column, changes) = (ColumnLight::default(), LevelRow::default());
        Self { columns, light, band, column, changes, short_px: 0 }
    }

    /// Chooses the rows of each layer.
    fn choose(mut self, layers: &[Around<'_>]) -> Vec<ChosenRows> {
        let (Some(lowest), Some(highest)) = (layers.first(), layers.last()) else {
            return Vec::new();
        };
        let rows = self.columns.rows(lowest.layer);
        let (width, band) = (rows.width(), band_rows(self.band, rows));
        let mut above: Vec<AboveRow> = band.clone().map(|_| AboveRow::new(width)).collect();
        let mut chosen = Vec::with_capacity(layers.len());
        for layer in (lowest.layer..highest.end).rev() {
            if let Some(around) = layers.get(layer - lowest.layer) {
                chosen.push(self.choose_layer(around, &above, chosen.last()));
            }
            for (in_band, above) in (0..).zip(&mut above) {
                above.go_down(layer, self.below(layer, in_band), self.light.most_above());
            }
        }
        chosen.reverse();
        chosen
    }

    fn choose_layer(
        &mut self,
        around: &Around<'_>,
        above: &[AboveRow],
        last: Option<&ChosenRows>,
    ) -> ChosenRows {
        let mut lists = last.map_or_else(RowLists::default, |(rows, _)| RowLists::like(rows));
        self.short_px = 0;
        for (in_band, above) in (0..).zip(above) {
            self.choose_row(around, in_band, above);
            lists.push_row(|list| self.changes.finish(list));
        }
        (lists, self.short_px)
    }

    /// Chooses a row, given its number in the band.
    fn choose_row(&mut self, around: &Around<'_>, in_band: u32, above: &AboveRow) {
        let row = self.band as u32 * BAND_ROWS + in_band;
        let layers_above = around.layers_above();
        let mut rest = above.pieces();
        for &Below { start, end, layer } in self.below(around.layer, in_band) {
            if layer == DEEP {
                self.changes.push(start, end, 255);
                continue;
            }
            let mut column = start;
            while column < end {
                while rest[0].end <= column {
                    rest = &rest[1..];
                }
                let to = rest[0].end.min(end);
                match rest[0].white_of(layers_above) {
                    Some(white) => self.by_depth(around, row, (column, to), layer as usize, white),
                    None => (column..to).for_each(|column| {
                        let level = self.column_level(around, in_band, column);
                        self.changes.push(column, column + 1, level);
                    }),
                }
                column = to;
            }
        }
    }

    fn below(&self, layer: usize, in_band: u32) -> &'a [Below] {
        self.columns.below[self.band][layer - self.columns.first].row(in_band)
    }

    /// Adds the levels of columns under so many white layers, whose undersides lie in one layer.
    fn by_depth(
        &mut self,
        around: &Around<'_>,
        row: u32,
        (start, end): (u32, u32),
        below: usize,
        white: usize,
    ) {
        let table = around.levels_under(white);
        let tops_um = self.light.distance_um(around.layer, below);
        if tops_um + self.light.step_um(below) < table.first_um {
            // However deep it is within its layer.
            return self.changes.push(start, end, 1);
        }
        if tops_um >= table.white_um && below != around.layer {
            return self.changes.push(start, end, 255);
        }
        for (from, to, depth_um) in self.columns.rows(below).pieces_within(row, start, end) {
            let depth_um = tops_um + depth_um;
            if below == around.layer && depth_um > table.falls_short_um + 1.0 {
                self.short_px += u64::from(to - from);
            }
            self.changes.push(from, to, table.level(depth_um));
        }
    }

    /// Returns the depth of the part below a layer's top, infinite where light does not reach.
    fn depth_um(&self, layer: usize, in_band: u32, column: u32) -> f64 {
        let below = self.below(layer, in_band);
        let at = below.partition_point(|below| below.end <= column);
        match below.get(at) {
            Some(&Below { start, layer: DEEP, .. }) if start <= column => f64::INFINITY,
            Some(below) if below.start <= column => {
                let (known, row) = (below.layer as usize, self.band as u32 * BAND_ROWS + in_band);
                self.light.distance_um(layer, known) + self.columns.rows(known).at(row, column)
            }
            _ => 0.0,
        }
    }

    /// Goes down a column to the layer, from as far up as it counts.
    fn column_level(&mut self, around: &Around<'_>, in_band: u32, column: u32) -> u8 {
        self.column.darken();
        let mut level = 0;
        for layer in (around.layer..around.end).rev() {
            let levels = self.light.of_layer(layer);
            let depth_um = self.depth_um(layer, in_band, column);
            level = if depth_um == 0.0 {
                0
            } else if depth_um.is_infinite() {
                255
            } else {
                let before = self.column.left(depth_um) + self.light.least_below(layer, depth_um);
                let level = levels.level(depth_um, 1.0 - before).max(1);
                let is_lowest = layer == around.layer && depth_um < self.light.step_um(layer);
                if is_lowest && level == 255 {
                    let left = before + levels.left(level, depth_um);
                    self.short_px += u64::from(left < 1.0 - SHORT);
                }
                level
            };
            if level > 0 {
                self.column.add(levels.depth_um(level), levels.share(level));
            }
            if layer > around.layer {
                self.column.go_down(self.light.step_um(layer));
            }
        }
        level
    }
}

/// The changes of a row that is made from the left.
#[derive(Default)]
struct LevelRow {
    changes: Vec<LevelChange>,
    end: u32,
    level: u8,
}

impl LevelRow {
    /// Adds columns of one level above black.
    #[inline]
    fn push(&mut self, start: u32, end: u32, level: u8) {
        if start > self.end && self.level > 0 {
            self.changes.push(LevelChange { column: self.end, level: 0 });
            self.level = 0;
        }
        if level != self.level {
            self.changes.push(LevelChange { column: start, level });
            self.level = level;
        }
        self.end = end;
    }

    /// Ends the row, and moves its changes to a list. The last column of images is black.
    fn finish(&mut self, list: &mut Vec<LevelChange>) {
        if self.level > 0 {
            self.changes.push(LevelChange { column: self.end, level: 0 });
        }
        list.append(&mut self.changes);
        (self.end, self.level) = (0, 0);
    }
}

/// The light at a height of a column: penetration depths and critical doses.
#[derive(Default)]
struct ColumnLight(Vec<(f64, f64)>);

impl ColumnLight {
    fn darken(&mut self) {
        self.0.clear();
    }

    fn add(&mut self, depth_um: f64, share: f64) {
        match self.0.iter_mut().find(|(known, _)| *known == depth_um) {
            Some((_, sum)) => *sum += share,
            None => self.0.push((depth_um, share)),
        }
    }

    /// Returns the critical doses at a depth below.
    fn left(&self, below_um: f64) -> f64 {
        self.0.iter().map(|&(depth_um, share)| share * (-below_um / depth_um).exp()).sum()
    }

    fn go_down(&mut self, by_um: f64) {
        self.0.iter_mut().for_each(|(depth_um, share)| *share *= (-by_um / *depth_um).exp());
        self.0.retain(|(_, share)| *share > 1e-6);
    }
}
