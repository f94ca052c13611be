//! Drawn blocks, counted by hand, and checked.

use super::agree::agree;
use super::referee::*;

/// Reads layers from the bottom, each a picture of rows: `#` is white.
pub(crate) fn block(layers: &[&str]) -> Block {
    let rows: Vec<Vec<&str>> =
        layers.iter().map(|layer| layer.split_whitespace().collect()).collect();
    let white = layers.iter().flat_map(|layer| layer.chars().filter(|c| !c.is_whitespace()));
    Block {
        size: [rows[0][0].len(), rows[0].len(), layers.len()],
        white: white.map(|c| c == '#').collect(),
        pitch_um: 100.0,
        thickness_um: vec![50.0; layers.len()],
    }
}

const LIMITS: Limits =
    Limits { speck: 2, least_support: 0.25, max_overhang_um: None, drain_um: None };

#[test]
fn islands_join_elders_first() {
    // One island at each end; the right one is born later, and they join the part at last.
    let block = block(&[
        "....#.... .........",
        "##..#.... ##.......",
        "##..#..## ##.....##",
        "##..##### ##.....##",
        "######### ##.....##",
    ]);
    let found = islands(&block, &LIMITS);
    let [left, right] = &found[..] else { panic!("{found:?}") };
    assert_eq!((left.layer, left.area, left.centroid), (1, 4, [1.0, 1.0]));
    assert_eq!((left.joins, left.floating_pixels), (Some((4, None)), 12));
    assert_eq!((right.layer, right.joins, right.floating_pixels), (2, Some((3, None)), 4));
    assert_eq!((right.first, right.is_speck), ([7, 0], false));
    assert!((left.floating_mm3 - 12.0 * 0.1 * 0.1 * 0.05).abs() < 1e-12);
    agree(&block, &LIMITS);
}

#[test]
fn islands_that_join_first_are_one_and_the_elder_keeps_its_name() {
    let block = block(&[
        "#........", //
        "#....#...",
        "#.#..#...",
        "#.####.#.",
        "#.####.##",
        "########.",
    ]);
    let found = islands(&block, &LIMITS);
    let told: Vec<_> = found
        .iter()
        .map(|i| (i.layer, i.joins, i.floating_pixels, i.largest_area, i.largest_layer))
        .collect();
    assert_eq!(
        told,
        [
            // At layer 3 it takes the other in: 1 + 1 + 4 + 4.
            (1, Some((5, None)), 10, 4, 3),
            (2, Some((3, Some(0))), 1, 1, 2),
            (3, Some((5, None)), 3, 2, 4),
        ]
    );
    assert!(found.iter().all(|island| island.is_speck));
    agree(&block, &LIMITS);
}

#[test]
fn what_meets_by_a_corner_only_does_not_join() {
    let block = block(&["#... ....", ".#.. ....", "..## ..#."]);
    let found = islands(&block, &LIMITS);
    let told: Vec<_> = found.iter().map(|i| (i.layer, i.area, i.joins)).collect();
    assert_eq!(told, [(1, 1, None), (2, 3, None)]);
    agree(&block, &LIMITS);
}

#[test]
fn joints_are_weak_below_a_fourth() {
    let block = block(&[".#...#", "######", "......", "######", "#.####"]);
    assert_eq!(weak_joints(&block, &LIMITS), []);
    let quarter = Limits { least_support: 0.34, ..LIMITS };
    let joints = weak_joints(&block, &quarter);
    let told: Vec<_> = joints.iter().map(|j| (j.layer, j.area, j.support, j.is_speck)).collect();
    assert_eq!(told, [(1, 6, 2, true)]);
    agree(&block, &LIMITS);
}

#[test]
fn overhangs_are_measured_by_euclid_and_gathered() {
    let block = block(&[
        "##.... ##.... ......",
        "##.... ###... .##...",
        "##.... ####.. .####.",
        "##.... ####.. .####.",
    ]);
    let limits = Limits { max_overhang_um: Some(120.0), ..LIMITS };
    let found = patches(&block, &limits);
    let told: Vec<_> = found.iter().map(|p| (p.layer, p.area, p.reach_um)).collect();
    // The pixel one across and one down is 141 um off; in the layer above, one is 200 um off.
    assert_eq!(told, [(1, 1, 2.0f64.sqrt() * 100.0), (2, 1, 200.0)]);
    assert_eq!(overhangs(&block, &limits), []);
    let limits = Limits { speck: 1, max_overhang_um: Some(70.0), ..LIMITS };
    let found = overhangs(&block, &limits);
    let told: Vec<_> =
        found.iter().map(|o| (o.layers.clone(), o.area, o.reach_um, o.reach_layer)).collect();
    assert_eq!(told, [(1..3, 6, 200.0, 2)]);
    agree(&block, &LIMITS);
}

