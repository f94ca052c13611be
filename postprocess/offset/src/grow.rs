//! Growing by a disc, exactly, at a cost that follows edges and hardly the disc.
//!
//! Runs that follow each other row by row, one on one, are a sheet. In any row a sheet's discs are
//! one run, whose ends are the farthest that a disc of an end reaches there. Of two discs of equal
//! size the lower one reaches farther from some row on. So the discs that reach farthest are found
//! in one pass over the ends, with a stack (the lower envelope of P. Felzenszwalb and D.
//! Huttenlocher, Theory of Computing 8, 2012, of circles instead of parabolas).
//!
//! Dots make sheets of a row or two. There, rows are cut by one row of the disc after the other
//! ([`erode`](super::erode)), which soon leaves nothing.

use std::ops::Range;

use rayon::prelude::*;

use super::erode::{Disc, DistanceSources, Erosion, ROUNDING, half_widths};
use super::row_runs::{RowRuns, Run, join_runs, subtract};

/// The fewest rows that are grown at a time.
const BAND: i32 = 512;
/// The fewest rows that a sheet must have on average to be worth following.
const SHEET_ROWS: usize = 4;
/// The most runs that sheets may have in a band, so that they take 32 MiB. More of them, which
/// only large discs have, are cut by rows.
const MAX_RUNS: usize = 1 << 22;

/// The pixels around a center that are nearer to it than a distance along the row and one across it.
#[derive(Debug)]
pub(super) struct Reach {
    disc: Disc,
    /// The columns that it reaches to each side, by the distance in rows, before they are rounded
    /// down.
    exact: Vec<f64>,
}

impl Reach {
    /// Returns the pixels that are nearer than distances in pixels, the center at least, as far as an
    /// image of `height` rows needs them.
    pub(super) fn nearer(distances: [f64; 2], height: u32) -> Self {
        // Not rounded, because rounded ellipses may cross more than once. No distance is NaN.
        let exact = half_widths(distances.map(|by| by.max(0.5)), -ROUNDING, height);
        Self { disc: Disc::of_widths(&exact), exact }
    }

    /// Returns the number of rows that it reaches to each side.
    fn rows(&self) -> i32 {
        self.exact.len() as i32 - 1
    }

    /// Returns the runs of rows `0..height` of an image of `width` columns that lie in a disc
    /// around a pixel of `runs`, whose first row is row `top` of the image.
    pub(super) fn grown(&self, runs: &RowRuns, top: i32, width: i32, height: i32) -> RowRuns {
        // A band also reads all rows that discs reach above and below it: in a high one they are
        // few.
        let band = BAND.max(4 * self.rows());
        let starts: Vec<i32> = (0..height).step_by(band as usize).collect();
        let bands = starts.into_par_iter().map(|start| {
            let rows = start..(start + band).min(height);
            self.grown_band(runs, top, width, rows)
        });
        let mut grown = RowRuns::new();
        for row in bands.collect::<Vec<_>>().iter().flat_map(RowRuns::rows) {
            grown.push(row);
        }
        grown
    }

    /// Returns the runs of some rows of the grown image.
    fn grown_band(&self, runs: &RowRuns, top: i32, width: i32, rows: Range<i32>) -> RowRuns {
        let from = (rows.start - self.rows() - top).max(0);
        let to = (rows.end + self.rows() - top).min(runs.height() as i32);
        let sheets = sheets(runs, from..to);
        let count = sheets.starts.len();
        if count * SHEET_ROWS > sheets.runs.len() || count * rows.len() > MAX_RUNS {
            self.band_by_rows(runs, from..to, top, width, rows)
        } else {
            self.band_by_sheets(&sheets, top, width, rows)
        }
    }

    /// Grows rows `of` of `runs` by cutting each of `rows` by every row of the disc.
    fn band_by_rows(
        &self,
        runs: &RowRuns,
        of: Range<i32>,
        top: i32,
        width: i32,
        rows: Range<i32>,
    ) -> RowRuns {
        let first = of.start + top;
        let sources = DistanceSources::white_rows(of.map(|row| runs.row(row as u32)));
        let (mut left, mut row_runs) = (Erosion::default(), Vec::new());
        let mut grown = RowRuns::new();
        for row in rows {
            sources.erode(&self.disc, (row - first) as u32, &[(0, width)], &mut left);
            subtract(&[(0, width)], &left.runs, &mut row_runs);
            grown.push(&row_runs);
        }
        grown
    }

