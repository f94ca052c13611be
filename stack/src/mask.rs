//! 1-bit images as runs.

use thiserror::Error;

/// A 1-bit image, kept as the columns where each row changes colour.
///
/// ```text
///   column  0 1 2 3 4 5 6 7
///   row 0   . # # # . . # #     transitions 1, 4, 6
///   row 1   . . . . . . . .     none
/// ```
///
/// Row 0 is at the largest y, column 0 at the smallest x; pixel `x` covers
/// `[x, x + 1)`. `#` is white: 1, cured. Every row starts black and toggles
/// at each of its transitions; a row with an odd number of them ends white.
///
/// # Guarantees
/// The transitions of a row strictly increase and are below the width. This
/// is the only form an image has, so `==` compares images.
#[derive(Clone, Debug)]
pub struct Mask {
    width: u32,
    /// Where each row's transitions start, and one entry more: the end.
    row_offsets: Vec<u32>,
    transitions: Vec<u32>,
    /// The T.6 strip that it was decoded from, so that an image which passes
    /// through a stage unchanged is not encoded again.
    strip: Option<Box<[u8]>>,
}

impl PartialEq for Mask {
    fn eq(&self, other: &Self) -> bool {
        self.width == other.width
            && self.row_offsets == other.row_offsets
            && self.transitions == other.transitions
    }
}

impl Eq for Mask {}

/// Why arrays are not a mask.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MaskError {
    /// A row's transitions do not strictly increase.
    #[error("row {row}: transitions do not strictly increase")]
    NotIncreasing {
        /// The row, from the top.
        row: usize,
    },
    /// A transition is at or past the width.
    #[error("row {row}: column {column} is outside an image {width} pixels wide")]
    OutsideWidth {
        /// The row, from the top.
        row: usize,
        /// The offending column.
        column: u32,
        /// The image's width in pixels.
        width: u32,
    },
    /// There are more transitions than 32 bits can count.
    #[error("row {row}: the image has more than 2^32 transitions")]
    TooMany {
        /// The row that is too much.
        row: usize,
    },
    /// The row offsets do not start at 0, go down, or miss the end.
    #[error("the row offsets do not partition the transitions")]
    Offsets,
}

impl Mask {
    /// Makes a mask of `width` from its two arrays: `row_offsets` has one
    /// entry more than there are rows, the first 0 and the last
    /// `transitions.len()`.
    ///
    /// # Errors
    /// Where the arrays break the guarantees of [`Mask`].
    pub fn new(
        width: u32,
        row_offsets: Vec<u32>,
        transitions: Vec<u32>,
    ) -> Result<Self, MaskError> {
        let ends_right = row_offsets.first() == Some(&0)
            && row_offsets.last().map(|&end| end as usize) == Some(transitions.len());
        if !ends_right || !row_offsets.is_sorted() {
            return Err(MaskError::Offsets);
        }
        let mask = Self { width, row_offsets, transitions, strip: None };
        for (row, transitions) in mask.rows().enumerate() {
            check_row(row, transitions, width)?;
        }
        Ok(mask)
    }

    /// An all-black mask.
    pub fn black(width: u32, height: u32) -> Self {
        let row_offsets = vec![0; height as usize + 1];
        Self { width, row_offsets, transitions: Vec::new(), strip: None }
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        (self.row_offsets.len() - 1) as u32
    }

    /// The transitions of row `row`.
    ///
    /// # Panics
    /// If `row` is not below the height.
    pub fn row(&self, row: u32) -> &[u32] {
        let row = row as usize;
        &self.transitions[self.row_offsets[row] as usize..self.row_offsets[row + 1] as usize]
    }

