//! Checks the surfaces that `lamp mesh-out` writes: their volume, place and holes, and what it
//! refuses.

use lamp_fixtures::{Mesh, Sample, build, sphere, torus};
use lamp_stack::{Image, Layer, MaskBuilder, PageInfo};
use lamp_tests::{Scratch, mask, with_soft_edges};
use serde_json::Value;

fn check(scratch: &Scratch, mesh: &str) -> Value {
    let ran = scratch.run(&format!("lamp mesh check {mesh} --json")).succeeds();
    serde_json::from_slice(&ran.stdout).unwrap()
}

/// Slices a mesh and writes its surface; returns what `lamp mesh check` says of it.
fn surface_of(scratch: &Scratch, mesh: &Mesh, options: &str) -> Value {
    scratch.mesh("part.stl", mesh);
    scratch.run("slice part.stl --dpi 150 --thickness 150um -q -o part.tif").succeeds_quietly();
    scratch.run(&format!("lamp mesh-out part.tif -o out.stl {options}")).succeeds_quietly();
    check(scratch, "out.stl")
}

fn volume(found: &Value) -> f64 {
    found["lumps"][0]["mass"]["volume_mm3"].as_f64().unwrap()
}

#[test]
fn a_ball_keeps_its_volume_and_place() {
    let scratch = Scratch::new();
    let ball = sphere(6.0, 20_000).map(|[x, y, z]| [x + 30.0, y - 20.0, z + 1.0]);
    for (options, share) in [("--cells 32", 0.02), ("--cells 64", 0.01), ("", 0.01)] {
        let found = surface_of(&scratch, &ball, options);
        assert_eq!((&found["clean"], &found["shells"][0]["euler"]), (&true.into(), &2.into()));
        let volume = volume(&found) / ball.volume_mm3();
        assert!((volume - 1.0).abs() < share, "{options}: {volume}");
        let (low, high) = ball.bounds_mm();
        for (k, side) in [low, high].into_iter().enumerate() {
            for axis in 0..3 {
                let at = found["shells"][0]["box_mm"][k][axis].as_f64().unwrap();
                // Half a cell, or a pixel where cells are smaller.
                assert!((at - side[axis]).abs() < 0.2, "{options}: {at} {side:?}");
            }
        }
    }
}

#[test]
fn a_ring_keeps_its_hole_and_a_hollow_its_void() {
    let scratch = Scratch::new();
    let found = surface_of(&scratch, &torus(6.0, 2.0, 20_000), "--cells 64");
    assert_eq!((&found["clean"], &found["shells"][0]["euler"]), (&true.into(), &0.into()));
    let mut hollow = sphere(6.0, 20_000);
    let inner = sphere(3.0, 5_000).map(|[x, y, z]| [x, -y, z + 3.0]);
    hollow.facets.extend(inner.facets);
    let found = surface_of(&scratch, &hollow, "--cells 64");
    assert_eq!((&found["clean"], &found["counts"]["shells"]), (&true.into(), &2.into()));
    assert_eq!(found["shells"][1]["void"], true);
    assert!((volume(&found) / hollow.volume_mm3() - 1.0).abs() < 0.01, "{found}");
}

/// The blade's walls touch in cells: four facets meet in some edges, and none is open.
#[test]
fn a_blade_is_closed_and_slices_into_even_rows() {
    let scratch = Scratch::new();
    let blade = build(Sample::Blade, 50_000).unwrap();
    scratch.mesh("part.stl", &blade);
    scratch.run("slice part.stl --dpi 100 --thickness 500um -q -o part.tif").succeeds_quietly();
    scratch.run("lamp mesh-out part.tif -o out.stl --cells 100").succeeds_quietly();
    let found = check(&scratch, "out.stl");
    for fault in ["open_shells", "boundary_loops", "turned", "inside_out", "doubled", "not_finite"]
    {
        assert_eq!(found["counts"][fault], 0, "{fault}: {}", found["counts"]);
    }
    let crowded = found["non_manifold_edges"].as_array().unwrap();
    assert!(crowded.iter().all(|edge| edge["facets"].as_array().unwrap().len() == 4));
    assert!((volume(&found) / blade.volume_mm3() - 1.0).abs() < 0.03, "{found}");
    scratch.run("slice out.stl --dpi 100 --thickness 500um -q -o again.tif").succeeds_quietly();
    assert!(scratch.layers("again.tif").iter().all(|layer| layer.info.stray_rows.is_empty()));
}

