//! Parts whose islands, pockets and overhangs are known.

use lamp_fixtures::{
    Mesh, arch, cavity_core, closed_void, cup, lying_rod, mug, needle, ring, serpentine,
    slanted_wall, twin_islands,
};
use lamp_slicing::{Axis, Part, Placement, SliceOptions, Slices};
use lamp_stack::{Image, Layer, Length, Mask, PageInfo, Pitch};
use lamp_supports::{Findings, HeldAt, IslandEnd, PocketKind};

use super::agree::{agree_as, check};
use super::referee::{Block, Limits};

const LIMITS: Limits = Limits {
    speck: (3, 10),
    rounding: 3,
    least_support: 0.25,
    max_overhang_um: None,
    drain_um: None,
};

/// A tenth of a millimeter.
const FINE_DPI: f64 = 254.0;

fn slice(mesh: Mesh, dpi: f64, thickness_um: f64, placement: Placement) -> Vec<Layer> {
    let options = SliceOptions {
        pitch: Pitch::of_dpi(dpi).unwrap(),
        thickness: Length::from_um(thickness_um),
        placement,
        ..SliceOptions::default()
    };
    let part = Part::from_facets("part", mesh.facets);
    Slices::new(part, &options).unwrap().map(Result::unwrap).collect()
}

/// Returns the voxels of masks.
pub(crate) fn block(layers: &[Layer]) -> Block {
    let mut block = Block {
        size: [0, 0, layers.len()],
        white: Vec::new(),
        pitch_um: layers[0].pitch.unwrap().um(),
        thickness_um: layers.iter().map(|layer| layer.info.thickness_um.unwrap()).collect(),
    };
    for layer in layers {
        let Image::Mask(mask) = &*layer.image else { panic!("sections are masks") };
        (block.size[0], block.size[1]) = (mask.width() as usize, mask.height() as usize);
        for row in 0..mask.height() {
            block.white.extend((0..mask.width()).map(|column| mask.is_white(column, row)));
        }
    }
    block
}

fn upright() -> Placement {
    Placement::default()
}

fn upside_down() -> Placement {
    Placement::default().rotated(Axis::X, 180.0)
}

/// Checks a part at 254 dpi and 100 um, where the numbers that its text names are exact.
fn finely(mesh: Mesh, placement: Placement) -> Findings {
    check(slice(mesh, FINE_DPI, 100.0, placement), &LIMITS)
}

/// Returns the layer of birth, area then, end and floating volume in mm³ of each island.
fn islands(found: &Findings) -> Vec<(u32, u64, IslandEnd, f64)> {
    let island = |island: &lamp_supports::Island| {
        (island.layer, island.area, island.end, island.floating_pixels_um * 1e-5)
    };
    found.islands.list.iter().map(island).collect()
}

fn pockets(found: &Findings) -> Vec<(PocketKind, [u32; 2], f64)> {
    let pocket =
        |pocket: &lamp_supports::Pocket| (pocket.kind, pocket.layers, pocket.pixels_um * 1e-5);
    found.pockets.list.iter().map(pocket).collect()
}

fn near(value: f64, expected: f64, share: f64) {
    assert!((value / expected - 1.0).abs() <= share, "{value} {expected}");
}

#[test]
fn parts_agree_with_flooded_voxels_at_100_dpi() {
    let parts: [fn() -> Mesh; 11] = [
        || mug(2000),
        || cavity_core(1000),
        || needle(1000),
        || lying_rod(2000),
        || ring(1000),
        || arch(1000),
        || serpentine(1000),
        || cup(1000),
        || closed_void(1000),
        || slanted_wall(0.5, 1.0, 1000),
        || twin_islands(1000),
    ];
    for part in parts {
        for placement in [upright(), upside_down()] {
            let layers = slice(part(), 100.0, 250.0, placement);
            agree_as(layers.clone(), &block(&layers), &LIMITS);
        }
    }
}

#[test]
fn a_mug_has_a_floating_handle_and_a_cup() {
    let found = finely(mug(20_000), upright());
    let [(80, 900, IslandEnd::JoinsPart { layer: 140 }, floating_mm3)] = islands(&found)[..] else {
        panic!("{:?}", found.islands)
    };
    near(floating_mm3, 54.0, 1e-12);
    let [(PocketKind::Cup, [20, 299], mm3)] = pockets(&found)[..] else {
        panic!("{:?}", found.pockets)
    };
    near(mm3, 28.0 * 64.0 * std::f64::consts::PI, 5e-3);
}

