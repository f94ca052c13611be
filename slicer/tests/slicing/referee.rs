//! Every pixel against a slow obvious twin: how often the surface winds
//! around the pixel's centre, as the sum of the facets' solid angles.
//!
//! The twin looks at no plane, row or column, has no ties and no order of
//! facets. Source: A. Van Oosterom and J. Strackee, "The solid angle of a
//! plane triangle", IEEE Trans. Biomed. Eng. 30(2), 1983.

use std::f64::consts::PI;

use lamp_fixtures::{Mesh, cone, cube_with_hole, sphere, torus, tower};
use lamp_slicing::{Fill, GridRule, PixelGrid, PlaneRule, SliceOptions, Slices, Units};
use lamp_stack::{Layer, Length, Pitch};
use proptest::prelude::*;
use rayon::prelude::*;

use super::common::{
    block, cases, cube, inside_out, joined, mask, model, options, slice, turned, white_pixels,
};

type Point = [f64; 3];

/// Planes that pass a horizontal facet see it from the side of the layer, so
/// the twin looks from a little that way, in mm.
const ASIDE_MM: f64 = 2e-9;
/// Centres so near to the surface may go either way.
const NEAR_MM: f64 = 1e-8;

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn half_solid_angle(facet: &[Point; 3], point: Point) -> f64 {
    let [a, b, c] = facet.map(|corner| minus(corner, point));
    let [la, lb, lc] = [a, b, c].map(|v| dot(v, v).sqrt());
    let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    dot(a, cross(b, c)).atan2(below)
}

/// How often the surface winds around a point. No whole number on it.
fn winding(facets: &[[Point; 3]], point: Point) -> f64 {
    facets.iter().map(|facet| half_solid_angle(facet, point)).sum::<f64>() / (2.0 * PI)
}

fn inside(facets: &[[Point; 3]], point: Point, fill: Fill) -> bool {
    let times = winding(facets, point).round() as i64;
    match fill {
        Fill::EvenOdd => times.rem_euclid(2) == 1,
        Fill::Solid => times != 0,
    }
}

/// Whether the surface is so near that rounding decides.
fn near_surface(facets: &[[Point; 3]], [x, y, z]: Point, fill: Fill) -> bool {
    let d = NEAR_MM;
    let around = [[x - d, y, z], [x + d, y, z], [x, y - d, z], [x, y + d, z]];
    let first = inside(facets, around[0], fill);
    around.into_iter().any(|point| inside(facets, point, fill) != first)
}

/// The heights at which the twin looks at a part.
fn heights_mm(facets: &[[Point; 3]], options: &SliceOptions) -> Vec<f64> {
    let corners = || facets.as_flattened().iter().map(|corner| corner[2]);
    let low = corners().fold(f64::INFINITY, f64::min);
    let high = corners().fold(f64::NEG_INFINITY, f64::max);
    let thickness = options.thickness.mm();
    let count = ((high - low) / thickness).round().max(1.0) as u32;
    let height = |layer: u32| match options.plane {
        PlaneRule::Top => (low + f64::from(layer + 1) * thickness).min(high) - ASIDE_MM,
        PlaneRule::Middle => low + (f64::from(layer) + 0.5) * thickness - ASIDE_MM,
        PlaneRule::Bottom => low + f64::from(layer) * thickness + ASIDE_MM,
    };
    (0..count).map(height).collect()
}

/// Compares every pixel of a layer; says how many went either way.
fn compare(
    layer: &Layer,
    z: f64,
    grid: &PixelGrid,
    facets: &[[Point; 3]],
    fill: Fill,
) -> Result<u64, String> {
    let (mask, [pitch_x, pitch_y]) = (mask(layer), grid.pitch.dpi().map(|dpi| 25.4 / dpi));
    let mut open = 0;
    for (row, column) in (0..grid.height).flat_map(|r| (0..grid.width).map(move |c| (r, c))) {
        let x = grid.origin_mm[0] + (f64::from(column) + 0.5) * pitch_x;
        let y = grid.origin_mm[1] - (f64::from(row) + 0.5) * pitch_y;
        if mask.is_white(column, row) != inside(facets, [x, y, z], fill) {
            if !near_surface(facets, [x, y, z], fill) {
                return Err(format!("layer {}, column {column}, row {row}", layer.info.index));
            }
            open += 1;
        }
    }
    Ok(open)
}

/// Compares all pixels of a part. The twin knows no tolerance of planes.
fn referee(mesh: &Mesh, options: &SliceOptions) -> Result<(), String> {
    let options = &SliceOptions { plane_tolerance: Length::from_um(0.0), ..options.clone() };
    let mm = options.units.mm();
    let facets: Vec<_> =
        mesh.facets.iter().map(|f| f.map(|corner| corner.map(|v| f64::from(v) * mm))).collect();
    let grid = *Slices::new(model(mesh), options).unwrap().grid();
    let layers = slice(mesh, options);
    let heights = heights_mm(&facets, options);
    if layers.len() != heights.len() {
        return Err(format!("{} layers, not {}", layers.len(), heights.len()));
    }
    let open: u64 = layers
        .par_iter()
        .zip(heights)
        .map(|(layer, z)| compare(layer, z, &grid, &facets, options.fill))
        .sum::<Result<u64, String>>()?;
    let white = white_pixels(&layers);
    if open * 100 > white { Err(format!("{open} of {white} pixels are open")) } else { Ok(()) }
}