#[test]
fn threads_pipes_and_folders_give_the_same_bytes() {
    let scratch = Scratch::with_tower_and_torus();
    scratch.run("lamp mesh-out torus.tif -o one.stl --threads 1").succeeds_quietly();
    scratch.run("lamp convert torus.tif -q -o pages/").succeeds_quietly();
    for line in [
        "lamp mesh-out torus.tif -o - --threads 3 > other.stl",
        "lamp convert torus.tif -q | lamp mesh-out -o other.stl",
        "lamp mesh-out pages -o other.stl",
    ] {
        scratch.run(line).succeeds_quietly();
        assert!(scratch.bytes("one.stl") == scratch.bytes("other.stl"), "{line}");
    }
}

/// Gray levels at the border of the part shift the surface by parts of a pixel.
#[test]
fn gray_levels_count_by_their_share() {
    let scratch = Scratch::with_tower_and_torus();
    let soft = |layer: Layer| Layer { image: with_soft_edges(mask(&layer)).into(), ..layer };
    scratch.stack("gray.tif", scratch.layers("torus.tif").into_iter().map(soft));
    let [hard, soft] = ["torus", "gray"].map(|name| {
        scratch.run(&format!("lamp mesh-out {name}.tif -o {name}.stl")).succeeds_quietly();
        volume(&check(&scratch, &format!("{name}.stl")))
    });
    assert!(soft != hard && (soft / hard - 1.0).abs() < 0.1, "{soft} {hard}");
}

fn rows(width: u32, rows: &[&[u32]]) -> Image {
    let mut mask = MaskBuilder::new(width);
    rows.iter().for_each(|row| mask.push_row(row).unwrap());
    mask.finish().into()
}

#[test]
fn a_stack_without_heights_is_in_pixels_and_says_so() {
    let scratch = Scratch::new();
    let layer = |index| Layer {
        info: PageInfo { index, ..PageInfo::default() },
        pitch: None,
        image: rows(4, &[&[1, 3], &[1, 3]]).into(),
    };
    scratch.stack("plain.tif", (0..3).map(layer));
    let ran = scratch.run("lamp mesh-out plain.tif -o out.stl").succeeds();
    assert!(ran.stderr.contains("the mesh's unit is a pixel"), "{ran:?}");
    let found = check(&scratch, "out.stl");
    assert_eq!(found["shells"][0]["box_mm"], serde_json::json!([[1.0, 0.0, 0.0], [3.0, 2.0, 3.0]]));
}

#[test]
fn what_cannot_be_written_leaves_no_file() {
    let scratch = Scratch::with_tower_and_torus();
    let whole = scratch.bytes("tower.tif");
    scratch.write("cut.tif", &whole[..whole.len() / 2]);
    let black =
        Layer { info: PageInfo::default(), pitch: None, image: rows(4, &[&[], &[]]).into() };
    scratch.stack("black.tif", [black]);
    let before = scratch.names();
    let refused = |line: &str, words: &[&str]| scratch.run(line).is_refused_with(words);
    refused("lamp mesh-out cut.tif -o out.stl", &["mesh-out: cut.tif: ", "cut off"]);
    refused("lamp mesh-out black.tif -o out.stl", &["black.tif: there is no surface", "--cells"]);
    refused("lamp mesh-out absent.tif -o out.stl", &["absent.tif: "]);
    refused("lamp mesh-out tower.stl -o out.stl", &["tower.stl: this is neither a TIFF"]);
    refused("lamp mesh-out tower.tif -o no/out.stl", &["no/out.stl: "]);
    let wrong = |line: &str, words: &[&str]| scratch.run(line).is_wrong_usage(words);
    wrong("lamp mesh-out tower.tif -o out.obj", &["out.obj: meshes are written as STL"]);
    wrong("lamp mesh-out tower.tif -o tower.tif", &["tower.tif: that is an input"]);
    for cells in ["7", "1025", "-1", "many"] {
        let line = format!("lamp mesh-out tower.tif -o out.stl --cells={cells}");
        wrong(&line, &["is not a number of cells from 8 to 1024"]);
    }
    assert_eq!(scratch.names(), before);
}
