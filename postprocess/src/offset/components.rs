//! The pieces that a shape is in, and what becomes of each.
//!
//! A piece is what touches, at sides or corners. Runs of neighbouring rows are
//! joined, so the cost follows the runs.

use std::ops::Range;

use lamp_stack::{GrayMask, Mask, combine_rows};

use super::row_runs::RowRuns;

/// A piece of an image that edges took away or broke apart as they moved.
///
/// A pixel counts as left from half level on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Loss {
    /// The columns of the piece as it was.
    pub columns: Range<u32>,
    /// The rows of the piece as it was.
    pub rows: Range<u32>,
    /// How many pieces are left of it: none, or more than one.
    pub left: usize,
}

/// The pieces of which nothing is left, and those that broke apart, from the
/// top. All that is white `after` was so `before`.
pub(super) fn losses(before: &Mask, after: &Mask) -> Vec<Loss> {
    let [before, after] = [before, after].map(|mask| Components::of(RowRuns::white(mask)));
    let mut left = vec![0; before.runs.len()];
    for (run, &(row, column)) in after.runs.iter().enumerate() {
        if after.first[run] as usize == run {
            left[before.at(column, row)] += 1;
        }
    }
    let mut losses: Vec<Loss> = Vec::new();
    // Where the losses of pieces stand, by their first runs.
    let mut places = vec![usize::MAX; before.runs.len()];
    for (run, &(row, start)) in before.runs.iter().enumerate() {
        let first = before.first[run] as usize;
        if left[first] == 1 {
            continue;
        }
        let [start, end] = [start, before.ends[run]].map(|column| column as u32);
        if first == run {
            places[run] = losses.len();
            losses.push(Loss { columns: start..end, rows: row..row + 1, left: left[run] });
        }
        let Loss { columns, rows, .. } = &mut losses[places[first]];
        *columns = columns.start.min(start)..columns.end.max(end);
        rows.end = row + 1;
    }
    losses
}

/// Takes away pieces that are nowhere as bright as half: what is left of gray
/// edges where the wall that they belonged to is elsewhere.
pub(super) fn without_specks(gray: GrayMask) -> GrayMask {
    // Whether a part of the row, between black ones, is nowhere as bright.
    let faint = |row: u32| {
        let parts = gray.row(row).split(|change| change.level == 0);
        let brightest = parts.filter_map(|part| part.iter().map(|change| change.level).max());
        brightest.min().is_some_and(|level| level < 128)
    };
    if !(0..gray.height()).any(faint) {
        return gray;
    }
    let pieces = Components::of(RowRuns::white(&gray.at_least(1)));
    let mut stays = vec![false; pieces.runs.len()];
    for (row, bright) in (0..).zip(gray.at_least(128).rows()) {
        for start in bright.iter().step_by(2) {
            stays[pieces.at(*start as i32, row)] = true;
        }
    }
    let stays = |run: usize| stays[pieces.first[run] as usize];
    if (0..pieces.runs.len()).all(stays) {
        return gray;
    }
    let kept = pieces.filtered(gray.height(), stays).mask(gray.width());
    lower(&gray, &GrayMask::from(&kept))
}

/// The lower level of two images of one size at each pixel.
pub(super) fn lower(a: &GrayMask, b: &GrayMask) -> GrayMask {
    let mut out = GrayMask::new(a.width());
    let mut row = Vec::new();
    for (a, b) in a.rows().zip(b.rows()) {
        combine_rows([a, b], |[a, b]| a.min(b), &mut row);
        out.push_row(&row).expect("both rows are of images as wide");
    }
    out
}

/// Makes white what is black and does not touch the black of the top left pixel.
pub(crate) fn without_holes(mask: &Mask) -> Mask {
    let black = Components::of(RowRuns::white(&mask.inverted()));
    let outside = black.first.first().copied();
    let outside = black.filtered(mask.height(), |run| Some(black.first[run]) == outside);
    outside.mask(mask.width()).inverted()
}

/// The runs of a shape, by the pieces that they belong to.
struct Components {
    rows: RowRuns,
    /// The row and first column of each run.
    runs: Vec<(u32, i32)>,
    /// Where each run ends.
    ends: Vec<i32>,
    /// The first run of its piece, for each run.
    first: Vec<u32>,
}

