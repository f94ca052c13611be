//! Stores 8-bit images as runs of equal level.

use crate::image::mask::Mask;
use crate::image::runs::{Change, RunError, RunImage};

/// An 8-bit image, stored as the columns where each row changes its level: 0 is black, 255
/// full exposure. See [`RunImage`] for the coordinates and the guarantees.
///
/// ```
/// use lamp_stack::{GrayMask, LevelChange, gray_runs};
///
/// let mut gray = GrayMask::new(8);
/// gray.push_row(&[LevelChange { column: 2, level: 128 }, LevelChange { column: 5, level: 0 }])?;
/// // The same as runs of (length, level).
/// gray.push_runs([(2, 0), (3, 128)])?;
/// assert_eq!(gray.row(0), gray.row(1));
/// assert_eq!(gray_runs(gray.row(0), gray.width()).collect::<Vec<_>>(), [(2, 5, 128)]);
/// # Ok::<(), lamp_stack::RunError>(())
/// ```
pub type GrayMask = RunImage<LevelChange>;

/// A change of level in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelChange {
    /// The first column of the new level.
    pub column: u32,
    /// The new level: 0 is black, 255 full exposure.
    pub level: u8,
}

impl Change for LevelChange {
    type Pixel = u8;

    #[inline]
    fn new(column: u32, level: u8) -> Self {
        Self { column, level }
    }

    #[inline]
    fn moved(self, column: u32) -> Self {
        Self { column, ..self }
    }

    #[inline]
    fn column(self) -> u32 {
        self.column
    }

    #[inline]
    fn after(self, _: u8) -> u8 {
        self.level
    }

    #[inline]
    fn last_pixel(changes: &[Self]) -> u8 {
        changes.last().map_or(0, |last| last.level)
    }
}

impl GrayMask {
    /// Creates an image of `width` pixels without rows.
    pub fn new(width: u32) -> Self {
        Self::without_rows(width)
    }

    /// Creates an image from where each row's changes start, and last where they all end, and the
    /// changes of all rows.
    ///
    /// # Errors
    /// Returns an error if they break the guarantees of [`RunImage`].
    pub fn from_changes(
        width: u32,
        row_offsets: Vec<u32>,
        changes: Vec<LevelChange>,
    ) -> Result<Self, RunError> {
        Self::from_arrays(width, row_offsets, changes)
    }

    /// Returns the image with `levels[level]` in place of each level. Black stays black.
    #[must_use]
    pub fn with_levels(&self, levels: &[u8; 256]) -> Self {
        let (mut image, mut row) = (Self::new(self.width()), Vec::new());
        for index in 0..self.height() {
            row.clear();
            for &LevelChange { column, level } in self.row(index) {
                let level = if level == 0 { 0 } else { levels[usize::from(level)] };
                // Two levels may become one.
                if LevelChange::last_pixel(&row) != level {
                    row.push(LevelChange { column, level });
                }
            }
            image.push(&row);
        }
        image
    }

    /// Returns the number of pixels that are not black.
    pub(crate) fn exposed_pixels(&self) -> u64 {
        let of_row = |changes: &[LevelChange]| {
            let (mut sum, mut since, mut exposed) = (0, 0, 0);
            for change in changes {
                // A mask instead of a branch, which would often be mispredicted in noise.
                sum += (change.column - since) & exposed;
                (since, exposed) = (change.column, if change.level > 0 { u32::MAX } else { 0 });
            }
            u64::from(sum + ((self.width() - since) & exposed))
        };
        self.rows().map(of_row).sum()
    }

    /// Adds a row below the others.
    ///
    /// # Errors
    /// Returns an error if the changes break the guarantees of [`RunImage`].
    pub fn push_row(&mut self, changes: &[LevelChange]) -> Result<(), RunError> {
        self.push_row_checked(changes)
    }

    /// Adds a row given as runs `(length, level)` from the left, which may be empty or repeat a
    /// level. Pixels after the last run are black.
    ///
    /// # Errors
    /// Returns an error if the runs are longer than the width.
    pub fn push_runs(&mut self, runs: impl IntoIterator<Item = (u32, u8)>) -> Result<(), RunError> {
        self.push_row_with(|width, row, changes| {
            let (mut column, mut level) = (0u32, 0);
            for (length, next) in runs {
                // An empty run would make two changes at one column.
                if next != level && length > 0 {
                    changes.push(LevelChange { column, level: next });
                    level = next;
                }
                match column.checked_add(length) {
                    Some(end) if end <= width => column = end,
                    _ => return Err(RunError::OutsideWidth { row, column, width }),
                }
            }
            if level != 0 && column < width {
                changes.push(LevelChange { column, level: 0 });
            }
            Ok(())
        })
    }
}

