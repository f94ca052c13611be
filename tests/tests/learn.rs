//! Checks what `lamp learn` makes of measured prints.

use lamp_fixtures::cavity_staircase;
use lamp_tests::Scratch;
use serde_json::Value;

const PLAN: &str =
    "lamp plan speed stairs.tif --material pegda-sudan --search-gap 5% -q -o timed.tif";

/// A folder with a job of the staircase.
fn with_job() -> Scratch {
    let scratch = Scratch::new();
    scratch.stack("stairs.tif", cavity_staircase(1).layers());
    scratch.run(PLAN).succeeds();
    scratch.run("lamp learn job/ --start timed.tif --material pegda-sudan -q").succeeds();
    scratch
}

/// The times of a profile, bottom first.
fn times(scratch: &Scratch, name: &str) -> Vec<f64> {
    let text = String::from_utf8(scratch.bytes(name)).unwrap();
    let rows = text.lines().skip(1).filter(|line| !line.starts_with('#'));
    rows.map(|row| row.split(',').nth(3).unwrap().parse().unwrap()).collect()
}

fn areas(over: impl Fn(u32) -> u32, under: impl Fn(u32) -> u32) -> String {
    let rows = (0..60).map(|layer| format!("{layer},{},{}\n", over(layer), under(layer)));
    "layer,over_px,under_px\n".to_owned() + &rows.collect::<String>()
}

#[test]
fn a_job_keeps_every_print() {
    let scratch = with_job();
    let planned: Vec<_> =
        scratch.layers("timed.tif").iter().map(|layer| layer.info.exposure_ms.unwrap()).collect();
    assert_eq!(times(&scratch, "job/print-000.csv"), planned);
    // Eq. 3.5: each time changes by the gain for each pixel.
    let table = areas(|layer| if layer == 30 { 1000 } else { 0 }, |layer| 100 * (layer % 2));
    scratch.write("a.csv", table.as_bytes());
    let line = "lamp learn job/ --measured a.csv --law single --gain 2e-6 -o next.csv \
                --report learn.json --plot learn.svg";
    let said = String::from_utf8(scratch.run(line).succeeds().stdout).unwrap();
    assert!(said.contains("error of print 0: 4,000 pixels"), "{said}");
    let next = times(&scratch, "next.csv");
    assert_eq!(next, times(&scratch, "job/print-001.csv"));
    for (layer, (next, was)) in next.iter().zip(&planned).enumerate() {
        let error = if layer == 30 { -1000.0 } else { f64::from(100 * (layer as u32 % 2)) };
        let expected = (was + 1000.0 * 2e-6 * error).max(50.0);
        assert!((next - expected).abs() < 2e-3, "{layer}: {next} {expected}");
    }
    let report: Value = serde_json::from_slice(&scratch.bytes("learn.json")).unwrap();
    assert_eq!(report["prints"][0]["error"]["wrong_px"], 4000.0);
    assert_eq!(report["convergence"].as_array().unwrap().len(), 3);
    let plot = String::from_utf8(scratch.bytes("learn.svg")).unwrap();
    assert!(
        plot.contains("Pixels of the part that are not cured, by layer")
            && plot.contains("print 1")
    );
    // The same call gives the same, after a run that did not end.
    let bytes = scratch.bytes("next.csv");
    std::fs::remove_file(scratch.path("next.csv")).unwrap();
    let again = scratch.run(line).succeeds();
    assert!(again.stderr.contains("print 0 was used already"), "{}", again.stderr);
    assert_eq!(scratch.bytes("next.csv"), bytes);
    scratch
        .run("lamp learn job/ --measured a.csv -o next.csv")
        .is_refused_with(&["with other options: print-001.csv exists"]);
    // Two prints may have the same measurements, but rarely have.
    let same = scratch.run("lamp learn job/ --measured a.csv --print 1 --law single -o same.csv");
    let said = same.succeeds().stderr;
    assert!(said.contains("print 1 has the same measurements as print 0"), "{said}");
    scratch.write("b.csv", areas(|_| 20, |_| 0).as_bytes());
    scratch.run("lamp learn job/ --measured b.csv --print 2 -o last.csv").succeeds();
    let last = times(&scratch, "last.csv");
    assert!(last.iter().sum::<f64>() < next.iter().sum());
    for law in ["--law multi", ""] {
        let line = format!("lamp learn job/ --measured c.csv {law} -o last.csv");
        scratch.write("c.csv", format!("# {law}\n{}", areas(|_| 20, |layer| layer)).as_bytes());
        scratch.run(&line).succeeds();
    }
}

