//! Squared distances of pixels from the nearest source.

use super::erode::Sources;
use super::row_runs::Run;

/// The greatest distance along a row, in pixels. Edges move less far, and the sum of two such
/// squares fits in 32 bits.
const MAX_DISTANCE: u32 = 1 << 15;

impl Sources {
    /// Makes `squares` the squared distance of each pixel of a run in row `row` from the nearest
    /// source, or `limit` if that is smaller.
    pub(super) fn squares(&self, row: u32, run: Run, limit: u64, squares: &mut Vec<u32>) {
        squares.clear();
        let mut furthest = u32::try_from(limit).unwrap_or(u32::MAX);
        squares.resize((run.1 - run.0) as usize, furthest);
        let row = i64::from(row);
        for away in 0.. {
            let square = (away * away) as u32;
            if square >= furthest {
                return;
            }
            nearer(self.row(row - away), run, square, squares);
            if away > 0 {
                nearer(self.row(row + away), run, square, squares);
            }
            furthest = squares.iter().copied().max().unwrap_or(0);
        }
    }
}

/// Lowers the squares of a run's pixels to those of the distance from the nearest source in a
/// row whose own distance has the square `away`.
fn nearer(between: &[Run], (start, end): Run, away: u32, squares: &mut [u32]) {
    let mut next = between.partition_point(|run| run.1 <= start);
    let mut column = start;
    while column < end {
        let (from, to) = between.get(next).map_or((end, end), |run| (run.0.min(end), run.1));
        let on_sources = (column - start) as usize..(from.max(column) - start) as usize;
        for square in &mut squares[on_sources] {
            *square = away.min(*square);
        }
        column = column.max(from);
        let inside = to.min(end);
        if column < inside {
            let left = (column - between[next].0 + 1) as u32;
            let right = (to - column) as u32;
            let places = &mut squares[(column - start) as usize..(inside - start) as usize];
            for (square, step) in places.iter_mut().zip(0..) {
                let aside = (left + step).min(right - step).min(MAX_DISTANCE);
                *square = (away + aside * aside).min(*square);
            }
            column = inside;
        }
        next += 1;
    }
}
