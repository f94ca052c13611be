//! Checks `lamp mesh check` and `lamp mesh repair` on sample parts, defects and other programs'
//! files.

use std::f64::consts::PI;
use std::fs;

use lamp_fixtures::{Defect, Mesh, Sample, StepSample, StepUnit, build, inject, sphere, step};
use lamp_tests::{Ran, Scratch, note, shared_data};
use serde_json::{Value, json};

fn check(scratch: &Scratch, words: &str) -> Value {
    let ran = scratch.run(&format!("lamp mesh check {words} --json")).succeeds();
    let found: Value = serde_json::from_slice(&ran.stdout).unwrap();
    assert_eq!(found["schema"], "lamp-mesh-2");
    found
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn spoiled(good: &Mesh, defect: Defect, count: usize) -> Mesh {
    let mut mesh = good.clone();
    inject(&mut mesh, defect, count, 4);
    mesh
}

fn text(ran: &Ran) -> String {
    String::from_utf8(ran.stdout.clone()).unwrap()
}

#[test]
fn sample_parts_are_clean_and_have_their_volumes() {
    let scratch = Scratch::new();
    for sample in Sample::ALL {
        let mesh = build(sample, sample.min_facets().max(30_000)).unwrap();
        scratch.mesh("part.stl", &mesh);
        scratch.run("lamp mesh check part.stl --strict --self-intersections").succeeds_quietly();
        let found = check(&scratch, "part.stl");
        assert_eq!((&found["clean"], &found["counts"]["lumps"]), (&json!(true), &json!(1)));
        assert_eq!(found["facets"], json!(mesh.facets.len()));
        let volume = number(&found["lumps"][0]["mass"]["volume_mm3"]);
        assert!((volume / mesh.volume_mm3() - 1.0).abs() < 1e-9, "{sample:?}");
    }
}

#[test]
fn a_check_speaks_of_shells_in_millimetres() {
    let scratch = Scratch::new();
    // Two balls; the inner one is a void.
    let mut mesh = sphere(10.0, 20_000);
    let inner = sphere(5.0, 5_000).map(|[x, y, z]| [x, -y, z + 5.0]);
    mesh.facets.extend(inner.facets);
    scratch.mesh("balls.stl", &mesh);
    let ran = scratch.run("lamp mesh check balls.stl --strict").succeeds_quietly();
    for words in ["shells:     2\n", "lumps:      1 with 1 void, ", "faults:     none\n"] {
        assert!(text(&ran).contains(words), "{ran:?}");
    }
    assert!(text(&ran).contains("Euler number 2; a void, within shell 1\n"), "{ran:?}");
    let found = check(&scratch, "balls.stl --units inch");
    let mass = &found["lumps"][0]["mass"];
    let expected = 4.0 / 3.0 * PI * (1000.0 - 125.0) * 25.4f64.powi(3);
    assert!((number(&mass["volume_mm3"]) / expected - 1.0).abs() < 2e-3);
    assert!((number(&mass["center_mm"][2]) / 254.0 - 1.0).abs() < 1e-6);
}

#[test]
fn strict_ends_with_status_3_and_still_answers() {
    let scratch = Scratch::new();
    scratch.mesh("hole.stl", &spoiled(&sphere(10.0, 2_000), Defect::Drop, 2));
    let ran = scratch.run("lamp mesh check hole.stl --strict");
    assert_eq!(ran.statuses, [Some(3)]);
    assert_eq!(ran.stderr, "error: mesh: hole.stl: its mesh has faults\n");
    for words in
        ["2 loops of boundary edges; the longest has 3 edges, ", "  volume:   not closed: 6 sides"]
    {
        assert!(text(&ran).contains(words), "{ran:?}");
    }
    scratch.run("lamp mesh check hole.stl").succeeds_quietly();
    let found = check(&scratch, "hole.stl");
    assert_eq!(found["counts"]["boundary_loops"], 2);
    let mut loops = found["boundary_loops"].as_array().unwrap().iter();
    assert!(loops.all(|it| it["boundary_edges"] == 3 && it["closed"] == true));
    scratch.mesh("doubled.stl", &spoiled(&sphere(10.0, 2_000), Defect::Duplicate, 1));
    let ran = scratch.run("lamp mesh check doubled.stl").succeeds_quietly();
    assert!(text(&ran).contains("3 non-manifold edges; the first has 3 facets, from ("), "{ran:?}");
    let found = check(&scratch, "doubled.stl");
    assert_eq!(found["counts"]["non_manifold_edges"], 3);
    assert_eq!(found["non_manifold_edges"][2]["facets"].as_array().unwrap().len(), 3);
}

#[test]
fn step_bodies_are_checked_each_by_itself() {
    let scratch = Scratch::new();
    scratch.write("block.step", step(StepSample::Block, StepUnit::Inch).as_bytes());
    let found = check(&scratch, "block.step");
    assert_eq!((&found["clean"], &found["bodies"]), (&json!(true), &json!(1)));
    assert!((number(&found["lumps"][0]["mass"]["volume_mm3"]) - 6000.0).abs() < 1e-3);
    let refused = scratch.run("lamp mesh check block.step --units inch");
    refused.is_wrong_usage(&["block.step: a STEP or 3MF file states its own unit"]);
}

#[test]
fn facets_through_each_other_are_found_on_request() {
    let scratch = Scratch::new();
    let mut mesh = sphere(10.0, 2_000);
    mesh.facets.extend(sphere(10.0, 2_000).map(|[x, y, z]| [x + 7.0, y + 0.1, z]).facets);
    scratch.mesh("pair.stl", &mesh);
    scratch.run("lamp mesh check pair.stl --strict").succeeds_quietly();
    let ran = scratch.run("lamp mesh check pair.stl --strict --self-intersections");
    assert_eq!(ran.statuses, [Some(3)]);
    assert!(text(&ran).contains("pairs of facets pass through each other: "), "{ran:?}");
}

#[test]
fn each_defect_is_repaired_and_reported() {
    let scratch = Scratch::new();
    let good = sphere(10.0, 4_000);
    for (defect, action) in [
        (Defect::Drop, "added"),
        (Defect::Flip, "turned"),
        (Defect::Duplicate, "dropped-doubled"),
        (Defect::Nudge { by_mm: 0.004 }, "moved"),
        (Defect::Gap { by_mm: 0.1 }, "dropped-alone"),
    ] {
        let mesh = spoiled(&good, defect, 9);
        scratch.mesh("bad.stl", &mesh);
        let line = "lamp mesh repair bad.stl -o good.stl --weld 5um --close 3mm --report report.json --strict";
        let ran = scratch.run(line).succeeds();
        assert!(ran.stderr.starts_with("mesh repair: facets: "), "{ran:?}");
        scratch.run("lamp mesh check good.stl --strict").succeeds_quietly();
        let report: Value = serde_json::from_slice(&scratch.bytes("report.json")).unwrap();
        assert_eq!(report["schema"], "lamp-mesh-repair-2");
        let touched = report["touched"].as_array().unwrap();
        let of_action = touched.iter().filter(|it| it["action"] == action).count();
        assert_eq!(json!(of_action), report["repair_actions"][action], "{defect:?}");
        assert!(of_action >= 9, "{defect:?}");

        let ran =
            scratch.run("lamp mesh repair good.stl -o again.stl --weld 5um --close 3mm").succeeds();
        assert_eq!(ran.stderr, "mesh repair: no facet was touched\n");
        assert!(scratch.bytes("again.stl") == scratch.bytes("good.stl"));
    }
}

#[test]
fn a_mesh_without_faults_keeps_its_bytes() {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 5_000);
    // Parts that a rewritten file would lose: a header and attributes.
    let mut binary = scratch.bytes("tower.stl");
    (binary[3], binary[84 + 48]) = (b'!', 17);
    let facet = |corners: &str| {
        let corners: String =
            corners.split(' ').map(|c| format!("vertex {}\n", c.replace(',', " "))).collect();
        format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    };
    let ascii: String =
        ["0,0,0 0,1,0 1,0,0", "0,0,0 1,0,0 0,0,1", "0,0,0 0,0,1 0,1,0", "1,0,0 0,1,0 0,0,1"]
            .map(facet)
            .concat();
    let ascii = format!("solid  mine\n{ascii}endsolid mine\n");
    for bytes in [&binary[..], ascii.as_bytes()] {
        scratch.write("in.stl", bytes);
        scratch.run("lamp mesh repair in.stl -o out.stl -q --strict").succeeds_quietly();
        assert!(scratch.bytes("out.stl") == bytes);
        let piped = scratch.run_on("lamp mesh repair - -o - -q", bytes).succeeds_quietly();
        assert!(piped.stdout == bytes);
    }
}