#[test]
fn a_gain_that_is_too_large_names_a_safe_one() {
    let scratch = with_job();
    scratch.write("a.csv", areas(|_| 50, |_| 0).as_bytes());
    let line = "lamp learn job/ --measured a.csv --law single --gain 1 -o next.csv";
    let said = String::from_utf8(scratch.run(line).succeeds().stdout).unwrap();
    assert!(said.contains("warning: the norm is above 1"), "{said}");
    assert!(said.contains("the largest safe gain is"), "{said}");
}

#[test]
fn heights_that_are_too_low_shorten_times() {
    let scratch = with_job();
    // The corner of the part in its frame is 0.5 mm off, and layers are 0.1 mm.
    let heights = "x_mm,y_mm,z_mm,measured_mm,sd_um\n\
                   2.05,0.75,1.5,1.0,20\n3.05,0.75,3.0,2.5,20\n4.05,0.75,4.5,4.0,\n2.05,1.55,5.2,4.7,20\n";
    scratch.write("heights.csv", heights.as_bytes());
    let line =
        "lamp learn job/ --measured heights.csv -o next.csv --plot h.svg --report learn.json";
    let said = String::from_utf8(scratch.run(line).succeeds().stdout).unwrap();
    assert!(said.contains("error of print 0: 500 um"), "{said}");
    assert!(said.contains("times the material's; before this print 1.00 ("), "{said}");
    let [was, next] = ["job/print-000.csv", "next.csv"].map(|name| times(&scratch, name));
    assert!(next.iter().sum::<f64>() < 0.95 * was.iter().sum::<f64>());
    let plot = String::from_utf8(scratch.bytes("h.svg")).unwrap();
    assert!(plot.contains("Light and resin that each print was planned for"), "{plot}");
    let report: Value = serde_json::from_slice(&scratch.bytes("learn.json")).unwrap();
    let state = report["state"].as_array().unwrap();
    let of = |number: usize, key: &str| state[number][key].as_f64().unwrap();
    // Faces that are cured too deep got more light, or light that reaches deeper.
    assert!(state.len() == 3 && of(0, "value") * of(1, "value") > 1.1, "{state:?}");
    let width = |key: &str| {
        let ends = state[0][key].as_array().unwrap();
        (ends[1].as_f64().unwrap() / ends[0].as_f64().unwrap()).ln()
    };
    assert!(width("interval") < width("interval_before"), "{state:?}");
    assert_eq!(report["by_layer"].as_array().unwrap().len(), 60);
    let kept = String::from_utf8(scratch.bytes("job/print-001-state.toml")).unwrap();
    assert!(kept.contains("[penetration-depth]"), "{kept}");
    // A law is of wrong pixels.
    scratch.write("more.csv", heights.replace("1.0,20", "1.1,20").as_bytes());
    scratch
        .run("lamp learn job/ --measured more.csv --law single -o law.csv")
        .is_refused_with(&["heights and places teach the state of light and resin"]);
    // Nor may it be missing.
    std::fs::remove_file(scratch.path("job/print-001-state.toml")).unwrap();
    scratch
        .run("lamp learn job/ --measured more.csv -o law.csv")
        .is_refused_with(&["print-001-state.toml: the file is missing: bring it back"]);
    // A state that was changed is no longer what was learned.
    scratch.write("job/print-001-state.toml", kept.replace("0.", "1.").as_bytes());
    scratch
        .run("lamp learn job/ --measured more.csv -o law.csv")
        .is_refused_with(&["print-001-state.toml differs from the file that lamp learn wrote"]);
}

