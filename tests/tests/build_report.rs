//! Checks `tile --report` and `tile --time` against the pixels of the pages.

use lamp_stack::{Image, Layer, Mask, PageInfo, Pitch};
use lamp_tests::{Scratch, write_gray_ramp};
use serde_json::{Value, json};

fn json_of(scratch: &Scratch, name: &str) -> Value {
    serde_json::from_slice(&scratch.bytes(name)).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn is_near(value: &Value, expected: f64) -> bool {
    (number(value) - expected).abs() <= 1e-9 * expected.abs() + 2e-6
}

/// Counts, pixel by pixel, what is not black.
fn exposed(layer: &Layer) -> u64 {
    let image = layer.image.clone().into_image();
    let runs = (0..image.height()).flat_map(|row| image.runs(row));
    runs.map(|(start, end, level)| (start..end).filter(|_| level > 0).count() as u64).sum()
}

#[test]
fn pixels_and_volumes_are_those_of_the_pages() {
    let scratch = Scratch::with_tower_and_torus();
    write_gray_ramp(&scratch.path("gray.tif"), 300, 200);
    for options in [
        "tower.tif:3 torus.tif:2 --area 120x150mm --pack outline",
        "tower.tif:2 --area 120x110mm --moat layer --base-layers 2",
        "tower.tif:2 --area 120x110mm --moat outline --least-piece 0",
        "tower.tif torus.tif --area 120x110mm --mesh none",
        "tower.tif:2 --area 120x110mm --layers 20..40",
        "gray.tif:2 --area 190x70mm --cell 4mm",
    ] {
        let line = format!("tile {options} --report r.json -o build.tif");
        scratch.run(&line).succeeds_quietly();
        let report = json_of(&scratch, "r.json");
        scratch.run(&format!("tile {options} -o none.tif")).succeeds_quietly();
        assert!(scratch.bytes("none.tif") == scratch.bytes("build.tif"), "{options}");

        let layers = scratch.layers("build.tif");
        let by_layer = report["by_layer"].as_array().unwrap();
        assert_eq!(by_layer.len(), layers.len(), "{options}");
        let (mut exposed_px, mut mesh_px) = (0, 0);
        for (told, layer) in by_layer.iter().zip(&layers) {
            assert_eq!(told["exposed_px"], json!(exposed(layer)), "{options}: {told}");
            assert_eq!(told["layer"], json!(layer.info.index));
            assert_eq!(told["z_um"], json!(layer.info.z_um));
            exposed_px += told["exposed_px"].as_u64().unwrap();
            mesh_px += told["mesh_px"].as_u64().unwrap();
        }
        assert_eq!(report["all"]["exposed_px"], json!(exposed_px));
        assert_eq!(report["mesh"]["exposed_px"], json!(mesh_px));
        let copies = report["copies"].as_array().unwrap();
        let of_copies: u64 = copies.iter().map(|copy| copy["exposed_px"].as_u64().unwrap()).sum();
        assert_eq!(of_copies + mesh_px, exposed_px, "{options}");

        let info = scratch.run("lamp info build.tif --json").succeeds_quietly().stdout;
        let info: Value = serde_json::from_slice(&info).unwrap();
        assert_eq!(info["exposed_px"], report["all"]["exposed_px"]);
        if let Some(volume) = info["volume_mm3"].as_f64() {
            assert!(is_near(&report["all"]["volume_mm3"], volume), "{options}");
        }

        // The same without the images of the layers.
        for alone in ["--recipe recipe.json", "--time"] {
            scratch.run(&format!("tile {options} --report alone.json {alone}")).succeeds();
            assert!(scratch.bytes("alone.json") == scratch.bytes("r.json"), "{options} {alone}");
        }
    }
}

/// Writes 50 layers of 100 um of a white rectangle of 40 x 30 mm, with a black margin of 1 mm.
fn cuboid(scratch: &Scratch, exposure_ms: Option<f64>) {
    let ends = (0..=32_u32).map(|row| 2 * row.saturating_sub(1).min(30)).collect();
    let image = Mask::new(42, ends, [1, 41].repeat(30)).unwrap();
    let layer = |index: u32| Layer {
        info: PageInfo {
            index,
            z_um: Some(f64::from(index) * 100.0),
            thickness_um: Some(100.0),
            exposure_ms,
            ..PageInfo::default()
        },
        pitch: Pitch::of_dpi(25.4),
        image: Image::Mask(image.clone()).into(),
    };
    scratch.stack("box.tif", (0..50).map(layer));
}

const MACHINE: &str = r#"name = "mine"
description = "A machine of mine"
[area]
value = "100x80mm"
source = "data sheet"
[strips]
mirrors = 40
overlap = 10
source = "data sheet"
[times]
recoat_s = 8
swath_speed_mm_per_s = 20
swath_step_s = 0.5
source = "measured"
"#;

#[test]
fn a_cuboid_has_its_volume_and_each_copy_its_serial_number() {
    let scratch = Scratch::new();
    cuboid(&scratch, Some(200.0));
    let layout = r#"{"copies": [
        {"part": "box.tif", "x_mm": 2, "y_mm": 3, "serial": "A-1018"},
        {"part": "box.tif", "x_mm": 50, "y_mm": 3, "turn": 90}
    ]}"#;
    scratch.write("layout.json", layout.as_bytes());
    scratch.write("mine.toml", MACHINE.as_bytes());
    let line = "tile box.tif --machine mine.toml --mesh none --layout layout.json";
    let beside = "--layout-out again.json --report r.json -o b.tif";
    scratch.run(&format!("{line} {beside}")).succeeds_quietly();
    let report = json_of(&scratch, "r.json");
    assert_eq!(report["schema"], "lamp-build-report-2");
    let copies = &report["copies"];
    for copy in [&copies[0], &copies[1]] {
        // 40 x 30 x 5 mm.
        assert!(is_near(&copy["volume_mm3"], 6000.0), "{copy}");
        assert!(is_near(&copy["area_mm2"], 60_000.0), "{copy}");
    }
    assert!(is_near(&report["all"]["volume_mm3"], 12_000.0));
    assert_eq!((&copies[0]["serial"], &copies[1]["serial"]), (&json!("A-1018"), &Value::Null));
    assert_eq!((&copies[1]["x_mm"], &copies[1]["turn"]), (&json!(50.0), &json!(90)));
    assert_eq!((&copies[1]["number"], &copies[1]["part"]), (&json!(2), &json!("box.tif")));
    let again = json_of(&scratch, "again.json");
    assert_eq!(again["copies"][0]["serial"], "A-1018");
    assert_eq!(again["copies"][1].get("serial"), None);

    // Swaths begin at columns 0, 30, 60: three of 80 mm at 20 mm/s, two steps, 50 layers.
    assert_eq!((&report["swaths"], &report["black_swaths"]), (&json!(150), &json!(0)));
    assert!(is_near(&report["swaths_s"], 50.0 * (3.0 * 4.0 + 2.0 * 0.5)), "{report}");
    assert!(is_near(&report["recoating_s"], 400.0) && is_near(&report["build_s"], 1050.0));
    assert!(is_near(&report["build_exposure_s"], 10.0));
    // `lamp report` says the same of the build.
    let told = scratch.run("lamp report b.tif --machine mine.toml --json").succeeds_quietly();
    let told: Value = serde_json::from_slice(&told.stdout).unwrap();
    for key in ["swaths_s", "recoating_s", "build_s", "build_exposure_s"] {
        assert!(is_near(&told["stacks"][0][key], number(&report[key])), "{key}");
    }
}

