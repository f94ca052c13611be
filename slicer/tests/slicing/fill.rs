//! What is inside where bodies overlap, enclose one another or are turned
//! inside out.

use lamp_fixtures::{Mesh, blade, sphere};
use lamp_slicing::{Fill, Join, Part, Placement, PlaneRule, SliceOptions, Slices};
use lamp_stack::Layer;

use super::common::{
    block, cube, inside_out, joined, mask, masks, model, options, slice, white_pixels,
};

/// Tenths of a millimetre, in pixels and layers.
fn filled(mesh: &Mesh, fill: Fill) -> Vec<Layer> {
    slice(mesh, &SliceOptions { fill, ..options(254.0, 100.0) })
}

fn both(mesh: &Mesh) -> [Vec<Layer>; 2] {
    [Fill::EvenOdd, Fill::Solid].map(|fill| filled(mesh, fill))
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
    assert_eq!(masks(&non_zero), masks(&filled(&outer, Fill::Solid)));
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
    assert_eq!(masks(&non_zero), masks(&filled(&once, Fill::Solid)));
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
    let [even_odd, non_zero] = [Fill::EvenOdd, Fill::Solid]
        .map(|fill| slice(&mesh, &SliceOptions { fill, ..options(100.0, 1000.0) }));
    assert!(even_odd.iter().all(|layer| layer.info.stray_rows.is_empty()));
    assert!(even_odd == non_zero);
    // Within 1 % of the volume, and with walls to disagree about.
    let counted_mm3 = white_pixels(&even_odd) as f64 * 0.254f64.powi(2);
    assert!((counted_mm3 / mesh.volume_mm3() - 1.0).abs() < 0.01, "{counted_mm3}");
    let most = even_odd.iter().flat_map(|l| mask(l).rows()).map(<[u32]>::len).max();
    assert!(most >= Some(8), "{most:?}");
}

/// Two balls that overlap, and one within the first: every pixel against
/// the balls' equations, except where a facet's chord leaves it open.
#[test]
fn balls_that_overlap_are_their_union() {
    // Inscribed: no facet is farther inside its sphere than this.
    const CHORD_MM: f64 = 0.002;
    let balls = [([0.0, 0.0, 2.0], 2.0), ([1.3, 0.9, 2.4], 1.5), ([-0.4, 0.2, 1.7], 0.9)];
    let bodies = balls.map(|(centre, radius): ([f64; 3], f64)| {
        let ball = sphere(radius, 30_000);
        ball.map(|[x, y, z]| [x + centre[0], y + centre[1], z - radius + centre[2]])
    });
    let mesh = joined(&bodies);
    let options = SliceOptions { fill: Fill::Solid, ..options(200.0, 100.0) };
    let grid = *Slices::new(model(&mesh), &options).unwrap().grid();
    let bottom_mm = mesh.bounds_mm().0[2];
    let (mut white, mut open) = (0, 0);
    for (layer, k) in slice(&mesh, &options).iter().zip(1..) {
        let z = bottom_mm + 0.1 * f64::from(k);
        for (column, row) in (0..grid.width).flat_map(|c| (0..grid.height).map(move |r| (c, r))) {
            let [x, y] = grid.to_mm(column.into(), row.into());
            let inside = |less_mm: f64| {
                balls.iter().any(|(centre, radius)| {
                    let squares = [x - centre[0], y - centre[1], z - centre[2]].map(|d| d * d);
                    squares.iter().sum::<f64>().sqrt() < radius - less_mm
                })
            };
            let is_white = mask(layer).is_white(column, row);
            assert!(is_white <= inside(-1e-5) && is_white >= inside(CHORD_MM), "{x} {y} {z}");
            white += u32::from(is_white);
            open += u32::from(inside(-1e-5) != inside(CHORD_MM));
        }
    }
    assert!(white > 20_000 && open * 100 < white, "{open} of {white} are open");
}

