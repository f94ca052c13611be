//! The squared distances of the pixels along an edge.

use super::far::Field;
use super::rows::Run;

impl Field {
    /// Makes `squares` the squared distance of each pixel of a run in row
    /// `row` from the nearest source, where that is below `limit`.
    pub(super) fn squares(&self, row: u32, run: Run, limit: u64, squares: &mut Vec<u32>) {
        squares.clear();
        squares.resize((run.1 - run.0) as usize, u32::try_from(limit).unwrap_or(u32::MAX));
        let row = i64::from(row);
        let mut furthest = limit;
        for away in 0.. {
            let square = (away * away) as u64;
            if square >= furthest {
                return;
            }
            nearer(self.row(row - away), run, square, squares);
            if away > 0 {
                nearer(self.row(row + away), run, square, squares);
            }
            furthest = squares.iter().copied().max().map_or(0, u64::from);
        }
    }
}

/// Lowers the squares of a run's pixels to those of the way to the nearest
/// source in a row, whose own distance has the square `away`.
fn nearer(between: &[Run], (start, end): Run, away: u64, squares: &mut [u32]) {
    let mut next = between.partition_point(|run| run.1 <= start);
    let mut column = start;
    let lower = |square: &mut u32, to: u64| {
        if to < u64::from(*square) {
            *square = to as u32;
        }
    };
    while column < end {
        let (from, to) = between.get(next).map_or((end, end), |run| (run.0.min(end), run.1));
        for square in &mut squares[(column - start) as usize..(from.max(column) - start) as usize] {
            lower(square, away);
        }
        column = column.max(from);
        let inside = to.min(end);
        while column < inside {
            let aside = (column - between[next].0 + 1).min(to - column) as u64;
            lower(&mut squares[(column - start) as usize], away + aside * aside);
            column += 1;
        }
        next += 1;
    }
}
