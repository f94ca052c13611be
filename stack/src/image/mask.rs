//! Stores 1-bit images as runs.

use crate::image::runs::{RunError, RunImage};

/// A 1-bit image, stored as the columns where each row changes color.
///
/// ```text
///   column  0 1 2 3 4 5 6 7
///   row 0   . # # # . . # #     transitions 1, 4, 6
///   row 1   . . . . . . . .     none
/// ```
///
/// `#` is white: 1, cured. Every row starts black and toggles at each of its transitions; a
/// row with an odd number of them ends white. See [`RunImage`] for the coordinates and the
/// guarantees.
///
/// ```
/// use lamp_stack::Mask;
///
/// let mask = Mask::new(8, vec![0, 3, 3], vec![1, 4, 6])?;
/// assert_eq!((mask.width(), mask.height(), mask.white_pixels()), (8, 2, 5));
/// assert!(mask.is_white(7, 0) && !mask.is_white(4, 0));
/// assert_eq!(mask.row(0), [1, 4, 6]);
/// # Ok::<(), lamp_stack::RunError>(())
/// ```
pub type Mask = RunImage<u32>;

impl Mask {
    /// Creates a mask from its two arrays. `row_offsets` has one entry more than there are rows,
    /// the first 0 and the last `transitions.len()`.
    ///
    /// # Errors
    /// Returns an error if the arrays break the guarantees of [`RunImage`].
    pub fn new(width: u32, row_offsets: Vec<u32>, transitions: Vec<u32>) -> Result<Self, RunError> {
        Self::from_transitions(width, row_offsets, transitions)
    }

    /// Returns the number of white pixels.
    pub fn white_pixels(&self) -> u64 {
        let (ends, transitions) = self.row_ends_and_changes();
        // No sum passes the 2^64 pixels of an image.
        let run =
            |sum: u64, [start, end]: &[u32; 2]| sum.wrapping_add(end.wrapping_sub(*start).into());
        if ends.iter().all(|end| end.is_multiple_of(2)) {
            // Every pair is a run.
            return transitions.as_chunks().0.iter().fold(0, run);
        }
        // Every pair is a run up to a row that ends white.
        let (mut sum, mut from, mut start) = (0, 0, 0);
        for &end in ends {
            let end = end as usize;
            if (end - start) % 2 == 1 {
                let last = transitions[end - 1];
                sum = transitions[from..end - 1].as_chunks().0.iter().fold(sum, run);
                sum = run(sum, &[last, self.width()]);
                from = end;
            }
            start = end;
        }
        transitions[from..].as_chunks().0.iter().fold(sum, run)
    }

    /// Returns true if the pixel is white. Pixels outside the image are black.
    pub fn is_white(&self, column: u32, row: u32) -> bool {
        column < self.width()
            && row < self.height()
            && self.row(row).partition_point(|&t| t <= column) % 2 == 1
    }

    /// Returns the image with black and white exchanged.
    pub fn inverted(&self) -> Self {
        let mut inverted = Self::without_rows(self.width());
        let mut toggled = Vec::new();
        for row in self.rows() {
            toggled.clear();
            match row {
                [0, rest @ ..] => toggled.extend_from_slice(rest),
                // Nothing can start white in an image without columns.
                _ if self.width() == 0 => {}
                _ => {
                    toggled.push(0);
                    toggled.extend_from_slice(row);
                }
            }
            inverted.push(&toggled);
        }
        inverted
    }
}

/// Returns the white runs of a row of `width` pixels with these transitions, as
/// the first column and the column after the last.
///
/// ```
/// // `.###..##`
/// let runs: Vec<_> = lamp_stack::white_runs(&[1, 4, 6], 8).collect();
/// assert_eq!(runs, [(1, 4), (6, 8)]);
/// ```
#[inline]
pub fn white_runs(
    transitions: &[u32],
    width: u32,
) -> impl DoubleEndedIterator<Item = (u32, u32)> + ExactSizeIterator + Clone + use<'_> {
    transitions.chunks(2).map(move |run| (run[0], run.get(1).copied().unwrap_or(width)))
}

