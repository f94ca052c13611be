//! Checks the mesh of `tile`: around and below the parts, never on them.

use std::ops::Range;

use lamp_fixtures::Sample;
use lamp_stack::{Frame, Layer, Mask, Op};
use lamp_tests::{Scratch, ends_white, mask, write_gray_ramp};

/// The default clearance in pixels, at 100 dpi.
const CLEARANCE: f64 = 1.0 * 100.0 / 25.4;
/// The default number of layers of mesh alone.
const BASE: usize = 5;

/// Returns the white runs of an image, as rows and columns.
fn white_runs(mask: &Mask) -> impl Iterator<Item = (usize, Range<usize>)> + '_ {
    mask.rows().enumerate().flat_map(|(k, row)| {
        let runs = lamp_stack::white_runs(row, mask.width());
        runs.map(move |(start, end)| (k, start as usize..end as usize))
    })
}

/// Returns, by brute force, the pixels with fewer than `gap` pixels between them and a white one.
fn nearer_than(mask: &Mask, gap: f64) -> Vec<Vec<bool>> {
    let (width, height) = (mask.width() as usize, mask.height() as usize);
    let mut near = vec![vec![false; width]; height];
    let reach = gap.ceil() as usize + 1;
    for (row, run) in white_runs(mask) {
        let first = row.saturating_sub(reach);
        let lines = near[first..(row + reach + 1).min(height)].iter_mut();
        for (line, near) in (first..).zip(lines) {
            // The distance between centers is one pixel more.
            let away = |across: usize| (across as f64).hypot(line.abs_diff(row) as f64);
            let across = (0..=reach).rev().find(|&across| away(across) < gap + 1.0);
            let Some(across) = across else { continue };
            near[run.start.saturating_sub(across)..(run.end + across).min(width)].fill(true);
        }
    }
    near
}

fn minus(a: &Mask, b: &Mask) -> Mask {
    a.combined(Op::Difference, b).unwrap()
}

fn pixels_in(mask: &Mask, places: &[Vec<bool>]) -> usize {
    white_runs(mask).map(|(row, run)| places[row][run].iter().filter(|&&place| place).count()).sum()
}

#[test]
fn parts_are_untouched_and_moats_are_as_wide_as_stated() {
    let scratch = Scratch::with_tower_and_torus();
    let stacks = "tower.tif torus.tif";
    for (k, packed) in ["", "--pack outline"].into_iter().enumerate() {
        let line = "tile tower.tif:3 torus.tif:2 --area 120x150mm --least-piece 0 --layout-out l.json -o meshed.tif";
        scratch.run(&format!("{line} {packed}")).succeeds_quietly();
        let fit = if packed.is_empty() { "" } else { "--fit" };
        let again = format!("tile {stacks} {fit} --layout l.json");
        scratch.run(&format!("{again} --mesh none -o plain.tif")).succeeds_quietly();
        scratch
            .run(&format!("{again} --break-width 0 --least-piece 0 -o unbroken.tif"))
            .succeeds_quietly();
        let [meshed, plain, unbroken] =
            ["meshed.tif", "plain.tif", "unbroken.tif"].map(|name| scratch.layers(name));
        assert_eq!((plain.len(), meshed.len(), unbroken.len()), (76, 76 + BASE, 76 + BASE));
        let whole = mask(&unbroken[0]);
        assert!(mask(&meshed[0]) == whole, "break lines are for the layers of the parts");
        for layer in [0, 3, 12, 20, 50, 75] {
            let [parts, meshed, unbroken] =
                [&plain[layer], &meshed[layer + BASE], &unbroken[layer + BASE]].map(mask);
            assert_eq!(minus(parts, meshed).white_pixels(), 0, "{k}, layer {layer}");
            let [mesh, unbroken] = [meshed, unbroken].map(|build| minus(build, parts));
            // The moat follows what is part in this layer or below.
            let union = |all: Mask, layer: &Layer| all.combined(Op::Union, mask(layer)).unwrap();
            let parts = &plain[..=layer].iter().fold(parts.clone(), union);
            assert_eq!(pixels_in(&mesh, &nearer_than(parts, CLEARANCE)), 0, "{k}, layer {layer}");
            // Outside the moat, mesh is where it would be without parts.
            assert_eq!(minus(&unbroken, whole).white_pixels(), 0, "{k}, layer {layer}");
            assert_eq!(minus(&mesh, &unbroken).white_pixels(), 0, "{k}, layer {layer}");
            let lost = minus(whole, &unbroken);
            let within = pixels_in(&lost, &nearer_than(parts, CLEARANCE + 2.0));
            let enclosed = lost.white_pixels() - within as u64;
            // Mesh in the hole of a torus could not be removed.
            assert!(enclosed > 0, "{k}, layer {layer}: {enclosed}");
            let cut = minus(&unbroken, &mesh).white_pixels() as f64 / mesh.white_pixels() as f64;
            assert!((0.01..0.3).contains(&cut), "{k}, layer {layer}: {cut} is cut by break lines");
        }
    }
}

