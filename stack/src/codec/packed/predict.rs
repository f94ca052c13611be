//! Predicts where a row's transitions stand, from a row that is like it.

use super::tokens::TOGETHER;
use crate::image::mask::Mask;

/// A part of a pixel: shifts and bends are in 1/256 of one.
const PIXEL: i32 = 256;
/// Transitions of neighboring rows that are farther apart, in pixels, belong to other edges.
const FAR: u32 = 64;
/// The greatest bend of an edge, in pixels, that is taken for the roughness of rounding.
const ROUGH: i32 = 4;
/// Weights of the shifts learned from a row, in 1/16: of an edge's first row, and at least.
const FIRST_RATE: i32 = 16;
const LAST_RATE: i32 = 4;

/// A number for each of the transitions that are predicted together.
pub(super) type Four<T> = [T; TOGETHER];

/// Turns a residual's sign where its side is -1; turning it twice gives it back.
#[inline]
fn turned(residual: i32, side: i32) -> i32 {
    // In two's complement, (r ^ -1) - -1 is -r; a side of 0 leaves r.
    (residual ^ side).wrapping_sub(side)
}

/// A row that another is predicted from, among the rows of its image.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Like<'a> {
    /// The transitions of all rows.
    changes: &'a [u32],
    /// The start of the row's own transitions, and their number.
    start: usize,
    count: usize,
    /// The distance from their start, back and forward, to the start of the transitions of the rows
    /// above and below, if both rows have as many; else 0.
    around: usize,
}

impl<'a> Like<'a> {
    /// Takes a row of an image. The rows around it matter only if `with_around`.
    #[inline]
    pub(super) fn new(image: &'a Mask, row: u32, with_around: bool) -> Self {
        let (offsets, changes) = (image.row_offsets(), image.row_ends_and_changes().1);
        let above = (row as usize).checked_sub(1);
        match above.and_then(|above| offsets.get(above..)?.first_chunk()) {
            Some(offsets) => {
                let [above, start, end, below]: [usize; 4] = offsets.map(|offset| offset as usize);
                let count = end - start;
                let are_alike = with_around && start - above == count && below - end == count;
                Self { changes, start, count, around: if are_alike { count } else { 0 } }
            }
            None => {
                let range = image.changes_of(row);
                Self { changes, start: range.start, count: range.len(), around: 0 }
            }
        }
    }

    /// Takes a row alone.
    pub(super) fn alone(row: &'a [u32]) -> Self {
        Self { changes: row, start: 0, count: row.len(), around: 0 }
    }

    fn row(&self) -> &'a [u32] {
        &self.changes[self.start..][..self.count]
    }
}

/// Returns four of an image's transitions; behind its last, any.
#[inline]
pub(super) fn four_of(changes: &[u32], from: usize) -> Four<u32> {
    match changes.get(from..from + TOGETHER) {
        Some(four) => std::array::from_fn(|k| four[k]),
        None => last_four_of(changes, from),
    }
}

#[cold]
fn last_four_of(changes: &[u32], from: usize) -> Four<u32> {
    std::array::from_fn(|k| changes.get(from + k).copied().unwrap_or(0))
}

/// Where four transitions are expected: behind the row's last, at the width.
#[derive(Clone, Copy, Debug)]
pub(super) struct PredictedPlaces {
    places: Four<u32>,
    /// How far their edges have moved from the reference row's transitions, in 1/256 pixel.
    by: Four<i32>,
}

/// For each number of transitions that are left, which of four there are.
const THERE: [Four<u32>; TOGETHER + 1] = {
    let mut masks = [[0; TOGETHER]; TOGETHER + 1];
    let mut left = 0;
    while left <= TOGETHER {
        let mut k = 0;
        while k < left {
            masks[left][k] = u32::MAX;
            k += 1;
        }
        left += 1;
    }
    masks
};

