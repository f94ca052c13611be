//! Chooses the gray levels of a band of rows, layer by layer from the top.

use std::sync::{Arc, OnceLock};

use lamp_stack::LevelChange;

use super::above::{Above, AboveRows};
use super::below::{Below, DEEP};
use super::columns::{BAND_ROWS, Columns, band_rows};
use super::print_through::{LevelsByDepth, PrintThrough};
use super::row_lists::RowLists;
use super::solid::{Intervals, SolidRow};

/// A surface this far above the underside, as a share of the critical dose, falls short of it.
const SHORT: f64 = 1e-3;

/// The data that all pixels of a layer have in common.
pub(super) struct Around<'a> {
    light: &'a PrintThrough,
    layer: usize,
    /// The first layer above that does not count.
    end: usize,
    /// The levels under each number of white layers, as far as requested.
    by_depth: Vec<OnceLock<Arc<LevelsByDepth>>>,
    /// The level under white layers alone if the underside is in the layer itself, in the layer
    /// below it, and so on.
    under_white: Vec<Option<u8>>,
}

impl<'a> Around<'a> {
    pub(super) fn new(light: &'a PrintThrough, layer: usize, end: usize) -> Self {
        let by_depth = (layer..end).map(|_| OnceLock::new()).collect();
        let around = Self { light, layer, end, by_depth, under_white: Vec::new() };
        let (table, first) = (around.levels_under(end - 1 - layer), light.first_in_reach(layer));
        let of_all = |below| around.level_of_all(table, below);
        let under_white = (first as usize..=layer).rev().map(of_all).collect();
        Self { under_white, ..around }
    }

    /// Returns the levels under this number of white layers.
    fn levels_under(&self, white: usize) -> &LevelsByDepth {
        self.by_depth[white].get_or_init(|| {
            // White as far up as light counts is taken as white all the way, so that layers share a
            // table.
            let goes_on = self.end < self.light.len() && white + 1 == self.end - self.layer;
            self.light.levels_by_depth(self.layer, if goes_on { None } else { Some(white) })
        })
    }

    /// Returns the level of all undersides in a layer, if they share one.
    fn level_of_all(&self, table: &LevelsByDepth, below: usize) -> Option<u8> {
        let tops_um = self.light.distance_um(self.layer, below);
        if tops_um + self.light.step_um(below) < table.first_um {
            // At any depth within its layer.
            Some(1)
        } else if tops_um >= table.white_um && below != self.layer {
            Some(255)
        } else {
            None
        }
    }
}

/// Chooses the levels of a band of rows.
pub(super) struct BandChooser<'a> {
    columns: &'a Columns,
    light: &'a PrintThrough,
    band: usize,
    column: ColumnLight,
    rows: ChangeRows,
    short_px: u64,
    /// The number of changes of each layer below read in the row, from the layer itself down.
    read: Vec<usize>,
    /// The columns of each row that are part in all layers above.
    solid: Vec<SolidRow>,
    /// The columns of the current row.
    white_above: Intervals,
    spare: Intervals,
    above: AboveRows<'a>,
    seen: Vec<Above>,
}

/// The rows of a layer in a band, and their number of pixels that fall short of the underside.
pub(super) type ChosenRows = (RowLists<LevelChange>, u64);

impl<'a> BandChooser<'a> {
    pub(super) fn new(columns: &'a Columns, light: &'a PrintThrough) -> Self {
        Self {
            columns,
            light,
            band: 0,
            column: ColumnLight::default(),
            rows: ChangeRows::default(),
            short_px: 0,
            read: Vec::new(),
            solid: Vec::new(),
            white_above: Intervals::new(),
            spare: Intervals::new(),
            above: AboveRows::new(columns),
            seen: Vec::new(),
        }
    }

