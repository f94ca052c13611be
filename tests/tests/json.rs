//! Checks the keys and values that docs/json.md gives for `--json`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use lamp_fixtures::{Sample, StepDefect, StepSample, StepUnit, broken_step, step};
use lamp_tests::{Scratch, workspace_root};
use serde_json::{Value, json};

/// Returns the one object that a command prints, in one line.
fn answer(scratch: &Scratch, line: &str) -> Value {
    let text = String::from_utf8(scratch.run(line).succeeds().stdout).unwrap();
    assert_eq!(text.lines().count(), 1, "{text}");
    serde_json::from_str(&text).unwrap()
}

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

fn is_near(value: &Value, expected: f64) -> bool {
    value.as_f64().is_some_and(|number| (number - expected).abs() < 1e-6 * expected.abs())
}

const MATERIAL: &str = r#"name = "mine"
description = "A resin of mine"

[intensity]
value = "2 W/cm2"
source = "radiometer"

[spread]
sigma = { value = "34 um", source = "camera" }

[gamma]
value = 2.2
source = "radiometer"

[working-curve.critical-dose]
value = "100 mJ/cm2"
source = "notebook"

[working-curve.penetration-depth]
value = "200 um"
source = "notebook"

[working-curve.measured]
source = "notebook"
doses = { from = "50 mJ/cm2", to = "900 mJ/cm2" }

[[cure-width]]
feature-size = "0.5 mm"
critical-dose = { value = "150 mJ/cm2", source = "notebook" }
sensitivity = { value = "0.2 um/(mJ/cm2)", source = "notebook" }
"#;

#[test]
fn materials() {
    let scratch = Scratch::new();
    scratch.write("mine.toml", MATERIAL.as_bytes());
    let shown = answer(&scratch, "lamp material show mine.toml --json");
    assert_eq!(shown["schema"], "lamp-material-1");
    let mine = &shown["materials"][0];
    // White takes E_c exp(100/200) mJ/cm2 at 2000 mW/cm2.
    let ms = 100.0 * 0.5_f64.exp() / 2.0;
    assert!(is_near(&mine["exposure_ms"], ms), "{mine}");
    let mut rest = mine.clone();
    rest["exposure_ms"] = Value::Null;
    rest["given"] = Value::Null;
    assert_eq!(
        rest,
        json!({
            "name": "mine",
            "description": "A resin of mine",
            "light_mw_per_cm2": 2000.0,
            "spread_um": 34.0,
            "spread_across_um": 34.0,
            "spread_along_um": 34.0,
            "gamma": 2.2,
            "models": ["working-curve"],
            "cure_width_um": [500.0],
            "depths_um": [0.0, null],
            "measured_mj_per_cm2": [50.0, 900.0],
            "layer_um": 100.0,
            "exposure_ms": null,
            "why_not": null,
            "given": null,
        })
    );
    let dose = &mine["given"]["working-curve"]["critical-dose"];
    assert_eq!(*dose, json!({"value": "100 mJ/cm2", "source": "notebook"}));
    assert_eq!(answer(&scratch, "lamp material check mine.toml --json"), shown);

    let list = answer(&scratch, "lamp material list --json");
    let names: Vec<_> =
        list["materials"].as_array().unwrap().iter().map(|it| &it["name"]).collect();
    assert_eq!(names.len(), 7);
    let dark = &list["materials"][0];
    assert_eq!(dark["name"], "lamp-no-absorber");
    assert_eq!((&dark["light_mw_per_cm2"], &dark["depths_um"]), (&Value::Null, &Value::Null));
    assert!(dark["why_not"].as_str().unwrap().contains("how bright full white is"), "{dark}");
}

