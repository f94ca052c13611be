//! Layers inside and outside of the part, against a slow obvious twin that passes the vertical line
//! through every pixel by every facet; against closed forms; and against sections.

use std::f64::consts::PI;

use lamp_fixtures::{Mesh, cube_with_hole, sphere, torus, tower};
use lamp_slicing::{
    LayerHeights, Placement, PlaneRule, Shading, Side, SliceError, SliceOptions, Slices,
};
use lamp_stack::{Layer, Length};

use super::common::{block, inside_out, joined, mask, masks, model, options, slice, turned};

fn on_side(side: Side, options: &SliceOptions) -> SliceOptions {
    SliceOptions { shading: side.into(), ..options.clone() }
}

/// Returns the heights in micrometers at which the vertical line through a point meets facets, with
/// 1 if the way up enters there and -1 if it leaves. Returns `None` if it passes an edge too near.
fn passes(mesh: &Mesh, [x, y]: [f64; 2]) -> Option<Vec<(f64, i32)>> {
    let mut passes = Vec::new();
    for facet in &mesh.facets {
        let [a, b, c] = facet.map(|corner| corner.map(f64::from));
        let cross = |p: [f64; 3], q: [f64; 3]| (p[0] - x) * (q[1] - y) - (q[0] - x) * (p[1] - y);
        let parts = [cross(b, c), cross(c, a), cross(a, b)];
        let area: f64 = parts.iter().sum();
        if area.abs() < 1e-12 {
            continue;
        }
        let shares = parts.map(|part| part / area);
        if shares.iter().any(|share| share.abs() < 1e-7) && shares.iter().all(|s| *s > -1e-7) {
            return None;
        }
        if shares.iter().all(|share| *share > 0.0) {
            let z_mm = shares[0] * a[2] + shares[1] * b[2] + shares[2] * c[2];
            passes.push((1000.0 * z_mm, if area > 0.0 { -1 } else { 1 }));
        }
    }
    passes.sort_by(|a, b| a.0.total_cmp(&b.0));
    Some(passes)
}

/// Returns whether the part fills a line from one height to another, and whether it is anywhere
/// between; `None` if an end of the part is too near one of these heights.
fn filled_and_met(passes: &[(f64, i32)], [bottom, top]: [f64; 2]) -> Option<[bool; 2]> {
    let (mut winding, mut filled, mut met, mut began) = (0, false, false, f64::NEG_INFINITY);
    for &(z_um, turn) in passes {
        let was_inside = winding != 0;
        winding += turn;
        if was_inside == (winding != 0) {
            continue;
        }
        if (z_um - bottom).abs() < 1.1 || (z_um - top).abs() < 1.1 {
            return None;
        }
        if was_inside {
            filled |= began < bottom && top < z_um;
            met |= began < top && bottom < z_um;
        }
        began = z_um;
    }
    assert_eq!(winding, 0, "the mesh is closed");
    Some([filled, met])
}

/// Compares all pixels of all layers with the twin. Returns how many pixels were compared where
/// inside and outside differ.
fn check(mesh: &Mesh, options: &SliceOptions) -> u64 {
    let both = Slices::new(model(mesh), options).unwrap();
    let grid = *both.grid();
    let columns: Vec<_> = (0..grid.height)
        .flat_map(|row| (0..grid.width).map(move |column| [column, row]))
        .map(|[column, row]| passes(mesh, grid.to_mm(f64::from(column), f64::from(row))))
        .collect();
    let mut differ = 0;
    for side in [Side::Inside, Side::Outside] {
        let layers = slice(mesh, &on_side(side, options));
        let mut compared = 0;
        for layer in &layers {
            let bottom = layer.info.z_um.unwrap();
            let ends = [bottom, bottom + layer.info.thickness_um.unwrap()];
            for (k, passes) in columns.iter().enumerate() {
                let Some(passes) = passes else { continue };
                let Some([filled, met]) = filled_and_met(passes, ends) else { continue };
                let (row, column) = (k as u32 / grid.width, k as u32 % grid.width);
                let expected = if side == Side::Inside { filled } else { met };
                let found = mask(layer).is_white(column, row);
                assert_eq!(found, expected, "{side}, {ends:?}, {column} {row}: {passes:?}");
                compared += 1;
                differ += u64::from(filled != met);
            }
        }
        let all = layers.len() * columns.len();
        assert!(compared > all * 8 / 10, "{compared} of {all}");
    }
    differ
}

