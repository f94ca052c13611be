//! Chooses the gray levels of a band of rows, layer by layer from the top.

use std::sync::{Arc, OnceLock};

use lamp_stack::LevelChange;

use super::below::{Below, DEEP};
use super::columns::{BAND_ROWS, Columns, band_rows};
use super::print_through::{LevelsByDepth, PrintThrough};
use super::row_lists::RowLists;
use super::solid::SolidRow;

/// A surface this far above the underside, as a share of the critical dose, is short of it.
const SHORT: f64 = 1e-3;

/// What all pixels of a layer have in common.
pub(super) struct Around<'a> {
    light: &'a PrintThrough,
    layer: usize,
    /// The first layer above that does not count.
    end: usize,
    /// The levels under so many white layers, as far as they were asked for.
    by_depth: Vec<OnceLock<Arc<LevelsByDepth>>>,
}

impl<'a> Around<'a> {
    pub(super) fn new(light: &'a PrintThrough, layer: usize, end: usize) -> Self {
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
}

/// Chooses the levels of a band of rows.
pub(super) struct BandChooser<'a> {
    columns: &'a Columns,
    light: &'a PrintThrough,
    band: usize,
    column: ColumnLight,
    changes: LevelRow,
    short_px: u64,
    /// Columns that are still to be looked at, the first ones last.
    above: Vec<AbovePiece>,
}

/// Columns, and what is known of the layers above them up to the next.
struct AbovePiece {
    columns: (u32, u32),
    next: usize,
    seen: Seen,
}

/// What was seen above, from the lowest layer on.
#[derive(Clone, Copy)]
enum Seen {
    /// So many white layers.
    White(usize),
    /// So many white layers, and black ones above these.
    Black(usize),
    /// Anything else.
    Mixed,
}

impl Seen {
    /// Goes on with a layer that is part, perhaps down to the next.
    fn then_part(self, is_through: bool) -> Self {
        match self {
            Self::White(white) if is_through => Self::White(white + 1),
            _ => Self::Mixed,
        }
    }

    fn then_black(self) -> Self {
        match self {
            Self::White(white) => Self::Black(white),
            seen => seen,
        }
    }
}

/// The rows of a layer in a band, and their pixels that are short of the underside.
pub(super) type ChosenRows = (RowLists<LevelChange>, u64);

impl<'a> BandChooser<'a> {
    pub(super) fn new(columns: &'a Columns, light: &'a PrintThrough, band: usize) -> Self {
        let (column, changes) = (ColumnLight::default(), LevelRow::default());
        Self { columns, light, band, column, changes, short_px: 0, above: Vec::new() }
    }

    /// Chooses the rows of each layer.
    pub(super) fn choose(mut self, layers: &[Around<'_>]) -> Vec<ChosenRows> {
        let (Some(lowest), Some(highest)) = (layers.first(), layers.last()) else {
            return Vec::new();
        };
        let rows = self.columns.rows(lowest.layer);
        let (width, band) = (rows.width(), band_rows(self.band, rows));
        let (most_above, is_top) = (self.light.most_above(), highest.end == self.light.len());
        let solid = |_| SolidRow::new(width, most_above, is_top);
        let mut solid: Vec<SolidRow> = band.clone().map(solid).collect();
        let mut chosen = Vec::with_capacity(layers.len());
        for layer in (lowest.layer..highest.end).rev() {
            if let Some(around) = layers.get(layer - lowest.layer) {
                chosen.push(self.choose_layer(around, &solid, chosen.last()));
            }
            for (in_band, solid) in (0..).zip(&mut solid) {
                solid.go_down(layer, self.below(layer, in_band));
            }
        }
        chosen.reverse();
        chosen
    }

    fn choose_layer(
        &mut self,
        around: &Around<'_>,
        solid: &[SolidRow],
        last: Option<&ChosenRows>,
    ) -> ChosenRows {
        let mut rows = last.map_or_else(RowLists::default, |(rows, _)| RowLists::like(rows));
        self.short_px = 0;
        for (in_band, solid) in (0..).zip(solid) {
            std::mem::swap(rows.items_mut(), &mut self.changes.changes);
            self.choose_row(around, in_band, solid.columns());
            self.changes.end();
            std::mem::swap(rows.items_mut(), &mut self.changes.changes);
            rows.end_row();
        }
        (rows, self.short_px)
    }

    /// Chooses a row, given its number in the band and the columns that are part in all layers above.
    fn choose_row(&mut self, around: &Around<'_>, in_band: u32, mut solid: &[(u32, u32)]) {
        let layers_above = around.end - 1 - around.layer;
        for &Below { start, end, layer } in self.below(around.layer, in_band) {
            if layer == DEEP {
                self.changes.push(start, end, 255);
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
                    self.choose_below_gaps(around, in_band, (column, from), layer as usize);
                }
                if from < to {
                    self.by_depth(around, in_band, (from, to), layer as usize, layers_above);
                }
                column = to;
            }
        }
    }

    /// Adds the levels of columns that are not part in all layers above.
    fn choose_below_gaps(
        &mut self,
        around: &Around<'_>,
        in_band: u32,
        columns: (u32, u32),
        below: usize,
    ) {
        self.above.push(AbovePiece { columns, next: around.layer + 1, seen: Seen::White(0) });
        while let Some(piece) = self.above.pop() {
            let (start, end) = piece.columns;
            match piece.seen {
                Seen::Mixed => (start..end).for_each(|column| {
                    let level = self.column_level(around, in_band, column);
                    self.changes.push(column, column + 1, level);
                }),
                _ if piece.next < around.end => self.look_up(in_band, piece),
                Seen::White(white) | Seen::Black(white) => {
                    self.by_depth(around, in_band, piece.columns, below, white);
                }
            }
        }
    }

    /// Cuts columns by what the next layer above is there. The pieces are left in reverse.
    fn look_up(&mut self, in_band: u32, AbovePiece { columns, next, seen }: AbovePiece) {
        let first = self.above.len();
        let (mut column, end) = columns;
        let row = self.below(next, in_band);
        let mut rest = &row[row.partition_point(|piece| piece.end <= column)..];
        while column < end {
            let (to, seen) = match rest.first() {
                Some(piece) if piece.start <= column => {
                    rest = &rest[1..];
                    (piece.end, seen.then_part(piece.layer != next as u32))
                }
                gap => (gap.map_or(end, |piece| piece.start), seen.then_black()),
            };
            let to = to.min(end);
            self.above.push(AbovePiece { columns: (column, to), next: next + 1, seen });
            column = to;
        }
        self.above[first..].reverse();
    }

    fn below(&self, layer: usize, in_band: u32) -> &'a [Below] {
        self.columns.below(layer, self.band, in_band)
    }

    /// Adds the levels of columns under so many white layers, whose undersides lie in one layer.
    fn by_depth(
        &mut self,
        around: &Around<'_>,
        in_band: u32,
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
        let row = self.band as u32 * BAND_ROWS + in_band;
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

/// The changes of rows, the last of which is made from the left.
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

    /// Ends the row. The last column of images is black.
    fn end(&mut self) {
        if self.level > 0 {
            self.changes.push(LevelChange { column: self.end, level: 0 });
        }
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