    /// Grows sheets by their ends.
    fn band_by_sheets(&self, sheets: &Sheets, top: i32, width: i32, rows: Range<i32>) -> RowRuns {
        let mut found: Vec<Vec<Run>> = vec![Vec::new(); rows.len()];
        let mut ends = SheetEnds::default();
        for (first_row, sheet) in sheets.iter() {
            let at = ends.of(self, sheet, first_row + top, &rows);
            let of_rows = found[(at - rows.start) as usize..].iter_mut();
            for (found, (&start, &end)) in of_rows.zip(ends.starts.iter().zip(&ends.ends)) {
                let run = (start.max(0), (-end).min(width));
                if run.0 < run.1 {
                    found.push(run);
                }
            }
        }
        let mut grown = RowRuns::new();
        for row in &mut found {
            join_runs(row);
            grown.push(row);
        }
        grown
    }

    /// Returns how far the discs of some rows with the same end reach in a row: the least column.
    fn reached(&self, arc: &Arc, row: i32) -> Option<f64> {
        let exact = self.exact.get(arc.away(row))?;
        Some(f64::from(arc.end) - exact)
    }

    /// Returns whether a lower arc reaches farther in a row than an upper one.
    fn is_farther(&self, lower: &Arc, upper: &Arc, row: i32) -> bool {
        match (self.reached(lower, row), self.reached(upper, row)) {
            (Some(lower), Some(upper)) => lower < upper,
            // Where the upper arc reaches nothing, any reach is farther.
            (lower, _) => lower.is_some(),
        }
    }

    /// Returns the row from which on a lower arc reaches farther than an upper one, no higher than
    /// `from`.
    fn crossing(&self, lower: &Arc, upper: &Arc, from: i32) -> i32 {
        let mut low = from.max(lower.first - self.rows());
        // Below it, the upper arc reaches nothing.
        let mut high = (upper.last + self.rows() + 1).max(low);
        if self.is_farther(lower, upper, low) {
            return low;
        }
        // Once farther, the lower arc stays so, and halving finds the row.
        while high - low > 1 {
            let middle = low.midpoint(high);
            if self.is_farther(lower, upper, middle) { high = middle } else { low = middle }
        }
        high
    }
}

/// Neighboring rows of a sheet with the same end.
#[derive(Clone, Copy, Debug)]
struct Arc {
    end: i32,
    first: i32,
    last: i32,
    /// The first row in which its discs reach farthest.
    from: i32,
}

impl Arc {
    /// Returns how many rows away its nearest row is.
    fn away(&self, row: i32) -> usize {
        (self.first - row).max(row - self.last).max(0) as usize
    }
}

/// The ends of a sheet's discs in consecutive rows.
#[derive(Debug, Default)]
struct SheetEnds {
    starts: Vec<i32>,
    /// The ends, negative.
    ends: Vec<i32>,
    arcs: Vec<Arc>,
}

impl SheetEnds {
    /// Finds the ends of a sheet's discs in each of `rows` that they reach. Returns the first such
    /// row.
    fn of(&mut self, reach: &Reach, sheet: &[Run], first_row: i32, rows: &Range<i32>) -> i32 {
        let past = first_row + sheet.len() as i32 + reach.rows();
        let rows = rows.start.max(first_row - reach.rows())..rows.end.min(past);
        let Self { starts, ends, arcs } = self;
        farthest(reach, sheet.iter().map(|run| run.0), first_row, &rows, arcs, starts);
        // Negative, so that the least column is the farthest on this side as well.
        farthest(reach, sheet.iter().map(|run| -run.1), first_row, &rows, arcs, ends);
        rows.start
    }
}

