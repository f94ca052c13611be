//! How deep copies overlap: the way from each displacement to the nearest that is free.

use super::super::no_fit::{CellRun, NoFitRegion};

/// Cells from one place to the next where all of an area are compared.
pub(super) const STEP: i32 = 8;

/// The depth of every displacement at which two outlines overlap.
///
/// Depths are distances in fifths of a cell, by steps of 5 to the side and 7 along a diagonal.
///
/// Depths of displacements that are [`STEP`] cells apart stand together: a phase has the
/// displacements whose column and row leave the same remainders.
pub(super) struct DepthMap {
    /// The displacement of the first depth of the first phase.
    first: [i32; 2],
    /// The columns and rows of a phase.
    size: [i32; 2],
    depths: Vec<u16>,
}

/// The depths of one phase, as far as a grid of places meets them.
pub(super) struct Phase<'a> {
    /// The first column and row of the grid that is within it, and the column and row after the
    /// last.
    pub(super) from: [i32; 2],
    pub(super) to: [i32; 2],
    depths: &'a [u16],
    /// The offset from a column and row of the grid to a column and row of the phase.
    by: [i32; 2],
    columns: i32,
}

impl DepthMap {
    pub(super) fn new(region: &NoFitRegion) -> Self {
        let runs = region.rows.iter().flat_map(|runs| runs.iter());
        let left = runs.clone().map(|run| run.0).min().unwrap_or(0);
        let right = runs.map(|run| run.1).max().unwrap_or(0);
        let (columns, rows) = ((right - left) as usize, region.rows.len());
        let distances = distances(region, left, [columns, rows]);
        let size = [columns, rows].map(|side| side.div_ceil(STEP as usize));
        let mut depths = Vec::with_capacity(size[0] * size[1] * (STEP * STEP) as usize);
        // Each grid of places meets one phase, and reads its rows in sequence.
        for phase in 0..(STEP * STEP) as usize {
            let [x, y] = [phase % STEP as usize, phase / STEP as usize];
            for row in 0..size[1] {
                for column in 0..size[0] {
                    let [x, y] = [column * STEP as usize + x, row * STEP as usize + y];
                    let is_in = x < columns && y < rows;
                    depths.push(if is_in { distances[(y + 1) * (columns + 2) + x + 1] } else { 0 });
                }
            }
        }
        Self { first: [left, -region.top], size: size.map(|side| side as i32), depths }
    }

    /// Returns the depths of the opposite displacements.
    pub(super) fn reversed(&self) -> Self {
        let last = [0, 1].map(|axis| self.first[axis] + self.size[axis] * STEP - 1);
        Self {
            first: last.map(|end| -end),
            size: self.size,
            // The opposites of a phase form a phase, with rows and columns reversed: all of the
            // list turns.
            depths: self.depths.iter().rev().copied().collect(),
        }
    }

    /// Returns the depth of a displacement, 0 where it is free.
    pub(super) fn at(&self, by: [i32; 2]) -> u16 {
        let [x, y] = [0, 1].map(|axis| by[axis] - self.first[axis]);
        let [columns, rows] = self.size;
        if x < 0 || y < 0 || x >= columns * STEP || y >= rows * STEP {
            return 0;
        }
        let phase = y % STEP * STEP + x % STEP;
        self.depths[((phase * rows + y / STEP) * columns + x / STEP) as usize]
    }

    /// Returns the first and the last displacement that may not be free.
    pub(super) fn range(&self) -> [[i32; 2]; 2] {
        [self.first, [0, 1].map(|axis| self.first[axis] + self.size[axis] * STEP - 1)]
    }

    /// Returns the depths at a grid of displacements, [`STEP`] apart from the first on.
    pub(super) fn phase(&self, start: [i32; 2], grid: [i32; 2]) -> Phase<'_> {
        let offset = [0, 1].map(|axis| start[axis] - self.first[axis]);
        let by = offset.map(|cells| cells.div_euclid(STEP));
        let [x, y] = offset.map(|cells| cells.rem_euclid(STEP));
        let from = by.map(|by| (-by).max(0));
        let to = [0, 1].map(|axis| (self.size[axis] - by[axis]).min(grid[axis]));
        let depths = self.size[0] * self.size[1];
        let before = ((y * STEP + x) * depths) as usize;
        let columns = self.size[0];
        Phase { from, to, depths: &self.depths[before..][..depths as usize], by, columns }
    }
}

impl Phase<'_> {
    /// Returns the depths of a row of the grid, from its first column within on.
    pub(super) fn row(&self, row: i32) -> &[u16] {
        let start = (row + self.by[1]) * self.columns + self.from[0] + self.by[0];
        &self.depths[start as usize..][..(self.to[0] - self.from[0]) as usize]
    }

    pub(super) fn is_empty(&self) -> bool {
        self.from[0] >= self.to[0] || self.from[1] >= self.to[1]
    }
}

/// Returns the distance from each displacement to the nearest that is free, with a frame of free
/// ones around.
fn distances(region: &NoFitRegion, left: i32, [columns, rows]: [usize; 2]) -> Vec<u16> {
    let wide = columns + 2;
    let mut all = vec![0u16; wide * (rows + 2)];
    for (row, runs) in region.rows.iter().enumerate() {
        for &(from, to) in runs.iter() {
            let run: CellRun = (from - left, to - left);
            all[(row + 1) * wide + 1..][run.0 as usize..run.1 as usize].fill(u16::MAX);
        }
    }
    // A chamfer distance: 7/5 is nearly √2. The first pass brings distances from above and the
    // left, the second from below and the right. `u16::MAX` is not known yet, and saturates.
    let mut lower = |at: usize, near: [usize; 2], aslant: [usize; 2]| {
        if all[at] > 0 {
            let near = near.map(|near| all[near].saturating_add(5));
            let aslant = aslant.map(|near| all[near].saturating_add(7));
            all[at] = near.into_iter().chain(aslant).fold(all[at], u16::min);
        }
    };
    for row in 1..=rows {
        for at in row * wide + 1..=row * wide + columns {
            lower(at, [at - 1, at - wide], [at - wide - 1, at - wide + 1]);
        }
    }
    for row in (1..=rows).rev() {
        for at in (row * wide + 1..=row * wide + columns).rev() {
            lower(at, [at + 1, at + wide], [at + wide - 1, at + wide + 1]);
        }
    }
    all
}
