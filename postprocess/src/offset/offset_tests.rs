//! Offsets beside a slow twin that measures every pixel against every other.

use lamp_stack::{Mask, MaskBuilder};
use proptest::prelude::*;

use super::*;

/// A mask of the pixels that `is_white`, by column and row.
pub(super) fn drawn(width: u32, height: u32, is_white: impl Fn(i32, i32) -> bool) -> Mask {
    let mut mask = MaskBuilder::new(width);
    for row in 0..height as i32 {
        let white = |column: i32| column >= 0 && is_white(column, row);
        let toggles = (0..width as i32).filter(|&c| white(c) != white(c - 1));
        mask.push_row(&toggles.map(|c| c as u32).collect::<Vec<_>>()).unwrap();
    }
    mask.finish()
}

/// The squared distance of a pixel from the nearest of the other colour. Of
/// what is outside the image only the pixels around it count, as black.
fn square(mask: &Mask, column: u32, row: u32) -> Option<i64> {
    let colour = mask.is_white(column, row);
    let (width, height) = (i64::from(mask.width()), i64::from(mask.height()));
    let all = (-1..=height).flat_map(|y| (-1..=width).map(move |x| (x, y)));
    let is_inside = |x: i64, y: i64| (0..width).contains(&x) && (0..height).contains(&y);
    let differs =
        |&(x, y): &(i64, i64)| (is_inside(x, y) && mask.is_white(x as u32, y as u32)) != colour;
    all.filter(differs)
        .map(|(x, y)| (x - i64::from(column)).pow(2) + (y - i64::from(row)).pow(2))
        .min()
}

/// What an offset makes of a pixel, by its definition.
fn referee(mask: &Mask, inwards: f64, column: u32, row: u32) -> f64 {
    let white = mask.is_white(column, row);
    if white != (inwards > 0.0) {
        return f64::from(u8::from(white));
    }
    let distance = square(mask, column, row).map_or(f64::INFINITY, |square| (square as f64).sqrt());
    let left = (distance - inwards.abs()).clamp(0.0, 1.0);
    if white { left } else { 1.0 - left }
}

/// Random pixels, smeared into spots and slits of some size.
fn masks() -> impl Strategy<Value = Mask> {
    let spots = prop::collection::vec((0..48i32, 0..40i32, 0..9i32, 0..9i32, any::<bool>()), 0..40);
    (1u32..48, 1u32..40, spots).prop_map(|(width, height, spots)| {
        drawn(width, height, |column, row| {
            let last = spots.iter().rev().find(|&&(x, y, w, h, _)| {
                (x..=x + w).contains(&column) && (y..=y + h).contains(&row)
            });
            last.is_some_and(|spot| spot.4)
        })
    })
}

