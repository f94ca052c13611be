//! Gray images out of others.

use lamp_stack::{GrayMask, Mask, MaskBuilder, combine_levels};

/// Where a gray image has at least that level, which is above zero.
pub(super) fn at_least(gray: &GrayMask, level: u8) -> Mask {
    let mut mask = MaskBuilder::new(gray.width());
    let mut row = Vec::new();
    for changes in gray.rows() {
        let mut white = false;
        let toggles = changes
            .iter()
            .filter(|change| std::mem::replace(&mut white, change.level >= level) != white);
        row.clear();
        row.extend(toggles.map(|change| change.column));
        mask.push_row(&row).expect("columns of a gray row increase");
    }
    mask.finish()
}

/// The mask that a gray image is, if it has no level between.
pub(super) fn mask(gray: &GrayMask) -> Option<Mask> {
    let is_gray =
        |row: &[lamp_stack::LevelChange]| row.iter().any(|c| ![0, 255].contains(&c.level));
    if gray.rows().any(is_gray) { None } else { Some(at_least(gray, 255)) }
}

/// The lower level of two images of one size at each pixel.
pub(super) fn lower(a: &GrayMask, b: &GrayMask) -> GrayMask {
    let mut out = GrayMask::new(a.width());
    let mut row = Vec::new();
    for (a, b) in a.rows().zip(b.rows()) {
        combine_levels([a, b], |[a, b]| a.min(b), &mut row);
        out.push_row(&row).expect("both rows are of images as wide");
    }
    out
}
