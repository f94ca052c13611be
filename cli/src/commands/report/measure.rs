//! The numbers of a layer, from its runs.

use lamp_stack::{FixRecord, Image, Layer, Mask, gray_runs, white_in_both, white_in_row};

/// The counts of a layer, and the statements of its page.
#[derive(Clone, Debug)]
pub(super) struct LayerNumbers {
    pub(super) index: u32,
    pub(super) z_um: Option<f64>,
    pub(super) thickness_um: Option<f64>,
    pub(super) exposure_ms: Option<f64>,
    /// Pixels that are not black.
    pub(super) area_px: u64,
    /// Sides of pixels between black and not black.
    pub(super) perimeter_px: u64,
    /// Pixels that are not black, above black ones; of the first layer all.
    pub(super) new_px: u64,
    /// Pixels between black and white.
    pub(super) gray_px: u64,
    /// Rows that the page calls stray.
    pub(super) stray_rows: u64,
    /// Stray rows that `fix` corrected.
    pub(super) fixed_rows: u64,
}

impl LayerNumbers {
    /// Counts all but the new pixels.
    pub(super) fn of(layer: &Layer) -> Self {
        let exposed = layer.image.exposed();
        let info = &layer.info;
        Self {
            index: info.index,
            z_um: info.z_um,
            thickness_um: info.thickness_um,
            exposure_ms: info.exposure_ms,
            area_px: exposed.white_pixels(),
            perimeter_px: perimeter(&exposed),
            new_px: 0,
            gray_px: gray_pixels(&layer.image),
            stray_rows: info.stray_rows.len() as u64,
            fixed_rows: info.record().map_or(0, |fix: FixRecord| fix.rows()),
        }
    }
}

/// Returns how many sides of white pixels are not shared with another one.
fn perimeter(mask: &Mask) -> u64 {
    let width = mask.width();
    let (mut above, mut white_above): (&[u32], _) = (&[], 0);
    let mut sides = 0;
    for row in mask.rows() {
        // A row that ends white ends at the border.
        sides += row.len().next_multiple_of(2) as u64;
        // Between equal rows no side is free, and most rows equal the row above.
        if row != above {
            let white = white_in_row(row, width);
            sides += white + white_above - 2 * white_in_both(above, row, width);
            (above, white_above) = (row, white);
        }
    }
    sides + white_above
}

/// Returns the number of white pixels that are black in the layer below. Where the images differ
/// in size, they begin at one corner.
pub(super) fn new_pixels(layer: &Mask, below: Option<&Mask>) -> u64 {
    let Some(below) = below else { return layer.white_pixels() };
    let of_row = |(number, row): (u32, &[u32])| {
        let under = if number < below.height() { below.row(number) } else { &[] };
        if row == under {
            return 0;
        }
        white_in_row(row, layer.width()) - white_in_both(row, under, layer.width())
    };
    (0..).zip(layer.rows()).map(of_row).sum()
}

fn gray_pixels(image: &Image) -> u64 {
    let Image::Gray(gray) = image else { return 0 };
    let runs = gray.rows().flat_map(|row| gray_runs(row, gray.width()));
    runs.filter(|run| run.2 != 255).map(|(start, end, _)| u64::from(end - start)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mask(width: u32, rows: &[&[u32]]) -> Mask {
        let mut ends = vec![0];
        ends.extend(rows.iter().scan(0, |end, row| {
            *end += row.len() as u32;
            Some(*end)
        }));
        Mask::new(width, ends, rows.concat()).unwrap()
    }

    #[test]
    fn sides_of_pixels_are_counted() {
        // One pixel; a block of 2 x 3; a block in the corner; two pixels that touch at a corner.
        assert_eq!(perimeter(&mask(5, &[&[], &[2, 3], &[]])), 4);
        assert_eq!(perimeter(&mask(5, &[&[1, 4], &[1, 4]])), 10);
        assert_eq!(perimeter(&mask(5, &[&[], &[3], &[3]])), 8);
        assert_eq!(perimeter(&mask(5, &[&[1, 2], &[2, 3]])), 8);
    }

    #[test]
    fn new_pixels_lie_above_black() {
        let below = mask(6, &[&[1, 4], &[1, 4]]);
        let layer = mask(6, &[&[0, 2], &[1, 4], &[2, 3]]);
        assert_eq!(new_pixels(&layer, Some(&below)), 2);
        assert_eq!(new_pixels(&layer, None), 6);
    }
}
