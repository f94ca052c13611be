//! `--report`: agrees with the changes in the stacks.

use std::collections::BTreeSet;

use lamp_stack::Layer;
use lamp_tests::{differing, ends_white, mask};
use serde_json::{Value, json};

use super::{COARSE, bands, broken_ball, is_corrected, layer_of, number, report};

const PITCH: f64 = 25.4 / 300.0;

fn is_near(value: &Value, expected: f64) -> bool {
    (value.as_f64().expect("a number") - expected).abs() < 2e-6
}

/// The layers and rows in which two stacks differ.
fn changed_rows(a: &[Layer], b: &[Layer]) -> BTreeSet<(u32, u32)> {
    let rows = |(a, b): (&Layer, &Layer)| -> Vec<(u32, u32)> {
        let changed = |row: &u32| !differing(&a.image, &b.image, *row).is_empty();
        (0..a.image.height()).filter(changed).map(|row| (a.info.index, row)).collect()
    };
    a.iter().zip(b).flat_map(rows).collect()
}

#[test]
fn bands_are_where_the_stacks_differ_to_the_pixel() {
    for (seed, options) in
        [(1, ""), (2, "--max-width 4"), (3, "--method nearest"), (4, "--use-neighbors")]
    {
        let (scratch, _) = broken_ball(5, seed, COARSE);
        let (report, ran) = report(&scratch, options);
        ran.succeeds();
        let (stray, fixed) = (scratch.layers("stray.tif"), scratch.layers("fixed.tif"));
        let mut rows = BTreeSet::new();
        let (mut corrected, mut left, mut pixels) = (0, 0, 0);
        for band in bands(&report) {
            let (before, after) = (layer_of(&stray, band), layer_of(&fixed, band));
            let band_rows = number(&band["first_row"])..=number(&band["last_row"]);
            let columns: Vec<Vec<u32>> =
                band_rows.clone().map(|row| differing(&before.image, &after.image, row)).collect();
            let changed = || columns.iter().flatten();
            if is_corrected(band) {
                corrected += 1;
                pixels += changed().count();
                rows.extend(band_rows.map(|row| (before.info.index, row)));
                assert_eq!(band["pixels"], changed().count());
                assert_eq!(band["columns"], json!([changed().min(), changed().max()]));
            } else {
                left += 1;
                assert_eq!(changed().next(), None, "{band}");
            }
        }
        assert_eq!(rows, changed_rows(&stray, &fixed), "seed {seed} {options}");
        assert!(corrected > 0 && (left > 0 || !options.contains("max-width")));
        assert_eq!(
            [&report["layers"], &report["bands_corrected"], &report["bands_left"]],
            [stray.len(), corrected, left]
        );
        assert_eq!(report["pixels_changed"], pixels);
    }
}

#[test]
fn millimetres_are_those_of_the_page() {
    let (scratch, _) = broken_ball(5, 1, COARSE);
    let (report, _) = report(&scratch, "--max-width 4");
    let stray = scratch.layers("stray.tif");
    assert!(bands(&report).iter().any(is_corrected) && !bands(&report).iter().all(is_corrected));
    for band in bands(&report) {
        let info = &layer_of(&stray, band).info;
        let [left, top] = info.origin_mm.unwrap();
        assert!(is_near(&band["z_mm"], info.z_um.unwrap() / 1000.0));
        let y = |row: u32| top - f64::from(row) * PITCH;
        assert!(is_near(&band["y_mm"][0], y(number(&band["last_row"]) + 1)), "{band}");
        assert!(is_near(&band["y_mm"][1], y(number(&band["first_row"]))), "{band}");
        for (columns, x_mm) in [("columns", "x_mm"), ("gap_columns", "gap_x_mm")] {
            let x = |column: u32| left + f64::from(column) * PITCH;
            let [first, last] = [0, 1].map(|side| number(&band[columns][side]));
            assert!(is_near(&band[x_mm][0], x(first)), "{band}");
            assert!(is_near(&band[x_mm][1], x(last + 1)), "{band}");
        }
    }
}

