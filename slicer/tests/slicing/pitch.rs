//! Pixels that are not square: against the same part stretched along x, run for run, and against
//! closed forms.
//!
//! Stretched parts have corners on whole 1024ths of a pixel along x and y, and pixels of whole
//! millimeters, so doubles hold their coordinates in millimeters and in pixels. A part and its
//! stretched twin then have equal coordinates in pixels, and meet every tie alike.

use std::f64::consts::PI;

use lamp_fixtures::{Mesh, cube_with_hole, sphere, torus, tower};
use lamp_slicing::{Fill, GridRule, PixelGrid, PlaneRule, Shading, SliceOptions, Slices};
use lamp_stack::{DepthLevels, Layer, Length, Pitch};
use proptest::prelude::*;

use super::common::{block, cases, cube, joined, mask, model, options, slice, turned};

fn pitch(text: &str) -> Pitch {
    text.parse().unwrap()
}

/// Slices a part whose x and y are in pixels, in a frame of 96 pixels on all sides of zero.
fn sliced(mesh: &Mesh, text: &str, more: &SliceOptions) -> Vec<Layer> {
    let [x_mm, y_mm] = pitch(text).mm();
    let step = |pixels: f64, mm: f64| (pixels * 1024.0).round() / 1024.0 * mm;
    let mesh = mesh.map(|[x, y, z]| [step(x, x_mm), step(y, y_mm), z]);
    let grid = GridRule::At { origin_mm: [-96.0 * x_mm, 96.0 * y_mm], pixels: [192, 192] };
    slice(&mesh, &SliceOptions { pitch: pitch(text), grid, ..more.clone() })
}

/// Parts of up to 180 pixels, among them bodies that overlap and faces on pixels' centers.
fn part() -> impl Strategy<Value = Mesh> {
    let overlapping = joined(&[cube(0.0, 2.0), cube(1.0, 3.0), block([0.5; 3], [1.5, 4.0, 0.9])]);
    let known = prop::sample::select(vec![
        cube_with_hole(3.0, 1.0, 100),
        torus(1.5, 0.6, 100),
        sphere(2.0, 300),
        tower(150).map(|p| p.map(|v| v * 0.05)),
        overlapping,
    ]);
    let corner = || prop::array::uniform3(-2.0f32..2.0);
    let tetrahedron = (corner(), corner(), corner(), corner())
        .prop_map(|(a, b, c, d)| Mesh { facets: vec![[a, b, c], [a, c, d], [a, d, b], [b, d, c]] });
    prop_oneof![2 => known, 1 => tetrahedron]
}

fn any_options() -> impl Strategy<Value = SliceOptions> {
    let plane = prop::sample::select(vec![PlaneRule::Top, PlaneRule::Middle, PlaneRule::Bottom]);
    let fill = prop::sample::select(vec![Fill::EvenOdd, Fill::Solid]);
    (150.0..900.0, plane, fill, any::<bool>()).prop_map(|(thickness_um, plane, fill, is_gray)| {
        let reach = Length::from_um(2.0 * thickness_um);
        let levels = DepthLevels::new(reach, |gray| Length::from_um(reach.um() * gray));
        let shading = if is_gray { Shading::ByDepth(levels.into()) } else { Shading::White };
        let plane = if is_gray { PlaneRule::Top } else { plane };
        SliceOptions { plane, fill, shading, ..options(1500.0, thickness_um) }
    })
}

proptest! {
    #![proptest_config(cases(96))]

    #[test]
    fn a_stretched_part_has_the_same_pixels(
        mesh in part(),
        angles in prop::array::uniform3(0.0..6.3),
        is_turned in any::<bool>(),
        pixels_per_mm in 4.0..20.0,
        options in any_options(),
    ) {
        let mesh = if is_turned { turned(&mesh, angles) } else { mesh };
        let [x, y, z] = [pixels_per_mm, pixels_per_mm, 1.0];
        let mesh = mesh.map(|p| [p[0] * x, p[1] * y, p[2] * z]);
        let narrow = sliced(&mesh, "14x19mm", &options);
        let stretched = sliced(&mesh, "19mm", &options);
        prop_assert_eq!(narrow.len(), stretched.len());
        for (narrow, stretched) in narrow.iter().zip(&stretched) {
            prop_assert_eq!(narrow.pitch, Some(pitch("14x19mm")));
            prop_assert!(*narrow.image == *stretched.image, "layer {}", narrow.info.index);
            prop_assert_eq!(&narrow.info.stray_rows, &stretched.info.stray_rows);
        }
    }
}

#[test]
fn the_frame_is_the_box_and_its_margin_along_both_axes() {
    let grid = PixelGrid::around([-0.7, 0.0], [0.7, 1.9], 2, pitch("14x19um")).unwrap();
    // 1.4 mm are 100 columns and 1.9 mm 100 rows; the width is rounded up.
    assert_eq!((grid.origin_mm, grid.width, grid.height), ([-0.728, 1.938], 128, 104));
    assert_eq!(grid.to_pixels(-0.728, 1.938), [-0.5, -0.5]);
    // 0.875 mm is 62 pixels and a half of 14 um, which a double holds.
    let grid = PixelGrid::at([0.0, 0.0], 64.0, 64.0, pitch("14x19um")).unwrap();
    assert_eq!(grid.to_pixels(0.875, -2.375), [62.0, 124.5]);
    let [x_mm, y_mm] = grid.to_mm(62.0, 124.5);
    assert!((x_mm - 0.875).abs() < 1e-15 && (y_mm + 2.375).abs() < 1e-15);
}

/// The number of lattice points in an ellipse errs by a few times the root of its radius (see
/// `closed_forms`); half the boundary's pixels are far more.
#[test]
fn the_volume_of_a_sphere_is_that_in_millimeters() {
    let (radius_mm, mesh) = (1.0, sphere(1.0, 200_000));
    for text in ["14x19um", "31x14um", "1814x1337"] {
        let options = SliceOptions { pitch: pitch(text), ..options(1500.0, 50.0) };
        let slices =
            Slices::new(model(&mesh), &SliceOptions { plane: PlaneRule::Middle, ..options });
        let pixel_mm2 = pitch(text).pixel_mm2();
        for layer in slices.unwrap().map(Result::unwrap) {
            let up_mm = (layer.info.z_um.unwrap() + 25.0) / 1000.0 - radius_mm;
            let mesh_mm2 = PI * (radius_mm * radius_mm - up_mm * up_mm);
            let found_mm2 = mask(&layer).white_pixels() as f64 * pixel_mm2;
            let error_px = (found_mm2 - mesh_mm2).abs() / pixel_mm2;
            assert!(error_px < 60.0, "{text}, layer {}: {error_px} pixels", layer.info.index);
        }
    }
}
