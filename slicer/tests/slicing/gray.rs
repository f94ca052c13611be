//! Gray layers against a slow obvious twin, which follows the vertical line
//! through every pixel past every facet from above; against closed forms; and
//! against the rules that white layers keep.

use lamp_fixtures::{Mesh, cone, cube_with_hole, sphere, torus, tower};
use lamp_slicing::{
    Axis, Fill, LayerHeights, LayerLevels, PixelGrid, Placement, PlaneRule, Shading, SliceError,
    SliceOptions, Slices,
};
use lamp_stack::{DepthLevels, Image, Layer, Length, gray_runs};
use proptest::prelude::*;
use rayon::prelude::*;

use super::common::{
    block, cases, cube, inside_out, joined, mask, model, options, slice, turned, without_stack,
};

type Point = [f64; 3];

/// Depths in proportion to the level, up to a number of layers.
fn gray(overcure: f64, options: &SliceOptions) -> SliceOptions {
    let of = |thickness: Length| depth_levels(overcure, thickness);
    let levels = match &options.heights {
        Some(heights) => LayerLevels::by_thickness(heights, |um| Ok::<_, ()>(of(um))).unwrap(),
        None => of(options.thickness).into(),
    };
    SliceOptions { shading: Shading::ByDepth(levels), ..options.clone() }
}

fn depth_levels(overcure: f64, thickness: Length) -> DepthLevels {
    let reach = Length::from_um(thickness.um() * overcure);
    DepthLevels::new(reach, |gray| Length::from_um(reach.um() * gray))
}

/// The levels of every pixel, row by row.
fn levels(layer: &Layer) -> Vec<Vec<u8>> {
    match &*layer.image {
        Image::Mask(mask) => {
            let level = |c, r| u8::from(mask.is_white(c, r)) * 255;
            (0..mask.height()).map(|r| (0..mask.width()).map(|c| level(c, r)).collect()).collect()
        }
        Image::Gray(gray) => gray
            .rows()
            .map(|row| {
                let mut levels = vec![0; gray.width() as usize];
                for (start, end, level) in gray_runs(row, gray.width()) {
                    levels[start as usize..end as usize].fill(level);
                }
                levels
            })
            .collect(),
    }
}

/// Where a vertical line passes a facet.
struct Pass {
    z: f64,
    faces_up: bool,
    /// Half of what must lie between this and others to be compared: the slicer joins facets
    /// that are 2 nm apart, or that a step aside of 2 millionths of a pixel brings together.
    tie: f64,
}

/// Where the vertical line through (x, y) passes facets. `None` where it is too near to an edge to
/// say.
fn passes(facets: &[[Point; 3]], [x, y]: [f64; 2], pixel_mm: f64) -> Option<Vec<Pass>> {
    let mut met = Vec::new();
    for [a, b, c] in facets {
        let side = |p: &Point, q: &Point| {
            let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
            (dx * (y - p[1]) - dy * (x - p[0])) / dx.hypot(dy).max(1e-300)
        };
        let sides = [side(b, c), side(c, a), side(a, b)];
        if sides.iter().any(|s| s.abs() < 1e-7) {
            let near = |axis: usize, v: f64| {
                let ends = [a[axis], b[axis], c[axis]];
                v > ends.iter().fold(f64::MAX, |m, v| m.min(*v)) - 1e-7
                    && v < ends.iter().fold(f64::MIN, |m, v| m.max(*v)) + 1e-7
            };
            if near(0, x) && near(1, y) {
                return None;
            }
            continue;
        }
        if sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0) {
            let area =
                |p: &Point, q: &Point| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
            let weights = [area(b, c), area(c, a), area(a, b)];
            let sum: f64 = weights.iter().sum();
            let z = (weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2]) / sum;
            let [u, v] = [b, c].map(|to| [0, 1, 2].map(|axis| to[axis] - a[axis]));
            let across = (u[1] * v[2] - u[2] * v[1]).hypot(u[2] * v[0] - u[0] * v[2]);
            let steepness = across / sum.abs();
            met.push(Pass { z, faces_up: sum > 0.0, tie: 2e-6 * (1.0 + steepness * pixel_mm) });
        }
    }
    met.sort_by(|a, b| b.z.partial_cmp(&a.z).unwrap());
    Some(met)
}

