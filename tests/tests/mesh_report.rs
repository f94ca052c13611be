//! Checks that `slice --report` lists the edges and facets behind unbalanced rows.

use std::collections::BTreeSet;
use std::fs;

use lamp_fixtures::{Defect, Facet, Mesh, inject, torus};
use lamp_tests::{Scratch, note, shared_data, tilted_ball};
use serde_json::{Value, json};

const FINE: &str = "--dpi 600 --thickness 50um";

/// Slices a part and reads its report.
fn report(scratch: &Scratch, parts: &str, options: &str) -> Value {
    let line = format!("slice {parts} {FINE} {options} -o part.tif --report gaps.json");
    let ran = scratch.run(&line).succeeds();
    let report: Value = serde_json::from_slice(&scratch.bytes("gaps.json")).unwrap();
    let rows = report["stray_rows"].as_u64().unwrap();
    if rows == 0 {
        assert_eq!(ran.stderr, "");
    } else {
        let layers = &report["stray_layers"];
        let says = format!(
            "note: slice: {rows} rows in {layers} layers do not balance: the mesh has gaps; \
             fix corrects them, and gaps.json lists the facets\n"
        );
        assert_eq!(ran.stderr, says);
    }
    report
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().unwrap()
}

/// Returns the facets that a report names: file, number and corners.
fn named(report: &Value) -> BTreeSet<(u64, u64, String)> {
    let facets = list(report, "edges").iter().flat_map(|edge| list(edge, "facets"));
    let name = |facet: &Value| {
        let number = |key: &str| facet[key].as_u64().unwrap();
        (number("file"), number("facet"), corners(serde_json::from_value(facet["corners"].clone())))
    };
    facets.map(name).collect()
}

fn corners(facet: Result<Facet, serde_json::Error>) -> String {
    format!("{:?}", facet.expect("three corners"))
}

/// Returns the facets of a mesh that share an edge with a given one.
fn at_edges_of(mesh: &Mesh, facet: &Facet, file: u64) -> BTreeSet<(u64, u64, String)> {
    let shared = |other: &Facet| facet.iter().filter(|corner| other.contains(corner)).count();
    let facets = (0..).zip(&mesh.facets).filter(|(_, other)| shared(other) >= 2);
    facets.map(|(k, other)| (file, k, corners(Ok(*other)))).collect()
}

fn spoiled(mesh: &Mesh, defect: Defect, seed: u64) -> (Mesh, Facet) {
    let mut spoiled = mesh.clone();
    let chosen = inject(&mut spoiled, defect, 1, seed);
    (spoiled, mesh.facets[chosen[0]])
}

fn faults(report: &Value) -> BTreeSet<&str> {
    list(report, "edges").iter().map(|edge| edge["fault"].as_str().unwrap()).collect()
}

#[test]
fn the_neighbours_of_a_hole_are_named_with_their_corners() {
    for seed in 0..4 {
        let scratch = Scratch::new();
        let (broken, hole) = spoiled(&tilted_ball(), Defect::Drop, seed);
        scratch.mesh("ball.stl", &broken);
        let report = report(&scratch, "ball.stl", "");
        assert_eq!(named(&report), at_edges_of(&broken, &hole, 0));
        assert_eq!(faults(&report), ["open"].into());
        assert_eq!(report["files"], json!(["ball.stl"]));
        assert_eq!(report["fill"], json!("solid"));
        for edge in list(&report, "edges") {
            let ends: [[f32; 3]; 2] = serde_json::from_value(edge["ends"].clone()).unwrap();
            assert!(ends[0] != ends[1] && ends.iter().all(|end| hole.contains(end)));
            assert_eq!(list(edge, "facets").len(), 1);
        }
    }
}

