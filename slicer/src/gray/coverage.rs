//! Gray edges: each pixel's level is the share of its area within the section.
//!
//! By Green's theorem, the area within a contour is the sum of the trapezoids to the right of its
//! edges, with signs. An edge therefore adds to the pixels that it passes and, by its height, to
//! all pixels to the right of them. Between edges a row's level does not change, so the cost
//! grows with edges, not with area.
//!
//! A sum of windings is an area only where no winding exceeds one. Edges of a row that share pixels
//! form a cluster. If they do not all cross it one way, as at overlaps of bodies or the ends of
//! contours, the cluster is swept from top to bottom, and only edges between inside and outside
//! count.

use std::ops::Range;

use lamp_stack::{GrayMask, Image, KeyCounts, LevelChange};

use super::row_lists::RowLists;
use super::rows::finished;
use crate::bodies::{FillRule, Position, Turn};
use crate::grid::PixelGrid;
use crate::image_rows::sort_by;

/// A pixel's height, and its area, in the whole numbers that are summed. The ends of edges are rounded
/// to them once for both facets, so a closed contour's heights add up to exactly zero.
const UNIT: i32 = 1 << 20;

/// An edge of a contour in a layer, in pixels from the image's corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    /// The columns of its upper and lower end.
    x: [f64; 2],
    /// Their rows.
    y: [f64; 2],
    /// The step of the winding number at the edge, from left to right.
    turn: Turn,
}

impl Edge {
    /// Creates the edge of a body between two points given in pixels from the first pixel's center;
    /// `is_reversed` says that the second one is the start.
    #[inline]
    pub(crate) fn new([a, b]: [[f64; 2]; 2], is_reversed: bool, body: u32) -> Self {
        let down = a[1] < b[1];
        let [upper, lower] = if down { [a, b] } else { [b, a] };
        let winding = if down == is_reversed { -1 } else { 1 };
        let [x, y] = [0, 1].map(|axis| [upper[axis] + 0.5, lower[axis] + 0.5]);
        Self { x, y, turn: Turn::new(body, winding) }
    }

    /// Returns the rows of its ends in units, within an image.
    #[inline]
    fn units(&self, height: u32) -> [i64; 2] {
        let end = i64::from(height) * i64::from(UNIT);
        // Rounded by a cast, since `f64::round` is a call on many processors.
        self.y.map(|y| ((y * f64::from(UNIT) + 0.5) as i64).clamp(0, end))
    }

    /// Returns the rows between two ends in units.
    #[inline]
    fn rows([top, bottom]: [i64; 2]) -> Range<usize> {
        let unit = i64::from(UNIT);
        // An edge along a row has no rows.
        let end = if top < bottom { (bottom + unit - 1) / unit } else { top / unit };
        (top / unit) as usize..end as usize
    }

    /// Calls `each` with its piece in each row.
    #[inline]
    fn for_each_piece(&self, grid: &PixelGrid, mut each: impl FnMut(usize, Piece)) {
        let [top, bottom] = self.units(grid.height);
        let rows = Self::rows([top, bottom]);
        // Not used if it is a division by zero: such an edge has no rows.
        let columns_per_row = (self.x[1] - self.x[0]) / (self.y[1] - self.y[0]);
        let [least, most] = [self.x[0].min(self.x[1]), self.x[0].max(self.x[1])];
        let mut upper = self.x[0];
        for row in rows.clone() {
            let start = row as i64 * i64::from(UNIT);
            let y = [(top - start).max(0) as i32, (bottom - start).min(UNIT.into()) as i32];
            let lower = if row + 1 == rows.end {
                self.x[1]
            } else {
                let down = (row + 1) as f64 - self.y[0];
                // Rounding must not move it past the edge's ends.
                (self.x[0] + columns_per_row * down).max(least).min(most)
            };
            each(row, Piece::new([upper, lower], y, self.turn, grid.width));
            upper = lower;
        }
    }
}

/// The piece of an edge in a row.
#[derive(Clone, Copy, Debug, Default)]
struct Piece {
    /// The columns of its upper and lower end.
    x: [f64; 2],
    /// Their distances from the row's top, in units.
    y: [i32; 2],
    /// The first and the last pixel that it passes.
    pixels: [u32; 2],
    turn: Turn,
}

impl Piece {
    #[inline]
    fn new(x: [f64; 2], y: [i32; 2], turn: Turn, width: u32) -> Self {
        let pixels = [x[0].min(x[1]), x[0].max(x[1])].map(|x| (x as u32).min(width - 1));
        Self { x, y, pixels, turn }
    }