/// Replaces the entries of four that are behind the last `left` ones.
#[inline]
pub(super) fn padded(four: Four<u32>, left: usize, width: u32) -> Four<u32> {
    // Masks instead of branches: the ends of rows would be mispredicted.
    let there = &THERE[left.min(TOGETHER)];
    std::array::from_fn(|k| four[k] & there[k] | width & !there[k])
}

impl PredictedPlaces {
    /// Returns 0, or -1 where an edge is left of its expected place: residuals that are turned by
    /// it are more often 1 than -1.
    #[inline]
    fn side(&self, k: usize) -> i32 {
        // Bit 7 is the half: if it is set, the place was rounded up, and the edge is left of it.
        self.by[k] << 24 >> 31
    }

    /// Returns the place of one of the transitions.
    #[inline]
    pub(super) fn place(&self, k: usize) -> u32 {
        self.places[k]
    }

    /// Returns how far from their places transitions are, turned.
    #[inline]
    pub(super) fn residuals(&self, columns: Four<u32>) -> Four<i32> {
        std::array::from_fn(|k| self.residual(k, columns[k]))
    }

    #[inline]
    pub(super) fn residual(&self, k: usize, column: u32) -> i32 {
        turned(column.wrapping_sub(self.places[k]) as i32, self.side(k))
    }

    /// Returns how far an edge is from where it was expected before rounding, in 1/256 pixel.
    #[inline]
    fn missed(&self, k: usize, residual: i32) -> i32 {
        // The error of rounding to a pixel: 256 floor((by + 128) / 256) - by.
        let error = PIXEL / 2 - (self.by[k].wrapping_add(PIXEL / 2) & (PIXEL - 1));
        turned(residual, self.side(k)).wrapping_mul(PIXEL).wrapping_add(error)
    }

    /// Undoes [`residuals`](Self::residuals).
    #[inline]
    pub(super) fn columns(&self, residuals: Four<i32>) -> Four<u32> {
        std::array::from_fn(|k| self.column(k, residuals[k]))
    }

    #[inline]
    pub(super) fn column(&self, k: usize, residual: i32) -> u32 {
        self.places[k].wrapping_add_signed(turned(residual, self.side(k)))
    }
}

/// Predicts rows from reference rows, top down: from the rows of the layer below or the rows above.
///
/// An edge of the part moves from its reference by a shift that changes slowly from row to row. It
/// is not a whole number of pixels, so it is averaged over the rows above. The reference itself is
/// on whole pixels, too: where the rows around it are known, their mean gives the place of its edge
/// before rounding.
///
/// Sums wrap: damaged files make any numbers.
#[derive(Default)]
pub(super) struct Predictor {
    /// The number of transitions of the reference row; `None` if the rows above are not known.
    count: Option<usize>,
    /// How far each of its transitions was moved in the rows above, in 1/256 pixel.
    shifts: Vec<i32>,
    /// The weight of the next shift, in 1/16.
    rates: Vec<i32>,
    /// Both of the row before, while they are followed.
    before: [Vec<i32>; 2],
}

impl Predictor {
    /// Forgets the rows above: behind rows that are left out, shifts are unknown.
    pub(super) fn forget(&mut self) {
        self.count = None;
    }

