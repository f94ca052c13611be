//! Checks `tile` with several stacks, extents, outlines, layout files and machines.

use std::fs;

use lamp_stack::{
    Frame, GrayMask, Image, Layer, Mask, Op, Orientation, PageInfo, Pitch, StackInfo,
};
use lamp_tests::{Scratch, mask};
use serde_json::Value;

/// Returns the places of a part's copies: left, top and orientation.
fn copies(about: &Value) -> Vec<(u32, u32, Orientation)> {
    let places = about["copies"].as_array().expect("a list").iter();
    let turn = |k: usize| about["turns"][k].as_str().unwrap_or("0").parse().expect("a turn");
    let number = |value: &Value| value.as_u64().expect("a number of pixels") as u32;
    places.enumerate().map(|(k, at)| (number(&at[0]), number(&at[1]), turn(k))).collect()
}

fn about_parts(build: &[Layer]) -> Vec<Value> {
    let stack: &StackInfo = build[0].info.stack.as_ref().expect("the first page speaks of it");
    let tile = &stack.other["tile"];
    tile["parts"].as_array().cloned().unwrap_or_else(|| vec![tile.clone()])
}

/// Checks that each copy in a build equals the part, and that the rest is black.
fn check(scratch: &Scratch, build: &str, stacks: &[&str]) -> usize {
    let build = scratch.layers(build);
    let parts: Vec<Vec<Layer>> = stacks.iter().map(|stack| scratch.layers(stack)).collect();
    let about = about_parts(&build);
    assert_eq!(about.len(), parts.len());
    assert_eq!(build.len(), parts.iter().map(Vec::len).max().unwrap());
    let number = |value: &Value| value.as_i64().unwrap_or(0);
    for (k, built) in build.iter().enumerate() {
        let mut rest = mask(built).clone();
        for (part, about) in parts.iter().zip(&about) {
            let Some(layer) = part.get(k) else { continue };
            let [width, height] = [0, 1].map(|side| number(&about["part_pixels"][side]) as u32);
            let [left, top] = [0, 1].map(|side| number(&about["part_corner"][side]));
            let placed = mask(layer).framed(Frame { left, top, width, height });
            assert_eq!(placed.white_pixels(), mask(layer).white_pixels());
            for (left, top, turn) in copies(about) {
                let around = Frame {
                    left: -i64::from(left),
                    top: -i64::from(top),
                    width: rest.width(),
                    height: rest.height(),
                };
                let copy = placed.oriented(turn).unwrap().framed(around);
                assert_eq!(copy.combined(Op::Difference, &rest).unwrap().white_pixels(), 0);
                rest = rest.combined(Op::Xor, &copy).unwrap();
            }
        }
        assert_eq!(rest.white_pixels(), 0, "layer {k}");
    }
    about.iter().map(|about| copies(about).len()).sum()
}

#[test]
fn several_stacks_make_one_build_whatever_the_threads() {
    let scratch = Scratch::with_tower_and_torus();
    let line = "tile tower.tif:5 torus.tif:3 --area 150x150mm --mesh none";
    for (k, more) in ["", "--fit", "--fit --turns quarters"].into_iter().enumerate() {
        let build = format!("build{k}.tif");
        scratch.run(&format!("{line} {more} -o {build}")).succeeds_quietly();
        assert_eq!(check(&scratch, &build, &["tower.tif", "torus.tif"]), 8);
        for threads in [1, 2, 7] {
            let again =
                scratch.run(&format!("{line} {more} --threads {threads}")).succeeds_quietly();
            assert!(again.stdout == scratch.bytes(&build), "{more} --threads {threads}");
        }
    }
    let layers = scratch.layers("build0.tif");
    let stack = layers[0].info.stack.as_ref().unwrap();
    assert_eq!((stack.part.as_str(), stack.layers), ("tower+torus", Some(76)));
    assert!(scratch.run("lamp info build0.tif").succeeds().statuses == [Some(0)]);
}

