//! Layers compared with golden images, pixel for pixel.
//!
//! After a change that is meant,
//! `LAMP_BLESS=1 cargo test -p lamp-tests golden::`
//! rewrites the images in `fixtures/golden` and says which ones changed; look
//! at them before they are committed.

mod stray_rows;

use lamp_fixtures::{Mesh, Sample, sphere};
use lamp_stack::{Layer, Mask};
use lamp_tests::{
    Change, Golden, Scratch, Shade, difference, ends_white, mask, note, read_stack, write_gray_ramp,
};

/// Images by the names of their golden ones.
type Images = Vec<(String, Mask)>;

/// Compares all images, so that one run shows all that differ.
#[track_caller]
fn check(images: &Images) {
    let golden = Golden::of_the_project();
    let mut faults = Vec::new();
    for (name, image) in images {
        match golden.check(name, image) {
            Ok(None) => {}
            Ok(Some(change)) => note(&format!("golden image {name}.png: {change:?}")),
            Err(fault) => faults.push(fault),
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The images of some layers, named after the part and their index.
fn named(part: &str, layers: &[Layer], wanted: &[u32]) -> Images {
    let image = |&k: &u32| {
        let layer = layers.iter().find(|layer| layer.info.index == k).expect("such a layer");
        (format!("{part}_{k:03}"), mask(layer).clone())
    };
    wanted.iter().map(image).collect()
}

fn sliced(part: Sample, facets: usize, options: &str) -> Vec<Layer> {
    let scratch = Scratch::new();
    scratch.part("part.stl", part, facets);
    read_stack(scratch.run(&format!("slice part.stl {options}")).succeeds_quietly().stdout)
}

/// Drains in the flange, a row of pins and holes, the serpentine between
/// them, the tip plate.
fn blade() -> Images {
    named("blade", &sliced(Sample::Blade, 24_000, "--dpi 100 --thickness 1mm"), &[5, 45, 96, 117])
}

/// Cylinder, cone, sphere, and the five lobes at their widest and narrowest.
fn tower() -> Images {
    let layers = sliced(Sample::Tower, 20_000, "--dpi 150 --thickness 1mm");
    named("tower", &layers, &[9, 30, 45, 60, 70])
}

/// The torus where it starts, at its waist and where it ends.
fn torus() -> Images {
    named("torus", &sliced(Sample::Torus, 5_000, "--dpi 100 --thickness 1mm"), &[0, 7, 14])
}

fn cube() -> Images {
    named("cube", &sliced(Sample::Cube, 200, "--dpi 100 --thickness 1mm"), &[10])
}

/// Two balls that overlap: what the two rules of filling make of them.
fn overlap() -> Images {
    let ball = sphere(8.0, 2_000);
    let moved = ball.map(|[x, y, z]| [x + 7.0, y + 3.0, z]);
    let scratch = Scratch::new();
    scratch.mesh("balls.stl", &Mesh { facets: [ball.facets, moved.facets].concat() });
    let filled = |fill: &str| {
        let line = format!("slice balls.stl --dpi 150 --thickness 1mm --layers 6 --fill {fill}");
        let layers = read_stack(scratch.run(&line).succeeds().stdout);
        (format!("overlap_{fill}"), mask(&layers[0]).clone())
    };
    vec![filled("even-odd"), filled("nonzero")]
}

/// A tower that lost facets: the stray rows, and what `fix` makes of them.
fn broken() -> Images {
    let scratch = Scratch::new();
    let line = "lamp sample tower --facets 20k --defect drop --count 60 --seed 7 -o broken.stl";
    scratch.run(line).succeeds();
    scratch.run("slice broken.stl --dpi 150 --thickness 500um -o stray.tif").succeeds();
    scratch.run("fix stray.tif -o fixed.tif").succeeds();
    // A layer of the cone, where a true row is known from its neighbors.
    let wanted = &[51];
    let stray = named("broken", &scratch.layers("stray.tif"), wanted);
    let fixed = named("broken_fixed", &scratch.layers("fixed.tif"), wanted);
    assert!(ends_white(&stray[0].1) && !ends_white(&fixed[0].1));
    [stray, fixed].concat()
}

/// Copies on a build area, the last row not full.
fn tiled() -> Images {
    let scratch = Scratch::new();
    scratch.part("torus.stl", Sample::Torus, 2_000);
    let line = "slice torus.stl --dpi 60 --thickness 1mm --layers 7 | fix | dither \
                | tile --mesh none --area 220x150mm --copies 5 --gap 2mm";
    named("tiled", &read_stack(scratch.run(line).succeeds_quietly().stdout), &[7])
}

/// A ramp from black to white in dots.
fn dithered() -> Images {
    let scratch = Scratch::new();
    write_gray_ramp(&scratch.path("ramp.tif"), 256, 64);
    let dots = |method: &str| {
        let line = format!("dither -q ramp.tif --method {method}");
        let layers = read_stack(scratch.run(&line).succeeds_quietly().stdout);
        (format!("ramp_{method}"), mask(&layers[0]).clone())
    };
    ["blue-noise", "ordered", "floyd-steinberg", "sierra-lite", "threshold"].map(dots).to_vec()
}

#[test]
fn the_blade_is_as_it_was() {
    check(&blade());
}

#[test]
fn the_tower_is_as_it_was() {
    check(&tower());
}

#[test]
fn torus_and_cube_are_as_they_were() {
    check(&torus());
    check(&cube());
}

#[test]
fn overlapping_bodies_fill_as_they_did() {
    check(&overlap());
}

#[test]
fn stray_rows_and_their_correction_are_as_they_were() {
    check(&broken());
}

#[test]
fn a_tiled_build_is_as_it_was() {
    check(&tiled());
}

#[test]
fn dots_are_as_they_were() {
    check(&dithered());
}

#[test]
fn every_golden_image_is_compared() {
    let makers = [blade, tower, torus, cube, overlap, broken, tiled, dithered, stray_rows::fixed];
    let compared: Vec<String> = makers.iter().flat_map(|make| make()).map(|(n, _)| n).collect();
    let names = Golden::of_the_project().names();
    let left_over: Vec<_> = names.iter().filter(|name| !compared.contains(name)).collect();
    assert!(left_over.is_empty(), "no test makes {left_over:?} any more: remove them");
}

/// `#` is white.
fn picture(rows: &[&str]) -> Mask {
    let mut offsets = vec![0];
    let mut transitions = Vec::new();
    for row in rows {
        let row = row.as_bytes();
        let toggles = |&c: &usize| row[c] != if c == 0 { b'.' } else { row[c - 1] };
        transitions.extend((0..row.len()).filter(toggles).map(|c| c as u32));
        offsets.push(transitions.len() as u32);
    }
    Mask::new(rows[0].len() as u32, offsets, transitions).expect("rows of one width")
}

/// Golden images in a folder of their own, to be compared or blessed.
fn golden_in(scratch: &Scratch, bless: bool) -> Golden {
    Golden::new(scratch.path("images"), scratch.path("differences"), bless)
}

#[test]
fn one_other_pixel_is_noticed_until_it_is_blessed() {
    // Wider than a byte, and not a whole number of bytes.
    let before = picture(&["..####....#", "#.........."]);
    let after = picture(&["..####....#", "#....#....."]);
    let scratch = Scratch::new();
    let (compare, bless) = (golden_in(&scratch, false), golden_in(&scratch, true));
    assert!(compare.check("it", &before).unwrap_err().contains("LAMP_BLESS=1 cargo test"));
    assert_eq!(bless.check("it", &before), Ok(Some(Change::New)));
    assert_eq!(compare.check("it", &before), Ok(None));
    assert!(!scratch.path("differences").exists());

    let fault = compare.check("it", &after).unwrap_err();
    for words in ["it: 1 pixels differ", "differences/it.png", "LAMP_BLESS=1 cargo test"] {
        assert!(fault.contains(words), "{fault}");
    }
    assert_eq!(bless.check("it", &after), Ok(Some(Change::Changed)));
    assert_eq!(bless.check("it", &after), Ok(None));
    assert_eq!(compare.check("it", &after), Ok(None));
    assert_eq!(compare.names(), ["it"]);
}

#[test]
fn another_size_is_noticed_though_all_of_it_is_black() {
    let scratch = Scratch::new();
    golden_in(&scratch, true).check("it", &Mask::black(40, 30)).unwrap();
    let fault = golden_in(&scratch, false).check("it", &Mask::black(40, 31)).unwrap_err();
    assert!(fault.contains("40 x 31 now, 40 x 30 there"), "{fault}");
}

#[test]
fn the_difference_picture_shows_each_pixel_as_it_compares() {
    use Shade::{Black, Gone, New, White};
    let expected = picture(&["##.", "#.."]);
    let actual = picture(&["#.#.", "...."]);
    let shades = [[White, Gone, New, Black], [Gone, Black, Black, Black]];
    assert_eq!(difference(&expected, &actual), shades);

    let scratch = Scratch::new();
    golden_in(&scratch, true).check("it", &expected).unwrap();
    golden_in(&scratch, false).check("it", &actual).unwrap_err();
    let png = scratch.bytes("differences/it.png");
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    const GRAY: [u8; 3] = [128; 3];
    const RED: [u8; 3] = [220, 0, 0];
    const BLUE: [u8; 3] = [0, 90, 255];
    let rows = [[[255; 3], RED, BLUE, GRAY], [RED, GRAY, GRAY, GRAY]];
    assert_eq!(pixels, rows.as_flattened().as_flattened());
}