#[test]
fn pockets_are_told_apart_by_where_they_end() {
    let block = block(&[
        "####### #..#.## #######",
        "####### #.##### #######",
        "####### ####### #######",
        "####### #.##.## #######",
        "####### ####.## #######",
    ]);
    let told: Vec<_> = pockets(&block, &LIMITS)
        .into_iter()
        .map(|p| (p.kind, p.layers, p.pixels, p.largest_area, p.is_speck))
        .collect();
    assert_eq!(
        told,
        [
            (Kind::Sealed, 0..2, 3, 2, true),
            (Kind::Sealed, 0..1, 1, 1, true),
            (Kind::Trap, 3..4, 1, 1, true),
            (Kind::Cup, 3..5, 2, 1, true),
        ]
    );
    agree(&block, &LIMITS);
}

#[test]
fn a_serpentine_with_one_opening_drains_until_drains_must_be_wide() {
    let block = block(&[
        "####### ####### #######",
        "####### #.....# #######",
        "####### #.###.# #######",
        "####### #.###.. #######",
        "####### ####### #######",
    ]);
    assert_eq!(pockets(&block, &LIMITS), []);
    // White is 100 um or more from all black pixels of the channel.
    assert_eq!(narrow_pockets(&block, &LIMITS, 100.0), []);
    agree(&block, &LIMITS);
}

#[test]
fn a_hall_behind_a_narrow_drain_is_a_pocket_of_the_wide_black() {
    let wall = "####### ####### ####### ####### #######";
    let hall = "####### #....## #....## #....## #######";
    let drain = "####### #....## #...... #....## #######";
    let mut block = block(&[wall, hall, drain, hall, wall]);
    block.thickness_um = vec![100.0; 5];
    assert_eq!(pockets(&block, &LIMITS), []);
    assert_eq!(narrow_pockets(&block, &LIMITS, 200.0), []);
    let told: Vec<_> = narrow_pockets(&block, &LIMITS, 210.0)
        .into_iter()
        .map(|p| (p.kind, p.layers, p.pixels, p.frame.columns, p.frame.rows))
        .collect();
    assert_eq!(told, [(Kind::Trap, 2..3, 3, 2..5, 2..3)]);
    agree(&block, &LIMITS);
}

#[test]
fn a_body_leans_when_its_centre_passes_its_base() {
    let block = block(&["#.....", "##....", ".####.", "....##"]);
    let [tilt] = &tilts(&block)[..] else { panic!() };
    assert_eq!((tilt.base.clone(), tilt.layer), (Frame { columns: 0..1, rows: 0..1 }, 2));
    // All 9 pixels: columns 0; 0, 1; 1, 2, 3, 4; 4, 5.
    assert!((tilt.farthest_um - 100.0 * (20.0 / 9.0 + 0.5 - 1.0)).abs() < 1e-9);
    agree(&block, &LIMITS);
}

#[test]
fn empty_and_border_layers_come_in_runs() {
    let block = block(&["... .#. ...", "... ... ...", "... ... ...", "#.. ... ...", ".#. ... ..."]);
    let runs = |layers: Vec<std::ops::Range<usize>>| format!("{layers:?}");
    assert_eq!(runs(empty_layers(&block)), "[1..3]");
    assert_eq!(runs(border_layers(&block)), "[3..5]");
    agree(&block, &LIMITS);
}

/// Others call this an island, though a post holds it.
#[test]
fn what_a_post_holds_is_a_weak_joint_and_no_island() {
    let block = block(&["...#... .......", "...#... .......", "####### #######"]);
    assert_eq!(islands(&block, &LIMITS), []);
    let joints = weak_joints(&block, &LIMITS);
    assert_eq!(joints.iter().map(|j| (j.layer, j.support)).collect::<Vec<_>>(), [(2, 1)]);
    agree(&block, &LIMITS);
}

#[test]
fn a_support_that_ends_a_layer_below_holds_nothing() {
    let block = block(&[
        "#..#..# ....... .......",
        "#..#..# ....... .......",
        "#.....# ....... .......",
        "#.###.# ..###.. .......",
        "####### ####### #######",
    ]);
    let found = islands(&block, &LIMITS);
    let told: Vec<_> = found.iter().map(|i| (i.layer, i.joins, i.is_speck)).collect();
    assert_eq!(told, [(3, Some((4, None)), false)]);
    agree(&block, &LIMITS);
}
