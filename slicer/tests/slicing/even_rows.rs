//! A closed mesh is crossed an even number of times in every row of every
//! layer, whatever the rounding; a hole in it shows.

use std::f64::consts::FRAC_PI_2;

use lamp_fixtures::{Defect, Mesh, blade, cone, cube_with_hole, inject, sphere, torus, tower};
use lamp_slicing::{
    Axis, Facet, Fill, GridRule, PixelGrid, Placement, PlaneRule, SliceOptions, Slices,
};
use lamp_stack::Layer;
use proptest::prelude::*;

use super::common::{
    block, cases, joined, mask, masks, model, options, slice, turned, white_pixels,
};

/// The first row that breaks the theorem: its layer and number.
fn odd_row(layers: &[Layer]) -> Option<(u32, usize)> {
    layers.iter().find_map(|layer| {
        let odd = mask(layer).rows().position(|row| row.len() % 2 == 1);
        let stray = layer.info.stray_rows.first().map(|&row| row as usize);
        odd.or(stray).map(|row| (layer.info.index, row))
    })
}

fn with_fills(options: &SliceOptions) -> [SliceOptions; 2] {
    [Fill::EvenOdd, Fill::Solid].map(|fill| SliceOptions { fill, ..options.clone() })
}

/// Options that show a part in about 100 pixels and 17 layers, whatever its
/// size.
fn fitting(mesh: &Mesh) -> SliceOptions {
    let (low, high) = mesh.bounds_mm();
    let [x, y, z] = [0, 1, 2].map(|axis| high[axis] - low[axis]);
    let dpi = (100.0 * 25.4 / x.max(y).max(1e-3)).clamp(1.0, 100_000.0);
    options(dpi, (z * 1000.0 / 17.3).max(0.1))
}

/// Coarse parts, some millimetres large, around the origin.
fn part() -> impl Strategy<Value = Mesh> {
    prop::sample::select(vec![
        sphere(2.0, 200).map(|[x, y, z]| [x, y, z - 2.0]),
        torus(1.5, 0.7, 300),
        tower(700).map(|[x, y, z]| [0.05 * x, 0.05 * y, 0.05 * z - 2.0]),
        cone(2.0, 0.0, 3.0, 100),
        cube_with_hole(3.0, 1.0, 100),
        joined(&[block([-2.0; 3], [1.0; 3]), block([-1.0; 3], [2.0; 3])]),
    ])
}

/// Any angles, and quarter turns, which leave faces on planes and rows.
fn angles() -> impl Strategy<Value = [f64; 3]> {
    let quarters = prop::array::uniform3(0..4u8).prop_map(|k| k.map(|k| FRAC_PI_2 * f64::from(k)));
    prop_oneof![3 => prop::array::uniform3(0.0..6.3), 1 => quarters]
}

fn moved(mesh: &Mesh, scale: f64, shift: [f64; 3]) -> Mesh {
    mesh.map(|p| [0, 1, 2].map(|axis| p[axis] * scale + shift[axis]))
}

/// The part with its corners on whole eighths of a millimetre. It stays
/// closed; facets may lose their area, and bodies cut themselves.
fn snapped(mesh: &Mesh) -> Mesh {
    mesh.map(|p| p.map(|v| (v * 8.0).round() / 8.0))
}

/// Options for a snapped part: every corner is on a plane and on the centre
/// of a pixel.
fn on_centres(mesh: &Mesh) -> SliceOptions {
    let (low, high) = mesh.bounds_mm();
    let origin_mm = [low[0] - 3.0 / 16.0, high[1] + 3.0 / 16.0];
    let pixels = [0, 1].map(|axis| ((high[axis] - low[axis]) * 8.0) as u32 + 4);
    SliceOptions { grid: GridRule::At { origin_mm, pixels }, ..options(203.2, 125.0) }
}

/// Facets that change nothing: without area, or twice with opposite sides.
fn idle_facets(mesh: &Mesh) -> Vec<Facet> {
    let of = |&[a, b, c]: &Facet| [[a, b, b], [a, a, a], [c, b, c], [b, c, a], [b, a, c]];
    mesh.facets.iter().step_by(3).flat_map(of).collect()
}

