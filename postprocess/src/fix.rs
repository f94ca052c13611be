//! Detection and correction of stray rows.
//!
//! Source: 002 section 2.4.1, algorithms 10 and 11.

use lamp_stack::{Image, Layer, Mask, MaskBuilder, PageInfo, map_in_order, white_in_row};
use serde_json::json;

use crate::majority::majority;

/// A band of neighbouring stray rows that was corrected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Band {
    /// The band's first row, from the top.
    pub first_row: u32,
    /// How many rows it has.
    pub rows: u32,
    /// How many pixels changed colour.
    pub pixels: u64,
}

/// Corrects the stray rows of each layer, and tells `report` of each layer
/// that had some. The layer's page then says the same under `fix`, and no
/// longer lists the rows as stray. Layers without stray rows, and gray
/// layers, pass unchanged.
pub fn fix<E: Send>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    mut report: impl FnMut(&PageInfo, &[Band]),
) -> impl Iterator<Item = Result<Layer, E>> {
    map_in_order(layers, |layer| Ok(fix_layer(layer))).map(move |fixed| {
        fixed.map(|(layer, bands)| {
            if !bands.is_empty() {
                report(&layer.info, &bands);
            }
            layer
        })
    })
}

fn fix_layer(mut layer: Layer) -> (Layer, Vec<Band>) {
    let Image::Mask(mask) = &layer.image else { return (layer, Vec::new()) };
    layer.info.stray_rows.sort_unstable();
    let (fixed, bands) = fix_mask(mask, &layer.info.stray_rows);
    if !bands.is_empty() {
        layer.image = Image::Mask(fixed);
        layer.info.stray_rows.clear();
        let bands: Vec<_> = bands
            .iter()
            .map(|b| json!({"row": b.first_row, "rows": b.rows, "pixels": b.pixels}))
            .collect();
        layer.info.other.insert("fix".to_owned(), json!({"method": "nearest", "bands": bands}));
    }
    (layer, bands)
}

/// Corrects the stray rows of a mask: those that end white, since every part
/// leaves the image's last column black, and those listed in `known`, which
/// increase.
///
/// Each pixel of a band takes the colour that the good rows above and below
/// the band share, and keeps its own where they differ. Rows outside the
/// image are black.
pub fn fix_mask(mask: &Mask, known: &[u32]) -> (Mask, Vec<Band>) {
    let bands = stray_bands(mask, known);
    if bands.is_empty() {
        return (mask.clone(), Vec::new());
    }
    let row_or_black = |row: Option<u32>| match row {
        Some(row) if row < mask.height() => mask.row(row),
        _ => &[],
    };
    let mut fixed = MaskBuilder::new(mask.width());
    fixed.reserve(mask.height() as usize, mask.transition_count());
    let mut corrected = Vec::new();
    let mut done = 0;
    let mut bands = bands;
    let mut push =
        |row: &[u32]| fixed.push_row(row).expect("rows of masks and their majority are canonical");
    for band in &mut bands {
        let end = band.first_row + band.rows;
        (done..band.first_row).for_each(|row| push(mask.row(row)));
        let above = row_or_black(band.first_row.checked_sub(1));
        let below = row_or_black(Some(end));
        for row in band.first_row..end {
            majority([above, mask.row(row), below], &mut corrected);
            band.pixels += pixels_that_differ(mask.row(row), &corrected, mask.width());
            push(&corrected);
        }
        done = end;
    }
    (done..mask.height()).for_each(|row| push(mask.row(row)));
    (fixed.finish(), bands)
}

/// The bands of stray rows, from the top, with no pixel changed yet.
fn stray_bands(mask: &Mask, known: &[u32]) -> Vec<Band> {
    let mut bands: Vec<Band> = Vec::new();
    for (row, transitions) in (0..).zip(mask.rows()) {
        if transitions.len().is_multiple_of(2) && known.binary_search(&row).is_err() {
            continue;
        }
        match bands.last_mut() {
            Some(band) if band.first_row + band.rows == row => band.rows += 1,
            _ => bands.push(Band { first_row: row, rows: 1, pixels: 0 }),
        }
    }
    bands
}

