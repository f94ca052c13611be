//! Edges against closed forms: squares at seven angles, and discs.

use lamp_stack::GrayMask;

use super::offset_tests::drawn;
use super::*;

/// Micrometers of a pixel at 1500 dpi.
const PITCH: f64 = 25_400.0 / 1500.0;

/// The exposed pixels, by their shares.
pub(super) fn area(gray: &GrayMask) -> f64 {
    let mut sum = 0;
    for row in gray.rows() {
        let mut ends = row.iter().skip(1).map(|change| change.column);
        for change in row {
            let end = ends.next().unwrap_or(gray.width());
            sum += u64::from(end - change.column) * u64::from(change.level);
        }
    }
    sum as f64 / 255.0
}

pub(super) fn square(side: f64, degrees: f64) -> Mask {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let size = (side * 1.5) as u32 + 80;
    let middle = [f64::from(size) / 2.0 + 0.13, f64::from(size) / 2.0 - 0.29];
    drawn(size, size, |column, row| {
        let [x, y] = [f64::from(column) - middle[0], f64::from(row) - middle[1]];
        (x * cos + y * sin).abs().max((y * cos - x * sin).abs()) < side / 2.0
    })
}

pub(super) fn disc(radius: f64) -> Mask {
    disc_at(radius, [0.13, -0.29])
}

/// A disc whose middle is `off` from the middle of the image.
fn disc_at(radius: f64, off: [f64; 2]) -> Mask {
    let size = 2 * radius as u32 + 80;
    let middle = off.map(|off| f64::from(size) / 2.0 + off);
    drawn(size, size, |column, row| {
        (f64::from(column) - middle[0]).hypot(f64::from(row) - middle[1]) < radius
    })
}

/// By how much too far the edges of a shape move, whose area is `form` times a length squared.
fn too_far(mask: &Mask, form: f64, by: f64) -> f64 {
    let length = |area: f64| (area / form).sqrt();
    length(area(&GrayMask::from(mask))) - length(area(&offset(mask, by))) - by
}

/// By how much too far the edges of a square move. One that grows has round corners.
fn square_too_far(mask: &Mask, by: f64) -> f64 {
    if by > 0.0 {
        return too_far(mask, 4.0, by);
    }
    let [before, after] = [area(&GrayMask::from(mask)), area(&offset(mask, by))];
    let side = before.sqrt();
    let form = before - 4.0 * side * by + std::f64::consts::PI * by * by;
    (form - after) / (4.0 * side)
}

#[test]
fn edges_of_squares_and_discs_move_by_the_distance_at_every_angle() {
    for um in [25.0, -25.0, 100.0, -100.0, 250.0, -250.0] {
        let by = um / PITCH;
        for degrees in [0.0, 1.0, 7.0, 15.0, 22.5, 30.0, 41.0, 45.0] {
            for side in [100.3, 300.0] {
                let off_um = square_too_far(&square(side, degrees), by) * PITCH;
                assert!(off_um.abs() < 0.5, "square {side} at {degrees} by {um}: {off_um}");
            }
        }
        for radius in [75.0, 147.6, 300.0, 1000.0] {
            let off_um = too_far(&disc(radius), std::f64::consts::PI, by) * PITCH;
            assert!(off_um.abs() < 0.5, "disc {radius} by {um}: {off_um}");
        }
    }
}

#[test]
fn small_discs_grow_and_vanish_by_their_closed_form() {
    let by = 250.0 / PITCH;
    let pi = std::f64::consts::PI;
    for off in [[0.0, 0.0], [0.13, -0.29], [0.5, 0.0], [0.38, 0.21]] {
        for radius in [10.0, 14.0, 14.5] {
            // A faint pixel of a twentieth may be left in the middle.
            assert!(area(&offset(&disc_at(radius, off), by)) < 0.05, "{radius} at {off:?}");
        }
        for radius in [15.0, 16.0, 18.3, 20.0, 22.0, 25.7, 30.0, 35.0] {
            let most_um = if radius < 30.0 { 0.75 } else { 0.5 };
            let mask = disc_at(radius, off);
            // Outwards by the radius, inwards by what is missing along the edge: of the radius
            // next to nothing is left.
            let outwards = too_far(&mask, pi, -by);
            let own = (mask.white_pixels() as f64 / pi).sqrt();
            let missing = pi * (own - by).max(0.0).powi(2) - area(&offset(&mask, by));
            for off_px in [outwards, missing / (2.0 * pi * own)] {
                let off_um = off_px * PITCH;
                assert!(off_um.abs() < most_um, "disc {radius} at {off:?}: {off_um}");
            }
        }
    }
}

#[test]
fn a_wall_asked_to_be_wider_than_the_least_gets_what_was_asked() {
    for degrees in [0.0, 12.0, 30.0, 45.0, 81.0] {
        for asked in [2.3, 2.82, 3.4] {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let mask = drawn(260, 260, |column, row| {
                let [x, y] = [column, row].map(|at| f64::from(at) - 129.7);
                (x * cos + y * sin).abs() <= 4.0 && (y * cos - x * sin).abs() < 100.0
            });
            let own = mask.white_pixels() as f64 / 200.0;
            let by = (own - asked) / 2.0;
            let (kept, walls) = shrink(&mask, &Widths::uniform(by), 2.0);
            let made = area(&kept) / (200.0 - 2.0 * by);
            assert!((made - asked).abs() < 0.08, "{asked} at {degrees}: {made} {walls:?}");
            assert_eq!(walls, [], "{asked} at {degrees}");
        }
    }
}