#[test]
fn heights() {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 2_000);
    scratch.write("times.csv", b"thickness_um,exposure_ms\n1000,200\n2000,800\n");
    let line = "lamp heights tower.stl --min 1mm --max 2mm --step 0.5mm --exposure-table times.csv \
                --layer-overhead 10s --uniform-thickness 2mm --csv heights.csv --json";
    let answer = answer(&scratch, line);
    assert_eq!(
        keys(&answer),
        ["schema", "part", "criterion", "bound", "bounds", "choices", "layers"]
    );
    assert_eq!(answer["schema"], "lamp-heights-1");
    assert_eq!((&answer["part"], &answer["criterion"]), (&json!("tower.stl"), &json!("volume")));
    assert_eq!(answer["bound"], 0.02);
    assert_eq!(answer["bounds"], json!([{"from_um": null, "to_um": null, "bound": 0.02}]));

    // The layers are the rows of the report, to its digits.
    let layers = answer["layers"].as_array().unwrap();
    let report = String::from_utf8(scratch.bytes("heights.csv")).unwrap();
    let mut rows = report.lines().map(|line| line.split(',').skip(1).collect::<Vec<_>>());
    let columns = rows.next().unwrap();
    for (layer, row) in layers.iter().zip(rows) {
        assert_eq!(keys(layer), columns);
        for (key, cell) in columns.iter().zip(row) {
            let (said, written) = (layer[key].as_f64().unwrap(), cell.parse::<f64>().unwrap());
            assert!((said - written).abs() <= 6e-4, "{key}: {said} {written}");
        }
    }

    let [found, uniform] = &answer["choices"].as_array().unwrap()[..] else { panic!("two") };
    let names = ["name", "layers", "lost_mm3", "gained_mm3", "deviation_percent", "worst"];
    assert_eq!(keys(found), [&names[..], &["past_bound", "time_s"]].concat());
    assert_eq!((&found["name"], &found["layers"]), (&json!("volume 2.00%"), &json!(layers.len())));
    let sum = |key: &str| layers.iter().map(|layer| layer[key].as_f64().unwrap()).sum::<f64>();
    assert!(is_near(&found["gained_mm3"], sum("gained_mm3")), "{found}");
    let seconds = sum("exposure_ms") / 1000.0 + 10.0 * layers.len() as f64;
    assert!(is_near(&found["time_s"], seconds), "{found}");
    assert_eq!((&uniform["name"], &uniform["layers"]), (&json!("uniform 2mm"), &json!(38)));
    assert!(uniform["past_bound"].as_u64().unwrap() > 0, "{uniform}");
}

#[test]
fn bodies() {
    let scratch = Scratch::new();
    scratch.write("block.step", step(StepSample::Block, StepUnit::Inch).as_bytes());
    let answer_of_block = answer(&scratch, "lamp brep block.step --tolerance 1um --json");
    let [body] = &answer_of_block["bodies"].as_array().unwrap()[..] else { panic!("one body") };
    for (key, mm) in
        [("volume_mm3", 6000.0), ("facet_volume_mm3", 6000.0), ("facet_area_mm2", 2200.0)]
    {
        assert!(is_near(&body[key], mm), "{key}: {body}");
    }
    assert_eq!(body["faces"], json!({"plane": 6}));
    assert_eq!((&body["facets"], &body["faults"]), (&json!(12), &json!([])));
    let side =
        |k: usize| body["box_mm"][1][k].as_f64().unwrap() - body["box_mm"][0][k].as_f64().unwrap();
    for (k, mm) in [30.0, 20.0, 10.0].into_iter().enumerate() {
        assert!((side(k) - mm).abs() < 1e-6, "{body}");
    }
    let of_body = ["name", "faces", "facets", "box_mm", "volume_mm3", "facet_volume_mm3"];
    assert_eq!(keys(body), [&of_body[..], &["facet_area_mm2", "faults"]].concat());
    let mut rest = answer_of_block.clone();
    rest["bodies"] = Value::Null;
    assert_eq!(
        rest,
        json!({
            "schema": "lamp-brep-2",
            "part": "block.step",
            "unit": "inch",
            "facets": 12,
            "chordal_deviation_mm": 0.001,
            "heal_mm": 0.0,
            "notes": [],
            "tries": [],
            "bodies": null,
        })
    );

    scratch.write("gap.step", broken_step(StepDefect::Missing).as_bytes());
    let ran = scratch.run("lamp brep gap.step --strict --json");
    assert_eq!(ran.statuses, [Some(3)], "{ran:?}");
    let gap: Value = serde_json::from_slice(&ran.stdout).unwrap();
    let fault = gap["bodies"][0]["faults"][0].as_str().unwrap();
    assert!(fault.contains("edges of facets are open"), "{gap}");

    scratch.write("healed.step", broken_step(StepDefect::Apart { gap_nm: 1000 }).as_bytes());
    let healed = answer(&scratch, "lamp brep healed.step --json");
    assert_eq!(keys(&healed["tries"][0]), ["chordal_deviation_mm", "heal_mm", "why"]);
}

