//! `lamp plan column-cure` as its users run it.

use lamp_stack::{Image, write_gray_png};
use lamp_tests::Scratch;
use serde_json::Value;

const LENSES: &str =
    "lamp plan column-cure lens-array --projector zhao --material pegda-mw700 -o plan";

fn report(scratch: &Scratch, folder: &str) -> Value {
    serde_json::from_slice(&scratch.bytes(&format!("{folder}/report.json"))).unwrap()
}

#[test]
fn one_command_plans_a_lens_array() {
    let scratch = Scratch::new();
    scratch.run(LENSES).succeeds();
    for file in
        ["bitmaps.tif", "report.json", "section.svg", "section.csv", "residual.png", "times.png"]
    {
        assert!(!scratch.bytes(&format!("plan/{file}")).is_empty(), "{file}");
    }
    let report = report(&scratch, "plan");
    let measures = &report["bitmaps"]["measures"];
    assert_eq!(report["schema"], "lamp-plan-column-cure-2");
    assert_eq!(report["optimize"], "dose");
    assert!(report["best"]["relative_gap"].as_f64().unwrap() <= 1e-6, "{report}");
    assert!(report["bitmaps"]["excess"].as_f64().unwrap() < 0.01, "{report}");
    assert!(measures["ra_um"].as_f64().unwrap() < 14.0, "{report}");
    let layers = scratch.layers("plan/bitmaps.tif");
    let times: Vec<_> = layers.iter().map(|layer| layer.info.exposure_ms.unwrap()).collect();
    let told: Vec<_> = report["bitmaps"]["times_ms"]
        .as_array()
        .unwrap()
        .iter()
        .map(|ms| ms.as_f64().unwrap())
        .collect();
    assert_eq!(times, told);
    assert!(layers.len() > 20 && times.iter().all(|ms| *ms >= 1.0 && ms.fract() == 0.0));
    for (small, large) in layers.iter().skip(1).zip(&layers) {
        let [Image::Mask(small), Image::Mask(large)] = [&*small.image, &*large.image] else {
            panic!("they are black and white");
        };
        assert_eq!([small.width(), small.height()], [1024, 768]);
        assert!(small.white_pixels() < large.white_pixels());
    }
}

#[test]
fn threads_change_no_byte() {
    let scratch = Scratch::new();
    // The first in the option's former spelling.
    for (threads, option) in [(1, "--optimise"), (2, "--optimize"), (3, "--optimize")] {
        scratch.run(&format!("{LENSES}{threads} {option} height --threads {threads}")).succeeds();
    }
    for file in ["bitmaps.tif", "report.json", "residual.png"] {
        let [one, two, three] = [1, 2, 3].map(|k| scratch.bytes(&format!("plan{k}/{file}")));
        assert!(one == two && one == three, "{file}");
    }
}

#[test]
fn gray_bitmaps_come_out_as_the_best_times() {
    let scratch = Scratch::new();
    scratch.run(&format!("{LENSES} --gray --bitmaps 5")).succeeds();
    let report = report(&scratch, "plan");
    assert!(report["bitmaps"]["excess"].as_f64().unwrap() < 1e-3, "{report}");
    let layers = scratch.layers("plan/bitmaps.tif");
    assert_eq!(layers.len(), 5);
    assert!(layers.iter().all(|layer| matches!(*layer.image, Image::Gray(_))));
}

/// Light that rises from 100 to 228 over the width.
fn flat_field(width: u32, height: u32) -> Vec<u8> {
    let mut png = Vec::new();
    let row: Vec<_> = (0..width).map(|column| (100 + column * 128 / width) as u8).collect();
    write_gray_png(&mut png, width, height, (0..height).map(|_| row.clone())).unwrap();
    png
}

