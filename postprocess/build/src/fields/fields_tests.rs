//! Swaths and fields cut and put back together.

use lamp_stack::{GrayMask, Mask, PageInfo, Pitch};
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
    let layer = Layer { info, pitch: Pitch::of_dpi(25.4), image: image.into() };
    let form = FieldForm { width: 10, height: None, overlap: 4, seam: Seam::Comb };
    let fields = form.fields([22, 1]).unwrap();
    let swath = fields.cut_layer(&layer, 2..3).next().unwrap();
    assert_eq!(swath.info.origin_mm, Some([13.0, 5.0]));
    assert_eq!(swath.info.stray_rows, [0]);
    assert_eq!(
        swath.info.other["strip"],
        json!({ "number": 2, "of": 3, "columns": [12, 22], "bits": 1 })
    );
}

#[test]
fn a_page_says_where_its_field_lies() {
    let info = PageInfo {
        origin_mm: Some([1.0, 20.0]),
        stray_rows: vec![0, 6, 13],
        open_rows: vec![14],
        ..PageInfo::default()
    };
    let image = Image::Mask(Mask::black(22, 14));
    let layer = Layer { info, pitch: Pitch::of_dpi(25.4), image: image.into() };
    let form = FieldForm { width: 10, height: Some(8), overlap: 2, seam: Seam::Comb };
    let fields = form.fields([22, 14]).unwrap();
    assert_eq!((fields.grid(), fields.count()), ([3, 2], 6));
    let cut: Vec<Layer> = fields.cut_layer(&layer, 0..6).collect();
    assert_eq!((&cut[1].info.stray_rows[..], &cut[1].info.open_rows[..]), (&[0, 6][..], &[][..]));
    let page = &cut[4].info;
    assert_eq!(page.origin_mm, Some([9.0, 14.0]));
    assert_eq!((&page.stray_rows[..], &page.open_rows[..]), (&[0, 7][..], &[8][..]));
    assert_eq!(
        page.other["field"],
        json!({ "row": 1, "column": 1, "of": [2, 3], "columns": [8, 18], "rows": [6, 14], "bits": 1 })
    );
}

proptest! {
    /// A look at each pixel of each field: the shares add up to the layer's level, a comb gives each
    /// pixel to one field, and a gray seam gives each its part of both ramps, within a level.
    #[test]
    fn fields_add_up_to_the_layer(
        (width, height) in (1u32..30, 1u32..30),
        (shared, layer_width) in (0u32..15, 1u32..90),
        rows in prop::collection::vec(prop::collection::vec((0u32..30, any::<u8>()), 0..9), 1..60),
        (levels, layer_index) in (any::<bool>(), any::<u32>()),
        seam in prop::sample::select(Seam::ALL.to_vec()),
        split in any::<prop::sample::Index>(),
    ) {
        let overlap = shared.min((width.min(height) - 1) / 2);
        let form = FieldForm { width, height: Some(height), overlap, seam };
        let layer = image(layer_width, &rows, levels);
        let made = form.fields([layer_width, layer.height()]);
        prop_assume!(!matches!(made, Err(FieldsError::TooManyFields { .. })));
        let fields = made.unwrap();
        let count = fields.count();
        let cut = fields.cut(&layer, layer_index, 0..count);
        prop_assert!(cut.iter().all(|field| (field.width(), field.height()) == (width, height)));
        // Threads cut ranges of fields, which may begin and end within a row of them.
        let at = split.index(count as usize + 1) as u32;
        let mut parts = fields.cut(&layer, layer_index, 0..at);
        parts.extend(fields.cut(&layer, layer_index, at..count));
        prop_assert!(parts == cut);
        let mut sums = vec![vec![(0u32, 0u32, 0u32); layer_width as usize]; rows.len()];
        for (field, k) in cut.iter().zip(0..) {
            let (columns, rows) = (fields.columns(k), fields.rows(k));
            for (row, column) in (0..height).flat_map(|row| (0..width).map(move |c| (row, c))) {
                let level = u32::from(field.level(column, row));
                let (x, y) = (columns.start + column, rows.start + row);
                if !(columns.contains(&x) && rows.contains(&y)) {
                    prop_assert_eq!(level, 0, "beyond the layer");
                    continue;
                }
                let sum = &mut sums[y as usize][x as usize];
                *sum = (sum.0 + level, sum.1 + u32::from(level > 0), sum.2 + 1);
                if seam == Seam::Gray {
                    let across = ramp(x, &columns, layer_width, overlap);
                    let down = ramp(y, &rows, layer.height(), overlap);
                    let part = f64::from(layer.level(x, y)) * across * down;
                    prop_assert!((f64::from(level) - part).abs() <= 1.0, "{} {}: {} {}", x, y, level, part);
                }
            }
        }
        for (y, row) in (0..).zip(&sums) {
            for (x, &(sum, exposed, of)) in (0..).zip(row) {
                prop_assert_eq!(sum, u32::from(layer.level(x, y)), "{} {}", x, y);
                prop_assert!(matches!(of, 1 | 2 | 4), "{} fields", of);
                prop_assert!(seam == Seam::Gray || exposed == u32::from(sum > 0));
            }
        }
        prop_assert_eq!(fields.join(&cut), Ok(layer.to_gray().into_owned()));
    }
}

