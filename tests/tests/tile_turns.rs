//! Checks builds whose copies lie at angles at which parts are sliced again: `tile --turns 15deg`.

use lamp_fixtures::Plate;
use lamp_stack::{Frame, Layer, Mask, Orientation};
use lamp_tests::{Scratch, mask};
use serde_json::Value;

/// A folder with the stack of a plate, 4 layers at 100 dpi.
fn with_plate(plate: Plate) -> Scratch {
    let scratch = Scratch::new();
    scratch.mesh("plate.stl", &plate.mesh(4.0));
    slice(&scratch, "");
    scratch
}

fn slice(scratch: &Scratch, options: &str) {
    let line = format!("slice plate.stl --dpi 100 --thickness 1mm -q -o plate.tif {options}");
    scratch.run(&line).succeeds();
}

const PLAN: &str = "tile plate.tif --mesh none --gap 1mm --layout-out layout.json -o build.tif";

/// Plans a build, and returns the script.
fn plan(scratch: &Scratch, options: &str) -> String {
    let planned = scratch.run(&format!("{PLAN} {options} -q")).succeeds();
    assert!(!scratch.path("build.tif").exists(), "a plan writes no build");
    String::from_utf8(planned.stdout).unwrap()
}

/// Runs the commands of a script. Returns the stacks of its build.
fn run(scratch: &Scratch, script: &str) -> Vec<String> {
    let lines = script.lines().filter(|line| !line.starts_with('#') && *line != "set -e");
    let lines: Vec<&str> = lines.collect();
    for line in &lines {
        scratch.run(line).succeeds_quietly();
    }
    let last = lines.last().unwrap().split(' ').skip(1);
    last.take_while(|word| !word.starts_with('-')).map(ToOwned::to_owned).collect()
}

/// Returns the number that a script begins with.
fn planned_copies(script: &str) -> usize {
    let comment = script.lines().nth(1).unwrap();
    comment.strip_prefix("# ").unwrap().split(' ').next().unwrap().parse().unwrap()
}

/// A copy on a build: whose image it has, and where.
type Copy = (Mask, u32, u32);

/// Returns the copies of a layer of a build.
fn copies(build: &[Layer], stacks: &[Vec<Layer>], layer: usize) -> Vec<Copy> {
    let tile = &build[0].info.stack.as_ref().unwrap().other["tile"];
    let parts = tile["parts"].as_array().cloned().unwrap_or_else(|| vec![tile.clone()]);
    let number = |value: &Value| value.as_i64().unwrap();
    let of_part = |(part, stack): (&Value, &Vec<Layer>)| {
        let [width, height] = [0, 1].map(|side| number(&part["part_pixels"][side]) as u32);
        let [left, top] = [0, 1].map(|side| number(&part["part_corner"][side]));
        let image = mask(&stack[layer]).framed(Frame { left, top, width, height });
        let places = part["copies"].as_array().unwrap().iter().enumerate();
        let copy = |(k, at): (usize, &Value)| {
            let turn: Orientation = part["turns"][k].as_str().unwrap_or("0").parse().unwrap();
            let [left, top] = [0, 1].map(|side| number(&at[side]) as u32);
            (image.oriented(turn).unwrap(), left, top)
        };
        places.map(copy).collect::<Vec<Copy>>()
    };
    parts.iter().zip(stacks).flat_map(of_part).collect()
}

/// Checks a build pixel by pixel: it is its copies, each white pixel belongs to one, and is farther
/// than the gap from other copies' pixels. Returns the number of copies.
fn check(scratch: &Scratch, stacks: &[String], gap_px: i64) -> usize {
    let build = scratch.layers("build.tif");
    let stacks: Vec<Vec<Layer>> = stacks.iter().map(|stack| scratch.layers(stack)).collect();
    for layer in 0..build.len() {
        let image = mask(&build[layer]);
        let [width, height] = [image.width(), image.height()].map(i64::from);
        let mut owners = vec![usize::MAX; (width * height) as usize];
        let copies = copies(&build, &stacks, layer);
        for (copy, (mask, left, top)) in copies.iter().enumerate() {
            for row in 0..mask.height() {
                for column in (0..mask.width()).filter(|&column| mask.is_white(column, row)) {
                    let (x, y) = (left + column, top + row);
                    assert!(image.is_white(x, y), "a copy is not on the build");
                    let owner = &mut owners[(i64::from(y) * width + i64::from(x)) as usize];
                    assert_eq!(*owner, usize::MAX, "two copies touch at {x} {y}");
                    *owner = copy;
                }
            }
        }
        let owned = owners.iter().filter(|owner| **owner != usize::MAX).count();
        assert_eq!(owned, image.white_pixels() as usize);
        let owner = |x: i64, y: i64| {
            let is_on = (0..width).contains(&x) && (0..height).contains(&y);
            is_on.then(|| owners[(y * width + x) as usize]).filter(|owner| *owner != usize::MAX)
        };
        for y in 0..height {
            for x in 0..width {
                let Some(own) = owner(x, y) else { continue };
                for dy in -gap_px..=gap_px {
                    for dx in (-gap_px..=gap_px).filter(|dx| dx * dx + dy * dy <= gap_px * gap_px) {
                        let met = owner(x + dx, y + dy);
                        assert!(met.is_none_or(|met| met == own), "too near at {x} {y}");
                    }
                }
            }
        }
        if layer + 1 == build.len() {
            return copies.len();
        }
    }
    unreachable!("a build has layers")
}

