//! Checks what `lamp learn` and `lamp print-sim` make of plans of column cure.

use lamp_stack::write_gray_png;
use lamp_tests::Scratch;
use serde_json::Value;

/// Light that reaches 20 % deeper and is spread wider, and a critical dose 15 % lower.
const PLANT: &str = "penetration-depth = '+20%'\ncritical-dose = '-15%'\nspread = '+20%'\n";
const PRINT: &str = "lamp print-sim job/ --truth plant.toml --noise 1um --json -q -o heights.csv";

/// A folder with a job of a lens.
fn with_job() -> Scratch {
    let scratch = Scratch::new();
    scratch.write("plant.toml", PLANT.as_bytes());
    let plan = "lamp plan column-cure lens --projector zhao --material sl-5510 --optimize height \
                --search-gap 1e-3 -q -o plan";
    scratch.run(plan).succeeds();
    let begin = "lamp learn job/ --start plan --material sl-5510 --projector zhao -q";
    scratch.run(begin).succeeds();
    scratch
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

fn printed(scratch: &Scratch, options: &str) -> Value {
    json(&scratch.run(&format!("{PRINT} {options}")).succeeds().stdout)
}

fn rms_um(answer: &Value) -> f64 {
    answer["rms_um"].as_f64().unwrap()
}

#[test]
fn one_print_teaches_what_a_planner_must_know() {
    let scratch = with_job();
    let mut errors = Vec::new();
    for print in 0..3 {
        let answer = printed(&scratch, "");
        assert_eq!(
            (&answer["schema"], &answer["print"]),
            (&"lamp-print-sim-columns-1".into(), &print.into())
        );
        errors.push(rms_um(&answer));
        let line =
            format!("lamp learn job/ --measured heights.csv --report learn.json -q -o next{print}");
        let said = String::from_utf8(scratch.run(&line).succeeds().stdout).unwrap();
        assert!(said.contains("heights show only their ratio"), "{said}");
        let report = json(&scratch.bytes("learn.json"));
        assert_eq!(report["schema"], "lamp-learn-columns-1");
        for (state, known) in report["state"].as_array().unwrap().iter().zip([1.2, 1.0 / 0.85, 1.2])
        {
            let [low, high] = [0, 1].map(|end| state["interval"][end].as_f64().unwrap());
            let (value, half) = (state["value"].as_f64().unwrap(), (high - low) / 2.0);
            assert!((value - known).abs() < 2.0 * half && half < 0.1, "{print}: {state}");
        }
        let noise = report["noise_um"].as_f64().unwrap();
        assert!((noise - 1.0).abs() < 0.05, "{report}");
        let best = report["best_print"].as_i64().unwrap();
        assert!(if print == 0 { best == 0 } else { best > 0 }, "{report}");
    }
    // The plant prints what the planner that learned the state expects.
    let planned = json(&scratch.bytes("next0/report.json"));
    let planned = planned["bitmaps"]["measures"]["rms_um"].as_f64().unwrap();
    assert!(errors[0] > 3.0 * planned, "{errors:?} {planned}");
    assert!(errors[1] < 1.1 * planned && errors[2] < 1.1 * planned, "{errors:?} {planned}");
    // The next plan can begin another job.
    let begin = "lamp learn other/ --start next0 --material sl-5510 --projector zhao -q";
    scratch.run(begin).succeeds();
}

#[test]
fn a_height_map_teaches_as_a_table_does() {
    let scratch = with_job();
    printed(&scratch, "");
    let table = String::from_utf8(scratch.bytes("heights.csv")).unwrap();
    let rows: Vec<Vec<f64>> = table
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    let columns = rows.iter().filter(|row| row[1] == rows[0][1]).count();
    let level = |row: &Vec<f64>| (row[3] / 0.1 * 255.0).round().clamp(0.0, 255.0) as u8;
    let levels: Vec<u8> = rows.iter().map(level).collect();
    let mut png = Vec::new();
    let [width, height] = [columns, rows.len() / columns].map(|count| count as u32);
    write_gray_png(&mut png, width, height, levels.chunks(columns).map(<[u8]>::to_vec)).unwrap();
    scratch.write("map.png", &png);
    let line = "lamp learn job/ --measured map.png --pixel 10um --full 100um --report learn.json \
                -q -o next";
    scratch.run(line).succeeds();
    let report = json(&scratch.bytes("learn.json"));
    for (state, known) in report["state"].as_array().unwrap().iter().zip([1.2, 1.0 / 0.85, 1.2]) {
        let off = state["value"].as_f64().unwrap() / known - 1.0;
        assert!(off.abs() < 0.1, "{state}");
    }
    // Without a scale there are no heights.
    let no_scale = "lamp learn job/ --measured map.png -o again";
    scratch.run(no_scale).is_wrong_usage(&["needs its scale", "--pixel"]);
}

#[test]
fn mirrors_have_the_light_of_a_picture() {
    let scratch = with_job();
    let print = |truth: &str, options: &str| {
        scratch.write("plant.toml", truth.as_bytes());
        printed(&scratch, options);
        scratch.bytes("heights.csv")
    };
    let light = |left: u8, right: u8| {
        let row: Vec<u8> = (0..1024).map(|at| if at < 512 { left } else { right }).collect();
        let mut png = Vec::new();
        write_gray_png(&mut png, 1024, 768, vec![row; 768].into_iter()).unwrap();
        scratch.write("light.png", &png);
    };
    let even = print("", "");
    light(77, 77);
    assert_eq!(print("flat-field = 'light.png'", ""), even);
    // Far from the middle, heights are as by the light of their side.
    light(240, 160);
    let rows = |table: Vec<u8>| -> Vec<Vec<f64>> {
        let text = String::from_utf8(table).unwrap();
        let cells = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect();
        text.lines().skip(1).map(cells).collect()
    };
    let both = rows(print("flat-field = 'light.png'", ""));
    let (left, right) = (rows(print("light = '+20%'", "")), rows(print("light = '-20%'", "")));
    let most = both.iter().map(|row| row[0]).fold(0.0, f64::max);
    let (mut compared, mut differ) = (0, 0);
    for ((both, left), right) in both.iter().zip(&left).zip(&right) {
        if both[0].abs() > 0.4 * most {
            let of_side = if both[0] < 0.0 { left } else { right };
            assert!((both[3] - of_side[3]).abs() < 1e-4, "{both:?} {of_side:?}");
            compared += 1;
            differ += usize::from((left[3] - right[3]).abs() > 1e-3);
        }
    }
    assert!(compared > 900 && differ > 100, "{compared} {differ}");
    scratch.write("plant.toml", b"layer-picture = 'light.png'");
    let layer = "lamp print-sim job/ --truth plant.toml -o m.csv";
    scratch.run(layer).is_refused_with(&["`layer-picture`, which is not of this job's model"]);
    let mut png = Vec::new();
    write_gray_png(&mut png, 2, 2, vec![vec![9; 2]; 2].into_iter()).unwrap();
    scratch.write("small.png", &png);
    scratch.write("plant.toml", b"flat-field = 'small.png'");
    scratch
        .run(layer)
        .is_refused_with(&["small.png: 2 x 2 pixels, but the display has 1024 x 768"]);
}

#[test]
fn a_job_of_columns_is_repeatable_and_guarded() {
    let scratch = with_job();
    printed(&scratch, "");
    let learn = "lamp learn job/ --measured heights.csv -q -o";
    scratch.run(&format!("{learn} one")).succeeds();
    // The same table once more is the same print.
    scratch.run(&format!("{learn} two")).succeeds();
    assert_eq!(scratch.bytes("one/bitmaps.tif"), scratch.bytes("two/bitmaps.tif"));
    assert_eq!(scratch.bytes("job/print-001.tif"), scratch.bytes("one/bitmaps.tif"));
    for (line, why) in [
        ("lamp learn new/ --start plan --material sl-5510", "--projector"),
        (
            "lamp learn new/ --start plan --material sl-5510 --projector zhao --wanted 9",
            "for stacks",
        ),
        (
            "lamp learn new/ --start job --material sl-5510 --projector zhao",
            "job has no bitmaps.tif",
        ),
        ("lamp learn job/ --measured heights.csv --law single -o three", "--law"),
        ("lamp learn job/ --measured heights.csv -o job/three", "in the job's folder"),
        ("lamp learn job/ --measured heights.csv --pixel 1um --full 1um -o three", "a PNG"),
        ("lamp print-sim job/ --noise 2% -o a.csv", "a length"),
        ("lamp print-sim job/ --body b.tif -o a.csv", "--body"),
    ] {
        scratch.run(line).is_wrong_usage(&[why]);
    }
    let begun = "lamp learn job/ --start plan --material sl-5510 --projector zhao";
    scratch.run(begun).is_refused_with(&["job/ has a job already"]);
    scratch.write("areas.csv", b"layer,over_px,under_px\n1,2,3\n");
    let areas = "lamp learn job/ --measured areas.csv -o three";
    scratch.run(areas).is_refused_with(&["areas.csv", "learns from heights"]);
    scratch.write("far.csv", b"x_mm,y_mm,z_mm,measured_mm\n90,0,0,0\n");
    let far = "lamp learn job/ --measured far.csv -o three";
    scratch.run(far).is_refused_with(&["far.csv", "line 2", "outside"]);
    // Micrometers where millimeters are meant.
    scratch.write("um.csv", b"x_mm,y_mm,z_mm,measured_mm\n0,0,0.05,47\n");
    let um = "lamp learn job/ --measured um.csv -o three";
    scratch.run(um).is_refused_with(&["um.csv", "line 2", "47 mm is too high"]);
    let record = String::from_utf8(scratch.bytes("job/print-001.toml")).unwrap();
    scratch.write("job/print-001.toml", record.replace("value = 1", "value = 2").as_bytes());
    scratch.run(&format!("{learn} four")).is_refused_with(&["bring it back"]);
}
