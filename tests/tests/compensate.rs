//! Checks that `lamp compensate` moves edges, keeps and reports walls, and corrects shrinkage.

use lamp_fixtures::Sample;
use lamp_stack::{GrayMask, Image, Layer, Mask, MaskBuilder, PageInfo, Pitch, StackInfo};
use lamp_tests::{Scratch, mask};
use serde_json::Value;

/// At 254 dpi a pixel is 100 um.
fn layer(index: u32, image: Image) -> Layer {
    let stack = StackInfo { part: "bars".to_owned(), ..StackInfo::default() };
    let info = PageInfo {
        index,
        z_um: Some(f64::from(index) * 100.0),
        origin_mm: Some([10.0, 20.0]),
        stack: (index == 0).then_some(stack),
        ..PageInfo::default()
    };
    Layer { info, pitch: Pitch::of_dpi(254.0), image: image.into() }
}

/// Builds blocks from ranges of columns and rows, each with an exclusive end.
fn blocks(blocks: &[[u32; 4]]) -> Mask {
    let mut mask = MaskBuilder::new(64);
    for row in 0..40 {
        let there = blocks.iter().filter(|b| (b[2]..b[3]).contains(&row));
        mask.push_row(&there.flat_map(|b| [b[0], b[1]]).collect::<Vec<_>>()).unwrap();
    }
    mask.finish()
}

fn gray(layer: &Layer) -> &GrayMask {
    match &*layer.image {
        Image::Gray(gray) => gray,
        Image::Mask(_) => panic!("{} is a mask", layer.info.name()),
    }
}

fn levels(layer: &Layer, row: u32) -> Vec<(u32, u8)> {
    gray(layer).row(row).iter().map(|change| (change.column, change.level)).collect()
}

fn json(scratch: &Scratch, name: &str) -> Value {
    serde_json::from_slice(&scratch.bytes(name)).unwrap()
}

#[test]
fn edges_move_by_the_length_and_the_rest_becomes_gray() {
    let scratch = Scratch::new();
    let bar = blocks(&[[10, 30, 5, 35]]);
    scratch
        .stack("in.tif", [layer(0, Image::Mask(bar.clone())), layer(1, Image::Mask(blocks(&[])))]);
    scratch.run("lamp compensate in.tif --uniform 0.15mm -o out.tif").succeeds_quietly();
    let layers = scratch.layers("out.tif");
    assert_eq!(levels(&layers[0], 20), [(11, 128), (12, 255), (28, 128), (29, 0)]);
    let page = &layers[0].info.other["compensate"];
    assert_eq!(page["inwards_um"], serde_json::json!([150.0, 150.0]));
    // Without a move the page passes unchanged.
    assert_eq!(layers[1], layer(1, Image::Mask(blocks(&[]))));
    scratch.run("lamp compensate in.tif --uniform 2mil --one-bit -o out.tif").succeeds_quietly();
    assert_eq!(mask(&scratch.layers("out.tif")[0]), &blocks(&[[11, 29, 6, 34]]));
    scratch.run("lamp compensate in.tif --uniform -0.2mm --one-bit -o out.tif").succeeds_quietly();
    let grown = scratch.layers("out.tif");
    assert_eq!(mask(&grown[0]).row(20), [8, 32]);
    let back = "lamp compensate out.tif --uniform 200um --one-bit -o back.tif";
    let said = scratch.run(back).succeeds().stderr;
    assert!(said.contains("compensated before") && said.lines().count() == 1, "{said}");
    assert_eq!(mask(&scratch.layers("back.tif")[0]), &bar);
}

#[test]
fn gray_layers_shrink_by_their_outlines() {
    let scratch = Scratch::new();
    let mut image = GrayMask::new(64);
    for row in 0..40 {
        let inside = (5..35).contains(&row);
        let runs =
            [(10, 0), (8, 100), (12, 255)].map(|(n, level)| (n, if inside { level } else { 0 }));
        image.push_runs(runs).unwrap();
    }
    scratch.stack("in.tif", [layer(0, Image::Gray(image))]);
    scratch.run("lamp compensate in.tif --uniform 150um -o out.tif").succeeds_quietly();
    let layers = scratch.layers("out.tif");
    let expected = [(11, 100), (18, 255), (28, 128), (29, 0)];
    assert_eq!(levels(&layers[0], 20), expected);
    let grow = "lamp compensate in.tif --uniform -150um -o out.tif";
    scratch.run(grow).is_refused_with(&["in.tif", "layer 0", "gray", "dither"]);
}