#[test]
fn standard_input_fits_as_a_file_does() {
    let scratch = Scratch::with_tower_and_torus();
    let stack = scratch.bytes("torus.tif");
    for options in ["--fit", "--pack outline", "--fit --layers 3..9", "--copies 2 --gap 1mm"] {
        let file = scratch.run(&format!("tile torus.tif {options}")).succeeds_quietly().stdout;
        let line = format!("tile {options}");
        assert!(scratch.run_on(&line, &stack).succeeds_quietly().stdout == file, "{options}");
    }
    let both = scratch.run("tile tower.tif torus.tif:2 --area 200x200mm").succeeds_quietly().stdout;
    assert!(
        scratch.run_on("tile tower.tif --area 200x200mm -- -:2", &stack).succeeds_quietly().stdout
            == both
    );
    scratch.run("tile --fit").is_refused_with(&["standard input", "empty"]);
    let cut = scratch.run_on("tile --fit", &stack[..stack.len() / 2]);
    cut.is_refused_with(&["torus (standard input): ", "cut off"]);
    for options in ["--copies 99", "--copies 99 --fit"] {
        let many = scratch.run_on(&format!("tile {options}"), &stack);
        many.is_refused_with(&["tile: torus: 99 copies were asked for"]);
    }
    scratch.write("layout.json", br#"{"copies": [{"part": "torus"}]}"#);
    let wrong = scratch.run_on("tile --layout layout.json", &stack);
    assert_eq!(wrong.stderr.matches("missing field").count(), 1, "{wrong:?}");
    wrong.is_refused_with(&["layout.json: this is not a layout"]);
}

#[test]
fn outlines_place_more_round_parts_than_boxes() {
    let scratch = Scratch::with_tower_and_torus();
    let count = |options: &str, build: &str| {
        let line =
            format!("tile tower.tif --area 95x120mm --mesh none --gap 0.5mm {options} -o {build}");
        scratch.run(&line).succeeds_quietly();
        check(&scratch, build, &["tower.tif"])
    };
    let boxes = count("--fit", "boxes.tif");
    let outlines = count("--pack outline", "outlines.tif");
    assert!(outlines > boxes, "{outlines} by outlines, {boxes} by boxes");
}

#[test]
fn what_is_left_of_several_parts_is_told() {
    let scratch = Scratch::with_tower_and_torus();
    let line = "tile tower.tif:9 torus.tif:1 --area 120x120mm --mesh none --edge-gap 5mm -o b.tif";
    let told = scratch.run(line).succeeds();
    assert!(told.stderr.contains("tower.tif: "), "{}", told.stderr);
    assert!(told.stderr.contains(" of 9 copies are placed: no more fit"), "{}", told.stderr);
    assert!(check(&scratch, "b.tif", &["tower.tif", "torus.tif"]) < 10);
    let strict = scratch.run(&format!("{line}.2 --strict"));
    assert_eq!(strict.statuses, [Some(3)]);
    assert!(!scratch.path("b.tif.2").exists());
}

#[test]
fn copies_by_hand_nearer_than_the_gap_are_told() {
    let scratch = Scratch::with_tower_and_torus();
    let packed = "tile tower.tif:4 --area 95x120mm --mesh none --gap 1mm --layout-out l.json";
    scratch.run(&format!("{packed} -o b.tif")).succeeds_quietly();
    let again = "tile tower.tif --layout l.json --mesh none -o c.tif";
    scratch.run(&format!("{again} --gap 1mm")).succeeds_quietly();
    scratch.run(again).succeeds_quietly();
    let told = scratch.run(&format!("{again} --gap 2mm")).succeeds();
    assert!(told.stderr.contains("are nearer to each other than 2mm"), "{}", told.stderr);
}

#[test]
fn a_layout_gives_the_same_build_again() {
    let scratch = Scratch::with_tower_and_torus();
    let stacks = "tower.tif torus.tif";
    let line = "tile tower.tif:4 torus.tif:2 --area 120x150mm --mesh none --pack outline";
    let written = "--layout-out 1.json --layout-picture 1.png -o 1.tif";
    scratch.run(&format!("{line} {written}")).succeeds_quietly();
    let line = format!("tile {stacks} --fit --mesh none --layout 1.json");
    let written = "--layout-out 2.json --layout-picture 2.svg -o 2.tif";
    scratch.run(&format!("{line} {written}")).succeeds_quietly();
    assert!(scratch.bytes("1.json") == scratch.bytes("2.json"));
    let images =
        |name| scratch.layers(name).into_iter().map(|layer| layer.image).collect::<Vec<_>>();
    assert!(images("1.tif") == images("2.tif"));
    assert_eq!(&scratch.bytes("1.png")[1..4], b"PNG");
    let picture = String::from_utf8(scratch.bytes("2.svg")).unwrap();
    for word in ["<svg", "tower.tif: 4 copies", "torus.tif: 2 copies", "120x150mm at 100 dpi"] {
        assert!(picture.contains(word), "no {word}");
    }
}

#[test]
fn a_layout_says_how_copies_lie() {
    let scratch = Scratch::new();
    let image = Image::Mask(Mask::new(8, vec![0, 2, 4, 4], vec![1, 3, 1, 7]).unwrap());
    let info = PageInfo { stack: Some(StackInfo::default()), ..PageInfo::default() };
    scratch.stack("l.tif", [Layer { info, pitch: Pitch::of_dpi(25.4), image: image.into() }]);
    let layout = |copies: &[&str]| {
        let copies: Vec<_> =
            copies.iter().map(|copy| format!(r#"{{"part": "l.tif", {copy}}}"#)).collect();
        let text = format!(r#"{{"area_mm": [20, 20], "copies": [{}]}}"#, copies.join(","));
        scratch.write("layout.json", text.as_bytes());
        scratch.run("tile l.tif --layout layout.json --mesh none -o build.tif")
    };
    layout(&[
        r#""x_mm": 0, "y_mm": 0"#,
        r#""x_mm": 12, "y_mm": 1, "turn": 90, "mirror": true"#,
        r#""x_mm": 5, "y_mm": 12, "turn": 180"#,
    ])
    .succeeds_quietly();
    assert_eq!(check(&scratch, "build.tif", &["l.tif"]), 3);
    let at = |column, row| mask(&scratch.layers("build.tif")[0]).is_white(column, row);
    // The first copy's long row is the second of three.
    assert!(at(6, 18) && !at(6, 17) && at(2, 17) && !at(1, 19));
    for (copies, words) in [
        (&[r#""x_mm": 0, "y_mm": 0"#, r#""x_mm": 7, "y_mm": 2"#][..], ["copy 1", "copy 2 overlap"]),
        (
            &[r#""x_mm": 0, "y_mm": 0"#, r#""x_mm": 14, "y_mm": 2"#],
            ["copy 2 reaches 2mm", "20x20mm"],
        ),
        (&[r#""x_mm": 0, "y_mm": 0, "turn": 30"#], ["layout.json: copies[0].turn", "90"]),
        (&[r#""x_mm": 0"#], ["not a layout", "y_mm"]),
    ] {
        fs::remove_file(scratch.path("build.tif")).ok();
        layout(copies).is_refused_with(&words);
        assert!(!scratch.path("build.tif").exists());
    }
}

#[test]
fn other_heights_are_refused_or_resampled() {
    let scratch = Scratch::with_tower_and_torus();
    scratch.run("slice torus.stl --dpi 100 --thickness 0.5mm -q -o fine.tif").succeeds();
    scratch
        .run("slice torus.stl --dpi 100 --thickness 1mm --translate 0,0,7 -q -o high.tif")
        .succeeds();
    scratch.run("slice torus.stl --dpi 200 --thickness 1mm -q -o sharp.tif").succeeds();
    let area = "--area 150x150mm -o build.tif";
    scratch.run(&format!("tile tower.tif fine.tif {area}")).is_refused_with(&[
        "fine.tif: layer 0 (z 0.00 mm) spans z 0 to 0.5 mm where the build's layer spans 0 to 1",
        "--thickness 1mm",
        "--resample",
    ]);
    scratch
        .run(&format!("tile tower.tif high.tif {area}"))
        .is_refused_with(&["high.tif starts at z 7.000 mm and tower.tif at 0.000 mm", "--settle"]);
    scratch
        .run(&format!("tile tower.tif sharp.tif {area}"))
        .is_refused_with(&["sharp.tif has 200 dpi and tower.tif has 100 dpi"]);
    // Planes lie at the tops of layers, so every second fine layer is a coarse one.
    scratch.run(&format!("tile tower.tif torus.tif {area}")).succeeds_quietly();
    let plain = scratch.layers("build.tif");
    scratch.run(&format!("tile tower.tif fine.tif --resample {area}")).succeeds_quietly();
    let resampled = scratch.layers("build.tif");
    scratch.run(&format!("tile tower.tif high.tif --settle {area}")).succeeds_quietly();
    let settled = scratch.layers("build.tif");
    for (other, option) in [(&plain, ""), (&resampled, " --resample"), (&settled, " --settle")] {
        let commands = &other[0].info.stack.as_ref().unwrap().commands;
        let expected = format!("--base-layers 5{option}");
        assert!(commands[0].ends_with(&expected), "{commands:?}");
    }
    for other in [&resampled, &settled] {
        assert_eq!(plain.len(), other.len());
        assert!(plain.iter().zip(other).all(|(a, b)| a.image == b.image));
    }
}

#[test]
fn stray_rows_are_told_once_however_many_copies() {
    let scratch = Scratch::new();
    let stray = |index, stray_rows: &[u32]| {
        let info = PageInfo {
            index,
            z_um: Some(f64::from(index) * 100.0),
            thickness_um: Some(100.0),
            stray_rows: stray_rows.to_vec(),
            ..PageInfo::default()
        };
        let image =
            Image::Mask(Mask::new(4, vec![0, 2, 3, 4, 5, 7], vec![1, 3, 1, 1, 1, 1, 3]).unwrap());
        Layer { info, pitch: Pitch::of_dpi(25.4), image: image.into() }
    };
    scratch.stack("p.tif", [stray(0, &[]), stray(1, &[1, 2, 3])]);
    let said = |options: &str| {
        let line = format!("tile p.tif:200 --area 100x100mm --mesh none {options} -o build.tif");
        scratch.run(&line).succeeds().stderr
    };
    let all = "warning: tile: p.tif: 3 stray rows in 1 layer, the first in layer 1 (z 0.10 mm): run fix \
               before tile, and repair the CAD model where fix cannot\n";
    assert_eq!(said("-q"), all);
    let listed = "tile: p.tif: layer 1 (z 0.10 mm) has 3 stray rows: 1-3\n";
    assert_eq!(said("-v"), listed.to_owned() + all);
    assert_eq!(said(""), all);
    let build = scratch.layers("build.tif");
    assert!(build[0].info.stray_rows.is_empty());
    assert_eq!(build[1].info.stray_rows.len(), 3 * 10);
}

#[test]
fn gray_layers_make_a_gray_build() {
    let scratch = Scratch::new();
    let mut ramp = GrayMask::new(64);
    (0..16).for_each(|row| ramp.push_runs((row..64).map(|level| (1, level as u8 * 3))).unwrap());
    let info = PageInfo { stack: Some(StackInfo::default()), ..PageInfo::default() };
    let image = Image::Gray(ramp.clone());
    scratch.stack("gray.tif", [Layer { info, pitch: Pitch::of_dpi(25.4), image: image.into() }]);
    let layout = r#"{"copies": [{"part": "gray.tif", "x_mm": 1, "y_mm": 1, "turn": 270}, {"part": "gray.tif", "x_mm": 20, "y_mm": 1}]}"#;
    scratch.write("layout.json", layout.as_bytes());
    scratch.run("tile gray.tif --layout layout.json --mesh none -o build.tif").succeeds_quietly();
    let build = scratch.layers("build.tif");
    let Image::Gray(image) = &*build[0].image else { panic!("a mask") };
    let places = copies(&about_parts(&build)[0]);
    assert_eq!(places.len(), 2);
    for (left, top, turn) in places {
        let (width, height) = turn.size(64, 16);
        let cut = image.framed(Frame { left: left.into(), top: top.into(), width, height });
        assert!(cut.oriented(turn.inverse()).unwrap() == ramp);
    }
    // A threshold does not depend on the place, so dots are the same before and after.
    let dots = "dither --method threshold";
    let after = scratch.run(&format!("tile gray.tif --mesh none --copies 2 | {dots} -o after.tif"));
    after.succeeds_quietly();
    let before =
        scratch.run(&format!("{dots} gray.tif | tile --mesh none --copies 2 -o before.tif"));
    before.succeeds_quietly();
    assert!(scratch.layers("after.tif")[0].image == scratch.layers("before.tif")[0].image);
}

#[test]
fn machines_have_areas_and_limits() {
    let scratch = Scratch::with_tower_and_torus();
    let list = scratch.run("lamp machine list").succeeds_quietly().stdout;
    let list = String::from_utf8(list).unwrap();
    assert!(list.contains("alpha") && list.contains("584.2x584.2mm"), "{list}");
    let beta = scratch.run("lamp machine show beta").succeeds_quietly().stdout;
    let mine = String::from_utf8(beta).unwrap().replace("least = 1500", "least = 100");
    scratch.write("mine.toml", mine.replace("100um", "1mm").as_bytes());
    scratch.run("tile tower.tif --copies 3 --machine mine.toml -o build.tif").succeeds_quietly();
    assert_eq!(scratch.layers("build.tif")[0].image.width(), 2300);
    scratch.run("tile tower.tif --machine beta -o x.tif").is_refused_with(&[
        "tower.tif: layer 0",
        "100 dpi",
        "beta builds in 1500 to 2400 dpi",
    ]);
    scratch.write("mine.toml", mine.as_bytes());
    scratch.run("tile tower.tif --machine mine.toml -o x.tif").is_refused_with(&[
        "tower.tif: layer 0",
        "1mm thick",
        "25um to 100um",
    ]);
    for area in ["9x9in", "4.1x1in", "1x4.6in"] {
        let line = format!("tile tower.tif --machine alpha --area {area} -o x.tif");
        scratch.run(&line).is_wrong_usage(&["alpha builds on 101.6x114.3mm", "smaller --area"]);
    }
    scratch
        .run("tile tower.tif --machine gamma -o x.tif")
        .is_refused_with(&["gamma", "alpha, beta"]);
    scratch.write("mine.toml", b"name = \"a\"");
    scratch.run("lamp machine show mine.toml").is_refused_with(&["mine.toml: line 1"]);
    assert!(!scratch.path("x.tif").exists());
}

#[test]
fn what_cannot_be_meant_is_wrong_usage() {
    let scratch = Scratch::with_tower_and_torus();
    for (line, words) in [
        ("tile tower.tif:2 --copies 3", &["--copies", "blade.tif:120"][..]),
        ("tile tower.tif torus.tif --copies 3", &["--copies"]),
        ("tile tower.tif:0", &["`0` is not a number of copies"]),
        ("tile tower.tif tower.tif:3", &["tower.tif is given twice"]),
        ("tile - tower.tif -- -:2", &["standard input is given twice"]),
        ("tile tower.tif:3 --layout l.json", &["leave out the counts"]),
        ("tile tower.tif --layout l.json --edge-gap 2mm", &["--layout"]),
        ("tile tower.tif --layout-picture p.jpg", &[".svg or .png"]),
        ("tile tower.tif --layout-out tower.tif", &["no stack is written there"]),
        ("tile tower.tif --pack tight", &["box", "outline"]),
    ] {
        scratch.run(&line.replacen("tile", "tile -o x.tif", 1)).is_wrong_usage(words);
        assert!(!scratch.path("x.tif").exists());
    }
    scratch
        .run("tile tower.tif:999 --mesh none -o x.tif")
        .is_refused_with(&["tower.tif: 999 copies", "only 12 fit"]);
    scratch.run("tile tower.tif --layout l.json -o x.tif").is_refused_with(&["l.json"]);
}