/// The depth of part below a height on a vertical line, with its tolerance; `None` where it stands
/// on what is below `end`, and whether the line is inside the part at the
/// height at all.
fn depth_below(
    met: &[Pass],
    plane: f64,
    end: f64,
    fill: Fill,
) -> Option<(bool, Option<(f64, f64)>)> {
    let inside = |winding: i32| match fill {
        Fill::EvenOdd => winding % 2 != 0,
        Fill::Solid => winding != 0,
    };
    let mut winding = 0;
    let mut at_plane = None;
    if met.windows(2).any(|pair| pair[0].z - pair[1].z < pair[0].tie + pair[1].tie) {
        return None;
    }
    for &Pass { z, faces_up, tie } in met {
        if (z - plane).abs() < tie {
            return None;
        }
        if z < plane && at_plane.is_none() {
            at_plane = Some(inside(winding));
        }
        winding += if faces_up { 1 } else { -1 };
        if z < plane && at_plane == Some(true) && !inside(winding) {
            return Some((true, (z > end).then_some((plane - z, tie))));
        }
    }
    Some((at_plane.unwrap_or(false), None))
}

/// Compares every pixel of a part with the twin's. Returns how many are gray, or a sentence
/// where one differs or more than `most_open` of them are too near to facets to compare.
fn referee(
    mesh: &Mesh,
    options: &SliceOptions,
    overcure: f64,
    most_open: f64,
) -> Result<usize, String> {
    // The twin knows no tolerance of planes.
    let options = &SliceOptions { plane_tolerance: Length::from_um(0.0), ..options.clone() };
    let facets: Vec<_> = mesh.facets.iter().map(|f| f.map(|c| c.map(f64::from))).collect();
    let corners = || facets.as_flattened().iter().map(|corner| corner[2]);
    let low = corners().fold(f64::INFINITY, f64::min);
    let high = corners().fold(f64::NEG_INFINITY, f64::max);
    let gray_options = gray(overcure, options);
    let grid = *Slices::new(model(mesh), options).unwrap().grid();
    let layers = slice(mesh, &gray_options);
    let pixel_mm = options.pitch.x.pitch().mm();
    let check = |layer: &Layer| -> Result<(usize, usize, usize), String> {
        let index = layer.info.index as usize;
        let [bottom, top] = match &options.heights {
            Some(heights) => [0, 1].map(|k| heights.boundaries_um()[index + k] / 1000.0),
            None => [0, 1].map(|k| low + (index + k) as f64 * options.thickness.mm()),
        };
        let thickness = top - bottom;
        let levels_of_depths = depth_levels(overcure, Length::from_mm(thickness));
        let of_um = |um: f64| levels_of_depths.level(Length::from_um(um));
        let plane = top.min(high);
        let end = (top - overcure * thickness).max(low + 1e-3);
        let (mut open, mut seen, mut grays) = (0, 0, 0);
        for (row, levels) in levels(layer).iter().enumerate() {
            for (column, &level) in levels.iter().enumerate() {
                let met = passes(&facets, centre(&grid, column, row), pixel_mm);
                let found = met.and_then(|met| depth_below(&met, plane, end, options.fill));
                let Some((inside, depth)) = found else {
                    open += 1;
                    continue;
                };
                let depth =
                    depth.map(|(depth, tie)| [depth + top - plane, tie].map(|mm| mm * 1000.0));
                let expected = match (inside, depth) {
                    (false, _) => 0..=0,
                    (true, None) => 255..=255,
                    (true, Some([um, tie_um])) => of_um(um - tie_um)..=of_um(um + tie_um),
                };
                if !expected.contains(&level) {
                    let place = format!("layer {}, {column}, {row}", layer.info.index);
                    return Err(format!("{place}: {level}, not {expected:?} for {depth:?}"));
                }
                seen += 1;
                grays += usize::from(level % 255 != 0);
            }
        }
        Ok((open, seen, grays))
    };
    let counts = layers.par_iter().map(check).collect::<Result<Vec<_>, _>>()?;
    let [open, seen, grays] = counts
        .iter()
        .fold([0; 3], |sum, &(open, seen, grays)| [sum[0] + open, sum[1] + seen, sum[2] + grays]);
    if open as f64 > most_open * seen as f64 {
        return Err(format!("{open} of {seen} pixels are open"));
    }
    Ok(grays)
}

fn centre(grid: &PixelGrid, column: usize, row: usize) -> [f64; 2] {
    grid.to_mm(column as f64, row as f64)
}

