//! Swaths cut and put back together.

use lamp_stack::{Dpi, GrayMask, Mask, PageInfo};
use proptest::prelude::*;
use serde_json::json;

use super::*;

fn image(width: u32, rows: &[Vec<(u32, u8)>], levels: bool) -> Image {
    let mut gray = GrayMask::new(width);
    for row in rows {
        let mut room = width;
        let runs = row.iter().map(|&(length, level)| {
            let part = length.min(room);
            room -= part;
            (part, if levels { level } else { 255 * (level & 1) })
        });
        gray.push_runs(runs).unwrap();
    }
    if levels {
        return Image::Gray(gray);
    }
    Image::Mask(gray.to_mask().unwrap())
}

proptest! {
    #[test]
    fn swaths_add_up_to_the_layer(
        (mirrors, shared, width) in (1u32..40, 0u32..20, 1u32..120),
        rows in prop::collection::vec(prop::collection::vec((0u32..30, any::<u8>()), 0..9), 1..5),
        (levels, layer_index) in (any::<bool>(), any::<u32>()),
        seam in prop::sample::select(Seam::ALL.to_vec()),
    ) {
        let overlap = shared.min((mirrors - 1) / 2);
        let swaths = Swaths::new(mirrors, overlap, width).unwrap().with_seam(seam);
        let layer = image(width, &rows, levels);
        let cut: Vec<Image> = swaths.cut(&layer, layer_index, 0..swaths.count()).collect();
        let one = |k| swaths.cut(&layer, layer_index, k..k + 1).next().unwrap();
        let apart = (0..swaths.count()).map(one);
        prop_assert!(apart.eq(cut.iter().cloned()));
        prop_assert!(cut.iter().all(|swath| swath.width() == mirrors));
        for row in 0..layer.height() {
            for column in 0..width {
                let mut sum = 0;
                let (mut of, mut exposed) = (0, 0);
                for (k, swath) in (0..).zip(&cut) {
                    if swaths.columns(k).contains(&column) {
                        of += 1;
                        let level = swath.level(column - swaths.columns(k).start, row);
                        sum += u32::from(level);
                        exposed += u32::from(level > 0);
                    }
                }
                prop_assert!((1..=2).contains(&of));
                prop_assert!(seam == Seam::Gray || exposed == u32::from(sum > 0));
                prop_assert_eq!(sum, u32::from(layer.level(column, row)), "{} {}", column, row);
            }
        }
        prop_assert_eq!(swaths.join(&cut), Ok(layer.to_gray().into_owned()));
    }
}

#[test]
fn ramps_rise_in_equal_steps_and_fall_alike() {
    let swaths = Swaths::new(10, 4, 22).unwrap().with_seam(Seam::Gray);
    assert_eq!((swaths.count(), swaths.columns(1), swaths.columns(2)), (3, 6..16, 12..22));
    let white = Image::Mask(Mask::black(22, 1).inverted());
    let levels = |k| {
        let cut = swaths.cut(&white, 0, k..k + 1).next().unwrap();
        (0..10).map(|column| cut.level(column, 0)).collect::<Vec<_>>()
    };
    assert_eq!(levels(0), [255, 255, 255, 255, 255, 255, 204, 153, 102, 51]);
    assert_eq!(levels(1), [51, 102, 153, 204, 255, 255, 204, 153, 102, 51]);
    assert_eq!(levels(2), [51, 102, 153, 204, 255, 255, 255, 255, 255, 255]);
}

#[test]
fn a_column_is_in_one_swath_or_two() {
    assert!(Swaths::new(10, 5, 22).is_err() && Swaths::new(0, 0, 22).is_err());
    assert!(Swaths::new(u32::MAX, u32::MAX, 1).is_err());
    let one = Swaths::new(30, 9, 22).unwrap();
    assert_eq!((one.count(), one.columns(0)), (1, 0..22));
}

#[test]
fn a_page_says_where_its_swath_lies() {
    let info = PageInfo { origin_mm: Some([1.0, 5.0]), stray_rows: vec![0], ..PageInfo::default() };
    let image = Image::Mask(Mask::black(22, 1));
    let layer = Layer { info, dpi: Dpi::new(25.4), image: image.into() };
    let swath = Swaths::new(10, 4, 22).unwrap().cut_layer(&layer, 2..3).next().unwrap();
    assert_eq!(swath.info.origin_mm, Some([13.0, 5.0]));
    assert_eq!(swath.info.stray_rows, [0]);
    assert_eq!(
        swath.info.other["strip"],
        json!({ "number": 2, "of": 3, "columns": [12, 22], "bits": 1 })
    );
}

/// In every square of 8 x 8 pixels, the second swath exposes the ramp's share, to one of 8 rows.
#[test]
fn a_comb_follows_the_ramp_within_few_pixels() {
    let (overlap, rows) = (64u32, 200);
    let swaths = Swaths::new(160, overlap, 256).unwrap();
    let white = Image::Mask(Mask::black(256, rows).inverted());
    for layer in [0, 1, 2, 77, 5079] {
        let cut: Vec<Image> = swaths.cut(&white, layer, 0..2).collect();
        let [first, second] = &cut[..] else { panic!("two swaths") };
        let shares = |column: u32, row| {
            let level = |image: &Image, column| u32::from(image.level(column, row) == 255);
            [level(first, column + 96), level(second, column)]
        };
        for (row, column) in (0..rows - 7).flat_map(|row| (0..=overlap - 8).map(move |c| (row, c)))
        {
            let square = (row..row + 8).flat_map(|row| (column..column + 8).map(move |c| (c, row)));
            let [left, right] = square.fold([0, 0], |sum, (column, row)| {
                let [left, right] = shares(column, row);
                [sum[0] + left, sum[1] + right]
            });
            assert_eq!(left + right, 64);
            let ramp = (f64::from(column) + 4.5) / f64::from(overlap + 1);
            assert!(
                (f64::from(right) / 64.0 - ramp).abs() < 0.125,
                "{row} {column}: {right} of 64"
            );
        }
    }
}

/// A comb adds two transitions to a row at most, where its white goes from swath to swath.
#[test]
fn a_comb_costs_a_transition_on_either_side() {
    let swaths = Swaths::new(100, 40, 1000).unwrap();
    let layer = Image::Mask(Mask::black(1000, 50).inverted());
    let cut = swaths.cut(&layer, 3, 0..swaths.count());
    let changes: usize = cut.map(|swath| swath.change_count()).sum();
    assert!(changes <= 50 * (1 + 2 * (swaths.count() as usize - 1)) + 50, "{changes}");
}
