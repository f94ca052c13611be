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
        pitch_um: [100.0; 2],
        thickness_um: vec![50.0; layers.len()],
    }
}

const LIMITS: Limits = Limits {
    speck: (2, 9),
    rounding: 2,
    least_support: 0.25,
    max_overhang_um: None,
    drain_um: None,
};

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
fn a_sliver_that_began_first_joins_the_large_one() {
    let block = block(&[
        "......#", //
        ".#....#", ".#.##.#", ".####.#", ".####.#", ".######",
    ]);
    let found = islands(&block, &LIMITS);
    let told: Vec<_> = found.iter().map(|i| (i.layer, i.joins, i.floating_pixels)).collect();
    // Both have two pixels by then: the first keeps its name.
    assert_eq!(told, [(1, Some((5, None)), 10), (2, Some((3, Some(0))), 2)]);
    agree(&block, &LIMITS);
    let block = block_of(&["......#", ".#....#", ".#####.", ".######"], [1, 1, 3, 3]);
    let found = islands(&block, &LIMITS);
    assert_eq!(found.len(), 1);
    agree(&block, &LIMITS);
    let block = block_of(&["......#", ".#....#", ".#.##.#", ".####.#", ".######"], [1, 1, 3, 3, 3]);
    let told: Vec<_> = islands(&block, &LIMITS).iter().map(|i| (i.layer, i.joins)).collect();
    assert_eq!(told, [(1, Some((3, Some(1)))), (2, Some((4, None)))]);
    agree(&block, &LIMITS);
}

/// Returns a block whose layers are one row each, repeated so often.
fn block_of<const N: usize>(layers: &[&str; N], rows: [usize; N]) -> Block {
    let most = rows.into_iter().max().unwrap();
    let black = ".".repeat(layers[0].len());
    let layer = |(layer, rows): (&&str, usize)| {
        (0..most)
            .map(|row| if row < rows { *layer } else { black.as_str() })
            .collect::<Vec<_>>()
            .join(" ")
    };
    let layers: Vec<String> = layers.iter().zip(rows).map(layer).collect();
    block(&layers.iter().map(String::as_str).collect::<Vec<_>>())
}

#[test]
fn a_thin_wall_that_floats_for_long_is_no_speck() {
    for (layers, is_speck) in [(2, true), (8, true), (9, false), (40, false)] {
        let mut all = vec!["........... #.........."];
        all.extend((0..layers).map(|_| "#.......... #..########"));
        all.push("#.......... ###########");
        let block = block(&all);
        let [island] = &islands(&block, &LIMITS)[..] else { panic!("one island") };
        assert_eq!((island.floating_layers, island.is_speck), (layers, is_speck));
        agree(&block, &LIMITS);
    }
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
    let limits = Limits { rounding: 1, max_overhang_um: Some(70.0), ..LIMITS };
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
            (Kind::Trap, 3..4, 1, 1, true),
            (Kind::Cup, 3..5, 2, 1, true),
            (Kind::Sealed, 0..2, 3, 2, true),
            (Kind::Sealed, 0..1, 1, 1, true),
        ]
    );
    agree(&block, &LIMITS);
}

#[test]
fn a_bend_of_a_serpentine_is_a_cup_and_its_drain_may_be_narrow() {
    let block = block(&[
        "####### ####### #######",
        "####### #.....# #######",
        "####### #.###.# #######",
        "####### #.###.. #######",
        "####### ####### #######",
    ]);
    // From the left leg, resin would have to rise to the bridge above the two legs.
    assert_eq!(kinds(&block), [(Kind::Cup, 1..3, 7)]);
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
    assert_eq!(kinds(&block), [(Kind::Cup, 1..2, 12)]);
    assert_eq!(narrow_pockets(&block, &LIMITS, 200.0), []);
    let told: Vec<_> = narrow_pockets(&block, &LIMITS, 210.0)
        .into_iter()
        .map(|p| (p.kind, p.layers, p.pixels, p.frame.columns, p.frame.rows))
        .collect();
    assert_eq!(told, [(Kind::Trap, 2..3, 3, 2..5, 2..3)]);
    agree(&block, &LIMITS);
}

/// Returns the kind, the layers and the volume of each pocket, and checks that the code agrees.
fn kinds(block: &Block) -> Vec<(Kind, std::ops::Range<usize>, usize)> {
    agree(block, &LIMITS);
    pockets(block, &LIMITS).into_iter().map(|p| (p.kind, p.layers, p.pixels)).collect()
}

