//! Checks that stacks prove themselves: what is missing, moved or changed is named by every reader,
//! and `lamp verify` says what is whole.

use lamp_fixtures::Sample;
use lamp_tests::{Scratch, ask};
use serde_json::{Value, json};

/// A stack of 20 layers, `cube.tif`, and its part.
fn with_cube() -> Scratch {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 200);
    scratch.run("slice cube.stl --dpi 100 --thickness 1mm -o cube.tif").succeeds();
    scratch
}

fn verified(scratch: &Scratch, line: &str) -> String {
    String::from_utf8(scratch.run(line).succeeds_quietly().stdout).unwrap()
}

/// Copies a stack without its checks, as older versions wrote it.
fn without_checks(scratch: &Scratch, from: &str, to: &str) {
    let mut bytes = scratch.bytes(from);
    let key = b",\"check\":";
    while let Some(at) = bytes.windows(key.len()).position(|window| window == key) {
        let end = at + bytes[at..].iter().position(|&byte| byte == 0).unwrap();
        bytes[at..end].fill(b' ');
        bytes[at] = b'}';
    }
    scratch.write(to, &bytes);
}

#[test]
fn a_whole_stack_is_said_to_be_whole() {
    let scratch = with_cube();
    let whole = "whole, 20 layers, z 0.000 to 20.000 mm";
    assert_eq!(verified(&scratch, "lamp verify cube.tif"), format!("cube.tif: {whole}\n"));
    let from_pipe = verified(&scratch, "slice cube.stl --dpi 100 --thickness 1mm | lamp verify");
    assert_eq!(from_pipe, format!("cube (standard input): {whole}\n"));
}

#[test]
fn folders_of_pages_and_of_stacks_are_found() {
    let scratch = with_cube();
    std::fs::create_dir(scratch.path("night")).unwrap();
    for line in [
        "lamp convert cube.tif -o night/pages/",
        "lamp convert cube.tif --png -o night/pictures/",
        "lamp split cube.tif --every 8 -o night/ranges/",
        "slice cube.stl --dpi 100 --thickness 1mm | fix | tile --mesh none -o night/build.tif",
    ] {
        scratch.run(line).succeeds_quietly();
    }
    let found = verified(&scratch, "lamp verify night");
    let names: Vec<&str> = found.lines().map(|line| line.split(':').next().unwrap()).collect();
    let expected = [
        "night/build.tif",
        "night/pages",
        "night/pictures",
        "night/ranges/layers_00000-00007.tif",
        "night/ranges/layers_00008-00015.tif",
        "night/ranges/layers_00016-00019.tif",
    ];
    assert_eq!(names, expected);
    assert!(found.lines().all(|line| line.contains(": whole, ")), "{found}");
}

#[test]
fn strips_are_also_checked_together() {
    let scratch = with_cube();
    let line = "tile cube.tif --area 50x30mm --mesh none --strips strips --mirrors 96";
    scratch.run(line).succeeds_quietly();
    let found = verified(&scratch, "lamp verify strips");
    assert!(found.ends_with("strips: whole, the strips make one build\n"), "{found}");
    std::fs::copy(scratch.path("strips/strip_000.tif"), scratch.path("strips/strip_001.tif"))
        .unwrap();
    let ran = scratch.run("lamp verify strips").is_refused_with(&["1 of 4 stacks is not"]);
    let said = String::from_utf8_lossy(&ran.stdout).into_owned();
    assert!(said.lines().last().unwrap().starts_with("strips: strip_001.tif"), "{said}");
    std::fs::remove_file(scratch.path("strips/strip_001.tif")).unwrap();
    scratch.run("lamp verify strips").is_refused_with(&["1 of 3 stacks is not"]);
}