proptest! {
    #![proptest_config(cases(200))]

    #[test]
    fn rows_are_even_in_any_place_and_size(
        part in part(),
        angles in angles(),
        scale in (-2.3..1.0).prop_map(|power| 10f64.powf(power)),
        shift in prop::array::uniform3(-20.0..20.0),
    ) {
        let mesh = moved(&turned(&part, angles), scale, shift);
        for options in with_fills(&fitting(&mesh)) {
            let layers = slice(&mesh, &options);
            prop_assert!(white_pixels(&layers) > 0);
            prop_assert_eq!(odd_row(&layers), None);
        }
    }

    /// At 10 m, 32-bit coordinates are a micrometre apart: small parts fall
    /// together.
    #[test]
    fn rows_are_even_far_from_the_origin(
        part in part(),
        angles in angles(),
        scale in prop::sample::select(vec![0.0025, 0.05, 1.0]),
        shift in prop::array::uniform3(prop::sample::select(vec![-1e4, -9_876.543, 1e4])),
    ) {
        let mesh = moved(&turned(&part, angles), scale, shift);
        for options in with_fills(&fitting(&mesh)) {
            prop_assert_eq!(odd_row(&slice(&mesh, &options)), None);
        }
    }

    #[test]
    fn rows_are_even_where_every_corner_is_a_tie(
        part in part(),
        angles in angles(),
        scale in 0.2..2.0,
        plane in prop::sample::select(vec![PlaneRule::Top, PlaneRule::Bottom]),
    ) {
        let mesh = snapped(&moved(&turned(&part, angles), scale, [0.0; 3]));
        for options in with_fills(&SliceOptions { plane, ..on_centres(&mesh) }) {
            let layers = slice(&mesh, &options);
            prop_assert_eq!(odd_row(&layers), None);

            let idle = Mesh { facets: idle_facets(&mesh) };
            let more = slice(&joined(&[mesh.clone(), idle]), &options);
            prop_assert_eq!(odd_row(&more), None);
            prop_assert_eq!(masks(&more), masks(&layers));
        }
    }

    #[test]
    fn even_odd_does_not_see_which_way_facets_face(
        part in part(),
        angles in angles(),
        share in 0.0..1.0,
        seed in any::<u64>(),
    ) {
        let mesh = turned(&part, angles);
        let mut flipped = mesh.clone();
        inject(&mut flipped, Defect::Flip, (mesh.facets.len() as f64 * share) as usize, seed);
        let options = SliceOptions { fill: Fill::EvenOdd, ..fitting(&mesh) };
        let [layers, flipped] = [&mesh, &flipped].map(|mesh| slice(mesh, &options));
        prop_assert_eq!(odd_row(&flipped), None);
        prop_assert_eq!(masks(&flipped), masks(&layers));
    }
}

fn rotated(placement: Placement, degrees: [f64; 3]) -> Placement {
    let turns = [Axis::X, Axis::Y, Axis::Z].into_iter().zip(degrees);
    turns.fold(placement, |placement, (axis, degrees)| placement.rotated(axis, degrees))
}

/// Needles: tetrahedra with two corners far apart, the others beside the
/// first, thinner than any pixel.
fn needles() -> impl Strategy<Value = Mesh> {
    let far = || prop::array::uniform3(-3.0f32..3.0);
    let aside = || (-9.0f32..-1.0, prop::array::uniform3(-1.0f32..1.0));
    let needle = (far(), far(), aside(), aside()).prop_map(|(a, b, c, d)| {
        let beside = |(power, way): (f32, [f32; 3])| {
            [0, 1, 2].map(|axis| a[axis] + 10f32.powf(power) * way[axis])
        };
        let (c, d) = (beside(c), beside(d));
        [[a, b, c], [a, c, d], [a, d, b], [b, d, c]]
    });
    prop::collection::vec(needle, 1..30)
        .prop_map(|needles| Mesh { facets: needles.into_iter().flatten().collect() })
}

/// The part with every facet in three, by a corner close to one of its own:
/// most are slivers.
fn splintered(mesh: &Mesh, closeness: f32) -> Mesh {
    let split = |&[a, b, c]: &Facet| {
        let d = [0, 1, 2].map(|i| a[i] + closeness * (0.7 * b[i] + 0.3 * c[i] - a[i]));
        [[a, b, d], [b, c, d], [c, a, d]]
    };
    Mesh { facets: mesh.facets.iter().flat_map(split).collect() }
}