    /// The transitions of every row, from the top.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.row_offsets
            .windows(2)
            .map(|ends| &self.transitions[ends[0] as usize..ends[1] as usize])
    }

    /// The number of transitions in all rows: what the image costs.
    pub fn transition_count(&self) -> usize {
        self.transitions.len()
    }

    /// The number of white pixels.
    pub fn white_pixels(&self) -> u64 {
        self.rows().map(|row| white_in_row(row, self.width)).sum()
    }

    /// Whether the pixel is white. Pixels outside the image are black.
    pub fn is_white(&self, column: u32, row: u32) -> bool {
        column < self.width
            && row < self.height()
            && self.row(row).partition_point(|&t| t <= column) % 2 == 1
    }

    /// The T.6 strip that the image was decoded from, where it is known.
    pub(crate) fn strip(&self) -> Option<&[u8]> {
        self.strip.as_deref()
    }

    /// The image with the T.6 strip that it was decoded from.
    pub(crate) fn with_strip(self, strip: Vec<u8>) -> Self {
        Self { strip: Some(strip.into()), ..self }
    }

    /// The image with black and white exchanged.
    pub fn inverted(&self) -> Self {
        let mut inverted = MaskBuilder::new(self.width);
        let mut toggled = Vec::new();
        for row in self.rows() {
            toggled.clear();
            match row {
                [0, rest @ ..] => toggled.extend_from_slice(rest),
                // Nothing can start white in an image without columns.
                _ if self.width == 0 => {}
                _ => {
                    toggled.push(0);
                    toggled.extend_from_slice(row);
                }
            }
            inverted.push_checked(&toggled);
        }
        inverted.finish()
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

fn check_row(row: usize, transitions: &[u32], width: u32) -> Result<(), MaskError> {
    if !transitions.is_sorted_by(|a, b| a < b) {
        return Err(MaskError::NotIncreasing { row });
    }
    match transitions.last() {
        Some(&column) if column >= width => Err(MaskError::OutsideWidth { row, column, width }),
        _ => Ok(()),
    }
}

/// Builds a [`Mask`] row by row, from the top.
#[derive(Clone, Debug)]
pub struct MaskBuilder {
    mask: Mask,
}

impl MaskBuilder {
    /// An image of `width` pixels and no rows yet.
    pub fn new(width: u32) -> Self {
        Self { mask: Mask::black(width, 0) }
    }

    /// Makes room for so many more rows and transitions.
    pub fn reserve(&mut self, rows: usize, transitions: usize) {
        self.mask.row_offsets.reserve(rows);
        self.mask.transitions.reserve(transitions);
    }

    /// Adds a row below the others.
    ///
    /// # Errors
    /// Where the transitions do not strictly increase below the width, or are
    /// too many altogether.
    pub fn push_row(&mut self, transitions: &[u32]) -> Result<(), MaskError> {
        let row = self.rows_so_far();
        check_row(row, transitions, self.mask.width)?;
        if u32::try_from(self.transition_count() + transitions.len()).is_err() {
            return Err(MaskError::TooMany { row });
        }
        self.push_checked(transitions);
        Ok(())
    }

    /// Adds a row that this crate has made in canonical form.
    pub(crate) fn push_checked(&mut self, transitions: &[u32]) {
        debug_assert_eq!(check_row(self.rows_so_far(), transitions, self.mask.width), Ok(()));
        self.mask.transitions.extend_from_slice(transitions);
        self.mask.row_offsets.push(self.mask.transitions.len() as u32);
    }

    /// Adds the row of the first `len` of `places`, in canonical form, which are
    /// at least three more: rows are short, and go faster in fours.
    pub(crate) fn push_padded(&mut self, places: &[u32], len: usize) {
        debug_assert_eq!(check_row(self.rows_so_far(), &places[..len], self.mask.width), Ok(()));
        let end = self.mask.transitions.len() + len;
        for four in places.as_chunks::<4>().0.iter().take(len.div_ceil(4)) {
            self.mask.transitions.extend_from_slice(four);
        }
        self.mask.transitions.truncate(end);
        self.mask.row_offsets.push(end as u32);
    }

    /// Adds `rows` black rows.
    pub fn push_black(&mut self, rows: u32) {
        let end = self.mask.transitions.len() as u32;
        let new_len = self.mask.row_offsets.len() + rows as usize;
        self.mask.row_offsets.resize(new_len, end);
    }

    /// How many transitions there are so far.
    pub(crate) fn transition_count(&self) -> usize {
        self.mask.transitions.len()
    }

    fn rows_so_far(&self) -> usize {
        self.mask.row_offsets.len() - 1
    }

    /// The image of the rows given.
    pub fn finish(self) -> Mask {
        self.mask
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_canonical_form_is_taken() {
        assert!(Mask::new(8, vec![0, 3, 3], vec![1, 4, 6]).is_ok());
        assert_eq!(Mask::new(8, vec![0, 2], vec![4, 4]), Err(MaskError::NotIncreasing { row: 0 }));
        assert_eq!(
            Mask::new(8, vec![0, 0, 1], vec![8]),
            Err(MaskError::OutsideWidth { row: 1, column: 8, width: 8 })
        );
        for offsets in [vec![], vec![1], vec![0, 1], vec![0, 3, 2], vec![1, 2]] {
            assert_eq!(Mask::new(8, offsets, vec![1, 2]), Err(MaskError::Offsets));
        }
    }

    #[test]
    fn pixels_and_area_follow_the_transitions() {
        let mask = Mask::new(8, vec![0, 3, 3], vec![1, 4, 6]).unwrap();
        let row: String = (0..8).map(|c| if mask.is_white(c, 0) { '#' } else { '.' }).collect();
        assert_eq!(row, ".###..##");
        assert_eq!(mask.white_pixels(), 5);
        assert!(!mask.is_white(8, 0) && !mask.is_white(2, 1) && !mask.is_white(2, 2));
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