#[test]
fn a_report_in_a_file_is_what_json_prints() {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 5_000);
    let slice = "slice tower.stl --dpi 100 --thickness 1mm";
    scratch.run(&format!("{slice} -o tower.tif")).succeeds();
    for line in [
        &format!("{slice} -o again.tif"),
        "fix tower.tif -o fixed.tif",
        "lamp compensate tower.tif --uniform 10um --min-feature 0um -o offset.tif",
        "lamp support tower.tif --part tower.stl --to platform -o held.tif",
        "tile tower.tif --area 4x4in --mesh none -o build.tif",
        "tile tower.tif --area 4x4in --mesh none --time",
        "lamp check tower.tif",
        "lamp orient tower.stl --directions 20 --best 0",
        "lamp heights tower.stl --dpi 100",
    ] {
        let printed = scratch.run(&format!("{line} --json")).succeeds();
        scratch.run(&format!("{line} --report report.json")).succeeds();
        assert!(printed.stdout == scratch.bytes("report.json"), "{line}");
        assert!(scratch.run(&format!("{line} --report -")).succeeds().stdout == printed.stdout);
        let answer: Value = serde_json::from_slice(&printed.stdout).unwrap();
        assert!(answer["schema"].as_str().unwrap().starts_with("lamp-"), "{line}");
        scratch.run(&format!("{line} --json --report report.json")).is_wrong_usage(&["--report"]);
    }
    // Standard output is for one thing.
    for line in [slice, "fix tower.tif", "tile tower.tif --area 4x4in -o -"] {
        scratch.run(&format!("{line} --json")).is_wrong_usage(&["name a file with -o"]);
    }
    assert!(!scratch.names().contains(&"-".to_owned()));
}

#[test]
fn batches() {
    let scratch = Scratch::new();
    scratch.part("torus.stl", Sample::Torus, 500);
    scratch.write("bad.stl", b"nonsense\n");
    let night = "[defaults]\nstages = [\"slice --dpi 100 --thickness 1mm\"]\n\n\
                 [[part]]\nfile = \"torus.stl\"\n\n[[part]]\nfile = \"bad.stl\"\n";
    scratch.write("night.toml", night.as_bytes());
    let plan = answer(&scratch, "lamp batch plan night.toml --json");
    assert_eq!(plan["schema"], "lamp-batch-plan-1");
    assert_eq!(plan["cannot_be_made"][0]["name"], "bad");
    let status = answer(&scratch, "lamp batch status night.toml --json");
    assert_eq!(status["schema"], "lamp-batch-status-1");
    assert_eq!(status["tasks_to_do"], plan["to_do"]);
    let states: Vec<_> =
        status["parts"].as_array().unwrap().iter().map(|it| &it["state"]).collect();
    assert_eq!(states, ["failed", "waiting"]);
    assert_eq!(status["last_failures"], json!([]));
    let build =
        "[[build]]\nname = \"small\"\nparts = [\"torus:1\"]\ntile = \"--area 1x1mm --mesh none\"\n";
    let night = night.replace("[[part]]\nfile = \"bad.stl\"\n", build);
    scratch.write("night.toml", night.as_bytes());
    assert_eq!(scratch.run("lamp batch night.toml").statuses, [Some(1)]);
    let status = answer(&scratch, "lamp batch status night.toml --json");
    let failure = &status["last_failures"][0];
    assert_eq!(failure["subject"], "small", "{status}");
    assert!(failure["why"].as_str().unwrap().contains("1x1mm"), "{status}");
}

#[test]
fn each_form_in_the_book_has_a_schema() {
    let docs = workspace_root().join("docs");
    let files = |folder: &Path, ending: &str| -> Vec<PathBuf> {
        let files = fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
        files.filter(|path| path.extension().is_some_and(|found| found == ending)).collect()
    };
    let schemas = files(&docs.join("schemas"), "json").into_iter();
    let schemas: BTreeSet<String> =
        schemas.map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect();
    let pages: Vec<String> =
        files(&docs, "md").iter().map(|page| fs::read_to_string(page).unwrap()).collect();
    let words = pages.iter().flat_map(|page| {
        page.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '-')
    });
    let is_form = |word: &&str| {
        let parts = word.strip_prefix("lamp-").and_then(|rest| rest.rsplit_once('-'));
        parts.is_some_and(|(name, number)| {
            name.chars().all(|letter| letter.is_ascii_lowercase() || letter == '-')
                && number.parse::<u32>().is_ok()
        })
    };
    let forms: BTreeSet<String> = words.filter(is_form).map(str::to_owned).collect();
    // Only LAMP reads recipes.
    let without = BTreeSet::from(["lamp-recipe-1".to_owned()]);
    assert_eq!(&forms - &without, schemas);
}