#[test]
fn other_formats_become_stl() {
    let scratch = Scratch::new();
    let obj = "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 0 0 10\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 4 3\n";
    scratch.write("part.obj", obj.as_bytes());
    let ran = scratch.run("lamp mesh repair part.obj -o part.stl").succeeds();
    assert_eq!(ran.stderr, "mesh repair: facets: 1 turned\n");
    assert_eq!(scratch.bytes("part.stl").len(), 84 + 4 * 50);
    let found = check(&scratch, "part.stl");
    assert_eq!(found["clean"], json!(true));
    assert!((number(&found["lumps"][0]["mass"]["volume_mm3"]) - 500.0 / 3.0).abs() < 1e-9);
    // One that has no faults, too.
    scratch.write("part.obj", obj.replace("f 2 4 3", "f 2 3 4").as_bytes());
    scratch.run("lamp mesh repair part.obj -o clean.stl -q").succeeds_quietly();
    assert_eq!(scratch.bytes("clean.stl").len(), 84 + 4 * 50);
}

#[test]
fn what_cannot_be_mended_is_told() {
    let scratch = Scratch::new();
    scratch.mesh("hole.stl", &spoiled(&sphere(10.0, 2_000), Defect::Drop, 1));
    let ran = scratch.run("lamp mesh repair hole.stl -o out.stl --close 10um --strict");
    assert_eq!(ran.statuses, [Some(3)]);
    assert!(ran.stderr.contains("left: 1 loop of boundary edges; it has 3 edges, "), "{ran:?}");
    assert!(scratch.bytes("out.stl") == scratch.bytes("hole.stl"));

    let nothing = Mesh { facets: vec![[[0.0; 3]; 3]; 2] };
    scratch.mesh("nothing.stl", &nothing);
    let refused = scratch.run("lamp mesh repair nothing.stl -o none.stl");
    refused.is_refused_with(&["nothing.stl: a repair would drop all of its last 2 facets"]);
    assert!(!scratch.names().contains(&"none.stl".to_owned()));
    let refused = scratch.run("lamp mesh repair hole.stl -o hole.stl");
    refused.is_wrong_usage(&["hole.stl: that is an input"]);
}

