//! Edges of images of shares against polygons that are moved exactly and cut by pixels.

use lamp_stack::GrayMask;

use super::edge_place_tests::area;
use super::scale::Enlargement;
use super::*;

/// Micrometers of a pixel at 1500 dpi.
const PITCH: f64 = 25_400.0 / 1500.0;

type Polygon = Vec<[f64; 2]>;

/// The part of a polygon where `off` of a place is not below zero.
fn cut(polygon: &[[f64; 2]], off: impl Fn([f64; 2]) -> f64) -> Polygon {
    let mut out = Vec::new();
    for (of, &a) in polygon.iter().enumerate() {
        let b = polygon[(of + 1) % polygon.len()];
        let [at_a, at_b] = [a, b].map(&off);
        if at_a >= 0.0 {
            out.push(a);
        }
        if (at_a >= 0.0) != (at_b >= 0.0) {
            let share = at_a / (at_a - at_b);
            out.push([0, 1].map(|axis| a[axis] + share * (b[axis] - a[axis])));
        }
    }
    out
}

fn area_of(polygon: &[[f64; 2]]) -> f64 {
    let sides = polygon.iter().zip(polygon.iter().cycle().skip(1));
    sides.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>().abs() / 2.0
}

/// The shares of the areas of pixels that are in a convex polygon.
fn shares(size: u32, polygon: &[[f64; 2]]) -> GrayMask {
    let mut out = GrayMask::new(size);
    for row in 0..size {
        let top = f64::from(row);
        let strip = cut(&cut(polygon, |at| at[1] - top), |at| top + 1.0 - at[1]);
        let level = |column: u32| {
            let left = f64::from(column);
            let pixel = cut(&cut(&strip, |at| at[0] - left), |at| left + 1.0 - at[0]);
            (255.0 * area_of(&pixel)).round() as u8
        };
        out.push_runs((0..size).map(|column| (1, level(column)))).unwrap();
    }
    out
}

/// A regular polygon around a place, whose sides are so far from it; the first one's normal is
/// turned by an angle.
fn regular(sides: u32, apothem: f64, degrees: f64, middle: [f64; 2]) -> Polygon {
    let half = std::f64::consts::PI / f64::from(sides);
    let corner = |of: u32| {
        let angle = degrees.to_radians() + f64::from(2 * of + 1) * half;
        let radius = apothem / half.cos();
        [middle[0] + radius * angle.cos(), middle[1] + radius * angle.sin()]
    };
    (0..sides).map(corner).collect()
}

fn moved_by(shares: &GrayMask, by: f64) -> GrayMask {
    let gray = offset_areas(&TrueShape::of(shares), &Widths::uniform(by), 0.0).0;
    if by < 0.0 { gray } else { components::lower(shares, &gray) }
}

/// The greatest difference of two images in a pixel, in pixels.
fn most_off(a: &GrayMask, b: &GrayMask) -> f64 {
    let all = (0..a.height()).flat_map(|row| (0..a.width()).map(move |column| (column, row)));
    let off = |(column, row)| a.level(column, row).abs_diff(b.level(column, row));
    f64::from(all.map(off).max().unwrap()) / 255.0
}

const ANGLES: [f64; 10] = [0.0, 1.0, 7.0, 15.0, 18.4, 22.5, 26.6, 30.0, 41.0, 45.0];
const PHASES: [[f64; 2]; 3] = [[0.13, 0.71], [0.5, 0.0], [0.37, 0.36]];

#[test]
fn straight_edges_move_exactly_at_every_angle_and_phase() {
    for (sides, apothem, most_px) in
        [(3, 40.0, 0.36), (4, 17.5, 0.25), (4, 50.2, 0.25), (6, 30.3, 0.25), (8, 50.0, 0.25)]
    {
        for (degrees, phase) in ANGLES.iter().flat_map(|angle| PHASES.map(|phase| (*angle, phase)))
        {
            let middle = phase.map(|phase| 90.0 + phase);
            let polygon = |by: f64| shares(180, &regular(sides, apothem - by, degrees, middle));
            let before = polygon(0.0);
            for um in [0.0, 5.0, 25.0, 100.0, 200.0] {
                let (made, wanted) = (moved_by(&before, um / PITCH), polygon(um / PITCH));
                let around = 2.0 * area(&wanted) / (apothem - um / PITCH);
                let off_um = (area(&made) - area(&wanted)) / around * PITCH;
                let off_px = most_off(&made, &wanted);
                let of = format!("{sides} at {degrees} {phase:?} by {um}: {off_um} um {off_px} px");
                assert!(off_um.abs() < 0.3, "{of}");
                assert!(off_px < most_px, "{of}");
            }
        }
    }
}