#[test]
fn a_damaged_stack_hides_no_other_in_its_folder() {
    let scratch = with_cube();
    std::fs::create_dir(scratch.path("night")).unwrap();
    scratch.write("night/a.tif", b"");
    scratch.write("night/b.tif", &scratch.bytes("cube.tif")[..4000]);
    scratch.write("night/c.tif", &scratch.bytes("cube.tif"));
    let ran = scratch.run("lamp verify night").is_refused_with(&["2 of 3 stacks are not"]);
    let said = String::from_utf8_lossy(&ran.stdout).into_owned();
    assert!(said.contains("a.tif: the input is empty"), "{said}");
    assert!(said.contains("night/b.tif: the stack is cut off"), "{said}");
    assert!(said.ends_with("night/c.tif: whole, 20 layers, z 0.000 to 20.000 mm\n"), "{said}");
}

#[test]
fn a_stage_that_never_starts_tells_the_next_one_why() {
    let scratch = with_cube();
    let ran = scratch.run("slice absent.stl | fix | tile -o build.tif");
    assert_eq!(ran.statuses, [Some(1); 3]);
    // Processes write in any order.
    let mut lines: Vec<&str> = ran.stderr.lines().collect();
    lines.sort_unstable();
    let [of_fix, of_slice, of_tile] = lines[..] else { panic!("{}", ran.stderr) };
    let reason = of_slice.strip_prefix("error: slice: ").unwrap();
    assert!(reason.starts_with("absent.stl: No such file"), "{reason}");
    let told = format!("standard input: the stage before gave up: {reason}");
    assert_eq!([of_fix, of_tile], [format!("error: fix: {told}"), format!("error: tile: {told}")]);
    assert_eq!(scratch.names(), ["cube.stl", "cube.tif"]);
}

#[test]
fn a_stack_with_a_page_missing_can_be_used_on_purpose() {
    let scratch = with_cube();
    let which = (0..19).map(|page| format!(",{page}")).collect::<String>();
    if ask(&scratch, "tiffcp", &[&format!("cube.tif{which}"), "less.tif"]).is_none() {
        return;
    }
    scratch.run("lamp convert less.tif -o same.tif").is_refused_with(&["--ignore-checks"]);
    scratch.run("lamp convert less.tif --ignore-checks -o used.tif").succeeds_quietly();
    assert!(verified(&scratch, "lamp verify used.tif").contains(": whole, 19 layers"));
}

#[test]
fn a_page_that_libtiff_left_out_is_missed_by_every_reader() {
    let scratch = with_cube();
    let pages =
        |skip: u32| (0..20).filter(move |&page| page != skip).map(|page| format!(",{page}"));
    let copy = |skip: u32, to: &str| {
        let which = format!("cube.tif{}", pages(skip).collect::<String>());
        ask(&scratch, "tiffcp", &[&which, to]).is_some()
    };
    if !copy(7, "seven.tif") || !copy(19, "last.tif") || !copy(0, "first.tif") {
        return;
    }
    let missing = "layer 19: the pages before it differ from the pages that were written: layers \
                   between 6 and 8 are missing";
    let ran = scratch.run("fix seven.tif | tile -o build.tif");
    assert_eq!(ran.statuses, [Some(1), Some(1)], "{ran:?}");
    assert!(ran.stderr.contains(missing), "{ran:?}");
    scratch.run("lamp info seven.tif").is_refused_with(&[missing]);
    let end = "the stack ends with layer 18, but was written with more layers";
    scratch.run("lamp verify last.tif").is_refused_with(&[]);
    scratch.run("fix last.tif -o fixed.tif").is_refused_with(&[end]);
    scratch.run("fix first.tif -o fixed.tif").is_refused_with(&[
        "layer 19: the pages before it",
        "with this page there are 19 instead of 20",
    ]);
    let names = scratch.names();
    assert!(!names.contains(&"build.tif".to_owned()) && !names.contains(&"fixed.tif".to_owned()));
}

