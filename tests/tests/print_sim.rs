//! Checks the simulated machine, and the loop of printing and learning on it.

use lamp_fixtures::{Voxels, cavity_staircase, narrow_cross, square_prism};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::ExposureTime;
use lamp_planning::learn::{Law, SHORTEST, errors_of};
use lamp_planning::speed::{PartPages, Simulation, recorded_ms};
use lamp_planning::{Light, SampleHeight};
use lamp_stack::Catalogued;
use lamp_tests::Scratch;
use serde_json::Value;

/// One time for all layers, which gives 4 E_c in the long run (004 section 3.2).
const TIMES: &str = "thickness_um,exposure_ms\n120,502.17\n";
/// 004's square and cross, as prisms that `slice` cuts.
const HEAD: &str = "<svg xmlns='http://www.w3.org/2000/svg' \
                    xmlns:slic3r='http://slic3r.org/namespaces/slic3r' width='5mm' height='5mm' \
                    viewBox='0 0 5 5'><g slic3r:z='6' slic3r:layer-height='6'>";
const SQUARE: &str = "<rect width='5' height='5'/></g></svg>\n";
const CROSS: &str =
    "<rect x='2' width='1' height='5'/><rect y='2' width='5' height='1'/></g></svg>\n";
/// Light 10 % brighter, reaching 25 % deeper, and a critical dose 15 % lower.
const PLANT: &str = "penetration-depth = '+25%'\ncritical-dose = '-15%'\nlight = '+10%'\n";

/// A folder with a job of a prism, whose resin spreads light over 0.1 mm.
fn with_prism(shapes: &str) -> Scratch {
    let scratch = Scratch::new();
    scratch.write("part.svg", (HEAD.to_owned() + shapes).as_bytes());
    scratch.write("times.csv", TIMES.as_bytes());
    let sliced =
        "slice part.svg --dpi 10um --thickness 120um --exposure-table times.csv -q -o part.tif";
    scratch.run(sliced).succeeds();
    let pegda = scratch.run("lamp material show pegda-sudan").succeeds_quietly().stdout;
    scratch.write("narrow.toml", &pegda);
    let wide = String::from_utf8(pegda).unwrap().replace("value = \"50 um\"", "value = \"0.1 mm\"");
    scratch.write("wide.toml", wide.as_bytes());
    scratch
}

/// The wrong pixels that a simulated print has.
fn printed(scratch: &Scratch, options: &str) -> Value {
    let line = format!("lamp print-sim job/ {options} --json -q -o measured.csv");
    serde_json::from_slice(&scratch.run(&line).succeeds().stdout).unwrap()
}

fn wrong(answer: &Value) -> u64 {
    answer["over_px"].as_u64().unwrap() + answer["under_px"].as_u64().unwrap()
}

/// The wrong pixels of prints that a law corrects one after the other.
fn prints(scratch: &Scratch, count: usize) -> Vec<u64> {
    let mut all = Vec::new();
    for print in 0..count {
        let answer = printed(scratch, "");
        assert_eq!(answer["print"], print);
        assert_eq!(answer["measured_px"].as_f64().unwrap() as u64, wrong(&answer));
        all.push(wrong(&answer));
        scratch
            .run("lamp learn job/ --measured measured.csv --law single -q -o next.csv")
            .succeeds();
    }
    all
}

#[test]
fn the_prisms_of_004_are_those_of_the_tests() {
    for (shapes, voxels) in [(SQUARE, square_prism(0)), (CROSS, narrow_cross(0))] {
        let scratch = with_prism(shapes);
        scratch.stack("voxels.tif", voxels.layers());
        scratch.run("lamp compare part.tif voxels.tif -q").succeeds();
    }
}

