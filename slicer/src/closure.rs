//! Checks whether a layer's contours close, without linking them.
//!
//! A contour is a chain of segments. It closes if an even number of segments ends at each of its
//! points. Equal points have equal bits, as `cut.rs` shows; and no coordinate in pixels is -0,
//! since 1/2 was subtracted from it. So a sum over hashes of the points, in any order, is zero if
//! all contours close, and otherwise another of 2^64 values.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The sum over the ends of a layer's segments.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct EndSum(u64);

impl EndSum {
    /// Adds the ends of a segment. Ends with different salts are different points.
    #[inline]
    pub(crate) fn add(&mut self, ends: [[f64; 2]; 2], salt: u64) {
        let [a, b] = ends.map(|end| hash(end, salt));
        self.0 ^= a ^ b;
    }

    /// Returns the sum over the segments of both.
    pub(crate) fn joined(self, other: Self) -> Self {
        Self(self.0 ^ other.0)
    }

    /// Returns true if every contour closes.
    pub(crate) fn is_closed(self) -> bool {
        self == Self::default()
    }
}

/// Sums over the ends of segments in each row, which all workers add to. A sum is not
/// zero if a contour breaks off in its row.
#[derive(Debug)]
pub(crate) struct RowSums(Vec<AtomicU64>);

impl RowSums {
    /// Starts with no ends in rows 0 to `last`.
    pub(crate) fn new(last: u32) -> Self {
        Self((0..=last).map(|_| AtomicU64::new(0)).collect())
    }

    /// Adds an end of a segment. Ends with different salts are different points.
    #[inline]
    pub(crate) fn add(&self, row: u32, point: [f64; 2], salt: u64) {
        // Exclusive or gives the same sum in any order, and sums are read after all workers have
        // ended.
        self.0[row as usize].fetch_xor(hash(point, salt), Relaxed);
    }

    /// Returns the rows where contours break off, in ascending order.
    pub(crate) fn open_rows(&self) -> Vec<u32> {
        let rows = (0..).zip(&self.0).filter(|(_, sum)| sum.load(Relaxed) != 0);
        rows.map(|(row, _)| row).collect()
    }
}

/// Returns a hash of a point and a salt: the two halves of the product of its coordinates' bits,
/// combined. Sums of a few hashes do not cancel because of how points lie, such as at
/// the corners of a rectangle.
#[inline]
fn hash(point: [f64; 2], salt: u64) -> u64 {
    // Whole numbers end in zeros. These bits, of pi, do not.
    const PI: [u64; 2] = [0x243f_6a88_85a3_08d3, 0xa409_3822_299f_31d1];
    let [x, y] = point.map(f64::to_bits);
    let product = u128::from(x ^ PI[0] ^ salt) * u128::from(y ^ PI[1]);
    product as u64 ^ (product >> 64) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(segments: &[[[f64; 2]; 2]]) -> EndSum {
        let mut sum = EndSum::default();
        segments.iter().for_each(|&ends| sum.add(ends, 0));
        sum
    }

    /// A contour around a square of points that are not binary fractions.
    fn square(side: f64) -> [[[f64; 2]; 2]; 4] {
        let [a, b, c, d] = [[0.1, 0.2], [side, 0.2], [side, side], [0.1, side]];
        [[a, b], [b, c], [c, d], [d, a]]
    }

    #[test]
    fn a_contour_is_closed_until_a_segment_is_missing_or_comes_twice() {
        for segments in [&square(7.3)[..], &[square(7.3), square(-2.1)].concat()] {
            assert!(sum(segments).is_closed());
            for k in 0..segments.len() {
                let missing = [&segments[..k], &segments[k + 1..]].concat();
                let twice = [segments, &segments[k..=k]].concat();
                assert!(!sum(&missing).is_closed() && !sum(&twice).is_closed());
            }
        }
    }

    #[test]
    fn contours_of_two_bodies_do_not_close_each_other() {
        let [side, ..] = square(7.3);
        for (salt, is_closed) in [(0, true), (1, false)] {
            let mut sum = EndSum::default();
            sum.add(side, 0);
            sum.add(side, salt);
            assert_eq!(sum.is_closed(), is_closed);
        }
    }

    #[test]
    fn a_segment_turned_round_leaves_no_gap() {
        let mut segments = square(7.3);
        segments[1].reverse();
        assert!(sum(&segments).is_closed());
    }

    #[test]
    fn the_shares_of_workers_add_up() {
        let (mut there, mut back) = (EndSum::default(), EndSum::default());
        let ends = [[0.5, 1.0], [3.0, 0.0]];
        there.add(ends, 0);
        back.add(ends, 0);
        assert!(!there.is_closed() && !back.is_closed());
        assert!(there.joined(back).is_closed());
    }

    #[test]
    fn rows_are_open_where_an_end_has_no_partner() {
        let sums = RowSums::new(9);
        let [a, b, c] = [[0.5, 3.0], [8.25, 3.0], [1.5, 7.25]];
        for (row, point) in [(3, a), (3, b), (3, a), (8, c), (8, c)] {
            sums.add(row, point, 0);
        }
        assert_eq!(sums.open_rows(), [3]);
        sums.add(3, b, 0);
        sums.add(8, c, 0);
        sums.add(8, a, 0);
        assert_eq!(sums.open_rows(), [8]);
    }

    /// Neighboring whole numbers differ in one bit, and their points lie on a
    /// grid whose rectangles must not cancel.
    #[test]
    fn points_of_a_grid_have_hashes_without_pattern() {
        let points = (0..100).flat_map(|x| (0..100).map(move |y| [f64::from(x), f64::from(y)]));
        let mut hashes: Vec<_> = points.map(|point| hash(point, 0)).collect();
        let at = |x: usize, y: usize| hashes[100 * x + y];
        for (x, y) in (1..100).flat_map(|x| (1..100).map(move |y| (x, y))) {
            let [a, b, c, d] = [at(0, 0), at(x, 0), at(0, y), at(x, y)];
            assert_ne!(a ^ b ^ c ^ d, 0);
            assert_ne!(a.wrapping_add(d), b.wrapping_add(c));
        }
        for bit in 0..64 {
            let ones = hashes.iter().filter(|&hash| hash >> bit & 1 == 1).count();
            assert!((4_500..5_500).contains(&ones), "bit {bit} is set in {ones}");
        }
        hashes.sort_unstable();
        assert!(hashes.is_sorted_by(|a, b| a < b));
    }
}