#[test]
fn a_cup_is_a_cup_whatever_is_beside_or_above_it() {
    // A box of 4 x 3 pixels in layers 1 and 2.
    let floor = "........ .######. .######. .######. .######. .######. ........";
    let walls = "........ .######. .#....#. .#....#. .#....#. .######. ........";
    let empty = "........ ........ ........ ........ ........ ........ ........";
    // A post in the corner, beside the cup.
    let post = |layer: &str| format!("{}#{}", &layer[..7], &layer[8..]);
    // A boss on the cup's floor that is as high as its rim, or higher.
    let boss = |layer: &str| format!("{}#{}", &layer[..30], &layer[31..]);
    // A drain through a wall.
    let drain = |layer: &str| format!("{}.{}", &layer[..28], &layer[29..]);
    let cup = |layers: &[String]| {
        let layers: Vec<&str> = layers.iter().map(String::as_str).collect();
        kinds(&block(&layers))
    };
    let [plain, low] = [walls, floor].map(str::to_owned);
    let of = |pixels| vec![(Kind::Cup, 1..3, pixels)];
    let both = |f: &dyn Fn(&str) -> String| vec![f(floor), f(walls), f(walls)];
    assert_eq!(cup(&[low.clone(), plain.clone(), plain.clone()]), of(24));
    assert_eq!(cup(&[low.clone(), plain.clone(), plain.clone(), empty.into()]), of(24));
    let mut beside = both(&post);
    beside.extend([post(empty), post(empty)]);
    assert_eq!(cup(&beside), of(24));
    for higher in 0..3 {
        let mut within = vec![low.clone(), boss(walls), boss(walls)];
        within.extend((0..higher).map(|_| boss(empty)));
        assert_eq!(cup(&within), of(22), "{higher}");
    }
    // It holds what is below the drain.
    assert_eq!(cup(&[low.clone(), plain.clone(), drain(walls)]), [(Kind::Cup, 1..2, 12)]);
    assert_eq!(cup(&[low.clone(), drain(walls), plain.clone()]), []);
    assert_eq!(cup(&[low.clone(), plain.clone(), low.clone()]), [(Kind::Trap, 1..2, 12)]);
    assert_eq!(
        cup(&[low.clone(), plain.clone(), low.clone(), empty.into()]),
        [(Kind::Trap, 1..2, 12)]
    );
    // Upside down the platform closes it, and a hole through the floor opens it.
    assert_eq!(cup(&[plain.clone(), plain.clone(), low.clone()]), [(Kind::Sealed, 0..2, 24)]);
    let pierced = format!("{}.{}", &floor[..30], &floor[31..]);
    for above in 0..2 {
        let mut through = vec![plain.clone(), plain.clone(), pierced.clone()];
        through.extend((0..above).map(|_| post(empty)));
        assert_eq!(cup(&through), []);
        let mut drained = vec![pierced.clone(), plain.clone(), plain.clone()];
        drained.extend((0..above).map(|_| empty.to_owned()));
        assert_eq!(cup(&drained), []);
    }
}

#[test]
fn two_basins_are_one_cup_until_one_of_them_gets_out() {
    let wall = "########### ########### ########### ###########";
    let apart = "########### #....##...# #....##...# ###########";
    let joined = "########### #.........# #.........# ###########";
    let gate = "########### #.........# #.......... ###########";
    // A wall between two basins is lower than the rim around both.
    assert_eq!(kinds(&block(&[wall, apart, joined, gate])), [(Kind::Cup, 1..3, 14 + 18)]);
    assert_eq!(kinds(&block(&[wall, apart, gate])), [(Kind::Cup, 1..2, 8), (Kind::Cup, 1..2, 6)]);
    // The left basin spills into a shaft down to the platform, whether that opens above or not.
    let shaft = "########### ######....# ######....# ###########";
    let cup = [(Kind::Cup, 1..2, 8)];
    assert_eq!(kinds(&block(&[shaft, apart, joined])), cup);
    assert_eq!(
        kinds(&block(&[shaft, apart, joined, wall])),
        [(Kind::Cup, 1..2, 8), (Kind::Sealed, 0..3, 8 + 6 + 18)]
    );
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
