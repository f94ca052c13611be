//! 8-bit images as runs of equal level.

use thiserror::Error;

use crate::mask::Mask;

/// An 8-bit image, kept as the places where each row changes its level.
/// 0 is black, 255 full exposure; pixels lie as in a [`Mask`](crate::Mask).
///
/// # Guarantees
/// Every row starts at level 0. The columns of a row's changes strictly
/// increase and are below the width, and every change is to another level:
/// the only form an image has, so `==` compares images.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GrayMask {
    width: u32,
    row_offsets: Vec<u32>,
    changes: Vec<LevelChange>,
}

/// From `column` on, a row's pixels have `level`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelChange {
    /// The first column of the new level.
    pub column: u32,
    /// 0 black, 255 full exposure.
    pub level: u8,
}

/// Why changes are not a row of a gray mask.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("row {row}: the change at column {column} breaks the order, the width or the level")]
pub struct GrayMaskError {
    /// The row, from the top.
    pub row: usize,
    /// The change that cannot stand where it is.
    pub column: u32,
}

impl GrayMask {
    /// An image of `width` pixels and no rows yet.
    pub fn new(width: u32) -> Self {
        Self { width, row_offsets: vec![0], changes: Vec::new() }
    }

    /// Adds a row below the others.
    ///
    /// # Errors
    /// Where the changes break the guarantees of [`GrayMask`].
    pub fn push_row(&mut self, changes: &[LevelChange]) -> Result<(), GrayMaskError> {
        let mut last = None;
        let mut level = 0;
        for &change in changes {
            if change.column >= self.width || last >= Some(change.column) || change.level == level {
                let row = self.row_offsets.len() - 1;
                return Err(GrayMaskError { row, column: change.column });
            }
            (last, level) = (Some(change.column), change.level);
        }
        self.changes.extend_from_slice(changes);
        self.row_offsets.push(self.changes.len() as u32);
        Ok(())
    }

    /// Adds a row given as runs of `(length, level)` from the left, which may
    /// be empty or repeat a level, and may end before the width (black then).
    ///
    /// # Errors
    /// Where the runs are longer than the width.
    pub fn push_runs(
        &mut self,
        runs: impl IntoIterator<Item = (u32, u8)>,
    ) -> Result<(), GrayMaskError> {
        let first = self.changes.len();
        let row = self.row_offsets.len() - 1;
        let (mut column, mut level) = (0u32, 0);
        for (length, next) in runs {
            if next != level && length > 0 {
                self.changes.push(LevelChange { column, level: next });
                level = next;
            }
            match column.checked_add(length) {
                Some(end) if end <= self.width => column = end,
                _ => {
                    self.changes.truncate(first);
                    return Err(GrayMaskError { row, column });
                }
            }
        }
        if level != 0 && column < self.width {
            self.changes.push(LevelChange { column, level: 0 });
        }
        self.row_offsets.push(self.changes.len() as u32);
        Ok(())
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        (self.row_offsets.len() - 1) as u32
    }

    /// The changes of row `row`.
    ///
    /// # Panics
    /// If `row` is not below the height.
    pub fn row(&self, row: u32) -> &[LevelChange] {
        let row = row as usize;
        &self.changes[self.row_offsets[row] as usize..self.row_offsets[row + 1] as usize]
    }

    /// The changes of every row, from the top.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[LevelChange]> {
        self.row_offsets.windows(2).map(|ends| &self.changes[ends[0] as usize..ends[1] as usize])
    }

    /// The number of changes in all rows: what the image costs.
    pub fn change_count(&self) -> usize {
        self.changes.len()
    }
}

/// A mask as levels 0 and 255.
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
            gray.push_row(&changes).expect("transitions increase within the mask");
        }
        gray
    }
}

/// The runs of a row that are not black, as `(first column, end, level)`.
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

    #[test]
    fn only_the_canonical_form_is_taken() {
        let mut image = GrayMask::new(10);
        assert!(image.push_row(&[change(2, 7), change(6, 0)]).is_ok());
        for row in [
            [change(2, 0), change(6, 1)],
            [change(2, 7), change(6, 7)],
            [change(6, 7), change(6, 0)],
            [change(2, 7), change(10, 0)],
        ] {
            assert!(image.push_row(&row).is_err(), "{row:?}");
        }
        let runs: Vec<_> = gray_runs(&[change(2, 7), change(6, 0), change(8, 9)], 10).collect();
        assert_eq!(runs, [(2, 6, 7), (8, 10, 9)]);
    }
}
