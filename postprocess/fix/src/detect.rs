//! Detection of stray rows.

use std::ops::Range;

use lamp_stack::{Layer, Mask, white_in_row};

use super::FixOptions;
use super::band::{BandKind, BandKinds};
use super::beside::Beside;
use super::combine::{difference, majority, white_in_both};
use super::contours::{BandContours, DEPTH};
use super::mend::{DROP, mend};

/// Pixels from which on a run counts as a sliver, or as wrong for lack of two crossings:
/// shorter ones may be the part's own.
const MIN_RUN: u32 = 16;
/// Rows of the widest band that is searched for contours missed in all its rows, if it is not known
/// where contours break off.
const MAX_PAIRED_ROWS: u32 = 30;
/// Effort after which the search for paired rows ends, as a multiple of the layer's rows and
/// crossings: no part's section takes more, but noise would take the square.
const MAX_EFFORT: usize = 2;
/// The share of pixels that must agree for a neighboring layer to agree.
const MIN_AGREEMENT: f64 = 0.9;

/// The known data of a layer before its rows are corrected.
pub(super) struct Scene<'a> {
    /// The exposed pixels.
    pub(super) mask: &'a Mask,
    /// The rows whose crossings did not balance when the layer was sliced, increasing.
    pub(super) unbalanced: &'a [u32],
    /// The rows at which contours break off, increasing, if that is known.
    pub(super) open_rows: Option<&'a [u32]>,
    /// The layers below and above, the nearest first.
    pub(super) neighbours: &'a [Vec<&'a Layer>; 2],
}

/// The stray rows of an image.
pub(super) struct Strays {
    kinds: Vec<BandKinds>,
    /// Rows that may be right as they are: to be reported, but not corrected.
    pub(super) doubtful: Vec<u32>,
}

impl Strays {
    pub(super) fn is_good(&self, row: u32) -> bool {
        self.kinds[row as usize].is_empty()
    }

    pub(super) fn kinds(&self, row: u32) -> BandKinds {
        self.kinds[row as usize]
    }

    /// Returns whether a later stage ended a row of the mask: it did not balance when it was
    /// sliced, and yet it ends black.
    pub(super) fn is_ended(&self, mask: &Mask, row: u32) -> bool {
        self.kinds(row).contains(BandKind::Unbalanced) && mask.row(row).len().is_multiple_of(2)
    }

    /// Returns the bands of neighboring stray rows, from the top.
    pub(super) fn bands(&self) -> Vec<Range<u32>> {
        runs((0..self.kinds.len() as u32).filter(|&row| !self.is_good(row)))
    }

    fn mark(&mut self, rows: Range<u32>, kind: BandKind, is_certain: bool) {
        for row in rows {
            self.kinds[row as usize].insert(kind);
            if !is_certain {
                self.doubtful.push(row);
            }
        }
    }
}

