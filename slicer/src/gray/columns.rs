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
//! of the layers below.

use std::sync::Arc;

use lamp_stack::{GrayMask, Image};

use super::print_through::{LevelsByDepth, PrintThrough};
use super::row_pieces::{Piece, push_joined, split};
use super::rows::{DepthRows, finished};

/// Rounding of depths, which must not open gaps between layers.
const TIE_UM: f64 = 0.01;
/// A surface this far above the underside, as a share of the critical dose, is short of it.
const SHORT: f64 = 1e-3;

/// A layer whose levels are chosen.
pub(crate) struct ChosenLayer {
    pub(crate) image: Image,
    /// The pixels that even white does not cure down to the underside within the layer.
    pub(crate) short_px: u64,
}

/// The depths of some layers in a row.
#[derive(Clone, Copy)]
pub(crate) struct KnownDepths<'a> {
    /// The number of the first.
    pub(crate) first: usize,
    pub(crate) rows: &'a [DepthRows],
}

impl<'a> KnownDepths<'a> {
    fn of(self, layer: usize) -> Option<&'a DepthRows> {
        self.rows.get(layer.checked_sub(self.first)?)
    }
}

/// Chooses the levels of a layer.
pub(crate) struct LevelChooser<'a> {
    light: &'a PrintThrough,
    layer: usize,
    known: KnownDepths<'a>,
    /// The first layer above that does not count.
    end: usize,
    /// The levels under so many white layers, as far as they were asked for.
    by_depth: Vec<Option<Arc<LevelsByDepth>>>,
    column: ColumnLight,
    short_px: u64,
}

/// How a pixel's underside is found: so many layers further down, at this distance of tops.
#[derive(Clone, Copy)]
struct Below {
    layers: usize,
    tops_um: f64,
}

impl<'a> LevelChooser<'a> {
    /// Starts a layer, given the depths of the layers below and above it, as far as they count.
    pub(crate) fn new(light: &'a PrintThrough, layer: usize, known: KnownDepths<'a>) -> Self {
        let end = light.end_above(layer).min(known.first + known.rows.len());
        let by_depth = vec![None; end - layer];
        Self { light, layer, known, end, by_depth, column: ColumnLight::default(), short_px: 0 }
    }

    pub(crate) fn choose(mut self) -> ChosenLayer {
        let own = self.known.of(self.layer).expect("its own depths are known");
        let mut image = GrayMask::new(own.width());
        let mut runs = Vec::new();
        for row in 0..own.height() {
            runs.clear();
            if !own.row(row).is_empty() {
                self.choose_row(row, &mut runs);
            }
            image.push_runs(runs.iter().copied()).expect("runs are those of the row");
        }
        ChosenLayer { image: finished(image), short_px: self.short_px }
    }

    /// Adds the runs of a row.
    fn choose_row(&mut self, row: u32, runs: &mut Vec<(u32, u8)>) {
        let (near, white) = self.undersides(row);
        let mut levels: Vec<(u32, u32, u8)> =
            white.iter().map(|&(from, to)| (from, to, 255)).collect();
        if !near.is_empty() {
            let mut stretches = Vec::new();
            near.iter().for_each(|&(from, to, _)| push_joined(&mut stretches, (from, to)));
            let under = self.layers_above(row, stretches);
            let mut under = under.into_iter().peekable();
            for (start, end, below) in near {
                let mut column = start;
                while column < end {
                    while under.next_if(|&(_, to, _)| to <= column).is_some() {}
                    let (white_above, to) = match under.peek() {
                        Some(&(from, to, count)) if from <= column => (Some(count), to.min(end)),
                        Some(&(from, ..)) => (None, from.min(end)),
                        None => (None, end),
                    };
                    match white_above {
                        Some(count) => self.by_depth(row, (column, to), below, count, &mut levels),
                        None => levels
                            .extend((column..to).map(|column| {
                                (column, column + 1, self.column_level(row, column))
                            })),
                    }
                    column = to;
                }
            }
            levels.sort_unstable();
        }
        let mut column = 0;
        for (from, to, level) in levels {
            runs.extend([(from - column, 0), (to - from, level)]);
            column = to;
        }
    }

    /// Returns the stretches of a row above undersides that light reaches, and those that are
    /// white as the part is deeper.
    fn undersides(&self, row: u32) -> (Vec<(u32, u32, Below)>, Vec<Piece>) {
        let (mut near, mut tops_um) = (Vec::new(), 0.0);
        let own = self.known.of(self.layer).expect("its own depths are known");
        let mut through = vec![(0, own.width())];
        for layers in 0.. {
            let Some(layer) = self.layer.checked_sub(layers) else { break };
            if tops_um >= self.light.reach_um() || through.is_empty() {
                break;
            }
            let Some(rows) = self.known.of(layer) else { break };
            let step_um = self.light.step_um(layer);
            let mut deeper = Vec::new();
            split(&through, rows, row, |piece, depth_um| {
                if is_through(depth_um, step_um) {
                    push_joined(&mut deeper, piece);
                } else if depth_um > 0.0 || layers > 0 {
                    // Black right below is an underside at the plane between.
                    match near.last_mut() {
                        Some((_, to, Below { layers: same, .. }))
                            if *to == piece.0 && *same == layers =>
                        {
                            *to = piece.1;
                        }
                        _ => near.push((piece.0, piece.1, Below { layers, tops_um })),
                    }
                }
            });
            through = deeper;
            tops_um += step_um;
        }
        near.sort_unstable_by_key(|&(from, ..)| from);
        (near, through)
    }