#[test]
fn another_codec_keeps_the_checks() {
    let scratch = with_cube();
    for codec in ["none", "lzw", "zip", "packbits", "g3"] {
        let to = format!("{codec}.tif");
        if ask(&scratch, "tiffcp", &["-c", codec, "cube.tif", &to]).is_none() {
            return;
        }
        let line = format!("{codec}.tif: whole, 20 layers, z 0.000 to 20.000 mm\n");
        assert_eq!(verified(&scratch, &format!("lamp verify {to}")), line);
        scratch.run(&format!("lamp convert {to} -o again.tif")).succeeds_quietly();
        assert!(scratch.bytes("again.tif") == scratch.bytes("cube.tif"), "{codec}");
    }
}

#[test]
fn a_stack_without_checks_is_read_and_not_called_proven() {
    let scratch = with_cube();
    without_checks(&scratch, "cube.tif", "old.tif");
    let line = "old.tif: no fault in 20 layers, z 0.000 to 20.000 mm, but it has no checks: a \
                changed image or text would not show\n";
    assert_eq!(verified(&scratch, "lamp verify old.tif"), line);
    scratch.run("lamp convert old.tif -o new.tif").succeeds_quietly();
    assert!(scratch.bytes("new.tif") == scratch.bytes("cube.tif"));
}

#[test]
fn a_stack_is_compared_with_its_part() {
    let scratch = with_cube();
    scratch.part("torus.stl", Sample::Torus, 500);
    let whole = "whole, 20 layers, z 0.000 to 20.000 mm, made from the given part";
    let line = verified(&scratch, "lamp verify cube.tif --against cube.stl");
    assert_eq!(line, format!("cube.tif: {whole}\n"));
    let ran = scratch.run("lamp verify cube.tif --against torus.stl").is_refused_with(&[]);
    assert!(String::from_utf8_lossy(&ran.stdout).contains("it was made from blake3:"));

    scratch.run("slice torus.stl --dpi 100 --thickness 1mm -o torus.tif").succeeds();
    let build = "tile cube.tif torus.tif --mesh none --settle -o build.tif";
    scratch.run(build).succeeds_quietly();
    let both = "lamp verify build.tif --against cube.stl --against torus.stl";
    assert!(verified(&scratch, both).contains("made from the given part"));
    scratch.run("lamp verify build.tif --against cube.stl").is_refused_with(&[]);
}

#[test]
fn a_changed_image_is_named_and_can_be_taken_on_purpose() {
    let scratch = with_cube();
    let layers = scratch.layers("cube.tif");
    // The same pages with another image on one of them: its codes moved by hand.
    scratch.run("lamp convert cube.tif -o pages/").succeeds_quietly();
    let mut page = scratch.bytes("pages/layer_00005.tif");
    let photometric = page.windows(4).position(|entry| entry == [6, 1, 3, 0]).unwrap();
    page[photometric + 12] ^= 1;
    scratch.write("pages/layer_00005.tif", &page);
    let fault = "layer 5: its image is not the one that was written";
    scratch.run("fix pages -o fixed.tif").is_refused_with(&[fault, "--ignore-checks"]);
    let ran = scratch
        .run("lamp verify pages cube.tif")
        .is_refused_with(&["1 of 2 stacks is not proven whole"]);
    let said = String::from_utf8_lossy(&ran.stdout).into_owned();
    assert!(
        said.contains(&format!("pages: {fault}")) && said.contains("cube.tif: whole"),
        "{said}"
    );
    scratch.run("lamp convert pages --ignore-checks -o inverted.tif").succeeds_quietly();
    let inverted = scratch.layers("inverted.tif");
    assert!(inverted[5].image != layers[5].image && inverted[6] == layers[6]);
    verified(&scratch, "lamp verify inverted.tif");
}

