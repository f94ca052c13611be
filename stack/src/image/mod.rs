//! Images as runs: masks and gray masks, and what is done to their rows.

pub(crate) mod boxes;
pub(crate) mod combine;
pub(crate) mod coverage;
pub(crate) mod difference;
pub(crate) mod frame;
pub(crate) mod gray;
pub(crate) mod mask;
pub(crate) mod orientation;
pub(crate) mod outline;
pub(crate) mod runs;
pub mod sets;
pub(crate) mod threshold;

use crate::image::gray::{GrayMask, gray_runs};
use crate::image::mask::{Mask, white_runs};
use crate::ordered::MemorySize;

/// A layer's pixels: 1-bit or 8-bit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Image {
    /// A 1-bit image: every pixel is exposed or not.
    Mask(Mask),
    /// An 8-bit image: every pixel has an exposure level.
    Gray(GrayMask),
}

impl MemorySize for Image {
    fn bytes(&self) -> usize {
        let (rows, changes) = (self.height() as usize, self.change_count());
        match self {
            Self::Mask(_) => 4 * (rows + changes),
            Self::Gray(_) => 4 * rows + 8 * changes,
        }
    }
}

impl From<Mask> for Image {
    fn from(mask: Mask) -> Self {
        Self::Mask(mask)
    }
}

impl From<GrayMask> for Image {
    fn from(gray: GrayMask) -> Self {
        Self::Gray(gray)
    }
}

impl Image {
    /// Returns the width in pixels.
    pub fn width(&self) -> u32 {
        match self {
            Self::Mask(mask) => mask.width(),
            Self::Gray(gray) => gray.width(),
        }
    }

    /// Returns the height in pixels.
    pub fn height(&self) -> u32 {
        match self {
            Self::Mask(mask) => mask.height(),
            Self::Gray(gray) => gray.height(),
        }
    }

    /// Returns the level of a pixel: of a mask, 0 or 255.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn level(&self, column: u32, row: u32) -> u8 {
        match self {
            Self::Mask(mask) => 255 * u8::from(mask.is_white(column, row)),
            Self::Gray(gray) => gray.level(column, row),
        }
    }

    /// Returns the number of changes in all rows, which determines the cost of processing.
    pub fn change_count(&self) -> usize {
        match self {
            Self::Mask(mask) => mask.change_count(),
            Self::Gray(gray) => gray.change_count(),
        }
    }

    /// Gives back the memory that rows to come were expected to take.
    pub fn shrink_to_fit(&mut self) {
        match self {
            Self::Mask(mask) => mask.shrink_to_fit(),
            Self::Gray(gray) => gray.shrink_to_fit(),
        }
    }

    /// Returns the nonblack runs of a row, as the first column, the column after the last, and
    /// the level.
    ///
    /// # Panics
    /// Panics if `row` is not below the height.
    pub fn runs(&self, row: u32) -> impl Iterator<Item = (u32, u32, u8)> {
        let width = self.width();
        // Two optional iterators make one type without a box.
        let (mask, gray) = match self {
            Self::Mask(mask) => (Some(white_runs(mask.row(row), width)), None),
            Self::Gray(gray) => (None, Some(gray_runs(gray.row(row), width))),
        };
        let white = mask.into_iter().flatten().map(|(start, end)| (start, end, 255));
        white.chain(gray.into_iter().flatten())
    }
}