/// A square bar with its axis at (20, 20) mm, as an ASCII STL.
fn square_bar(side_mm: f64, degrees: f64) -> String {
    let (sin, cos) = f64::to_radians(degrees).sin_cos();
    let corner = |k: usize, z: f64| {
        let [x, y] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]][k % 4];
        let [x, y] = [x, y].map(|at: f64| at * side_mm / 2.0);
        format!("vertex {} {} {z}\n", 20.0 + x * cos - y * sin, 20.0 + x * sin + y * cos)
    };
    let facet = |corners: [(usize, f64); 3]| {
        let corners = corners.map(|(k, z)| corner(k, z)).concat();
        format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    };
    let sides = (0..4).flat_map(|k| {
        [[(k, 0.0), (k + 1, 0.0), (k + 1, 1.0)], [(k, 0.0), (k + 1, 1.0), (k, 1.0)]].map(facet)
    });
    let ends = [[(0, 0.0), (2, 0.0), (1, 0.0)], [(0, 0.0), (3, 0.0), (2, 0.0)]]
        .into_iter()
        .chain([[(0, 1.0), (1, 1.0), (2, 1.0)], [(0, 1.0), (2, 1.0), (3, 1.0)]]);
    let facets: String = sides.chain(ends.map(facet)).collect();
    format!("solid bar\n{facets}endsolid bar\n")
}

/// The side in micrometers of a square of the area of a page's white, at 1500 dpi.
fn side_um(image: &Image) -> f64 {
    let runs = (0..image.height()).flat_map(|row| image.runs(row));
    let area: f64 =
        runs.map(|(start, end, level)| f64::from((end - start) * u32::from(level))).sum();
    (area / 255.0).sqrt() * 25_400.0 / 1500.0
}

#[test]
fn edges_of_antialiased_slices_move_to_the_places_of_the_part() {
    let scratch = Scratch::new();
    for degrees in [0.0, 18.4, 26.6, 45.0] {
        scratch.write("bar.stl", square_bar(1.7, degrees).as_bytes());
        let slice = "lamp slice bar.stl --dpi 1500 --thickness 1mm --margin 4 --antialias";
        scratch.run(&format!("{slice} -o in.tif")).succeeds();
        assert_eq!(scratch.layers("in.tif")[0].info.other["levels"], "areas");
        scratch.run("lamp compensate in.tif --uniform 25um -o out.tif").succeeds_quietly();
        let off_um = (side_um(&scratch.layers("out.tif")[0].image) - 1650.0) / 2.0;
        assert!(off_um.abs() < 0.3, "{degrees}: {off_um}");
        scratch.run("lamp compensate in.tif --shrinkage 2% -o large.tif").succeeds_quietly();
        let off_um = (side_um(&scratch.layers("large.tif")[0].image) - 1700.0 / 0.98) / 2.0;
        assert!(off_um.abs() < 0.3, "{degrees}: {off_um}");
        // Such pages may grow, but not those that are gray by depth.
        scratch.run("lamp compensate in.tif --uniform -25um -o out.tif").succeeds_quietly();
        let corners_um2 = (4.0 - std::f64::consts::PI) * 25.0 * 25.0;
        let grown = f64::sqrt(1750.0 * 1750.0 - corners_um2);
        let off_um = (side_um(&scratch.layers("out.tif")[0].image) - grown) / 2.0;
        assert!(off_um.abs() < 0.3, "{degrees}: {off_um}");
    }
}

