//! Tests of the correction on drawn shapes.

use std::io::Cursor;

use lamp_stack::{EncodedPage, Format, LevelChange, PageInfo, PageWriter, Pages};
use proptest::prelude::*;

use super::*;

/// `#` is white; all rows as wide as the first.
fn picture(rows: &[&str]) -> Mask {
    let mut mask = MaskBuilder::new(rows[0].len() as u32);
    for row in rows {
        let bytes = row.as_bytes();
        let toggles = |&c: &usize| bytes[c] != if c == 0 { b'.' } else { bytes[c - 1] };
        let transitions: Vec<u32> = (0..bytes.len()).filter(toggles).map(|c| c as u32).collect();
        mask.push_row(&transitions).unwrap();
    }
    mask.finish()
}

/// Where a shape is crossed by a row, as real columns.
type ShapeCrossings = fn(f64) -> Vec<f64>;

const WIDTH: u32 = 800;
const HEIGHT: u32 = 500;

/// A disc with a round hole.
fn ring(row: f64) -> Vec<f64> {
    let half = |radius: f64| (radius * radius - (row - 250.3).powi(2)).sqrt();
    let (outer, hole) = (half(210.0), half(60.0));
    match (outer.is_nan(), hole.is_nan()) {
        (true, _) => vec![],
        (_, true) => vec![400.2 - outer, 400.2 + outer],
        _ => vec![400.2 - outer, 400.2 - hole, 400.2 + hole, 400.2 + outer],
    }
}

/// Two bars next to each other, one upright and one leaning.
fn bars(row: f64) -> Vec<f64> {
    if !(20.0..480.0).contains(&row) {
        return vec![];
    }
    vec![100.5, 200.5, 300.0 + 0.37 * row, 360.0 + 0.37 * row]
}

/// The shape as a mask; `miss` says of each row which crossings are lost.
fn drawn(shape: ShapeCrossings, miss: impl Fn(u32) -> &'static [usize]) -> Mask {
    let mut mask = MaskBuilder::new(WIDTH);
    for row in 0..HEIGHT {
        let crossings = shape(f64::from(row)).into_iter().enumerate();
        let kept = crossings.filter(|(which, _)| !miss(row).contains(which));
        mask.push_row(&kept.map(|(_, column)| column.ceil() as u32).collect::<Vec<_>>()).unwrap();
    }
    mask.finish()
}

fn whole(shape: ShapeCrossings) -> Mask {
    drawn(shape, |_| &[])
}

fn layer(index: u32, mask: Mask) -> Layer {
    let info = PageInfo { index, ..PageInfo::default() };
    Layer { info, pitch: None, image: mask.into() }
}

fn fixed(layers: Vec<impl Into<PassingLayer>>, options: FixOptions) -> (Vec<Layer>, Vec<Band>) {
    let mut found = Vec::new();
    let layers = layers.into_iter().map(Ok::<_, StackError>);
    let fixed = fix(layers, options, |fixed| found.extend_from_slice(fixed.bands));
    (fixed.map(|layer| layer.unwrap().decode().unwrap()).collect(), found)
}

fn fixed_mask(mask: &Mask, options: FixOptions) -> (Mask, Vec<Band>) {
    let (mut layers, bands) = fixed(vec![layer(0, mask.clone())], options);
    let Image::Mask(fixed) = layers.remove(0).image.into_image() else { unreachable!() };
    (fixed, bands)
}

fn spline(mask: &Mask) -> (Mask, Vec<Band>) {
    fixed_mask(mask, FixOptions::default())
}

fn nearest(mask: &Mask) -> (Mask, Vec<Band>) {
    let options = FixOptions {
        method: FixMethod::Nearest,
        max_width: None,
        min_confidence: 0.0,
        use_neighbours: false,
    };
    fixed_mask(mask, options)
}

fn kinds(kinds: &[BandKind]) -> BandKinds {
    kinds.iter().copied().collect()
}

