//! Checks the poses that `lamp orient` compares.

use lamp_fixtures::{Defect, Mesh, inject, mug, needle, ring, twin_islands};
use lamp_tests::Scratch;
use serde_json::Value;

fn with(name: &str, mesh: &Mesh) -> Scratch {
    let scratch = Scratch::new();
    scratch.mesh(name, mesh);
    scratch
}

fn answer(scratch: &Scratch, line: &str) -> Value {
    let answer: Value = serde_json::from_slice(&scratch.run(line).succeeds().stdout).unwrap();
    assert_eq!(answer["schema"], "lamp-orient-2");
    answer
}

fn poses(answer: &Value) -> &Vec<Value> {
    answer["orientations"].as_array().unwrap()
}

#[test]
fn the_best_pose_of_a_needle_has_no_island() {
    let scratch = with("needle.stl", &needle(500));
    let answer = answer(&scratch, "lamp orient needle.stl --directions 60 --best 3 --json");
    assert_eq!(
        (&poses(&answer)[0]["rotate"], &poses(&answer)[0]["islands"]),
        (&"".into(), &1.into())
    );
    let best = answer["best"].as_str().unwrap();
    let rank = poses(&answer).iter().find(|pose| pose["rotate"] == best).unwrap();
    assert_eq!((&rank["islands"], &rank["image_islands"]), (&0.into(), &0.into()));
    let check = format!("lamp check needle.stl --rotate {best} --dpi 200 --only islands --strict");
    scratch.run(&check).succeeds();
    let as_it_is = "lamp check needle.stl --dpi 200 --only islands --strict";
    assert_eq!(scratch.run(as_it_is).statuses, [Some(3)]);
}

#[test]
fn images_have_the_islands_that_the_mesh_tells() {
    for (mesh, islands) in [(ring(500), 1), (twin_islands(500), 2), (mug(2_000), 1)] {
        let scratch = with("part.stl", &mesh);
        let answer = answer(&scratch, "lamp orient part.stl --directions 0 --best 6 --json");
        assert_eq!(poses(&answer).len(), 6);
        assert_eq!(poses(&answer)[0]["islands"], islands);
        let sliced: Vec<_> =
            poses(&answer).iter().filter(|pose| !pose["image_islands"].is_null()).collect();
        assert!(!sliced.is_empty());
        for pose in sliced {
            assert_eq!(pose["image_islands"], pose["islands"], "{pose}");
        }
    }
}

/// A pose's height and footprint equal the stack's that its rotation gives.
#[test]
fn slicing_with_the_rotation_gives_the_pose() {
    let scratch = with("mug.stl", &mug(1_000));
    let line = "lamp orient mug.stl --rotate z:30 --directions 9 --best 0 --json";
    let answer = answer(&scratch, line);
    for pose in poses(&answer).iter().skip(7) {
        let rotate = pose["rotate"].as_str().unwrap();
        assert!(rotate.starts_with("z:30,"), "{rotate}");
        scratch
            .run(&format!(
                "slice mug.stl --rotate {rotate} --dpi 254 --thickness 1mm -o turned.tif"
            ))
            .succeeds_quietly();
        let info = scratch.run("lamp info turned.tif --json").succeeds().stdout;
        let info: Value = serde_json::from_slice(&info).unwrap();
        let height = pose["height_mm"].as_f64().unwrap();
        assert!((info["layers"].as_f64().unwrap() - height).abs() <= 1.0);
        // A margin of one pixel, and the width is a multiple of 32.
        let [width, depth] = [0, 1].map(|k| pose["footprint_mm"][k].as_f64().unwrap() * 10.0);
        let sides = ["width_px", "height_px"].map(|side| info[side].as_f64().unwrap());
        assert!((sides[0] - width - 2.0) < 33.0 && sides[0] > width, "{sides:?} {width}");
        assert!((1.0..4.0).contains(&(sides[1] - depth)), "{sides:?} {depth}");
    }
}

#[test]
fn threads_change_nothing_and_a_cone_holds_its_directions() {
    let scratch = with("mug.stl", &mug(1_000));
    let line = "lamp orient mug.stl --cone 30deg --directions 50 --plot islands.svg --best 1";
    let one = scratch.run(&format!("{line} --threads 1")).succeeds().stdout;
    let drawn = scratch.bytes("islands.svg");
    let three = scratch.run(&format!("{line} --threads 3")).succeeds().stdout;
    assert_eq!((one.clone(), drawn), (three, scratch.bytes("islands.svg")));
    let said = String::from_utf8(one).unwrap();
    assert!(
        said.starts_with("mug.stl: 51 orientations; ") && said.contains("(as it is)"),
        "{said}"
    );
    let answer = answer(&scratch, &format!("{line} --json"));
    let cosine = 30f64.to_radians().cos() - 1e-3;
    assert!(poses(&answer).iter().all(|pose| pose["up"][2].as_f64().unwrap() > cosine));
}

#[test]
fn broken_meshes_are_measured_or_refused_in_a_sentence() {
    let mut open = mug(1_000);
    inject(&mut open, Defect::Drop, 50, 7);
    let scratch = with("open.stl", &open);
    scratch.run("lamp orient open.stl --directions 20 --best 1").succeeds();
    let mut nan = mug(1_000);
    nan.facets[12][1] = [f32::NAN; 3];
    scratch.mesh("nan.stl", &nan);
    scratch.run("lamp orient nan.stl --directions 20").is_refused_with(&["nan.stl", "facet 12"]);
    scratch.mesh("none.stl", &Mesh::default());
    scratch.run("lamp orient none.stl").is_refused_with(&["none.stl"]);
}

#[test]
fn wrong_options_are_told_before_the_work() {
    let scratch = Scratch::new();
    for (options, words) in [
        ("--cone 200deg", ["--cone", "200deg"]),
        ("--max-overhang-angle 91", ["--max-overhang-angle", "90 degrees"]),
        ("--plot islands.pdf", ["islands.pdf", ".svg"]),
        ("--directions 1e9", ["--directions", "1e9"]),
    ] {
        scratch.run(&format!("lamp orient none.stl {options}")).is_wrong_usage(&words);
    }
}
