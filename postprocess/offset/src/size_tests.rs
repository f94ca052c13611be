//! Sizes of features, and edges that move by them.

use super::offset_tests::drawn;
use super::*;

/// The width exposed in a row or column of pixels.
fn in_row(gray: &GrayMask, row: u32) -> f64 {
    (0..gray.width()).map(|column| f64::from(gray.level(column, row))).sum::<f64>() / 255.0
}

/// A distance of a steep material: half of it for small features.
fn steep() -> Widths {
    Widths::by_size(&[20.0, 400.0], |size| 1.0 + size / 50.0)
}

#[test]
fn a_rib_on_a_block_is_as_wide_along_its_length() {
    for width in [12, 30] {
        // A block of 500 pixels, and on its right a rib of 300.
        let mask = drawn(840, 520, |column, row| {
            let is_block = (10..510).contains(&column) && (10..510).contains(&row);
            is_block || ((510..810).contains(&column) && (200..200 + width).contains(&row))
        });
        let (gray, walls) = shrink(&mask, &steep(), 2.0);
        assert_eq!(walls, []);
        let made = |column: u32| {
            (190..240).map(|row| f64::from(gray.level(column, row))).sum::<f64>() / 255.0
        };
        let by = f64::max(1.0 + 20.0 / 50.0, 1.0 + f64::from(width) / 50.0);
        let expected = f64::from(width) - 2.0 * by;
        for column in (522..790).step_by(3) {
            assert!((made(column) - expected).abs() < 0.05, "{width} {column}: {}", made(column));
        }
        // Of its length the tip takes its own width away, and the block its own.
        let along: f64 = (600..830).map(|c| f64::from(gray.level(c, 205))).sum::<f64>() / 255.0;
        assert!((along - (210.0 - by)).abs() < 0.1, "{along}");
        let block: f64 = (0..510).map(|c| f64::from(gray.level(c, 100))).sum::<f64>() / 255.0;
        let of_block = 1.0 + 400.0 / 50.0;
        assert!((block - (500.0 - of_block) + gap(&gray, 100)).abs() < 0.1, "{block}");
        assert!((in_row(&gray, 400) - (500.0 - 2.0 * of_block)).abs() < 0.05);
    }
}

/// The part of the block's right side that is taken away.
fn gap(gray: &GrayMask, row: u32) -> f64 {
    (480..510).map(|column| 1.0 - f64::from(gray.level(column, row)) / 255.0).sum()
}

#[test]
fn a_square_has_its_size_up_to_its_corners_at_every_angle() {
    for degrees in [0.0, 7.0, 30.0, 45.0, 80.0] {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let mask = drawn(200, 200, |column, row| {
            let [x, y] = [column, row].map(|at| f64::from(at) - 99.7);
            (x * cos + y * sin).abs().max((y * cos - x * sin).abs()) < 50.0
        });
        let (gray, _) = shrink(&mask, &steep(), 2.0);
        // A square of 100 pixels loses what its own size does.
        let uniform = offset(&mask, 3.0);
        for row in 0..200 {
            for column in 0..200 {
                let [a, b] = [&gray, &uniform].map(|gray| i32::from(gray.level(column, row)));
                assert!((a - b).abs() <= 8, "{degrees}: {column} {row} {a} {b}");
            }
        }
    }
}

#[test]
fn places_of_one_layer_move_by_their_own_sizes() {
    let square = |column: i32, row: i32| (10..110).contains(&column) && (10..110).contains(&row);
    let wall = |column: i32, row: i32| (150..170).contains(&column) && (10..190).contains(&row);
    let round = |column: i32, row: i32| f64::from(column - 260).hypot(f64::from(row - 100)) < 80.0;
    let mask = drawn(400, 200, |c, r| square(c, r) || wall(c, r) || round(c, r));
    let (gray, walls) = shrink(&mask, &steep(), 2.0);
    assert_eq!(walls, []);
    let made = |columns: std::ops::Range<u32>, row| {
        columns.map(|column| f64::from(gray.level(column, row))).sum::<f64>() / 255.0
    };
    assert!((made(0..130, 60) - 94.0).abs() < 0.05);
    assert!((made(130..175, 60) - 17.2).abs() < 0.05);
    // The disc of 160 pixels, to the accuracy that its stairs allow.
    assert!((made(176..400, 100) - (159.5 - 8.4)).abs() < 0.6, "{}", made(176..400, 100));
}
