//! Gray edges against areas of clipped polygons, against closed forms, and against white layers.

use lamp_fixtures::{Mesh, cube_with_hole, sphere, torus};
use lamp_slicing::{Fill, GridRule, PlaneRule, Shading, SliceError, SliceOptions, Slices};
use lamp_stack::{DepthLevels, Image, Layer, Length, gray_runs};
use proptest::prelude::*;

use super::common::{
    block, cases, inside_out, joined, mask, model, options, slice, try_layers, turned,
    white_pixels, without_stack,
};

type Point = [f64; 2];

/// Pixels of 1/8 mm, which floating point represents exactly.
fn eighths() -> SliceOptions {
    let plane = PlaneRule::Middle;
    SliceOptions { antialias: true, plane, ..options(203.2, 1000.0) }
}

/// Returns the level of each pixel, row by row.
fn levels(layer: &Layer) -> Vec<Vec<u8>> {
    let [width, height] = [layer.image.width(), layer.image.height()];
    let mut levels = vec![vec![0; width as usize]; height as usize];
    for (row, levels) in (0..).zip(&mut levels) {
        match &*layer.image {
            Image::Mask(mask) => {
                for (start, end) in lamp_stack::white_runs(mask.row(row), width) {
                    levels[start as usize..end as usize].fill(255);
                }
            }
            Image::Gray(gray) => {
                for (start, end, level) in gray_runs(gray.row(row), width) {
                    levels[start as usize..end as usize].fill(level);
                }
            }
        }
    }
    levels
}

/// Returns the sum of all levels in white pixels.
fn white_pixels_of(layer: &Layer) -> f64 {
    let sum = |row: &Vec<u8>| row.iter().map(|&level| u64::from(level)).sum::<u64>();
    levels(layer).iter().map(sum).sum::<u64>() as f64 / 255.0
}

/// Returns a prism over a convex polygon that turns left, 1 mm high.
fn prism(polygon: &[[f32; 2]]) -> Mesh {
    let at = |[x, y]: [f32; 2], z: f32| [x, y, z];
    let mut facets = Vec::new();
    for k in 0..polygon.len() {
        let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
        facets.push([at(a, 0.0), at(b, 0.0), at(b, 1.0)]);
        facets.push([at(a, 0.0), at(b, 1.0), at(a, 1.0)]);
        if k > 0 && k + 1 < polygon.len() {
            facets.push([at(polygon[0], 1.0), at(a, 1.0), at(b, 1.0)]);
            facets.push([at(polygon[0], 0.0), at(b, 0.0), at(a, 0.0)]);
        }
    }
    Mesh { facets }
}

fn area(polygon: &[Point]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0])).sum()
}

/// Returns a polygon cut by the half planes to the left of a convex polygon's edges (Sutherland and
/// Hodgman 1974).
fn clipped(mut polygon: Vec<Point>, by: &[Point]) -> Vec<Point> {
    for (k, &a) in by.iter().enumerate() {
        let b = by[(k + 1) % by.len()];
        let side = |p: Point| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
        let mut kept = Vec::new();
        for (k, &p) in polygon.iter().enumerate() {
            let q = polygon[(k + 1) % polygon.len()];
            let (of_p, of_q) = (side(p), side(q));
            if of_p >= 0.0 {
                kept.push(p);
            }
            if of_p * of_q < 0.0 {
                let t = of_p / (of_p - of_q);
                kept.push([0, 1].map(|axis| p[axis] + t * (q[axis] - p[axis])));
            }
        }
        polygon = kept;
    }
    polygon
}

/// Checks each pixel of a layer against the area of a union of convex polygons within it, by
/// inclusion and exclusion of at most two of them.
fn check(layer: &Layer, polygons: &[Vec<Point>], pitch: f64) {
    let origin = layer.info.origin_mm.unwrap();
    for (r, row) in levels(layer).iter().enumerate() {
        for (c, &level) in row.iter().enumerate() {
            let [x, y] = [origin[0] + c as f64 * pitch, origin[1] - (r + 1) as f64 * pitch];
            let [right, top] = [x + pitch, y + pitch];
            let pixel = vec![[x, y], [right, y], [right, top], [x, top]];
            let mut within: f64 = polygons.iter().map(|it| area(&clipped(pixel.clone(), it))).sum();
            if let [a, b] = polygons {
                within -= area(&clipped(clipped(pixel, a), b));
            }
            let share: f64 = 255.0 * within / (pitch * pitch);
            assert!((share - f64::from(level)).abs() < 0.502, "({c}, {r}): {level}, not {share}");
        }
    }
}

fn as_f64(polygon: &[[f32; 2]]) -> Vec<Point> {
    polygon.iter().map(|point| point.map(f64::from)).collect()
}