/// Any way to place a part, from micrometres in size, and up to 10 m or
/// 900 km away; and options that fit it.
fn placed() -> impl Strategy<Value = SliceOptions> {
    let degrees = prop_oneof![
        3 => prop::array::uniform3(-360.0..360.0),
        1 => prop::array::uniform3((0..8).prop_map(|eighths| 45.0 * f64::from(eighths))),
    ];
    let shift = prop::sample::select(vec![0.0, -0.001, 0.3, 1e4, -9_876.543, 9e8]);
    (degrees, -3.0..1.0, prop::array::uniform3(shift), any::<[bool; 3]>()).prop_map(
        |(degrees, power, shift_mm, mirrors)| {
            let factor = 10f64.powf(power);
            let factors = mirrors.map(|mirror| if mirror { -factor } else { factor });
            let placement = rotated(Placement::default().scaled(factors), degrees);
            let dpi = (25.4 * 25.0 / factor).min(100_000.0);
            SliceOptions {
                placement: placement.translated(shift_mm),
                ..options(dpi, (230.0 * factor).max(0.1))
            }
        },
    )
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn rows_are_even_however_a_part_is_placed(part in part(), placed in placed()) {
        for options in with_fills(&placed) {
            let layers = slice(&part, &options);
            prop_assert!(!layers.is_empty());
            prop_assert_eq!(odd_row(&layers), None);
        }
    }

    #[test]
    fn rows_are_even_where_facets_are_slivers(
        part in part(),
        needles in needles(),
        closeness in prop::sample::select(vec![0.0, 1e-7, 1e-5, 1e-3, 0.1]),
        placed in placed(),
    ) {
        let mesh = joined(&[splintered(&part, closeness), needles]);
        for options in with_fills(&placed) {
            prop_assert_eq!(odd_row(&slice(&mesh, &options)), None);
        }
    }
}

/// As many facets as the largest mould has, turned at random (with
/// `--release -- --ignored`: a minute and 400 MB).
#[test]
#[ignore = "takes a minute in release mode"]
fn rows_are_even_in_millions_of_facets() {
    let mesh = blade(5_500_000);
    assert_eq!(mesh.open_edges(), 0);
    let turn = |k: u32, stride: f64| 360.0 * (f64::from(k) * stride).fract();
    for k in 1..=10 {
        let degrees = [turn(k, 0.754_877_666), turn(k, 0.569_840_296), turn(k, 0.330_598_7)];
        let shift_mm = if k % 2 == 0 { [1e4, -1e4, 1e4] } else { [0.0; 3] };
        let placement = rotated(Placement::default(), degrees).translated(shift_mm);
        let options = SliceOptions { placement, ..options(1500.0, 100.0) };
        let mut rows = 0;
        for layer in Slices::new(model(&mesh), &options).unwrap() {
            let layer = layer.unwrap();
            rows += mask(&layer).height();
            assert_eq!(odd_row(&[layer]), None, "{degrees:?} degrees");
        }
        println!("{degrees:?} degrees, {shift_mm:?} mm: {rows} rows are even");
    }
}

/// The rows that a facet crosses, layer by layer.
fn rows_of(facet: &Facet, grid: &PixelGrid, planes_mm: &[f64]) -> Vec<Vec<u32>> {
    let corners = facet.map(|corner| corner.map(f64::from));
    let row_at = |y: f64| (grid.origin_mm[1] - y) * grid.pitch.x.get() / 25.4 - 0.5;
    let rows = |&plane: &f64| {
        let ends = (0..3).map(|k| (corners[k], corners[(k + 1) % 3])).filter_map(|(a, b)| {
            let met = (a[2] < plane) != (b[2] < plane);
            met.then(|| row_at(a[1] + (plane - a[2]) / (b[2] - a[2]) * (b[1] - a[1])))
        });
        let ends: Vec<f64> = ends.collect();
        let [a, b] = ends[..] else { return Vec::new() };
        (a.min(b).ceil() as u32..a.max(b).ceil() as u32).collect()
    };
    planes_mm.iter().map(rows).collect()
}

fn stray_rows(mesh: &Mesh, options: &SliceOptions) -> Vec<Vec<u32>> {
    slice(mesh, options).into_iter().map(|layer| layer.info.stray_rows).collect()
}

#[test]
fn a_hole_leaves_stray_rows_where_the_facet_was() {
    let mesh = turned(&sphere(2.0, 200), [0.3, 0.4, 0.5]);
    let options = SliceOptions { plane: PlaneRule::Middle, ..fitting(&mesh) };
    let grid = *Slices::new(model(&mesh), &options).unwrap().grid();
    let bottom = mesh.bounds_mm().0[2];
    let plane = |layer: usize| bottom + (layer as f64 + 0.5) * options.thickness.mm();
    let planes_mm: Vec<f64> = (0..slice(&mesh, &options).len()).map(plane).collect();
    let mut stray = 0;
    for seed in 0..20 {
        for defect in [Defect::Drop, Defect::Duplicate] {
            let mut broken = mesh.clone();
            let chosen = inject(&mut broken, defect, 1, seed);
            let expected = rows_of(&mesh.facets[chosen[0]], &grid, &planes_mm);
            for fill in [Fill::EvenOdd, Fill::Solid] {
                let options = SliceOptions { fill, ..options.clone() };
                assert_eq!(stray_rows(&broken, &options), expected, "{defect:?} {fill:?}");
            }
            stray += expected.iter().flatten().count();
        }
    }
    assert!(stray > 500, "only {stray} rows were met");
}
