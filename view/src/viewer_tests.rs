//! Tests of what the viewer answers.

use std::sync::Arc;

use lamp_stack::{
    Destination, Format, GrayMask, Image, IndexedStack, Layer, LevelChange, Mask, MaskBuilder,
    PageInfo, Pitch, StackError, write_stack,
};
use lamp_supports::FoundPixels;
use serde_json::{Value, json};

use super::*;

const MEMORY: u64 = 1 << 30;

/// A stack of 8 x 3 pixels whose layers have these rows of transitions.
fn stack(name: &str, layers: Vec<(PageInfo, Image)>) -> ViewedStack {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let layer = |(index, (info, image)): (u32, (PageInfo, Image))| Layer {
        info: PageInfo { index, origin_mm: Some([1.0, 5.0]), ..info },
        pitch: Pitch::of_dpi(254.0),
        image: image.into(),
    };
    let layers = (0..).zip(layers).map(layer).map(Ok::<_, StackError>);
    write_stack(layers, Destination::File(path.clone()), Format::Big).unwrap();
    // The file stays open.
    ViewedStack::new(name, IndexedStack::open(&path).unwrap())
}

fn mask(rows: [&[u32]; 3]) -> Mask {
    let mut mask = MaskBuilder::new(8);
    rows.iter().for_each(|row| mask.push_row(row).unwrap());
    mask.finish()
}

fn white(rows: [&[u32]; 3]) -> (PageInfo, Image) {
    (PageInfo::default(), Image::Mask(mask(rows)))
}

fn viewer() -> Viewer {
    let (info, image) = white([&[1, 6], &[1, 4], &[]]);
    let other = [("fix".to_owned(), json!({"bands": [{"row": 2, "rows": 1}]}))];
    let info = PageInfo { stray_rows: vec![0, 1], other: other.into_iter().collect(), ..info };
    let a = stack("a.tif", vec![white([&[1, 4], &[1, 4], &[7]]), (info, image)]);
    let b = stack("b.tif", vec![white([&[1, 4], &[1, 4], &[7]]), white([&[2, 6], &[1, 5], &[]])]);
    Viewer::new(vec![a, b], MEMORY, 2, "lamp")
}

fn drawn(viewer: &Viewer, stack: usize, layer: usize, overlay: Overlay) -> Image {
    let image = viewer.image(stack, layer, ImageKind::Over(overlay), &GivenUp::default());
    Image::clone(&image.unwrap())
}