/// A regular polygon, turned by an angle in radians.
fn regular(corners: u32, radius: f64, angle: f64, center: Point) -> Vec<[f32; 2]> {
    let corner = |k: u32| {
        let (sin, cos) =
            (angle + f64::from(k) * std::f64::consts::TAU / f64::from(corners)).sin_cos();
        [(center[0] + radius * cos) as f32, (center[1] + radius * sin) as f32]
    };
    (0..corners).map(corner).collect()
}

#[test]
fn levels_are_areas_of_turned_squares() {
    for degrees in [0.0, 1.0, 10.0, 45.0, 89.5] {
        let square = regular(4, 1.7, f64::to_radians(degrees), [0.03, -0.02]);
        let layers = slice(&prism(&square), &eighths());
        check(&layers[0], &[as_f64(&square)], 0.125);
    }
}

proptest! {
    #![proptest_config(cases(60))]

    /// Shells of one file, which unite, with edges that cross in pixels.
    #[test]
    fn levels_are_areas_of_unions(
        corners in [3u32..7, 3u32..7],
        radius in [0.05f64..1.5, 0.05f64..1.5],
        angle in [0.0f64..6.3, 0.0f64..6.3],
        center in [-0.6f64..0.6, -0.6f64..0.6],
        is_inward in any::<bool>(),
    ) {
        let polygon = |k: usize| {
            regular(corners[k], radius[k], angle[k], [center[k], center[1 - k] * 0.7])
        };
        let polygons = [polygon(0), polygon(1)];
        let mesh = joined(&polygons.each_ref().map(|polygon| prism(polygon)));
        let mesh = if is_inward { inside_out(&mesh) } else { mesh };
        let layers = slice(&mesh, &eighths());
        check(&layers[0], &polygons.each_ref().map(|polygon| as_f64(polygon)), 0.125);
    }
}

#[test]
fn walls_thinner_than_pixels_are_as_gray_as_thin() {
    let wall = regular(4, 1.0, 0.3, [0.0, 0.0]);
    let thin: Vec<_> = wall.iter().map(|&[x, y]| [x, y * 0.02]).collect();
    let layers = slice(&prism(&thin), &eighths());
    check(&layers[0], &[as_f64(&thin)], 0.125);
    assert!(levels(&layers[0]).iter().flatten().all(|&level| level < 255));
}

#[test]
fn the_sum_of_levels_is_the_area_of_sections() {
    let pixel = 0.125 * 0.125;
    let mm2 = |layer: &Layer| white_pixels_of(layer) * pixel;
    let ball = sphere(5.0, 300_000);
    let layers = slice(&ball, &eighths());
    for (k, layer) in layers.iter().enumerate() {
        let z = k as f64 + 0.5 - 5.0;
        let exact = std::f64::consts::PI * (25.0 - z * z);
        assert!(
            (mm2(layer) / exact - 1.0).abs() < 4e-4,
            "layer {k}: {} mm2, not {exact}",
            mm2(layer)
        );
    }
    let ring = torus(5.0, 2.0, 300_000);
    let layers = slice(&ring, &eighths());
    for (k, layer) in layers.iter().enumerate() {
        let z = k as f64 + 0.5 - 2.0;
        let exact = 4.0 * std::f64::consts::PI * 5.0 * (4.0 - z * z).sqrt();
        assert!(
            (mm2(layer) / exact - 1.0).abs() < 4e-4,
            "layer {k}: {} mm2, not {exact}",
            mm2(layer)
        );
    }
}

#[test]
fn voids_and_even_odd_take_area_away() {
    let options = SliceOptions { fill: Fill::EvenOdd, ..eighths() };
    let (a, b) = (regular(4, 1.5, 0.2, [0.0, 0.0]), regular(3, 0.7, 1.0, [0.2, 0.1]));
    let (outer, inner) = (prism(&a), prism(&b));
    let layers = slice(&joined(&[outer.clone(), inner.clone()]), &options);
    let [a, b] = [a, b].map(|polygon| as_f64(&polygon));
    let exact = area(&a) - area(&b);
    assert!((white_pixels_of(&layers[0]) * 0.015625 - exact).abs() < 2e-3);
    let hollow = slice(&joined(&[outer, inside_out(&inner)]), &eighths());
    assert_eq!(levels(&hollow[0]), levels(&layers[0]));
}

/// Pixels that no edge passes are as they are without gray.
#[test]
fn only_pixels_at_edges_are_gray() {
    let mesh = turned(&cube_with_hole(6.0, 1.5, 500), [0.3, 0.2, 0.1]);
    let white = slice(&mesh, &SliceOptions { antialias: false, ..eighths() });
    let gray = slice(&mesh, &eighths());
    assert_eq!(white.len(), gray.len());
    for (white, gray) in white.iter().zip(&gray) {
        let white = mask(white);
        let levels = levels(gray);
        let at = |c: i64, r: i64| {
            let is_within = (0..i64::from(white.width())).contains(&c);
            let is_within = is_within && (0..i64::from(white.height())).contains(&r);
            is_within && white.is_white(c as u32, r as u32)
        };
        for (r, row) in levels.iter().enumerate() {
            for (c, &level) in row.iter().enumerate() {
                let (c, r) = (c as i64, r as i64);
                let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (c + dx, r + dy)));
                let white = around.filter(|&(c, r)| at(c, r)).count();
                assert!(white > 0 || level < 128 && (level == 0 || at_edge(&levels, c, r)));
                assert!(white < 9 || level >= 128);
            }
        }
    }
}