    /// Returns the pieces of stretches of a row above which so many layers are white without gaps,
    /// and all others, as far as they count, are black.
    fn layers_above(&self, row: u32, mut white: Vec<Piece>) -> Vec<(u32, u32, usize)> {
        let mut ended: Vec<(u32, u32, usize)> = Vec::new();
        for layer in self.layer + 1..self.end {
            let rows = self.known.of(layer).expect("it is known as it counts");
            let step_um = self.light.step_um(layer);
            if !ended.is_empty() {
                let mut still = Vec::new();
                for &(from, to, count) in &ended {
                    split(&[(from, to)], rows, row, |piece, depth_um| {
                        if depth_um == 0.0 {
                            still.push((piece.0, piece.1, count));
                        }
                    });
                }
                ended = still;
            }
            let mut higher = Vec::new();
            split(&white, rows, row, |piece, depth_um| {
                if is_through(depth_um, step_um) {
                    push_joined(&mut higher, piece);
                } else if depth_um == 0.0 {
                    ended.push((piece.0, piece.1, layer - 1 - self.layer));
                }
            });
            white = higher;
            if white.is_empty() && ended.is_empty() {
                break;
            }
        }
        let all = self.end - 1 - self.layer;
        ended.extend(white.iter().map(|&(from, to)| (from, to, all)));
        ended.sort_unstable();
        ended
    }

    /// Adds the levels of a stretch under so many white layers.
    fn by_depth(
        &mut self,
        row: u32,
        stretch: Piece,
        below: Below,
        count: usize,
        levels: &mut Vec<(u32, u32, u8)>,
    ) {
        let (light, layer) = (self.light, self.layer);
        let goes_on = self.end < light.len() && count + 1 == self.end - layer;
        let table = self.by_depth[count].get_or_insert_with(|| {
            light.levels_by_depth(layer, if goes_on { None } else { Some(count) })
        });
        let here = layer - below.layers;
        let step_um = light.step_um(here);
        if below.tops_um + step_um < table.first_um() {
            // However deep it is within its layer.
            return levels.push((stretch.0, stretch.1, 1));
        }
        let rows = self.known.of(here).expect("an underside was found in it");
        let mut short_px = 0;
        split(&[stretch], rows, row, |(from, to), depth_um| {
            let depth_um = below.tops_um + depth_um;
            if below.layers == 0 && depth_um > table.falls_short_um + 1.0 {
                short_px += u64::from(to - from);
            }
            levels.push((from, to, table.level(depth_um)));
        });
        self.short_px += short_px;
    }

    /// Returns the depth of the part below a layer's top, infinite where light does not reach.
    fn depth_um(&self, mut layer: usize, row: u32, column: u32) -> f64 {
        let mut tops_um = 0.0;
        loop {
            let Some(rows) = self.known.of(layer) else { return f64::INFINITY };
            let (depth_um, step_um) = (rows.at(row, column), self.light.step_um(layer));
            if !is_through(depth_um, step_um) {
                return tops_um + depth_um;
            }
            tops_um += step_um;
            if tops_um >= self.light.reach_um() || layer == 0 {
                return f64::INFINITY;
            }
            layer -= 1;
        }
    }

    /// Goes down a column to the layer, from as far up as it counts.
    fn column_level(&mut self, row: u32, column: u32) -> u8 {
        self.column.darken();
        let mut level = 0;
        for layer in (self.layer..self.end).rev() {
            let levels = self.light.of_layer(layer);
            let depth_um = self.depth_um(layer, row, column);
            level = if depth_um == 0.0 {
                0
            } else if depth_um.is_infinite() {
                255
            } else {
                let before = self.column.left(depth_um) + self.light.least_below(layer, depth_um);
                let level = levels.level(depth_um, 1.0 - before).max(1);
                let is_lowest = layer == self.layer && depth_um < self.light.step_um(layer);
                if is_lowest && level == 255 {
                    let left = before + levels.left(level, depth_um);
                    self.short_px += u64::from(left < 1.0 - SHORT);
                }
                level
            };
            if level > 0 {
                self.column.add(levels.depth_um(level), levels.share(level));
            }
            if layer > self.layer {
                self.column.go_down(self.light.step_um(layer));
            }
        }
        level
    }
}

/// Returns whether the part goes on into the layer below. The first layer has none, but may stand.
fn is_through(depth_um: f64, step_um: f64) -> bool {
    depth_um.is_infinite() || depth_um > step_um - TIE_UM
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