    #[inline]
    fn height(&self) -> i32 {
        self.y[1] - self.y[0]
    }

    /// Returns its column at a distance from the row's top, within its ends.
    fn at(&self, y: f64) -> f64 {
        let share = (y - f64::from(self.y[0])) / f64::from(self.height());
        self.x[0] + (self.x[1] - self.x[0]) * share.clamp(0.0, 1.0)
    }

    /// Returns the piece between two distances from the row's top.
    fn part(&self, y: [i32; 2], width: u32) -> Self {
        Self::new(y.map(|y| self.at(y.into())), y, self.turn, width)
    }

    /// Returns where in the row it crosses another piece.
    fn crossing(&self, other: &Self) -> Option<i32> {
        let [top, bottom] = [self.y[0].max(other.y[0]), self.y[1].min(other.y[1])];
        if top >= bottom {
            return None;
        }
        let [upper, lower] = [top, bottom].map(|y| self.at(y.into()) - other.at(y.into()));
        (upper * lower < 0.0).then(|| {
            let down = f64::from(bottom - top) * upper / (upper - lower);
            top + (down + 0.5) as i32
        })
    }

    /// Calls `each` with the cell of each pixel that it passes, from the left.
    #[inline]
    fn for_each_cell(&self, mut each: impl FnMut(Cell)) {
        // An area does not depend on the direction in which columns are passed.
        let [left, right] = [self.x[0].min(self.x[1]), self.x[0].max(self.x[1])];
        let [first, last] = self.pixels;
        let height = self.height();
        let (mut done, mut from) = (0, left);
        for column in first..=last {
            let end = f64::from(column + 1);
            let (to, until) = if column == last {
                (right, height)
            } else {
                let down = f64::from(height) * (end - left) / (right - left);
                (end, ((down + 0.5) as i32).min(height))
            };
            let cover = until - done;
            let beside = end - 0.5 * (from + to);
            let area = (f64::from(cover) * beside + 0.5) as i32;
            each(Cell { column, area, cover });
            (done, from) = (until, to);
        }
    }
}

/// The contribution of edges to a pixel.
#[derive(Clone, Copy)]
struct Cell {
    column: u32,
    /// The area in this pixel to the right of the edges.
    area: i32,
    /// The area in each pixel further right.
    cover: i32,
}

/// Returns a layer whose levels are the levels of `image`, which has the pixels whose centers are within
/// the section, times the shares of pixels within the section. Rows whose edges do not add up, because
/// facets are missing, are rows of `image`.
pub(crate) fn covered<'a, I: Iterator<Item = &'a Edge>>(
    edges: impl Fn() -> I,
    grid: &PixelGrid,
    rule: &FillRule,
    image: &Image,
    stray_rows: &[u32],
) -> Image {
    let height = grid.height;
    let mut counts = KeyCounts::new(height as usize);
    edges().for_each(|edge| counts.add_each(Edge::rows(edge.units(height))));
    let mut by_row = counts.into_groups();
    edges().for_each(|edge| {
        edge.for_each_piece(grid, |row, piece| {
            by_row.put(row, piece).expect("as many pieces as before");
        });
    });
    let mut by_row = by_row.finish();
    let mut rows = Rows::new(grid.width, rule, by_row.items().len());
    for row in 0..height {
        let is_stray = stray_rows.binary_search(&row).is_ok();
        if is_stray || !rows.add(by_row.group_mut(row as usize)) {
            rows.copy(image, row);
        } else if let Image::Gray(gray) = image {
            rows.dim(gray, row);
        }
        rows.end();
    }
    finished(grid.width, rows.made)
}

/// The rows made so far, and lists that keep their memory.
struct Rows<'a> {
    width: u32,
    rule: &'a FillRule,
    made: RowLists<LevelChange>,
    /// The changes of the row in work.
    changes: Vec<LevelChange>,
    cells: Vec<Cell>,
    /// The heights of a cluster's edges, with signs, by body.
    heights: Vec<(u32, i64)>,
    breaks: Vec<i32>,
    met: Vec<(f64, Piece)>,
}

impl<'a> Rows<'a> {
    fn new(width: u32, rule: &'a FillRule, pieces: usize) -> Self {
        Self {
            width,
            rule,
            // An edge changes the level of one pixel, and the level after it.
            made: RowLists::with_room(0, 2 * pieces),
            changes: Vec::new(),
            cells: Vec::new(),
            heights: Vec::new(),
            breaks: Vec::new(),
            met: Vec::new(),
        }
    }

