//! Checks that the limits of machines bind, and what `lamp machine` says of them.

use lamp_fixtures::Sample;
use lamp_tests::{OWN_SETTINGS, Scratch};
use serde_json::{Value, json};

const MINE: &str = r#"name = "mine"
description = "A machine of mine"

[area]
value = "40x30mm"
source = "measured"

[height]
value = "80mm"
source = "data sheet"

[dpi]
least = 50
most = 100
source = "data sheet"

[thickness]
least = "0.5mm"
most = "1mm"
source = "data sheet"

[strips]
mirrors = 64
overlap = 8
source = "data sheet"

[times]
recoat_s = 8
swath_speed_mm_per_s = 50
source = "measured"
"#;

/// Returns a folder with `tower.stl`, 25.4 x 25.4 x 76 mm, and a machine that just builds it.
fn tower_and_machine() -> Scratch {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 5_000);
    scratch.write("mine.toml", MINE.as_bytes());
    scratch
}

const SLICE: &str = "slice tower.stl --machine mine.toml -q -o tower.tif";

#[test]
fn a_part_within_the_limits_is_sliced_as_without_a_machine() {
    let scratch = tower_and_machine();
    scratch.run(&format!("{SLICE} --dpi 100 --thickness 1mm")).succeeds_quietly();
    scratch.run("slice tower.stl --dpi 100 --thickness 1mm -q -o plain.tif").succeeds_quietly();
    let [mut limited, plain] = ["tower.tif", "plain.tif"].map(|name| scratch.layers(name));
    // The machine is recorded with its digest.
    let stack = limited[0].info.stack.as_mut().unwrap();
    let command = &mut stack.commands[0];
    let machine = command.find(" --machine mine.toml@blake3:").expect("the machine");
    command.truncate(machine);
    let record = stack.other["slice"].as_object_mut().unwrap();
    let word = record.shift_remove("machine").unwrap();
    assert!(word.as_str().unwrap().starts_with("mine.toml@blake3:"), "{word}");
    assert!(limited == plain);
}

#[test]
fn options_beyond_a_limit_are_wrong_usage() {
    let scratch = tower_and_machine();
    let limits = "mine builds in layers of 500um to 1mm";
    for (options, words) in [
        ("--dpi 120 --thickness 1mm", ["the stack has 120 dpi", "mine builds in 50 to 100 dpi"]),
        ("--dpi 100 --thickness 0.4mm", ["a layer is 400um thick", limits]),
        ("--dpi 100 --thickness 1.1mm", ["a layer is 1.1mm thick", limits]),
        ("--dpi 100 --adaptive --max 1mm", ["the thinnest layer is 25um thick", limits]),
        ("--dpi 100 --adaptive --min 0.5mm --max 2mm", ["the thickest layer is 2mm thick", limits]),
    ] {
        scratch.run(&format!("{SLICE} {options}")).is_wrong_usage(&words);
        assert_eq!(scratch.names(), ["mine.toml", "tower.stl"]);
    }
}

#[test]
fn parts_beyond_a_limit_are_refused_before_they_are_sliced() {
    let scratch = tower_and_machine();
    let line = format!("{SLICE} --dpi 100 --thickness 1mm");
    for (options, words) in [
        ("--scale 1.3,1.3,1", ["tower.stl: the part takes 33", "mine builds on 40x30mm"]),
        ("--scale 1.7,1,1", ["tower.stl: the part takes 43", "mine builds on 40x30mm"]),
        ("--scale 1,1,1.1", ["tower.stl: the part is 84mm high", "mine builds 80mm high"]),
        ("--units inch", ["the part takes", "check --units"]),
    ] {
        scratch.run(&format!("{line} {options}")).is_refused_with(&words);
        assert_eq!(scratch.names(), ["mine.toml", "tower.stl"]);
    }
    // It fits when it is turned by 90 degrees.
    scratch.run(&format!("{line} --scale 1,1.5,1")).succeeds_quietly();
}

#[test]
fn a_build_that_is_too_high_is_refused_with_its_layer() {
    let scratch = tower_and_machine();
    scratch.run(&format!("{SLICE} --dpi 100 --thickness 1mm")).succeeds_quietly();
    let tile = "tile tower.tif --machine mine.toml --copies 1 -o build.tif";
    // 76 layers of 1 mm on five of mesh alone.
    let words = ["the build up to layer 80", "is 81mm high", "mine builds 80mm high"];
    scratch.run(tile).is_refused_with(&words);
    assert!(!scratch.path("build.tif").exists());
    scratch.run(&format!("{tile} --base-layers 4")).succeeds_quietly();
}

