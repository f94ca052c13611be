//! Checks parts that are scaled, mirrored, rotated and moved, and several parts at once.

use lamp_fixtures::{Mesh, Sample, sphere, torus};
use lamp_stack::{Layer, StackInfo};
use lamp_tests::{Scratch, masks};

const COARSE: &str = "--dpi 100 --thickness 1mm";

fn stack_info(layers: &[Layer]) -> &StackInfo {
    layers[0].info.stack.as_ref().expect("the first page speaks of the stack")
}

#[test]
fn a_part_is_scaled_mirrored_turned_and_moved_in_this_order() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 64);
    // The cube, 20 mm wide around the z axis on z = 0, comes to x -1 to 1, y
    // -10 to 10, z 0 to 5; to z -5 to 0; to x -10 to 10, y -1 to 1; to y -5
    // to 0, z -1 to 1; and away.
    let scaled = "--scale 0.1,1,0.25 --mirror z --rotate z:90,x:-90 --translate 1000,-20,7.5";
    let other =
        "--translate 1000,-20,7.5 --rotate z:90 --rotate X:-450 --mirror z --scale .1,1,.25";
    let sliced = |options| {
        let line = format!("slice cube.stl --dpi 254 --thickness 100um --plane middle {options}");
        scratch.run(&format!("{line} -o out.tif")).succeeds_quietly();
        scratch.layers("out.tif")
    };
    let layers = sliced(scaled);
    assert_eq!(layers.len(), 20);
    assert_eq!(layers[0].info.z_um, Some(6500.0));
    let [x0, y1] = layers[0].info.origin_mm.unwrap();
    assert!((x0 - 989.9).abs() < 1e-5 && (y1 + 19.9).abs() < 1e-5, "{x0}, {y1}");
    assert!(masks(&layers) == masks(&sliced(other)));
}

#[test]
fn the_stack_remembers_where_the_part_was_put() {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 2_000);
    scratch.run(&format!("slice tower.stl {COARSE} -o plain.tif")).succeeds_quietly();
    let placed = "--scale 2 --mirror x,z --rotate x:90,z:-12.5 --translate -5,0,12.7";
    scratch.run(&format!("slice tower.stl {COARSE} {placed} -o placed.tif")).succeeds_quietly();
    let command = |name| stack_info(&scratch.layers(name)).commands[0].clone();
    let full = placed.replace("--scale 2", "--scale 2,2,2");
    assert_eq!(command("placed.tif").replace(&format!(" {full}"), ""), command("plain.tif"));
    // The record is a command that runs.
    let again = scratch.run(&command("placed.tif")).succeeds().stdout;
    assert!(again == scratch.bytes("placed.tif"));
}

#[test]
fn several_parts_are_sliced_as_one() {
    let scratch = Scratch::new();
    let parts = [torus(20.0, 8.0, 3_000), sphere(15.0, 2_000)];
    let both = Mesh { facets: parts.iter().flat_map(|part| part.facets.clone()).collect() };
    for (name, mesh) in [("a.stl", &parts[0]), ("b.stl", &parts[1]), ("both.stl", &both)] {
        scratch.mesh(name, mesh);
    }
    for fill in ["even-odd", "solid"] {
        let sliced = |parts: &str| format!("slice {parts} {COARSE} --fill {fill} -o out.tif");
        scratch.run(&sliced("both.stl")).succeeds();
        let expected = scratch.layers("out.tif");
        let ran = scratch.run(&sliced("a.stl b.stl")).succeeds();
        assert_eq!(ran.stderr.contains("boxes of a.stl and b.stl overlap"), fill == "even-odd");
        let layers = scratch.layers("out.tif");
        assert!(masks(&layers) == masks(&expected));
        let StackInfo { part, commands, digest, .. } = stack_info(&layers);
        assert_eq!(part, "a+b");
        assert!(commands[0].starts_with("slice a.stl b.stl --dpi 100 "), "{commands:?}");
        assert_ne!(digest, &stack_info(&expected).digest);
        scratch.run_on(&sliced("a.stl -"), &scratch.bytes("b.stl")).succeeds();
        assert!(masks(&scratch.layers("out.tif")) == masks(&expected));
        assert_eq!(&stack_info(&scratch.layers("out.tif")).digest, digest);
    }
}