    /// Chooses the rows of each layer in a band.
    pub(super) fn choose(&mut self, band: usize, layers: &[Around<'_>]) -> Vec<ChosenRows> {
        let (Some(lowest), Some(highest)) = (layers.first(), layers.last()) else {
            return Vec::new();
        };
        self.start(band, highest);
        let mut chosen = Vec::with_capacity(layers.len());
        for layer in (lowest.layer..highest.end).rev() {
            if let Some(around) = layers.get(layer - lowest.layer) {
                chosen.push(self.choose_layer(around, chosen.last()));
            }
            let below = |in_band| self.columns.below(layer, band, in_band);
            for (in_band, solid) in (0..).zip(&mut self.solid) {
                solid.go_down(layer, below(in_band), &mut self.spare);
            }
        }
        chosen.reverse();
        chosen
    }

    /// Starts a band above all layers that count for the highest one.
    fn start(&mut self, band: usize, highest: &Around<'_>) {
        self.band = band;
        let rows = self.columns.rows(highest.layer);
        let (width, height) = (rows.width(), band_rows(band, rows).len());
        let (most_above, is_top) = (self.light.most_above(), highest.end == self.light.len());
        self.solid.resize_with(height, SolidRow::default);
        self.solid.iter_mut().for_each(|solid| solid.start(width, most_above, is_top));
        self.above.start(band, height);
    }

    fn choose_layer(&mut self, around: &Around<'_>, last: Option<&ChosenRows>) -> ChosenRows {
        self.rows.lists = last.map_or_else(RowLists::default, |(rows, _)| RowLists::like(rows));
        self.short_px = 0;
        self.above.start_layer(around.layer, around.end);
        let width = self.columns.rows(around.layer).width();
        for in_band in 0..self.solid.len() as u32 {
            self.choose_row(around, in_band);
            self.rows.end_row(width);
            self.above.end_row(in_band);
        }
        (std::mem::take(&mut self.rows.lists), self.short_px)
    }

    /// Chooses a row, given its number in the band.
    fn choose_row(&mut self, around: &Around<'_>, in_band: u32) {
        let row = self.below(around.layer, in_band);
        // Most rows of thick parts end here.
        if row.iter().all(|below| below.layer == DEEP) {
            return row.iter().for_each(|below| self.rows.push(below.start, below.end, 255));
        }
        let layers_above = around.end - 1 - around.layer;
        self.read.clear();
        let mut white_above = std::mem::take(&mut self.white_above);
        white_above.clear();
        self.solid[in_band as usize].push_columns(&mut white_above);
        let mut solid = &white_above[..];
        for &Below { start, end, layer } in row {
            if layer == DEEP {
                self.rows.push(start, end, 255);
                continue;
            }
            let mut column = start;
            while column < end {
                while solid.first().is_some_and(|&(_, to)| to <= column) {
                    solid = &solid[1..];
                }
                let (from, to) = solid.first().copied().unwrap_or((end, end));
                let (from, to) = (from.clamp(column, end), to.min(end));
                if column < from {
                    self.choose_below_gaps(around, in_band, (column, from), layer);
                }
                if from < to {
                    let below = layer as usize;
                    match around.under_white[around.layer - below] {
                        Some(level) => self.rows.push(from, to, level),
                        None => self.by_depth(around, in_band, (from, to), below, layers_above),
                    }
                }
                column = to;
            }
        }
        self.white_above = white_above;
    }

    /// Adds the levels of columns that are not part in all layers above.
    fn choose_below_gaps(
        &mut self,
        around: &Around<'_>,
        in_band: u32,
        columns: (u32, u32),
        below: u32,
    ) {
        let mut seen = std::mem::take(&mut self.seen);
        self.above.look(in_band, columns, below, &mut seen);
        for &Above { start, end, white_to, black_to } in &seen {
            let (white_to, black_to) = (around.end.min(white_to as usize), black_to as usize);
            if white_to < around.end && black_to < around.end {
                (start..end).for_each(|column| {
                    let level = self.column_level(around, in_band, column);
                    self.rows.push(column, column + 1, level);
                });
            } else {
                let white = white_to - 1 - around.layer;
                self.by_depth(around, in_band, (start, end), below as usize, white);
            }
        }
        self.seen = seen;
    }

    fn below(&self, layer: usize, in_band: u32) -> &'a [Below] {
        self.columns.below(layer, self.band, in_band)
    }

    /// Adds the levels of columns under this number of white layers, whose undersides are in one
    /// layer.
    fn by_depth(
        &mut self,
        around: &Around<'_>,
        in_band: u32,
        (start, end): (u32, u32),
        below: usize,
        white: usize,
    ) {
        let table = around.levels_under(white);
        if let Some(level) = around.level_of_all(table, below) {
            return self.rows.push(start, end, level);
        }
        let tops_um = self.light.distance_um(around.layer, below);
        let (row, down) = (self.band as u32 * BAND_ROWS + in_band, around.layer - below);
        if down >= self.read.len() {
            self.read.resize(down + 1, 0);
        }
        let pieces = self.columns.rows(below).pieces_from(row, &mut self.read[down], start, end);
        for (from, to, depth_um) in pieces {
            let depth_um = tops_um + depth_um;
            if below == around.layer && depth_um > table.falls_short_um + 1.0 {
                self.short_px += u64::from(to - from);
            }
            self.rows.push(from, to, table.level(depth_um));
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

    /// Goes down a column to the layer, from the highest layer that counts.
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
                // No pixel of the part is black, so that outlines stay.
                let level = levels.level(depth_um, 1.0 - before).max(1);
                // Counted once, in the layer that has the underside.
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

/// Rows of changes, the last of which is built from the left.
#[derive(Default)]
struct ChangeRows {
    lists: RowLists<LevelChange>,
    end: u32,
    level: u8,
}

impl ChangeRows {
    /// Adds columns of one level above black.
    #[inline]
    fn push(&mut self, start: u32, end: u32, level: u8) {
        if start > self.end && self.level > 0 {
            self.lists.items_mut().push(LevelChange { column: self.end, level: 0 });
            self.level = 0;
        }
        if level != self.level {
            self.lists.items_mut().push(LevelChange { column: start, level });
            self.level = level;
        }
        self.end = end;
    }

    /// Ends the row of an image of a given width. A row that ends white stops there.
    fn end_row(&mut self, width: u32) {
        if self.level > 0 && self.end < width {
            self.lists.items_mut().push(LevelChange { column: self.end, level: 0 });
        }
        (self.end, self.level) = (0, 0);
        self.lists.end_row();
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
        // Light with one penetration depth fades alike, however many layers it comes from.
        match self.0.iter_mut().find(|(known, _)| *known == depth_um) {
            Some((_, sum)) => *sum += share,
            None => self.0.push((depth_um, share)),
        }
    }

    /// Returns the critical doses at a depth below.
    fn left(&self, below_um: f64) -> f64 {
        // Beer-Lambert: light falls to 1/e in each penetration depth.
        self.0.iter().map(|&(depth_um, share)| share * (-below_um / depth_um).exp()).sum()
    }

    fn go_down(&mut self, by_um: f64) {
        self.0.iter_mut().for_each(|(depth_um, share)| *share *= (-by_um / *depth_um).exp());
        // A millionth of the critical dose moves no underside, and exponentials cost time.
        self.0.retain(|(_, share)| *share > 1e-6);
    }
}