#[test]
fn pixels_are_white_where_the_part_fills_the_layer_or_is_in_it() {
    let leaning = |mesh: &Mesh| turned(mesh, [0.4, 0.3, 0.2]);
    let ball = sphere(1.5, 600);
    for (name, mesh) in [
        ("sphere", ball.clone()),
        ("torus", leaning(&torus(1.4, 0.5, 900))),
        ("cube", leaning(&cube_with_hole(2.0, 0.6, 200))),
        ("balls", joined(&[ball.clone(), ball.map(|[x, y, z]| [x + 0.7, y + 0.2, z + 0.9])])),
        // Thinner than a layer, so that no section sees it.
        ("plate", leaning(&block([0.0; 3], [2.0, 1.5, 0.07]))),
    ] {
        let even = options(400.0, 130.0);
        assert!(check(&mesh, &even) > 300, "{name}");
        let low = mesh.facets.iter().flatten().map(|corner| f64::from(corner[2]) * 1000.0);
        let low = low.fold(f64::MAX, f64::min).floor();
        let boundaries = (0..40).map(|k| low + f64::from(k * k) * 2.5).collect();
        let heights = Some(LayerHeights::new(boundaries).unwrap());
        assert!(check(&mesh, &SliceOptions { heights, ..even }) > 300, "{name}");
    }
}

/// Returns the volume of layers in cubic millimeters.
fn volume(layers: &[Layer]) -> f64 {
    let of_layer = |layer: &Layer| {
        let [x, y] = layer.pitch.unwrap().mm();
        mask(layer).white_pixels() as f64 * x * y * layer.info.thickness_um.unwrap() / 1000.0
    };
    layers.iter().map(of_layer).sum()
}

/// Figure 38: a sphere of 14,137 mm3 in layers of half a millimeter. Sections are widest at one
/// end of each layer, so its two planes decide.
#[test]
fn a_sphere_is_contained_or_contains() {
    let (radius, t) = (15.0, 0.5);
    let mesh = sphere(radius, 200_000);
    let section = |k: i32| PI * (radius * radius - (f64::from(k) * t - radius).powi(2));
    let sum = |pick: fn(f64, f64) -> f64| {
        (0..60).map(|k| t * pick(section(k), section(k + 1))).sum::<f64>()
    };
    let [inside, outside] = [sum(f64::min), sum(f64::max)];
    assert!((outside - 14_475.0).abs() < 15.0 && (inside - 13_768.0).abs() < 15.0);
    let options = options(300.0, 1000.0 * t);
    for (side, expected) in [(Side::Inside, inside), (Side::Outside, outside)] {
        let layers = slice(&mesh, &on_side(side, &options));
        let found = volume(&layers);
        assert_eq!(layers.len(), 60);
        assert!((found / expected - 1.0).abs() < 1e-3, "{side}: {found} for {expected}");
    }
}

/// Flat faces at layers' ends are not within the layers beyond them.
#[test]
fn boxes_of_whole_layers_are_alike_on_both_sides() {
    let low = block([0.0; 3], [2.0, 2.0, 0.3]);
    // With the usual rounding of 32 bits.
    let high = block([0.5, 0.5, 0.3], [1.5, 1.5, 0.7]);
    let aside = block([2.5, 0.0, 0.2], [3.0, 1.0, 0.6]);
    for mesh in [joined(&[low, high, aside.clone()]), inside_out(&aside)] {
        let options = options(254.0, 100.0);
        let both = slice(&mesh, &options);
        for side in [Side::Inside, Side::Outside] {
            let layers = slice(&mesh, &on_side(side, &options));
            assert_eq!(masks(&layers), masks(&both), "{side}");
        }
    }
}