#[test]
fn the_base_lies_below_and_heights_stay_the_parts() {
    let scratch = Scratch::with_tower_and_torus();
    let options = "--copies 1 --area 100x90mm";
    scratch.run(&format!("tile torus.tif {options} --mesh none -o plain.tif")).succeeds_quietly();
    for (line, base) in [("", BASE), ("--base-layers 0", 0), ("--base-layers 12", 12)] {
        scratch.run(&format!("tile torus.tif {options} {line} -o build.tif")).succeeds_quietly();
        let (build, parts) = (scratch.layers("build.tif"), scratch.layers("plain.tif"));
        assert_eq!(build.len(), parts.len() + base);
        let stack = build[0].info.stack.as_ref().unwrap();
        assert_eq!(stack.layers.map(|layers| layers as usize), Some(build.len()));
        let facts = |layer: &Layer| (layer.info.z_um, layer.info.thickness_um);
        for (k, layer) in build.iter().enumerate() {
            let height = (k as f64 - base as f64) * 1000.0;
            assert_eq!(facts(layer), (Some(height), Some(1000.0)));
            assert_eq!((layer.info.index as usize, layer.info.stack.is_some()), (k, k == 0));
        }
        assert!(build[base..].iter().map(facts).eq(parts.iter().map(facts)));
        assert!(build[..base].iter().all(|layer| layer.image == build[0].image));
        assert!(scratch.run("lamp info build.tif").succeeds_quietly().stdout.len() > 100);
    }
}

#[test]
fn ranges_tiled_apart_join_to_the_whole() {
    let scratch = Scratch::with_tower_and_torus();
    let place = "tile tower.tif --area 120x110mm --layout-out l.json -o x.tif";
    scratch.run(place).succeeds_quietly();
    for moat in ["rising", "layer"] {
        let line = format!("tile tower.tif --layout l.json --cell 3mm --moat {moat}");
        for (k, range) in ["..30", "30..31", "31.."].iter().enumerate() {
            scratch.run(&format!("{line} --layers {range} -o {k}.tif")).succeeds_quietly();
        }
        scratch.run("lamp join 0.tif 1.tif 2.tif -o joined.tif").succeeds_quietly();
        let whole = scratch.run(&line).succeeds_quietly().stdout;
        assert!(scratch.bytes("joined.tif") == whole);
        assert_eq!(scratch.layers("2.tif")[0].info.index as usize, 31 + BASE);
        let alone = format!("tile tower.tif --area 120x110mm --moat {moat} --layers 31..");
        let alone = scratch.run(&alone).succeeds_quietly().stdout;
        let piped = format!("tile --area 120x110mm --moat {moat} --layers 31..");
        let stack = scratch.bytes("tower.tif");
        assert!(scratch.run_on(&piped, &stack).succeeds_quietly().stdout == alone);
    }
}

