//! Checks the simulated machine, and the loop of printing and learning on it.

use lamp_fixtures::{Voxels, cavity_staircase, narrow_cross, square_prism};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::ExposureTime;
use lamp_planning::learn::{Law, SHORTEST, errors_of};
use lamp_planning::speed::{PartPages, Simulation, recorded_ms};
use lamp_planning::target::GrayPicture;
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

fn picture(scratch: &Scratch, name: &str, columns: usize, levels: Vec<u16>) {
    let rows = levels.len() / columns;
    scratch.write(name, &GrayPicture { columns, rows, levels }.to_png().unwrap());
}

#[test]
fn a_camera_picture_of_a_layer_is_the_light_of_004() {
    let scratch = with_prism(SQUARE);
    let sliced = "slice part.svg --dpi 50um --thickness 120um --exposure-table times.csv \
                  --margin 10 -q -o part.tif";
    scratch.run(sliced).succeeds();
    scratch.run("lamp learn job/ --start part.tif --material wide.toml -q").succeeds();
    let blurred = printed(&scratch, "");
    // The picture that a camera takes of a square whose light spreads over 0.1 mm.
    let info = scratch.run("lamp info part.tif --json").succeeds_quietly().stdout;
    let info: Value = serde_json::from_slice(&info).unwrap();
    let [columns, rows] = ["width_px", "height_px"].map(|key| info[key].as_u64().unwrap() as usize);
    let share = |at: usize| {
        // Of a Gaussian of 2 pixels, the part from the square's.
        let weight = |away: i64| (-0.5 * (away as f64 / 2.0).powi(2)).exp();
        let field: f64 = (-20..=20).map(weight).sum();
        (10..110).map(|pixel| weight(pixel - at as i64)).sum::<f64>() / field
    };
    let levels = (0..columns * rows)
        .map(|at| (60_000.0 * share(at % columns) * share(at / columns)).round() as u16);
    picture(&scratch, "square.png", columns, levels.collect());
    scratch.write("camera.toml", b"layer-picture = 'square.png'\n");
    let seen = printed(&scratch, "--truth camera.toml");
    let off = wrong(&seen).abs_diff(wrong(&blurred));
    assert!(200 * off < wrong(&blurred), "{seen} {blurred}");
    // With a shade at one side, the loop of 004 corrects what it can.
    let shaded = (0..columns * rows).map(|at| {
        let shade = 1.0 - 0.5 * (at % columns) as f64 / columns as f64;
        (60_000.0 * shade * share(at % columns) * share(at / columns)).round() as u16
    });
    picture(&scratch, "square.png", columns, shaded.collect());
    let mut errors = Vec::new();
    for _ in 0..3 {
        errors.push(wrong(&printed(&scratch, "--truth camera.toml --noise 2%")));
        scratch.run("lamp learn job/ --measured measured.csv -q -o next.csv").succeeds();
    }
    assert!(2 * errors[2] < errors[0], "{errors:?}");
    scratch.write("both.toml", b"layer-picture = 'square.png'\nflat-field = 'square.png'\n");
    scratch.write("twice.toml", b"layer-picture = 'square.png'\nspread = '+1%'\n");
    scratch.write("none.toml", b"flat-field = 'none.png'\n");
    scratch.write("black.toml", b"flat-field = 'black.png'\n");
    scratch.write("table.toml", b"flat-field = 'measured.csv'\n");
    picture(&scratch, "black.png", 2, vec![0; 4]);
    for (truth, words) in [
        ("both.toml", "both.toml: the truth has `flat-field` and `layer-picture`"),
        ("twice.toml", "twice.toml: the truth has `spread` and `layer-picture`"),
        ("none.toml", "none.png"),
        ("black.toml", "black.png: all black: it shows no light"),
        ("table.toml", "measured.csv: it is not a complete PNG"),
    ] {
        let line = format!("lamp print-sim job/ --truth {truth} -o m.csv");
        scratch.run(&line).is_refused_with(&[words]);
    }
    let over = "lamp print-sim job/ --truth camera.toml -o square.png";
    scratch.run(over).is_wrong_usage(&["square.png"]);
}

