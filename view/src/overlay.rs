//! Overlays on a layer's picture, as masks.

use std::ops::Range;

use lamp_stack::{FixRecord, FixedBand, Mask, MaskBuilder, Op, PageInfo};

/// An overlay on a layer's picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Overlay {
    /// White in the layer below, and black in this one.
    Below,
    /// White in this layer, and black in the one below.
    New,
    /// White in the second stack, and black in this one.
    Added,
    /// White in this stack, and black in the second one.
    Missing,
    /// Rows that `fix` changed.
    Fixed,
    /// Rows that are stray.
    Stray,
    /// Each copy of a build in a color of its own.
    Copies,
    /// Pixels of findings.
    Findings,
}

lamp_stack::named!(Overlay {
    Below = "below",
    New = "new",
    Added = "added",
    Missing = "missing",
    Fixed = "fixed",
    Stray = "stray",
    Copies = "copies",
    Findings = "findings",
});

impl Overlay {
    /// Returns the label for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Below => "Only in the layer below",
            Self::New => "New over the layer below",
            Self::Added => "Only in the second stack",
            Self::Missing => "Not in the second stack",
            Self::Fixed => "Rows that fix changed",
            Self::Stray => "Stray rows",
            Self::Copies => "Copies",
            Self::Findings => "Findings",
        }
    }
}

/// Returns the white of `a` alone. Outside `b`, `b` counts as black.
pub(crate) fn only_in(a: &Mask, b: &Mask) -> Mask {
    let mut only = MaskBuilder::new(a.width());
    only.reserve(a.height() as usize, a.change_count());
    let mut out = Vec::new();
    for (number, row) in (0..).zip(a.rows()) {
        let other = if number < b.height() { b.row(number) } else { &[] };
        // A run that ends at the right border of `b` ends there in wider images, too.
        let ended = (other.len() % 2 == 1 && b.width() < a.width()).then(|| {
            let mut ended = other.to_vec();
            ended.push(b.width());
            ended
        });
        Op::Difference.rows(row, ended.as_deref().unwrap_or(other), &mut out);
        // If `b` is wider, it changes beyond the border.
        out.truncate(out.partition_point(|&column| column < a.width()));
        only.push_row(&out).expect("the columns of combined rows increase");
    }
    only.finish()
}

/// Returns whole rows; bands must increase and not touch.
pub(crate) fn rows(size: [u32; 2], rows: &[Range<u32>]) -> Mask {
    let [width, height] = size;
    let mut mask = MaskBuilder::new(width);
    let mut next = 0;
    for band in rows {
        // Bands come from the text of pages, which may be wrong: no row may repeat or lie outside.
        let band = band.start.clamp(next, height)..band.end.min(height);
        mask.push_black(band.start - next);
        for _ in band.clone() {
            mask.push_row(&[0]).expect("images are wider than nothing");
        }
        next = band.end.max(band.start);
    }
    mask.push_black(height - next);
    mask.finish()
}

/// Returns consecutive rows as bands.
pub(crate) fn bands(rows: &[u32]) -> Vec<Range<u32>> {
    let follow = rows.chunk_by(|&a, &b| a.checked_add(1) == Some(b));
    follow.map(|band| band[0]..band[band.len() - 1].saturating_add(1)).collect()
}

/// Returns the bands that `fix` changed, as it records them on a page.
pub(crate) fn fixed_bands(info: &PageInfo) -> Vec<Range<u32>> {
    let bands = info.record().map(|fix: FixRecord| fix.bands);
    let band = |band: FixedBand| band.row..band.row.saturating_add(band.rows);
    let mut bands: Vec<_> = bands.into_iter().flatten().map(band).collect();
    bands.sort_by_key(|band| band.start);
    bands
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn masks() -> impl Strategy<Value = Mask> {
        let row = prop::collection::btree_set(0u32..30, 0..8);
        (1u32..30, prop::collection::vec(row, 0..6)).prop_map(|(width, rows)| {
            let mut mask = MaskBuilder::new(width);
            for row in rows {
                let row: Vec<u32> = row.into_iter().filter(|&column| column < width).collect();
                mask.push_row(&row).unwrap();
            }
            mask.finish()
        })
    }

    fn is_white(mask: &Mask, column: u32, row: u32) -> bool {
        column < mask.width() && row < mask.height() && mask.is_white(column, row)
    }

    proptest! {
        #[test]
        fn what_is_in_one_alone_is_found_for_any_sizes(a in masks(), b in masks()) {
            let only = only_in(&a, &b);
            prop_assert_eq!([only.width(), only.height()], [a.width(), a.height()]);
            for row in 0..a.height() {
                for column in 0..a.width() {
                    let wanted = is_white(&a, column, row) && !is_white(&b, column, row);
                    prop_assert_eq!(only.is_white(column, row), wanted);
                }
            }
        }
    }

    #[test]
    fn rows_are_drawn_whole() {
        let stray = bands(&[1, 2, 4]);
        assert_eq!(stray, [1..3, 4..5]);
        let mask = rows([7, 6], &stray);
        let white: Vec<bool> = (0..6).map(|row| mask.is_white(6, row)).collect();
        assert_eq!(white, [false, true, true, false, true, false]);
        // Rows outside the image, as a false page may name them.
        assert_eq!(rows([7, 2], &[5..9, 3..4]).white_pixels(), 0);
        assert_eq!(rows([7, 6], &bands(&[1, 2, 9])).height(), 6);
    }

    #[test]
    fn what_fix_records_is_read() {
        let fix = serde_json::json!({"bands": [{"row": 5, "rows": 2, "pixels": 9}, {"row": "x"}]});
        let other = [("fix".to_owned(), fix)].into_iter().collect();
        let info = PageInfo { other, ..PageInfo::default() };
        assert_eq!(fixed_bands(&info), vec![5..7]);
    }
}