#[test]
fn cores_float_in_a_cavity_that_drains() {
    let found = finely(cavity_core(1000), upright());
    let joins = IslandEnd::JoinsPart { layer: 280 };
    let [(80, 6000, first, larger_mm3), (120, 2400, second, smaller_mm3)] = islands(&found)[..]
    else {
        panic!("{:?}", found.islands)
    };
    assert_eq!([first, second], [joins; 2]);
    near(larger_mm3, 1200.0, 1e-12);
    near(smaller_mm3, 384.0, 1e-12);
    assert_eq!(pockets(&found), []);
}

/// Others drop what begins as small as this.
#[test]
fn a_needle_is_an_island_from_its_first_four_pixels() {
    let found = finely(needle(1000), upright());
    let [(102, 4, IslandEnd::JoinsPart { layer: 200 }, floating_mm3)] = islands(&found)[..] else {
        panic!("{:?}", found.islands)
    };
    near(floating_mm3, 160.0 / 3.0, 0.02);
    assert_eq!(found.specks.count(), 0);
}

#[test]
fn a_rod_floats_from_its_lowest_line() {
    let found = finely(lying_rod(20_000), upright());
    let [(100, 1440, IslandEnd::JoinsPart { layer: 200 }, floating_mm3)] = islands(&found)[..]
    else {
        panic!("{:?}", found.islands)
    };
    near(floating_mm3, 48.0 * std::f64::consts::PI + 24.0, 5e-3);
}

#[test]
fn a_ring_is_an_island_around_its_centroid() {
    let layers = slice(ring(1000), FINE_DPI, 100.0, upright());
    let found = check(layers.clone(), &LIMITS);
    let [(100, 15_600, IslandEnd::JoinsPart { layer: 200 }, floating_mm3)] = islands(&found)[..]
    else {
        panic!("{:?}", found.islands)
    };
    near(floating_mm3, 408.0, 1e-12);
    let [column, row] = found.islands.list[0].centroid;
    let [left, top] = found.origin_mm.unwrap();
    assert!((left + 0.1 * column).abs() < 1e-9 && (top - 0.1 * row).abs() < 1e-9);
    let Image::Mask(mask) = &*layers[100].image else { panic!("sections are masks") };
    assert!(!mask.is_white(column as u32, row as u32));
}

#[test]
fn twin_islands_join_each_other_before_the_part() {
    let found = finely(twin_islands(1000), upright());
    let [(80, 400, elder, elder_mm3), (100, 400, younger, younger_mm3)] = islands(&found)[..]
    else {
        panic!("{:?}", found.islands)
    };
    assert_eq!(elder, IslandEnd::JoinsPart { layer: 200 });
    assert_eq!(younger, IslandEnd::JoinsIsland { layer: 140, number: 1 });
    near(elder_mm3, 88.0, 1e-12);
    near(younger_mm3, 16.0, 1e-12);
}

#[test]
fn an_arch_hangs_over_by_half_its_span() {
    let found = finely(arch(1000), upright());
    assert_eq!(islands(&found), []);
    let [overhang] = &found.overhangs.list[..] else { panic!("{:?}", found.overhangs) };
    // The pixels next to the piers are as far from them as the layer is thick.
    assert_eq!((overhang.layers, overhang.area), ([160; 2], 198 * 80));
    assert_eq!((overhang.reach_pixels(), overhang.reach_layer), (100.0, 160));
    assert_eq!((overhang.held_at(), overhang.span_pixels), (HeldAt::BothSides, Some(200.0)));
}

