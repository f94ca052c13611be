//! Checks what `lamp learn` and `lamp print-sim` make of plans of ECPL.

use lamp_tests::Scratch;
use serde_json::Value;

const MACHINE: &str = "--projector sharp.toml --material tmpta -q";

/// A folder with a job of a lens that plans quickly, by a projector that blurs by 8 um in a low
/// chamber.
fn with_job() -> Scratch {
    let scratch = Scratch::new();
    let lens = "name = 'small'\ndescription = 'a'\n[[lens]]\ndiameter = '120 um'\nsag = '20 um'\n";
    scratch.write("small.toml", lens.as_bytes());
    scratch.write("plant.toml", b"oxygen = '-30%'\n");
    let projector = scratch.run("lamp projector show jariwala").succeeds_quietly().stdout;
    let sharper = String::from_utf8(projector).unwrap().replace("25.2 um", "8 um");
    scratch.write("sharp.toml", sharper.replace("200 um", "40 um").as_bytes());
    scratch.run(&format!("lamp plan ecpl small.toml {MACHINE} -o plan")).succeeds();
    scratch.run(&format!("lamp learn job/ --start plan {MACHINE}")).succeeds();
    scratch
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

fn printed(scratch: &Scratch, job: &str) -> Value {
    let print = "--truth plant.toml --heights 1000 --noise 2um --json -q -o heights.csv";
    json(&scratch.run(&format!("lamp print-sim {job} {print}")).succeeds().stdout)
}

fn rms_um(answer: &Value) -> f64 {
    answer["rms_um"].as_f64().unwrap()
}

#[test]
fn two_prints_teach_the_oxygen_that_a_planner_must_know() {
    let scratch = with_job();
    let mut errors = Vec::new();
    for print in 0..3 {
        let answer = printed(&scratch, "job/");
        assert_eq!(answer["schema"], "lamp-print-sim-rings-1");
        assert_eq!((&answer["print"], &answer["places"]), (&print.into(), &1000.into()));
        assert!((answer["oxygen_mol_per_m3"].as_f64().unwrap() - 0.735).abs() < 1e-9, "{answer}");
        errors.push(rms_um(&answer));
        if print == 2 {
            break;
        }
        let line = format!(
            "lamp learn job/ --measured heights.csv --report learn.json \
                     --plot learn.csv -q -o next{print}"
        );
        let said = String::from_utf8(scratch.run(&line).succeeds().stdout).unwrap();
        assert!(said.contains("oxygen: 0.") && !said.contains("only their ratio"), "{said}");
        let report = json(&scratch.bytes("learn.json"));
        assert_eq!(report["schema"], "lamp-learn-columns-1");
        for state in report["state"].as_array().unwrap() {
            let known = if state["number"] == "oxygen" { 0.7 } else { 1.0 };
            let [low, high] = [0, 1].map(|end| state["interval"][end].as_f64().unwrap());
            let value = state["value"].as_f64().unwrap();
            assert!((value - known).abs() < high - low, "{print}: {state}");
        }
        assert!((report["noise_um"].as_f64().unwrap() - 2.0).abs() < 0.2, "{report}");
        let plot = String::from_utf8(scratch.bytes("learn.csv")).unwrap();
        assert!(plot.contains("critical conversion"), "{plot}");
    }
    // A plan that knows the truth.
    let material = scratch.run("lamp material show tmpta").succeeds_quietly().stdout;
    let material = String::from_utf8(material).unwrap();
    assert!(material.contains("1.05 mol/m3"), "{material}");
    scratch.write("true.toml", material.replace("1.05 mol/m3", "0.735 mol/m3").as_bytes());
    let knowing =
        "lamp plan ecpl small.toml --projector sharp.toml --material true.toml -q -o known";
    scratch.run(knowing).succeeds();
    let known = json(&scratch.bytes("known/report.json"))["measures"]["rms_um"].as_f64().unwrap();
    println!("{errors:?}, {known} by a plan that knows");
    assert!(errors[0] > 2.0 * known, "{errors:?} {known}");
    assert!(errors[2] < 1.2 * known, "{errors:?} {known}");
}

#[test]
fn the_next_plan_can_begin_a_job_and_repeats() {
    let scratch = with_job();
    printed(&scratch, "job/");
    for next in ["one", "two"] {
        scratch.run(&format!("lamp learn job/ --measured heights.csv -q -o {next}")).succeeds();
    }
    assert_eq!(scratch.bytes("one/bitmaps.tif"), scratch.bytes("two/bitmaps.tif"));
    assert_eq!(scratch.bytes("job/print-001.tif"), scratch.bytes("one/bitmaps.tif"));
    scratch.run(&format!("lamp learn other/ --start one {MACHINE}")).succeeds();
    let [first, second] = ["job/", "other/"].map(|job| rms_um(&printed(&scratch, job)));
    assert_eq!(first, second);
}

#[test]
fn what_kinetics_cannot_learn_from_is_refused() {
    let scratch = with_job();
    let learn = |table: &str| scratch.run(&format!("lamp learn job/ --measured {table} -o next"));
    scratch.write("far.csv", b"x_mm,y_mm,z_mm,measured_mm\n9,0,0,0\n");
    learn("far.csv").is_refused_with(&["far.csv", "line 2", "outside"]);
    scratch.write("areas.csv", b"layer,over_px,under_px\n1,2,3\n");
    learn("areas.csv").is_refused_with(&["areas.csv", "learns from heights"]);
    let sim = |truth: &str| {
        scratch.write("other.toml", truth.as_bytes());
        scratch.run("lamp print-sim job/ --truth other.toml -o a.csv")
    };
    sim("flat-field = 'light.png'\n").is_refused_with(&["`flat-field`", "leave it out"]);
    sim("critical-dose = '+5%'\n").is_refused_with(&[
        "other.toml",
        "`critical-dose`",
        "leave it out",
    ]);
    sim("light = '0 W/m2'\n").is_refused_with(&["other.toml", "the light"]);
    let none = "lamp learn new/ --start plan --projector sharp.toml --material pegda-mw700";
    scratch.run(none).is_refused_with(&["pegda-mw700", "[kinetics]"]);
    let settings = String::from_utf8(scratch.bytes("plan/plan.toml")).unwrap();
    scratch.write("plan/plan.toml", settings.replace("target.toml", "../small.toml").as_bytes());
    let astray = format!("lamp learn new/ --start plan {MACHINE}");
    scratch.run(&astray).is_refused_with(&["plan/plan.toml", "`../small.toml`"]);
    assert!(!scratch.path("new").exists());
    let lens = scratch.bytes("job/target.toml");
    let lens = String::from_utf8(lens).unwrap().replace("20 um", "21 um");
    scratch.write("job/target.toml", lens.as_bytes());
    learn("far.csv").is_refused_with(&["job/target.toml", "bring it back"]);
}
