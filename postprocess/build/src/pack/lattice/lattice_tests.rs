use lamp_fixtures::Plate;
use lamp_stack::{Image, Layer, Mask, Orientation, PageInfo, Pitch};
use proptest::prelude::*;

use super::super::super::testing::mask_of;
use super::super::super::{Layout, Pack, PackBy, PartStack, TileError};
use super::*;

/// Places copies on lattices of the only part, and in the same ways at their edges.
fn placed(layout: &Layout, gap: u32, wanted: u32, turns: Turns) -> Vec<CopyPlacement> {
    place(layout, gap, wanted, 0, turns, &ways(turns), &mut HashMap::new())
}

fn ways(turns: Turns) -> Vec<Way> {
    turns.orientations().into_iter().map(|turn| (0, turn)).collect()
}

/// An area for a part of 25.4 dpi times `scale`, so that a pixel is a millimeter or less.
fn layout_of(mask: Mask, scale: f64, area: &str) -> Layout {
    let pitch = Pitch::of_dpi(25.4 * scale);
    let layer = Layer { info: PageInfo::default(), pitch, image: Image::Mask(mask).into() };
    let part = PartStack::of_outline("p.tif", std::iter::once(Ok::<_, TileError>(layer)));
    let part = part.unwrap().unwrap();
    let gap = lamp_stack::Length::from_mm(0.0);
    Layout::packed(vec![part], &[Some(1)], area.parse().unwrap(), gap, Pack::default()).unwrap()
}

/// Counts the copies of a plate on lattices and, for comparison, on rows and by outlines without
/// lattices; gaps and the area are in mm, with 4 pixels each.
fn counts(plate: Plate, area: &str, gap: u32) -> [usize; 2] {
    let layout = layout_of(plate.mask(0.25), 4.0, area);
    let gap = gap * 4;
    let lattices = placed(&layout, gap, u32::MAX, Turns::Quarters);
    check(&layout, &lattices, gap);
    let mut regions = NoFitRegions::new(&layout, gap, PackBy::Outlines);
    let greedy = greedy::PlacingRule::ALL.map(|order| {
        greedy::place(&layout, &mut regions, &[MAX_COPIES], &[ways(Turns::Quarters)], order).len()
    });
    [greedy.into_iter().max().unwrap_or(0), lattices.len()]
}

/// Checks pixel by pixel that copies lie on the area, and no two nearer than the gap: a copy's
/// border keeps its own distance from all others.
fn check(layout: &Layout, placements: &[CopyPlacement], gap: u32) {
    let area = layout.pixels();
    let [width, height] = [area.width, area.height].map(|side| side as usize);
    let mut owner = vec![u32::MAX; width * height];
    let mut borders = Vec::new();
    for (number, at) in (0..).zip(placements) {
        let mask = layout.parts()[0].silhouette(at.turn);
        let is_white = |x: i64, y: i64| {
            let inside = 0 <= x && x < mask.width().into() && 0 <= y && y < mask.height().into();
            inside && mask.is_white(x as u32, y as u32)
        };
        for y in 0..i64::from(mask.height()) {
            for x in (0..i64::from(mask.width())).filter(|&x| is_white(x, y)) {
                let [column, row] = [at.left as usize + x as usize, at.top as usize + y as usize];
                assert!(column < width && row < height);
                assert_eq!(owner[row * width + column], u32::MAX, "two copies at {column} {row}");
                owner[row * width + column] = number;
                let around = [[-1, 0], [1, 0], [0, -1], [0, 1]];
                if around.iter().any(|[dx, dy]| !is_white(x + dx, y + dy)) {
                    borders.push((column as i64, row as i64, number));
                }
            }
        }
    }
    let reach = i64::from(gap);
    let disc = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy)));
    // From the edges of pixels to the edges of pixels.
    let between = |by: i64| (by.abs() - 1).max(0).pow(2);
    let disc: Vec<(i64, i64)> =
        disc.filter(|&(dx, dy)| between(dx) + between(dy) < reach.pow(2)).collect();
    for (column, row, number) in borders {
        for (dx, dy) in &disc {
            let [x, y] = [column + dx, row + dy];
            if 0 <= x && x < width as i64 && 0 <= y && y < height as i64 {
                let met = owner[y as usize * width + x as usize];
                assert!(met == u32::MAX || met == number, "{number} is too near {met} at {x} {y}");
            }
        }
    }
}

#[test]
fn lattices_hold_as_many_copies_as_one_after_another_or_more() {
    // Each first: one after another, on a lattice.
    let expected = [
        (Plate::Triangle, 1, [31, 46]),
        (Plate::L, 1, [34, 34]),
        (Plate::T, 1, [32, 34]),
        (Plate::U, 1, [20, 28]),
        (Plate::Crescent, 1, [97, 108]),
        (Plate::Ring, 1, [24, 25]),
        (Plate::Aerofoil, 4, [62, 68]),
    ];
    let found = expected.map(|(plate, gap, _)| (plate, gap, counts(plate, "200x230mm", gap)));
    assert_eq!(found, expected);
}

#[test]
fn right_triangles_fill_squares() {
    // Two make a square of 40 mm and a gap over the root of 2, where the legs are a gap apart:
    // three columns of 41.75 mm, in whole pixels, less the last gap.
    let layout = layout_of(Plate::Triangle.mask(0.25), 4.0, "124.5x124.5mm");
    let most = placed(&layout, 4, u32::MAX, Turns::Half);
    check(&layout, &most, 4);
    assert_eq!(most.len(), 18);
    assert!(placed(&layout, 4, u32::MAX, Turns::None).len() < 18);
    assert_eq!(placed(&layout, 4, 7, Turns::Half).len(), 7);
}

#[test]
fn lattices_have_the_least_area() {
    // An L of three cells tiles the plane with its half turn, and so does a T of four.
    for rows in [["##", "#."].as_slice(), &["###", ".#."]] {
        let mask = mask_of(rows);
        let white = mask.white_pixels() as i64;
        let layout = layout_of(mask, 1.0, "20x20mm");
        let mut regions = NoFitRegions::in_cells(&layout, 0, 1);
        let motif = Motif::new(&layout, &mut regions, 0, false, true);
        let densest = search::lattices(&motif).into_iter().map(|l| l.cells_of_two()).min();
        assert_eq!(densest, Some(2 * white));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_lattice_brings_copies_too_near(
        rows in prop::collection::vec(1u32..64, 1..9),
        (gap, width, height) in (0u32..3, 6u32..40, 9u32..40),
        turns in 0usize..3,
    ) {
        let row = |bits: &u32| -> String {
            (0..6).map(|bit| if bits >> bit & 1 == 1 { '#' } else { '.' }).collect()
        };
        let rows: Vec<String> = rows.iter().map(row).collect();
        let mask = mask_of(&rows.iter().map(String::as_str).collect::<Vec<_>>());
        let layout = layout_of(mask, 1.0, &format!("{width}x{height}mm"));
        let turns = [Turns::None, Turns::Half, Turns::Quarters][turns];
        let placed = placed(&layout, gap, u32::MAX, turns);
        check(&layout, &placed, gap);
        prop_assert!(!placed.is_empty());
        prop_assert!(turns == Turns::Quarters || placed.iter().all(|at| at.turn.quarters() % 2 == 0));
        prop_assert!(turns > Turns::None || placed.iter().all(|at| at.turn == Orientation::default()));
    }
}
