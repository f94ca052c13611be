//! Checks the plans of `lamp plan ecpl`, and the rates that `lamp calibrate kinetics` finds for them.

use std::fmt::Write as _;

use lamp_fixtures::SplitMix;
use lamp_stack::{Image, Layer, Mask, PageInfo};
use lamp_tests::{Scratch, masks, with_soft_edges};
use serde_json::Value;

use crate::plot_tables::is_as_in_the_book;

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

/// Films of a resin with 30 % more oxygen than the material states, made by discs so wide that their middle
/// is a film.
#[test]
fn films_show_how_much_oxygen_a_resin_has() {
    let scratch = Scratch::new();
    let tmpta = scratch.run("lamp material show tmpta").succeeds_quietly().stdout;
    let truth = String::from_utf8(tmpta).unwrap().replace("1.05 mol/m3", "1.365 mol/m3");
    scratch.write("truth.toml", truth.as_bytes());
    let mut noise = SplitMix(3);
    let mut table = "exposure_ms,height_um,note\n500,0,did not cure\n".to_owned();
    for ms in [1500, 2000, 3000, 4000, 5000] {
        let folder = format!("disc-{ms}");
        let disc = format!(
            "lamp plan simulate 60:{ms}ms --model kinetics --projector jariwala --material truth.toml -o {folder}"
        );
        scratch.run(&disc).succeeds();
        let film_um = number(&report(&scratch, &folder), "/cured/sag_um");
        for _ in 0..3 {
            writeln!(table, "{ms},{:.2},", film_um + noise.normal()).unwrap();
        }
    }
    scratch.write("films.csv", table.as_bytes());
    let fit = "lamp calibrate kinetics films.csv --material tmpta --projector jariwala";
    let outputs =
        "--rates oxygen,absorptivity --name mine -o mine.toml --plot fit.csv --report fit.json";
    scratch.run(&format!("{fit} {outputs}")).succeeds();
    is_as_in_the_book(&scratch, "lamp calibrate kinetics", "fit.csv");
    let answer: Value = serde_json::from_slice(&scratch.bytes("fit.json")).unwrap();
    assert_eq!([&answer["points"], &answer["without_measure"]], [15, 1]);
    for (name, truth) in [("oxygen", 1.365), ("absorptivity", 15.0)] {
        let all = answer["parameters"].as_array().unwrap();
        let rate = all.iter().find(|it| it["name"] == name).unwrap();
        let [value, low, high] = ["value", "low", "high"].map(|key| rate[key].as_f64().unwrap());
        assert!(low < truth && truth < high && (value / truth - 1.0).abs() < 0.1, "{rate}");
    }
    scratch.run("lamp material check mine.toml").succeeds();
    let mine = String::from_utf8(scratch.bytes("mine.toml")).unwrap();
    assert!(
        mine.contains("[kinetics.measured") && mine.contains("from films.csv, 15 points"),
        "{mine}"
    );
    // 003's rates: films do not show how radicals end each other.
    let rates = "--rates propagation,termination,termination-by-oxygen";
    let said = scratch.run(&format!("{fit} {rates}")).succeeds_quietly().stdout;
    let said = String::from_utf8(said).unwrap();
    let (_, kept) = said.split_once("not shown by the points, and kept:\n").unwrap();
    assert!(kept.contains("termination (m3/(mol s))                  1.3100\n"), "{said}");
    // Two chambers, two resins, or none.
    let refused = |command: &str, words: &[&str]| {
        scratch.run(command).is_wrong_usage(words);
    };
    refused("lamp calibrate kinetics films.csv --projector jariwala", &["--material"]);
    refused(&format!("{fit} --rates oxygen,oxygen"), &["oxygen is given twice"]);
    let fails = |command: &str, words: &[&str]| {
        scratch.run(command).is_refused_with(words);
    };
    fails(
        "lamp calibrate kinetics films.csv --material sl-5510 --projector jariwala",
        &["sl-5510 lacks the rates"],
    );
    fails(&fit.replace("jariwala", "zhao"), &["zhao", "cone"]);
    scratch.write("high.csv", b"exposure_ms,height_um\n5000,210\n");
    fails(&fit.replace("films", "high"), &["high.csv", "line 2, column height_um: 210 is not"]);
    scratch.write("few.csv", b"exposure_ms,height_um\n5000,70\n6000,75\n");
    fails(&fit.replace("films", "few"), &["few.csv", "2 points are too few"]);
}

#[test]
fn lines_of_mirrors_are_lit_for_their_times() {
    let scratch = Scratch::new();
    let lines = "lamp target lines --projector jariwala --widths 4,9 --times 2s,5s --length 75um --gap 50um";
    scratch.run(&format!("{lines} -o lines")).succeeds();
    let layers = scratch.layers("lines/lines.tif");
    let times: Vec<_> =
        layers.iter().map(|layer| layer.info.exposure_ms.unwrap().round()).collect();
    assert_eq!(times, [2000.0, 3000.0]);
    let pitch = layers[0].pitch.unwrap().dpi()[0];
    assert!((25_400.0 / pitch - 560.0 / 90.0).abs() < 1e-5, "{pitch}");
    let masks = masks(&layers);
    assert_eq!((masks[0].width(), masks[0].height()), (64, 48));
    assert_eq!(masks[0].row(10)[..4], [8, 12, 20, 29]);
    assert_eq!(masks.iter().map(|mask| mask.white_pixels()).collect::<Vec<_>>(), [312, 156]);
    let table = String::from_utf8(scratch.bytes("lines/lines.csv")).unwrap();
    let rows = "exposure_ms,line_px,x_um,height_um,width_um\n2000,4,0,,\n2000,9,0,,\n5000,4,0,,\n5000,9,0,,\n";
    assert!(table.ends_with(rows), "{table}");
    // Its table is read as it is.
    let fit = "lamp calibrate kinetics lines/lines.csv --material tmpta --projector jariwala";
    scratch.run(fit).is_refused_with(&["lines.csv"]);
    let shown = "lamp plan simulate lines/lines.tif --model column --projector jariwala --material pegda-mw700";
    scratch.run(shown).succeeds();
    scratch.run("lamp target lines --projector jariwala -o whole").succeeds();
    let cone = scratch.run("lamp target lines --projector zhao -o refused");
    cone.is_refused_with(&["zhao", "spreads over a cone"]);
    for (options, words) in [
        ("--times 5s,2s", &["--times", "ascending order"][..]),
        ("--times 1ms", &["--times", "100 ms"]),
        ("--length 9mm", &["1024 x 768", "--length"]),
        ("--widths 9,9", &["9 is given twice"]),
        ("--widths 0", &["lines of 0 pixels"]),
        ("--gap 1um", &["gaps of 0 pixels"]),
    ] {
        let command = format!("lamp target lines --projector jariwala {options} -o refused");
        scratch.run(&command).is_wrong_usage(words);
    }
    assert!(!scratch.path("refused").exists());
}