#[test]
fn overlays_have_the_pixels_that_they_tell() {
    let viewer = viewer();
    let is = |stack, layer, overlay, rows| {
        assert_eq!(drawn(&viewer, stack, layer, overlay), Image::Mask(mask(rows)), "{overlay}");
    };
    is(0, 1, Overlay::New, [&[4, 6], &[], &[]]);
    is(0, 1, Overlay::Below, [&[], &[], &[7]]);
    is(0, 0, Overlay::New, [&[1, 4], &[1, 4], &[7]]);
    is(0, 0, Overlay::Below, [&[], &[], &[]]);
    is(0, 1, Overlay::Added, [&[], &[4, 5], &[]]);
    is(0, 1, Overlay::Missing, [&[1, 2], &[], &[]]);
    // The same where the second stack is looked at.
    is(1, 1, Overlay::Added, [&[], &[4, 5], &[]]);
    is(1, 1, Overlay::Missing, [&[1, 2], &[], &[]]);
    is(0, 1, Overlay::Stray, [&[0], &[0], &[]]);
    is(0, 1, Overlay::Fixed, [&[], &[], &[0]]);
    let ids = |viewer: &Viewer| {
        let session = viewer.session();
        let overlays = session["overlays"].as_array().unwrap().iter();
        overlays.map(|overlay| overlay["id"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(ids(&viewer), ["below", "new", "added", "missing", "fixed", "stray"]);
    let one = Viewer::new(vec![stack("a.tif", vec![white([&[], &[], &[]])])], MEMORY, 2, "lamp");
    assert_eq!(ids(&one), ["below", "new"]);
}

#[test]
fn a_thick_layer_differs_where_any_thin_one_does() {
    let page = |z_um, thickness_um, rows| {
        let (info, image) = white(rows);
        (PageInfo { z_um: Some(z_um), thickness_um: Some(thickness_um), ..info }, image)
    };
    let thick = stack("thick.tif", vec![page(0.0, 150.0, [&[1, 4], &[], &[]])]);
    let thin = [page(0.0, 50.0, [&[1, 5], &[], &[]]), page(50.0, 50.0, [&[2, 4], &[], &[]])];
    let viewer = Viewer::new(vec![thick, stack("thin.tif", thin.into())], MEMORY, 2, "lamp");
    let is = |stack, layer, overlay, row: &[u32]| {
        let wanted = Image::Mask(mask([row, &[], &[]]));
        assert_eq!(drawn(&viewer, stack, layer, overlay), wanted, "{overlay}");
    };
    is(0, 0, Overlay::Added, &[4, 5]);
    is(0, 0, Overlay::Missing, &[1, 4]);
    is(1, 0, Overlay::Added, &[4, 5]);
    is(1, 1, Overlay::Missing, &[1, 2]);
    let layers = viewer.layers(0).unwrap();
    assert_eq!((&layers["partner"], &layers["shift"]), (&json!([1]), &json!([[0, 0]])));
}

#[test]
fn findings_appear_once_they_are_there() {
    let viewer = viewer();
    assert_eq!(drawn(&viewer, 0, 1, Overlay::Findings).change_count(), 0);
    let finding = |layer, bounds| Finding {
        kind: "border".to_owned(),
        layer,
        last_layer: layer,
        bounds: Some(bounds),
        at: None,
        z_mm: None,
        text: "layer 0: white there".to_owned(),
        about: "white there".to_owned(),
        pixels: FoundPixels::All,
    };
    viewer.set_findings(vec![finding(0, [0, 0, 8, 3]), finding(1, [0, 0, 3, 1])]);
    assert_eq!(drawn(&viewer, 0, 1, Overlay::Findings), Image::Mask(mask([&[1, 3], &[], &[]])));
    assert_eq!(drawn(&viewer, 1, 1, Overlay::Findings).change_count(), 0, "the first stack's");
    let state = viewer.findings();
    assert_eq!((&state["status"], &state["list"][1]["id"]), (&json!("ready"), &json!(1)));
    let pixel = |layer| viewer.pixel(0, layer, [1, 0], None, &GivenUp::default()).unwrap();
    assert_eq!(
        [pixel(0), pixel(1)].map(|pixel| pixel["findings"][0].clone()),
        [json!(0), json!(1)]
    );
}

#[test]
fn work_that_fails_or_panics_says_so() {
    let viewer = Arc::new(viewer());
    let wait = || loop {
        let state = viewer.findings();
        if state["status"] != "running" {
            return (state["status"].clone(), state["message"].clone());
        }
        std::thread::yield_now();
    };
    viewer.find(|_, _| Err("layer 3: a reason".to_owned()));
    assert_eq!(wait(), (json!("failed"), json!("layer 3: a reason")));
    viewer.find(|_, _| panic!("on purpose"));
    let (status, message) = wait();
    assert!(status == "failed" && message.as_str().unwrap().contains("report"), "{message}");
}

#[test]
fn pixels_are_told() {
    let mut gray = GrayMask::new(8);
    gray.push_row(&[LevelChange { column: 2, level: 100 }, LevelChange { column: 4, level: 0 }])
        .unwrap();
    gray.push_row(&[]).unwrap();
    gray.push_row(&[]).unwrap();
    let page = (PageInfo::default(), Image::Gray(gray));
    let viewer = Viewer::new(vec![stack("gray.tif", vec![page])], MEMORY, 2, "lamp");
    let threshold = std::num::NonZeroU8::new(101);
    let pixel = |x, y, threshold| viewer.pixel(0, 0, [x, y], threshold, &GivenUp::default());
    let told = pixel(3, 0, None).unwrap();
    assert_eq!((&told["level"], &told["white"]), (&json!(100), &json!(true)));
    assert_eq!(told["component"], json!({"area_px": 2, "box": [2, 0, 4, 1]}));
    assert_eq!([&told["x_mm"], &told["y_mm"]].map(|mm| mm.as_f64().unwrap()), [1.35, 4.95]);
    assert_eq!(told["copy"], Value::Null);
    assert_eq!(pixel(3, 0, threshold).unwrap()["white"], json!(false));
    assert_eq!(pixel(8, 0, None), Err(ViewError::NoSuch("pixel")));
    let cured = |level| {
        let kind = ImageKind::Cured(std::num::NonZeroU8::new(level).unwrap());
        let image = viewer.image(0, 0, kind, &GivenUp::default()).unwrap();
        image.change_count()
    };
    assert_eq!([cured(100), cured(101)], [2, 0]);
}

#[test]
fn edges_are_found_near_a_point() {
    let viewer = viewer();
    let edge = |at, radius| viewer.edge(0, 0, at, radius, &GivenUp::default());
    assert_eq!(edge([1.3, 0.5], 2.0), Ok(json!({"x": 1.0, "y": 0.5})));
    assert_eq!(edge([6.0, 0.5], 1.0), Ok(json!({"x": null, "y": null})));
    assert_eq!(edge([6.0, 0.5], f64::INFINITY).unwrap()["x"], json!(7.0));
    for (at, radius) in [([f64::NAN, 0.0], 1.0), ([0.0, 0.0], f64::NAN), ([0.0, 0.0], -1.0)] {
        assert!(matches!(edge(at, radius), Err(ViewError::Malformed(_))));
    }
}

#[test]
fn what_there_is_not_and_what_nobody_waits_for_is_refused() {
    let viewer = viewer();
    let tile = |stack, layer, x, given_up: &GivenUp| {
        let at = TileAt { reduction: 0, x, y: 0 };
        viewer.tile(stack, layer, ImageKind::Layer, at, given_up).map(drop)
    };
    let waiting = GivenUp::default();
    assert_eq!(tile(0, 1, 0, &waiting), Ok(()));
    assert_eq!(tile(2, 0, 0, &waiting), Err(ViewError::NoSuch("stack")));
    assert_eq!(tile(0, 2, 0, &waiting), Err(ViewError::NoSuch("layer")));
    assert_eq!(tile(0, 0, 1, &waiting), Err(ViewError::NoSuch("tile")));
    waiting.set();
    assert_eq!(tile(0, 0, 0, &waiting), Err(ViewError::GivenUp));
}
