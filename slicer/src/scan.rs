//! Finds where planes and rows meet the edges of facets.
//!
//! The slicer meets facets with planes, then the segments there with rows; gray layers and adaptive
//! heights meet facets with rows directly. All work the same way. A facet's corners are sorted
//! along an axis. Each line across this axis (planes across z, rows across y) meets the long edge,
//! from the first corner to the last, and one of the two short edges, before or after the middle
//! corner.
//!
//! Both facets on an edge find its point on a line by the same arithmetic on the
//! same two ends, sorted alike. The points of a closed mesh on a line are
//! therefore equal in pairs, bit for bit, whatever the rounding.

use std::ops::Range;

/// The axis of rows.
pub const Y: usize = 1;
/// The axis of planes.
pub const Z: usize = 2;

/// Returns the least whole number that is not below `value`, between 0 and `max`.
#[inline]
pub fn ceil_clamped(value: f64, max: u32) -> u32 {
    // From here to twice this number, all floating-point numbers are whole: adding it rounds to the
    // nearest. Casts and `f64::ceil` take several times as long.
    const WHOLE: f64 = (1u64 << 52) as f64;
    let max = f64::from(max);
    // No comparison holds for `NaN`, so it becomes 0.
    let value = if value > 0.0 { value } else { 0.0 };
    let value = if value < max { value } else { max };
    let moved = value + WHOLE;
    let nearest = moved - WHOLE;
    // The lowest bits of 2^52 + n are n.
    (moved.to_bits() as u32).wrapping_add(u32::from(nearest < value))
}

/// Returns the number of ascending values at or below `value`. Nearly even values are found fast,
/// by a guess and a walk from there.
#[inline]
pub fn count_at_or_below(rising: &[f64], value: f64, guess: f64) -> usize {
    let mut count = ((guess as i32).max(0) as usize).min(rising.len());
    while count < rising.len() && rising[count] <= value {
        count += 1;
    }
    while count > 0 && rising[count - 1] > value {
        count -= 1;
    }
    count
}

/// A facet whose corners are sorted along an axis, [`Y`] or [`Z`].
#[derive(Clone, Copy, Debug)]
pub struct SortedFacet<const ALONG: usize> {
    /// The corners, from the least to the greatest.
    pub corners: [[f64; 3]; 3],
    /// For each of these, the corner's index in the facet.
    pub order: [u8; 3],
    /// Whether sorting turned the facet over.
    pub is_flipped: bool,
}

impl<const ALONG: usize> SortedFacet<ALONG> {
    /// Sorts a facet's corners; equal corners stay in their order.
    #[inline]
    pub fn new(corners: [[f64; 3]; 3]) -> Self {
        // A table is used because facets come in any order, so a processor could not predict
        // branches.
        const ORDERS: [([u8; 3], bool); 8] = {
            // Bits 0b011 and 0b100 contradict themselves.
            let impossible = ([0, 1, 2], false);
            let mut orders = [impossible; 8];
            orders[0b001] = ([1, 0, 2], true);
            orders[0b010] = ([0, 2, 1], true);
            orders[0b101] = ([1, 2, 0], false);
            orders[0b110] = ([2, 0, 1], false);
            orders[0b111] = ([2, 1, 0], true);
            orders
        };
        let [a, b, c] = corners.map(|corner| corner[ALONG]);
        let falls = usize::from(b < a) | usize::from(c < b) << 1 | usize::from(c < a) << 2;
        let (order, is_flipped) = ORDERS[falls];
        Self { corners: order.map(|corner| corners[usize::from(corner)]), order, is_flipped }
    }

    /// Calls `each` with each line across the facet, the points of the long and the short edge
    /// there, and the number of the short edge, 0 or 1. `second` is the first line past the middle
    /// corner; `at` returns a line's coordinate.
    #[inline]
    pub fn for_each_line(
        &self,
        lines: Range<usize>,
        second: usize,
        at: impl Fn(usize) -> f64,
        mut each: impl FnMut(usize, [[f64; 2]; 2], usize),
    ) {
        if lines.is_empty() {
            return;
        }
        let [low, middle, high] = self.corners;
        let long = FacetEdge::<ALONG>::new(low, high);
        let second = second.clamp(lines.start, lines.end);
        let halves = [(low, middle, lines.start..second), (middle, high, second..lines.end)];
        for (half, (from, to, lines)) in halves.into_iter().enumerate() {
            if lines.is_empty() {
                continue;
            }
            let short = FacetEdge::<ALONG>::new(from, to);
            for line in lines {
                let value = at(line);
                each(line, [long.at(value), short.at(value)], half);
            }
        }
    }
}