/// A polygon grown by a disc, with arcs of 32 sides around its corners.
fn grown(polygon: &[[f64; 2]], by: f64) -> Polygon {
    let count = polygon.len();
    let normal = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).atan2(b[1] - a[1]);
    let corner = |of: usize| {
        let [a, b, c] = [of + count - 1, of, of + 1].map(|of| polygon[of % count]);
        let (from, to) = (normal(a, b), normal(b, c));
        let turn = (to - from).rem_euclid(std::f64::consts::TAU);
        (0..=32).map(move |step| {
            let (sin, cos) = (from - turn * f64::from(step) / -32.0).sin_cos();
            [b[0] + by * cos, b[1] + by * sin]
        })
    };
    (0..count).flat_map(corner).collect()
}

#[test]
fn straight_edges_and_corners_grow_exactly() {
    for (sides, apothem, most_um, most_px) in
        [(3, 20.0, 0.7, 0.4), (4, 17.5, 0.45, 0.25), (4, 40.2, 0.3, 0.25), (6, 30.3, 0.3, 0.25)]
    {
        for (degrees, phase) in ANGLES.iter().flat_map(|angle| PHASES.map(|phase| (*angle, phase)))
        {
            let polygon = regular(sides, apothem, degrees, phase.map(|phase| 90.0 + phase));
            let before = shares(180, &polygon);
            let around = 2.0 * area_of(&polygon) / apothem;
            for um in [5.0, 25.0, 100.0, 250.0] {
                let by: f64 = um / PITCH;
                let (made, wanted) = (moved_by(&before, -by), shares(180, &grown(&polygon, by)));
                let off_um = (area(&made) - area(&wanted)) / around * PITCH;
                let off_px = most_off(&made, &wanted);
                let of = format!("{sides} at {degrees} {phase:?} by {um}: {off_um} um {off_px} px");
                assert!(off_um.abs() < most_um && off_px < most_px, "{of}");
            }
        }
    }
}

/// A rectangle turned around a place.
fn turned([left, top, right, bottom]: [f64; 4], degrees: f64, middle: [f64; 2]) -> Polygon {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let corner = |[x, y]: [f64; 2]| [middle[0] + x * cos - y * sin, middle[1] + x * sin + y * cos];
    [[left, top], [right, top], [right, bottom], [left, bottom]].map(corner).to_vec()
}

/// The levels of one image, or the levels of both, at each pixel.
fn sum(a: &GrayMask, b: &GrayMask, sign: i32) -> GrayMask {
    let mut out = GrayMask::new(a.width());
    for row in 0..a.height() {
        let level = |column| {
            let [a, b] = [a, b].map(|of| i32::from(of.level(column, row)));
            (a + sign * b).clamp(0, 255) as u8
        };
        out.push_runs((0..a.width()).map(|column| (1, level(column)))).unwrap();
    }
    out
}

#[test]
fn gaps_and_holes_without_black_pixels_widen_and_close() {
    for (degrees, phase) in ANGLES.iter().flat_map(|angle| PHASES.map(|phase| (*angle, phase))) {
        let middle = phase.map(|phase| 40.0 + phase);
        for gap in [0.9, 1.4, 2.0] {
            let of = format!("{gap} at {degrees} {phase:?}");
            let by = 25.0 / PITCH;
            let bars = |by: f64| {
                let bar = |left: f64, right: f64| {
                    shares(
                        80,
                        &turned([left + by, by - 20.0, right - by, 20.0 - by], degrees, middle),
                    )
                };
                sum(&bar(-20.0, -gap / 2.0), &bar(gap / 2.0, 20.0), 1)
            };
            let off_um = |made: f64, wanted: f64, around: f64| (made - wanted) / around * PITCH;
            let (made, wanted) = (moved_by(&bars(0.0), by), bars(by));
            let off = off_um(area(&made), area(&wanted), 2.0 * (40.0 - 2.0 * by));
            assert!(off.abs() < 3.5, "{of}: {off} um");
            let square =
                |half: f64| shares(80, &turned([-half, -half, half, half], degrees, middle));
            let hole = sum(&square(20.0), &square(gap / 2.0), -1);
            // It grows by the distance, and around its corners.
            let grown = gap * gap + 4.0 * gap * by + std::f64::consts::PI * by * by;
            let made = area(&square(20.0 - by)) - area(&moved_by(&hole, by));
            let off = off_um(made, grown, 4.0 * gap + 2.0 * std::f64::consts::PI * by);
            assert!(off.abs() < 12.0, "hole of {of}: {off} um, {made} for {grown}");
            // Edges on both sides pass each other: nothing is left between.
            let grown = moved_by(&bars(0.0), -by);
            let inside = square(18.0).at_least(255);
            let left = sum(&GrayMask::from(&inside), &grown, -1);
            assert!(area(&left) < 1.0, "closed {of}: {}", area(&left));
        }
    }
}