#[test]
fn kinds_outcomes_and_limits_are_named() {
    let kinds = ["ends white", "unbalanced", "paired", "sliver", "at edge", "touching"];
    let (scratch, _) = broken_ball(25, 1, COARSE);
    let options = "--max-width 9 --min-confidence 0.95 --method nearest --use-neighbors";
    let (limited, _) = report(&scratch, options);
    let head = |report: &Value| {
        ["method", "max_width", "min_confidence", "use_neighbors"].map(|key| report[key].clone())
    };
    assert_eq!(head(&limited), [json!("nearest"), json!(9), json!(0.95), json!(true)]);
    let stray = scratch.layers("stray.tif");
    let mut outcomes = BTreeSet::new();
    for band in bands(&limited) {
        let of_band: Vec<&str> =
            band["kinds"].as_array().unwrap().iter().map(|kind| kind.as_str().unwrap()).collect();
        assert!(!of_band.is_empty() && of_band.iter().all(|kind| kinds.contains(kind)), "{band}");
        let image = mask(layer_of(&stray, band));
        let (first, last) = (number(&band["first_row"]), number(&band["last_row"]));
        let ends_white = (first..=last).any(|row| image.row(row).len() % 2 == 1);
        assert_eq!(of_band.contains(&"ends white"), ends_white, "{band}");
        let confidence = band["confidence"].as_f64().unwrap();
        let expected = match (last - first + 1 > 9, confidence < 0.95) {
            (true, _) => "left: too wide",
            (false, true) => "left: doubtful",
            (false, false) => "corrected",
        };
        assert_eq!(band["outcome"], expected, "{band}");
        assert_eq!(band["method"], "nearest");
        outcomes.insert(expected);
    }
    assert_eq!(outcomes.len(), 3, "each outcome is met");
    let (by_default, _) = report(&scratch, "");
    assert_eq!(head(&by_default), [json!("spline"), Value::Null, json!(0.35), json!(false)]);
}

#[test]
fn a_clean_stack_has_an_empty_report_and_no_pictures() {
    let (scratch, _) = broken_ball(0, 1, COARSE);
    let (report, ran) = report(&scratch, "--evidence pictures --strict");
    ran.succeeds_quietly();
    assert_eq!(report["bands"], json!([]));
    for key in ["bands_corrected", "bands_left", "pixels_changed"] {
        assert_eq!(report[key], 0, "{key}");
    }
    let layers = scratch.layers("stray.tif");
    assert_eq!(report["layers"], layers.len());
    assert!(!layers.iter().any(|layer| ends_white(mask(layer))));
    assert_eq!(scratch.names_in("pictures").len(), 0);
}

#[test]
fn a_report_needs_a_file_of_its_own() {
    let (scratch, _) = broken_ball(1, 1, COARSE);
    let names = scratch.names();
    for (options, words) in [
        ("--report -", "name a file"),
        ("-o a.tif --report a.tif", "the stack is written there"),
        ("-o a.tif --report ./a.tif", "the stack is written there"),
        ("-o a.tif --report stray.tif", "that is an input"),
    ] {
        let ran = scratch.run(&format!("fix stray.tif {options}"));
        assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
        assert!(ran.stderr.contains(words) && ran.stdout.is_empty(), "{ran:?}");
    }
    assert_eq!(scratch.names(), names);
}

#[test]
fn a_run_that_fails_writes_no_report() {
    let scratch = broken_ball(2, 1, COARSE).0;
    let bytes = scratch.bytes("stray.tif");
    scratch.write("cut.tif", &bytes[..bytes.len() - 500]);
    let names = scratch.names();
    let ran = scratch.run("fix cut.tif --quiet --report fix.json -o fixed.tif");
    ran.is_refused_with(&["cut.tif", "cut off"]);
    assert_eq!(scratch.names(), names);
}