#[test]
fn parts_in_no_position_agree_in_every_pixel() {
    let overlapping = joined(&[
        turned(&cube(0.0, 3.0), [0.3, 0.2, 0.1]),
        turned(&cube(0.7, 3.7), [0.2, 0.4, 0.9]),
        turned(&block([0.5, -1.0, 0.3], [1.5, 4.0, 0.9]), [0.1, 0.5, 0.3]),
    ]);
    let cavity = joined(&[sphere(1.7, 400), inside_out(&sphere(1.2, 300))]);
    for (mesh, angles) in [
        (sphere(2.0, 600), [0.1, 0.2, 0.3]),
        (torus(2.0, 0.8, 500), [0.9, 0.3, 0.1]),
        (cone(1.5, 0.5, 3.0, 90), [2.6, 0.4, 1.0]),
        (cube_with_hole(3.0, 1.0, 100), [0.6, 1.1, 0.2]),
        (tower(200).map(|p| p.map(|v| v * 0.04)), [3.0, 0.2, 0.1]),
        (overlapping, [0.0; 3]),
        (cavity, [0.3; 3]),
    ] {
        let mesh = turned(&mesh, angles);
        for (fill, overcure) in [(Fill::EvenOdd, 1.0), (Fill::Solid, 1.0), (Fill::EvenOdd, 2.3)] {
            let options = SliceOptions { fill, ..options(300.0, 290.0) };
            let grays = referee(&mesh, &options, overcure, 0.05);
            assert!(grays.as_ref().is_ok_and(|grays| *grays > 150), "{fill:?}: {grays:?}");
        }
    }
}

/// Each layer has the levels of its own thickness, however deep those of others
/// reach.
#[test]
fn layers_of_many_thicknesses_agree_in_every_pixel() {
    let mesh = turned(&sphere(2.0, 600), [0.1, 0.2, 0.3]);
    let low = mesh.bounds_mm().0[2] * 1000.0;
    let mut boundaries = vec![low];
    while boundaries[boundaries.len() - 1] < low + 3_950.0 {
        let k = boundaries.len();
        boundaries.push(boundaries[k - 1] + [290.0, 61.0, 120.5, 455.0][k % 4]);
    }
    let heights = Some(LayerHeights::new(boundaries).unwrap());
    for overcure in [1.0, 2.3] {
        let options = SliceOptions { heights: heights.clone(), ..options(300.0, 1.0) };
        let grays = referee(&mesh, &options, overcure, 0.05);
        assert!(grays.as_ref().is_ok_and(|grays| *grays > 150), "{grays:?}");
    }
}

fn tetrahedra() -> impl Strategy<Value = Mesh> {
    let corner = || prop::array::uniform3(-2.0f32..2.0);
    prop::collection::vec((corner(), corner(), corner(), corner()), 1..5).prop_map(|bodies| {
        let facets = |&(a, b, c, d): &_| [[a, b, c], [a, c, d], [a, d, b], [b, d, c]];
        Mesh { facets: bodies.iter().flat_map(facets).collect() }
    })
}

proptest! {
    #![proptest_config(cases(60))]

    #[test]
    fn overlapping_bodies_agree_in_every_pixel(
        mesh in tetrahedra(),
        dpi in 120.0..400.0,
        thickness_um in 100.0..900.0,
        fill in prop::sample::select(vec![Fill::EvenOdd, Fill::Solid]),
        overcure in 1.0..3.0,
    ) {
        let options = SliceOptions { fill, ..options(dpi, thickness_um) };
        // Of flat bodies one above the other, much is too near to compare.
        let seen = referee(&mesh, &options, overcure, 0.5);
        prop_assert!(seen.is_ok(), "{}", seen.unwrap_err());
    }
}

/// The depth of a level that [`gray`] gives, in micrometres.
fn depth_um(level: u8, options: &SliceOptions) -> f64 {
    f64::from(level) / 255.0 * options.thickness.um()
}

#[test]
fn below_a_sphere_the_depth_is_its_closed_form() {
    let options = options(500.0, 200.0);
    let sphere = sphere(5.0, 40_000);
    let (low, _) = sphere.bounds_mm();
    let grid = *Slices::new(model(&sphere), &options).unwrap().grid();
    let mut grays = 0;
    for layer in slice(&sphere, &gray(1.0, &options)) {
        let top = low[2] + f64::from(layer.info.index + 1) * 0.2;
        for (row, levels) in levels(&layer).iter().enumerate() {
            for (column, &level) in levels.iter().enumerate().filter(|(_, level)| *level % 255 > 0)
            {
                let [x, y] = centre(&grid, column, row);
                let under = low[2] + 5.0 - (25.0 - x * x - y * y).max(0.0).sqrt();
                let slope = x.hypot(y) / (25.0 - x * x - y * y).max(0.01).sqrt();
                let exact = (top - under) * 1000.0;
                // Half a level, and how far the facets lie inside the sphere.
                let tolerance = 0.5 * 200.0 / 255.0 + 1.0 + 4.0 * slope;
                let depth = depth_um(level, &options);
                assert!((depth - exact).abs() < tolerance, "{column}, {row}: {depth} {exact}");
                grays += 1;
            }
        }
    }
    assert!(grays > 20_000, "{grays}");
}

