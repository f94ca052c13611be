//! Offsets against a slow twin that measures every pixel against every other.

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

/// The squared distance of a pixel from the nearest pixel of the other color. Outside the image,
/// only the pixels around it count, as black.
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

/// The level of a pixel after an offset of stairs, by its definition.
fn referee(mask: &Mask, inwards: f64, column: u32, row: u32) -> f64 {
    let white = mask.is_white(column, row);
    if white != (inwards > 0.0) {
        return f64::from(u8::from(white));
    }
    let distance = square(mask, column, row).map_or(f64::INFINITY, |square| (square as f64).sqrt());
    let left = (distance - inwards.abs()).clamp(0.0, 1.0);
    if white { left } else { 1.0 - left }
}

/// The share of a pixel inside a straight edge, by 60 x 60 points.
pub(super) fn share(distance: f64, angle: f64) -> f64 {
    let (sin, cos) = angle.sin_cos();
    let place = |step: i32| (f64::from(step) + 0.5) / 60.0 - 0.5;
    let is_inside = |x: i32, y: i32| place(x) * cos + place(y) * sin + distance > 0.0;
    let inside = (0..60).flat_map(|y| (0..60).map(move |x| (x, y)));
    inside.filter(|&(x, y)| is_inside(x, y)).count() as f64 / 3600.0
}

/// The distance of a pixel's middle from the nearest side of any outline, and the angle of the
/// way there.
fn distance(outlines: &[outline::Outline], column: u32, row: u32) -> (f64, f64) {
    nearest(outlines, [column, row].map(|at| f64::from(at) + 0.5))
}

/// The same for a place.
pub(super) fn nearest(outlines: &[outline::Outline], [x, y]: [f64; 2]) -> (f64, f64) {
    let mut least = (f64::INFINITY, 0.0);
    for outline in outlines {
        for (of, a) in outline.iter().enumerate() {
            let b = outline[(of + 1) % outline.len()];
            let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
            let along = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy);
            let along = along.clamp(0.0, 1.0);
            let [away_x, away_y] = [x - a[0] - along * dx, y - a[1] - along * dy];
            let away = away_x.hypot(away_y);
            if away < least.0 {
                let is_on_it = away < 1e-9;
                least = (away, if is_on_it { dx.atan2(-dy) } else { away_y.atan2(away_x) });
            }
        }
    }
    least
}

/// A mask as text.
fn picture(mask: &Mask) -> String {
    let row = |row| (0..mask.width()).map(move |c| if mask.is_white(c, row) { '#' } else { '.' });
    (0..mask.height()).map(|r| row(r).chain(['\n']).collect::<String>()).collect()
}

/// Random pixels, smeared into spots and slits of some size.
pub(super) fn masks() -> impl Strategy<Value = Mask> {
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
        let outlines = outline::outlines(&RowRuns::white(&mask));
        for row in 0..mask.height() {
            for column in 0..mask.width() {
                let left = referee(&mask, by, column, row);
                if (left - 0.5).abs() > 1e-6 {
                    prop_assert_eq!(one_bit.is_white(column, row), left > 0.5);
                }
                let level = f64::from(gray.level(column, row));
                let is_white = mask.is_white(column, row);
                if is_white != (by > 0.0) {
                    prop_assert_eq!(level, if is_white { 255.0 } else { 0.0 });
                    continue;
                }
                // Next to an edge the mean line may pass on the other side of the pixel's middle.
                let (distance, slant) = distance(&outlines, column, row);
                let signs = if distance < 1.5 { &[1.0, -1.0][..] } else { &[1.0] };
                let is_level = signs.iter().any(|sign| {
                    let left = share(sign * distance - by.abs(), slant);
                    let left = if is_white { left } else { 1.0 - left };
                    (level - 255.0 * left).abs() <= 6.0
                });
                prop_assert!(is_level,
                    "column {column} row {row}: {level} at {distance} by {by}\n{}", picture(&mask));
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
                prop_assert!(level >= plain.level(column, row), "{column} {row} {} {}\n{}", level, plain.level(column, row), picture(&mask));
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
    assert_eq!(offset_one_bit(&bar, f64::NAN), bar);
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
        // Wide walls are narrowed as asked, and there is nothing to report.
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
