//! Images as text, for the tests of tiling.

use lamp_stack::{Image, Layer, Mask, MaskBuilder, PageInfo, Pitch};

/// An image of rows of `#` and `.`.
pub(super) fn mask_of(rows: &[&str]) -> Mask {
    let mut mask = MaskBuilder::new(rows[0].len() as u32);
    for row in rows {
        let white = |column: usize| row.as_bytes()[column] == b'#';
        let changes = (0..row.len()).filter(|&c| white(c) != (c > 0 && white(c - 1)));
        mask.push_row(&changes.map(|column| column as u32).collect::<Vec<_>>()).unwrap();
    }
    mask.finish()
}

/// A layer of 1 mm a pixel.
pub(super) fn layer(index: u32, image: Image) -> Layer {
    let info = PageInfo {
        index,
        z_um: Some(f64::from(index) * 100.0),
        thickness_um: Some(100.0),
        ..PageInfo::default()
    };
    Layer { info, pitch: Pitch::of_dpi(25.4), image: image.into() }
}