#[test]
fn an_image_is_repeated_as_the_mesh() {
    let scratch = Scratch::with_tower_and_torus();
    let text = ["#######", "#......", "#..##..", "#..##..", "#......"];
    let row = |row: &&str| -> Vec<u32> {
        let at = |column: usize| row.as_bytes().get(column) == Some(&b'#');
        (0..7).filter(|&c| at(c) != (c > 0 && at(c - 1))).map(|c| c as u32).collect()
    };
    let mut template = lamp_stack::MaskBuilder::new(7);
    text.iter().for_each(|line| template.push_row(&row(line)).unwrap());
    let layer = Layer {
        info: lamp_stack::PageInfo::default(),
        pitch: None,
        image: template.finish().into(),
    };
    scratch.stack("walls.tif", [layer]);
    scratch.run("tile torus.tif --mesh walls.tif --copies 1 -o build.tif").succeeds_quietly();
    let build = scratch.layers("build.tif");
    let base = mask(&build[0]);
    for (row, column) in (0..20).flat_map(|row| (0..base.width() - 1).map(move |c| (row, c))) {
        let expected = text[row % 5].as_bytes()[column as usize % 7] == b'#';
        assert_eq!(base.is_white(column, row as u32), expected, "{column}, {row}");
    }
    let command = build[0].info.stack.as_ref().unwrap().commands.last().unwrap();
    assert!(command.contains("--mesh walls.tif"), "{command}");
    write_gray_ramp(&scratch.path("gray.tif"), 16, 16);
    // Gray counts from half the brightness of white.
    scratch.run("tile torus.tif --mesh gray.tif --copies 1 -o build.tif").succeeds_quietly();
    let build = scratch.layers("build.tif");
    scratch.run("dither gray.tif --method threshold -q -o dots.tif").succeeds_quietly();
    let (base, dots) = (mask(&build[0]), scratch.layers("dots.tif"));
    for (row, column) in (0..16).flat_map(|row| (0..16).map(move |column| (row, column))) {
        assert_eq!(base.is_white(column, row), mask(&dots[0]).is_white(column, row));
    }
    scratch.run("tile torus.tif --mesh hexagons -o x.tif").is_wrong_usage(&[
        "hexagons",
        "there is no such image",
        "hexagon, square, none",
    ]);
    for (options, words) in [
        ("--cell 2mm --wall 2mm", "wall"),
        ("--mesh square --cell 100um", "cell"),
        ("--clearance 500mm", "clearance"),
    ] {
        let line = format!("tile torus.tif {options} --gap 5mm -o x.tif");
        scratch.run(&line).is_refused_with(&[words]);
    }
    assert!(!scratch.path("x.tif").exists());
}

#[test]
fn options_that_contradict_each_other_are_wrong_usage() {
    let scratch = Scratch::with_tower_and_torus();
    let before = scratch.names();
    for (options, words) in [
        ("--mesh none --cell 4mm", ["--cell", "--mesh none"]),
        ("--mesh none --clearance 1mm", ["--clearance", "--mesh none"]),
        ("--mesh none --break-pitch 9mm", ["--break-pitch", "--mesh none"]),
        ("--mesh none --base-layers 3", ["--base-layers", "--mesh none"]),
        ("--mesh none --least-piece 3mm2", ["--least-piece", "--mesh none"]),
        ("--least-piece 3mm", ["--least-piece", "such as 1mm2"]),
        ("--least-piece -3mm2", ["--least-piece", "below zero"]),
        ("--mesh torus.tif --wall 1mm", ["--wall", "an image has its own walls"]),
        ("--base-layers x", ["--base-layers", "invalid"]),
        ("--cell 4", ["--cell", "unit"]),
    ] {
        scratch.run(&format!("tile tower.tif {options} -o x.tif")).is_wrong_usage(&words);
    }
    assert_eq!(scratch.names(), before);
}

#[test]
fn threads_change_no_byte_and_fix_nothing() {
    let scratch = Scratch::with_tower_and_torus();
    let line = "tile tower.tif:3 torus.tif:2 --area 120x150mm --fit --mesh square";
    let build = scratch.run(&format!("{line} --threads 1")).succeeds_quietly().stdout;
    assert!(scratch.run(&format!("{line} --threads 3")).succeeds_quietly().stdout == build);
    scratch.write("build.tif", &build);
    assert!(scratch.layers("build.tif").iter().all(|layer| !ends_white(mask(layer))));
    assert!(scratch.run("fix build.tif").succeeds_quietly().stdout == build);
    assert!(scratch.run_on("fix | dither", &build).succeeds_quietly().stdout == build);
}