#[test]
fn a_flat_field_is_made_up_for() {
    let scratch = Scratch::new();
    scratch.write("light.png", &flat_field(1024, 768));
    scratch.run(&format!("{LENSES} --flat-field light.png")).succeeds();
    let flat = report(&scratch, "plan");
    scratch.run(&LENSES.replace("-o plan", "-o even")).succeeds();
    let even = report(&scratch, "even");
    // Times make up for the light, so the part is as good, and takes as long where light is 1.
    let ra = |report: &Value| report["best"]["measures"]["ra_um"].as_f64().unwrap();
    assert!((ra(&flat) / ra(&even) - 1.0).abs() < 0.01, "{} {}", ra(&flat), ra(&even));
    assert_ne!(flat["bitmaps"]["times_ms"], even["bitmaps"]["times_ms"]);
    scratch.write("small.png", &flat_field(100, 100));
    scratch.run(&LENSES.replace("-o plan", "-o none --flat-field small.png")).is_refused_with(&[
        "small.png",
        "100 x 100 pixels",
        "1024 x 768 mirrors",
    ]);
    assert!(!scratch.path("none").exists());
}

#[test]
fn a_plan_that_cures_nothing_gets_a_warning() {
    let scratch = Scratch::new();
    let ran = scratch.run(&format!("{LENSES} --max-time 1ms")).succeeds();
    assert!(ran.stderr.contains("warning: plan: the plan cures no column"), "{ran:?}");
    assert!(ran.stderr.contains("mirrors are on for all of --max-time 0.001s"), "{ran:?}");
}

#[test]
fn what_cannot_be_planned_is_refused_in_a_sentence() {
    let scratch = Scratch::new();
    let refused = |options: &str, words: &[&str]| {
        scratch.run(&format!("{LENSES} {options}")).is_refused_with(words);
        assert!(!scratch.path("plan").exists(), "{options}");
    };
    refused("--bitmaps 1000 --max-time 500ms", &["more than the mirrors have distinct times"]);
    refused("--voxel 0.1um", &["too many"]);
    refused("--voxel 10mm", &["columns of 10000 um are wider than a mirror's 27.88 um"]);
    refused("--rays 1x1", &["no ray reaches column", "count more rays"]);
    let mut resin =
        String::from_utf8(scratch.run("lamp material show pegda-mw700").succeeds().stdout).unwrap();
    resin = resin.replace("11.593 mJ/cm2", "1.1593e-6 mJ/cm2");
    scratch.write("fast.toml", resin.as_bytes());
    scratch
        .run(&LENSES.replace("pegda-mw700", "fast.toml"))
        .is_refused_with(&["the longest time", "under the display's step of 1.000 ms"]);
    scratch
        .run(&LENSES.replace("zhao", "jariwala"))
        .is_refused_with(&["jariwala", "--voxel, at most 6.222um"]);
    scratch.run(&format!("{LENSES} --rays 9")).is_wrong_usage(&["9x15"]);
    scratch.run(&format!("{LENSES} --max-time 0s")).is_wrong_usage(&["some time"]);
    scratch.run(&format!("{LENSES} --max-time 1e300s")).is_wrong_usage(&["a day at most"]);
    scratch.run(&format!("{LENSES} --robust 1mm")).is_wrong_usage(&["--robust 1mm", "49um wide"]);
}

#[test]
fn a_small_part_has_as_many_bitmaps_as_times() {
    let scratch = Scratch::new();
    let line = "lamp plan column-cure hemisphere --projector zhao --material pegda-mw700 -o plan";
    scratch.run(line).succeeds();
    assert!(scratch.layers("plan/bitmaps.tif").len() < 25);
    // It warns of low columns, too.
    let ran = scratch.run(&format!("{line} --bitmaps 25 --force"));
    assert_eq!(ran.statuses, [Some(1)]);
    let said = "25 bitmaps are more than the mirrors have distinct times: ask for";
    assert!(ran.stderr.contains(said), "{}", ran.stderr);
}

#[test]
fn heights_that_a_material_was_not_measured_for_are_told() {
    let scratch = Scratch::new();
    let line = "lamp plan column-cure sphere --projector zhao --material pegda-mw700 -o plan";
    let ran = scratch.run(line).succeeds();
    assert!(ran.stderr.contains("lower than 180um"), "{}", ran.stderr);
}