/// Whether a pixel has a neighbor of another level.
fn at_edge(levels: &[Vec<u8>], c: i64, r: i64) -> bool {
    let at = |c: i64, r: i64| {
        let row = usize::try_from(r).ok().and_then(|r| levels.get(r));
        row.and_then(|row| row.get(usize::try_from(c).ok()?)).copied().unwrap_or(0)
    };
    (-1..=1).any(|dy| (-1..=1).any(|dx| at(c + dx, r + dy) != at(c, r)))
}

#[test]
fn a_box_on_pixel_edges_is_white() {
    let mesh = block([0.0; 3], [2.0, 1.0, 1.0]);
    let layers = slice(&mesh, &eighths());
    assert!(matches!(*layers[0].image, Image::Mask(_)));
    assert_eq!(white_pixels(&layers[..1]), 16 * 8);
}

/// Levels by depth are multiplied by the shares of pixels.
#[test]
fn levels_by_depth_are_multiplied() {
    let mesh = sphere(3.0, 20_000);
    let options = SliceOptions { plane: PlaneRule::Top, ..eighths() };
    let of_depth = |level: f64| Length::from_um(1000.0 * level);
    let shading = Shading::ByDepth(DepthLevels::new(Length::from_um(1000.0), of_depth).into());
    let by_depth = SliceOptions { shading, ..options.clone() };
    let share = slice(&mesh, &options);
    let depth = slice(&mesh, &SliceOptions { antialias: false, ..by_depth.clone() });
    let both = slice(&mesh, &by_depth);
    let mut outside = 0;
    for ((share, depth), both) in share.iter().zip(&depth).zip(&both) {
        let [share, depth, both] = [share, depth, both].map(levels);
        for (r, row) in both.iter().enumerate() {
            for (c, &level) in row.iter().enumerate() {
                let share = u32::from(share[r][c]);
                let of = |depth: u8| ((share * u32::from(depth) + 127) / 255) as u8;
                if depth[r][c] > 0 || share == 0 {
                    assert_eq!(level, of(depth[r][c]));
                    continue;
                }
                outside += 1;
                let beside = [depth[r][c - 1], depth[r][c + 1], depth[r - 1][c], depth[r + 1][c]];
                let is_alone = beside == [0; 4] && u32::from(level) == share;
                assert!(is_alone || beside.iter().any(|&depth| depth > 0 && level == of(depth)));
            }
        }
    }
    assert!(outside > 200);
}

/// Facets in another order, other numbers of threads and less memory change nothing.
#[test]
fn levels_depend_on_the_part_alone() {
    let mesh = turned(&torus(5.0, 2.0, 4000), [0.5, 0.4, 0.3]);
    let expected = slice(&mesh, &eighths());
    let mut reversed = mesh.clone();
    reversed.facets.reverse();
    for (threads, memory) in [(1, 1), (2, 30_000), (3, 1 << 30)] {
        let options = SliceOptions { memory, ..eighths() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let layers = pool.install(|| slice(&reversed, &options));
        assert!(without_stack(layers) == without_stack(expected.clone()));
    }
}

/// Rows that a missing facet leaves open are as white layers have them, and are stray.
#[test]
fn stray_rows_are_white() {
    let mut mesh = prism(&regular(5, 1.5, 0.1, [0.0, 0.0]));
    mesh.facets.remove(0);
    let white = slice(&mesh, &SliceOptions { antialias: false, ..eighths() });
    let gray = slice(&mesh, &eighths());
    let stray = &gray[0].info.stray_rows;
    assert!(!stray.is_empty() && *stray == white[0].info.stray_rows);
    let (levels, white) = (levels(&gray[0]), mask(&white[0]));
    for &row in stray {
        let expected = (0..white.width()).map(|c| u8::from(white.is_white(c, row)) * 255);
        assert!(levels[row as usize].iter().copied().eq(expected));
    }
}

#[test]
fn a_frame_must_leave_the_last_column_black() {
    let mesh = block([0.0; 3], [1.95, 1.0, 1.0]);
    let frame =
        |pixels| SliceOptions { grid: GridRule::At { origin_mm: [0.0, 1.0], pixels }, ..eighths() };
    assert!(Slices::new(model(&mesh), &frame([17, 8])).is_ok());
    let error = try_layers(model(&mesh), &frame([16, 8])).unwrap_err();
    assert!(matches!(error, SliceError::OutsideFrame { .. }), "{error}");
}