#[test]
fn a_flat_field_is_as_wide_as_the_images() {
    let scratch = with_stairs();
    let even = printed(&scratch, "");
    // An even field of any level and size changes nothing.
    picture(&scratch, "light.png", 3, vec![9000; 6]);
    scratch.write("field.toml", b"flat-field = 'light.png'\n");
    assert_eq!(printed(&scratch, "--truth field.toml"), even);
    // A field with a dark half cures less, and more of the bright half.
    picture(&scratch, "light.png", 2, vec![60_000, 20_000]);
    let field = printed(&scratch, "--truth field.toml");
    assert!(field["under_px"].as_u64() > even["under_px"].as_u64(), "{field} {even}");
    assert!(field["over_px"].as_u64() > even["over_px"].as_u64(), "{field} {even}");
    scratch.write("layer.toml", b"layer-picture = 'light.png'\n");
    let layer = "lamp print-sim job/ --truth layer.toml -o m.csv";
    scratch.run(layer).is_refused_with(&["layer.toml: the layers' images differ"]);
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

const PLACES: &str = "
    [[place]]
    name = 'step'
    x = '4.05mm'
    y = '1.45mm'

    [[place]]
    name = 'roof'
    x = '2.05mm'
    y = '1.45mm'
    z = ['0mm', '3.3mm']

    [[place]]
    name = 'wide'
    y = '1.45mm'
    z = '5.03mm'
    wanted = '2mm'
    ";

#[test]
fn sizes_of_places_are_learned_from() {
    let scratch = with_stairs();
    scratch.write("places.toml", PLACES.as_bytes());
    let print = || -> Value {
        let line = "lamp print-sim job/ --truth plant.toml --places places.toml --noise 3um --json -q \
                    -o sizes.toml";
        serde_json::from_slice(&scratch.run(line).succeeds().stdout).unwrap()
    };
    let first = print();
    assert_eq!((&first["places"], &first["measured_px"]), (&3.into(), &Value::Null));
    // The plant's material cures the same, as lamp cure has it.
    let mut pegda =
        String::from_utf8(scratch.run("lamp material show pegda-sudan").succeeds_quietly().stdout)
            .unwrap();
    for (number, factor) in [(877.938, 1.25), (7.266, 0.85), (7.394, 1.1)] {
        assert!(pegda.contains(&number.to_string()), "{number} {pegda}");
        pegda = pegda.replace(&number.to_string(), &format!("{}", number * factor));
    }
    scratch.write("plant-resin.toml", pegda.as_bytes());
    let cure = "lamp cure timed.tif --material plant-resin.toml --places sizes.toml --json";
    let cured: Value = serde_json::from_slice(&scratch.run(cure).succeeds().stdout).unwrap();
    for place in cured["places"].as_array().unwrap() {
        let [white, measured] = ["white", "measured"].map(|key| place[key].as_f64().unwrap());
        // Four deviations, and whole pixels of the width.
        let close = if place["name"] == "wide" { 112.0 } else { 12.0 };
        assert!((white - measured).abs() < close, "{place}");
    }
    let learn = "lamp learn job/ --measured sizes.toml --report learn.json -q -o next.csv";
    scratch.run(learn).succeeds();
    let report: Value = serde_json::from_slice(&scratch.bytes("learn.json")).unwrap();
    for (state, truth) in report["state"].as_array().unwrap().iter().zip([1.25, 1.1 / 0.85, 1.0]) {
        let [low, high] = [0, 1].map(|end| state["interval"][end].as_f64().unwrap());
        let slack = (high - low) / 4.0;
        assert!(low - slack < truth && truth < high + slack, "{state}");
    }
    let second = print();
    let rms = |answer: &Value| answer["rms_um"].as_f64().unwrap();
    assert!(rms(&second) < 0.5 * rms(&first), "{first} {second}");
    // Counts and places of one print; again, it is the same.
    printed(&scratch, "--truth plant.toml --noise 2%");
    let both = "lamp learn job/ --measured measured.csv --measured sizes.toml -q -o last.csv";
    scratch.run(both).succeeds();
    let last = scratch.bytes("last.csv");
    scratch.run(&format!("{both} --plot learn.svg")).succeeds();
    assert_eq!(scratch.bytes("last.csv"), last);
    assert_eq!(printed(&scratch, "")["print"], 2);
}

#[test]
fn places_that_have_no_size_are_refused() {
    let scratch = with_stairs();
    scratch.write("places.toml", PLACES.as_bytes());
    scratch.write("areas.csv", b"layer,over_px,under_px\n1,2,3\n");
    scratch.write("beside.toml", b"[[place]]\nname = 'p'\nx = '99mm'\ny = '1mm'\n");
    scratch.write("over.toml", PLACES.replace("5.03mm", "50mm").as_bytes());
    scratch.write("known.toml", PLACES.replace("'2mm'", "'2mm'\nmeasured = '2mm'").as_bytes());
    let before = scratch.names();
    for (line, words) in [
        ("lamp print-sim job/ --places beside.toml -o m.toml", "the place p: it is outside"),
        ("lamp print-sim job/ --places over.toml -o m.toml", "no layer is at a height of 50 mm"),
        ("lamp print-sim job/ --places areas.csv -o m.toml", "areas.csv: line 1"),
        ("lamp learn job/ --measured places.toml -o n.csv", "no place states a `measured` size"),
        ("lamp learn job/ --measured known.toml --law single -o n.csv", "is for wrong pixels"),
    ] {
        scratch.run(line).is_refused_with(&[words]);
    }
    let areas = "lamp learn job/ --measured areas.csv -o n.csv";
    for (line, words) in [
        ("lamp print-sim job/ --places places.toml -o m.csv", "end its name in .toml"),
        ("lamp print-sim job/ --heights 9 -o m.toml", "end its name in .csv"),
        ("lamp print-sim job/ --places places.toml --noise 2% -o m.toml", "is a length"),
        ("lamp print-sim job/ --places places.toml -o places.toml", "that is an input"),
        (&format!("{areas} --measured areas.csv"), "one is a table"),
        (&format!("{areas} --measured known.toml --measured areas.csv"), "once, or twice"),
    ] {
        scratch.run(line).is_wrong_usage(&[words]);
    }
    assert_eq!(scratch.names(), before);
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
        ("--noise 2um -o m.csv", "a length is for --heights and --places"),
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
