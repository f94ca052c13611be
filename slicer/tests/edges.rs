//! Compares layers of parts with edges with closed forms, pixel by pixel: rims of
//! cylinders, cones, balls and tori, upright, lying and askew.

use crate::referee::{askew, back, model, model_by, options, wrong_levels, wrong_pixels};
use lamp_fixtures::StepSample;
use lamp_slicing::{Axis, KernelName, Placement};

type Outside = fn([f64; 3]) -> f64;

/// A cylinder of radius 10 mm with a hole of radius 4 mm across it.
fn off_drilled([x, y, z]: [f64; 3]) -> f64 {
    (x.hypot(y) - 10.0).max(-z).max(z - 25.0).max(4.0 - x.hypot(z - 12.0))
}

/// A cone between radii of 15 and 7.5 mm.
fn off_frustum([x, y, z]: [f64; 3]) -> f64 {
    let slant = 0.25f64.atan().cos();
    ((x.hypot(y) - 15.0 + 0.25 * z) * slant).max(-z).max(z - 30.0)
}

/// A ball of radius 10 mm between two planes.
fn off_barrel([x, y, z]: [f64; 3]) -> f64 {
    (x.hypot(y).hypot(z) - 10.0).max(-6.0 - z).max(z - 8.0)
}

/// A quarter of a torus.
fn off_bend([x, y, z]: [f64; 3]) -> f64 {
    ((x.hypot(y) - 12.0).hypot(z) - 4.0).max(-x).max(-y)
}

const PARTS: [(StepSample, Outside); 4] = [
    (StepSample::Drilled, off_drilled),
    (StepSample::Frustum, off_frustum),
    (StepSample::Barrel, off_barrel),
    (StepSample::Bend, off_bend),
];

#[cfg(feature = "occt")]
const KERNELS: &[KernelName] = &[KernelName::Lamp, KernelName::Occt];
#[cfg(not(feature = "occt"))]
const KERNELS: &[KernelName] = &[KernelName::Lamp];

/// Counts the wrong pixels of all parts in a place, read by each kernel.
fn check(dpi: f64, thickness_mm: f64, placement: Placement, back: impl Fn([f64; 3]) -> [f64; 3]) {
    let mut all = Vec::new();
    let options = options(dpi, thickness_mm, placement);
    for &kernel in KERNELS {
        for (part, outside) in PARTS {
            for chord_mm in [0.25 * 25.4 / dpi, 0.02] {
                let model = model_by(kernel, part, chord_mm);
                let (wrong, white) = wrong_pixels(model, &options, |point| outside(back(point)));
                assert!(white > 10_000, "{part:?}: {white}");
                all.push((kernel, part, chord_mm, wrong));
            }
        }
    }
    assert!(all.iter().all(|(.., wrong)| *wrong == 0), "{dpi} dpi: {all:?}");
}

#[test]
fn upright_parts_have_no_wrong_pixel() {
    check(600.0, 1.37, Placement::default(), |point| point);
}

#[test]
fn lying_parts_have_no_wrong_pixel() {
    for axis in [Axis::X, Axis::Y] {
        let there = Placement::default().rotated(axis, 90.0);
        check(600.0, 1.37, there, |point| Placement::default().rotated(axis, -90.0).at(point));
    }
}

#[test]
fn parts_askew_have_no_wrong_pixel() {
    check(600.0, 1.37, askew(), back);
}

/// Near the height of a rim, contours run along it, between its chords and its curve.
#[test]
fn rims_that_lean_by_a_degree_have_no_wrong_pixel() {
    let lean = |degrees: f64| Placement::default().rotated(Axis::X, degrees);
    check(600.0, 0.93, lean(1.0), |point| lean(-1.0).at(point));
}

#[test]
fn a_hole_across_a_cylinder_has_no_wrong_pixel_at_2400_dpi() {
    let part = || model(StepSample::Drilled, 0.25 * 25.4 / 2400.0);
    let upright = options(2400.0, 3.1, Placement::default());
    let (wrong, white) = wrong_pixels(part(), &upright, off_drilled);
    assert!(wrong == 0 && white > 1_000_000, "{wrong} of {white}");
    let tilted = options(2400.0, 5.3, askew());
    let (wrong, white) = wrong_pixels(part(), &tilted, |point| off_drilled(back(point)));
    assert!(wrong == 0 && white > 1_000_000, "askew: {wrong} of {white}");
}

#[test]
fn parts_are_gray_out_to_their_rims() {
    for (part, outside) in PARTS {
        let (options, chord_mm) = (options(600.0, 4.3, askew()), 0.25 * 25.4 / 600.0);
        let (wrong, gray) = wrong_levels(part, chord_mm, &options, |point| outside(back(point)));
        assert!(wrong == 0 && gray > 1000, "{part:?}: {wrong} of {gray}");
    }
}
