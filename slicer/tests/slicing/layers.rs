//! What the layers say of themselves: index, place, thickness, part.

use lamp_slicing::{GridRule, PlaneRule, SliceError, SliceOptions, Slices};
use lamp_stack::Length;
use proptest::prelude::*;

use super::common::{
    block, cases, cube, mask, masks, model, options, slice, try_layers, white_pixels,
};

const PLANES: [PlaneRule; 3] = [PlaneRule::Top, PlaneRule::Middle, PlaneRule::Bottom];

#[test]
fn layers_say_where_they_are() {
    // 32-bit 0.1 is 100.0000015 um: heights are told to the nanometre.
    let mesh = block([-1.0, -2.0, 0.1], [1.0, 3.0, 1.1]);
    let options = options(254.0, 250.0);
    let layers = slice(&mesh, &options);
    let heights: Vec<_> = layers.iter().map(|layer| layer.info.z_um.unwrap()).collect();
    assert_eq!(heights, [100.0, 350.0, 600.0, 850.0]);
    for (layer, index) in layers.iter().zip(0..) {
        assert_eq!(layer.info.index, index);
        assert_eq!(layer.info.thickness_um, Some(250.0));
        assert_eq!(layer.info.origin_mm, Some([-1.1, 3.1]));
        assert_eq!(layer.pitch, Some(options.pitch));
        assert_eq!(layer.info.exposure_ms, None);
        assert!(layer.info.other.is_empty());
    }
}

#[test]
fn a_part_below_zero_keeps_its_heights() {
    let layers = slice(&block([0.0, 0.0, -0.3], [1.0; 3]), &options(254.0, 400.0));
    let heights: Vec<_> = layers.iter().map(|layer| layer.info.z_um.unwrap()).collect();
    assert_eq!(heights, [-300.0, 100.0, 500.0]);
}

#[test]
fn only_the_first_page_tells_of_the_stack() {
    let mesh = cube(0.0, 2.0);
    for (range, count, first) in [(None, 20, 0), (Some(4..11), 7, 4)] {
        let layers = slice(&mesh, &SliceOptions { layers: range, ..options(254.0, 100.0) });
        let (stacks, indices): (Vec<_>, Vec<_>) =
            layers.iter().map(|layer| (layer.info.stack.clone(), layer.info.index)).unzip();
        assert!(indices.into_iter().eq(first..first + count));
        let stack = stacks[0].as_ref().unwrap();
        assert_eq!((stack.part.as_str(), stack.layers), ("part", Some(count)));
        assert_eq!(stack.digest, model(&mesh).digest());
        let hex = stack.digest.strip_prefix("blake3:").unwrap();
        assert!(hex.len() == 64 && hex.chars().all(|c| c.is_ascii_hexdigit()));
        assert!(stacks[1..].iter().all(Option::is_none));
    }
}

#[test]
fn another_part_has_another_digest() {
    assert_ne!(model(&cube(0.0, 2.0)).digest(), model(&cube(0.0, 2.5)).digest());
}

#[test]
fn layer_count_is_known_beforehand() {
    for layers in [None, Some(2..5), Some(8..1000)] {
        let options = SliceOptions { layers, ..options(254.0, 100.0) };
        let slices = Slices::new(model(&cube(0.0, 1.0)), &options).unwrap();
        assert_eq!(slices.layer_count(), slices.count());
    }
}

proptest! {
    #![proptest_config(cases(200))]

    /// However the height rounds to layers, no layer misses the part.
    #[test]
    fn every_layer_of_a_box_is_its_whole_section(
        low in -5.0f32..5.0,
        height in 0.001f32..2.0,
        thickness_um in 20.0..300.0,
    ) {
        let mesh = block([0.0, 0.0, low], [1.0, 1.0, low + height]);
        for plane in PLANES {
            let layers = slice(&mesh, &SliceOptions { plane, ..options(254.0, thickness_um) });
            let height_um = 1000.0 * (f64::from(low + height) - f64::from(low));
            let count = (height_um / thickness_um).round().max(1.0);
            prop_assert_eq!(layers.len() as f64, count);
            for layer in &layers {
                prop_assert_eq!(mask(layer).white_pixels(), 100);
            }
        }
    }

    #[test]
    fn the_frame_has_black_margins_and_whole_words(
        low in prop::array::uniform3(-9.0f32..9.0),
        size in prop::array::uniform3(0.5f32..8.0),
        margin in 0u32..5,
        dpi in 80.0..500.0,
    ) {
        let mesh = block(low, [0, 1, 2].map(|axis| low[axis] + size[axis]));
        let grid = GridRule::Around { margin };
        let layers = slice(&mesh, &SliceOptions { grid, ..options(dpi, 1000.0) });
        let (low, high) = mesh.bounds_mm();
        let image = mask(&layers[0]);
        prop_assert_eq!(image.width() % 32, 0);
        let [x0, y1] = layers[0].info.origin_mm.unwrap();
        let margin_mm = f64::from(margin) * 25.4 / dpi;
        let out_nm = [low[0] - margin_mm - x0, y1 - high[1] - margin_mm].map(|mm| mm * 1e6);
        prop_assert!(out_nm.iter().all(|nm| (-1e-6..1.0 + 1e-6).contains(nm)), "{out_nm:?}");
        prop_assert!([x0, y1].iter().all(|mm| (mm * 1e6).round() / 1e6 == *mm));
        let across = |axis: usize| (high[axis] - low[axis]) * dpi / 25.4 + 2.0 * f64::from(margin);
        // The origin goes out to a nanometre; words take up to 31 columns.
        prop_assert!((across(0)..across(0) + 33.1).contains(&f64::from(image.width())));
        prop_assert!((across(1)..across(1) + 1.1).contains(&f64::from(image.height())));
        for (row, transitions) in (0..).zip(image.rows()) {
            let outside = row < margin || row >= image.height() - margin;
            prop_assert!(!outside || transitions.is_empty());
            prop_assert!(transitions.first().is_none_or(|&column| column >= margin));
            let last = transitions.get(1).copied().unwrap_or(image.width());
            prop_assert!(transitions.is_empty() || last <= image.width() - margin);
        }
    }
}

