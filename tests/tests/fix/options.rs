//! Threads, ranges of layers, limits and wrong values.

use lamp_stack::{Image, Layer, MaskBuilder, PageInfo};
use lamp_tests::Scratch;

use super::{COARSE, bands, broken_ball, is_corrected, number, pixels_off, report};

#[test]
fn threads_do_not_change_a_byte() {
    let (scratch, _) = broken_ball(20, 1, COARSE);
    let run = |threads: u32| {
        let folder = format!("pictures_{threads}");
        let options = format!("--use-neighbors --threads {threads} --evidence {folder}");
        let (_, ran) = report(&scratch, &options);
        let mut pictures: Vec<_> = std::fs::read_dir(scratch.path(&folder))
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .map(|path| (path.file_name().unwrap().to_owned(), std::fs::read(path).unwrap()))
            .collect();
        pictures.sort();
        (ran.succeeds().stderr, scratch.bytes("fixed.tif"), scratch.bytes("fix.json"), pictures)
    };
    let alone = run(1);
    assert!(alone == run(4));
    assert!(!alone.3.is_empty());
}

/// Where no vote of other layers is needed: a dropped facet shows in its rows.
#[test]
fn a_range_of_layers_is_corrected_as_in_the_whole() {
    let (scratch, _) = broken_ball(12, 2, COARSE);
    scratch.run("fix stray.tif -o fixed.tif").succeeds();
    let whole = scratch.layers("fixed.tif");
    // The record of the whole stack is on another page.
    let pages = |layers: &[Layer]| -> Vec<Layer> {
        let mut layers = layers.to_vec();
        layers.iter_mut().for_each(|layer| layer.info.stack = None);
        layers
    };
    for range in [0..60, 0..50, 13..31, 40..41] {
        let (start, end) = (range.start, range.end);
        scratch.run(&format!("fix stray.tif --layers {start}..{end} -o part.tif")).succeeds();
        // The first and the last layers of a range lack some of their neighbors.
        let inner = |layers: &[Layer]| {
            let known = if start == 0 { 0 } else { 32 }..layers.len().saturating_sub(32);
            pages(layers.get(known).unwrap_or_default())
        };
        assert!(inner(&scratch.layers("part.tif")) == inner(&whole[start..end]), "{range:?}");
    }
}

#[test]
fn wider_bands_are_corrected_if_that_is_allowed() {
    let (scratch, _) = broken_ball(5, 1, COARSE);
    let widest = |limit: u32| {
        let (report, ran) = report(&scratch, &format!("--max-width {limit}"));
        ran.succeeds();
        let rows =
            |band: &serde_json::Value| number(&band["last_row"]) - number(&band["first_row"]) + 1;
        let (corrected, left): (Vec<_>, Vec<_>) =
            bands(&report).iter().partition(|band| is_corrected(band));
        assert!(corrected.iter().all(|band| rows(band) <= limit));
        assert!(left.iter().all(|band| rows(band) > limit));
        corrected.len()
    };
    let corrected = [0, 1, 6, 60].map(widest);
    assert!(corrected.is_sorted_by(|a, b| a < b) && corrected[0] == 0, "{corrected:?}");
}

#[test]
fn what_is_sure_enough_is_up_to_the_user() {
    let (scratch, _) = broken_ball(25, 1, COARSE);
    let at = |limit: &str| {
        let (report, _) = report(&scratch, &format!("--max-width 60 --min-confidence {limit}"));
        let limit: f64 = limit.parse().unwrap();
        for band in bands(&report) {
            let confidence = band["confidence"].as_f64().unwrap();
            assert_eq!(is_corrected(band), confidence >= limit, "{band}");
        }
        number(&report["bands_corrected"])
    };
    let (all, some, none) = (at("0"), at("0.9"), at("1"));
    assert!(none < some && some < all, "{none} {some} {all}");
}

/// A notch that no good row shows, though the neighboring layers do.
#[test]
fn neighbours_show_what_a_wide_band_hides() {
    let notched = |is_missed: bool| {
        let mut mask = MaskBuilder::new(200);
        for row in 0..90_u32 {
            let right = 150 - 12_u32.saturating_sub(row.abs_diff(45));
            let kept = if is_missed && row.abs_diff(45) < 7 { 1 } else { 2 };
            mask.push_row(&[40, right][..kept]).unwrap();
        }
        Image::Mask(mask.finish())
    };
    let scratch = Scratch::new();
    let layer = |index: u32, is_missed| {
        let info = PageInfo { index, ..PageInfo::default() };
        Layer { info, pitch: None, image: notched(is_missed).into() }
    };
    scratch.stack("whole.tif", (0..3).map(|index| layer(index, false)));
    scratch.stack("stray.tif", (0..3).map(|index| layer(index, index == 1)));
    let off = |options: &str| {
        report(&scratch, options).1.succeeds();
        pixels_off(&scratch.layers("whole.tif"), &scratch.layers("fixed.tif"))
    };
    assert_eq!([off(""), off("--use-neighbours")], [0, 0]);
    let stray = pixels_off(&scratch.layers("whole.tif"), &scratch.layers("stray.tif"));
    // Alone, the layer does not show its notch.
    scratch.stack("whole.tif", [layer(1, false)]);
    scratch.stack("stray.tif", [layer(1, true)]);
    assert!((1..stray / 5).contains(&off("")));
}

#[test]
fn wrong_values_are_refused_with_a_sentence() {
    let (scratch, _) = broken_ball(0, 1, COARSE);
    let names = scratch.names();
    for (options, words) in [
        ("--min-confidence 1.5", "`1.5` is not a share: write a number from 0 to 1"),
        ("--min-confidence NaN", "`NaN` is not a share: write a number from 0 to 1"),
        ("--min-confidence much", "`much` is not a share: write a number from 0 to 1"),
        ("--min-confidence=-0.1", "`-0.1` is not a share: write a number from 0 to 1"),
        ("--max-width 2.5", "invalid value '2.5' for '--max-width <ROWS>'"),
        ("--max-width=-1", "invalid value '-1' for '--max-width <ROWS>'"),
        ("--max-width 99999999999", "invalid value '99999999999' for '--max-width <ROWS>'"),
        ("--method best", "[possible values: nearest, spline]"),
    ] {
        let ran = scratch.run(&format!("fix stray.tif {options} -o fixed.tif"));
        assert_eq!(ran.statuses, [Some(2)], "{options}");
        assert!(ran.stderr.contains(words), "{ran:?}");
    }
    assert_eq!(scratch.names(), names);
}
