//! Gray images out of others.

use lamp_stack::{GrayMask, Mask, MaskBuilder};

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

/// A mask as levels 0 and 255.
pub(super) fn gray(mask: &Mask) -> GrayMask {
    let mut gray = GrayMask::new(mask.width());
    for row in mask.rows() {
        let mut column = 0;
        let runs = (0..).zip(row).map(|(k, &t)| {
            let run = (t - column, if k % 2 == 0 { 0 } else { 255 });
            column = t;
            run
        });
        let mut runs: Vec<_> = runs.collect();
        runs.push((mask.width() - column, if row.len() % 2 == 0 { 0 } else { 255 }));
        gray.push_runs(runs).expect("runs as wide as the mask");
    }
    gray
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
    for (mut a_row, mut b_row) in a.rows().zip(b.rows()) {
        let (mut column, mut levels) = (0, [0, 0]);
        let mut runs = Vec::new();
        loop {
            let next = [a_row.first(), b_row.first()].into_iter().flatten().map(|c| c.column).min();
            let end = next.unwrap_or(a.width());
            runs.push((end - column, levels[0].min(levels[1])));
            if next.is_none() {
                break;
            }
            column = end;
            for (row, level) in [&mut a_row, &mut b_row].into_iter().zip(&mut levels) {
                if let Some((change, rest)) = row.split_first().filter(|(c, _)| c.column == end) {
                    (*level, *row) = (change.level, rest);
                }
            }
        }
        out.push_runs(runs).expect("runs as wide as the images");
    }
    out
}