#[test]
fn a_large_weld_and_an_unlikely_unit_are_doubted() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 100);
    let ran = scratch.run("lamp mesh repair cube.stl -o out.stl --weld 40um").succeeds();
    assert!(
        ran.stderr.contains("up to 0.040 mm apart") && ran.stderr.contains("--weld"),
        "{ran:?}"
    );
    let ran = scratch.run("lamp mesh repair cube.stl -o out.stl --weld 30um").succeeds();
    assert!(!ran.stderr.contains("apart become one"), "{ran:?}");
    // 20 m, and 20 um.
    for (units, words) in [("m", "larger than any machine"), ("um", "smaller than any casting")] {
        let ran = scratch.run(&format!("lamp mesh repair cube.stl -o out.stl --units {units}"));
        let ran = ran.succeeds();
        assert!(ran.stderr.contains(words) && ran.stderr.contains("--units mm"), "{ran:?}");
    }
}

#[test]
fn other_programs_files_have_findings_or_sentences() {
    let Some(folder) = shared_data("stl") else { return note("no folder of other STL files") };
    let scratch = Scratch::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, scratch.path("part.stl")).unwrap();
        let ran = scratch.run("lamp mesh check part.stl --json");
        if ran.statuses == [Some(1)] {
            ran.is_refused_with(&["part.stl"]);
            continue;
        }
        ran.succeeds();
        let ran = scratch.run("lamp mesh repair part.stl -o out.stl -q");
        if ran.statuses == [Some(0)] {
            let again = scratch.run("lamp mesh repair out.stl -o again.stl").succeeds();
            assert!(again.stderr.contains("mesh repair: no facet was touched\n"), "{again:?}");
        }
    }
}