/// Returns the number of white pixels in a row of `width` pixels with these
/// transitions.
pub fn white_in_row(transitions: &[u32], width: u32) -> u64 {
    white_runs(transitions, width).map(|(start, end)| u64::from(end - start)).sum()
}

/// Returns the number of pixels that are white in both of two rows.
///
/// ```
/// assert_eq!(lamp_stack::white_in_both(&[1, 4, 6], &[0, 2, 3, 7], 8), 3);
/// ```
pub fn white_in_both(a: &[u32], b: &[u32], width: u32) -> u64 {
    let (mut left, mut right) = (white_runs(a, width), white_runs(b, width));
    let (mut in_a, mut in_b) = (left.next(), right.next());
    let mut shared = 0;
    while let (Some((from, to)), Some((start, end))) = (in_a, in_b) {
        shared += u64::from(to.min(end).saturating_sub(from.max(start)));
        if to < end {
            in_a = left.next();
        } else {
            in_b = right.next();
        }
    }
    shared
}

/// Builds a [`Mask`] row by row, from the top.
///
/// ```
/// use lamp_stack::{Mask, MaskBuilder};
///
/// let mut builder = MaskBuilder::new(8);
/// builder.push_row(&[1, 4, 6])?;
/// builder.push_black(1);
/// assert_eq!(builder.finish(), Mask::new(8, vec![0, 3, 3], vec![1, 4, 6])?);
/// # Ok::<(), lamp_stack::RunError>(())
/// ```
#[derive(Clone, Debug)]
pub struct MaskBuilder {
    mask: Mask,
}

impl MaskBuilder {
    /// Starts an image of `width` pixels without rows.
    pub fn new(width: u32) -> Self {
        Self { mask: Mask::without_rows(width) }
    }

    /// Makes room for this many more rows and transitions.
    pub fn reserve(&mut self, rows: usize, transitions: usize) {
        self.mask.reserve(rows, transitions);
    }

    /// Adds a row below the others.
    ///
    /// # Errors
    /// Returns an error if the transitions do not strictly increase or reach the width, or if
    /// the image has too many.
    pub fn push_row(&mut self, transitions: &[u32]) -> Result<(), RunError> {
        self.mask.push_row_checked(transitions)
    }

    /// Adds black rows.
    pub fn push_black(&mut self, rows: u32) {
        self.mask.push_black_rows(rows);
    }

    /// Returns the image.
    pub fn finish(self) -> Mask {
        self.mask
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn pixels_and_area_follow_the_transitions() {
        let mask = Mask::new(8, vec![0, 3, 3], vec![1, 4, 6]).unwrap();
        let row: String = (0..8).map(|c| if mask.is_white(c, 0) { '#' } else { '.' }).collect();
        assert_eq!(row, ".###..##");
        assert_eq!(mask.white_pixels(), 5);
        assert!(!mask.is_white(8, 0) && !mask.is_white(2, 1) && !mask.is_white(2, 2));
    }

    proptest! {
        #[test]
        fn white_pixels_are_those_that_are_white(
            rows in prop::collection::vec(prop::collection::btree_set(0u32..20, 0..8), 0..12),
        ) {
            let ends = rows.iter().scan(0, |end, row| {
                *end += row.len() as u32;
                Some(*end)
            });
            let offsets = std::iter::once(0).chain(ends).collect();
            let mask = Mask::new(20, offsets, rows.into_iter().flatten().collect()).unwrap();
            let pixels = (0..mask.height()).flat_map(|row| (0..20).map(move |column| (column, row)));
            let white = pixels.filter(|&(column, row)| mask.is_white(column, row)).count();
            prop_assert_eq!(mask.white_pixels(), white as u64);
        }
    }

    #[test]
    fn inverting_twice_changes_nothing() {
        let mask = Mask::new(8, vec![0, 3, 3, 4], vec![1, 4, 6, 0]).unwrap();
        let inverted = mask.inverted();
        assert_eq!(inverted.row(0), [0, 1, 4, 6]);
        assert_eq!(inverted.row(1), [0]);
        assert_eq!(inverted.row(2), [] as [u32; 0]);
        assert_eq!(inverted.inverted(), mask);
    }
}
