//! Checks the plans of `lamp plan ecpl`.

use lamp_stack::{Image, Layer, Mask, PageInfo};
use lamp_tests::{Scratch, masks, with_soft_edges};
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
fn simulation_of_the_bitmaps_agrees_with_the_plan() {
    let scratch = with_lens();
    scratch.run(&format!("{PLAN} -o plan")).succeeds();
    let line = "lamp plan simulate plan/bitmaps.tif --model kinetics --projector sharp.toml \
                --material tmpta --target small.toml -o again";
    scratch.run(line).succeeds();
    let [planned, again] = ["plan", "again"].map(|folder| report(&scratch, folder));
    for key in ["bitmaps", "cured", "measures", "profile", "other_light", "aside", "exposure_s"] {
        assert_eq!(planned[key], again[key], "{key}");
    }
    for file in ["section.svg", "residual.png", "times.png"] {
        let [planned, again] = ["plan", "again"].map(|it| scratch.bytes(&format!("{it}/{file}")));
        assert!(planned == again, "{file}");
    }
}

const KINETICS: &str = "--model kinetics --projector jariwala --material tmpta";

#[test]
fn figure_11_is_typed_in() {
    let scratch = Scratch::new();
    let discs = "12:7.9s,11:0.8s,10:1.3s,9:1.2s,8:1.8s,7:1.2s,6:1.7s,5:1.8s";
    let line = format!("lamp plan simulate {discs} {KINETICS} --target hemisphere -o figure");
    let said = scratch.run(&line).succeeds().stderr;
    assert!(said.contains("8 bitmaps in 17.7 s cure"), "{said}");
    let report = report(&scratch, "figure");
    assert_eq!(report["schema"], "lamp-simulation-1");
    assert!((number(&report, "/cured/sag_um") - 108.0).abs() < 10.8);
    assert!((number(&report, "/cured/base_radius_um") - 105.0).abs() < 10.5);
    assert!(number(&report, "/measures/rms_um") <= 5.0);
    let grown: Vec<_> =
        (0..8).map(|of| number(&report, &format!("/bitmaps/{of}/sag_um"))).collect();
    assert!(grown.is_sorted() && grown[7] == number(&report, "/cured/sag_um"), "{grown:?}");
    let alone = scratch.run(&format!("lamp plan simulate {discs} {KINETICS}")).succeeds().stderr;
    assert!(!alone.contains("target"), "{alone}");
}

#[test]
fn bitmaps_that_kinetics_cannot_take_are_refused() {
    let scratch = with_lens();
    let page = |image: Image| Layer {
        info: PageInfo { exposure_ms: Some(900.0), ..PageInfo::default() },
        pitch: None,
        image: image.into(),
    };
    let square = Mask::new(8, vec![0, 0, 2, 4, 4], vec![2, 6, 2, 6]).unwrap();
    scratch.stack("square.tif", [page(square.clone().into())]);
    scratch.stack("gray.tif", [page(with_soft_edges(&square).into())]);
    let run = |bitmaps: &str| scratch.run(&format!("lamp plan simulate {bitmaps} {KINETICS}"));
    run("square.tif").is_refused_with(&["square.tif", "bitmap 1", "not round"]);
    run("gray.tif").is_refused_with(&["gray.tif", "bitmap 1 has gray levels"]);
    run("12:50ms").is_refused_with(&["bitmap 1", "50 ms", "step is 100 ms"]);
    run("12:2h").is_wrong_usage(&["12:2h", "12:7.9s"]);
    run("12:4000s").is_refused_with(&["4000 s", "an hour"]);
    run("12:1s --rays 9x15").is_wrong_usage(&["--rays", "column"]);
    run("12:1s --target lens-array").is_refused_with(&["lens-array", "not round about the axis"]);
}

#[test]
fn threads_do_not_change_a_byte() {
    let scratch = with_lens();
    for threads in [1, 3] {
        scratch.run(&format!("{PLAN} --threads {threads} -o on{threads}")).succeeds();
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
    scratch.write("thin.toml", high.replace("'210 um'", "'0.1 um'").as_bytes());
    let bright = dim.replace("25.7 W/m2", "900000 W/m2");
    scratch.write("bright.toml", bright.as_bytes());
    scratch.write("coarse.toml", dim.replace("\"0.1 s\"", "\"30 s\"").as_bytes());
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
        ("thin.toml", "jariwala", "tmpta", &["thin.toml", "no better than nothing"]),
        ("small.toml", "bright.toml", "tmpta", &["small.toml", "too small", "100 ms"]),
        ("small.toml", "coarse.toml", "tmpta", &["step is 30000 ms", "2 s is the most"]),
        ("small.toml", "zhao", "tmpta", &["zhao", "over a cone", "sigma"]),
        ("small.toml", "jariwala", "pegda-mw700", &["pegda-mw700", "add [kinetics]"]),
    ] {
        plan(target, projector, material).is_refused_with(words);
        assert!(!scratch.path("plan").exists());
    }
    scratch.run(&format!("{PLAN} -o plan")).succeeds();
    scratch.run(&format!("{PLAN} -o plan")).is_refused_with(&["plan", "--force"]);
}