/// How many pixels of two masks differ, and how many at most in a row.
fn off(a: &Mask, b: &Mask) -> (u64, u64) {
    let rows = a.rows().zip(b.rows()).map(|(a, b)| white_in_row(&difference(a, b), WIDTH));
    rows.fold((0, 0), |(sum, most), pixels| (sum + pixels, most.max(pixels)))
}

#[test]
fn nearest_takes_what_the_good_rows_share() {
    let stray = picture(&["..####....", "..########", "......####", "..##..####", "...####..."]);
    // The rows above and below differ in columns 2 and 6: there the band
    // keeps what it has (the edges that figure 29b shows).
    let expected = picture(&["..####....", "..#####...", "...####...", "..#####...", "...####..."]);
    let (mended, bands) = nearest(&stray);
    assert_eq!(mended, expected);
    assert_eq!((bands[0].first_row, bands[0].rows, bands[0].pixels), (1, 3, 14));
    assert_eq!((bands.len(), bands[0].columns.clone()), (1, 3..10));
}

#[test]
fn nearest_takes_what_lies_outside_for_black() {
    let (mended, bands) = nearest(&picture(&["..######", "..##....", "....####"]));
    assert_eq!(mended, picture(&["..##....", "..##....", "........"]));
    assert!(bands.iter().all(|band| band.kinds == kinds(&[BandKind::EndsWhite, BandKind::AtEdge])));
}

#[test]
fn a_missed_crossing_is_put_back_and_all_others_stay() {
    let clean = whole(ring);
    for missed in [&[0][..], &[1], &[2], &[3]] {
        for rows in [200..201, 205..210, 230..245] {
            let stray = drawn(ring, |row| if rows.contains(&row) { missed } else { &[] });
            let (mended, bands) = spline(&stray);
            let (pixels, most) = off(&mended, &clean);
            assert!(
                most <= 1 && pixels <= 1 + rows.len() as u64 / 2,
                "{missed:?} {rows:?}: {pixels}"
            );
            let [band] = &bands[..] else { panic!("one band, not {bands:?}") };
            assert_eq!((band.first_row..band.end(), band.outcome), (rows, BandOutcome::Corrected));
            assert_eq!(band.kinds, kinds(&[BandKind::EndsWhite]));
            assert_eq!(band.pixels, off(&mended, &stray).0);
            let gap = band.gap.clone().unwrap();
            let edges: Vec<u32> =
                (band.first_row..band.end()).map(|row| clean.row(row)[missed[0]]).collect();
            let (low, high) = (edges.iter().min().unwrap(), edges.iter().max().unwrap());
            assert!(gap.start.abs_diff(*low) <= 1 && gap.end.abs_diff(*high + 1) <= 1);
            assert!(band.confidence > 0.9, "{band:?}");
        }
    }
}

#[test]
fn nearest_leaves_steps_where_spline_leaves_none() {
    let stray = drawn(bars, |row| if (100..110).contains(&row) { &[3] } else { &[] });
    let clean = whole(bars);
    let [(by_spline, _), (by_nearest, _)] =
        [spline(&stray).0, nearest(&stray).0].map(|mended| off(&mended, &clean));
    assert!(by_spline * 5 < by_nearest, "{by_spline} pixels off, {by_nearest} by nearest");
}

#[test]
fn a_band_where_a_contour_begins_is_mended_on_both_sides_of_it() {
    // The hole of the ring begins at row 190.3.
    for (rows, missed) in [(188..193, &[0][..]), (189..194, &[1]), (306..313, &[3])] {
        let stray = drawn(ring, |row| match ring(row.into()).len() {
            4 if rows.contains(&row) => missed,
            2 if rows.contains(&row) => &[0],
            _ => &[],
        });
        let (pixels, most) = off(&spline(&stray).0, &whole(ring));
        assert!(most <= 12 && pixels <= 24, "{rows:?}: {pixels} pixels off, {most} in a row");
    }
}