#[test]
fn json_says_what_is_known_of_machines() {
    let scratch = tower_and_machine();
    let answer = |line: &str| -> Value {
        serde_json::from_slice(&scratch.run(line).succeeds_quietly().stdout).unwrap()
    };
    assert_eq!(
        answer("lamp machine show mine.toml --json"),
        json!({"schema": "lamp-machine-1", "machines": [{
            "name": "mine",
            "description": "A machine of mine",
            "area_mm": [40.0, 30.0],
            "height_mm": 80.0,
            "dpi": [50.0, 100.0],
            "thickness_um": [500.0, 1000.0],
            "mirrors": 64,
            "overlap": 8,
            "scan": null,
                "fields": null,
            "panel": null,
            "gamma": null,
            "recoating_pa": null,
            "times": {
                "recoat_s": 8.0,
                "expose_s": null,
                "swath_speed_mm_per_s": 50.0,
                "swath_step_s": null,
            },
            "defaults": {"dpi": null, "thickness_um": null, "margin": null},
            "sources": {
                "area": "measured",
                "height": "data sheet",
                "dpi": "data sheet",
                "thickness": "data sheet",
                "strips": "data sheet", "recoating": null, "times": "measured",
            },
        }]})
    );
    let list = answer("lamp machine list --json");
    assert_eq!(list["schema"], "lamp-machine-1");
    assert_eq!(list["machines"][0]["name"], "alpha");
    assert_eq!(list["machines"][1]["area_mm"], json!([584.2, 584.2]));
    assert_eq!(list["machines"][1]["height_mm"], Value::Null);
    assert_eq!(list["machines"][1]["sources"]["strips"], Value::Null);
    assert_eq!(list["displays"][0]["name"], "dlp7000");
    assert_eq!(list["displays"][0]["mirrors"], json!([1024, 768]));
    let text = scratch.run("lamp machine list").succeeds_quietly().stdout;
    let text = String::from_utf8(text).unwrap();
    let (machines, displays) = text.split_once("\nDisplays").unwrap();
    assert!(machines.contains("alpha") && !machines.contains("dlp7000"), "{text}");
    assert!(displays.contains("1024x768") && displays.contains("no machine"), "{text}");
}

const SCAN: &str = r#"
[scan]
display = "dlp7000"
mirrors = [64, 2]
overlap = 8
speed = ["1mm/s", "0.2m/s"]
acceleration = "2000mm/s2"
both_ways = true
source = "data sheet"

[scan.faults]
dead = [[3, 1]]
source = "camera"
"#;

/// Returns the machine with a scan in place of its strips and times.
fn scanning() -> String {
    let (limits, _) = MINE.split_once("[strips]").unwrap();
    limits.to_owned() + SCAN
}

const LIGHT: &str = "[scan.light]\nfile = \"light.csv\"\nsource = \"camera\"\n";

#[test]
fn json_says_how_a_display_scans() {
    let scratch = tower_and_machine();
    scratch.write("scan.toml", scanning().as_bytes());
    let stdout = scratch.run("lamp machine show scan.toml --json").succeeds_quietly().stdout;
    let answer: Value = serde_json::from_slice(&stdout).unwrap();
    let machine = &answer["machines"][0];
    assert_eq!((&machine["mirrors"], &machine["overlap"]), (&json!(64), &json!(8)));
    assert_eq!(
        machine["scan"],
        json!({
            "display": "dlp7000",
            "mirrors": [64, 2],
            "overlap_px": 8,
            "speed_mm_per_s": [1.0, 200.0],
            "acceleration_mm_per_s2": 2000.0,
            "row_clock_hz": 32552.0,
            "both_ways": true,
            "direction": "down",
            "settle_s": 0.0,
            "strobe": 1.0,
            "passes": 1,
            "irradiance_mw_per_cm2": null,
            "light": null,
            "faults": {"dead": [[3, 1]], "stuck": [], "source": "camera"},
            "tilt": null,
            "source": "data sheet",
        })
    );
}

