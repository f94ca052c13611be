//! Rows as runs with both ends.

use lamp_stack::{Mask, MaskBuilder, white_runs};

/// The columns from the first up to, but without, the second.
pub(super) type Run = (i32, i32);

/// For each row of an image its runs, from the left, apart from each other.
#[derive(Clone, Debug)]
pub(super) struct RowRuns {
    ends: Vec<usize>,
    runs: Vec<Run>,
}

impl RowRuns {
    /// No rows yet.
    pub(super) fn new() -> Self {
        Self { ends: vec![0], runs: Vec::new() }
    }

    /// The white runs of a mask.
    pub(super) fn white(mask: &Mask) -> Self {
        let mut rows = Self::new();
        rows.runs.reserve(mask.change_count() / 2 + 1);
        for row in mask.rows() {
            let runs = white_runs(row, mask.width());
            rows.runs.extend(runs.map(|(start, end)| (start as i32, end as i32)));
            rows.ends.push(rows.runs.len());
        }
        rows
    }

    /// Adds a row below the others.
    pub(super) fn push(&mut self, row: &[Run]) {
        self.runs.extend_from_slice(row);
        self.ends.push(self.runs.len());
    }

    pub(super) fn height(&self) -> u32 {
        (self.ends.len() - 1) as u32
    }

    pub(super) fn row(&self, row: u32) -> &[Run] {
        let row = row as usize;
        &self.runs[self.ends[row]..self.ends[row + 1]]
    }

    /// Whether a pixel is in a run.
    pub(super) fn holds(&self, column: i32, row: u32) -> bool {
        let runs = self.row(row);
        let next = runs.partition_point(|run| run.1 <= column);
        runs.get(next).is_some_and(|run| run.0 <= column)
    }

    /// Whether no row has a run.
    pub(super) fn are_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// As a mask of so many columns, which hold all runs.
    pub(super) fn mask(&self, width: u32) -> Mask {
        let mut mask = MaskBuilder::new(width);
        mask.reserve(self.height() as usize, 2 * self.runs.len());
        let mut transitions: Vec<u32> = Vec::new();
        for row in 0..self.height() {
            transitions.clear();
            for &(start, end) in self.row(row) {
                match transitions.last() {
                    Some(&last) if last == start as u32 => _ = transitions.pop(),
                    _ => transitions.push(start as u32),
                }
                transitions.push(end as u32);
            }
            transitions.pop_if(|end| *end == width);
            mask.push_row(&transitions).expect("runs rise within the image");
        }
        mask.finish()
    }
}

/// Makes `out` the parts of `runs` that are in no run of `others`.
pub(super) fn subtract(runs: &[Run], others: &[Run], out: &mut Vec<Run>) {
    out.clear();
    let mut next = 0;
    for &(mut start, end) in runs {
        while others.get(next).is_some_and(|other| other.1 <= start) {
            next += 1;
        }
        let mut over = next;
        while let Some(&(from, to)) = others.get(over).filter(|other| other.0 < end) {
            if start < from {
                out.push((start, from));
            }
            start = start.max(to);
            over += 1;
        }
        if start < end {
            out.push((start, end));
        }
    }
}
