//! Moves by an ellipse against closed forms, and against a slow twin that tries every pixel.

use proptest::prelude::*;

use super::edge_place_tests::{area, disc, square};
use super::offset_tests::{drawn, masks, nearest, share};
use super::*;

/// The half axes of the moves of 25 um and more at 1500 dpi, and extreme ones.
const AXES: [[f64; 2]; 6] =
    [[1.476, 2.362], [2.362, 1.476], [6.0, 2.0], [0.5, 9.0], [14.8, 3.0], [4.0, 0.0]];

/// The most by which edges are off on average, in pixels. An ellipse 256 times as long as wide
/// stretches the unevenness of stairs.
fn tolerance([x, y]: [f64; 2]) -> f64 {
    if x.min(y) == 0.0 { 0.08 } else { 0.03 }
}

/// How far an edge moves whose normal is at an angle.
fn support([x, y]: [f64; 2], degrees: f64) -> f64 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    (x * cos).hypot(y * sin)
}

/// The length around an ellipse: by Cauchy, the mean of its width over all angles, times pi.
fn perimeter(axes: [f64; 2]) -> f64 {
    let width = |step: u32| 2.0 * support(axes, f64::from(step) / 10.0);
    (0..3600).map(width).sum::<f64>() / 3600.0 * std::f64::consts::PI
}

#[test]
fn squares_at_every_angle_move_by_the_ellipse() {
    for axes in AXES {
        for degrees in [0.0, 1.0, 7.0, 22.5, 30.0, 45.0, 71.0, 90.0] {
            let mask = square(160.0, degrees);
            let before = mask.white_pixels() as f64;
            let side = before.sqrt();
            let [a, b] = [degrees, degrees + 90.0].map(|angle| support(axes, angle));
            let left = area(&offset_by_ellipse(&mask, axes));
            let off = (left - (side - 2.0 * a) * (side - 2.0 * b)) / (4.0 * side);
            assert!(off.abs() < tolerance(axes), "{axes:?} at {degrees}: {off} pixels");
            // Steiner's formula for convex shapes: sides move, and corners add the ellipse.
            let grown = area(&offset_by_ellipse(&mask, axes.map(|axis| -axis)));
            let corners = std::f64::consts::PI * axes[0] * axes[1];
            let off = (grown - before - 2.0 * side * (a + b) - corners) / (4.0 * side);
            assert!(off.abs() < tolerance(axes), "{axes:?} at {degrees}: {off} pixels");
        }
    }
}

#[test]
fn discs_grow_by_the_mixed_area() {
    for axes in AXES {
        for radius in [40.3, 75.0, 147.6] {
            let mask = disc(radius);
            let before = mask.white_pixels() as f64;
            let grown = area(&offset_by_ellipse(&mask, axes.map(|axis| -axis)));
            let pi = std::f64::consts::PI;
            let own = (before / pi).sqrt();
            let form = before + pi * axes[0] * axes[1] + own * perimeter(axes);
            let off = (grown - form) / (2.0 * pi * own);
            assert!(off.abs() < tolerance(axes), "{axes:?} {radius}: {off} pixels");
        }
    }
}