/// Converts a mask to the levels 0 and 255.
impl From<&Mask> for GrayMask {
    fn from(mask: &Mask) -> Self {
        let mut gray = Self::new(mask.width());
        let mut changes = Vec::new();
        for row in mask.rows() {
            changes.clear();
            let levels = [255, 0].into_iter().cycle();
            changes.extend(
                row.iter().zip(levels).map(|(&column, level)| LevelChange { column, level }),
            );
            gray.push(&changes);
        }
        gray
    }
}

/// Returns the nonblack runs of a row, as the first column, the column after the last, and
/// the level.
pub fn gray_runs(changes: &[LevelChange], width: u32) -> impl Iterator<Item = (u32, u32, u8)> {
    let ends = changes.iter().skip(1).map(|change| change.column).chain([width]);
    changes
        .iter()
        .zip(ends)
        .filter(|(change, _)| change.level > 0)
        .map(|(change, end)| (change.column, end, change.level))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn change(column: u32, level: u8) -> LevelChange {
        LevelChange { column, level }
    }

    #[test]
    fn runs_become_the_canonical_form() {
        let mut image = GrayMask::new(10);
        image.push_runs([(2, 0), (3, 7), (0, 9), (1, 7), (1, 255)]).unwrap();
        image.push_runs([(10, 1)]).unwrap();
        image.push_runs([(2, 7), (0, 0), (1, 7), (0, 7)]).unwrap();
        image.push_runs([]).unwrap();
        let rows: Vec<_> = image.rows().collect();
        assert_eq!(rows[0], [change(2, 7), change(6, 255), change(7, 0)]);
        assert_eq!(rows[1], [change(0, 1)]);
        assert_eq!(rows[2], [change(0, 7), change(3, 0)]);
        assert!(rows[3].is_empty());
        assert!(image.push_runs([(10, 1), (1, 0)]).is_err());
        assert!(image.push_runs([(u32::MAX, 1), (u32::MAX, 0)]).is_err());
        assert_eq!(image.height(), 4);
    }

    proptest! {
        #[test]
        fn each_pixel_gets_the_level_of_its_level(
            image in crate::testing::arbitrary_gray(),
            levels in prop::collection::vec(0u8..4, 256),
        ) {
            let levels: [u8; 256] = levels.try_into().unwrap();
            let mapped = image.with_levels(&levels);
            let changes = (0..mapped.height()).flat_map(|row| mapped.row(row).to_vec()).collect();
            let offsets = (0..=mapped.height()).scan(0, |sum, row| {
                *sum += row.checked_sub(1).map_or(0, |row| mapped.row(row).len() as u32);
                Some(*sum)
            });
            // It keeps the guarantees of runs.
            let checked = GrayMask::from_changes(mapped.width(), offsets.collect(), changes);
            prop_assert_eq!(checked.as_ref(), Ok(&mapped));
            for row in 0..image.height() {
                for column in 0..image.width() {
                    let expected = match image.level(column, row) {
                        0 => 0,
                        level => levels[usize::from(level)],
                    };
                    prop_assert_eq!(mapped.level(column, row), expected);
                }
            }
        }

        #[test]
        fn changes_of_all_rows_are_checked_as_those_of_each(
            rows in prop::collection::vec(prop::collection::vec((0u32..4, 0u8..3), 0..4), 1..4),
            width in 1u32..10,
        ) {
            let mut column = 0;
            let of_row = |row: &Vec<(u32, u8)>| {
                column = 0;
                let changes = row.iter().map(|&(gap, level)| {
                    column += gap;
                    change(column, level)
                });
                changes.collect::<Vec<_>>()
            };
            let rows: Vec<_> = rows.iter().map(of_row).collect();
            let mut image = GrayMask::new(width);
            let pushed = rows.iter().try_for_each(|row| image.push_row(row));
            let ends = rows.iter().scan(0, |end, row| {
                *end += row.len() as u32;
                Some(*end)
            });
            let offsets = std::iter::once(0).chain(ends).collect();
            let made = GrayMask::from_changes(width, offsets, rows.concat());
            prop_assert_eq!(made, pushed.map(|()| image));
        }
    }

    #[test]
    fn runs_leave_black_out() {
        let runs: Vec<_> = gray_runs(&[change(2, 7), change(6, 0), change(8, 9)], 10).collect();
        assert_eq!(runs, [(2, 6, 7), (8, 10, 9)]);
    }
}