/// Makes `out` the least columns that discs around a sheet's ends reach, in each of `rows`.
fn farthest(
    reach: &Reach,
    ends: impl Iterator<Item = i32>,
    first_row: i32,
    rows: &Range<i32>,
    arcs: &mut Vec<Arc>,
    out: &mut Vec<i32>,
) {
    arcs.clear();
    let mut next: Option<Arc> = None;
    for (row, end) in (first_row..).zip(ends) {
        match &mut next {
            Some(arc) if arc.end == end => arc.last = row,
            _ => {
                let arc = Arc { end, first: row, last: row, from: row - reach.rows() };
                next.replace(arc).into_iter().for_each(|arc| push(reach, arc, arcs));
            }
        }
    }
    next.into_iter().for_each(|arc| push(reach, arc, arcs));
    out.clear();
    let past = arcs.iter().skip(1).map(|arc| arc.from).chain([rows.end]);
    for (arc, past) in arcs.iter().zip(past) {
        let of_arc = arc.from.max(rows.start)..past.min(rows.end);
        out.extend(of_arc.map(|row| arc.end - reach.disc.halves()[arc.away(row)]));
    }
}

/// Adds an arc below others, in place of the arcs that it leaves no row.
fn push(reach: &Reach, mut arc: Arc, arcs: &mut Vec<Arc>) {
    while let Some(upper) = arcs.last() {
        arc.from = reach.crossing(&arc, upper, upper.from);
        if arc.from > upper.from {
            break;
        }
        arcs.pop();
    }
    arcs.push(arc);
}

/// Runs in the order of the sheets that they belong to.
struct Sheets {
    runs: Vec<Run>,
    /// The first row of each sheet, and where its runs begin.
    starts: Vec<(i32, usize)>,
}

impl Sheets {
    /// Returns the first row and the runs of each sheet.
    fn iter(&self) -> impl Iterator<Item = (i32, &[Run])> {
        let ends = self.starts.iter().skip(1).map(|start| start.1).chain([self.runs.len()]);
        self.starts.iter().zip(ends).map(|(&(row, start), end)| (row, &self.runs[start..end]))
    }
}

/// Splits the runs of some rows into sheets: a run goes on with the sheet of the run above if they
/// share columns with each other and with no other of the two rows.
fn sheets(runs: &RowRuns, rows: Range<i32>) -> Sheets {
    const NONE: u32 = u32::MAX;
    let mut of_run: Vec<u32> = Vec::new();
    let mut sizes: Vec<(i32, usize)> = Vec::new();
    let mut above: &[Run] = &[];
    for index in rows.clone() {
        let row = runs.row(index as u32);
        let start = of_run.len();
        of_run.resize(start + row.len(), NONE);
        let (before, of_row) = of_run.split_at_mut(start);
        let of_above = &before[start - above.len()..];
        for_each_pair(above, row, |upper, lower| of_row[lower] = of_above[upper]);
        for sheet in of_row {
            if *sheet == NONE {
                *sheet = sizes.len() as u32;
                sizes.push((index, 0));
            }
            sizes[*sheet as usize].1 += 1;
        }
        above = row;
    }
    // A counting sort: sizes become the places where sheets begin.
    let mut next = 0;
    for size in &mut sizes {
        next += std::mem::replace(&mut size.1, next);
    }
    let mut places: Vec<usize> = sizes.iter().map(|size| size.1).collect();
    let mut sorted = vec![(0, 0); of_run.len()];
    let all = rows.flat_map(|index| runs.row(index as u32));
    for (&run, sheet) in all.zip(of_run) {
        sorted[places[sheet as usize]] = run;
        places[sheet as usize] += 1;
    }
    Sheets { runs: sorted, starts: sizes }
}