/// Bodies in one another, by their ways round: the winding number counts.
#[test]
fn three_bodies_in_one_another_wind_as_they_face() {
    let [outer, middle, inner] = [cube(0.0, 3.0), cube(0.5, 2.5), cube(1.0, 2.0)];
    let (in_middle, in_inner) = (|p| within(p, 50, 250), |p| within(p, 100, 200));
    for ways in 0..4 {
        let turned_if = |mesh: &Mesh, turned| if turned { inside_out(mesh) } else { mesh.clone() };
        let (middle_turned, inner_turned) = (ways & 1 == 1, ways & 2 == 2);
        let mesh = joined(&[
            outer.clone(),
            turned_if(&middle, middle_turned),
            turned_if(&inner, inner_turned),
        ]);
        let way = |turned: bool| if turned { -1 } else { 1 };
        let winding = |p| {
            1 + if in_middle(p) { way(middle_turned) } else { 0 }
                + if in_inner(p) { way(inner_turned) } else { 0 }
        };
        for mirrored in [false, true] {
            // About the middle, so that the expected pixels stay.
            let scale = if mirrored { [-1.0, 1.0, 1.0] } else { [1.0; 3] };
            let placement = Placement::default()
                .translated([-1.5, 0.0, 0.0])
                .scaled(scale)
                .translated([1.5, 0.0, 0.0]);
            let [even_odd, non_zero] = [Fill::EvenOdd, Fill::Solid].map(|fill| {
                slice(&mesh, &SliceOptions { fill, placement, ..options(254.0, 100.0) })
            });
            assert_pixels(&even_odd, 30, |p| !in_middle(p) || in_inner(p));
            assert_pixels(&non_zero, 30, |p| winding(p) != 0);
            let closed =
                |layer: &Layer| layer.info.closed == Some(true) && layer.info.stray_rows.is_empty();
            assert!(even_odd.iter().chain(&non_zero).all(closed));
        }
    }
}

#[test]
fn mirrored_bodies_that_overlap_are_their_mirrored_union() {
    let bodies = [cube(0.0, 2.0), inside_out(&cube(1.0, 3.0))];
    for axes in 0..8 {
        let scale = [0, 1, 2].map(|axis| if axes >> axis & 1 == 1 { -1.0 } else { 1.0 });
        let back = scale.map(|factor: f64| if factor < 0.0 { 3.0 } else { 0.0 });
        let placement = Placement::default().scaled(scale).translated(back);
        let of = |mesh: &Mesh, fill| {
            slice(mesh, &SliceOptions { fill, placement, ..options(254.0, 100.0) })
        };
        // Where the axis is mirrored, the low end is the high end.
        let side = |axis: usize, v: u32, low: u32, high: u32| {
            let v = if scale[axis] < 0.0 { 300 - v } else { v };
            let tie_is_in = axis == 2 && scale[axis] > 0.0;
            if tie_is_in { low < v && v <= high } else { low <= v && v < high }
        };
        let is_in = |p: [u32; 3], low, high| (0..3).all(|axis| side(axis, p[axis], low, high));
        let (first, second) = (|p| is_in(p, 0, 200), |p| is_in(p, 100, 300));
        // One faces inwards: where they overlap they cancel.
        assert_pixels(&of(&joined(&bodies), Fill::Solid), 30, |p| first(p) != second(p));
        let facing = [bodies[0].clone(), inside_out(&bodies[1])];
        assert_pixels(&of(&joined(&facing), Fill::Solid), 30, |p| first(p) || second(p));
    }
}

/// Joins parts, each in its way, and slices them in tenths of a millimeter.
fn joined_by(parts: &[(&Mesh, Join)], fill: Fill) -> Vec<Layer> {
    let parts = parts.iter().map(|&(mesh, join)| model(mesh).with_join(join));
    let options = SliceOptions { fill, ..options(254.0, 100.0) };
    Slices::new(Part::joined(parts.collect()), &options).unwrap().map(Result::unwrap).collect()
}