impl Scene<'_> {
    /// Finds the stray rows. Returns `None` if all rows are good, which for most layers takes
    /// one look at the number of each row's transitions.
    ///
    /// A row begins and ceases to miss crossings only where a contour breaks off. If all
    /// contours of a layer close, only rows that end white can be stray.
    pub(super) fn strays(&self, options: &FixOptions) -> Option<Strays> {
        let crossings: Vec<u32> = self.mask.rows().map(|row| row.len() as u32).collect();
        let parity = crossings.iter().fold(0, |any, crossings| any | crossings);
        let is_balanced = self.unbalanced.is_empty() && parity % 2 == 0;
        let is_closed = self.open_rows.is_some_and(<[u32]>::is_empty);
        if is_balanced && is_closed {
            return None;
        }
        // Every part leaves the last column black (002 section 2.4.1, algorithm 10).
        let alone = |crossings: &u32| {
            if crossings.is_multiple_of(2) { BandKinds::NONE } else { BandKinds::ENDS_WHITE }
        };
        let kinds = crossings.iter().map(alone).collect();
        let mut strays = Strays { kinds, doubtful: Vec::new() };
        for &row in self.unbalanced {
            if let Some(kinds) = strays.kinds.get_mut(row as usize) {
                kinds.insert(BandKind::Unbalanced);
            }
        }
        if !is_closed {
            let most = self.open_rows.map_or(MAX_PAIRED_ROWS, |_| self.mask.height());
            let widest = options.max_width.map_or(most, |width| width.min(most));
            self.find_shown(&mut strays);
            self.find_pairs(&mut strays, &crossings, widest);
            self.find_slivers(&mut strays, &crossings);
            strays.doubtful.sort_unstable();
        }
        strays.kinds.iter().any(|kinds| !kinds.is_empty()).then_some(strays)
    }

    /// Finds rows that end black, but lack contours which the layers below and above show. They
    /// begin where a contour breaks off; a fin whose tip is missing breaks off on one side only.
    fn find_shown(&self, strays: &mut Strays) {
        let Some(open_rows) = self.open_rows else { return };
        let beside = Beside { mask: self.mask, sides: self.neighbours };
        for &open in open_rows.iter().filter(|&&open| open <= self.mask.height()) {
            let lacks = |row: &u32| {
                let near = *row.min(&open)..open.max(row + 1);
                let shown = strays.is_good(*row).then(|| beside.show(*row, &near))??;
                Some((shown.missed_pixels()?, shown))
            };
            let above: Vec<_> = (0..open).rev().map_while(|row| lacks(&row)).collect();
            let below: Vec<_> = (open..self.mask.height()).map_while(|row| lacks(&row)).collect();
            for (mut rows, is_above) in [(above, true), (below, false)] {
                let band = |count: u32| match is_above {
                    true => open - count..open,
                    false => open..open + count,
                };
                let all = band(rows.len() as u32);
                let far = if is_above { all.start } else { all.end };
                if open_rows.binary_search(&far).is_err() {
                    let sure = rows.iter().take_while(|(_, shown)| shown.is_sure()).count();
                    rows.truncate(sure);
                }
                // A contour that breaks off here goes on behind the break.
                let across = if is_above { Some(open) } else { open.checked_sub(1) };
                let across = across.filter(|&row| row < self.mask.height());
                let across = across.map_or(&[][..], |row| self.mask.row(row));
                let breaks_off = rows.first().is_some_and(|(_, shown)| shown.goes_on_in(across));
                let pixels = rows.iter().map(|(pixels, _)| pixels).sum::<f64>();
                if breaks_off && pixels >= MIN_RUN.into() {
                    strays.mark(band(rows.len() as u32), BandKind::Paired, true);
                }
            }
        }
    }

    /// Finds rows that lack contours which cross good rows above and below them.
    fn find_pairs(&self, strays: &mut Strays, crossings: &[u32], max_width: u32) {
        let mut effort = MAX_EFFORT * (crossings.len() + self.mask.change_count());
        for row in 1..crossings.len() {
            // Most rows have as many crossings as the one above: nothing is missing there.
            if crossings[row] >= crossings[row - 1] && strays.kinds[row - 1].is_empty() {
                continue;
            }
            if !strays.kinds[row].is_empty() {
                continue;
            }
            let nearest = row.saturating_sub(max_width as usize)..row;
            let Some(above) = nearest.rev().find(|&row| strays.kinds[row].is_empty()) else {
                continue;
            };
            if crossings[row] >= crossings[above] {
                continue;
            }
            let falls = above as u32 + 1..row as u32;
            if self.open_rows.is_some_and(|open| !any_in(open, &falls)) {
                continue;
            }
            let last = crossings.len().min(above.saturating_add(max_width as usize + 2));
            let below = (row + 1..last)
                .find(|&below| strays.kinds[below].is_empty() && crossings[below] > crossings[row]);
            let Some(left) = effort.checked_sub(below.unwrap_or(last) - row) else { return };
            effort = left;
            let Some(below) = below else { continue };
            let band = above as u32 + 1..below as u32;
            let rows = band.len() + 2 * DEPTH as usize;
            let cost = crossings[above].max(crossings[below]) as usize * rows;
            let Some(left) = effort.checked_sub(cost) else { continue };
            effort = left;
            self.check_pairs(strays, &band);
        }
    }

    /// Marks the rows of a band that are stray although they end black.
    fn check_pairs(&self, strays: &mut Strays, band: &Range<u32>) {
        let is_good = |row: u32| !band.contains(&row) && strays.is_good(row);
        let Some(contours) = BandContours::around(self.mask, band.clone(), is_good) else { return };
        let mended =
            |row: u32| mend(self.mask.row(row), &contours.outlook(row), self.mask.width(), DROP);
        let lacks_some = |row: &u32| {
            strays.is_good(*row) && {
                let mended = mended(*row);
                mended.gain >= MIN_RUN && !mended.added.is_empty()
            }
        };
        for rows in runs(band.clone().filter(lacks_some)) {
            let touches = [rows.start.checked_sub(1), Some(rows.end)].into_iter().flatten();
            let beside_strays = touches.into_iter().any(|row| !strays.is_good(row));
            let is_certain = match self.open_rows {
                // Rows that are not between open rows are the part's own.
                Some(open) if !is_between(open, &rows) => continue,
                Some(_) => true,
                None if beside_strays => true,
                // A wall of several rows, or one that another layer has there,
                // may well be the part's own.
                None if rows.len() > 1 => continue,
                None => {
                    let row = rows.start;
                    if self.is_in_another_layer(row, self.mask.row(row), &mended(row).row) {
                        continue;
                    }
                    false
                }
            };
            strays.mark(rows, BandKind::Paired, is_certain);
        }
    }

    /// Finds rows with a run that neither the neighboring rows nor the neighboring layers have.
    fn find_slivers(&self, strays: &mut Strays, crossings: &[u32]) {
        for (row, crossings) in (1..).zip(crossings.windows(3)) {
            if crossings[1] <= crossings[0] || crossings[1] <= crossings[2] {
                continue;
            }
            let is_between = |open| is_between(open, &(row..row + 1));
            if self.open_rows.is_some_and(|open| !is_between(open)) {
                continue;
            }
            if [row - 1, row, row + 1].iter().any(|&row| !strays.is_good(row)) {
                continue;
            }
            let had = self.mask.row(row);
            let without = without_slivers(self.mask, row);
            // A hole or a bar whose side just touches this plane looks the same, but the next
            // layer shows more of it.
            if without != had && !self.is_in_another_layer(row, had, &without) {
                strays.mark(row..row + 1, BandKind::Sliver, self.open_rows.is_some());
            }
        }
    }

    /// Returns whether a neighboring layer has the colors of the first of two versions of a
    /// row where they differ.
    fn is_in_another_layer(&self, row: u32, had: &[u32], mended: &[u32]) -> bool {
        let width = self.mask.width();
        let differ = difference(had, mended);
        let pixels = white_in_row(&differ, width) as f64;
        self.neighbours.iter().filter_map(|side| side.first()).any(|layer| {
            let as_mended = difference(&layer.image.exposed_row(row), had);
            let share = white_in_both(&differ, &as_mended, width) as f64 / pixels;
            share <= 1.0 - MIN_AGREEMENT
        })
    }
}