#[test]
fn a_build_is_cut_into_the_swaths_of_a_scan_as_into_strips() {
    let scratch = tower_and_machine();
    scratch.write("scan.toml", scanning().as_bytes());
    scratch.run(&format!("{SLICE} --dpi 100 --thickness 1mm")).succeeds_quietly();
    let tile = "tile tower.tif --copies 1 --mesh none";
    for machine in ["mine", "scan"] {
        scratch
            .run(&format!("{tile} --machine {machine}.toml --strips {machine}"))
            .succeeds_quietly();
        scratch.run(&format!("lamp join {machine} -o {machine}.tif")).succeeds_quietly();
    }
    let images = |name| scratch.layers(name).into_iter().map(|layer| layer.image);
    assert!(images("mine.tif").eq(images("scan.tif")));
    let info = |folder| {
        let stdout = scratch.run(&format!("lamp info {folder} --json")).succeeds_quietly().stdout;
        serde_json::from_slice::<Value>(&stdout).unwrap()
    };
    for key in ["mirrors", "overlap"] {
        assert_eq!(info("mine")[key], info("scan")[key]);
    }
}

#[test]
fn machines_are_checked_by_name() {
    let scratch = tower_and_machine();
    let own = scratch.path(OWN_SETTINGS).join("lamp/machines");
    std::fs::create_dir_all(&own).unwrap();
    std::fs::write(own.join("lit.toml"), (scanning() + LIGHT).replace("\"mine\"", "\"lit\""))
        .unwrap();
    // The light lies beside the machine's file, not in the current folder.
    let light = format!("{}\n", ["1"; 64].join(",")).repeat(2);
    std::fs::write(own.join("light.csv"), light).unwrap();
    let line = "lamp machine check Mars3 alpha lit Lit mine.toml";
    assert_eq!(
        String::from_utf8(scratch.run(line).succeeds_quietly().stdout).unwrap(),
        "Mars3: machine mars3: whole\nalpha: machine alpha: whole\nlit: machine lit: whole\n\
         Lit: machine lit: whole\nmine.toml: machine mine: whole\n"
    );
    scratch.run("lamp machine check mars").is_refused_with(&["the machine has a fault"]);
    for (kind, name) in [("material", "lamp-suspension"), ("projector", "zhao")] {
        let by_name = scratch.run(&format!("lamp {kind} check {name}")).succeeds_quietly().stdout;
        scratch.write("x.toml", &scratch.run(&format!("lamp {kind} show {name}")).stdout);
        let of_file = scratch.run(&format!("lamp {kind} check x.toml")).succeeds_quietly().stdout;
        let of_file = String::from_utf8(of_file).unwrap();
        assert_eq!(String::from_utf8(by_name).unwrap(), of_file.replacen("x.toml", name, 1));
        scratch.run(&format!("lamp {kind} check nobody")).is_refused_with(&["nobody", name]);
    }
}

#[test]
fn machine_files_are_checked_with_the_light_that_they_name() {
    let scratch = tower_and_machine();
    let folder = scratch.path("light");
    std::fs::create_dir(&folder).unwrap();
    let lit = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    lit("scan.toml", &(scanning() + LIGHT));
    lit("light.csv", &format!("{}\n", ["1"; 64].join(",")).repeat(2));
    let line = "lamp machine check mine.toml light/scan.toml";
    assert_eq!(
        String::from_utf8(scratch.run(line).succeeds_quietly().stdout).unwrap(),
        "mine.toml: machine mine: whole\nlight/scan.toml: machine mine: whole\n"
    );
    for (light, words) in [
        (Some("1\n"), "line 1 has 1 number, but 64 mirrors lie across"),
        (Some(""), "this table has 0 rows, but 2 mirrors lie along the scan"),
        (None, "light/scan.toml: scan.light.file: light.csv: "),
    ] {
        match light {
            Some(light) => lit("light.csv", light),
            None => std::fs::remove_file(folder.join("light.csv")).unwrap(),
        }
        let output = scratch.run(line);
        let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
        output.is_refused_with(&["1 of 2 machines has a fault"]);
        let answer = scratch.run(&format!("{line} --json"));
        assert_eq!(answer.statuses, [Some(1)], "{answer:?}");
        let answer: Value = serde_json::from_slice(&answer.stdout).unwrap();
        let [mine, scan] = [0, 1].map(|file| &answer["machines"][file]);
        assert_eq!((&answer["whole"], &mine["name"]), (&json!(false), &json!("mine")));
        assert_eq!(scan["input"], "light/scan.toml");
        let lines: Vec<_> = stdout.lines().collect();
        assert_eq!((lines.len(), lines[0]), (2, "mine.toml: machine mine: whole"), "{stdout}");
        assert!(lines[1].contains(words), "{stdout}");
        assert_eq!(scan["fault"], lines[1]);
    }
}