#[test]
fn verify_answers_scripts_in_json() {
    let scratch = with_cube();
    scratch.write("cut.tif", &scratch.bytes("cube.tif")[..2000]);
    let ran = scratch.run("lamp verify cube.tif cut.tif --json").is_refused_with(&[]);
    let answer: Value = serde_json::from_slice(&ran.stdout).unwrap();
    assert_eq!(answer["schema"], "lamp-verify-1");
    assert_eq!(answer["whole"], false);
    let [whole, cut] = [&answer["stacks"][0], &answer["stacks"][1]];
    assert_eq!((&whole["stack"], &whole["whole"]), (&json!("cube.tif"), &json!(true)));
    assert_eq!((&whole["fault"], &whole["layers"]), (&json!(null), &json!(20)));
    assert_eq!((&cut["whole"], &cut["layers"]), (&json!(false), &json!(null)));
    assert!(cut["fault"].as_str().unwrap().contains("the stack is cut off"), "{cut}");
}

#[test]
fn heights_without_a_layer_between_are_a_fault() {
    let scratch = with_cube();
    let mut layers = scratch.layers("cube.tif");
    layers[9].info.z_um = Some(9500.0);
    scratch.stack("raised.tif", layers.clone());
    let ran = scratch.run("lamp verify raised.tif").is_refused_with(&[]);
    let said = String::from_utf8_lossy(&ran.stdout).into_owned();
    let fault = "raised.tif: layer 9: it starts at z 9.5mm, but the layer before ends at 9mm\n";
    assert_eq!(said, fault);
    layers[9].info.z_um = Some(9000.0);
    layers[12].info.stray_rows = vec![81];
    scratch.stack("rows.tif", layers);
    let ran = scratch.run("lamp verify rows.tif").is_refused_with(&[]);
    assert_eq!(
        String::from_utf8_lossy(&ran.stdout),
        "rows.tif: layer 12: its text names row 81 of 81\n"
    );
}

#[test]
fn a_strict_stage_that_gives_up_stops_the_build_and_says_why() {
    let scratch = Scratch::new();
    scratch.run("lamp sample tower --facets 5k --defect drop --seed 7 -o broken.stl").succeeds();
    scratch.run("slice broken.stl --dpi 100 --thickness 1mm -o stray.tif").succeeds();
    let ran = scratch.run("fix stray.tif --strict --max-width 0 | tile --mesh none -o build.tif");
    assert_eq!(ran.statuses, [Some(3), Some(1)], "{}", ran.stderr);
    assert!(
        ran.stderr.contains("tile: broken (standard input): the stage before gave up: "),
        "{}",
        ran.stderr
    );
    assert_eq!(ran.stderr.matches("of stray rows were left").count(), 2, "{}", ran.stderr);
    let ran = scratch.run("fix stray.tif --strict --max-width 0 --report fix.json -o fixed.tif");
    assert_eq!(ran.statuses, [Some(3)]);
    let ran = scratch.run("tile stray.tif --strict --mesh none -o build.tif");
    assert_eq!(ran.statuses, [Some(3)]);
    assert!(ran.stderr.contains("the first in layer 1 (z 1.00 mm): run fix"), "{}", ran.stderr);
    assert_eq!(scratch.names(), ["broken.stl", "fix.json", "stray.tif"]);
    scratch.run("fix stray.tif --strict | tile --strict --mesh none -o build.tif").succeeds();
}

#[test]
fn a_black_part_makes_no_build() {
    let scratch = with_cube();
    let black = |mut layer: lamp_stack::Layer| {
        let (width, height) = (layer.image.width(), layer.image.height());
        layer.image = lamp_stack::Mask::black(width, height).into();
        layer
    };
    scratch.stack("black.tif", scratch.layers("cube.tif").into_iter().map(black));
    for options in ["--mesh none", "", "--fit", "--strips strips/ --mirrors 1024"] {
        let ran =
            scratch.run(&format!("tile black.tif {options} -o build.tif")).is_refused_with(&[]);
        assert!(ran.stderr.contains("black.tif: all its layers are black"), "{}", ran.stderr);
    }
    assert_eq!(scratch.names(), ["black.tif", "cube.stl", "cube.tif"]);
}
