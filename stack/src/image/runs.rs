//! Stores the rows of 1-bit and gray images as runs in two flat arrays.

use std::fmt::Debug;
use std::ops::Range;

use thiserror::Error;

/// A pixel's value: `bool` in a mask, `u8` in a gray mask. The default is black.
pub trait Pixel: Copy + Debug + Default + Eq {}

impl Pixel for bool {}
impl Pixel for u8 {}

/// A column where a row changes its value: a `u32` in a [`Mask`](crate::Mask), a
/// [`LevelChange`](crate::LevelChange) in a gray mask.
pub trait Change: Copy + Debug + Eq {
    /// The type of the pixel's value.
    type Pixel: Pixel;

    /// Creates the change to `pixel` at a column. A mask needs only the column.
    fn new(column: u32, pixel: Self::Pixel) -> Self;

    /// Returns the change to the same value at another column, which all changes of its row move
    /// with.
    fn moved(self, column: u32) -> Self;

    /// Returns the first column of the new value.
    fn column(self) -> u32;

    /// Returns the new value, given the value before the change.
    fn after(self, before: Self::Pixel) -> Self::Pixel;

    /// Returns the value after the last of a row's changes.
    fn last_pixel(changes: &[Self]) -> Self::Pixel;
}

impl Change for u32 {
    type Pixel = bool;

    #[inline]
    fn new(column: u32, _: bool) -> Self {
        column
    }

    #[inline]
    fn moved(self, column: u32) -> Self {
        column
    }

    #[inline]
    fn column(self) -> u32 {
        self
    }

    #[inline]
    fn after(self, before: bool) -> bool {
        !before
    }

    #[inline]
    fn last_pixel(changes: &[Self]) -> bool {
        changes.len() % 2 == 1
    }
}

/// An image stored as the columns where each row changes: a [`Mask`](crate::Mask) or a
/// [`GrayMask`](crate::GrayMask).
///
/// Row 0 is at the largest y, column 0 at the smallest x; pixel `x` covers
/// `[x, x + 1)`. Every row starts black.
///
/// # Guarantees
/// The columns of a row's changes strictly increase and are below the width, and every
/// change is to a different value. This form is unique, so `==` compares images.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunImage<C> {
    width: u32,
    /// The start of each row's changes, and a last entry: their end.
    row_offsets: Vec<u32>,
    changes: Vec<C>,
}

/// A violation of the guarantees of a [`RunImage`].
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RunError {
    /// The columns of a row do not strictly increase.
    #[error("row {row}: columns do not strictly increase")]
    NotIncreasing {
        /// The row, from the top.
        row: usize,
    },
    /// A change is to the same value.
    #[error("row {row}: nothing changes at column {column}")]
    NoChange {
        /// The row, from the top.
        row: usize,
        /// The column of the change.
        column: u32,
    },
    /// A change is at or beyond the width.
    #[error("row {row}: column {column} is outside an image {width} pixels wide")]
    OutsideWidth {
        /// The row, from the top.
        row: usize,
        /// The offending column.
        column: u32,
        /// The image's width in pixels.
        width: u32,
    },
    /// There are more changes than 32 bits can count.
    #[error("row {row}: the image has more than 2^32 changes")]
    TooMany {
        /// The row that does not fit.
        row: usize,
    },
    /// The row offsets do not start at 0, decrease, or miss the end.
    #[error("the row offsets do not partition the changes")]
    Offsets,
}

impl<C: Change> RunImage<C> {
    /// Creates an image without rows.
    pub(crate) fn without_rows(width: u32) -> Self {
        Self { width, row_offsets: vec![0], changes: Vec::new() }
    }

    /// Creates an image from its two arrays, or returns an error if they break the guarantees.
    pub(crate) fn from_arrays(
        width: u32,
        row_offsets: Vec<u32>,
        changes: Vec<C>,
    ) -> Result<Self, RunError> {
        let image = Self { width, row_offsets, changes };
        if !image.has_partition() {
            return Err(RunError::Offsets);
        }
        // A pass without branches accepts nearly all images; the second one names the fault.
        if !image.rows().all(|changes| image.is_canonical(changes)) {
            for (row, changes) in image.rows().enumerate() {
                image.check_row(row, changes)?;
            }
        }
        Ok(image)
    }

    /// Returns whether the row offsets partition the changes.
    fn has_partition(&self) -> bool {
        self.row_offsets.first() == Some(&0)
            && self.row_offsets.last().map(|&end| end as usize) == Some(self.changes.len())
            && self.row_offsets.is_sorted()
    }

    /// Creates an all-black image.
    pub fn black(width: u32, height: u32) -> Self {
        Self { width, row_offsets: vec![0; height as usize + 1], changes: Vec::new() }
    }

    /// Returns the width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Returns the height in pixels.
    pub fn height(&self) -> u32 {
        (self.row_offsets.len() - 1) as u32
    }

