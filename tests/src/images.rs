//! Derives images from others, and compares rows.

use lamp_stack::{GrayMask, Image, Layer, Mask, MaskBuilder, PageInfo};

/// Returns a mask with `edit` applied to each row and its number.
///
/// # Panics
/// Panics if an edited row is invalid.
pub fn edited(mask: &Mask, edit: impl Fn(u32, &[u32]) -> Vec<u32>) -> Mask {
    let mut out = MaskBuilder::new(mask.width());
    for (row, transitions) in (0..).zip(mask.rows()) {
        out.push_row(&edit(row, transitions)).expect("columns in rising order");
    }
    out.finish()
}

/// Returns a gray image whose levels rise over four pixels inwards from the edges of
/// the mask's runs. The image's last column is no edge.
///
/// # Panics
/// Never panics: the image is as wide as the mask.
pub fn with_soft_edges(mask: &Mask) -> GrayMask {
    let mut gray = GrayMask::new(mask.width());
    for row in mask.rows() {
        let level = |column: u32| {
            let next = row.partition_point(|&edge| edge <= column);
            let left = next.checked_sub(1).map(|last| column - row[last] + 1);
            let right = row.get(next).map(|edge| edge - column);
            let inwards = left.into_iter().chain(right).min();
            match inwards {
                Some(pixels) if next % 2 == 1 => (64 * pixels).min(255) as u8,
                _ => 0,
            }
        };
        gray.push_runs((0..mask.width()).map(|column| (1, level(column)))).expect("its width");
    }
    gray
}

/// Returns the pixels of a gray image that have at least a level.
///
/// # Panics
/// Never panics: its columns are the columns of the gray image.
pub fn at_least(gray: &GrayMask, level: u8) -> Mask {
    let mut mask = MaskBuilder::new(gray.width());
    for row in gray.rows() {
        let mut white = false;
        let toggles = row
            .iter()
            .filter(|change| std::mem::replace(&mut white, change.level >= level) != white);
        mask.push_row(&toggles.map(|change| change.column).collect::<Vec<_>>())
            .expect("columns of a gray row increase");
    }
    mask.finish()
}

/// Returns the layers without metadata, numbered from 0, as other programs write them.
pub fn stripped(layers: &[Layer]) -> Vec<Layer> {
    let bare = |(index, layer): (u32, &Layer)| Layer {
        info: PageInfo { index, ..PageInfo::default() },
        pitch: layer.pitch,
        image: layer.image.clone(),
    };
    (0..).zip(layers).map(bare).collect()
}

/// Returns the columns in which a row differs between two images of one size.
pub fn differing(a: &Image, b: &Image, row: u32) -> Vec<u32> {
    (0..a.width()).filter(|&column| a.level(column, row) != b.level(column, row)).collect()
}