fn with_planes(options: &SliceOptions) -> [SliceOptions; 3] {
    [PlaneRule::Top, PlaneRule::Middle, PlaneRule::Bottom]
        .map(|plane| SliceOptions { plane, ..options.clone() })
}

#[test]
fn an_upright_cube_with_a_hole_agrees_at_every_plane() {
    let mesh = cube_with_hole(4.0, 1.2, 120);
    for options in with_planes(&options(300.0, 330.0)) {
        assert_eq!(referee(&mesh, &options), Ok(()));
    }
}

#[test]
fn a_coarse_tower_in_inches_agrees_at_every_plane() {
    let mesh = tower(200).map(|p| p.map(|v| v / 254.0));
    let inches = SliceOptions { units: Units::Inches, ..options(400.0, 500.0) };
    for options in with_planes(&inches) {
        assert_eq!(referee(&mesh, &options), Ok(()));
    }
}

#[test]
fn a_part_in_the_wrong_units_does_not_pass() {
    let mesh = cube_with_hole(4.0, 1.2, 120);
    let layers = slice(&mesh, &options(100.0, 330.0));
    let inches = SliceOptions { units: Units::Inches, ..options(100.0, 330.0) };
    let large = slice(&mesh, &inches);
    let ratio = white_pixels(&large) as f64 / white_pixels(&layers) as f64;
    assert!((ratio / 25.4f64.powi(3) - 1.0).abs() < 0.1, "{ratio}");
}

#[test]
fn a_frame_may_be_anywhere_around_the_part() {
    let mesh = turned(&torus(3.0, 1.0, 100), [0.6, 0.2, 1.0]);
    for (origin_mm, pixels) in
        [([-2.7, 3.8], [66, 80]), ([-9.037, 4.4], [133, 90]), ([-3.0, 6.013], [70, 103])]
    {
        let grid = GridRule::At { origin_mm, pixels };
        let options = SliceOptions { grid, ..options(254.0, 410.0) };
        assert_eq!(referee(&mesh, &options), Ok(()));
    }
}

/// Small parts, among them bodies that overlap and bodies inside out.
fn part() -> impl Strategy<Value = Mesh> {
    let overlapping =
        joined(&[cube(0.0, 2.0), cube(1.0, 3.0), block([0.5, -1.0, 0.3], [1.5, 4.0, 0.9])]);
    let cavity = joined(&[sphere(1.5, 120), inside_out(&sphere(1.0, 64))]);
    let known = prop::sample::select(vec![
        cube_with_hole(3.0, 1.0, 100),
        torus(1.5, 0.6, 100),
        tower(150).map(|p| p.map(|v| v * 0.05)),
        cone(1.5, 0.5, 3.0, 80),
        overlapping,
        cavity,
    ]);
    let corner = || prop::array::uniform3(-2.0f32..2.0);
    let tetrahedra = prop::collection::vec((corner(), corner(), corner(), corner()), 1..4);
    let tetrahedra = tetrahedra.prop_map(|bodies| {
        let facets = |&(a, b, c, d): &_| [[a, b, c], [a, c, d], [a, d, b], [b, d, c]];
        Mesh { facets: bodies.iter().flat_map(facets).collect() }
    });
    prop_oneof![2 => known, 1 => tetrahedra]
}

fn any_options() -> impl Strategy<Value = SliceOptions> {
    let plane = prop::sample::select(vec![PlaneRule::Top, PlaneRule::Middle, PlaneRule::Bottom]);
    let fill = prop::sample::select(vec![Fill::EvenOdd, Fill::Solid]);
    let dpi =
        prop_oneof![(120.0..400.0).prop_map(|dpi| [dpi; 2]), prop::array::uniform2(120.0..400.0),];
    (dpi, 100.0..900.0, plane, fill, 0u32..4).prop_map(
        |(dpi, thickness_um, plane, fill, margin)| SliceOptions {
            pitch: Pitch::of_two_dpi(dpi).unwrap(),
            plane,
            fill,
            grid: GridRule::Around { margin },
            ..options(120.0, thickness_um)
        },
    )
}

proptest! {
    #![proptest_config(cases(160))]

    #[test]
    fn parts_in_any_position_agree_in_every_pixel(
        mesh in part(),
        angles in prop::array::uniform3(0.0..6.3),
        shift in prop::array::uniform3(-50.0..50.0),
        options in any_options(),
    ) {
        let placed = turned(&mesh, angles).map(|p| [0, 1, 2].map(|i| p[i] + shift[i]));
        prop_assert_eq!(referee(&placed, &options), Ok(()));
    }
}