    /// Returns the changes of a row.
    ///
    /// # Panics
    /// Panics if `row` is not below the height.
    pub fn row(&self, row: u32) -> &[C] {
        let row = row as usize;
        &self.changes[self.row_offsets[row] as usize..self.row_offsets[row + 1] as usize]
    }

    /// Returns which of the image's changes are a row's.
    pub(crate) fn changes_of(&self, row: u32) -> std::ops::Range<usize> {
        let row = row as usize;
        self.row_offsets[row] as usize..self.row_offsets[row + 1] as usize
    }

    /// Returns the changes of every row, from the top.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[C]> {
        self.row_offsets.windows(2).map(|ends| &self.changes[ends[0] as usize..ends[1] as usize])
    }

    /// Returns the number of changes up to each row's end, and the changes of all rows.
    pub(crate) fn row_ends_and_changes(&self) -> (&[u32], &[C]) {
        (&self.row_offsets[1..], &self.changes)
    }

    /// Returns where the changes of each row start, and where the last row's changes end.
    pub fn row_offsets(&self) -> &[u32] {
        &self.row_offsets
    }

    /// Returns the changes of all rows, from the top.
    pub fn changes(&self) -> &[C] {
        &self.changes
    }

    /// Returns the number of changes in all rows, which determines the cost of processing.
    pub fn change_count(&self) -> usize {
        self.changes.len()
    }

    /// Makes room for this many more rows and changes.
    pub(crate) fn reserve(&mut self, rows: usize, changes: usize) {
        self.row_offsets.reserve(rows);
        self.changes.reserve(changes);
    }

    /// Gives back the memory that rows to come were expected to take.
    pub fn shrink_to_fit(&mut self) {
        self.row_offsets.shrink_to_fit();
        self.changes.shrink_to_fit();
    }

    /// Adds a row from outside this crate, after checking it.
    pub(crate) fn push_row_checked(&mut self, changes: &[C]) -> Result<(), RunError> {
        let row = self.row_offsets.len() - 1;
        self.check_row(row, changes)?;
        if u32::try_from(self.changes.len() + changes.len()).is_err() {
            return Err(RunError::TooMany { row });
        }
        self.push(changes);
        Ok(())
    }

    /// Adds the row that `make` appends to the image's changes, given the width and the row's
    /// number. Adds nothing if it fails.
    pub(crate) fn push_row_with(
        &mut self,
        make: impl FnOnce(u32, usize, &mut Vec<C>) -> Result<(), RunError>,
    ) -> Result<(), RunError> {
        let first = self.changes.len();
        let made = make(self.width, self.row_offsets.len() - 1, &mut self.changes);
        match made {
            Ok(()) => self.row_offsets.push(self.changes.len() as u32),
            Err(_) => self.changes.truncate(first),
        }
        made
    }

    /// Adds the row that `make` appends to the image's changes in canonical form. If `make` returns
    /// `None`, adds nothing and returns `None`.
    #[inline]
    pub(crate) fn push_row_made(
        &mut self,
        make: impl FnOnce(&mut Vec<C>) -> Option<()>,
    ) -> Option<()> {
        let first = self.changes.len();
        if make(&mut self.changes).is_none() {
            self.changes.truncate(first);
            return None;
        }
        let row = self.row_offsets.len() - 1;
        debug_assert_eq!(self.check_row(row, &self.changes[first..]), Ok(()));
        self.row_offsets.push(self.changes.len() as u32);
        Some(())
    }

    /// Adds the last row once more, or a black one if there is no row.
    pub(crate) fn push_again(&mut self) {
        if let Some(last) = (self.row_offsets.len() as u32 - 1).checked_sub(1) {
            self.changes.extend_from_within(self.changes_of(last));
        }
        self.row_offsets.push(self.changes.len() as u32);
    }

    /// Adds rows of another image of the same width.
    pub(crate) fn push_rows(&mut self, from: &Self, rows: Range<u32>) {
        let ends = &from.row_offsets[rows.start as usize..=rows.end as usize];
        let [first, last] = [ends[0], ends[ends.len() - 1]];
        // Offsets of either image wrap around alike.
        let moved = (self.changes.len() as u32).wrapping_sub(first);
        self.changes.extend_from_slice(&from.changes[first as usize..last as usize]);
        self.row_offsets.extend(ends[1..].iter().map(|end| end.wrapping_add(moved)));
    }

    /// Adds a row in canonical form, without checking it.
    pub(crate) fn push(&mut self, changes: &[C]) {
        debug_assert_eq!(self.check_row(self.row_offsets.len() - 1, changes), Ok(()));
        self.changes.extend_from_slice(changes);
        self.row_offsets.push(self.changes.len() as u32);
    }

    /// Adds the first `len` of `changes`, in canonical form, as a row. `changes` has at least
    /// three more entries, because short rows are copied faster in groups of four.
    #[inline]
    pub(crate) fn push_padded(&mut self, changes: &[C], len: usize) {
        debug_assert_eq!(self.check_row(self.row_offsets.len() - 1, &changes[..len]), Ok(()));
        let end = self.changes.len() + len;
        for four in changes.as_chunks::<4>().0.iter().take(len.div_ceil(4)) {
            self.changes.extend_from_slice(four);
        }
        self.changes.truncate(end);
        self.row_offsets.push(end as u32);
    }

    /// Adds black rows.
    pub(crate) fn push_black_rows(&mut self, rows: u32) {
        let end = self.changes.len() as u32;
        self.row_offsets.resize(self.row_offsets.len() + rows as usize, end);
    }

    /// Returns whether a row keeps the guarantees, in one pass.
    #[inline]
    fn is_canonical(&self, changes: &[C]) -> bool {
        let (mut least, mut pixel, mut is_canonical) = (0, C::Pixel::default(), true);
        for &change in changes {
            let next = change.after(pixel);
            is_canonical &= change.column() >= least && next != pixel;
            (least, pixel) = (change.column().saturating_add(1), next);
        }
        is_canonical && changes.last().is_none_or(|last| last.column() < self.width)
    }

    fn check_row(&self, row: usize, changes: &[C]) -> Result<(), RunError> {
        if !changes.is_sorted_by(|a, b| a.column() < b.column()) {
            return Err(RunError::NotIncreasing { row });
        }
        if let Some(column) = changes.last().map(|last| last.column())
            && column >= self.width
        {
            return Err(RunError::OutsideWidth { row, column, width: self.width });
        }
        let mut pixel = C::Pixel::default();
        for change in changes {
            let next = change.after(pixel);
            if next == pixel {
                return Err(RunError::NoChange { row, column: change.column() });
            }
            pixel = next;
        }
        Ok(())
    }
}