    /// Adds the levels of a row. Returns false, and adds nothing, if its edges do not add up.
    fn add(&mut self, pieces: &mut [Piece]) -> bool {
        self.heights.clear();
        // The order of pieces in one pixel, which depends on threads, has no effect on sums.
        sort_by(pieces, |a, b| a.pixels[0].cmp(&b.pixels[0]));
        let mut position = Position::outside(self.rule);
        let mut is_inside = false;
        let mut rest = &pieces[..];
        while let Some((first, others)) = rest.split_first() {
            let was_inside = is_inside;
            // The usual case: one edge alone crosses the whole row.
            let is_alone = others.first().is_none_or(|next| next.pixels[0] > first.pixels[1]);
            if is_alone && first.height() == UNIT {
                position.cross(first.turn);
                is_inside = position.is_inside();
                if is_inside != was_inside {
                    self.add_alone(first, is_inside);
                }
                rest = others;
                continue;
            }
            let (cluster, others) = rest.split_at(self.cluster_len(rest));
            let is_monotone = match self.heights[..] {
                [(_, sum)] => {
                    sum.abs() == i64::from(UNIT)
                        && cluster.iter().all(|it| i64::from(it.turn.winding()) == sum.signum())
                }
                _ => false,
            };
            if !is_monotone {
                self.sweep(cluster, &position);
            }
            for &(body, sum) in &self.heights {
                position.step(body, (sum / i64::from(UNIT)) as i32);
            }
            is_inside = position.is_inside();
            if is_monotone && is_inside != was_inside {
                cluster.iter().for_each(|piece| self.put(piece, is_inside));
            }
            self.flush(was_inside, is_inside);
            rest = others;
        }
        let is_balanced = position.is_balanced() && self.are_whole();
        if !is_balanced {
            self.changes.clear();
        }
        is_balanced
    }

    /// Adds the levels of an edge between outside and inside that is alone in its pixels.
    #[inline]
    fn add_alone(&mut self, piece: &Piece, is_inside: bool) {
        let (mut cover, unit) = (0, i64::from(UNIT));
        piece.for_each_cell(|cell| {
            let area = cover + i64::from(cell.area);
            self.push(cell.column, level(if is_inside { area } else { unit - area }));
            cover += i64::from(cell.cover);
        });
        self.push(piece.pixels[1] + 1, if is_inside { u8::MAX } else { 0 });
    }

    /// Returns the number of pieces in the first cluster of a row, and leaves their heights: the pieces
    /// share pixels, and up to their end contours are not whole.
    fn cluster_len(&mut self, pieces: &[Piece]) -> usize {
        self.heights.clear();
        let mut right = pieces[0].pixels[1];
        for (k, piece) in pieces.iter().enumerate() {
            if piece.pixels[0] > right && self.are_whole() {
                return k;
            }
            right = right.max(piece.pixels[1]);
            let height = i64::from(piece.height() * piece.turn.winding());
            match self.heights.iter_mut().find(|(body, _)| *body == piece.turn.body()) {
                Some((_, sum)) => *sum += height,
                None => self.heights.push((piece.turn.body(), height)),
            }
        }
        pieces.len()
    }

    /// Returns whether the edges of the last cluster end where they must.
    fn are_whole(&self) -> bool {
        self.heights.iter().all(|(_, sum)| sum % i64::from(UNIT) == 0)
    }

    /// Adds the pieces of boundaries between inside and outside in a cluster.
    fn sweep(&mut self, cluster: &[Piece], before: &Position<'_>) {
        // Crossings of pairs take the square of their number.
        const MOST: usize = 256;
        // Hostile clusters get strips of a 256th of a row.
        const STRIPS: i32 = 256;
        self.breaks.clear();
        if cluster.len() <= MOST {
            self.breaks.extend(cluster.iter().flat_map(|piece| piece.y));
            for (k, piece) in cluster.iter().enumerate() {
                let others = cluster[k + 1..].iter();
                self.breaks.extend(others.filter_map(|other| piece.crossing(other)));
            }
            self.breaks.sort_unstable();
            self.breaks.dedup();
        } else {
            self.breaks.extend((0..=STRIPS).map(|strip| strip * (UNIT / STRIPS)));
        }
        let breaks = std::mem::take(&mut self.breaks);
        let mut met = std::mem::take(&mut self.met);
        for strip in breaks.windows(2) {
            let (y, middle) =
                ([strip[0], strip[1]], f64::midpoint(strip[0].into(), strip[1].into()));
            let is_met = |it: &&Piece| f64::from(it.y[0]) < middle && middle < f64::from(it.y[1]);
            met.clear();
            met.extend(cluster.iter().filter(is_met).map(|piece| (piece.at(middle), *piece)));
            met.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut position = before.clone();
            let mut is_inside = position.is_inside();
            for (_, piece) in &met {
                position.cross(piece.turn);
                if position.is_inside() != is_inside {
                    is_inside = !is_inside;
                    self.put(&piece.part(y, self.width), is_inside);
                }
            }
        }
        (self.breaks, self.met) = (breaks, met);
    }