impl Components {
    fn of(rows: RowRuns) -> Self {
        let mut pieces = Self { runs: Vec::new(), ends: Vec::new(), first: Vec::new(), rows };
        let mut above = 0;
        for row in 0..pieces.rows.height() {
            let below = pieces.runs.len();
            pieces.runs.extend(pieces.rows.row(row).iter().map(|run| (row, run.0)));
            pieces.ends.extend(pieces.rows.row(row).iter().map(|run| run.1));
            pieces.first.extend(below as u32..pieces.runs.len() as u32);
            let [mut upper, mut lower] = [above, below];
            while upper < below && lower < pieces.runs.len() {
                let [a, b] = [upper, lower].map(|run| (pieces.runs[run].1, pieces.ends[run]));
                if a.0 <= b.1 && b.0 <= a.1 {
                    pieces.join(upper, lower);
                }
                if a.1 < b.1 { upper += 1 } else { lower += 1 }
            }
            above = below;
        }
        for run in 0..pieces.first.len() {
            // Runs point at earlier ones, which by now point at their first.
            pieces.first[run] = pieces.first[pieces.first[run] as usize];
        }
        pieces
    }

    fn join(&mut self, a: usize, b: usize) {
        let [a, b] = [a, b].map(|run| self.first_of(run));
        self.first[a.max(b) as usize] = a.min(b);
    }

    fn first_of(&mut self, run: usize) -> u32 {
        let mut run = run as u32;
        while self.first[run as usize] != run {
            let next = self.first[self.first[run as usize] as usize];
            self.first[run as usize] = next;
            run = next;
        }
        run
    }

    /// The first run of the piece that holds a pixel.
    fn at(&self, column: i32, row: u32) -> usize {
        let next = self.runs.partition_point(|&run| run <= (row, column));
        self.first[next - 1] as usize
    }

    /// The runs that stay.
    fn filtered(&self, height: u32, stays: impl Fn(usize) -> bool) -> RowRuns {
        let mut rows = RowRuns::new();
        let mut all = 0..self.runs.len();
        for row in 0..height {
            let runs = self.rows.row(row).iter().zip(all.by_ref());
            let staying: Vec<_> =
                runs.filter(|(_, run)| stays(*run)).map(|(run, _)| *run).collect();
            rows.push(&staying);
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::super::offset_tests::drawn;
    use super::*;

    #[test]
    fn what_vanishes_or_breaks_apart_is_told() {
        // A ring, open below and joined by a corner; a bar; two blocks and a neck.
        let ring =
            |c: i32, r: i32| (2..9).contains(&c) && (2..9).contains(&r) && !(c == 5 && r > 2);
        let bar = |c: i32, r: i32| c == 20 && (3..30).contains(&r);
        let blocks = |c: i32, r: i32| {
            (30..60).contains(&c) && (10..20).contains(&r) && (r == 15 || !(40..50).contains(&c))
        };
        let before = drawn(64, 40, |c, r| ring(c, r) || bar(c, r) || blocks(c, r));
        let after = drawn(64, 40, |c, r| {
            ring(c, r) || (blocks(c, r) && (11..19).contains(&r) && !(39..51).contains(&c))
        });
        let expected = [
            Loss { columns: 20..21, rows: 3..30, left: 0 },
            Loss { columns: 30..60, rows: 10..20, left: 2 },
        ];
        assert_eq!(losses(&before, &after), expected);
        assert_eq!(losses(&before, &before), []);
        let all = losses(&before, &drawn(64, 40, |_, _| false));
        assert_eq!((all.len(), all[0].columns.clone(), all[0].rows.clone()), (3, 2..9, 2..9));
    }

    #[test]
    fn specks_go_and_gray_edges_stay() {
        let mut gray = GrayMask::new(16);
        for runs in [
            [(1, 0), (2, 40), (5, 0), (8, 0)],
            [(1, 0), (3, 200), (5, 0), (7, 30)],
            [(4, 0), (2, 20), (5, 0), (5, 127)],
            [(7, 0), (1, 10), (3, 0), (5, 0)],
        ] {
            gray.push_runs(runs).unwrap();
        }
        let clean = without_specks(gray.clone());
        for (column, row) in (0..4).flat_map(|row| (0..16).map(move |column| (column, row))) {
            let level = if column < 7 { gray.level(column, row) } else { 0 };
            assert_eq!(clean.level(column, row), level, "{column} {row}");
        }
    }
}