/// The layer, with what its slicer saw of its contours.
fn with_open_rows(mut layer: Layer, open_rows: &[u32]) -> Layer {
    layer.info.closed = Some(open_rows.is_empty());
    layer.info.open_rows = open_rows.to_vec();
    layer
}

/// The bars with a wall between them, or a stray line, in some rows.
fn barred(index: u32, rows: std::ops::Range<u32>) -> Layer {
    layer(index, drawn(bars, |row| if rows.contains(&row) { &[1, 2] } else { &[] }))
}

#[test]
fn two_crossings_missed_in_a_row_are_found_where_contours_break_off() {
    for rows in [150..151, 150..158] {
        let stray = with_open_rows(barred(0, rows.clone()), &[rows.start, rows.end]);
        let (layers, bands) = fixed(vec![stray], FixOptions::default());
        let Image::Mask(mended) = &*layers[0].image else { unreachable!() };
        assert!(off(mended, &whole(bars)).1 <= 1);
        let [band] = &bands[..] else { panic!("one band, not {bands:?}") };
        assert_eq!(
            (band.kinds, band.outcome),
            (kinds(&[BandKind::Paired]), BandOutcome::Corrected)
        );
        assert_eq!(band.first_row..band.end(), rows);
    }
}

#[test]
fn walls_stay_where_no_contour_breaks_off() {
    // All contours close; or they break off, but elsewhere, or on one side only.
    for open_rows in [&[][..], &[30, 40], &[100, 101], &[150, 300], &[149, 159]] {
        let wall = with_open_rows(barred(0, 150..158), open_rows);
        let (layers, bands) = fixed(vec![wall.clone()], FixOptions::default());
        assert_eq!((&layers[0], bands), (&wall, vec![]), "{open_rows:?}");
    }
}

#[test]
fn where_nothing_is_known_a_row_that_lacks_two_crossings_is_told_of_and_stays() {
    let alone = vec![barred(0, 150..151)];
    let (layers, bands) = fixed(alone.clone(), FixOptions::default());
    assert_eq!(layers, alone);
    assert_eq!(
        (bands[0].kinds, bands[0].outcome),
        (kinds(&[BandKind::Paired]), BandOutcome::Doubtful)
    );
    // Of several rows, or in another layer too, it is the part's own.
    for own in [vec![barred(0, 150..152)], (0..3).map(|k| barred(k, 150..151)).collect()] {
        assert_eq!(fixed(own.clone(), FixOptions::default()), (own, vec![]));
    }
}

#[test]
fn rows_of_two_gaps_beside_each_other_are_one_band() {
    let stray = drawn(ring, |row| match row {
        200..205 => &[0],
        // Both gaps at once: the row ends black.
        205..208 => &[0, 3],
        208..212 => &[3],
        _ => &[],
    });
    let (mended, bands) = spline(&stray);
    let all = kinds(&[BandKind::EndsWhite, BandKind::Paired]);
    assert_eq!(bands.len(), 1, "{bands:?}");
    assert_eq!((bands[0].first_row, bands[0].rows, bands[0].kinds), (200, 12, all));
    assert!(off(&mended, &whole(ring)).1 <= 1);

    let touching = drawn(ring, |row| match row {
        200..205 => &[0],
        205..209 => &[3],
        _ => &[],
    });
    let (mended, bands) = spline(&touching);
    assert_eq!(bands[0].kinds, kinds(&[BandKind::EndsWhite, BandKind::Touching]));
    assert!(off(&mended, &whole(ring)).1 <= 1);
}