/// Returns whether one of the increasing rows is in a band or right behind it.
fn any_in(open: &[u32], band: &Range<u32>) -> bool {
    let first = open.partition_point(|&row| row < band.start);
    open.get(first).is_some_and(|&row| row <= band.end)
}

/// Returns whether contours break off both where rows begin and where they end.
fn is_between(open: &[u32], rows: &Range<u32>) -> bool {
    open.binary_search(&rows.start).is_ok() && open.binary_search(&rows.end).is_ok()
}

/// Groups increasing rows into ranges without gaps.
fn runs(rows: impl Iterator<Item = u32>) -> Vec<Range<u32>> {
    let mut runs: Vec<Range<u32>> = Vec::new();
    for row in rows {
        match runs.last_mut() {
            Some(run) if run.end == row => run.end += 1,
            _ => runs.push(row..row + 1),
        }
    }
    runs
}

/// Returns a row without its long runs that lie between pixels of the other color above and
/// below. The row must have neighbors on both sides.
///
/// Source: 002 section 2.4.1, the first algorithm.
pub(super) fn without_slivers(mask: &Mask, row: u32) -> Vec<u32> {
    let [above, row, below] = [row - 1, row, row + 1].map(|row| mask.row(row));
    let alone = difference(&majority([above, row, below]), row);
    let is_own = |column: &u32| row.binary_search(column).is_ok();
    let is_between = |run: &[u32]| {
        let crosses = |other: &[u32]| {
            let next = other.partition_point(|&column| column <= run[0]);
            other.get(next).is_some_and(|&column| column < run[1])
        };
        run.iter().all(is_own) && !crosses(above) && !crosses(below)
    };
    let slivers: Vec<u32> = alone
        .chunks_exact(2)
        .filter(|run| run[1] - run[0] >= MIN_RUN && is_between(run))
        .flatten()
        .copied()
        .collect();
    difference(row, &slivers)
}