#[test]
fn a_pixel_of_a_disc_stays_if_its_ellipse_fits() {
    const SURE: f64 = 0.35;
    let (radius, size) = (30.2_f64, 140);
    let middle = f64::from(size) / 2.0 + 0.13;
    let mask = drawn(size, size, |column, row| {
        (f64::from(column) + 0.5 - middle).hypot(f64::from(row) + 0.5 - middle) < radius
    });
    // A distance, for comparison, and ellipses.
    for axes in [[2.362; 2]].into_iter().chain(AXES) {
        // The farthest and the nearest that the disc's middle is from an ellipse around a pixel.
        let away = |column: u32, row: u32| {
            let [x, y] = [column, row].map(|at| f64::from(at) + 0.5 - middle);
            let place = |step: u32| {
                let (sin, cos) = (f64::from(step) * std::f64::consts::TAU / 720.0).sin_cos();
                (x + axes[0] * cos).hypot(y + axes[1] * sin)
            };
            let least = (0..720).map(place).fold(f64::INFINITY, f64::min);
            let most = (0..720).map(place).fold(0.0, f64::max);
            let holds_it = (x / axes[0]).hypot(y / axes[1].max(1e-9)) < 1.0;
            [if holds_it { 0.0 } else { least }, most]
        };
        let [left, grown] = [1.0, -1.0]
            .map(|sign| offset_by_ellipse(&mask, axes.map(|axis| sign * axis)).at_least(128));
        for row in 0..size {
            for column in 0..size {
                let [least, most] = away(column, row);
                // From its stair, a place of the disc's edge is known to a third of a pixel.
                if (most - radius).abs() > SURE {
                    assert_eq!(
                        left.is_white(column, row),
                        most < radius,
                        "{axes:?} {column} {row}"
                    );
                }
                if (least - radius).abs() > SURE {
                    assert_eq!(
                        grown.is_white(column, row),
                        least < radius,
                        "{axes:?} {column} {row}"
                    );
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn every_pixel_is_at_its_elliptic_distance(
        mask in masks(),
        // The test takes the edge in a pixel to be straight. Stretched along a shorter axis, pixels
        // would be wider than arcs around corners.
        axes in [0.5..9.0f64, 0.5..9.0f64],
        grows: bool,
    ) {
        let sign = if grows { -1.0 } else { 1.0 };
        let gray = offset_by_ellipse(&mask, axes.map(|axis| sign * axis));
        let far = axes[0].max(axes[1]);
        let pixel = axes.map(|axis| far / axis);
        let outlines: Vec<outline::Outline> = outline::outlines(&RowRuns::white(&mask))
            .iter()
            .map(|it| it.iter().map(|at| [at[0] * pixel[0], at[1] * pixel[1]]).collect())
            .collect();
        for row in 0..mask.height() {
            for column in 0..mask.width() {
                let level = f64::from(gray.level(column, row));
                let is_white = mask.is_white(column, row);
                if is_white == grows {
                    prop_assert_eq!(level, if is_white { 255.0 } else { 0.0 });
                    continue;
                }
                let at = [(f64::from(column) + 0.5) * pixel[0], (f64::from(row) + 0.5) * pixel[1]];
                let (distance, slant) = nearest(&outlines, at);
                // In pixels, the edge's normal and distance follow from the stretched ones.
                let normal = [slant.cos() * pixel[0], slant.sin() * pixel[1]];
                let length = normal[0].hypot(normal[1]);
                let slant = normal[1].atan2(normal[0]);
                let near_edge = distance < 1.5 * pixel[0].max(pixel[1]);
                let signs = if near_edge { &[1.0, -1.0][..] } else { &[1.0] };
                let is_level = signs.iter().any(|sign| {
                    let left = share((sign * distance - far) / length, slant);
                    let left = if is_white { left } else { 1.0 - left };
                    (level - 255.0 * left).abs() <= 6.0
                });
                prop_assert!(is_level, "column {column} row {row}: {level} at {distance} by {axes:?}");
            }
        }
    }
}

#[test]
fn equal_axes_are_a_distance_and_opposite_ones_nothing() {
    let mask = disc(20.0);
    for by in [1.4, -2.6, 0.0] {
        assert!(offset_by_ellipse(&mask, [by; 2]) == offset(&mask, by));
    }
    assert!(offset_by_ellipse(&mask, [1.0, -1.0]) == GrayMask::from(&mask));
    // Nearly equal axes are nearly a distance.
    let near = area(&offset_by_ellipse(&mask, [3.0, 3.000_001]));
    assert!((near - area(&offset(&mask, 3.0))).abs() < 0.5, "{near}");
}