#[test]
fn a_sliver_goes_only_if_contours_break_off_there_and_no_other_layer_has_it() {
    let clean = || whole(bars);
    let with_sliver = || {
        let mut mask = MaskBuilder::new(WIDTH);
        for (row, transitions) in (0..).zip(clean().rows()) {
            let sliver: &[u32] = if row == 250 { &[600, 700] } else { &[] };
            mask.push_row(&[transitions, sliver].concat()).unwrap();
        }
        mask.finish()
    };
    let of = |masks: Vec<Mask>| -> Vec<Layer> {
        masks.into_iter().zip(0..).map(|(mask, index)| layer(index, mask)).collect()
    };
    let sliver = kinds(&[BandKind::Sliver]);
    let mut broken = of(vec![clean(), with_sliver(), clean()]);
    broken[1] = with_open_rows(broken[1].clone(), &[250, 251]);
    let (layers, bands) = fixed(broken.clone(), FixOptions::default());
    assert_eq!(layers[1].image, clean().into());
    assert_eq!((bands[0].kinds, bands[0].outcome), (sliver, BandOutcome::Corrected));

    // No contour breaks off there.
    broken[1] = with_open_rows(broken[1].clone(), &[250, 300]);
    assert_eq!(fixed(broken.clone(), FixOptions::default()), (broken, vec![]));

    // Nothing is known of the contours.
    let unknown = of(vec![clean(), with_sliver(), clean()]);
    let (layers, bands) = fixed(unknown.clone(), FixOptions::default());
    assert_eq!(layers, unknown);
    assert_eq!((bands[0].kinds, bands[0].outcome), (sliver, BandOutcome::Doubtful));

    // Its neighbor above has more of it: the top of a bar that lies there.
    let top = of(vec![clean(), with_sliver(), with_sliver()]);
    assert_eq!(fixed(top.clone(), FixOptions::default()), (top, vec![]));
}

#[test]
fn a_band_at_the_edge_goes_on_from_its_good_side() {
    let mut mask = MaskBuilder::new(WIDTH);
    for row in 0..40 {
        let right = 300 + row;
        mask.push_row(&[100, right][..if row < 3 { 1 } else { 2 }]).unwrap();
    }
    let (mended, bands) = spline(&mask.finish());
    assert_eq!(bands[0].kinds, kinds(&[BandKind::EndsWhite, BandKind::AtEdge]));
    assert_eq!(bands[0].outcome, BandOutcome::Corrected);
    for row in 0..3 {
        assert_eq!(mended.row(row), [100, 300 + row]);
    }
}

#[test]
fn what_is_too_wide_is_left_and_its_gap_is_named() {
    let stray = drawn(bars, |row| if (100..116).contains(&row) { &[3] } else { &[] });
    let narrow = FixOptions { max_width: Some(15), ..FixOptions::default() };
    let (mended, bands) = fixed_mask(&stray, narrow);
    assert_eq!(mended, stray);
    assert_eq!((bands[0].outcome, bands[0].rows), (BandOutcome::TooWide, 16));
    let gap = bands[0].gap.clone().unwrap();
    assert!(gap.start.abs_diff(397) <= 1 && gap.end.abs_diff(404) <= 1, "{gap:?}");
    for max_width in [Some(16), None] {
        let wider = FixOptions { max_width, ..FixOptions::default() };
        assert!(off(&fixed_mask(&stray, wider).0, &whole(bars)).1 <= 1);
    }
}

/// A body whose right side is missed over many rows, in which fins and a slot begin and end.
fn finned(row: f64) -> Vec<f64> {
    let mut columns = vec![100.0, 300.0 + 0.2 * row];
    for (rows, fin) in
        [(160..201, [40.0, 70.0]), (215..218, [420.0, 500.0]), (240..241, [600.0, 700.0])]
    {
        if rows.contains(&(row as u32)) {
            columns.extend(fin);
        }
    }
    if (250..262).contains(&(row as u32)) {
        columns.extend([150.0, 220.0]);
    }
    columns.sort_by(f64::total_cmp);
    columns
}

