//! Rows as runs with both ends, which erosion and components work on.

use lamp_stack::{Mask, MaskBuilder, white_runs};

/// The columns from the first up to, but without, the second. Signed, as discs reach beyond the
/// image.
pub(super) type Run = (i32, i32);

/// The runs of each row of an image, from the left and apart from each other.
#[derive(Clone, Debug)]
pub(super) struct RowRuns {
    ends: Vec<usize>,
    runs: Vec<Run>,
}

impl RowRuns {
    /// Returns an image without rows.
    pub(super) fn new() -> Self {
        Self { ends: vec![0], runs: Vec::new() }
    }

    /// Returns the white runs of a mask.
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

    /// Returns the black runs of a mask and of a frame of a pixel around it, so that the mask's
    /// first row is the second.
    pub(super) fn black_around(mask: &Mask) -> Self {
        let whole = (-1, mask.width() as i32 + 1);
        let white = Self::white(mask);
        let mut rows = Self::new();
        rows.push(&[whole]);
        let mut black = Vec::new();
        for row in white.rows() {
            subtract(&[whole], row, &mut black);
            rows.push(&black);
        }
        rows.push(&[whole]);
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

    /// Returns the runs of each row.
    pub(super) fn rows(&self) -> impl Iterator<Item = &[Run]> {
        self.ends.windows(2).map(|ends| &self.runs[ends[0]..ends[1]])
    }

    /// Returns the runs of a row; none outside the image.
    pub(super) fn row_or_none(&self, row: i64) -> &[Run] {
        match u32::try_from(row) {
            Ok(row) if row < self.height() => self.row(row),
            _ => &[],
        }
    }

    /// Returns the index of a run of a row, counted through all rows.
    pub(super) fn index(&self, row: u32, run: usize) -> usize {
        self.ends[row as usize] + run
    }

    /// Returns the runs of all rows.
    pub(super) fn all(&self) -> &[Run] {
        &self.runs
    }

    /// Returns the index of the run that holds a pixel, counted through all rows.
    pub(super) fn find(&self, column: i32, row: u32) -> Option<usize> {
        let runs = self.row(row);
        let next = runs.partition_point(|run| run.1 <= column);
        runs.get(next).filter(|run| run.0 <= column).map(|_| self.ends[row as usize] + next)
    }

    /// Returns the place in its row of the run that holds a point, searched from a place on.
    pub(super) fn place(&self, column: f64, row: i64, from: usize) -> Option<usize> {
        // The cast would round -0.5 to column 0.
        if column < 0.0 {
            return None;
        }
        let (runs, column) = (self.row_or_none(row), column as i32);
        let place = first_past(runs, |run| run.1, column, from);
        runs.get(place).filter(|run| run.0 <= column).map(|_| place)
    }

    /// Calls `touch` with the indices of each two runs of neighboring rows that touch, at sides
    /// or corners: the upper one, then the lower one.
    pub(super) fn for_each_touching(&self, mut touch: impl FnMut(usize, usize)) {
        for row in self.ends.windows(3) {
            let [mut upper, mut lower] = [row[0], row[1]];
            while upper < row[1] && lower < row[2] {
                let [a, b] = [self.runs[upper], self.runs[lower]];
                if a.0 <= b.1 && b.0 <= a.1 {
                    touch(upper, lower);
                }
                if a.1 < b.1 { upper += 1 } else { lower += 1 }
            }
        }
    }

    /// Returns the runs whose indices are to be kept.
    pub(super) fn filtered(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut kept = Self::new();
        for row in self.ends.windows(2) {
            kept.runs.extend((row[0]..row[1]).filter(|&run| keep(run)).map(|run| self.runs[run]));
            kept.ends.push(kept.runs.len());
        }
        kept
    }

    /// Returns the runs as a mask of `width` columns, which hold all runs.
    pub(super) fn mask(&self, width: u32) -> Mask {
        let mut mask = MaskBuilder::new(width);
        mask.reserve(self.height() as usize, 2 * self.runs.len());
        let mut transitions: Vec<u32> = Vec::new();
        for row in 0..self.height() {
            transitions.clear();
            for &(start, end) in self.row(row) {
                // Runs that touch are one run of a mask.
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

/// Returns the place of the first run that ends beyond a column, searched from a place on.
pub(super) fn first_past<T>(
    runs: &[T],
    end: impl Fn(&T) -> i32,
    column: i32,
    from: usize,
) -> usize {
    // From row to row, places change little: steps cost less than halving.
    let mut place = from.min(runs.len());
    while place > 0 && end(&runs[place - 1]) > column {
        place -= 1;
    }
    while runs.get(place).is_some_and(|run| end(run) <= column) {
        place += 1;
    }
    place
}

/// Sorts runs and joins touching ones.
pub fn join_runs<T: Copy + Ord>(runs: &mut Vec<(T, T)>) {
    runs.sort_unstable();
    runs.dedup_by(|next, last| {
        let touch = next.0 <= last.1;
        if touch {
            last.1 = last.1.max(next.1);
        }
        touch
    });
}

/// Makes `out` the parts of `runs` that are in none of `others`.
pub(super) fn subtract(runs: &[Run], others: &[Run], out: &mut Vec<Run>) {
    out.clear();
    let mut next = 0;
    for &(mut start, end) in runs {
        while others.get(next).is_some_and(|other| other.1 <= start) {
            next += 1;
        }
        // Apart from `next`, as one of the others may also cut the next run.
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
