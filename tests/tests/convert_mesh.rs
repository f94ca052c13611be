//! Checks the STEP files that `lamp convert` makes of meshes.

use lamp_fixtures::{Defect, Mesh, StepUnit, cavity_core, closed_void, cup, inject, mug, step};
use lamp_stack::Layer;
use lamp_tests::{Scratch, masks};

fn layers(scratch: &Scratch, part: &str) -> Vec<Layer> {
    let line = format!("slice {part} --dpi 254 --thickness 1mm -q");
    lamp_tests::read_stack(scratch.run(&line).succeeds_quietly().stdout)
}

#[test]
fn the_step_file_slices_as_the_mesh() {
    for mesh in [mug(1_000), cavity_core(2_000), closed_void(1)] {
        let scratch = Scratch::new();
        scratch.mesh("part.stl", &mesh);
        let said = scratch.run("lamp convert part.stl part.step").succeeds().written.concat();
        assert!(said.starts_with("part.step: 1 solid, ") && said.contains(" faces of "), "{said}");
        let (of_mesh, of_step) = (layers(&scratch, "part.stl"), layers(&scratch, "part.step"));
        assert_eq!(of_mesh.len(), of_step.len());
        let differing = masks(&of_mesh).into_iter().zip(masks(&of_step)).filter(|(a, b)| a != b);
        assert_eq!(differing.count(), 0);
        // Same input, same bytes, whatever is named and from wherever it comes.
        let bytes = scratch.bytes("part.step");
        scratch.run("lamp convert part.stl -o again.stp -q --threads 1").succeeds_quietly();
        assert!(scratch.bytes("again.stp") == bytes);
    }
}

#[test]
fn units_scale_the_solid() {
    let scratch = Scratch::new();
    scratch.mesh("cup.stl", &cup(1));
    scratch.run("lamp convert cup.stl cup.step --units inch -q").succeeds_quietly();
    let said = scratch.run("lamp brep cup.step --json").succeeds().stdout;
    let said: serde_json::Value = serde_json::from_slice(&said).unwrap();
    let volume = said["bodies"][0]["volume_mm3"].as_f64().unwrap();
    let exact = (16.0 * 12.0 * 12.0 - 960.0) * 25.4f64.powi(3);
    assert!((volume / exact - 1.0).abs() < 1e-6, "{said}");
}

#[test]
fn heights_are_the_decimals_that_were_meant() {
    let scratch = Scratch::new();
    let meant = |tenths: f32, mm: f64| (0.1 * f64::from(tenths) + mm) as f32;
    let at = |[x, y, z]: [f32; 3]| [meant(x, 1.3), meant(y, -0.7), meant(z, 0.7)];
    let cup = Mesh { facets: cup(1).facets.into_iter().map(|facet| facet.map(at)).collect() };
    scratch.mesh("cup.stl", &cup);
    scratch.run("lamp convert cup.stl cup.step -q").succeeds_quietly();
    let text = String::from_utf8(scratch.bytes("cup.step")).unwrap();
    let points = text.lines().filter(|line| line.contains("CARTESIAN_POINT"));
    for point in points {
        let (_, numbers) = point.split_once("',(").unwrap();
        let is_short = |number: &str| number.trim_end_matches(')').len() <= 5;
        assert!(numbers.trim_end_matches(");").split(',').all(is_short), "{point}");
    }
}

#[test]
fn a_surface_through_itself_is_refused_with_the_place() {
    let scratch = Scratch::new();
    let mut folded = cup(1);
    // The floor of the cup is pushed through its bottom.
    let inner = folded.facets.iter().flatten().map(|p| p[2]).filter(|z| *z > 0.0);
    let floor = inner.fold(f32::INFINITY, f32::min);
    let is_inner =
        |point: &&mut [f32; 3]| point[2] == floor && point[0].abs() < 7.0 && point[1].abs() < 5.0;
    for point in folded.facets.iter_mut().flatten().filter(is_inner) {
        *point = [0.9 * point[0], 0.9 * point[1], -1.0];
    }
    scratch.mesh("folded.stl", &folded);
    let words = ["folded.stl", "passes through itself", "cross by", "--self-intersections"];
    scratch.run("lamp convert folded.stl folded.step").is_refused_with(&words);
    assert_eq!(scratch.names(), ["folded.stl"]);
}

#[test]
fn what_is_no_solid_leaves_no_file() {
    let scratch = Scratch::new();
    let mut open = cup(500);
    inject(&mut open, Defect::Drop, 2, 1);
    scratch.mesh("open.stl", &open);
    let words = ["open.stl", "6 sides", "lamp mesh check", "lamp mesh repair"];
    scratch.run("lamp convert open.stl open.step").is_refused_with(&words);
    let mut turned = cup(500);
    inject(&mut turned, Defect::Flip, 2, 1);
    scratch.mesh("turned.stl", &turned);
    let words = ["turned.stl", "2 facets are turned over", "lamp mesh repair"];
    scratch.run("lamp convert turned.stl turned.step").is_refused_with(&words);
    scratch.write("cube.step", step(lamp_fixtures::StepSample::Cone, StepUnit::Inch).as_bytes());
    scratch
        .run("lamp convert cube.step other.step")
        .is_wrong_usage(&["cube.step", "STEP part already"]);
    scratch.run("lamp convert open.stl open.step --png").is_wrong_usage(&["--png", "stacks"]);
    assert_eq!(scratch.names(), ["cube.step", "open.stl", "turned.stl"]);
}