#[test]
fn thin_walls_are_kept_and_told_of() {
    let scratch = Scratch::new();
    // A block, a wall of one pixel and one of three.
    let mask = blocks(&[[10, 30, 5, 35], [40, 41, 5, 35], [50, 53, 5, 35]]);
    scratch.stack("in.tif", [layer(0, Image::Mask(mask.clone())), layer(1, Image::Mask(mask))]);
    let line = "lamp compensate in.tif --uniform 200um --report walls.json -o out.tif";
    let said = scratch.run(line).succeeds().stderr;
    assert!(said.contains("4 thin walls in 2 layers narrowed less than asked, 4 would"), "{said}");
    assert!(said.contains("100 um, in layer 0 (z 0.00 mm) near x 14.0-14.1 y 16.5-19.5"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    let out = scratch.layers("out.tif");
    let row = levels(&out[0], 20);
    assert_eq!(row[..4], [(12, 255), (28, 0), (40, 255), (41, 0)]);
    assert_eq!((row[4].0, row[5], row[7]), (50, (51, 255), (53, 0)));
    let report = json(&scratch, "walls.json");
    assert_eq!((&report["thin_walls"], &report["would_be_lost"]), (&4.into(), &4.into()));
    let first = &report["walls"][0];
    assert_eq!(first["columns"], serde_json::json!([40, 40]));
    assert_eq!(first["x_mm"], serde_json::json!([14.0, 14.1]));
    for (key, um) in [("width_um", 100.0), ("asked_um", 0.0), ("made_um", 100.0)] {
        assert_eq!(first[key].as_f64(), Some(um), "{key}");
    }
    let unkept = "lamp compensate in.tif --uniform 200um --min-feature 0um -o out.tif";
    scratch.run(unkept).succeeds();
    assert_eq!(lamp_tests::masks(&scratch.layers("out.tif"))[0].row(20), [12, 28]);
}

#[test]
fn what_goes_where_walls_are_not_kept_is_told_of() {
    let scratch = Scratch::new();
    // A block with a fin, two blocks with a neck, and a wall; a gray layer of the
    // wall alone; a block.
    let fin = [[2, 14, 5, 20], [2, 18, 20, 22], [2, 14, 22, 35]];
    let necked = [[24, 34, 5, 15], [28, 30, 15, 25], [24, 34, 25, 35]];
    let mask = blocks(&[&fin[..], &necked[..], &[[50, 53, 5, 35]]].concat());
    let mut wall = GrayMask::new(64);
    for row in 0..40 {
        let level = if (5..35).contains(&row) { 90 } else { 0 };
        wall.push_runs([(50, 0), (3, level), (11, 0)]).unwrap();
    }
    let block = blocks(&[[10, 30, 5, 35]]);
    let layers = [layer(0, Image::Mask(mask)), layer(1, Image::Gray(wall))];
    scratch.stack("in.tif", layers.into_iter().chain([layer(2, Image::Mask(block))]));
    let line = "lamp compensate in.tif --uniform 200um --min-feature 0um --report lost.json";
    for form in ["", "--one-bit"] {
        let said = scratch.run(&format!("{line} {form} -o out.tif")).succeeds().stderr;
        let counts = "2 pieces lost and 1 broken apart in 2 layers";
        assert!(said.contains(counts) && said.contains("layer 0 (z 0.00 mm) near x"), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        let report = json(&scratch, "lost.json");
        for (key, count) in
            [("thin_walls", 0), ("would_be_lost", 2), ("lost", 2), ("broken", 1), ("not_listed", 0)]
        {
            assert_eq!(report[key], count, "{key}");
        }
        let listed = report["walls"].as_array().unwrap();
        let of = |wall: &Value| {
            let numbers = ["layer", "pieces_left"].map(|key| wall[key].as_u64().unwrap());
            (numbers, wall["columns"].clone(), wall["would_be_lost"].clone())
        };
        let expected =
            [([0, 2], [24, 33], false), ([0, 0], [50, 52], true), ([1, 0], [50, 52], true)];
        assert_eq!(
            listed.iter().map(of).collect::<Vec<_>>(),
            expected.map(|(numbers, columns, lost)| (
                numbers,
                columns.into_iter().collect(),
                lost.into()
            ))
        );
        assert_eq!(listed[1]["x_mm"], serde_json::json!([15.0, 15.3]));
        assert_eq!(listed[1].get("width_um"), None);
        let pages = scratch.layers("out.tif");
        let told = |k: usize| pages[k].info.other["compensate"].get("losses").cloned();
        assert_eq!([0, 1, 2].map(told), [Some(2.into()), Some(1.into()), None]);
    }
    scratch.run(&format!("{line} --quiet -o out.tif")).succeeds_quietly();
}

#[test]
fn a_part_that_goes_whole_is_told_of() {
    let scratch = Scratch::new();
    scratch.part("sphere.stl", Sample::Sphere, 2_000);
    scratch.run("slice sphere.stl --dpi 100 --thickness 2mm -o in.tif").succeeds_quietly();
    let line =
        "lamp compensate in.tif --uniform 20mm --min-feature 0um --report lost.json -o out.tif";
    let said = scratch.run(line).succeeds().stderr;
    let report = json(&scratch, "lost.json");
    let some = |name| -> usize {
        let layers = scratch.layers(name);
        lamp_tests::masks(&layers).iter().filter(|mask| mask.white_pixels() > 0).count()
    };
    let gone = some("in.tif");
    assert_eq!(some("out.tif"), 0);
    assert!(gone > 10 && said.contains(&format!("{gone} piece")), "{said}");
    assert_eq!((&report["lost"], &report["would_be_lost"]), (&gone.into(), &gone.into()));
}

const MATERIAL: &str = r#"name = "mine"
description = "a resin"
[intensity]
value = "1 W/cm2"
source = "a meter"
[[cure-width]]
feature-size = "1 mm"
critical-dose = { value = "100 mJ/cm2", source = "page 1" }
sensitivity = { value = "0.5 um/(mJ/cm2)", source = "page 1" }
[[cure-width]]
feature-size = "2 mm"
critical-dose = { value = "100 mJ/cm2", source = "page 2" }
sensitivity = { value = "1 um/(mJ/cm2)", source = "page 2" }
"#;

#[test]
fn a_material_says_how_wide_each_feature_cures() {
    let scratch = Scratch::new();
    scratch.write("mine.toml", MATERIAL.as_bytes());
    let mut exposed = layer(0, Image::Mask(blocks(&[[4, 28, 5, 35], [40, 50, 5, 35]])));
    exposed.info.exposure_ms = Some(300.0);
    let mut longer = exposed.clone();
    (longer.info.index, longer.info.stack, longer.info.exposure_ms) = (1, None, Some(500.0));
    scratch.stack("in.tif", [exposed, longer]);
    let with = |options: &str| {
        let line =
            format!("lamp compensate in.tif --material mine.toml {options} --one-bit -o out.tif");
        scratch.run(&line).succeeds_quietly();
        lamp_tests::masks(&scratch.layers("out.tif"))
            .iter()
            .map(|m| m.row(20).to_vec())
            .collect::<Vec<_>>()
    };
    // 300 mJ/cm2 make 100 um of the wall and 200 um of the block, which is exposed 2 mm wide;
    // 500 make 200 um of the wall and 343 um of the block, of which 1.71 mm are exposed.
    let by_page = with("");
    assert_eq!(by_page, [[6, 26, 41, 49], [7, 25, 42, 48]]);
    assert_eq!(with("--dose 0.3J/cm2"), [[6, 26, 41, 49], [6, 26, 41, 49]]);
    assert_eq!(with("--dose 100mJ/cm2"), [[4, 28, 40, 50], [4, 28, 40, 50]]);
    let page = |k: usize| scratch.layers("out.tif")[k].info.other.get("compensate").cloned();
    assert_eq!(page(0), None);
}

/// A resin that cures large features much wider than small ones, over 25 to 450 pixels.
const STEEP: &str = r#"name = "steep"
description = "a resin"
[[cure-width]]
feature-size = "0.4233 mm"
critical-dose = { value = "100 mJ/cm2", source = "page 1" }
sensitivity = { value = "0.02 um/(mJ/cm2)", source = "page 1" }
[[cure-width]]
feature-size = "7.62 mm"
critical-dose = { value = "80 mJ/cm2", source = "page 2" }
sensitivity = { value = "0.5 um/(mJ/cm2)", source = "page 2" }
"#;

/// The growth of each edge of a feature of a size in micrometers at 500 mJ/cm2, in this resin.
fn steep_growth(size_um: f64) -> f64 {
    let share = ((size_um - 423.3) / (7620.0 - 423.3)).clamp(0.0, 1.0);
    (0.02 + 0.48 * share) * (400.0 + 20.0 * share)
}

#[test]
fn squares_cure_to_their_size_on_a_steep_material() {
    let scratch = Scratch::new();
    scratch.write("steep.toml", STEEP.as_bytes());
    let pitch = 25_400.0 / 1500.0;
    for side in [40u32, 100, 300] {
        let mut mask = MaskBuilder::new(320);
        for row in 0..side + 8 {
            let inside = [4, 4 + side];
            let is_inside = (4..4 + side).contains(&row);
            mask.push_row(if is_inside { &inside } else { &[] }).unwrap();
        }
        let mut square = layer(0, Image::Mask(mask.finish()));
        square.pitch = Pitch::of_dpi(1500.0);
        scratch.stack("in.tif", [square]);
        let line = "lamp compensate in.tif --material steep.toml --dose 500mJ/cm2 -o out.tif";
        scratch.run(line).succeeds_quietly();
        let layers = scratch.layers("out.tif");
        let row = side / 2;
        let exposed: u32 = (0..320).map(|c| u32::from(gray(&layers[0]).level(c, row))).sum();
        let exposed = f64::from(exposed) / 255.0 * pitch;
        let cured = exposed + 2.0 * steep_growth(exposed);
        let wanted = f64::from(side) * pitch;
        assert!((cured - wanted).abs() < 0.5, "{side}: {exposed} um cure to {cured} of {wanted}");
    }
}

#[test]
fn shrinkage_is_made_up_for_and_the_origin_goes_with_it() {
    let scratch = Scratch::new();
    scratch.stack("in.tif", [layer(0, Image::Mask(blocks(&[[10, 30, 5, 35]])))]);
    scratch.run("lamp compensate in.tif --shrinkage x:20%,y:50% -o out.tif").succeeds_quietly();
    let layers = scratch.layers("out.tif");
    let large = mask(&layers[0]);
    assert_eq!((large.width(), large.height()), (96, 80));
    assert_eq!(
        (large.row(9), large.row(10), large.row(69)),
        (&[][..], &[12, 37][..], &[12, 37][..])
    );
    assert_eq!(layers[0].info.origin_mm, Some([12.5, 40.0]));
    assert_eq!(layers[0].info.other["compensate"]["shrinkage"], serde_json::json!([0.2, 0.5]));
    // The corner (11 mm, 19.5 mm) has gone to (13.75 mm, 39 mm), to half a pixel.
    let [x, y] = [12.5 + 0.1 * 12.0, 40.0 - 0.1 * 10.0];
    assert!((x - 13.75f64).abs() <= 0.05 + 1e-9 && (y - 39.0f64).abs() <= 0.05, "{x} {y}");
    scratch.run("tile out.tif --area 30x30mm -o build.tif").succeeds_quietly();
    scratch.run("lamp compensate build.tif --shrinkage 2% -o out.tif").is_refused_with(&[
        "build.tif",
        "layer 0",
        "before tile",
    ]);
}

#[test]
fn it_is_a_stage_whatever_the_threads() {
    let scratch = Scratch::new();
    scratch.part("tower.stl", Sample::Tower, 2_000);
    let slice = "slice tower.stl --dpi 200 --thickness 5mm";
    let rest = "dither --quiet | tile --area 200x200mm --mesh none";
    for threads in [1, 2, 7] {
        let line = format!(
            "{slice} | lamp compensate --uniform 0.3mm --threads {threads} --quiet | {rest} > {threads}.tif"
        );
        scratch.run(&line).succeeds_quietly();
        assert!(scratch.bytes(&format!("{threads}.tif")) == scratch.bytes("1.tif"));
    }
    scratch.run(&format!("{slice} | {rest} > plain.tif")).succeeds_quietly();
    let white = |name| -> u64 {
        lamp_tests::masks(&scratch.layers(name)).iter().map(|mask| mask.white_pixels()).sum()
    };
    assert!(white("1.tif") < white("plain.tif") && white("1.tif") * 2 > white("plain.tif"));
}

#[test]
fn what_was_done_before_is_said_once() {
    let scratch = Scratch::new();
    let bar = |index| layer(index, Image::Mask(blocks(&[[10, 30, 5, 35]])));
    scratch.stack("in.tif", [bar(0), bar(1)]);
    // Shrinkage, then edges: each once.
    scratch.run("lamp compensate in.tif --shrinkage 2% -o larger.tif").succeeds_quietly();
    scratch.run("lamp compensate larger.tif --uniform 100um -o out.tif").succeeds_quietly();
    let page = &scratch.layers("out.tif")[0].info.other["compensate"];
    assert_eq!(page["shrinkage"], serde_json::json!([0.02, 0.02]));
    assert_eq!(page["inwards_um"], serde_json::json!([100.0, 100.0]));
    for (again, words) in [
        ("--uniform 100um", "out.tif: its layers were compensated before"),
        ("--shrinkage 2%", "out.tif: its layers were enlarged for shrinkage before"),
    ] {
        let line = format!("lamp compensate out.tif {again}");
        let said = scratch.run(&format!("{line} -o twice.tif")).succeeds().stderr;
        assert!(said.contains(words) && said.lines().count() == 1, "{said}");
        scratch.run(&format!("{line} --quiet -o twice.tif")).succeeds_quietly();
    }
}

#[test]
fn growing_out_of_the_image_is_told() {
    let scratch = Scratch::new();
    scratch.stack("in.tif", [layer(0, Image::Mask(blocks(&[[1, 30, 5, 35]])))]);
    let said = scratch.run("lamp compensate in.tif --uniform -150um -o out.tif").succeeds().stderr;
    assert!(said.contains("layer 0") && said.contains("--margin"), "{said}");
    scratch.run("lamp compensate in.tif --uniform -100um -o out.tif").succeeds_quietly();
}

#[test]
fn what_cannot_be_done_is_said() {
    let scratch = Scratch::new();
    scratch.stack("in.tif", [layer(0, Image::Mask(blocks(&[[10, 30, 5, 35]])))]);
    scratch.write("mine.toml", MATERIAL.as_bytes());
    let dark = MATERIAL.lines().filter(|line| {
        !["[intensity]", "value = \"1 W/cm2\"", "source = \"a meter\""].contains(line)
    });
    scratch.write("dark.toml", dark.collect::<Vec<_>>().join("\n").as_bytes());
    let to = "-o out.tif";
    for (line, words) in [
        ("--material mine.toml", &["in.tif", "layer 0", "--dose"][..]),
        ("--material lamp-suspension --dose 300mJ/cm2", &["lamp-suspension", "[[cure-width]]"]),
        ("--material teapot --dose 300mJ/cm2", &["teapot", "lamp-suspension"]),
        ("--uniform 1mm --report none/walls.json", &["none/walls.json", "no folder"]),
        ("--uniform 900mm --min-feature 0um", &["layer 0", "9000 pixels"]),
        ("--uniform 9mm", &["layer 0", "90 pixels", "6300 um", "--min-feature 0um"]),
        ("--uniform 6mm --min-feature 1mm", &["65 pixels", "64 is the most", "smaller"]),
    ] {
        scratch.run(&format!("lamp compensate in.tif {line} {to}")).is_refused_with(words);
    }
    for line in [
        "",
        "--uniform 25",
        "--uniform 25um --material mine.toml",
        "--dose 300mJ/cm2",
        "--material mine.toml --dose 300",
        "--shrinkage 2",
        "--shrinkage 60%",
        "--uniform 1mm --min-feature -1um",
        "--uniform 1mm --report in.tif",
        "--material mine.toml --dose 300mJ/cm2 --report mine.toml",
        "--material mine.toml --dose 300mJ/cm2 -o mine.toml",
    ] {
        let ran = scratch.run(&format!("lamp compensate in.tif {line} {to}"));
        assert_eq!(ran.statuses, [Some(2)], "{ran:?}");
    }
    assert_eq!(scratch.names(), ["dark.toml", "in.tif", "mine.toml"]);
    let mut bare = layer(0, Image::Mask(blocks(&[])));
    bare.pitch = None;
    scratch.stack("bare.tif", [bare]);
    scratch
        .run("lamp compensate bare.tif --uniform 1mm -o out.tif")
        .is_refused_with(&["bare.tif", "no resolution"]);
}
