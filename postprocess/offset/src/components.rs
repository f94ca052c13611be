//! The connected components of a shape, and what becomes of each as edges move.
//!
//! Pixels are connected if they touch at sides or corners. Runs of neighboring rows are joined
//! (union-find), so the cost follows the runs.

use std::ops::Range;

use lamp_stack::sets::unite;
use lamp_stack::{GrayMask, Mask, combine_rows};

use super::row_runs::RowRuns;

/// A component of an image that edges removed or broke apart as they moved.
///
/// A pixel counts as left from half level on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Loss {
    /// The columns of the component before.
    pub columns: Range<u32>,
    /// The rows of the component before.
    pub rows: Range<u32>,
    /// The number of components that are left of it: none, or more than one.
    pub left: usize,
}

/// Returns the components that vanish or break apart, from the top. All pixels that are white
/// `after` must be white `before`.
pub(super) fn losses(before: &Mask, after: &Mask) -> Vec<Loss> {
    let [before, after] = [before, after].map(|mask| ComponentRuns::of(RowRuns::white(mask)));
    let mut left = vec![0; before.first.len()];
    for (run, row, (start, _)) in after.runs() {
        // Counted at its first run. No pixel was added, so all of it was one component before.
        if after.first[run] as usize == run {
            left[before.at(start, row)] += 1;
        }
    }
    let mut losses: Vec<Loss> = Vec::new();
    // The index in `losses` of each component, by its first run.
    let mut indices = vec![usize::MAX; before.first.len()];
    for (run, row, (start, end)) in before.runs() {
        let first = before.first[run] as usize;
        if left[first] == 1 {
            continue;
        }
        let (start, end) = (start as u32, end as u32);
        if first == run {
            indices[run] = losses.len();
            losses.push(Loss { columns: start..end, rows: row..row + 1, left: left[run] });
        }
        let Loss { columns, rows, .. } = &mut losses[indices[first]];
        *columns = columns.start.min(start)..columns.end.max(end);
        rows.end = row + 1;
    }
    losses
}

/// Removes components without a pixel of half level: faint rests of the edges of a wall that is
/// kept elsewhere.
pub(super) fn without_specks(gray: GrayMask) -> GrayMask {
    // Most images have no specks: all that is faint goes on to something bright.
    if (0..gray.height()).all(|row| are_bright(&gray, row)) {
        return gray;
    }
    let components = ComponentRuns::of(RowRuns::white(&gray.at_least(1)));
    let mut is_bright = vec![false; components.first.len()];
    for (row, bright) in (0..).zip(gray.at_least(128).rows()) {
        for start in bright.iter().step_by(2) {
            is_bright[components.at(*start as i32, row)] = true;
        }
    }
    let is_bright = |run: usize| is_bright[components.first[run] as usize];
    if (0..components.first.len()).all(is_bright) {
        return gray;
    }
    let kept = components.rows.filtered(is_bright).mask(gray.width());
    lower(&gray, &GrayMask::from(&kept))
}

/// Returns whether each part of a row between black pixels has a pixel of half level, or goes on
/// up or down to one.
fn are_bright(gray: &GrayMask, row: u32) -> bool {
    let mut faint = parts(gray, row).filter(|&(_, brightest)| brightest < 128);
    faint.all(|(columns, _)| [-1, 1].into_iter().any(|step| goes_on(gray, row, &columns, step)))
}

/// Returns whether a part of a row goes on to a pixel of half level in a direction.
fn goes_on(gray: &GrayMask, mut row: u32, columns: &Range<u32>, step: i32) -> bool {
    let mut columns = columns.clone();
    while let Some(next) = row.checked_add_signed(step).filter(|&next| next < gray.height()) {
        let touches =
            |part: &(Range<u32>, u8)| part.0.start <= columns.end && columns.start <= part.0.end;
        // Only the first part that touches is followed: if it leads nowhere, the components decide.
        let Some((part, brightest)) = parts(gray, next).find(touches) else { return false };
        if brightest >= 128 {
            return true;
        }
        (row, columns) = (next, part);
    }
    false
}

/// Returns the parts of a row between black pixels, with the greatest level of each.
fn parts(gray: &GrayMask, row: u32) -> impl Iterator<Item = (Range<u32>, u8)> {
    let mut changes = gray.row(row).iter();
    std::iter::from_fn(move || {
        let first = changes.find(|change| change.level > 0)?;
        let (mut brightest, mut end) = (first.level, gray.width());
        for change in changes.by_ref() {
            if change.level == 0 {
                end = change.column;
                break;
            }
            brightest = brightest.max(change.level);
        }
        Some((first.column..end, brightest))
    })
}

/// Returns the lower level of two images of one size at each pixel.
pub(super) fn lower(a: &GrayMask, b: &GrayMask) -> GrayMask {
    let mut out = GrayMask::new(a.width());
    let mut row = Vec::new();
    for (a, b) in a.rows().zip(b.rows()) {
        combine_rows([a, b], |[a, b]| a.min(b), &mut row);
        out.push_row(&row).expect("both rows are of images as wide");
    }
    out
}

/// Makes white all black that is not connected to the top left pixel.
pub fn without_holes(mask: &Mask) -> Mask {
    let black = ComponentRuns::of(RowRuns::white(&mask.inverted()));
    // Images come with a black frame, so the first black run holds the top left pixel.
    let outside = black.first.first().copied();
    let outside = black.rows.filtered(|run| Some(black.first[run]) == outside);
    outside.mask(mask.width()).inverted()
}

/// The runs of a shape by connected component.
pub(super) struct ComponentRuns {
    rows: RowRuns,
    /// The first run of its component, for each run.
    first: Vec<u32>,
    /// The pairs of runs that touch.
    touching: usize,
}

impl ComponentRuns {
    pub(super) fn of(rows: RowRuns) -> Self {
        let mut first: Vec<u32> = (0..rows.all().len() as u32).collect();
        let mut touching = 0;
        rows.for_each_touching(|upper, lower| {
            touching += 1;
            unite(&mut first, upper as u32, lower as u32);
        });
        for run in 0..first.len() {
            // Runs point at earlier ones, which by now point at the first.
            first[run] = first[first[run] as usize];
        }
        Self { rows, first, touching }
    }

    /// Returns the number of runs.
    pub(super) fn run_count(&self) -> usize {
        self.first.len()
    }

    /// Returns the first run of the component that a run is of.
    pub(super) fn first(&self, run: usize) -> usize {
        self.first[run] as usize
    }

    /// Returns the first run of each component.
    pub(super) fn firsts(&self) -> impl Iterator<Item = usize> {
        (0..self.run_count()).filter(|&run| self.first(run) == run)
    }

    /// Returns the number of holes: runs that touch around one close a loop (Euler).
    pub(super) fn holes(&self) -> usize {
        self.touching + self.firsts().count() - self.run_count()
    }

    /// Returns each run with its index and row.
    fn runs(&self) -> impl Iterator<Item = (usize, u32, (i32, i32))> {
        let rows = (0..self.rows.height())
            .flat_map(|row| self.rows.row(row).iter().map(move |run| (row, *run)));
        rows.enumerate().map(|(index, (row, run))| (index, row, run))
    }

    /// Returns the first run of the component that holds a pixel.
    fn at(&self, column: i32, row: u32) -> usize {
        let run = self.rows.find(column, row).expect("the pixel is in the shape");
        self.first[run] as usize
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