fn distances() -> impl Strategy<Value = f64> {
    prop_oneof![
        (-40..40i32).prop_map(|quarters| f64::from(quarters) / 4.0),
        -9.0..9.0f64,
        Just(100.0),
        Just(-100.0),
    ]
    .prop_filter("moves", |by| *by != 0.0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn every_pixel_is_at_its_distance(mask in masks(), by in distances()) {
        let (gray, one_bit) = (offset(&mask, by), offset_one_bit(&mask, by));
        for row in 0..mask.height() {
            for column in 0..mask.width() {
                let left = referee(&mask, by, column, row);
                let level = gray.level(column, row);
                prop_assert!((f64::from(level) - 255.0 * left).abs() <= 0.5 + 1e-6,
                    "column {} row {}: {} for {}", column, row, level, 255.0 * left);
                if (left - 0.5).abs() > 1e-6 {
                    prop_assert_eq!(one_bit.is_white(column, row), left > 0.5);
                }
            }
        }
    }

    #[test]
    fn with_walls_kept_no_part_is_lost_and_none_breaks(
        mask in masks(), by in 0.1..7.0f64, min_feature in 0.5..5.0f64,
    ) {
        let (kept, _) = shrink(&mask, &Widths::uniform(by), min_feature);
        let plain = components::without_specks(offset(&mask, by));
        for row in 0..mask.height() {
            for column in 0..mask.width() {
                let level = kept.level(column, row);
                prop_assert!(level >= plain.level(column, row));
                prop_assert!(level == 0 || mask.is_white(column, row));
            }
        }
        for level in [1, 128] {
            prop_assert_eq!(parts(&kept.at_least(level)), parts(&mask), "{}", level);
        }
    }
}

/// How many parts the white pixels form, that touch at sides or corners.
fn parts(mask: &Mask) -> usize {
    let mut unseen: std::collections::BTreeSet<(u32, u32)> = (0..mask.height())
        .flat_map(|row| (0..mask.width()).map(move |column| (column, row)))
        .filter(|&(column, row)| mask.is_white(column, row))
        .collect();
    let mut count = 0;
    while let Some(first) = unseen.pop_first() {
        count += 1;
        let mut open = vec![first];
        while let Some((column, row)) = open.pop() {
            for x in column.saturating_sub(1)..=column + 1 {
                for y in row.saturating_sub(1)..=row + 1 {
                    if unseen.remove(&(x, y)) {
                        open.push((x, y));
                    }
                }
            }
        }
    }
    count
}

#[test]
fn a_straight_edge_moves_by_exactly_the_distance() {
    let bar = drawn(40, 30, |column, row| (10..30).contains(&column) && (5..25).contains(&row));
    for (by, left) in [(0.25, 19.5), (1.0, 18.0), (1.476, 17.048), (7.9, 4.2), (-1.476, 22.952)] {
        let gray = offset(&bar, by);
        let sum: u32 = (0..40).map(|column| u32::from(gray.level(column, 15))).sum();
        assert!((f64::from(sum) / 255.0 - left).abs() < 0.005, "{by}: {sum}");
    }
    assert_eq!(offset(&bar, 1.0).to_mask(), Some(offset_one_bit(&bar, 1.0)));
    assert_eq!(offset_one_bit(&bar, 1.4).white_pixels(), 18 * 18);
    assert_eq!(offset_one_bit(&bar, 1.6).white_pixels(), 16 * 16);
}

fn disc(radius: f64) -> Mask {
    let side = 2 * radius as u32 + 60;
    let centre = f64::from(side) / 2.0 - 0.5;
    drawn(side, side, |column, row| {
        (f64::from(column) - centre).hypot(f64::from(row) - centre) < radius
    })
}

fn rounded(half: [f64; 2], radius: f64) -> Mask {
    let [width, height] = half.map(|half| 2 * half as u32 + 60);
    let [x, y] = [width, height].map(|side| f64::from(side) / 2.0 - 0.5);
    drawn(width, height, |column, row| {
        let out = |at: f64, half: f64| (at.abs() - half + radius).max(0.0);
        let [x, y] = [out(f64::from(column) - x, half[0]), out(f64::from(row) - y, half[1])];
        x.hypot(y) < radius
    })
}

#[test]
fn there_and_back_a_smooth_shape_is_the_same_to_the_pixel() {
    for by in [1.0, 1.476, 2.0, 3.3, 5.0, 8.0] {
        for shape in [disc(60.0), disc(100.5), disc(131.7), rounded([120.0, 70.0], 40.0)] {
            for by in [by, -by] {
                let there = offset_one_bit(&shape, by);
                assert!(there != shape);
                assert!(offset_one_bit(&there, -by) == shape, "{by}");
            }
        }
    }
}

/// A wall through the middle of an image, turned.
fn wall(width: f64, degrees: f64) -> Mask {
    let (sin, cos) = degrees.to_radians().sin_cos();
    drawn(160, 160, |column, row| {
        let [x, y] = [column, row].map(|at| f64::from(at) - 79.7);
        (x * cos + y * sin).abs() <= width / 2.0 && (y * cos - x * sin).abs() < 60.0
    })
}

#[test]
fn a_thin_wall_stays_as_wide_as_the_least_feature_at_any_angle() {
    for degrees in [0.0, 10.0, 30.0, 45.0, 71.0, 90.0] {
        for width in [1.5, 2.0, 3.0, 4.0, 5.0, 6.0] {
            let mask = wall(width, degrees);
            let (kept, walls) = shrink(&mask, &Widths::uniform(3.5), 2.0);
            let white: u32 = (0..160u32)
                .flat_map(|row| (0..160u32).map(move |column| (column, row)))
                .map(|(column, row)| u32::from(kept.level(column, row)))
                .sum();
            let made = f64::from(white) / 255.0 / 120.0;
            let own = mask.white_pixels() as f64 / 120.0;
            let [low, high] = [0.95 * own.min(2.0), own.min(3.6) + 0.1];
            assert!((low..=high).contains(&made), "{width} at {degrees}: {made}");
            assert_eq!(parts(&kept.at_least(255)), 1, "{width} at {degrees}");
            assert_eq!(walls.len(), 1, "{width} at {degrees}: {walls:?}");
            assert_eq!(walls[0].asked, 0.0);
            assert!((walls[0].width - width).abs() <= 1.0, "{width} at {degrees}: {walls:?}");
            assert!(walls[0].columns.len().max(walls[0].rows.len()) > 70);
        }
        // Wide walls are narrowed as asked, and there is nothing to tell.
        let (_, walls) = shrink(&wall(12.0, degrees), &Widths::uniform(3.5), 2.0);
        assert_eq!(walls, []);
    }
}

#[test]
fn corners_and_sharp_tips_are_no_walls() {
    // A square corner, and a wedge of 60 degrees.
    for slope in [0.0, 0.5] {
        let shape = drawn(200, 200, |column, row| {
            let left = 20.0 + slope * f64::from(row);
            (20..180).contains(&row) && f64::from(column) > left && column < 160
        });
        let (kept, walls) = shrink(&shape, &Widths::uniform(1.476), 2.0);
        assert_eq!(walls, []);
        assert!(kept == offset(&shape, 1.476));
    }
}

#[test]
fn places_are_as_wide_as_the_squares_they_lie_in() {
    // A square of 60 pixels, and walls of 10, upright and turned.
    let square = |column: i32, row: i32| (10..70).contains(&column) && (10..70).contains(&row);
    let upright = |column: i32, row: i32| (100..110).contains(&column) && (10..190).contains(&row);
    let turned =
        |column: i32, row: i32| (column - row + 100).abs() <= 7 && (90..190).contains(&row);
    let mask = drawn(200, 200, |c, r| square(c, r) || upright(c, r) || turned(c, r));
    let sizes = [5.0, 10.0, 15.0, 59.0, 62.0];
    let parts = local_thickness::by_size(&mask, &sizes);
    let class = |column, row| parts.iter().position(|part| part.find(column, row).is_some());
    for row in [0, 1, 9, 10, 70, 199] {
        assert_eq!(class(0, row), None);
    }
    for (column, row) in [(10, 10), (69, 69), (40, 10), (11, 69), (40, 40), (10, 25)] {
        assert_eq!(class(column, row), Some(4), "{column} {row}");
    }
    for row in [10, 11, 80, 189] {
        assert_eq!([100, 105, 109].map(|column| class(column, row)), [Some(2); 3]);
    }
    for step in 110..180i32 {
        assert_eq!(class(step - 100, step as u32), Some(2), "{step}");
    }
    // Every pixel has one size, and only white ones have one.
    for row in 0..200 {
        for column in 0..200 {
            let holds = parts.iter().filter(|part| part.find(column, row).is_some()).count();
            assert_eq!(holds, usize::from(mask.is_white(column as u32, row)));
        }
    }
}

#[test]
fn wide_places_move_by_their_own_width() {
    let square = |column: i32, row: i32| (10..70).contains(&column) && (10..70).contains(&row);
    let wall = |column: i32, row: i32| (100..110).contains(&column) && (10..190).contains(&row);
    let mask = drawn(200, 200, |c, r| square(c, r) || wall(c, r));
    let widths = Widths::by_size(&[10.0, 60.0], |size| if size < 35.0 { 1.0 } else { 3.0 });
    let (gray, walls) = shrink(&mask, &widths, 2.0);
    assert_eq!(walls, []);
    assert_eq!(gray.row(100), offset(&mask, 1.0).row(100));
    let (of_square, by_three) = (gray.row(40), offset(&mask, 3.0));
    assert_eq!(of_square[..2], by_three.row(40)[..2]);
    assert_eq!(of_square[2..], offset(&mask, 1.0).row(40)[2..]);
}

#[test]
fn a_waist_between_wide_places_does_not_break() {
    for degrees in [0.0, 20.0, 45.0, 80.0, 90.0] {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let bridged = drawn(300, 300, |column, row| {
            let [x, y] = [column, row].map(|at| f64::from(at) - 150.0);
            let (along, across) = (x * cos + y * sin, y * cos - x * sin);
            let is_bridge = along.abs() < 62.0 && across.abs() < 3.4;
            is_bridge || (along.abs() - 62.0).hypot(across) < 60.0
        });
        let squares = drawn(300, 300, |column, row| {
            let is_in =
                |x: i32, y: i32| (x..x + 82).contains(&column) && (y..y + 82).contains(&row);
            is_in(40, 40) || is_in(120, 120)
        });
        for (mask, wide) in [(bridged, 4.0), (squares, 2.0)] {
            assert_eq!(parts(&mask), 1);
            assert_eq!(parts(&offset_one_bit(&mask, 5.5)), 2, "{degrees} {wide}");
            let (kept, walls) = shrink(&mask, &Widths::uniform(5.5), 2.0);
            assert_eq!(parts(&kept.at_least(255)), 1, "{degrees}");
            assert_eq!(walls.len(), 1, "{degrees}: {walls:?}");
            assert!(walls[0].width > wide && walls[0].asked < 5.0, "{walls:?}");
            // Elsewhere nothing is kept.
            let plain = offset(&mask, 5.5);
            let differs = (0..300).filter(|&row| kept.row(row) != plain.row(row)).count();
            assert!((2..70).contains(&differs), "{degrees}: {differs} rows");
        }
    }
}