/// One pass up the layers and one down, as others make, call it a trap.
#[test]
fn a_serpentine_holds_what_its_bends_hold() {
    // Two bends open to the next leg at their top, 16 mm above their floor.
    let bends = |placement| pockets(&finely(serpentine(1000), placement));
    let bend = |layers, mm3| (PocketKind::Cup, layers, mm3);
    assert_eq!(bends(upright()), [bend([20, 179], 136.0); 2]);
    // Upside down the last leg is a dead end.
    let [leg, a, b] = [64.0, 136.0, 136.0].map(|mm3| bend([40, 199], mm3));
    assert_eq!(bends(upside_down()), [a, b, leg]);
    // Lying, it is level: all of it opens upward, or downward to the platform.
    for (degrees, kind) in [(90.0, PocketKind::Cup), (-90.0, PocketKind::Sealed)] {
        let found = finely(serpentine(1000), upright().rotated(Axis::Y, degrees));
        let [(found, _, mm3)] = pockets(&found)[..] else { panic!("{:?}", found.pockets) };
        assert_eq!(found, kind);
        near(mm3, 400.0, 1e-12);
    }
}

#[test]
fn a_cup_is_sealed_by_the_platform_upside_down() {
    let [(PocketKind::Cup, [20, 119], mm3)] = pockets(&finely(cup(1000), upright()))[..] else {
        panic!("not a cup")
    };
    near(mm3, 960.0, 1e-12);
    let found = finely(cup(1000), upside_down());
    let [(PocketKind::Sealed, [0, 99], mm3)] = pockets(&found)[..] else {
        panic!("{:?}", found.pockets)
    };
    near(mm3, 960.0, 1e-12);
    let [overhang] = &found.overhangs.list[..] else { panic!("{:?}", found.overhangs) };
    assert_eq!((overhang.layers, overhang.area), ([100; 2], 118 * 78));
    assert_eq!((overhang.reach_pixels(), overhang.span_pixels), (40.0, Some(80.0)));
}

#[test]
fn a_closed_void_is_a_trap() {
    let [(PocketKind::Trap, [30, 89], mm3)] = pockets(&finely(closed_void(1000), upright()))[..]
    else {
        panic!("not a trap")
    };
    near(mm3, 576.0, 1e-12);
}

#[test]
fn walls_lean_until_they_hardly_rest_and_then_float() {
    let leaning = |lean: f64| finely(slanted_wall(0.5, lean, 1000), upright());
    let counts = |found: &Findings| {
        [found.islands.count(), found.weak_joints.count(), found.overhangs.count()]
    };
    // A layer reaches 0.1 mm beyond the one below, as far as it is thick.
    assert_eq!(counts(&leaning(1.0)), [0, 0, 0]);
    let found = leaning(4.0);
    assert_eq!(counts(&found), [0, 199, 1]);
    let [overhang] = &found.overhangs.list[..] else { panic!("{:?}", found.overhangs) };
    assert_eq!((overhang.layers, overhang.reach_pixels()), ([1, 199], 4.0));
    assert_eq!(overhang.held_at(), HeldAt::OneSide);
    assert!(found.weak_joints.list.iter().all(|joint| 5 * joint.support == joint.area));
    assert_eq!(counts(&leaning(6.0)), [199, 0, 0]);
}

#[test]
fn the_widest_images_are_checked() {
    let layer = |index, transitions: &[u32]| {
        let rows = (0..=3).map(|row| row * transitions.len() as u32).collect();
        let image = Mask::new(u32::MAX, rows, transitions.repeat(3)).unwrap().into();
        let info = PageInfo { index, thickness_um: Some(100.0), ..PageInfo::default() };
        Layer { info, pitch: Pitch::of_dpi(1500.0), image }
    };
    let layers = vec![layer(0, &[0, 9]), layer(1, &[0, 9, u32::MAX - 3]), layer(2, &[0])];
    let found = check(layers, &LIMITS);
    assert_eq!(islands(&found)[0].0, 1);
    assert_eq!(found.overhangs.list[0].area, 3 * (u64::from(u32::MAX) - 12) - 30);
}

#[test]
fn a_gate_drains_a_cavity_if_it_is_as_wide_as_asked() {
    let layers = slice(cavity_core(1000), 100.0, 250.0, upright());
    let with_drain = |drain_um| {
        let found = check(layers.clone(), &Limits { drain_um: Some(drain_um), ..LIMITS });
        found.pockets.list.iter().map(|pocket| pocket.kind).collect::<Vec<_>>()
    };
    assert_eq!(with_drain(1000.0), []);
    assert_eq!(with_drain(3000.0), [PocketKind::Narrow]);
}