#[test]
fn what_teaches_nothing_is_refused_and_changes_nothing() {
    let scratch = with_job();
    let names = || {
        let mut names: Vec<_> = std::fs::read_dir(scratch.path("job"))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    };
    let before = names();
    for (table, text) in [
        (
            "layer,over_px,under_px\n70,1,0\n",
            "line 2: there is no layer 70: the stack has layers 0 to 59",
        ),
        ("layer,over_px,under_px\n7,1,0\n8,0,0\n7,0,3\n", "line 4: layer 7 is also in line 2"),
        ("layer,over_px,under_px\n7,x,0\n", "line 2, column over_px: `x` is not a number"),
        ("layer,over_px,under_px\n7,,0\n", "line 2, column over_px: `` is not a number"),
        ("layer,over_px,under_px\n7,-1,0\n", "line 2: a number of wrong pixels must be 0 or more"),
        ("layer,over_px,under_px\n7.5,1,0\n", "line 2, column layer: 7.5 is not a layer"),
        (
            "layer,over_px,under_px\n7,1e11,0\n",
            "line 2, column over_px: 100000000000 pixels are more than the",
        ),
        ("layer,over_px,under_px\n7,0,9999\n", "line 2, column under_px: 9999 pixels are more"),
        ("layer,over_px,under_px\n", "there are no measurements below the header"),
        ("layer,over_px\n1,2\n", "there is no column under_px"),
        ("", "the file is empty"),
        (
            "x_mm,y_mm,z_mm,measured_mm\n2.05,0.75,1.6,1\n",
            "line 2, z 1.6 mm: the part has no face there",
        ),
        (
            "x_mm,y_mm,z_mm,measured_mm\n99,0.75,1.5,1\n",
            "the place 99, 0.75 mm is outside the images",
        ),
        ("x_mm,y_mm,z_mm,measured_mm\n1,1,1,NaN\n", "column measured_mm: `NaN` is not a number"),
        (
            "x_mm,y_mm,z_mm,measured_mm\n2.05,0.75,1.5,1\n2.05,0.75,1.5,1.2\n",
            "line 3: this place was measured in line 2, too",
        ),
        (
            "x_mm,y_mm,z_mm,measured_mm,sd_um\n2.05,0.75,1.5,1,1e-9\n",
            "is finer than any measurement",
        ),
    ] {
        scratch.write("bad.csv", table.as_bytes());
        scratch.run("lamp learn job/ --measured bad.csv -o next.csv").is_refused_with(&[text]);
    }
    scratch.write("good.csv", areas(|_| 1, |_| 0).as_bytes());
    for (line, text) in [
        (
            "job/ --measured good.csv --print 3 -o next.csv",
            "print 3 was never planned, and so not printed",
        ),
        (
            "none/ --measured good.csv -o next.csv",
            "there is no job: begin it with lamp learn JOB --start",
        ),
        ("job/ --start timed.tif --material pegda-sudan", "is the job of timed.tif already"),
        (
            "new/ --start stairs.tif --material pegda-sudan",
            "states no exposure, so no profile was printed",
        ),
        ("new/ --start timed.tif --material pegda-mw700", "[spread]"),
        (
            "new/ --start timed.tif --material pegda-sudan --speed 1um/s..10um/s",
            "the platform's speeds are 1 to 10 um/s: give --speed",
        ),
        (
            "new/ --start timed.tif --material pegda-sudan --max-change 1%",
            "1.0 % are allowed: give --speed and --max-change",
        ),
    ] {
        scratch.run(&format!("lamp learn {line}")).is_refused_with(&[text]);
    }
    for line in [
        "job/",
        "job/ --measured good.csv",
        "new/ --start timed.tif",
        "job/ --measured good.csv --gain 1 -o n.csv",
    ] {
        scratch.run(&format!("lamp learn {line}")).is_wrong_usage(&[]);
    }
    assert_eq!(names(), before);
    assert!(!scratch.names().contains(&"next.csv".to_owned()));
    assert!(!scratch.names().contains(&"new".to_owned()));
}

#[test]
fn a_job_is_of_one_stack() {
    let scratch = with_job();
    scratch.run("lamp plan speed stairs.tif --material pegda-sudan --search-gap 5% --layers 0..30 -q -o half.tif").succeeds();
    let other = scratch.run("lamp learn job/ --start half.tif --material pegda-sudan");
    other.is_refused_with(&["whose stack is not half.tif: name another folder"]);
    scratch.write("good.csv", areas(|_| 1, |_| 0).as_bytes());
    std::fs::copy(scratch.path("half.tif"), scratch.path("job/stack.tif")).unwrap();
    scratch
        .run("lamp learn job/ --measured good.csv -o next.csv")
        .is_refused_with(&["this stack differs from the stack of the job"]);
}

/// A job keeps the resin under the lamp that it was printed with.
#[test]
fn a_job_keeps_the_lamp() {
    let scratch = with_job();
    let begin = "lamp learn aged/ --start timed.tif --material pegda-sudan --lamp-intensity 50%";
    let said = scratch.run(begin).succeeds().stderr;
    assert!(said.contains("pegda-sudan does not state how its critical dose follows"), "{said}");
    let of = |job: &str| {
        let text = String::from_utf8(scratch.bytes(&format!("{job}/material.toml"))).unwrap();
        let (_, light) = text.split_once("[intensity]\nvalue = \"").unwrap();
        light.split('"').next().unwrap().to_owned()
    };
    assert_eq!([of("job"), of("aged")], ["7.394 mW/cm2", "3.697 mW/cm2"]);
    let late = "lamp learn job/ --measured a.csv --lamp-intensity 50% -o next.csv";
    scratch.run(late).is_wrong_usage(&["--lamp-intensity"]);
}
