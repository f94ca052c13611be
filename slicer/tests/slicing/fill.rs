//! What is inside where bodies overlap, enclose one another or are turned
//! inside out.

use lamp_fixtures::{Mesh, blade};
use lamp_slicer::{Fill, SliceOptions};
use lamp_stack::Layer;

use crate::common::{block, cube, inside_out, joined, mask, masks, options, slice, white_pixels};

/// Tenths of a millimetre, in pixels and layers.
fn filled(mesh: &Mesh, fill: Fill) -> Vec<Layer> {
    slice(mesh, &SliceOptions { fill, ..options(254.0, 100.0) })
}

fn both(mesh: &Mesh) -> [Vec<Layer>; 2] {
    [Fill::EvenOdd, Fill::NonZero].map(|fill| filled(mesh, fill))
}

/// Checks every pixel of a part that has its low corner at the origin. Tells
/// `expected` the pixel's centre in hundredths of a millimetre; planes are at
/// layers' tops.
fn assert_pixels(layers: &[Layer], side: u32, expected: impl Fn([u32; 3]) -> bool) {
    assert_eq!(layers.len() as u32, side);
    for (layer, z) in layers.iter().zip(1..) {
        for (column, row) in (0..side).flat_map(|c| (0..side).map(move |r| (c, r))) {
            let centre = [10 * column + 5, 10 * (side - row) - 5, 10 * z];
            let white = mask(layer).is_white(column + 1, row + 1);
            assert_eq!(white, expected(centre), "{centre:?} in hundredths of a millimetre");
        }
    }
}

/// Whether a place is in a cube; its top is, its bottom is not.
fn within([x, y, z]: [u32; 3], low: u32, high: u32) -> bool {
    [x, y].iter().all(|v| (low..high).contains(v)) && low < z && z <= high
}

#[test]
fn cubes_that_overlap_are_one_body_or_none_where_they_do() {
    let [even_odd, non_zero] = both(&joined(&[cube(0.0, 2.0), cube(1.0, 3.0)]));
    let (first, second) = (|p| within(p, 0, 200), |p| within(p, 100, 300));
    assert_pixels(&even_odd, 30, |p| first(p) != second(p));
    assert_pixels(&non_zero, 30, |p| first(p) || second(p));
}

#[test]
fn a_cube_in_a_cube_is_a_hole_or_nothing_new() {
    let outer = cube(0.0, 3.0);
    let [even_odd, non_zero] = both(&joined(&[outer.clone(), cube(1.0, 2.0)]));
    assert_pixels(&even_odd, 30, |p| !within(p, 100, 200));
    assert_pixels(&non_zero, 30, |_| true);
    assert_eq!(masks(&non_zero), masks(&filled(&outer, Fill::NonZero)));
}

#[test]
fn an_inside_out_cube_in_a_cube_is_a_cavity() {
    for layers in both(&joined(&[cube(0.0, 3.0), inside_out(&cube(1.0, 2.0))])) {
        assert_pixels(&layers, 30, |p| !within(p, 100, 200));
    }
}

#[test]
fn the_same_body_twice_is_nothing_or_itself() {
    let once = cube(0.0, 3.0);
    let [even_odd, non_zero] = both(&joined(&[once.clone(), once.clone()]));
    assert_pixels(&even_odd, 30, |_| false);
    assert_eq!(masks(&non_zero), masks(&filled(&once, Fill::NonZero)));
}

#[test]
fn a_part_inside_out_is_the_same_part() {
    let part = joined(&[cube(0.0, 2.0), cube(1.0, 3.0), block([0.0; 3], [3.0, 1.0, 0.5])]);
    let [even_odd, non_zero] = both(&part);
    let [even_odd_out, non_zero_out] = both(&inside_out(&part));
    assert_eq!(masks(&even_odd), masks(&even_odd_out));
    assert_eq!(masks(&non_zero), masks(&non_zero_out));
    assert_ne!(masks(&even_odd), masks(&non_zero));
}

#[test]
fn a_blade_has_no_overlaps_so_both_fills_agree() {
    let mesh = blade(24_000);
    let [even_odd, non_zero] = [Fill::EvenOdd, Fill::NonZero]
        .map(|fill| slice(&mesh, &SliceOptions { fill, ..options(100.0, 1000.0) }));
    assert!(even_odd.iter().all(|layer| layer.info.stray_rows.is_empty()));
    assert!(even_odd == non_zero);
    // Within 1 % of the volume, and with walls to disagree about.
    let counted_mm3 = white_pixels(&even_odd) as f64 * 0.254f64.powi(2);
    assert!((counted_mm3 / mesh.volume_mm3() - 1.0).abs() < 0.01, "{counted_mm3}");
    let most = even_odd.iter().flat_map(|l| mask(l).rows()).map(<[u32]>::len).max();
    assert!(most >= Some(8), "{most:?}");
}