#[test]
fn a_band_of_any_width_is_corrected_and_what_lies_in_it_stays() {
    for rows in [120..130, 130..270, 155..300, 210..222] {
        let mut stray = MaskBuilder::new(WIDTH);
        for row in 0..HEIGHT {
            let side = 300.0 + 0.2 * f64::from(row);
            let is_missed = |&column: &f64| rows.contains(&row) && column == side;
            let columns = finned(row.into()).into_iter().filter(|column| !is_missed(column));
            stray.push_row(&columns.map(|c| c.ceil() as u32).collect::<Vec<_>>()).unwrap();
        }
        let stray = with_open_rows(layer(0, stray.finish()), &[rows.start, rows.end]);
        let (layers, bands) = fixed(vec![stray], FixOptions::default());
        let [band] = &bands[..] else { panic!("one band, not {bands:?}") };
        assert_eq!((band.outcome, band.first_row..band.end()), (BandOutcome::Corrected, rows));
        let Image::Mask(mended) = &*layers[0].image else { unreachable!() };
        assert!(off(mended, &whole(finned)).1 <= 1, "{band:?}");
    }
}

/// A fin whose tip is missed looks in its own layer like a wall without it.
#[test]
fn layers_further_off_show_what_the_nearest_lack() {
    let fin: ShapeCrossings =
        |row| vec![100.0, if (200.0..230.0).contains(&row) { 420.0 } else { 300.0 }];
    let stray = || drawn(fin, |row| if (200..230).contains(&row) { &[1] } else { &[] });
    let layers = |damaged: std::ops::Range<u32>| -> Vec<Layer> {
        let drawn = |k| layer(k, if damaged.contains(&k) { stray() } else { whole(fin) });
        (0..9).map(drawn).collect()
    };
    for damaged in [4..5, 3..6, 1..6] {
        for layer in fixed(layers(damaged), FixOptions::default()).0 {
            let Image::Mask(mended) = &*layer.image else { unreachable!() };
            assert_eq!(off(mended, &whole(fin)).0, 0);
        }
    }
}

#[test]
fn an_image_without_a_good_row_is_left() {
    let stray = drawn(|_| vec![100.0, 200.0], |_| &[1]);
    for (mended, bands) in [spline(&stray), nearest(&stray)] {
        let [band] = &bands[..] else { panic!("one band, not {bands:?}") };
        assert_eq!((band.outcome, band.confidence), (BandOutcome::Doubtful, 0.0));
        assert_eq!(mended, stray);
    }
}

#[test]
fn neighbours_hold_a_wide_band_between_them() {
    // In the band the bar has a notch that no good row shows, but the layers do.
    let notched: ShapeCrossings = |row| {
        let dent = (12.0 - (row - 250.0).abs()).max(0.0);
        vec![100.0, 300.0 - dent]
    };
    let stray = drawn(notched, |row| if (244..257).contains(&row) { &[1] } else { &[] });
    let layers = vec![layer(0, whole(notched)), layer(1, stray.clone()), layer(2, whole(notched))];
    for use_neighbours in [true, false] {
        let options = FixOptions { use_neighbours, ..FixOptions::default() };
        let Image::Mask(mended) = &*fixed(layers.clone(), options).0[1].image else {
            unreachable!()
        };
        assert_eq!(off(mended, &whole(notched)).0, 0);
    }
    assert!(off(&spline(&stray).0, &whole(notched)).0 > 0);
}

#[test]
fn rows_that_the_page_lists_are_looked_at_and_crossed_off() {
    let mut listed = layer(3, drawn(bars, |row| if row == 150 { &[3] } else { &[] }));
    // The second of the rows is good, the third does not exist.
    listed.info.stray_rows = vec![150, 300, 9000];
    let (layers, bands) = fixed(vec![listed], FixOptions::default());
    assert_eq!(bands[0].kinds, kinds(&[BandKind::EndsWhite, BandKind::Unbalanced]));
    assert_eq!((bands[1].kinds, bands[1].pixels), (kinds(&[BandKind::Unbalanced]), 0));
    let info = &layers[0].info;
    assert_eq!(info.stray_rows, [9000]);
    assert_eq!(info.other["fix"]["method"], "spline");
    assert_eq!(info.other["fix"]["bands"][0]["row"], 150);
}