#[test]
fn bands_are_those_of_the_pages_and_lie_between_their_ends() {
    let scratch = Scratch::new();
    let (broken, hole) = spoiled(&tilted_ball(), Defect::Drop, 2);
    scratch.mesh("ball.stl", &broken);
    let report = report(&scratch, "ball.stl", "");
    let layers = scratch.layers("part.tif");
    let open = layers.iter().filter(|layer| layer.info.closed == Some(false)).count();
    let stray: usize = layers.iter().map(|layer| layer.info.stray_rows.len()).sum();
    assert!(stray > 0);
    assert_eq!(
        (&report["layers"], &report["open_layers"], &report["stray_rows"]),
        (&json!(layers.len()), &json!(open), &json!(stray))
    );
    let mut bands = list(&report, "bands").iter();
    let span = |axis: usize| {
        let values = hole.map(|corner| f64::from(corner[axis]));
        values.iter().fold(f64::MAX, |a, &b| a.min(b))
            ..values.iter().fold(f64::MIN, |a, &b| a.max(b))
    };
    for layer in &layers {
        for rows in layer.info.stray_rows.chunk_by(|a, b| a + 1 == *b) {
            let band = bands.next().unwrap();
            assert_eq!(band["layer"], json!(layer.info.index));
            assert_eq!(
                (&band["first_row"], &band["last_row"]),
                (&json!(rows[0]), &json!(rows[rows.len() - 1]))
            );
            let top_um = layer.info.z_um.unwrap() + 50.0;
            assert!((band["plane_mm"].as_f64().unwrap() - top_um / 1000.0).abs() < 1e-9);
            let [low, high]: [f64; 2] = serde_json::from_value(band["y_mm"].clone()).unwrap();
            let pitch = 25.4 / 600.0;
            assert!(((high - low) / pitch - rows.len() as f64).abs() < 1e-3);
            // One hole: its two sides.
            let ends = list(band, "ends");
            assert_eq!(ends.len(), 2);
            for (end, side) in ends.iter().zip([high, low]) {
                let [x, y]: [f64; 2] = serde_json::from_value(end["at_mm"].clone()).unwrap();
                assert!((y - side).abs() < pitch, "{band}");
                assert!(span(0).start - 1e-6 <= x && x <= span(0).end + 1e-6);
                assert!(span(1).start - 1e-6 <= y && y <= span(1).end + 1e-6);
            }
        }
    }
    assert_eq!(bands.next(), None);
}

#[test]
fn a_doubled_facet_is_named_with_its_copy_and_its_neighbours() {
    let scratch = Scratch::new();
    let (broken, doubled) = spoiled(&tilted_ball(), Defect::Duplicate, 3);
    scratch.mesh("ball.stl", &broken);
    let report = report(&scratch, "ball.stl", "");
    assert_eq!(named(&report), at_edges_of(&broken, &doubled, 0));
    assert_eq!(faults(&report), ["shared by more than two"].into());
    assert!(list(&report, "edges").iter().all(|edge| list(edge, "facets").len() == 3));
}

#[test]
fn a_flipped_facet_leaves_no_gap() {
    let scratch = Scratch::new();
    let (broken, _) = spoiled(&tilted_ball(), Defect::Flip, 5);
    scratch.mesh("ball.stl", &broken);
    scratch.run(&format!("slice ball.stl {FINE} -q --report gaps.json -o part.tif")).succeeds();
    let clean: Value = serde_json::from_slice(&scratch.bytes("gaps.json")).unwrap();
    assert_eq!((&clean["bands"], &clean["edges"]), (&json!([]), &json!([])));
}

#[test]
fn a_whole_part_has_an_empty_report_and_the_same_stack() {
    let scratch = Scratch::new();
    scratch.mesh("ball.stl", &tilted_ball());
    let report = report(&scratch, "ball.stl", "");
    for key in ["open_layers", "stray_layers", "stray_rows"] {
        assert_eq!(report[key], json!(0), "{key}");
    }
    assert_eq!(report["layers"], json!(scratch.layers("part.tif").len()));
    assert_eq!((&report["bands"], &report["edges"]), (&json!([]), &json!([])));
    let piped = scratch.run(&format!("slice ball.stl {FINE}")).succeeds_quietly().stdout;
    assert!(piped == scratch.bytes("part.tif"));
}

