//! Defines crossings of rows with contours, and segments that represent many crossings.

use std::ops::Range;

use crate::bodies::Turn;
use crate::grid::PixelGrid;
use crate::scan::ceil_clamped;

/// A crossing of a row in 64 bits: the row, the first column whose center is past the
/// crossing, and in the lowest bit the direction of the contour. Sorted, crossings
/// are in the order of rows and columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Crossing(u64);

impl Crossing {
    #[inline]
    fn new(row: u32, column: u32, rising: bool) -> Self {
        // Columns are at most 2^24, so column and direction fit in the lower half.
        Self(u64::from(row) << 32 | u64::from(column) << 1 | u64::from(rising))
    }

    /// Creates the crossing of a row at a column in pixels. The last column is black: rounding
    /// moves no crossing past it.
    #[inline]
    pub(crate) fn at(grid: &PixelGrid, row: u32, column: f64, rising: bool) -> Self {
        Self::new(row, ceil_clamped(column, grid.width - 1), rising)
    }

    /// Returns the crossing in the other direction.
    pub(crate) fn reversed(self) -> Self {
        Self(self.0 ^ 1)
    }

    #[inline]
    pub(crate) fn row(self) -> usize {
        (self.0 >> 32) as usize
    }

    /// Returns the column and direction.
    #[inline]
    pub(crate) fn in_row(self) -> RowCrossing {
        RowCrossing(self.0 as u32)
    }
}

/// A crossing in 32 bits, for small images: the row, and the column and direction below it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ShortCrossing(u32);

impl ShortCrossing {
    /// Returns whether all crossings of an image can be short.
    pub(crate) fn hold(grid: &PixelGrid) -> bool {
        grid.height <= 1 << 16 && grid.width <= 1 << 15
    }

    #[inline]
    pub(crate) fn new(crossing: Crossing) -> Self {
        // Where `hold` is true, column and direction are below bit 16, to which the row moves.
        Self((crossing.0 >> 16) as u32 | crossing.0 as u32)
    }

    #[inline]
    pub(crate) fn row(self) -> usize {
        (self.0 >> 16) as usize
    }

    /// Returns the column and direction.
    #[inline]
    pub(crate) fn in_row(self) -> RowCrossing {
        RowCrossing(self.0 & 0xFFFF)
    }
}

/// A crossing in its row: column and direction in 32 bits, to sort by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct RowCrossing(u32);

impl RowCrossing {
    #[inline]
    pub(crate) fn column(self) -> u32 {
        self.0 >> 1
    }

    /// Returns the step of the winding number, +1 or -1.
    #[inline]
    pub(crate) fn winding(self) -> i32 {
        (self.0 & 1) as i32 * 2 - 1
    }
}

/// A crossing in its row and its body, to sort by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct BodyCrossing {
    place: RowCrossing,
    body: u32,
}

impl BodyCrossing {
    #[inline]
    pub(crate) fn new(body: u32, place: RowCrossing) -> Self {
        Self { place, body }
    }
}

/// The elements from which a row's images are made.
pub(crate) trait InRow: Copy + Default + Ord {
    /// Returns the first column past it.
    fn column(self) -> u32;

    /// Returns the step of the winding number.
    fn turn(self) -> Turn;
}

impl InRow for RowCrossing {
    #[inline]
    fn column(self) -> u32 {
        self.column()
    }

    #[inline]
    fn turn(self) -> Turn {
        Turn::new(0, self.winding())
    }
}

impl InRow for BodyCrossing {
    #[inline]
    fn column(self) -> u32 {
        self.place.column()
    }

    #[inline]
    fn turn(self) -> Turn {
        Turn::new(self.body, self.place.winding())
    }
}

/// A segment that crosses rows.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RowSegment {
    /// The column and row of its upper end, in pixels.
    upper: [f64; 2],
    columns_per_row: f64,
    first: u32,
    /// The row after the last, times two, and whether the contour rises.
    end_and_rising: u32,
}

impl RowSegment {
    /// Creates a segment that starts at its upper end and crosses `rows`.
    #[inline]
    pub(crate) fn new(
        upper: [f64; 2],
        columns_per_row: f64,
        rows: Range<u32>,
        is_rising: bool,
    ) -> Self {
        // Rows are below 2^31.
        let end_and_rising = rows.end << 1 | u32::from(is_rising);
        Self { upper, columns_per_row, first: rows.start, end_and_rising }
    }

    /// Returns the rows that it crosses.
    #[inline]
    pub(crate) fn rows(&self) -> Range<u32> {
        self.first..self.end_and_rising >> 1
    }

    /// Returns the column in pixels at which it crosses a row.
    #[inline]
    pub(crate) fn column(&self, row: u32) -> f64 {
        self.upper[0] + self.columns_per_row * (f64::from(row) - self.upper[1])
    }

    /// Returns the index of the strip of an image that contains its middle, for `bins` equal strips
    /// from the left.
    #[inline]
    pub(crate) fn bin(&self, grid: &PixelGrid, bins: usize) -> usize {
        let middle = self.upper[0] + self.columns_per_row * (0.5 * self.rows().len() as f64);
        let bin = middle * (bins as f64 / f64::from(grid.width));
        ceil_clamped(bin, bins as u32 - 1) as usize
    }

    #[inline]
    pub(crate) fn is_rising(&self) -> bool {
        self.end_and_rising & 1 == 1
    }

    /// Returns its crossing of a row.
    #[inline]
    pub(crate) fn crossing(&self, grid: &PixelGrid, row: u32) -> Crossing {
        Crossing::at(grid, row, self.column(row), self.is_rising())
    }
}