/// The bars in gray: levels rise over four pixels at their left edges, fall over
/// three at their right ones.
fn gray_bars(miss: impl Fn(u32) -> &'static [usize]) -> GrayMask {
    let mut gray = GrayMask::new(WIDTH);
    for row in 0..HEIGHT {
        let mut crossings: Vec<u32> =
            bars(row.into()).into_iter().map(|c| c.ceil() as u32).collect();
        let missed = miss(row);
        let mut changes: Vec<LevelChange> = Vec::new();
        let mut white = false;
        for (which, column) in crossings.drain(..).enumerate() {
            if missed.contains(&which) {
                continue;
            }
            let mut push = |column, level| changes.push(LevelChange { column, level });
            if white {
                (0..3).for_each(|i| push(column - 3 + i, 200 - 60 * i as u8));
                push(column, 0);
            } else {
                (0..4).for_each(|i| push(column + i, 50 * (i as u8 + 1)));
                push(column + 4, 255);
            }
            white = !white;
        }
        gray.push_row(&changes).unwrap();
    }
    gray
}

#[test]
fn gray_rows_take_the_levels_of_the_good_rows_along_new_edges() {
    for missed in [&[0][..], &[1], &[2], &[3]] {
        let rows = 140..146;
        let stray = gray_bars(|row| if rows.contains(&row) { missed } else { &[] });
        let image = Image::Gray(stray);
        let stray = Layer { info: PageInfo::default(), pitch: None, image: image.into() };
        let (layers, bands) = fixed(vec![stray], FixOptions::default());
        assert_eq!((bands.len(), bands[0].outcome), (1, BandOutcome::Corrected));
        let Image::Gray(mended) = &*layers[0].image else { panic!("gray stays gray") };
        let clean = gray_bars(|_| &[]);
        for row in rows.clone() {
            // Of the leaning bar an edge may be a pixel off.
            let shift =
                |column: u32, other: u32| column.abs_diff(other) <= u32::from(missed[0] > 1);
            let same = mended.row(row).len() == clean.row(row).len()
                && mended
                    .row(row)
                    .iter()
                    .zip(clean.row(row))
                    .all(|(a, b)| a.level == b.level && shift(a.column, b.column));
            assert!(same, "{missed:?}: {:?} for {:?}", mended.row(row), clean.row(row));
        }
        assert!(
            (0..HEIGHT)
                .filter(|row| !rows.contains(row))
                .all(|row| mended.row(row) == clean.row(row))
        );
    }
}

/// Layers of twelve rows: most have rows in pairs of columns, and say that their contours close.
fn arbitrary_layers() -> impl Strategy<Value = Vec<Layer>> {
    let rows = prop::collection::vec(prop::collection::btree_set(0u32..60, 0..5), 12);
    let open_rows = prop::collection::vec(0u32..12, 0..3);
    let kind = (0u8..8, 0u8..4, open_rows);
    let layers = prop::collection::vec((rows, kind), 1..9);
    layers.prop_map(|layers| {
        let drawn = (0..).zip(layers).map(|(index, (rows, (stray, closed, open_rows)))| {
            let mut mask = MaskBuilder::new(60);
            for row in rows {
                let mut row: Vec<_> = row.into_iter().collect();
                row.truncate(if stray == 0 { row.len() } else { row.len() / 2 * 2 });
                mask.push_row(&row).unwrap();
            }
            let mut layer = layer(index, mask.finish());
            layer.info.closed = [None, Some(false), Some(true), Some(true)][usize::from(closed)];
            if closed == 1 {
                layer.info.open_rows = open_rows;
                layer.info.open_rows.sort_unstable();
            }
            if stray == 1 {
                layer.info.stray_rows = vec![5];
            }
            layer
        });
        drawn.collect()
    })
}