#[test]
fn files_unite_and_cut_each_other_when_asked() {
    let (large, small) = (cube(0.0, 3.0), cube(1.0, 2.0));
    let beside = block([2.5, 1.0, 1.0], [9.0, 2.0, 4.0]);
    let held = |place: [u32; 3]| within(place, 0, 300);
    let core = |place: [u32; 3]| within(place, 100, 200);
    let in_beside = |[x, y, z]: [u32; 3]| x >= 250 && (100..200).contains(&y) && z > 100;
    let unite = (&large, Join::Unite);
    assert_pixels(&joined_by(&[unite, (&small, Join::Unite)], Fill::Solid), 30, held);
    for fill in [Fill::Solid, Fill::EvenOdd] {
        let cut = joined_by(&[unite, (&small, Join::Subtract)], fill);
        assert_pixels(&cut, 30, |place| held(place) && !core(place));
        // A cutter may reach out of the part, whose box and layers it does not change.
        let cut = joined_by(&[(&beside, Join::Subtract), unite], fill);
        assert_pixels(&cut, 30, |place| held(place) && !in_beside(place));
        let kept = joined_by(&[unite, (&small, Join::Intersect)], fill);
        assert_pixels(&kept, 30, core);
        let all = [unite, (&beside, Join::Intersect), (&small, Join::Intersect)];
        assert_pixels(&joined_by(&all, fill), 30, |_| false);
    }
}

/// What is known of a part's windings after all layers.
fn doubts(mesh: &Mesh) -> [f64; 3] {
    let mut slices = Slices::new(model(mesh), &options(254.0, 100.0)).unwrap();
    slices.by_ref().for_each(|layer| drop(layer.unwrap()));
    let doubts = slices.fill_doubts();
    let sum = |of: fn(&lamp_slicing::FillDoubt) -> f64| doubts.iter().map(of).sum::<f64>();
    [sum(|it| it.unsigned_rows as f64), sum(|it| it.repeated_mm3), sum(|it| it.inward_mm3)]
}

#[test]
fn shells_that_contradict_each_other_are_reported() {
    let near = |found: [f64; 3], expected: [f64; 3]| {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
    };
    let (large, small) = (cube(0.0, 3.0), cube(1.0, 2.0));
    near(doubts(&large), [0.0; 3]);
    near(doubts(&joined(&[large.clone(), inside_out(&small)])), [0.0; 3]);
    // A body in a body, or a void the wrong way round.
    near(doubts(&joined(&[large.clone(), small.clone()])), [0.0, 1.0, 0.0]);
    near(doubts(&joined(&[large.clone(), large.clone()])), [0.0, 27.0, 0.0]);
    near(doubts(&inside_out(&large)), [0.0, 0.0, 27.0]);
    // Shells that touch share nothing.
    let beside = block([3.0, 0.0, 0.0], [5.0, 3.0, 3.0]);
    near(doubts(&joined(&[large.clone(), beside])), [0.0; 3]);
    // The facets of its left wall are turned over: 30 rows in each of 30 layers.
    let mut turned = large;
    for facet in &mut turned.facets {
        if facet.iter().all(|corner| corner[0] == 0.0) {
            facet.swap(1, 2);
        }
    }
    near(doubts(&turned), [900.0, 0.0, 0.0]);
    assert_pixels(&filled(&turned, Fill::Solid), 30, |_| true);
}

/// A body that ends within a layer has the layers that it has alone: its height is rounded to whole
/// layers, and its last section is at its own top.
#[test]
fn bodies_have_the_layers_that_they_have_alone() {
    for (height, expected) in [(1.06f32, 11), (1.04, 10), (0.3, 3), (0.02, 1), (2.0, 20)] {
        for plane in [PlaneRule::Top, PlaneRule::Middle, PlaneRule::Bottom] {
            let low = block([0.0; 3], [1.0, 1.0, height]);
            let high = block([2.0, 0.0, 0.0], [3.0, 1.0, 2.0]);
            let options = SliceOptions { plane, ..options(254.0, 100.0) };
            let white = |mesh: &Mesh| slice(mesh, &options).len();
            assert_eq!(white(&low), expected, "{height} mm alone");
            let both = Part::joined(vec![model(&low), model(&high)]);
            let layers: Vec<Layer> =
                Slices::new(both, &options).unwrap().map(Result::unwrap).collect();
            let pixels: Vec<u64> = layers.iter().map(|layer| mask(layer).white_pixels()).collect();
            let full = pixels.iter().filter(|&&pixels| pixels == 200).count();
            assert_eq!((full, pixels.len()), (expected, 20), "{height} mm at {plane:?}");
            assert!(pixels[full..].iter().all(|&pixels| pixels == 100));
        }
    }
}
