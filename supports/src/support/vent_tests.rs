//! Holes drawn into parts, and checked again.

use lamp_stack::{Layer, Length, Mask, MaskBuilder, Op, PageInfo, Pitch};
use proptest::prelude::*;
use std::num::NonZeroU8;

use super::window::Raster;
use super::*;
use crate::check::{CheckError, CheckOptions, Findings, check};

/// A pixel is 0.1 mm, and so is a layer.
const SQUARE: &str = "100um";
const SIDE: u32 = 48;

fn image(is_white: impl Fn(u32, u32) -> bool) -> Mask {
    let mut mask = MaskBuilder::new(SIDE);
    for row in 0..SIDE {
        let changes = |&column: &u32| {
            let before = column > 0 && is_white(column - 1, row);
            is_white(column, row) != before
        };
        mask.push_row(&(0..SIDE).filter(changes).collect::<Vec<_>>()).unwrap();
    }
    mask.finish()
}

/// Returns layers of 0.1 mm, white where `is_white` holds for a column, a row and a layer.
fn layers(count: u32, is_white: impl Fn(u32, u32, u32) -> bool) -> Vec<Layer> {
    layers_of(SQUARE, count, is_white)
}

fn layers_of(pitch: &str, count: u32, is_white: impl Fn(u32, u32, u32) -> bool) -> Vec<Layer> {
    let pitch: Pitch = pitch.parse().unwrap();
    let layer = |number: u32| {
        let image = image(|column, row| is_white(column, row, number));
        let info = PageInfo {
            index: number,
            z_um: Some(100.0 * f64::from(number)),
            thickness_um: Some(100.0),
            origin_mm: Some([0.0, 0.0]),
            ..PageInfo::default()
        };
        Layer { info, pitch: Some(pitch), image: image.into() }
    };
    (0..count).map(layer).collect()
}

fn found_in(layers: &[Layer]) -> Findings {
    let layers = layers.iter().cloned().map(Ok::<_, CheckError>);
    check(layers, Ok, &CheckOptions::default()).unwrap()
}

fn planned(layers: &[Layer], diameter: f64) -> Vec<VentPlan> {
    let lengths = [diameter, 10.0].map(Length::from_mm);
    let layers_once_more = layers.iter().cloned().map(Ok::<_, SupportError>);
    plan_vents(layers_once_more, &found_in(layers), lengths, NonZeroU8::MIN).unwrap()
}

/// Draws a hole into layers.
fn with(layers: &[Layer], vent: &Vent) -> Vec<Layer> {
    let raster = Raster::of(&found_in(layers)).unwrap();
    let drawn = |layer: &Layer| {
        let middle = Length::from_um(layer.info.z_um.unwrap() + 50.0);
        let section = vent.rod.section(middle, &raster);
        let hole = image(|column, row| {
            section.iter().any(|(at, run)| *at == row && run.contains(&column))
        });
        let white = layer.image.clone().into_image().into_mask(NonZeroU8::MIN);
        Layer { image: white.combined(Op::Difference, &hole).unwrap().into(), ..layer.clone() }
    };
    layers.iter().map(drawn).collect()
}

/// Returns what is left in the pocket with the first of its holes that drains it, and the hole.
fn drained(layers: &[Layer], plan: &VentPlan) -> Option<(f64, Vent)> {
    let left = |vent: &Vent| (plan.share_left(&found_in(&with(layers, vent))), vent.clone());
    plan.vents.iter().map(left).find(|(left, _)| *left < 0.01)
}

#[test]
fn a_round_cup_drains_through_its_wall() {
    // Walls of 0.7 mm, a floor of 1.2 mm.
    let part = layers(30, |column, row, layer| {
        let at = (f64::from(column) - 23.5).hypot(f64::from(row) - 23.5);
        at < 18.0 && (layer < 12 || at >= 11.0)
    });
    let plans = planned(&part, 1.0);
    let [plan] = &plans[..] else { panic!("{plans:?}") };
    let (left, vent) = drained(&part, plan).unwrap();
    assert_eq!(left, 0.0);
    // Pixels of both edges may be nearer to each other than the edges by one diagonal.
    assert!((0.55..0.75).contains(&vent.wall.mm()), "{}", vent.wall);
    // It leads out level, at the height of the floor.
    let [from, to] = vent.rod.ends.map(|end| end.map(Length::mm));
    assert_eq!(from[2], to[2]);
    assert!((1.3..=1.71).contains(&from[2]), "{from:?}");
}