/// The wrong pixels of prints by eq. 3.5 as the library computes them, with times to the microsecond.
fn prints_of_library(scratch: &Scratch, voxels: &Voxels, material: &str, count: usize) -> Vec<u64> {
    let text = String::from_utf8(scratch.bytes(material)).unwrap();
    let light = Light::of(&Material::from_toml(&text).unwrap(), SampleHeight::Top).unwrap();
    let mut pages = PartPages::new(128);
    voxels.layers().for_each(|layer| pages.push(layer).unwrap());
    let part = pages.finish().unwrap();
    let simulation = Simulation::new(&part, &light, 1 << 30).unwrap();
    let (low, high) = ([SHORTEST; 50], [1e3; 50]);
    let mut times = vec![0.50217; 50];
    let mut all = Vec::new();
    for _ in 0..count {
        let [print] = simulation.tally([&times]);
        all.push(print.wrong().sum());
        let law = Law::Single { gain: Law::GAIN };
        let next = law.next(&times, &errors_of(&print.layers), [&low, &high]);
        let rounded = |s: f64| recorded_ms(ExposureTime::from_ms(1000.0 * s)) / 1000.0;
        times = next.into_iter().map(rounded).collect();
    }
    all
}

#[test]
fn the_loop_gives_the_prints_of_004() {
    // The figures of the referee in planning/src/learn/prints.rs, in prints 0 and 5.
    for (shapes, voxels, material, referee) in [
        (SQUARE, square_prism(0), "narrow.toml", [757_260, 204_088]),
        (CROSS, narrow_cross(0), "narrow.toml", [436_336, 190_364]),
        (SQUARE, square_prism(0), "wide.toml", [1_053_112, 152_480]),
    ] {
        let scratch = with_prism(shapes);
        let begin = format!("lamp learn job/ --start part.tif --material {material} -q");
        scratch.run(&begin).succeeds();
        let all = prints(&scratch, 6);
        assert_eq!(all, prints_of_library(&scratch, &voxels, material, 6), "{material}");
        for (found, expected) in [all[0], all[5]].into_iter().zip(referee) {
            let off = found as f64 / f64::from(expected) - 1.0;
            assert!(off.abs() < 1e-4, "{found} is not {expected}");
        }
    }
}

#[test]
fn a_plant_is_learned_from_its_simulated_print() {
    let scratch = with_prism(SQUARE);
    scratch.run("lamp learn job/ --start part.tif --material wide.toml -q").succeeds();
    scratch.write("plant.toml", PLANT.as_bytes());
    let options = "--truth plant.toml --noise 2%";
    let first = printed(&scratch, options);
    let depth = first["penetration_depth_um"].as_f64().unwrap();
    assert!((depth / 877.938 - 1.25).abs() < 1e-9, "{first}");
    // Noise is in the table, not in the truth; the same seed gives the same table.
    let table = scratch.bytes("measured.csv");
    assert_ne!(first["measured_px"].as_f64().unwrap() as u64, wrong(&first));
    printed(&scratch, options);
    assert_eq!(scratch.bytes("measured.csv"), table);
    printed(&scratch, &format!("{options} --seed 2"));
    assert_ne!(scratch.bytes("measured.csv"), table);
    scratch.write("measured.csv", &table);
    scratch.run("lamp learn job/ --measured measured.csv -q -o next.csv").succeeds();
    let second = printed(&scratch, options);
    assert_eq!(second["print"], 1);
    assert!(50 * wrong(&second) <= wrong(&first), "{first} {second}");
    // Earlier prints can be simulated again, and light drifts from print to print.
    let again = printed(&scratch, &format!("{options} --print 0"));
    assert_eq!((again["print"].as_u64(), wrong(&again)), (Some(0), wrong(&first)));
    scratch.write("drift.toml", format!("{PLANT}drift = '-2%'\n").as_bytes());
    let drifted = printed(&scratch, "--truth drift.toml");
    let light = |answer: &Value| answer["intensity_mw_per_cm2"].as_f64().unwrap();
    assert!((light(&drifted) / light(&second) - 0.98).abs() < 1e-9);
}

/// A folder with a job of the staircase.
fn with_stairs() -> Scratch {
    let scratch = Scratch::new();
    scratch.stack("stairs.tif", cavity_staircase(1).layers());
    scratch
        .run("lamp plan speed stairs.tif --material pegda-sudan --search-gap 5% -q -o timed.tif")
        .succeeds();
    scratch.run("lamp learn job/ --start timed.tif --material pegda-sudan -q").succeeds();
    scratch.write("plant.toml", PLANT.as_bytes());
    scratch
}

