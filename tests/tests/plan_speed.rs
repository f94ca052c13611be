//! Checks the times of `lamp plan speed`.

use lamp_fixtures::cavity_staircase;
use lamp_stack::{Image, Layer};
use lamp_tests::Scratch;
use serde_json::Value;

fn with_stairs() -> Scratch {
    let scratch = Scratch::new();
    scratch.stack("stairs.tif", cavity_staircase(1).layers());
    scratch
}

fn json(scratch: &Scratch, name: &str) -> Value {
    serde_json::from_slice(&scratch.bytes(name)).unwrap()
}

fn wrong(counts: &Value) -> u64 {
    counts["overcured"].as_u64().unwrap() + counts["undercured"].as_u64().unwrap()
}

#[test]
fn pages_profile_and_report_have_the_same_times() {
    let scratch = with_stairs();
    let line = "lamp plan speed stairs.tif --material pegda-sudan --search-gap 1% -o timed.tif \
                --profile speed.csv --report plan.json --plot plan.svg";
    let said = scratch.run(line).succeeds().stderr;
    assert!(said.contains("error better; exposures take"), "{said}");
    let (before, after) = (scratch.layers("stairs.tif"), scratch.layers("timed.tif"));
    let report = json(&scratch, "plan.json");
    let text = String::from_utf8(scratch.bytes("speed.csv")).unwrap();
    let mut rows = text.lines();
    assert_eq!(rows.next(), Some("layer,z_um,thickness_um,exposure_ms,speed_um_per_s"));
    let rows: Vec<Vec<f64>> =
        rows.map(|row| row.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    assert_eq!([before.len(), after.len(), rows.len()], [60; 3]);
    for ((was, is), row) in before.iter().zip(&after).zip(&rows) {
        assert_eq!(was.image, is.image);
        assert_eq!(was.info.z_um, is.info.z_um);
        let ms = is.info.exposure_ms.unwrap();
        assert_eq!(
            [row[0], row[1], row[3]],
            [f64::from(is.info.index), was.info.z_um.unwrap(), ms]
        );
        assert!((row[4] * ms / 1000.0 - row[2]).abs() < 0.1 && (50.0..=20_000.0).contains(&ms));
        let layer = &report["by_layer"][is.info.index as usize];
        assert_eq!(layer["exposure_ms"].as_f64(), Some(ms));
    }
    // At most 30 % of what the best single time cures wrongly.
    assert!(10 * wrong(&report["after"]) <= 3 * wrong(&report["before"]), "{said}");
    assert!(report["gap"].as_f64().unwrap() <= 0.01);
    assert!(report["bound"].as_f64().unwrap() <= report["error"].as_f64().unwrap());
    let plot = String::from_utf8(scratch.bytes("plan.svg")).unwrap();
    for text in
        ["Voxels cured wrongly", "Time of each layer", "Doses", "light (%)", "Error and bound"]
    {
        assert!(plot.contains(text), "{text}");
    }
}

#[test]
fn a_platform_keeps_its_limits_and_threads_change_nothing() {
    let scratch = with_stairs();
    let line = "lamp plan speed stairs.tif --material pegda-sudan --speed 0.2mm/s..1mm/s \
                --max-change 20% --search-gap 5%";
    scratch.run(&format!("{line} --threads 1 -o one.tif")).succeeds();
    scratch.run(&format!("{line} --threads 3 > three.tif")).succeeds();
    assert_eq!(scratch.bytes("one.tif"), scratch.bytes("three.tif"));
    let times: Vec<_> =
        scratch.layers("one.tif").iter().map(|layer| layer.info.exposure_ms.unwrap()).collect();
    assert!(times.iter().all(|ms| (100.0..=500.0).contains(ms)), "{times:?}");
    assert!(times.windows(2).all(|two| (two[0] / two[1]).max(two[1] / two[0]) < 1.2001));
}

#[test]
fn a_pipe_is_planned_and_so_is_gray() {
    let scratch = with_stairs();
    let gray = scratch.layers("stairs.tif").into_iter().map(|layer| {
        let Image::Mask(mask) = &*layer.image else { panic!("the page is gray") };
        let image = lamp_tests::with_soft_edges(mask);
        Layer { image: image.into(), ..layer }
    });
    scratch.stack("gray.tif", gray);
    let line = "lamp plan speed --material pegda-sudan --search-gap 20% -o g.tif";
    scratch.run_on(line, &scratch.bytes("gray.tif")).succeeds();
    assert!(scratch.layers("g.tif").iter().all(|layer| layer.info.exposure_ms.is_some()));
}

#[test]
fn what_cannot_be_planned_is_refused_with_a_sentence() {
    let scratch = with_stairs();
    let mut layers = scratch.layers("stairs.tif");
    layers[7].info.thickness_um = None;
    scratch.stack("thin.tif", layers.clone());
    layers.truncate(7);
    layers[3].pitch = None;
    scratch.stack("pitch.tif", layers);
    let refused = |line: &str, text: &str| {
        let line = format!("lamp plan speed {line} -o out.tif");
        scratch.run(&line).is_refused_with(&[text]);
        assert!(!scratch.names().contains(&"out.tif".to_owned()));
    };
    refused(
        "thin.tif --material pegda-sudan",
        "layer 7 (z 0.70 mm) does not state its height and thickness",
    );
    refused(
        "pitch.tif --material pegda-sudan",
        "layer 3 (z 0.30 mm) does not state its resolution",
    );
    refused("stairs.tif --material pegda-mw700", "[spread]");
    refused("stairs.tif --material pegda-sudan --layers 70..80", "no layer is in that range");
    for options in ["--speed 2mm/s..5um/s", "--speed 3", "--max-change 0%", "--dose-margin 100%"] {
        let line =
            format!("lamp plan speed stairs.tif --material pegda-sudan {options} -o out.tif");
        scratch.run(&line).is_wrong_usage(&[]);
    }
}

/// Half the light takes twice the time, and a critical dose that follows the lamp less than that.
#[test]
fn a_lamp_that_ages_takes_longer() {
    let scratch = with_stairs();
    let plan = "lamp plan speed stairs.tif --search-gap 5% --speed 0.001um/s..1m/s";
    let shown = scratch.run("lamp material show pegda-sudan").succeeds().stdout;
    let follows = "\n[dimmed-lamp.critical-dose]\nat-zero = \"6 mJ/cm2\"\nrise = \"171.2 mJ/cm2\"\n\
                   source = \"a test\"\n";
    let material = String::from_utf8(shown).unwrap() + follows;
    scratch.write("aging.toml", material.as_bytes());
    let time = |material: &str, options: &str| -> f64 {
        let line = format!("{plan} --material {material} {options} -o timed.tif");
        let said = scratch.run(&line).succeeds().stderr;
        let is_told = said.contains("pegda-sudan does not state how its critical dose follows");
        assert_eq!(is_told, material == "pegda-sudan" && !options.is_empty(), "{said}");
        let layers = scratch.layers("timed.tif");
        let command = layers[0].info.stack.as_ref().unwrap().commands.last().unwrap();
        assert!(command.contains(options), "{command}");
        layers.iter().map(|layer| layer.info.exposure_ms.unwrap()).sum()
    };
    let (own, weak) = (time("pegda-sudan", ""), time("pegda-sudan", "--lamp-intensity 50%"));
    let aged = time("aging.toml", "--lamp-intensity 50%");
    // By equation 36, 6 + 0.1712 3.697 mJ/cm2 instead of 7.266.
    let dose = (6.0 + 0.1712 * 3.697) / 7.266;
    assert!((weak / own - 2.0).abs() < 0.02, "{weak} for {own}");
    assert!((aged / own - 2.0 * dose).abs() < 0.02, "{aged} for {own}");
}
