//! Gray images as masks: where they reach a level, and where they are exposed at all.

use std::borrow::Cow;
use std::num::NonZeroU8;

use crate::image::Image;
use crate::image::gray::{GrayMask, LevelChange};
use crate::image::mask::{Mask, MaskBuilder};

/// Returns the transitions of the pixels of a gray row that have at least `level`, which is
/// above zero.
fn threshold_row(changes: &[LevelChange], level: u8) -> impl Iterator<Item = u32> {
    let mut white = false;
    changes
        .iter()
        .filter(move |change| std::mem::replace(&mut white, change.level >= level) != white)
        .map(|change| change.column)
}

impl GrayMask {
    /// Returns the level of a pixel.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn level(&self, column: u32, row: u32) -> u8 {
        let changes = self.row(row);
        let next = changes.partition_point(|change| change.column <= column);
        next.checked_sub(1).map_or(0, |last| changes[last].level)
    }

    /// Returns a mask of the pixels that have at least `level`, which is above zero.
    pub fn at_least(&self, level: u8) -> Mask {
        let mut mask = MaskBuilder::new(self.width());
        mask.reserve(self.height() as usize, self.change_count());
        let mut row = Vec::new();
        for changes in self.rows() {
            row.clear();
            row.extend(threshold_row(changes, level));
            mask.push_row(&row).expect("the columns of a gray row increase");
        }
        mask.finish()
    }

    /// Returns the image as a mask, if it has no level between 0 and 255.
    pub fn to_mask(&self) -> Option<Mask> {
        let is_gray = |change: &LevelChange| ![0, 255].contains(&change.level);
        if self.rows().flatten().any(is_gray) { None } else { Some(self.at_least(255)) }
    }
}

impl Image {
    /// Returns a mask of the pixels that have at least `level`; a mask's pixels have 0 or 255.
    pub fn into_mask(self, level: NonZeroU8) -> Mask {
        match self {
            Self::Mask(mask) => mask,
            Self::Gray(gray) => gray.at_least(level.get()),
        }
    }

    /// Returns a mask of the pixels that are exposed at all.
    pub fn exposed(&self) -> Cow<'_, Mask> {
        match self {
            Self::Mask(mask) => Cow::Borrowed(mask),
            Self::Gray(gray) => Cow::Owned(gray.at_least(1)),
        }
    }

    /// Returns the transitions of a row of the pixels that are exposed at all.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn exposed_row(&self, row: u32) -> Cow<'_, [u32]> {
        match self {
            Self::Mask(mask) => Cow::Borrowed(mask.row(row)),
            Self::Gray(gray) => Cow::Owned(threshold_row(gray.row(row), 1).collect()),
        }
    }

    /// Returns the image with levels: a mask's levels are 0 and 255.
    pub fn to_gray(&self) -> Cow<'_, GrayMask> {
        match self {
            Self::Mask(mask) => Cow::Owned(mask.into()),
            Self::Gray(gray) => Cow::Borrowed(gray),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::arbitrary_gray;

    proptest! {
        #[test]
        fn masks_are_white_where_the_level_is_reached(gray in arbitrary_gray(), level in 1u8..) {
            let mask = gray.at_least(level);
            for (column, row) in (0..gray.width()).flat_map(|c| (0..gray.height()).map(move |r| (c, r))) {
                prop_assert_eq!(mask.is_white(column, row), gray.level(column, row) >= level);
            }
            prop_assert_eq!(GrayMask::from(&mask).to_mask(), Some(mask.clone()));
            let image = Image::Gray(gray);
            prop_assert_eq!(image.exposed().into_owned(), image.to_gray().at_least(1));
            prop_assert!((0..mask.height()).all(|row| *image.exposed_row(row) == *image.exposed().row(row)));
        }
    }
}