#[test]
fn the_time_is_told_in_words_with_what_is_missing() {
    let scratch = Scratch::new();
    cuboid(&scratch, None);
    scratch.write("mine.toml", MACHINE.as_bytes());
    let told = |line: &str| String::from_utf8(scratch.run(line).succeeds_quietly().stdout).unwrap();
    let line = "tile box.tif --mesh none --area 100x80mm";
    let text = told(&format!("{line} --machine mine.toml --time"));
    let expected = "build time: 17.5min, 50 layers\n\
                    swaths:     10.8min, 150 in all\n\
                    recoating:  6.67min\n";
    assert_eq!(text, expected);
    let text = told(&format!("{line} --time"));
    assert!(text.starts_with("build time: not known, 50 layers\n"), "{text}");
    for words in ["--expose", "expose_s", "--recoat", "recoat_s", "lamp machine show beta"] {
        assert!(text.contains(words), "{text}");
    }
    let text = told(&format!("{line} --time --recoat 9s"));
    assert!(
        text.starts_with("build time: at least 7.50min, 50 layers\nrecoating:  7.50min\n"),
        "{text}"
    );
    let text = told(&format!("{line} --time --recoat 9s --expose 1.5s"));
    assert_eq!(text, "build time: 8.75min, 50 layers\nexposure:   75.0s\nrecoating:  7.50min\n");
    scratch.run(&format!("{line} --recoat 9s -o b.tif")).is_wrong_usage(&["--recoat", "--time"]);
    // The page and its numbers take the same options.
    let told = told("lamp report box.tif --recoat 9s --expose 1.5s --json");
    let told: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(
        (&told["stacks"][0]["build_s"], &told["stacks"][0]["least_s"]),
        (&json!(525.0), &json!(525.0))
    );
    assert_eq!(scratch.names(), ["box.tif", "mine.toml"]);
    // Standard output is the build's.
    let line = format!("{line} --machine mine.toml");
    scratch.run(&format!("{line} -o build.tif")).succeeds_quietly();
    let ran = scratch.run(&format!("{line} --time -o -")).succeeds();
    assert!(ran.stdout == scratch.bytes("build.tif"));
    assert!(ran.stderr.contains("build time: 17.5min"), "{}", ran.stderr);
}

#[test]
fn layouts_and_reports_that_cannot_be_meant_are_refused() {
    let scratch = Scratch::new();
    cuboid(&scratch, None);
    for (serial, words) in [
        ("A", ["copies[1].serial", "copies[0] is \"A\", too"]),
        (" ", ["copies[1].serial", "empty"]),
    ] {
        let copy = |x_mm: f64, serial: &str| json!({"part": "box.tif", "x_mm": x_mm, "y_mm": 1, "serial": serial});
        let layout = json!({"copies": [copy(1.0, "A"), copy(50.0, serial)]});
        scratch.write("layout.json", layout.to_string().as_bytes());
        scratch.run("tile box.tif --layout layout.json -o b.tif").is_refused_with(&words);
    }
    for (line, words) in [
        ("tile box.tif --report box.tif -o b.tif", "box.tif: no stack is written there"),
        ("tile box.tif --report b.tif -o b.tif", "no stack is written there"),
        ("tile box.tif --report r.json --layout-out r.json -o b.tif", "r.json"),
        ("tile box.tif --report r.json --recipe r.json", "r.json"),
    ] {
        scratch.run(line).is_wrong_usage(&[words]);
    }
}
