//! Checks the plans of `lamp plan ecpl`.

use lamp_tests::{Scratch, masks};
use serde_json::Value;

/// A lens that plans quickly, and a projector that blurs by 8 um only.
fn with_lens() -> Scratch {
    let scratch = Scratch::new();
    let lens = "name = 'small'\ndescription = 'a'\n[[lens]]\ndiameter = '80 um'\nsag = '15 um'\n";
    scratch.write("small.toml", lens.as_bytes());
    let projector = scratch.run("lamp projector show jariwala").succeeds_quietly().stdout;
    let sharper = String::from_utf8(projector).unwrap().replace("25.2 um", "8 um");
    scratch.write("sharp.toml", sharper.as_bytes());
    scratch
}

const PLAN: &str = "lamp plan ecpl small.toml --projector sharp.toml --material tmpta";

fn report(scratch: &Scratch, folder: &str) -> Value {
    serde_json::from_slice(&scratch.bytes(&format!("{folder}/report.json"))).unwrap()
}

fn number(report: &Value, place: &str) -> f64 {
    report.pointer(place).and_then(Value::as_f64).unwrap_or_else(|| panic!("{place}: {report}"))
}

#[test]
fn a_plan_holds_nested_bitmaps_a_report_and_pictures() {
    let scratch = with_lens();
    let said = scratch.run(&format!("{PLAN} -o plan")).succeeds().stderr;
    let report = report(&scratch, "plan");
    assert!(number(&report, "/measures/rms_um") <= 1.0, "{said}");
    assert!(said.contains("off the target by") && said.contains("1, 3 and 5 um aside"), "{said}");
    assert!((number(&report, "/cured/sag_um") - 15.0).abs() < 1.0, "{said}");
    assert!(number(&report, "/other_light/1/sag_um") > number(&report, "/cured/sag_um"));
    assert!(number(&report, "/aside/2/rms_um") > number(&report, "/aside/0/rms_um"));

    let layers = scratch.layers("plan/bitmaps.tif");
    let bitmaps = report["bitmaps"].as_array().unwrap();
    assert_eq!(layers.len(), bitmaps.len());
    let mut ms = 0.0;
    for (layer, bitmap) in layers.iter().zip(bitmaps) {
        assert_eq!((layer.image.width(), layer.image.height()), (1024, 768));
        assert_eq!(layer.info.exposure_ms, bitmap["exposure_ms"].as_f64());
        assert_eq!(layer.info.exposure_ms.unwrap() % 100.0, 0.0);
        ms += layer.info.exposure_ms.unwrap();
    }
    assert_eq!(number(&report, "/exposure_s"), ms / 1000.0);
    for pair in masks(&layers).windows(2) {
        let inside = |column, row| !pair[1].is_white(column, row) || pair[0].is_white(column, row);
        assert!((0..768).all(|row| (0..1024).all(|column| inside(column, row))));
    }
    for picture in ["section.svg", "residual.png", "times.png"] {
        assert!(!scratch.bytes(&format!("plan/{picture}")).is_empty());
    }
    let info = scratch.run("lamp info plan/bitmaps.tif").succeeds_quietly().stdout;
    assert!(String::from_utf8(info).unwrap().contains("lamp plan ecpl small"));
}

#[test]
fn threads_do_not_change_a_byte() {
    let scratch = with_lens();
    for threads in ["1", "3"] {
        let mut command = scratch.command(&format!("{PLAN} --quiet -o on{threads}"));
        assert!(command.env("RAYON_NUM_THREADS", threads).status().unwrap().success());
    }
    for file in ["bitmaps.tif", "report.json", "section.svg", "residual.png", "times.png"] {
        let [one, three] = [1, 3].map(|threads| scratch.bytes(&format!("on{threads}/{file}")));
        assert_eq!(one, three, "{file}");
    }
}

#[test]
fn bitmap_after_bitmap_has_discs_that_shrink() {
    let scratch = with_lens();
    scratch.run(&format!("{PLAN} --method seed -o plan")).succeeds();
    let report = report(&scratch, "plan");
    let reach = |bitmap: &Value| {
        assert_eq!(bitmap["rings"].as_array().unwrap().len(), 1);
        assert_eq!(number(bitmap, "/rings/0/0"), 0.0);
        number(bitmap, "/rings/0/1")
    };
    let reaches: Vec<_> = report["bitmaps"].as_array().unwrap().iter().map(reach).collect();
    assert!(!reaches.is_empty() && reaches.is_sorted_by(|a, b| a > b), "{reaches:?}");
}

#[test]
fn what_cannot_be_cured_is_refused_in_a_sentence() {
    let scratch = with_lens();
    let high = "name = 'high'\ndescription = 'a'\n[[lens]]\ndiameter = '500 um'\nsag = '210 um'\n";
    scratch.write("high.toml", high.as_bytes());
    let dim = String::from_utf8(scratch.bytes("sharp.toml")).unwrap();
    scratch.write("dim.toml", dim.replace("25.7 W/m2", "0.01 W/m2").as_bytes());
    let plan = |target: &str, projector: &str, material: &str| {
        let line = format!(
            "lamp plan ecpl {target} --projector {projector} --material {material} -o plan"
        );
        scratch.run(&line)
    };
    for (target, projector, material, words) in [
        ("lens-array", "jariwala", "tmpta", &["lens-array", "not round about the axis"][..]),
        ("high.toml", "jariwala", "tmpta", &["210.0 um high", "200.0 um", "make it lower"]),
        ("small.toml", "dim.toml", "tmpta", &["small.toml", "300 s of light", "brighter"]),
        ("small.toml", "zhao", "tmpta", &["zhao", "over a cone", "sigma"]),
        ("small.toml", "jariwala", "pegda-mw700", &["pegda-mw700", "add [kinetics]"]),
    ] {
        plan(target, projector, material).is_refused_with(words);
        assert!(!scratch.path("plan").exists());
    }
    scratch.run(&format!("{PLAN} -o plan")).succeeds();
    scratch.run(&format!("{PLAN} -o plan")).is_refused_with(&["plan", "--force"]);
}