/// Returns the part of a pixel's dose that a field gives along one side.
fn ramp(at: u32, within: &std::ops::Range<u32>, end: u32, overlap: u32) -> f64 {
    let step = f64::from(overlap + 1);
    if within.start > 0 && at - within.start < overlap {
        f64::from(at - within.start + 1) / step
    } else if within.end < end && within.end - at <= overlap {
        f64::from(within.end - at) / step
    } else {
        1.0
    }
}

/// The four levels of a corner, by hand: 255 is divided by rows into 153 and 102 (2 to 3 of 5),
/// these by columns.
#[test]
fn four_fields_share_a_corner_without_a_rest() {
    let form = FieldForm { width: 10, height: Some(9), overlap: 4, seam: Seam::Gray };
    let fields = form.fields([16, 14]).unwrap();
    let white = Image::Mask(Mask::black(16, 14).inverted());
    let cut = fields.cut(&white, 0, 0..4);
    let shares = |x: u32, y: u32| {
        let places = [(x, y), (x - 6, y), (x, y - 5), (x - 6, y - 5)];
        let levels = cut.iter().zip(places).map(|(field, (c, r))| u32::from(field.level(c, r)));
        <[u32; 4]>::try_from(levels.collect::<Vec<_>>()).unwrap()
    };
    // Column 6 and row 6 are the first and the second shared ones: 4/5 and 3/5 stay.
    assert_eq!(shares(6, 6), [122, 31, 82, 20]);
    for (x, y) in (6..10).flat_map(|x| (5..9).map(move |y| (x, y))) {
        assert_eq!(shares(x, y).iter().sum::<u32>(), 255);
    }
}

#[test]
fn fields_that_make_no_layer_are_refused() {
    let form = FieldForm { width: 10, height: Some(8), overlap: 2, seam: Seam::Comb };
    let fields = form.fields([18, 13]).unwrap();
    let layer = Image::Mask(Mask::black(18, 13).inverted());
    let cut = fields.cut(&layer, 0, 0..4);
    let with = |k: usize, image: Image| {
        let mut cut = cut.clone();
        cut[k] = image;
        fields.join(&cut)
    };
    let white = |width, height| Image::Mask(Mask::black(width, height).inverted());
    assert_eq!(fields.join(&cut[..3]), Err(JoinSwathsError::Unlike));
    assert_eq!(with(1, white(10, 9)), Err(JoinSwathsError::Unlike));
    assert_eq!(with(2, white(9, 8)), Err(JoinSwathsError::Unlike));
    // A field that is all white takes pixels of its neighbors, or goes beyond the layer.
    assert!(matches!(with(0, white(10, 8)), Err(JoinSwathsError::TooMuch { row: 0, column: 8 })));
    assert!(matches!(with(3, white(10, 8)), Err(JoinSwathsError::TooMuch { .. })));
    let mut below = Mask::black(10, 7).inverted();
    below = below.framed(lamp_stack::Frame { left: 0, top: -1, width: 10, height: 8 });
    assert!(matches!(with(2, Image::Mask(below)), Err(JoinSwathsError::TooMuch { .. })));
}

#[test]
fn fields_of_impossible_sizes_are_refused() {
    let form = |width, height, overlap| FieldForm {
        width,
        height: Some(height),
        overlap,
        seam: Seam::Comb,
    };
    for wrong in [form(10, 8, 4), form(8, 10, 4), form(0, 8, 0), form(8, 0, 0), form(1, 9, 1)] {
        assert!(wrong.fields([22, 14]).is_err(), "{wrong:?}");
    }
    assert!(form(u32::MAX, u32::MAX, u32::MAX).fields([1, 1]).is_err());
    // Each pixel a field, and one field for all.
    assert_eq!(form(1, 1, 0).fields([22, 14]).unwrap().count(), 22 * 14);
    assert!(matches!(
        form(1, 1, 0).fields([u32::MAX, u32::MAX]),
        Err(FieldsError::TooManyFields { .. })
    ));
    assert!(matches!(form(65_536, 9, 0).fields([1, 1]), Err(FieldsError::LargeField { .. })));
    let large = form(30, 20, 9).fields([22, 14]).unwrap();
    assert_eq!((large.count(), large.columns(0), large.rows(0)), (1, 0..22, 0..14));
    let layer = Image::Mask(Mask::black(22, 14).inverted());
    let cut = large.cut(&layer, 0, 0..1);
    assert_eq!((cut[0].width(), cut[0].height()), (30, 20));
    assert_eq!(large.join(&cut).unwrap(), layer.to_gray().into_owned());
}

/// In every square of 8 x 8 pixels, the lower field exposes the ramp's share, to one of 8 columns.
#[test]
fn a_comb_of_rows_follows_the_ramp_within_few_pixels() {
    let (overlap, width) = (64u32, 200);
    let form = FieldForm { width, height: Some(160), overlap, seam: Seam::Comb };
    let fields = form.fields([width, 256]).unwrap();
    let white = Image::Mask(Mask::black(width, 256).inverted());
    for layer in [0, 1, 77] {
        let lower = &fields.cut(&white, layer, 1..2)[0];
        for (row, column) in (0..=overlap - 8).flat_map(|r| (0..width - 7).map(move |c| (r, c))) {
            let square = (row..row + 8).flat_map(|row| (column..column + 8).map(move |c| (c, row)));
            let part = square.filter(|&(column, row)| lower.level(column, row) == 255).count();
            let ramp = (f64::from(row) + 4.5) / f64::from(overlap + 1);
            assert!((part as f64 / 64.0 - ramp).abs() < 0.125, "{row} {column}: {part} of 64");
        }
    }
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