#[test]
fn heights_of_faces_are_learned_from() {
    let scratch = with_stairs();
    let rms = |answer: &Value| answer["rms_um"].as_f64().unwrap();
    let first = printed(&scratch, "--truth plant.toml --heights 300 --noise 2um");
    assert_eq!((&first["places"], &first["measured_px"]), (&Value::from(300), &Value::Null));
    let said = scratch.run("lamp learn job/ --measured measured.csv -o next.csv").succeeds();
    let said = String::from_utf8(said.stdout).unwrap();
    assert!(said.contains("error of print 0: "), "{said}");
    let places = |table: Vec<u8>| {
        let text = String::from_utf8(table).unwrap();
        let place = |row: &str| row.rsplitn(3, ',').last().unwrap().to_owned();
        text.lines().map(place).collect::<Vec<_>>()
    };
    let before = places(scratch.bytes("measured.csv"));
    let second = printed(&scratch, "--truth plant.toml --heights 300 --noise 2um");
    assert!(rms(&second) < 0.5 * rms(&first), "{first} {second}");
    assert_eq!(places(scratch.bytes("measured.csv")), before);
}

#[test]
fn the_body_is_a_stack_that_is_compared_with_the_part() {
    let scratch = with_stairs();
    let answer = printed(&scratch, "--truth plant.toml --body body.tif");
    let compared = scratch.run("lamp compare stairs.tif body.tif --json");
    let compared: Value = serde_json::from_slice(&compared.stdout).unwrap();
    assert_eq!(compared["added_px"], answer["over_px"]);
    assert_eq!(compared["missing_px"], answer["under_px"]);
    scratch.run("lamp verify body.tif").succeeds();
    // A table on standard output goes on to lamp learn.
    let table = scratch.run("lamp print-sim job/ --truth plant.toml -q").succeeds_quietly().stdout;
    assert_eq!(table, scratch.bytes("measured.csv"));
    let learned = scratch.run_on("lamp learn job/ --measured - -q -o next.csv", &table);
    learned.succeeds();
}

#[test]
fn what_cannot_be_printed_is_refused_and_writes_nothing() {
    let scratch = with_stairs();
    scratch.write("unknown.toml", b"light = '+10%'\nblur = '0.1mm'\n");
    scratch.write("unsigned.toml", b"light = '10%'\n");
    scratch.write("impossible.toml", b"critical-dose = '0 mJ/cm2'\n");
    scratch.write("other.toml", b"material = 'pegda-sodium'\n");
    let before = scratch.names();
    for (options, words) in [
        ("--truth unknown.toml", "unknown.toml: line 2: unknown key `blur`"),
        (
            "--truth unsigned.toml",
            "line 1: `10%` is not a change above -100% and up to +1000%: write +25% or -15%",
        ),
        ("--truth impossible.toml", "the critical dose must be above zero"),
        ("--truth other.toml", "pegda-sodium: there is no such file, nor a material"),
        ("--truth none.toml", "none.toml"),
        ("--print 1", "print 1 was never planned"),
    ] {
        let line = format!("lamp print-sim job/ {options} -o m.csv");
        scratch.run(&line).is_refused_with(&[words]);
    }
    scratch.run("lamp print-sim nojob/ -o m.csv").is_refused_with(&["there is no job"]);
    for (options, words) in [
        ("--noise 2um -o m.csv", "a length is for --heights"),
        ("--heights 9 --noise 2% -o m.csv", "a share is for counts"),
        ("--noise 2 -o m.csv", "is no noise"),
        ("--heights 0 -o m.csv", "is not a number of places"),
        ("-o job/m.csv", "is in the job's folder"),
        ("--body job/body.tif -o m.csv", "is in the job's folder"),
        ("--json", "name a file with -o"),
    ] {
        let line = format!("lamp print-sim job/ {options}");
        scratch.run(&line).is_wrong_usage(&[words]);
    }
    assert_eq!(scratch.names(), before);
}