#[test]
fn a_trap_above_a_thin_floor_drains_down() {
    // A closed box on four legs: walls of 1 mm, a floor of 0.3 mm.
    let part = layers(25, |column, row, layer| {
        let within =
            |low: u32, high: u32| (low..high).contains(&column) && (low..high).contains(&row);
        let leg = |at: u32| (4..8).contains(&at) || (40..44).contains(&at);
        match layer {
            0..6 => leg(column) && leg(row),
            6..9 | 21..25 => within(4, 44),
            _ => within(4, 44) && !within(14, 34),
        }
    });
    let plans = planned(&part, 1.0);
    let [plan] = &plans[..] else { panic!("{plans:?}") };
    let (left, vent) = drained(&part, plan).unwrap();
    assert!(left == 0.0 && (vent.wall.mm() - 0.3).abs() < 1e-9, "{left}, {}", vent.wall);
    let [from, to] = vent.rod.ends.map(|end| end.map(Length::mm));
    assert!(
        from[..2] == to[..2] && (from[2] - 1.0).abs() + (to[2] - 0.5).abs() < 1e-9,
        "{from:?} {to:?}"
    );
    // The middle of the floor.
    assert!((from[0] - 2.4).abs() < 0.11 && (from[1] + 2.4).abs() < 0.11, "{from:?}");
}

#[test]
fn thick_walls_get_no_hole() {
    let part = layers(30, |column, row, layer| {
        let within =
            |low: u32, high: u32| (low..high).contains(&column) && (low..high).contains(&row);
        within(2, 46) && !(within(20, 28) && layer >= 15)
    });
    let found = found_in(&part);
    let layers = part.iter().cloned().map(Ok::<_, SupportError>);
    let plans =
        plan_vents(layers, &found, [0.6, 1.5].map(Length::from_mm), NonZeroU8::MIN).unwrap();
    assert!(plans.len() == 1 && plans[0].vents.is_empty() && !plans[0].is_too_wide, "{plans:?}");
    // The wall is 1.8 mm thick, and the floor stands on the platform.
    assert_eq!(planned(&part, 0.6)[0].vents.len(), 2);
    // The pocket is 0.8 mm wide.
    let wide = &planned(&part, 0.9)[0];
    assert!(wide.is_too_wide && wide.vents.is_empty(), "{wide:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Boxes with a hollow of any place and height, with or without a lid, on the platform or on legs.
    #[test]
    fn holes_are_the_shortest_and_drain(
        walls in prop::array::uniform4(2_u32..12),
        floor in 2_u32..10,
        depth in 6_u32..14,
        lid in 0_u32..4,
        legs in 0_u32..6,
        diameter in 0.6..1.5_f64,
        pitch in prop::sample::select(vec![SQUARE, "100x136um", "118x87um"]),
    ) {
        let [left, right, top, bottom] = walls;
        let outer = 3..SIDE - 3;
        let hollow = [outer.start + left..outer.end - right, outer.start + top..outer.end - bottom];
        let [floor_at, end] = [legs + floor, legs + floor + depth];
        let is_white = |column: u32, row: u32, layer: u32| {
            if !(outer.contains(&column) && outer.contains(&row)) {
                return false;
            }
            let is_corner = |at: u32| at < outer.start + 2 || at >= outer.end - 2;
            if layer < legs {
                return is_corner(column) && is_corner(row);
            }
            let is_hollow = hollow[0].contains(&column) && hollow[1].contains(&row);
            !(is_hollow && (floor_at..end).contains(&layer))
        };
        let part = layers_of(pitch, end + lid, is_white);
        let plans = planned(&part, diameter);
        prop_assert_eq!(plans.len(), 1);
        let drained = drained(&part, &plans[0]);
        prop_assert!(drained.is_some(), "{:?}", plans[0]);
        let (_, vent) = drained.unwrap();
        // All walls are flat, so the nearest outside lies straight aside or straight down.
        let [wide, high] = pitch.parse::<Pitch>().unwrap().mm();
        let down = if legs > 0 { 0.1 * f64::from(floor) } else { f64::INFINITY };
        let aside = [(left, wide), (right, wide), (top, high), (bottom, high)];
        let walls = aside.into_iter().map(|(pixels, side)| f64::from(pixels) * side);
        // The shortest way is from pixel to pixel: a side of one longer than a wall aside, and a
        // layer longer than a floor.
        let ways = aside.into_iter().map(|(pixels, side)| f64::from(pixels + 1) * side);
        let ways = ways.zip(walls).chain([(down + 0.1, down)]);
        let (_, least) = ways.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        prop_assert!((vent.wall.mm() - least).abs() < 1e-9, "{} for {least}", vent.wall);
    }
}
