//! Edges beside closed forms: squares at seven angles, and discs.

use lamp_stack::GrayMask;

use super::offset_tests::drawn;
use super::*;

/// Micrometres of a pixel at 1500 dpi.
const PITCH: f64 = 25_400.0 / 1500.0;

/// The exposed pixels, by their shares.
fn area(gray: &GrayMask) -> f64 {
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

fn square(side: f64, degrees: f64) -> Mask {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let size = (side * 1.5) as u32 + 80;
    let middle = [f64::from(size) / 2.0 + 0.13, f64::from(size) / 2.0 - 0.29];
    drawn(size, size, |column, row| {
        let [x, y] = [f64::from(column) - middle[0], f64::from(row) - middle[1]];
        (x * cos + y * sin).abs().max((y * cos - x * sin).abs()) < side / 2.0
    })
}

fn disc(radius: f64) -> Mask {
    let size = 2 * radius as u32 + 80;
    let middle = [f64::from(size) / 2.0 + 0.13, f64::from(size) / 2.0 - 0.29];
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