#[test]
fn facets_are_numbered_in_their_own_file() {
    let scratch = Scratch::new();
    scratch.mesh("ring.stl", &torus(9.0, 2.0, 700));
    let (broken, hole) = spoiled(&tilted_ball(), Defect::Drop, 6);
    let mut text = Vec::new();
    broken.write_ascii_stl("ball", &mut text).unwrap();
    scratch.write("ball.stl", &text);
    let report = report(&scratch, "ring.stl ball.stl", "");
    assert_eq!(report["files"], json!(["ring.stl", "ball.stl"]));
    assert_eq!(named(&report), at_edges_of(&broken, &hole, 1));
}

#[test]
fn corners_stay_those_of_the_file_however_the_part_is_placed() {
    let scratch = Scratch::new();
    let (broken, hole) = spoiled(&tilted_ball(), Defect::Drop, 7);
    scratch.mesh("ball.stl", &broken);
    for placed in [
        "--rotate x:31,z:-12.5 --scale 1.5",
        "--mirror z --translate 100,-20,3",
        "--units inch --scale 0.05 --rotate y:90",
    ] {
        let report = report(&scratch, "ball.stl", placed);
        assert_eq!(named(&report), at_edges_of(&broken, &hole, 0), "{placed}");
    }
}

#[test]
fn threads_and_memory_do_not_change_the_report() {
    let scratch = Scratch::new();
    scratch
        .run("lamp sample tower --facets 20k --defect nudge --by 0.2mm --count 500 -o tower.stl")
        .succeeds();
    report(&scratch, "tower.stl", "");
    let expected = scratch.bytes("gaps.json");
    for options in ["--threads 1", "--threads 3 --memory 16MB"] {
        report(&scratch, "tower.stl", options);
        assert!(scratch.bytes("gaps.json") == expected, "{options}");
    }
}

#[test]
fn a_report_needs_a_file_of_its_own() {
    let scratch = Scratch::new();
    let (broken, _) = spoiled(&tilted_ball(), Defect::Drop, 2);
    scratch.mesh("ball.stl", &broken);
    for (options, word) in
        [("--report -", "name a file"), ("-o a.json --report a.json", "the stack is written there")]
    {
        let ran = scratch.run(&format!("slice ball.stl {options}"));
        assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
        assert!(ran.stderr.contains(word), "{ran:?}");
    }
    let ran = scratch.run("slice ball.stl -o part.tif --report no/such/gaps.json");
    ran.is_refused_with(&["no/such/gaps.json"]);
    assert_eq!(scratch.names(), ["ball.stl"]);
    let ran = scratch.run("slice ball.stl -o part.tif").succeeds();
    assert!(ran.stderr.ends_with("; fix corrects them, and --report FILE.json lists the facets\n"));
}

/// A downloaded part whose facets form no closed surface.
#[test]
fn a_soup_is_reported_on() {
    let Some(soup) = shared_data("stl").map(|folder| folder.join("trimesh_soup.stl")) else {
        return note("there is no ../shared/data/stl: skipped");
    };
    let scratch = Scratch::new();
    scratch.write("soup.stl", &fs::read(soup).unwrap());
    let report = report(&scratch, "soup.stl", "");
    let count =
        u64::from(u32::from_le_bytes(scratch.bytes("soup.stl")[80..84].try_into().unwrap()));
    assert!(!list(&report, "bands").is_empty());
    assert!(named(&report).iter().all(|&(file, facet, _)| file == 0 && facet < count));
    for band in list(&report, "bands") {
        assert!(list(band, "ends").len() >= 2, "{band}");
    }
}