/// Calls `met` with the numbers of runs of two rows that share columns with each other, and with
/// no other.
fn for_each_pair(upper: &[Run], lower: &[Run], mut met: impl FnMut(usize, usize)) {
    let shares = |a: Option<&Run>, b: Option<&Run>| {
        a.zip(b).is_some_and(|(a, b)| a.0.max(b.0) < a.1.min(b.1))
    };
    let [mut i, mut j] = [0, 0];
    while let (Some(a), Some(b)) = (upper.get(i), lower.get(j)) {
        // Runs of a row are apart, so if any other run shares columns, a neighbor does.
        let is_alone = |shared: bool| {
            shared
                && !shares(upper.get(i + 1), Some(b))
                && !shares(Some(a), lower.get(j + 1))
                && !shares(i.checked_sub(1).map(|i| &upper[i]), Some(b))
                && !shares(Some(a), j.checked_sub(1).map(|j| &lower[j]))
        };
        if is_alone(shares(Some(a), Some(b))) {
            met(i, j);
        }
        if a.1 <= b.1 { i += 1 } else { j += 1 }
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Mask;
    use proptest::prelude::*;

    use super::super::erode::{Disc, DistanceSources, SourceColour, at_least};
    use super::super::offset_tests::{drawn, masks};
    use super::super::{grow_one_bit, offset_one_bit, region};
    use super::*;

    /// Grows or shrinks by cutting every row by every row of the disc.
    fn referee(mask: &Mask, inwards: f64) -> Mask {
        let colour = if inwards < 0.0 { SourceColour::White } else { SourceColour::Black };
        let disc = Disc::below(at_least(inwards.abs() + 0.5), mask.height());
        let left = DistanceSources::new(mask, colour).erode_all(&disc, &region(mask, colour));
        let left = left.mask(mask.width());
        if inwards < 0.0 { left.inverted() } else { left }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Every pixel against every white one.
        #[test]
        fn growing_by_two_distances_reaches_what_is_near(
            mask in masks(),
            by in prop_oneof![Just([3.0, 2.0]), Just([1.5, 4.25]), Just([0.0, 2.0]), Just([2.5; 2])],
        ) {
            let grown = grow_one_bit(&mask, by);
            let whites: Vec<[f64; 2]> = (0..mask.height())
                .flat_map(|row| (0..mask.width()).map(move |column| [column, row]))
                .filter(|&[column, row]| mask.is_white(column, row))
                .map(|at| at.map(f64::from))
                .collect();
            for row in 0..mask.height() {
                for column in 0..mask.width() {
                    let share = |white: &[f64; 2]| {
                        let along = (f64::from(column) - white[0]) / (by[0] + 0.5);
                        let across = (f64::from(row) - white[1]) / (by[1] + 0.5);
                        along * along + across * across
                    };
                    let is_near = whites.iter().any(|white| share(white) < 1.0 - 1e-9);
                    prop_assert_eq!(grown.is_white(column, row), is_near, "{} {}", column, row);
                }
            }
        }
    }

    /// Bars whose edges sway from row to row, which branch, end and begin, over several bands.
    fn tall_masks() -> impl Strategy<Value = Mask> {
        let bars =
            prop::collection::vec((0.0..90.0f64, 1.0..12.0f64, 0.0..9.0f64, 5..200i32), 1..5);
        (bars, 1200..1500u32).prop_map(|(bars, height)| {
            drawn(96, height, |column, row| {
                bars.iter().any(|&(middle, half, sway, period)| {
                    let phase = f64::from(row) / f64::from(period);
                    let middle = middle + sway * (std::f64::consts::TAU * phase).sin();
                    (f64::from(column) - middle).abs() < half && row / period % 3 > 0
                })
            })
        })
    }

    /// Grows a whole mask by its sheets, and by rows of the disc.
    fn both_ways(mask: &Mask, by: f64) -> [Mask; 2] {
        let reach = Reach::nearer([by + 0.5; 2], mask.height());
        let runs = RowRuns::white(mask);
        let [width, height] = [mask.width() as i32, mask.height() as i32];
        let sheets = sheets(&runs, 0..height);
        let by_sheets = reach.band_by_sheets(&sheets, 0, width, 0..height);
        let by_rows = reach.band_by_rows(&runs, 0..height, 0, width, 0..height);
        [by_sheets, by_rows].map(|rows| rows.mask(mask.width()))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        #[test]
        fn it_is_what_every_row_of_the_disc_makes(mask in masks(), by in -30.0..30.0f64) {
            prop_assert!(offset_one_bit(&mask, by) == referee(&mask, by));
            let grown = referee(&mask, -by.abs());
            prop_assert!(both_ways(&mask, by.abs()).iter().all(|mask| *mask == grown));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn bands_are_seamless(mask in tall_masks(), by in -200.0..60.0f64) {
            prop_assert!(offset_one_bit(&mask, by) == referee(&mask, by));
        }

        #[test]
        fn dots_are_grown_as_well(dots in 2..6u32, by in -90.0..9.0f64) {
            let hash = |column: i32, row: i32| {
                (column as u32).wrapping_mul(0x9E37_79B9) ^ (row as u32).wrapping_mul(0x85EB_CA6B)
            };
            let dot = |column, row| row < 700 && (hash(column, row) >> 7) % dots == 0;
            let mask = drawn(96, 1100, |column, row| dot(column, row) || column == row / 16);
            prop_assert!(offset_one_bit(&mask, by) == referee(&mask, by));
        }
    }
}