#[test]
fn a_given_frame_is_kept() {
    let grid = GridRule::At { origin_mm: [-3.25, 7.125], pixels: [60, 80] };
    let options = SliceOptions { grid, ..options(254.0, 500.0) };
    for layer in slice(&cube(0.0, 2.0), &options) {
        assert_eq!(layer.info.origin_mm, Some([-3.25, 7.125]));
        assert_eq!((layer.image.width(), layer.image.height()), (60, 80));
    }
}

#[test]
fn a_part_that_sticks_out_of_its_frame_is_refused() {
    // Whole pixels of an eighth: the first frame just holds the part and a
    // black column.
    let part = block([1.0, -2.0, 0.0], [3.0, 1.0, 1.0]);
    let framed = |origin_mm, pixels| {
        let grid = GridRule::At { origin_mm, pixels };
        try_layers(model(&part), &SliceOptions { grid, ..options(203.2, 500.0) })
    };
    let layers = framed([1.0, 1.0], [17, 24]).unwrap();
    assert_eq!(white_pixels(&layers), 2 * 16 * 24);
    for (origin_mm, pixels) in [
        ([1.0, 1.0], [16, 24]),
        ([1.0, 1.0], [17, 23]),
        ([1.0 + 1.0 / 64.0, 1.0], [32, 24]),
        ([1.0, 1.0 - 1.0 / 64.0], [16, 48]),
        ([100.0, 100.0], [32, 32]),
    ] {
        let error = framed(origin_mm, pixels).unwrap_err();
        assert!(matches!(error, SliceError::OutsideFrame { .. }), "{error}");
        let says = "x 1.000 to 3.000 and y -2.000 to 1.000 mm";
        assert!(error.to_string().contains(says), "{error}");
    }
}

#[test]
fn moving_the_frame_moves_the_image() {
    let mesh = lamp_fixtures::torus(2.0, 0.7, 500);
    let framed = |origin_mm, pixels| {
        let grid = GridRule::At { origin_mm, pixels };
        slice(&mesh, &SliceOptions { grid, ..options(254.0, 100.0) })
    };
    let (small, large) = (framed([-3.0, 3.0], [60, 60]), framed([-3.7, 3.4], [90, 77]));
    assert_eq!(white_pixels(&small), white_pixels(&large));
    for (small, large) in masks(&small).iter().zip(masks(&large)) {
        for row in 0..60 {
            let moved: Vec<u32> = small.row(row).iter().map(|column| column + 7).collect();
            assert_eq!(large.row(row + 4), moved);
        }
    }
}

fn refusal(options: &SliceOptions) -> SliceError {
    try_layers(model(&cube(0.0, 1.0)), options).unwrap_err()
}

#[test]
fn layers_that_do_not_exist_are_refused() {
    for (start, end, asked) in [
        (10, 11, "layer 10 was"),
        (10, 13, "layers 10 to 12 were"),
        (10, u32::MAX, "layers 10 and above were"),
        (4, 4, "layers 4..4 were"),
        (7, 3, "layers 7..3 were"),
    ] {
        let error = refusal(&SliceOptions { layers: Some(start..end), ..options(254.0, 100.0) });
        assert!(matches!(error, SliceError::NoSuchLayers { count: 10, .. }), "{error}");
        let says = format!("{asked} asked for, but the part has layers 0 to 9");
        assert_eq!(error.to_string(), says);
    }
}

#[test]
fn images_too_large_are_refused() {
    let long = block([0.0; 3], [5_000.0, 1.0, 1.0]);
    let error = try_layers(model(&long), &options(100_000.0, 1000.0)).unwrap_err();
    assert!(matches!(error, SliceError::TooLarge { .. }), "{error}");
    assert!(error.to_string().contains("pixels"), "{error}");
    for pixels in [[0, 5], [5, 0], [(1 << 24) + 1, 5], [5, u32::MAX]] {
        let grid = GridRule::At { origin_mm: [0.0; 2], pixels };
        let error = refusal(&SliceOptions { grid, ..options(254.0, 100.0) });
        assert!(matches!(error, SliceError::TooLarge { .. }), "{error}");
    }
}

#[test]
fn too_many_layers_are_refused() {
    for thickness_um in [2e-4, 0.0, -100.0, f64::NAN] {
        let thickness = Length::from_um(thickness_um);
        let error = refusal(&SliceOptions { thickness, ..options(254.0, 100.0) });
        assert!(matches!(error, SliceError::TooManyLayers { .. }), "{error}");
        assert!(error.to_string().contains("1mm high"), "{error}");
    }
}
