//! Levels of gray rows whose exposed pixels were corrected.

use std::ops::Range;

use lamp_stack::LevelChange;

/// A gray row.
pub(super) struct GrayRow<'a> {
    pub(super) levels: &'a [LevelChange],
    /// The transitions of the pixels that are exposed at all.
    pub(super) exposed: &'a [u32],
}

impl GrayRow<'_> {
    /// Returns the exposed run whose left edge (0) or right edge (1) is the nearest to a column.
    fn run_nearest(&self, edge: usize, column: u32) -> Option<Range<u32>> {
        let runs = self.exposed.chunks_exact(2);
        runs.min_by_key(|run| run[edge].abs_diff(column)).map(|run| run[0]..run[1])
    }
}

/// Returns the runs of a gray row with new exposed pixels: (length, level).
///
/// Along an edge that the row had, its levels stay. Along a new edge, the levels come from the good
/// row `beside`, along its nearest edge of that direction, up to full exposure or half its run.
/// Further inside, pixels that were black take the good row's levels, or full exposure.
pub(super) fn levels(had: &GrayRow<'_>, beside: &GrayRow<'_>, exposed: &[u32]) -> Vec<(u32, u8)> {
    let mut runs = Vec::new();
    let mut end = 0;
    for run in exposed.chunks_exact(2) {
        runs.push((run[0] - end, 0));
        white_run(had, beside, run[0]..run[1], &mut runs);
        end = run[1];
    }
    runs
}

/// Adds the levels of an exposed run.
fn white_run(had: &GrayRow<'_>, beside: &GrayRow<'_>, run: Range<u32>, runs: &mut Vec<(u32, u8)>) {
    let left = EdgeLevels::left(beside, run.start);
    let right = EdgeLevels::right(beside, run.end);
    // An edge of the other direction has its levels on its other side.
    let is_new = |column: u32, direction: usize| {
        had.exposed.binary_search(&column).map_or(true, |which| which % 2 != direction)
    };
    // A new run may be narrower than both edges of the good row: each gets half of it.
    let half = (run.end - run.start) / 2;
    let left_depth = if is_new(run.start, 0) { left.depth.min(half) } else { 0 };
    let right_depth = if is_new(run.end, 1) { right.depth.min(half) } else { 0 };
    let inside = left.at + left.depth..right.at;
    runs.extend(levels_in(beside.levels, left.at..left.at + left_depth));
    for (column, length, level) in
        with_columns(had.levels, run.start + left_depth..run.end - right_depth)
    {
        if level > 0 {
            runs.push((length, level));
            continue;
        }
        for (column, length, level) in with_columns(beside.levels, column..column + length) {
            // The good row's own edge levels would draw a second edge within this run.
            let known = level > 0 && inside.start <= column && column + length <= inside.end;
            runs.push((length, if known { level } else { 255 }));
        }
    }
    let right_end = right.at + right.depth;
    runs.extend(levels_in(beside.levels, right_end - right_depth..right_end));
}

/// The gray levels along an edge: `depth` pixels from column `at` on.
struct EdgeLevels {
    at: u32,
    depth: u32,
}

impl EdgeLevels {
    const NONE: Self = Self { at: 0, depth: 0 };

    /// Returns the levels along the left edge nearest to a column.
    fn left(row: &GrayRow<'_>, column: u32) -> Self {
        let Some(run) = row.run_nearest(0, column) else { return Self::NONE };
        let half = run.len().div_ceil(2) as u32;
        let gray = levels_in(row.levels, run.start..run.start + half).take_while(|run| run.1 < 255);
        Self { at: run.start, depth: gray.map(|run| run.0).sum() }
    }

    /// Returns the levels along the right edge nearest to a column.
    fn right(row: &GrayRow<'_>, column: u32) -> Self {
        let Some(run) = row.run_nearest(1, column) else { return Self::NONE };
        let half = run.len().div_ceil(2) as u32;
        let runs: Vec<_> = levels_in(row.levels, run.end - half..run.end).collect();
        let gray = runs.iter().rev().take_while(|run| run.1 < 255);
        let depth = gray.map(|run| run.0).sum();
        Self { at: run.end - depth, depth }
    }
}

/// Returns the runs of a row between two columns: (length, level).
fn levels_in(row: &[LevelChange], columns: Range<u32>) -> impl Iterator<Item = (u32, u8)> {
    with_columns(row, columns).map(|(_, length, level)| (length, level))
}

/// Returns the runs of a row between two columns, black ones too: (column, length, level).
fn with_columns(row: &[LevelChange], columns: Range<u32>) -> impl Iterator<Item = (u32, u32, u8)> {
    let mut next = row.partition_point(|change| change.column <= columns.start);
    let mut level = next.checked_sub(1).map_or(0, |last| row[last].level);
    let mut column = columns.start;
    std::iter::from_fn(move || {
        let end = row.get(next).map_or(columns.end, |change| change.column.min(columns.end));
        if column >= columns.end {
            return None;
        }
        let run = (column, end - column, level);
        column = end;
        level = row.get(next).map_or(0, |change| change.level);
        next += 1;
        Some(run)
    })
}