/// Inside, no layer reaches above the part; outside, none of the part reaches above the layers.
#[test]
fn heights_are_whole_layers_within_the_part_or_around_it() {
    for (height, inside, outside) in [(0.96, 9, 10), (1.04, 10, 11), (1.0, 10, 10), (0.03, 1, 1)] {
        let mesh = block([0.0; 3], [1.0, 1.0, height]);
        let count = |side| {
            let layers = slice(&mesh, &on_side(side, &options(254.0, 100.0)));
            let white = layers.iter().filter(|layer| mask(layer).white_pixels() > 0);
            [layers.len(), white.count()]
        };
        // A part below one layer fills none.
        let filled = if height < 0.1 { 0 } else { inside };
        assert_eq!(count(Side::Inside), [inside, filled], "{height}");
        assert_eq!(count(Side::Outside), [outside; 2], "{height}");
    }
}

/// Sections within a layer lie between both sides, whatever the part.
#[test]
fn sections_lie_between_both_sides() {
    let mesh = turned(&tower(3_000).map(|p| p.map(|c| c / 20.0)), [0.2, 0.1, 0.0]);
    let coarse = options(200.0, 160.0);
    let grid = |layers: &[Layer]| layers[0].info.origin_mm.unwrap();
    let [inside, outside] =
        [Side::Inside, Side::Outside].map(|side| slice(&mesh, &on_side(side, &coarse)));
    let fine = slice(&mesh, &SliceOptions { thickness: Length::from_um(40.0), ..coarse });
    assert_eq!(grid(&inside), grid(&fine));
    let mut seen = 0;
    for layer in &fine {
        let top = layer.info.z_um.unwrap() + layer.info.thickness_um.unwrap();
        let holds = |other: &&Layer| {
            let bottom = other.info.z_um.unwrap();
            bottom + 0.1 < top && top < bottom + 160.1
        };
        let within = |a: &Layer, b: &Layer| {
            let (a, b) = (mask(a), mask(b));
            (0..a.height()).all(|r| (0..a.width()).all(|c| !a.is_white(c, r) || b.is_white(c, r)))
        };
        if let (Some(i), Some(o)) = (inside.iter().find(holds), outside.iter().find(holds)) {
            assert!(within(i, layer) && within(layer, o), "{top}");
            seen += 1;
        }
    }
    assert!(seen > 40, "{seen}");
}

#[test]
fn sides_are_black_and_white_from_the_top() {
    let mesh = sphere(1.0, 200);
    let inside = on_side(Side::Inside, &options(254.0, 100.0));
    let middle = SliceOptions { plane: PlaneRule::Middle, ..inside.clone() };
    let error = Slices::new(model(&mesh), &middle).unwrap_err();
    assert!(matches!(error, SliceError::GrayPlane), "{error}");
    let edges = SliceOptions { antialias: true, ..inside.clone() };
    let error = Slices::new(model(&mesh), &edges).unwrap_err();
    assert!(matches!(error, SliceError::GraySide), "{error}");
    let slices = Slices::new(model(&mesh), &inside).unwrap();
    assert!(!slices.is_gray() && slices.shading() == Shading::Inside);
    // Placements and slabs change nothing that counts.
    let moved = Placement::default().translated([3.0, 4.0, 5.0]);
    let moved = SliceOptions { placement: moved, memory: 1, ..inside.clone() };
    let [a, b] = [inside, moved].map(|options| slice(&mesh, &options));
    assert_eq!(masks(&a), masks(&b));
}