#[test]
fn edits_of_copies_hit_the_parts() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 2000);
    scratch.run("slice cube.stl --dpi 254 --thickness 500um -o cube.tif").succeeds_quietly();
    let label = |start: u32, copies: &str| {
        format!(
            "[[edit]]\nop = \"subtract\"\nz = [\"0mm\", \"1mm\"]\n{copies}\
             label = {{ text = \"{{n:03}}\", start = {start}, at = [[\"-9mm\", \"-9mm\"]], height = \"3mm\" }}\n"
        )
    };
    scratch.write("all.toml", label(8, "copies = true\n").as_bytes());
    scratch
        .run("tile cube.tif --fit --area 80x60mm --copies 6 | lamp edit - all.toml > build.tif")
        .succeeds_quietly();
    let build = scratch.layers("build.tif");
    let tile = &build[0].info.stack.as_ref().unwrap().other["tile"];
    let number = |key: &str, side: usize| tile[key][side].as_i64().unwrap();
    for k in 0..6 {
        scratch.write("one.toml", label(8 + k, "").as_bytes());
        scratch.run("lamp edit cube.tif one.toml -o one.tif").succeeds_quietly();
        let part = scratch.layers("one.tif");
        let [width, height] = [0, 1].map(|side| number("part_pixels", side) as u32);
        let frame = |left, top| Frame { left, top, width, height };
        let at = |side: usize| tile["copies"][k as usize][side].as_i64().unwrap();
        let (left, top) = (number("part_corner", 0), number("part_corner", 1));
        let placed = part.iter().map(|layer| mask(layer).framed(frame(left, top)));
        let copy = build[BASE..].iter().map(|layer| mask(layer).framed(frame(at(0), at(1))));
        assert!(placed.eq(copy), "copy {k}");
        assert!(part[0].image != part[2].image);
    }
}

/// A transverse bore is free of mesh unless the moat follows each layer alone.
#[test]
fn mesh_keeps_out_of_a_part_that_lies() {
    let scratch = Scratch::new();
    scratch.part("cube.stl", Sample::Cube, 64);
    scratch
        .run("slice cube.stl --rotate x:90 --dpi 100 --thickness 1mm -o cube.tif")
        .succeeds_quietly();
    let tile = "tile cube.tif --fit --area 40x40mm --copies 1";
    scratch.run(&format!("{tile} --mesh none -o part.tif")).succeeds_quietly();
    let inside = |options: &str| {
        scratch.run(&format!("{tile} {options} -o build.tif")).succeeds_quietly();
        // The middle of the bore, in the middle layer.
        let (build, part) = (scratch.layers("build.tif"), scratch.layers("part.tif"));
        let (build, part) = (mask(&build[10]), mask(&part[10]));
        let frame = 45..113;
        frame
            .clone()
            .flat_map(|y| frame.clone().map(move |x| (x, y)))
            .filter(|&(x, y)| build.is_white(x, y) && !part.is_white(x, y))
            .count()
    };
    let mesh = "--cell 2mm --base-layers 0";
    assert!(inside(&format!("{mesh} --moat layer")) > 50);
    assert_eq!([inside(mesh), inside(&format!("{mesh} --moat outline"))], [0, 0]);
}

#[test]
fn layers_without_mesh_are_told_once() {
    let scratch = Scratch::with_tower_and_torus();
    let build = "tile tower.tif --copies 1 --area 60x60mm";
    scratch.run(&format!("{build} --gap 4mm --mesh none -o plain.tif")).succeeds_quietly();
    let plain = scratch.layers("plain.tif");
    for options in ["", "--clearance 40mm", "--least-piece 150mm2"] {
        let ran = scratch.run(&format!("{build} {options} -o meshed.tif")).succeeds();
        let meshed = scratch.layers("meshed.tif");
        let of_parts = plain.iter().zip(&meshed[BASE..]);
        let bare: Vec<_> = of_parts.filter(|(a, b)| a.image == b.image).map(|(_, b)| b).collect();
        let Some(first) = bare.first() else {
            assert_eq!((options, ran.stderr.as_str()), ("", ""));
            continue;
        };
        assert_ne!(options, "");
        let layers = format!("{} layers, the first {}:", bare.len(), first.info.name());
        assert!(ran.stderr.contains(&layers), "no `{layers}` in {ran:?}");
        assert_eq!(ran.stderr.lines().count(), 1, "{ran:?}");
    }
}