    /// Goes on to the next row. `before` is the reference of the row above it. Changes of one edge
    /// stand `step` apart.
    #[inline]
    pub(super) fn start<'a>(
        &mut self,
        like: &Like<'_>,
        before: impl FnOnce() -> &'a [u32],
        step: usize,
    ) {
        if self.count != Some(like.count) {
            let before = if self.count.is_some() { before() } else { &[] };
            self.follow(like.row(), before, step);
        }
    }

    /// Returns the number of transitions of the reference row.
    pub(super) fn count(&self) -> usize {
        self.count.unwrap_or(0)
    }

    /// Returns where the transitions from `j` are expected, or `None` behind the last of a row.
    #[inline(always)]
    pub(super) fn expect(&self, like: &Like<'_>, j: usize, width: u32) -> Option<PredictedPlaces> {
        let left = like.count.checked_sub(j)?;
        let shifts: &Four<i32> = self.shifts.get(j..)?.first_chunk()?;
        let from = like.start + j;
        let here = four_of(like.changes, from);
        let [above, below] =
            [from - like.around, from + like.around].map(|from| four_of(like.changes, from));
        let there = &THERE[left.min(TOGETHER)];
        let by: Four<i32> = std::array::from_fn(|k| {
            let bend = above[k].wrapping_add(below[k]).wrapping_sub(here[k].wrapping_mul(2)) as i32;
            // One comparison for both ends of the range.
            let is_rough = (bend.wrapping_add(ROUGH) as u32) <= 2 * ROUGH as u32;
            // The mean of the three rows is a third of the bend away.
            let bent = i32::from(bend as i16) * (PIXEL / 3);
            let by = shifts[k].wrapping_add(if is_rough { bent } else { 0 });
            by & there[k] as i32
        });
        let places = std::array::from_fn(|k| {
            here[k].wrapping_add_signed(by[k].wrapping_add(PIXEL / 2) >> 8)
        });
        Some(PredictedPlaces { places: padded(places, left, width), by })
    }

    /// Learns from transitions that are at most a pixel from their expected places.
    #[inline(always)]
    pub(super) fn learn(&mut self, j: usize, expected: &PredictedPlaces, residuals: Four<i32>) {
        let shifts: Option<&mut Four<i32>> = self.shifts[j..].first_chunk_mut();
        let rates: Option<&mut Four<i32>> = self.rates[j..].first_chunk_mut();
        let (Some(shifts), Some(rates)) = (shifts, rates) else { return };
        let steps: Four<i32> = std::array::from_fn(|k| {
            // Products of 16 bits are faster.
            let missed = i32::from(expected.missed(k, residuals[k]) as i16);
            missed.wrapping_mul(i32::from(rates[k] as i16)).wrapping_add(8) >> 4
        });
        *shifts = std::array::from_fn(|k| shifts[k].wrapping_add(steps[k]));
        // Half of it, but 4 stays.
        *rates = rates.map(|rate| (rate >> 1).wrapping_add((rate & LAST_RATE) >> 1));
    }

    /// Learns from the first of these transitions.
    #[inline]
    pub(super) fn learn_one(&mut self, j: usize, expected: &PredictedPlaces, residual: i32) {
        let missed = expected.missed(0, residual);
        let step = missed.wrapping_mul(self.rates[j]).wrapping_add(8) >> 4;
        self.shifts[j] = self.shifts[j].wrapping_add(step);
        self.rates[j] = (self.rates[j] >> 1).max(LAST_RATE);
    }

    /// Gives the shifts of the row above to the transitions of the reference row that are
    /// nearest.
    #[cold]
    fn follow(&mut self, reference: &[u32], before: &[u32], step: usize) {
        std::mem::swap(&mut self.shifts, &mut self.before[0]);
        std::mem::swap(&mut self.rates, &mut self.before[1]);
        let [shifts, rates] = &self.before;
        self.shifts.clear();
        self.rates.clear();
        let mut j = 0;
        for (i, &column) in reference.iter().enumerate() {
            // Both transitions are to the same color.
            if !(i + j).is_multiple_of(step) {
                j = if j > 0 { j - 1 } else { j + 1 };
            }
            let distance = |j: usize| before[j].abs_diff(column);
            while j + step < before.len() && distance(j + step) <= distance(j) {
                j += step;
            }
            let near = j < before.len() && distance(j) < FAR;
            self.shifts.push(if near { shifts[j] } else { 0 });
            self.rates.push(if near { rates[j] } else { FIRST_RATE });
        }
        // Four are read at once, from any transition on.
        self.shifts.resize(reference.len() + TOGETHER, 0);
        self.rates.resize(reference.len() + TOGETHER, 0);
        self.count = Some(reference.len());
    }
}
