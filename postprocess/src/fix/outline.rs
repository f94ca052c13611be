//! The outlines of images: where anything is exposed at all.

use std::borrow::Cow;

use lamp_stack::{GrayMask, Image, LevelChange, Mask, MaskBuilder};

/// The image's outlines as a mask.
pub(super) fn outlines(image: &Image) -> Cow<'_, Mask> {
    match image {
        Image::Mask(mask) => Cow::Borrowed(mask),
        Image::Gray(gray) => Cow::Owned(of_gray(gray)),
    }
}

fn of_gray(gray: &GrayMask) -> Mask {
    let mut outlines = MaskBuilder::new(gray.width());
    outlines.reserve(gray.height() as usize, gray.change_count());
    for row in gray.rows() {
        outlines.push_row(&of_gray_row(row)).expect("columns of a gray row increase");
    }
    outlines.finish()
}

/// A row of the image's outlines.
pub(super) fn outline_row(image: &Image, row: u32) -> Cow<'_, [u32]> {
    match image {
        Image::Mask(mask) => Cow::Borrowed(mask.row(row)),
        Image::Gray(gray) => Cow::Owned(of_gray_row(gray.row(row))),
    }
}

fn of_gray_row(row: &[LevelChange]) -> Vec<u32> {
    let mut white = false;
    let toggles =
        row.iter().filter(|change| std::mem::replace(&mut white, change.level > 0) != white);
    toggles.map(|change| change.column).collect()
}