#[test]
fn enlarged_edges_are_where_the_enlarged_part_has_them() {
    for (degrees, phase) in ANGLES.iter().flat_map(|angle| PHASES.map(|phase| (*angle, phase))) {
        let middle = phase.map(|phase| 50.0 + phase);
        let before = TrueShape::of(&shares(100, &regular(4, 17.5, degrees, middle)));
        for shrinkage in [0.02, 0.2] {
            let side = Enlargement::new(100, shrinkage);
            let larger = before.enlarged(&side, &side, side.after() as u32);
            let middle = middle.map(|at| at / (1.0 - shrinkage));
            for um in [0.0, 25.0, -25.0] {
                let by = um / PITCH;
                let made = if um == 0.0 {
                    larger.shares()
                } else {
                    offset_areas(&larger, &Widths::uniform(by), 0.0).0
                };
                let side = 17.5 / (1.0 - shrinkage) - by;
                let mut wanted = 4.0 * side * side;
                if by < 0.0 {
                    wanted -= (4.0 - std::f64::consts::PI) * by * by;
                }
                let off_um = (area(&made) - wanted) / (8.0 * side) * PITCH;
                let of = format!("{shrinkage} at {degrees} {phase:?} by {um}: {off_um} um");
                assert!(off_um.abs() < 0.3, "{of}");
                if by >= 0.0 {
                    let size = made.width();
                    let off_px = most_off(&made, &shares(size, &regular(4, side, degrees, middle)));
                    assert!(off_px < 0.3, "{of} {off_px} px");
                }
            }
        }
    }
}

#[test]
fn discs_move_exactly() {
    for (radius, most_um) in [(5.0, 0.7), (10.0, 0.3), (16.0, 0.3), (25.7, 0.2), (50.0, 0.1)] {
        for phase in PHASES {
            let middle = phase.map(|phase| 90.0 + phase);
            let disc = |by: f64| shares(180, &regular(400, radius - by, 0.0, middle));
            let before = disc(0.0);
            for um in [-250.0, -25.0, 0.0, 5.0, 25.0, 60.0, 250.0] {
                let by = um / PITCH;
                if radius - by < 2.0 {
                    continue;
                }
                let (made, wanted) = (moved_by(&before, by), disc(by));
                let around = 2.0 * area(&wanted) / (radius - by);
                let off_um = (area(&made) - area(&wanted)) / around * PITCH;
                let off_px = most_off(&made, &wanted);
                let of = format!("{radius} {phase:?} by {um}: {off_um} um {off_px} px");
                assert!(off_um.abs() < most_um && off_px < 0.26, "{of}");
            }
        }
    }
}

#[test]
fn thin_walls_stay_as_they_were_and_grow_as_wide_ones_do() {
    for (width, degrees) in
        [0.3, 0.6, 0.9, 1.2, 1.7].iter().flat_map(|width| ANGLES.map(|angle| (width, angle)))
    {
        for phase in PHASES {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let corner = |[along, across]: [f64; 2]| {
                let [along, across] = [30.0 * along, width / 2.0 * across];
                let middle = phase.map(|phase| 40.0 + phase);
                [middle[0] + along * cos - across * sin, middle[1] + along * sin + across * cos]
            };
            let before =
                shares(80, &[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(corner));
            let (kept, _) = offset_areas(&TrueShape::of(&before), &Widths::uniform(1.5), 2.0);
            let kept = components::lower(&before, &kept);
            let of = format!("{width} at {degrees} {phase:?}");
            // Ends may become shorter by what edges move.
            let left = area(&kept) / area(&before);
            assert!((0.88..=1.0).contains(&left), "{of}: {left}");
            let pieces = components::losses(&before.at_least(1), &kept.at_least(1));
            assert!(pieces.is_empty(), "{of}: {pieces:?}");
            let grown = area(&moved_by(&before, -1.5));
            let wanted =
                60.0 * width + 1.5 * (120.0 + 2.0 * width) + std::f64::consts::PI * 1.5 * 1.5;
            let off_um = (grown - wanted) / 120.0 * PITCH;
            // Where a wall has no whole pixel, its two edges share their pixels.
            let most_um = if *width < 1.0 { 2.0 } else { 4.5 };
            assert!(off_um.abs() < most_um, "{of}: {off_um}");
        }
    }
}
