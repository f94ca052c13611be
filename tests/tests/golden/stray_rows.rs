//! Each kind of stray rows above its correction by `fix`.

use lamp_fixtures::Sample;
use lamp_stack::{Image, Layer, Mask, MaskBuilder};
use lamp_tests::{Scratch, at_least, edited, mask, stripped, with_soft_edges};
use serde_json::Value;

use super::{Images, check};

/// Black rows between two images.
const GUTTER: u32 = 6;

fn stacked(images: &[&Mask]) -> Mask {
    let mut all = MaskBuilder::new(images[0].width());
    for (k, image) in images.iter().enumerate() {
        all.push_black(if k == 0 { 0 } else { GUTTER });
        image.rows().for_each(|row| all.push_row(row).expect("images of one width"));
    }
    all.finish()
}

/// A part with defects, sliced to `stray.tif`.
fn broken(part: &str, slicing: &str) -> Scratch {
    let scratch = Scratch::new();
    scratch.run(&format!("lamp sample {part} -o part.stl")).succeeds();
    let line = format!("slice part.stl --dpi 100 --thickness 1mm {slicing} -o stray.tif");
    scratch.run(&line).succeeds();
    scratch
}

/// The torus near its waist, whole, as a stack of three layers.
fn waist() -> Vec<Layer> {
    let scratch = Scratch::new();
    scratch.part("torus.stl", Sample::Torus, 5_000);
    let line = "slice torus.stl --dpi 60 --thickness 1mm --layers 6..9 -o waist.tif";
    scratch.run(line).succeeds_quietly();
    stripped(&scratch.layers("waist.tif"))
}

/// Corrects `stray.tif`. Of a layer whose bands were all corrected, one of them
/// of these kinds, returns what it was and what it is.
fn corrected(scratch: &Scratch, layer: u32, kinds: &[&str], options: &str) -> [Image; 2] {
    let line = format!("fix stray.tif {options} --report fix.json -o fixed.tif");
    scratch.run(&line).succeeds();
    let report: Value = serde_json::from_slice(&scratch.bytes("fix.json")).unwrap();
    let bands = report["bands"].as_array().unwrap();
    let of_layer: Vec<_> = bands.iter().filter(|band| band["layer"] == layer).collect();
    assert!(of_layer.iter().any(|band| band["kinds"] == Value::from(kinds)), "{of_layer:?}");
    assert!(of_layer.iter().all(|band| band["outcome"] == "corrected"), "{of_layer:?}");
    ["stray.tif", "fixed.tif"].map(|name| {
        let layers = scratch.layers(name);
        let found = layers.into_iter().find(|of| of.info.index == layer);
        found.expect("such a layer").image.into_image()
    })
}

fn masks([stray, fixed]: &[Image; 2]) -> [&Mask; 2] {
    [stray, fixed].map(|image| match image {
        Image::Mask(mask) => mask,
        Image::Gray(_) => panic!("a mask stays one"),
    })
}

fn pair(name: &str, images: &[Image; 2]) -> (String, Mask) {
    (name.to_owned(), stacked(&masks(images)))
}

/// A band of one row, and one of five.
fn ends_white() -> (String, Mask) {
    let scratch = broken("sphere --facets 1k --defect drop --count 12 --seed 7", "");
    let kinds = &["ends white", "unbalanced"];
    pair("fix_ends_white", &corrected(&scratch, 11, kinds, ""))
}

/// The gap of each of two copies in a row: `tile` ends what runs across where
/// the copy's image ends, so that the row ends black.
fn tiled() -> (String, Mask) {
    let scratch = broken("sphere --facets 400 --defect drop --count 1 --seed 4", "");
    let line = "tile stray.tif --mesh none --area 70x35mm --copies 2 --gap 2mm";
    let tiled = scratch.run(line).succeeds().stdout;
    scratch.write("stray.tif", &tiled);
    pair("fix_unbalanced", &corrected(&scratch, 10, &["unbalanced"], ""))
}

/// Both edges of the hole are missed in a row.
fn paired() -> (String, Mask) {
    let scratch = Scratch::new();
    let mut layer = waist().remove(1);
    let whole = mask(&layer);
    let missed = |row, had: &[u32]| match (row, had) {
        (50, &[first, _, _, last]) => vec![first, last],
        _ => had.to_vec(),
    };
    layer.image = edited(whole, missed).into();
    (layer.info.closed, layer.info.open_rows) = (Some(false), vec![50, 51]);
    scratch.stack("stray.tif", [layer]);
    pair("fix_paired", &corrected(&scratch, 1, &["paired"], ""))
}

/// A run across the hole that neither the rows nor the neighboring layers have.
fn sliver() -> (String, Mask) {
    let scratch = Scratch::new();
    let mut layers = waist();
    let added = |row, had: &[u32]| match (row, had) {
        (60, &[a, b, c, d]) => vec![a, b, b + 12, c - 8, c, d],
        _ => had.to_vec(),
    };
    layers[1].image = edited(mask(&layers[1]), added).into();
    (layers[1].info.closed, layers[1].info.open_rows) = (Some(false), vec![60, 61]);
    scratch.stack("stray.tif", layers);
    pair("fix_sliver", &corrected(&scratch, 1, &["sliver"], ""))
}

/// Without a margin, the cube's first rows.
fn at_edge() -> (String, Mask) {
    let scratch = broken("cube --facets 400 --defect drop --count 14 --seed 2", "--margin 0");
    let kinds = &["ends white", "unbalanced", "at edge"];
    pair("fix_at_edge", &corrected(&scratch, 5, kinds, ""))
}

/// Gaps on both sides of the sphere, the one where the other ends.
fn touching() -> (String, Mask) {
    let scratch = broken("sphere --facets 1k --defect drop --count 14 --seed 3", "");
    let kinds = &["ends white", "unbalanced", "touching"];
    pair("fix_touching", &corrected(&scratch, 18, kinds, ""))
}

/// A band of ten rows where the edge leans: what the rows above and below
/// share leaves steps, a curve does not (002, figures 29b and 29c).
fn wide() -> Vec<(String, Mask)> {
    let scratch = broken("torus --facets 600 --defect drop --count 1 --seed 3", "");
    let by = |method: &str| {
        let options = format!("--method {method} --min-confidence 0");
        let images = corrected(&scratch, 13, &["ends white", "unbalanced"], &options);
        pair(&format!("fix_wide_{method}"), &images)
    };
    vec![by("nearest"), by("spline")]
}

/// A gray image: its outline as it was, the outline now, and where it is of
/// half exposure and more, as it was and now.
fn gray() -> (String, Mask) {
    let scratch = broken("sphere --facets 1k --defect drop --count 12 --seed 7", "");
    let mut layers = scratch.layers("stray.tif");
    for layer in &mut layers {
        layer.image = with_soft_edges(mask(layer)).into();
    }
    scratch.stack("stray.tif", layers);
    let images = corrected(&scratch, 11, &["ends white", "unbalanced"], "");
    let at = |level: u8| {
        images.each_ref().map(|image| match image {
            Image::Gray(gray) => at_least(gray, level),
            Image::Mask(_) => panic!("gray stays gray"),
        })
    };
    let all = [at(1), at(128)];
    ("fix_gray".to_owned(), stacked(&all.as_flattened().iter().collect::<Vec<_>>()))
}

/// All of them.
pub(crate) fn fixed() -> Images {
    let mut images = wide();
    images.extend([ends_white(), tiled(), paired(), sliver(), at_edge(), touching(), gray()]);
    images
}

#[test]
fn each_kind_of_stray_rows_is_corrected_as_it_was() {
    check(&fixed());
}
