//! Compares layers of B-rep parts with closed forms, pixel by pixel.

use crate::referee::{askew, back, model, options, wrong_levels, wrong_pixels};
use lamp_fixtures::StepSample;
use lamp_slicing::{Axis, LayerHeights, Placement, SliceOptions};

fn off_sphere([x, y, z]: [f64; 3]) -> f64 {
    x.hypot(y).hypot(z - 15.0) - 15.0
}

#[test]
fn a_sphere_has_no_wrong_pixel() {
    for dpi in [1500.0, 2400.0] {
        let options = options(dpi, 3.0, Placement::default());
        for chord_mm in [0.25 * 25.4 / dpi, 0.05] {
            let (wrong, white) =
                wrong_pixels(model(StepSample::Sphere, chord_mm), &options, off_sphere);
            assert!(wrong == 0 && white > 100_000, "{dpi} dpi, {chord_mm} mm: {wrong} of {white}");
        }
    }
}

#[test]
fn a_torus_has_no_wrong_pixel() {
    let outside = |[x, y, z]: [f64; 3]| (x.hypot(y) - 20.0).hypot(z - 8.0) - 8.0;
    for dpi in [1500.0, 2400.0] {
        let chord_mm = 0.25 * 25.4 / dpi;
        let flat = options(dpi, 2.3, Placement::default());
        let (wrong, white) = wrong_pixels(model(StepSample::Torus, chord_mm), &flat, outside);
        assert!(wrong == 0 && white > 100_000, "{dpi} dpi: {wrong} of {white}");
        let tilted = options(dpi, 9.1, askew());
        let (wrong, white) =
            wrong_pixels(model(StepSample::Torus, chord_mm), &tilted, |point| outside(back(point)));
        assert!(wrong == 0 && white > 100_000, "askew, {dpi} dpi: {wrong} of {white}");
    }
}

#[test]
fn rectangular_pixels_have_no_wrong_pixel() {
    for text in ["14x19um", "31x14um"] {
        let pitch = text.parse().unwrap();
        let flat = SliceOptions { pitch, ..options(1500.0, 3.0, Placement::default()) };
        let (wrong, white) = wrong_pixels(model(StepSample::Sphere, 0.0035), &flat, off_sphere);
        assert!(wrong == 0 && white > 100_000, "{text}: {wrong} of {white}");
        let outside = |[x, y, z]: [f64; 3]| (x.hypot(y) - 20.0).hypot(z - 8.0) - 8.0;
        let tilted = SliceOptions { pitch, ..options(1500.0, 9.1, askew()) };
        let (wrong, white) =
            wrong_pixels(model(StepSample::Torus, 0.0035), &tilted, |point| outside(back(point)));
        assert!(wrong == 0 && white > 100_000, "askew, {text}: {wrong} of {white}");
    }
}

/// Facets near a sphere's poles are thin as needles.
#[test]
fn poles_have_no_wrong_pixel() {
    let about_x = |degrees: f64| Placement::default().rotated(Axis::X, degrees);
    for (degrees, layers) in [(0.0, 0..8), (0.0, 292..300), (90.0, 142..158), (33.0, 0..8)] {
        let back = about_x(-degrees);
        let layers = Some(layers);
        let options = SliceOptions { layers, ..options(1500.0, 0.1, about_x(degrees)) };
        let model = model(StepSample::Sphere, 0.25 * 25.4 / 1500.0);
        let (wrong, white) = wrong_pixels(model, &options, |point| off_sphere(back.at(point)));
        assert!(wrong == 0 && white > 10_000, "{degrees} degrees: {wrong} of {white}");
    }
}

/// The sections of a nearly level torus are crescents with four extrema.
#[test]
fn crescents_have_no_wrong_pixel() {
    let [there, back] = [3.0, -3.0].map(|by| Placement::default().rotated(Axis::X, by));
    let outside = |[x, y, z]: [f64; 3]| (x.hypot(y) - 20.0).hypot(z - 8.0) - 8.0;
    let options = SliceOptions { layers: Some(37..39), ..options(800.0, 0.41, there) };
    let model = model(StepSample::Torus, 0.25 * 25.4 / 800.0);
    let (wrong, white) = wrong_pixels(model, &options, |point| outside(back.at(point)));
    assert!(wrong == 0 && white > 10_000, "{wrong} of {white}");
}

/// The sections of a torus that lies askew have saddles, where contours meet in a cross.
/// Facets split them the wrong way at heights within the chord.
#[test]
fn contours_that_meet_have_no_wrong_pixel() {
    let tilt = Placement::default().rotated(Axis::X, 20.0);
    let back = |point: [f64; 3]| Placement::default().rotated(Axis::X, -20.0).at(point);
    let outside = |[x, y, z]: [f64; 3]| (x.hypot(y) - 20.0).hypot(z - 8.0) - 8.0;
    let (sin, cos) = 20f64.to_radians().sin_cos();
    for saddle_mm in [20.0 * sin + 8.0 * cos - 8.0, -20.0 * sin + 8.0 * cos + 8.0] {
        let near_um = [-80.0, -9.0, -4.0, -2.0, -1.0, -0.3, -0.02, 0.02, 0.3, 1.0, 2.0, 4.0, 9.0];
        let tops = near_um.map(|um| ((1000.0 * saddle_mm + um) * 1000.0).round() / 1000.0);
        let heights = Some(LayerHeights::new(tops.to_vec()).unwrap());
        for (dpi, chord_mm) in [(1500.0, 0.0042), (600.0, 0.01)] {
            let options = SliceOptions { heights: heights.clone(), ..options(dpi, 1.0, tilt) };
            let model = model(StepSample::Torus, chord_mm);
            let (wrong, white) = wrong_pixels(model, &options, |point| outside(back(point)));
            assert!(wrong == 0 && white > 100_000, "{dpi} dpi: {wrong} of {white}");
        }
    }
}

/// Fewer facets give more wrong pixels; the surfaces stay exact.
#[test]
fn facets_alone_have_wrong_pixels() {
    let options = SliceOptions { polish: false, ..options(1500.0, 3.0, Placement::default()) };
    let wrong = [0.1, 0.01, 0.001]
        .map(|chord_mm| wrong_pixels(model(StepSample::Sphere, chord_mm), &options, off_sphere).0);
    println!("{wrong:?}");
    assert!(wrong[0] > 5 * wrong[1] && wrong[1] > 5 * wrong[2] && wrong[2] > 0, "{wrong:?}");
}

/// A gray pixel's level is the depth of the sphere below it, within one level. At the equator,
/// lines between the facets' outline and the sphere's meet no facet.
#[test]
fn gray_levels_are_those_of_the_exact_depth() {
    let options = options(600.0, 0.1, Placement::default().translated([0.01, 0.02, 0.0]));
    let outside = |[x, y, z]: [f64; 3]| off_sphere([x - 0.01, y - 0.02, z]);
    // Facets are off by up to 60 levels.
    for (chord_mm, polish) in [(0.01, true), (0.05, true), (0.05, false)] {
        for layers in [10..40, 142..158] {
            let options = SliceOptions { polish, layers: Some(layers), ..options.clone() };
            let (wrong, gray) = wrong_levels(StepSample::Sphere, chord_mm, &options, outside);
            assert!(gray > 3000 && (wrong == 0) == polish, "{chord_mm} mm: {wrong} of {gray}");
        }
    }
}