/// How many pixels of two rows differ in colour.
fn pixels_that_differ(a: &[u32], b: &[u32], width: u32) -> u64 {
    // Where just one of two rows toggles, they part or meet again.
    let mut toggles: Vec<u32> = [a, b].concat();
    toggles.sort_unstable();
    let alone: Vec<u32> = toggles
        .chunk_by(|a, b| a == b)
        .filter(|group| group.len() == 1)
        .map(|group| group[0])
        .collect();
    white_in_row(&alone, width)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// `#` is white; all rows as wide as the first.
    fn picture(rows: &[&str]) -> Mask {
        let mut mask = MaskBuilder::new(rows[0].len() as u32);
        for row in rows {
            let bytes = row.as_bytes();
            let toggles = |&c: &usize| bytes[c] != if c == 0 { b'.' } else { bytes[c - 1] };
            let transitions: Vec<u32> =
                (0..bytes.len()).filter(toggles).map(|c| c as u32).collect();
            mask.push_row(&transitions).unwrap();
        }
        mask.finish()
    }

    fn band(first_row: u32, rows: u32, pixels: u64) -> Band {
        Band { first_row, rows, pixels }
    }

    #[test]
    fn a_missed_crossing_is_mended() {
        let stray = picture(&["..####..", "..######", "..####.."]);
        let clean = picture(&["..####..", "..####..", "..####.."]);
        assert_eq!(fix_mask(&stray, &[]), (clean, vec![band(1, 1, 2)]));
    }

    #[test]
    fn a_band_of_any_width_takes_what_its_good_rows_share() {
        let stray =
            picture(&["..####....", "..########", "......####", "..##..####", "...####..."]);
        // The rows above and below differ in columns 2 and 6: there the band
        // keeps what it has (the edges that figure 29b shows).
        let fixed =
            picture(&["..####....", "..#####...", "...####...", "..#####...", "...####..."]);
        assert_eq!(fix_mask(&stray, &[]), (fixed, vec![band(1, 3, 14)]));
    }

    #[test]
    fn bands_at_the_edges_lean_on_black() {
        let stray = picture(&["..######", "..##....", "....####"]);
        let (fixed, bands) = fix_mask(&stray, &[]);
        assert_eq!(fixed, picture(&["..##....", "..##....", "........"]));
        assert_eq!(bands, [band(0, 1, 4), band(2, 1, 4)]);
    }

    #[test]
    fn rows_that_the_slicer_names_are_mended_too() {
        let stray = picture(&["..####..", "..#.....", "..####.."]);
        let clean = picture(&["..####..", "..####..", "..####.."]);
        assert_eq!(fix_mask(&stray, &[]).1, []);
        assert_eq!(fix_mask(&stray, &[1]), (clean, vec![band(1, 1, 3)]));
    }

    #[test]
    fn a_page_says_what_was_changed() {
        let mask = picture(&["..####..", "..######", "..####.."]);
        let info = PageInfo { stray_rows: vec![1], ..PageInfo::default() };
        let layer = Layer { info, dpi: None, image: Image::Mask(mask) };
        let mut reports = Vec::new();
        let fixed: Vec<_> = fix(std::iter::once(Ok::<_, ()>(layer)), |info, bands| {
            reports.push((info.index, bands.to_vec()));
        })
        .collect();
        assert_eq!(reports, [(0, vec![band(1, 1, 2)])]);
        let info = &fixed[0].as_ref().unwrap().info;
        assert!(info.stray_rows.is_empty());
        assert_eq!(info.other["fix"]["bands"][0]["row"], 1);
    }

    proptest! {
        #[test]
        fn a_clean_mask_stays_and_a_mended_one_is_clean(
            rows in prop::collection::vec(prop::collection::btree_set(0u32..60, 0..9), 0..20),
        ) {
            let mut mask = MaskBuilder::new(60);
            for row in &rows {
                mask.push_row(&row.iter().copied().collect::<Vec<_>>()).unwrap();
            }
            let mask = mask.finish();
            let (fixed, bands) = fix_mask(&mask, &[]);
            prop_assert_eq!(bands.is_empty(), mask == fixed);
            prop_assert!(fixed.rows().all(|row| row.len() % 2 == 0));
            prop_assert_eq!(fix_mask(&fixed, &[]), (fixed.clone(), vec![]));
            let changed: u64 = bands.iter().map(|band| band.pixels).sum();
            let differ = (0..60 * mask.height())
                .filter(|i| mask.is_white(i % 60, i / 60) != fixed.is_white(i % 60, i / 60));
            prop_assert_eq!(changed, differ.count() as u64);
        }
    }
}