#[test]
fn the_script_of_a_plan_makes_the_build_that_was_planned() {
    let scratch = with_plate(Plate::Aerofoil);
    // The plate is 62 mm long: it fits only at an angle.
    let area = "--area 60x60mm";
    let script = plan(&scratch, &format!("{area} --turns 45deg"));
    let stacks = run(&scratch, &script);
    assert!(stacks.iter().any(|stack| stack.starts_with("plate-z")), "{script}");
    // A gap of 1 mm is 3.9 pixels, rounded up.
    let copies = check(&scratch, &stacks, 4);
    assert_eq!(copies, planned_copies(&script), "{script}");
    assert!(copies > 1, "{script}");
    scratch
        .run(&format!("tile plate.tif --mesh none --gap 1mm --pack outline {area} -o quarters.tif"))
        .is_refused_with(&["larger than the build area"]);
    assert_eq!(
        scratch.run(&format!("{PLAN} {area} --turns 45deg -q")).succeeds().stdout,
        script.as_bytes()
    );
}

#[test]
fn what_a_stack_was_sliced_with_is_sliced_with_again() {
    let scratch = with_plate(Plate::Aerofoil);
    let again = "--rotate x:180,z:180 --translate 50,-20,4 --margin 7";
    slice(&scratch, again);
    // Aslant alone does it fit.
    let script = plan(&scratch, "--area 52x52mm --copies 1 --turns 45deg");
    let slices: Vec<&str> = script.lines().filter(|line| line.starts_with("slice ")).collect();
    assert_eq!(slices.len(), 1, "{script}");
    assert!(slices[0].contains("--rotate x:180,z:180,z:45 --translate 50,-20,4"), "{script}");
    let stacks = run(&scratch, &script);
    assert_eq!(check(&scratch, &stacks, 4), 1);
    let layers = scratch.layers(&stacks[0]);
    let heights = |layers: &[Layer]| layers.iter().map(|layer| layer.info.z_um).collect::<Vec<_>>();
    assert_eq!(heights(&layers), heights(&scratch.layers("plate.tif")));
}

#[test]
fn turns_that_gain_nothing_take_no_stacks() {
    let scratch = with_plate(Plate::Ring);
    let script = plan(&scratch, "--area 90x90mm --turns 30deg --strict --layers 1..3");
    assert!(
        script.starts_with("#!/bin/sh\n# 4 copies: no more fit with turns of 30deg than"),
        "{script}"
    );
    let tile = script.lines().last().unwrap();
    assert_eq!(
        tile,
        "tile plate.tif --fit --layout layout.json --gap 1mm --mesh none -o build.tif --area 90x90mm \
         --strict --layers 1..3 -q"
    );
    let stacks = run(&scratch, &script);
    assert_eq!(check(&scratch, &stacks, 4), 4);
}

#[test]
fn scripts_take_options_of_a_file_and_names_with_a_hyphen() {
    let scratch = with_plate(Plate::Aerofoil);
    std::fs::rename(scratch.path("plate.tif"), scratch.path("-plate.tif")).unwrap();
    let options = "[tile]\nturns = \"45deg\"\nmesh = \"none\"\ngap = \"1mm\"\narea = \"60x60mm\"\n\
                   layout-out = \"layout.json\"\noutput = \"build.tif\"\n";
    scratch.write("o.toml", options.as_bytes());
    let planned = scratch.run("tile --options o.toml -q -- -plate.tif").succeeds().stdout;
    let script = String::from_utf8(planned).unwrap();
    let stacks = run(&scratch, &script);
    assert!(stacks.iter().any(|stack| stack.starts_with("./-plate-z")), "{script}");
    assert_eq!(check(&scratch, &stacks, 4), planned_copies(&script), "{script}");
}

#[test]
fn plans_name_what_they_cannot_slice_again() {
    let scratch = with_plate(Plate::Aerofoil);
    let line = "tile plate.tif --area 52x52mm --copies 1 --turns 45deg --layout-out l.json";
    scratch.run("tile plate.tif --turns 45deg").is_wrong_usage(&["--layout-out"]);
    scratch.run("tile --turns 45deg --layout-out l.json").is_wrong_usage(&["standard input"]);
    scratch.run("tile plate.tif --turns 7deg").is_wrong_usage(&["7deg", "at most 18"]);
    // The part has changed, or is not there.
    scratch.mesh("plate.stl", &Plate::Ring.mesh(4.0));
    let told = scratch.run(line).succeeds().stderr;
    assert!(told.contains("plate.stl: not found next to its stack as it was sliced"), "{told}");
    scratch.write("cut.toml", b"[[edit]]\nrotate = 90\n");
    scratch.run("lamp edit plate.tif cut.toml -o cut.tif").succeeds();
    scratch
        .run(&line.replace("plate.tif", "cut.tif"))
        .is_refused_with(&["cut.tif: edit", "after slicing"]);
    let bare = scratch.layers("plate.tif").into_iter().map(|mut layer| {
        layer.info.stack = None;
        layer
    });
    scratch.stack("bare.tif", bare);
    scratch
        .run(&line.replace("plate.tif", "bare.tif"))
        .is_refused_with(&["bare.tif: it does not state how it was sliced", "--turns quarters"]);
}