/// A prism along y: a trapezoid of x and z.
fn prism(corners: [[f32; 2]; 4]) -> Mesh {
    let unit = block([0.0; 3], [1.0; 3]);
    unit.map(|[x, y, z]| {
        let [a, b, c, d] = corners.map(|corner| corner.map(f64::from));
        let mix = |i: usize| {
            (1.0 - x) * (1.0 - z) * a[i]
                + x * (1.0 - z) * b[i]
                + x * z * c[i]
                + (1.0 - x) * z * d[i]
        };
        [mix(0), 4.0 * y, mix(1)]
    })
}

/// Pixels and layers of 1/8 mm, which floating point holds, so that slopes of
/// 45 degrees pass through centres.
fn eighths() -> SliceOptions {
    options(203.2, 125.0)
}

/// In whole depths, a pixel an eighth to the right is an eighth deeper.
#[test]
fn slopes_through_centres_are_exact() {
    // Overhanging to the left, by 45 degrees.
    let wedge = prism([[0.0625, 0.0], [4.0625, 0.0], [4.0625, 2.0625], [-2.0, 2.0625]]);
    for mesh in [wedge.clone(), inside_out(&wedge)] {
        for layer in &slice(&mesh, &gray(2.0, &eighths()))[..16] {
            let plain = &slice(&mesh, &eighths())[layer.info.index as usize];
            for (row, levels) in levels(layer).iter().enumerate() {
                let row = row as u32;
                let white: Vec<_> =
                    (0..levels.len()).filter(|c| mask(plain).is_white(*c as u32, row)).collect();
                let Some(&first) = white.first() else { continue };
                // Nothing, one layer, two. The lowest layer stands on its platform.
                let on_platform = layer.info.index == 0;
                let expected = [0, if on_platform { 255 } else { 128 }, 255, 255];
                assert_eq!(levels[first..first + 4], expected, "layer {}", layer.info.index);
                assert!(white[1..].iter().all(|c| levels[*c] > 0));
            }
        }
    }
}

#[test]
fn upward_faces_do_not_change() {
    let hill = prism([[-2.0, 0.0], [4.0, 0.0], [3.0, 2.0], [0.0625, 2.0]]);
    let upper = cone(3.0, 0.5, 4.0, 300);
    for mesh in [hill.clone(), inside_out(&hill), upper] {
        for options in [eighths(), options(300.0, 170.0)] {
            let plain = without_stack(slice(&mesh, &options));
            assert!(without_stack(slice(&mesh, &gray(1.0, &options))) == plain);
        }
    }
}

#[test]
fn bodies_that_touch_are_one() {
    // On a layer's plane, within a layer, and along slopes through centres.
    let stacked =
        |z: f32| joined(&[block([0.0; 3], [2.0, 2.0, z]), block([0.0, 0.0, z], [2.0; 3])]);
    let low = prism([[0.0625, 0.0], [2.0625, 0.0], [2.0625, 2.0], [0.0625, 0.5]]);
    let high = prism([[0.0625, 0.5], [2.0625, 2.0], [2.0625, 3.0], [0.0625, 3.0]]);
    let sloping = joined(&[low, high]);
    for mesh in [stacked(1.0), stacked(1.03), sloping] {
        for fill in [Fill::EvenOdd, Fill::Solid] {
            for mesh in [mesh.clone(), turned(&mesh, [0.0, 0.0, 0.4])] {
                let options = SliceOptions { fill, ..eighths() };
                let plain = without_stack(slice(&mesh, &options));
                assert!(without_stack(slice(&mesh, &gray(1.0, &options))) == plain);
            }
        }
    }
}