/// Reads layers as pages that may pass.
fn passing(layers: &[Layer]) -> Vec<PassingLayer> {
    let mut pages = PageWriter::new(Vec::new(), Format::Big);
    layers.iter().for_each(|layer| pages.push(EncodedPage::new(layer)).unwrap());
    let pages = Pages::from_stream(Cursor::new(pages.finish().unwrap())).unwrap();
    pages.map(|page| PassingLayer::of_page(page.unwrap(), "").unwrap()).collect()
}

proptest! {
    #[test]
    fn layers_that_pass_are_corrected_as_decoded_ones(
        layers in arbitrary_layers(), use_neighbours: bool,
    ) {
        let options = FixOptions { use_neighbours, min_confidence: 0.0, ..FixOptions::default() };
        let (expected, bands) = fixed(layers.clone(), options);
        let (passed, found) = fixed(passing(&layers), options);
        prop_assert_eq!(passed, expected);
        prop_assert_eq!(found, bands);
    }

    #[test]
    fn whatever_the_image_good_rows_stay_and_corrected_ones_end_black(
        rows in prop::collection::vec(prop::collection::btree_set(0u32..60, 0..9), 0..20),
        min_confidence in 0.0..1.0,
        by_nearest: bool,
    ) {
        let mut mask = MaskBuilder::new(60);
        for row in &rows {
            mask.push_row(&row.iter().copied().collect::<Vec<_>>()).unwrap();
        }
        let mask = mask.finish();
        let method = if by_nearest { FixMethod::Nearest } else { FixMethod::Spline };
        let (mended, bands) = fixed_mask(&mask, FixOptions { method, min_confidence, ..FixOptions::default() });
        let band_of = |row| bands.iter().find(|band| (band.first_row..band.end()).contains(&row));
        let mut changed = 0;
        for row in 0..mask.height() {
            let pixels = white_in_row(&difference(mask.row(row), mended.row(row)), 60);
            match band_of(row) {
                Some(band) if band.outcome == BandOutcome::Corrected => {
                    changed += pixels;
                    prop_assert!(mended.row(row).len().is_multiple_of(2) || by_nearest);
                }
                Some(_) => prop_assert_eq!(pixels, 0),
                None => prop_assert!(pixels == 0 && mask.row(row).len().is_multiple_of(2)),
            }
        }
        let corrected = bands.iter().filter(|band| band.outcome == BandOutcome::Corrected);
        prop_assert_eq!(changed, corrected.map(|band| band.pixels).sum::<u64>());
        prop_assert!(bands.iter().all(|band| (0.0..=1.0).contains(&band.confidence)));
    }

    #[test]
    fn smooth_shapes_pass_unchanged_though_nothing_is_known_of_them(
        discs in prop::collection::vec((20.0..80.0f64, 100.0..400.0f64, 0.3..3.0f64), 1..5),
    ) {
        let mut mask = MaskBuilder::new(WIDTH);
        for row in 0..HEIGHT {
            let mut crossings = Vec::new();
            for (i, (radius, centre, stretch)) in discs.iter().enumerate() {
                let half = (radius * radius - (f64::from(row) - centre).powi(2)).sqrt();
                let middle = 80.0 + 160.0 * i as f64;
                let half = (half * stretch).min(79.0_f64);
                let run = [middle - half, middle + half].map(|column| column.ceil() as u32);
                if !half.is_nan() && run[0] < run[1] {
                    crossings.extend(run);
                }
            }
            mask.push_row(&crossings).unwrap();
        }
        let mask = mask.finish();
        prop_assert_eq!(spline(&mask), (mask.clone(), vec![]));
    }
}