/// A side of a facet, from its lesser end along the axis to its greater.
#[derive(Clone, Copy)]
pub(crate) struct FacetEdge<const ALONG: usize> {
    from: [f64; 3],
    to: [f64; 3],
    slopes: [f64; 2],
}

impl<const ALONG: usize> FacetEdge<ALONG> {
    /// The other two axes.
    const ACROSS: [usize; 2] = if ALONG == Z { [0, Y] } else { [0, Z] };

    /// Joins two corners, the lesser one first.
    #[inline]
    pub(crate) fn new(from: [f64; 3], to: [f64; 3]) -> Self {
        // Only edges that a line crosses get here, so the length is above zero.
        let length = to[ALONG] - from[ALONG];
        Self { from, to, slopes: Self::ACROSS.map(|axis| (to[axis] - from[axis]) / length) }
    }

    /// Returns the edge's point on a line, without the coordinate along the axis.
    #[inline]
    pub(crate) fn at(&self, value: f64) -> [f64; 2] {
        let [a, b] = Self::ACROSS;
        // No rounding where a plane meets the corner itself. Rows never do: the rows of an edge end
        // before the first row that its lower end is past.
        if ALONG == Z && value >= self.to[Z] {
            return [self.to[a], self.to[b]];
        }
        // A plane that counts as touching the lower end may be below it.
        let passed = value - self.from[ALONG];
        let passed = if ALONG == Z { passed.max(0.0) } else { passed };
        [self.from[a] + self.slopes[0] * passed, self.from[b] + self.slopes[1] * passed]
    }
}

/// A facet that rows cross: x in any unit, y in rows downward, z in micrometers.
#[derive(Clone, Copy, Debug)]
pub struct RowFacet {
    sorted: SortedFacet<Y>,
    /// The first row past each corner.
    rows: [u32; 3],
}

impl RowFacet {
    /// Returns the facet between these corners, if any of `count` rows crosses it.
    #[inline]
    pub fn new(corners: [[f64; 3]; 3], count: u32) -> Option<Self> {
        let sorted = SortedFacet::new(corners);
        let rows = sorted.corners.map(|corner| ceil_clamped(corner[Y], count));
        (rows[0] < rows[2]).then_some(Self { sorted, rows })
    }

    /// Returns the rows that cross it.
    pub fn rows(&self) -> Range<u32> {
        self.rows[0]..self.rows[2]
    }

    /// Returns true if sorting its corners from the top row down turned it over.
    #[inline]
    pub fn is_flipped(&self) -> bool {
        self.sorted.is_flipped
    }

    /// Returns the rows that cross its part between two heights (micrometers), and perhaps one more
    /// on each side, where rounding could decide.
    pub fn rows_between(&self, [low_um, high_um]: [f64; 2]) -> Range<u32> {
        let (mut first, mut last) = (f64::MAX, f64::MIN);
        let mut reach = |row: f64| (first, last) = (first.min(row), last.max(row));
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (self.sorted.corners[from], self.sorted.corners[to]);
            if (low_um..=high_um).contains(&a[Z]) {
                reach(a[Y]);
            }
            for z_um in [low_um, high_um] {
                if (a[Z] < z_um) != (b[Z] < z_um) {
                    reach(a[Y] + (b[Y] - a[Y]) * ((z_um - a[Z]) / (b[Z] - a[Z])));
                }
            }
        }
        let Range { start, end } = self.rows();
        // A thousandth of a row is far more than rounding.
        ceil_clamped(first - 1e-3, end).max(start)..ceil_clamped(last + 1e-3, end)
    }

    /// Calls `each` with each of the given rows that cross it, and the points (x, z) of its long
    /// and its short edge there.
    #[inline]
    pub fn for_each_row(&self, rows: Range<u32>, mut each: impl FnMut(u32, [[f64; 2]; 2])) {
        let rows = rows.start as usize..rows.end as usize;
        let at = |row: usize| f64::from(row as u32);
        self.sorted.for_each_line(rows, self.rows[1] as usize, at, |row, ends, _| {
            each(row as u32, ends);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ceilings_are_exact_and_clamped() {
        for (value, ceiling) in [
            (0.0, 0),
            (-0.5, 0),
            (-7.0, 0),
            (1e-300, 1),
            (5.0, 5),
            (5.000_000_000_1, 6),
            (5.5, 6),
            (6.5, 7),
            (6.999_999_999_9, 7),
            (f64::NAN, 0),
            (1e9, 1000),
            (f64::INFINITY, 1000),
        ] {
            assert_eq!(ceil_clamped(value, 1000), ceiling, "{value}");
        }
    }
}