impl RunImage<u32> {
    /// Creates a mask, as [`from_arrays`](Self::from_arrays), but checks all rows at once.
    pub(crate) fn from_transitions(
        width: u32,
        row_offsets: Vec<u32>,
        transitions: Vec<u32>,
    ) -> Result<Self, RunError> {
        let image = Self { width, row_offsets, changes: transitions };
        if image.has_partition() && image.rises_in_rows() {
            return Ok(image);
        }
        Self::from_arrays(width, image.row_offsets, image.changes)
    }

    /// Returns whether all transitions that do not rise begin a row, and rows end within the width.
    fn rises_in_rows(&self) -> bool {
        let (all, mut ends_right) = (&self.changes, true);
        let next = all.get(1..).unwrap_or_default();
        // Neither count passes 2^32, the most changes that there are.
        let falls = |count: u32, (a, b): (&u32, &u32)| count.wrapping_add(u32::from(a >= b));
        let expected = all.iter().zip(next).fold(0, falls);
        let mut between_rows = 0;
        for ends in self.row_offsets.windows(2) {
            let [start, end] = [ends[0] as usize, ends[1] as usize];
            if start < end {
                ends_right &= all[end - 1] < self.width;
                if start > 0 {
                    between_rows += u32::from(all[start - 1] >= all[start]);
                }
            }
        }
        ends_right && between_rows == expected
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{GrayMask, LevelChange, Mask};

    #[test]
    fn only_the_canonical_form_is_taken() {
        assert!(Mask::new(8, vec![0, 3, 3], vec![1, 4, 6]).is_ok());
        assert_eq!(Mask::new(8, vec![0, 2], vec![4, 4]), Err(RunError::NotIncreasing { row: 0 }));
        assert_eq!(
            Mask::new(8, vec![0, 0, 1], vec![8]),
            Err(RunError::OutsideWidth { row: 1, column: 8, width: 8 })
        );
        for offsets in [vec![], vec![1], vec![0, 1], vec![0, 3, 2], vec![1, 2]] {
            assert_eq!(Mask::new(8, offsets, vec![1, 2]), Err(RunError::Offsets));
        }
        let mut image = GrayMask::new(10);
        let mut push = |row: [(u32, u8); 2]| {
            image.push_row(&row.map(|(column, level)| LevelChange { column, level }))
        };
        assert_eq!(push([(2, 7), (6, 0)]), Ok(()));
        assert_eq!(push([(2, 0), (6, 1)]), Err(RunError::NoChange { row: 1, column: 2 }));
        assert_eq!(push([(2, 7), (6, 7)]), Err(RunError::NoChange { row: 1, column: 6 }));
        assert_eq!(push([(6, 7), (6, 0)]), Err(RunError::NotIncreasing { row: 1 }));
        let outside = RunError::OutsideWidth { row: 1, column: 10, width: 10 };
        assert_eq!(push([(2, 7), (10, 0)]), Err(outside));
    }
}