/// A thin gap within a layer: the pixel is as deep as the part above the gap,
/// and the part below it comes with the layer that has it in its section.
#[test]
fn a_column_that_is_left_and_entered_again_ends_at_the_gap() {
    let gap = joined(&[block([0.0; 3], [2.0, 2.0, 1.03]), block([0.0, 0.0, 1.06], [2.0; 3])]);
    let options = eighths();
    let layers = slice(&gap, &gray(1.0, &options));
    let mut all: Vec<u8> = layers.iter().flat_map(levels).flatten().collect();
    all.sort_unstable();
    all.dedup();
    // 1.125 mm less 1.06 mm, of 0.125 mm.
    assert_eq!(all, [0, 133, 255]);
}

#[test]
fn a_wide_underside_is_a_run_a_row() {
    let table = joined(&[
        block([4.0, 4.0, 0.0], [5.0, 5.0, 0.95]),
        block([0.0, 0.0, 0.95], [9.0, 9.0, 2.0]),
    ]);
    let layers =
        slice(&table, &SliceOptions { fill: Fill::Solid, ..gray(1.0, &options(600.0, 100.0)) });
    let Image::Gray(gray) = &*layers[9].image else { panic!("the underside is gray") };
    assert_eq!(
        levels(&layers[9]).concat().iter().filter(|level| **level == 128).count(),
        213 * 213 - 24 * 24
    );
    assert!(gray.change_count() < 5 * gray.height() as usize);
}

#[test]
fn depths_may_begin_below_a_last_layer_that_is_not_full() {
    // 2.5 layers high: a last layer of which half is part, on top of a ledge.
    let part =
        joined(&[block([0.0; 3], [1.0, 1.0, 0.3]), block([1.0, 0.0, 0.22], [2.0, 1.0, 0.25])]);
    let options = gray(1.0, &options(600.0, 100.0));
    let layers = slice(&part, &options);
    assert_eq!(layers.len(), 3);
    let low =
        joined(&[block([0.0; 3], [1.0, 1.0, 0.15]), block([1.0, 0.0, 0.12], [2.0, 1.0, 0.15])]);
    let layers = slice(&low, &options);
    assert_eq!(layers.len(), 2);
    // Cured down from 0.2 mm to the ledge's underside at 0.12 mm.
    let ledge: Vec<_> = levels(&layers[1]).concat();
    assert!(ledge.contains(&204) && ledge.iter().all(|level| [0, 204, 255].contains(level)));
}

/// A foot turned away and back is level only up to rounding.
#[test]
fn a_foot_that_was_turned_into_place_stands() {
    for degrees in [10.0, 25.0, 45.0, 63.0] {
        let turned = cube(0.0, 20.0).map(|p| Placement::default().rotated(Axis::X, degrees).at(p));
        let placement = Placement::default().rotated(Axis::X, -degrees);
        let options = SliceOptions { placement, ..gray(2.0, &options(300.0, 100.0)) };
        let layers = slice(&turned, &options);
        assert!(matches!(*layers[0].image, Image::Mask(_)), "{degrees}");
        assert!(mask(&layers[0]).white_pixels() > 50_000);
    }
}

#[test]
fn threads_memory_and_order_do_not_change_gray_layers() {
    let mesh = turned(&tower(6_000), [2.5, 0.3, 0.0]);
    let coarse = gray(1.7, &options(120.0, 700.0));
    let expected = without_stack(slice(&mesh, &coarse));
    let some_gray = |layer: &&Layer| matches!(*layer.image, Image::Gray(_));
    assert!(expected.iter().filter(some_gray).count() > 50);
    let mut mixed = mesh.clone();
    mixed.facets.sort_by_key(|facet| facet[0][0].to_bits().wrapping_mul(2_654_435_761));
    mixed.facets.iter_mut().step_by(3).for_each(|facet| facet.rotate_left(1));
    for memory in [1, 5_000, 200_000, 1 << 30] {
        for mesh in [&mesh, &mixed] {
            let options = SliceOptions { memory, ..coarse.clone() };
            assert!(without_stack(slice(mesh, &options)) == expected, "{memory} bytes");
        }
    }
    let some = slice(&mesh, &SliceOptions { layers: Some(20..25), ..coarse });
    assert!(without_stack(some) == expected[20..25]);
}

#[test]
fn gray_layers_have_their_sections_at_the_top() {
    for plane in [PlaneRule::Middle, PlaneRule::Bottom] {
        let options = SliceOptions { plane, ..gray(1.0, &options(300.0, 100.0)) };
        let slices = Slices::new(model(&cube(0.0, 1.0)), &options);
        assert!(matches!(slices, Err(SliceError::GrayPlane)));
    }
}
