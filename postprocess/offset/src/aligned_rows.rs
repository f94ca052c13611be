//! A fast path for rows whose edges run along the edges of the rows above and below, as in most
//! rows of a part.
//!
//! If each row that a disc reaches has as many runs as the row at its center, and no run comes
//! near another one's neighbor, each end of a run is cut only by the same end in the other rows.

use super::erode::{Disc, DistanceSources};
use super::row_runs::Run;

/// The greatest number of rows on each side: larger discs take the general path.
const MAX_REACH: usize = 16;

/// The rows around a row.
#[derive(Debug)]
pub(super) struct AlignedRows<'a> {
    sources: &'a DistanceSources,
    discs: [&'a Disc; 2],
    width: i32,
    /// The rows above and below by their distance, from the row itself on.
    rows: Vec<[&'a [Run]; 2]>,
}

/// A run of a row that runs along the others: the columns that lie in no source's outer disc, and
/// the columns that lie in no source's inner disc, at least one.
type AlignedRun = [Run; 2];

impl<'a> AlignedRows<'a> {
    /// Sets up for an outer and an inner disc, of which the inner one is the larger.
    pub(super) fn new(sources: &'a DistanceSources, discs: [&'a Disc; 2], width: u32) -> Self {
        Self { sources, discs, width: width as i32, rows: Vec::new() }
    }

    /// Makes `out` the runs of a row. Returns false if they do not run along those around them.
    pub(super) fn row(&mut self, row: u32, out: &mut Vec<AlignedRun>) -> bool {
        out.clear();
        // The inner disc is the larger, so its rows are enough for both.
        let reach = self.discs[1].halves().len();
        let runs = self.sources.row(row.into());
        if reach > MAX_REACH {
            return false;
        }
        self.rows.clear();
        for away in 0..reach as i64 {
            let rows =
                [i64::from(row) - away, i64::from(row) + away].map(|row| self.sources.row(row));
            if rows.iter().any(|row| row.len() != runs.len()) {
                return false;
            }
            self.rows.push(rows);
        }
        let mut before = i32::MIN;
        (0..runs.len()).all(|run| {
            let aligned = self.aligned_run(run, &mut before);
            out.extend(aligned);
            aligned.is_some()
        })
    }

    /// Returns a run, unless it or its like in another row lies left of the end of the one before.
    fn aligned_run(&self, run: usize, before: &mut i32) -> Option<AlignedRun> {
        let mut ends = [(0, 0); MAX_REACH];
        let mut hull = (i32::MAX, i32::MIN);
        for (end, rows) in ends.iter_mut().zip(&self.rows) {
            let [a, b] = rows.map(|row| row[run]);
            // A disc is symmetric, so the rows above and below count alike.
            *end = (a.0.max(b.0), a.1.min(b.1));
            hull = (hull.0.min(a.0).min(b.0), hull.1.max(a.1).max(b.1));
        }
        // The end of another run might cut this one, too.
        if hull.0 < std::mem::replace(before, hull.1) {
            return None;
        }
        let own = (ends[0].0.max(0), ends[0].1.min(self.width));
        let [outer, inner] = self.discs.map(|disc| {
            let narrowed = disc.halves().iter().zip(&ends);
            narrowed
                .fold(own, |left, (half, end)| (left.0.max(end.0 + half), left.1.min(end.1 - half)))
        });
        (inner.0 < inner.1).then_some([outer, inner])
    }
}