    /// Adds a boundary with the inside on its right, or on its left.
    #[inline]
    fn put(&mut self, piece: &Piece, is_inside: bool) {
        let sign = if is_inside { 1 } else { -1 };
        piece.for_each_cell(|Cell { column, area, cover }| {
            self.cells.push(Cell { column, area: sign * area, cover: sign * cover });
        });
    }

    /// Turns the cells of a cluster into changes of level.
    fn flush(&mut self, was_inside: bool, is_inside: bool) {
        let mut cells = std::mem::take(&mut self.cells);
        cells.sort_unstable_by_key(|cell| cell.column);
        let mut cover = if was_inside { i64::from(UNIT) } else { 0 };
        for of_pixel in cells.chunk_by(|a, b| a.column == b.column) {
            let column = of_pixel[0].column;
            let sum =
                |of: fn(&Cell) -> i32| of_pixel.iter().map(|it| i64::from(of(it))).sum::<i64>();
            self.push(column, level(cover + sum(|it| it.area)));
            cover += sum(|it| it.cover);
            self.push(column + 1, level(cover));
        }
        if let Some(last) = cells.last() {
            // Where facets are missing, strips may disagree with the row's sums.
            self.push(last.column + 1, if is_inside { u8::MAX } else { 0 });
        }
        cells.clear();
        self.cells = cells;
    }

    /// Gives all pixels from a column on a level.
    #[inline]
    fn push(&mut self, column: u32, level: u8) {
        // The level of a pixel takes the place of an earlier one.
        self.changes.pop_if(|last| last.column == column);
        if self.changes.last().map_or(0, |last| last.level) != level {
            self.changes.push(LevelChange { column, level });
        }
    }

    /// Adds the levels of a row of an image.
    fn copy(&mut self, image: &Image, row: u32) {
        for (start, end, level) in image.runs(row) {
            self.push(start, level);
            if end < self.width {
                self.push(end, 0);
            }
        }
    }

    /// Multiplies the shares of a row by levels. A pixel whose center is outside gets the level of a
    /// pixel to its left, to its right, above or below.
    fn dim(&mut self, levels: &GrayMask, row: u32) {
        let shares = std::mem::take(&mut self.changes);
        let mut next = shares.iter().skip(1).map(|change| change.column);
        for &LevelChange { column, level: share } in &shares {
            let end = next.next().unwrap_or(self.width);
            if share == 0 {
                self.push(column, 0);
                continue;
            }
            let mut at = column;
            while at < end {
                let (level, same_until) = level_from(levels, row, at);
                // Beyond the pixel itself, neighbors differ.
                let until = if level > 0 { same_until.min(end) } else { at + 1 };
                let level = if level > 0 { level } else { level_beside(levels, row, at) };
                let level = (u32::from(share) * u32::from(level) + 127) / 255;
                self.push(at, level as u8);
                at = until;
            }
        }
    }

    fn end(&mut self) {
        self.made.items_mut().append(&mut self.changes);
        self.made.end_row();
    }
}

/// Returns the level of a pixel with an area inside.
#[inline]
fn level(area: i64) -> u8 {
    let unit = i64::from(UNIT);
    ((area.clamp(0, unit) * 255 + unit / 2) / unit) as u8
}

/// Returns the level of a pixel, and the column up to which it holds.
fn level_from(levels: &GrayMask, row: u32, column: u32) -> (u8, u32) {
    let changes = levels.row(row);
    let after = changes.partition_point(|change| change.column <= column);
    let level = after.checked_sub(1).map_or(0, |last| changes[last].level);
    (level, changes.get(after).map_or(levels.width(), |change| change.column))
}

/// Returns the level of the first pixel beside, above or below one that is not black; white if all
/// are black, as thin walls are between centers.
fn level_beside(levels: &GrayMask, row: u32, column: u32) -> u8 {
    let beside = [(0, -1), (0, 1), (-1, 0), (1, 0)].map(|(down, right)| {
        let row = row.checked_add_signed(down).filter(|row| *row < levels.height())?;
        let column = column.checked_add_signed(right).filter(|column| *column < levels.width())?;
        Some(level_from(levels, row, column).0)
    });
    beside.into_iter().flatten().find(|level| *level > 0).unwrap_or(u8::MAX)
}
