use std::collections::{HashMap, HashSet};
use std::num::NonZeroU32;

use lamp_stack::{Compression, GrayMask, Image, Layer, PageHeader, PageInfo, Pitch};
use proptest::prelude::*;

use super::*;

/// Pixels of a tenth of a millimeter.
const DPI: f64 = 254.0;

/// A layer of so many micrometers at a height, with the levels of a solid.
fn layer(
    index: u32,
    [z_um, thickness_um]: [f64; 2],
    [width, height]: [u32; 2],
    level: impl Fn([f64; 3]) -> u8,
) -> Layer {
    let mut gray = GrayMask::new(width);
    for row in 0..height {
        let place = |column: u32| {
            let [x, y] = [f64::from(column), f64::from(height - row) - 1.0];
            [(x + 0.5) * 0.1, (y + 0.5) * 0.1, (z_um + thickness_um / 2.0) / 1e3]
        };
        gray.push_runs((0..width).map(|column| (1, level(place(column))))).unwrap();
    }
    let info = PageInfo {
        index,
        z_um: Some(z_um),
        thickness_um: Some(thickness_um),
        origin_mm: Some([0.0, f64::from(height) * 0.1]),
        ..PageInfo::default()
    };
    Layer { info, pitch: Pitch::of_dpi(DPI), image: Image::Gray(gray).into() }
}

/// Layers of a tenth of a millimeter.
fn stack(layers: u32, size: [u32; 2], level: impl Fn([f64; 3]) -> u8) -> Vec<Layer> {
    let at = |k: u32| layer(k, [f64::from(k) * 100.0, 100.0], size, &level);
    (0..layers).map(at).collect()
}

fn header(layer: &Layer) -> PageHeader {
    PageHeader {
        info: layer.info.clone(),
        pitch: layer.pitch,
        size: [layer.image.width(), layer.image.height()],
        gray: true,
        compression: Compression::PackBits,
        data_bytes: 1000,
        exposed_px: None,
        pages: None,
    }
}

fn options(cells: u32) -> SurfaceOptions {
    let cells = NonZeroU32::new(cells).unwrap();
    SurfaceOptions { cells, layers_a_cell: None, ..SurfaceOptions::default() }
}

fn surface(layers: &[Layer], options: &SurfaceOptions) -> Result<StackSurface, SurfaceError> {
    let headers: Vec<_> = layers.iter().map(header).collect();
    CellGrid::new(&headers, options)?.surface(|position| Ok(&layers[position]))
}

fn white(is_white: bool) -> u8 {
    if is_white { 255 } else { 0 }
}

fn ball([x, y, z]: [f64; 3]) -> u8 {
    white((x - 2.0).powi(2) + (y - 2.0).powi(2) + (z - 2.0).powi(2) < 1.8 * 1.8)
}

const BALL_MM3: f64 = 4.0 / 3.0 * std::f64::consts::PI * 1.8 * 1.8 * 1.8;

fn volume(surface: &StackSurface) -> f64 {
    let six_times = |facet: [[f32; 3]; 3]| {
        let [a, b, c] = facet.map(|corner| corner.map(f64::from));
        a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    surface.facets().map(six_times).sum::<f64>() / 6.0
}

/// Returns how many edges are not run once each way.
fn unbalanced(surface: &StackSurface) -> usize {
    let mut edges: HashMap<[u32; 2], [u32; 2]> = HashMap::new();
    for &[a, b, c] in &surface.triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            edges.entry([from.min(to), from.max(to)]).or_default()[usize::from(from < to)] += 1;
        }
    }
    edges.values().filter(|&&ways| ways != [1, 1]).count()
}

/// Returns how many vertices have triangles that do not form one fan.
fn split_vertices(surface: &StackSurface) -> usize {
    let mut next: HashMap<u32, HashMap<u32, u32>> = HashMap::new();
    for &[a, b, c] in &surface.triangles {
        for [at, from, to] in [[a, b, c], [b, c, a], [c, a, b]] {
            next.entry(at).or_default().insert(from, to);
        }
    }
    let is_one_fan = |around: &HashMap<u32, u32>| {
        let first = *around.keys().next().unwrap();
        let mut at = first;
        let steps = around.keys().take_while(|_| {
            at = around[&at];
            at != first
        });
        steps.count() + 1 == around.len()
    };
    next.values().filter(|around| !is_one_fan(around)).count()
}

fn euler_characteristic(surface: &StackSurface) -> i64 {
    let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
    let edges: HashSet<[u32; 2]> =
        surface.triangles.iter().flat_map(sides).map(|[a, b]| [a.min(b), a.max(b)]).collect();
    let used: HashSet<u32> = surface.triangles.iter().flatten().copied().collect();
    used.len() as i64 - edges.len() as i64 + surface.triangles.len() as i64
}

#[test]
fn a_ball_keeps_its_volume_and_place() {
    let layers = stack(40, [40, 40], ball);
    let found = surface(&layers, &options(40)).unwrap();
    assert_eq!((found.unit, unbalanced(&found)), (SurfaceUnit::Millimetres, 0));
    assert!((volume(&found) / BALL_MM3 - 1.0).abs() < 0.01, "{}", volume(&found));
    assert_eq!(euler_characteristic(&found), 2);
    for (vertex, normal) in found.vertices.iter().zip(&found.normals) {
        let out = vertex.map(|place| place - 2.0);
        let length = out.iter().map(|o| o * o).sum::<f32>().sqrt();
        assert!((length - 1.8).abs() < 0.1, "{vertex:?}");
        let along: f32 = out.iter().zip(normal).map(|(o, n)| o / length * n).sum();
        assert!(along > 0.8, "{vertex:?} {normal:?}");
    }
}

#[test]
fn a_ring_has_a_hole() {
    let ring = |[x, y, z]: [f64; 3]| {
        let from_axis = (x - 3.0).hypot(y - 3.0);
        white((from_axis - 1.9).hypot(z - 1.0) < 0.8)
    };
    let found = surface(&stack(20, [60, 60], ring), &options(60)).unwrap();
    assert_eq!((euler_characteristic(&found), unbalanced(&found)), (0, 0));
}

#[test]
fn larger_cells_and_fewer_layers_keep_the_volume() {
    let layers = stack(40, [41, 43], ball);
    let coarse = surface(&layers, &options(14)).unwrap();
    assert!((volume(&coarse) / BALL_MM3 - 1.0).abs() < 0.05, "{}", volume(&coarse));
    let few = SurfaceOptions { layers_a_cell: NonZeroU32::new(1), ..options(14) };
    let headers: Vec<_> = layers.iter().map(header).collect();
    assert_eq!(CellGrid::new(&headers, &few).unwrap().layers(), 14);
    let thinned = surface(&layers, &few).unwrap();
    assert!((volume(&thinned) / BALL_MM3 - 1.0).abs() < 0.05, "{}", volume(&thinned));
}

#[test]
fn layers_of_any_thickness_stand_where_they_say() {
    let heights = [[1000.0, 50.0], [1050.0, 400.0], [1450.0, 30.0], [1480.0, 520.0]];
    let block = |[x, _, _]: [f64; 3]| white(x < 1.0);
    let layers: Vec<_> = (0..).zip(heights).map(|(k, at)| layer(k, at, [20, 20], block)).collect();
    let found = surface(&layers, &options(20)).unwrap();
    let side = |axis: usize| {
        let places = found.vertices.iter().map(|vertex| vertex[axis]);
        places.fold([f32::MAX, f32::MIN], |[low, high], at| [low.min(at), high.max(at)])
    };
    for (axis, wanted) in [[0.0, 1.0], [0.0, 2.0], [1.0, 2.0]].into_iter().enumerate() {
        let [low, high] = side(axis);
        assert!((low - wanted[0]).abs() < 1e-3 && (high - wanted[1]).abs() < 1e-3, "{low} {high}");
    }
}

#[test]
fn cells_that_touch_at_an_edge_or_a_corner_are_joined() {
    let touch = |cells: &'static [[u32; 3]]| {
        let level = |[x, y, z]: [f64; 3]| {
            let at = [x, y, z].map(|at| (at * 10.0) as u32);
            white(cells.contains(&at))
        };
        surface(&stack(4, [4, 4], level), &options(8)).unwrap()
    };
    for cells in [
        &[[1, 1, 1], [2, 2, 1]][..],
        &[[1, 1, 1], [2, 1, 2]],
        &[[1, 2, 1], [1, 1, 2]],
        &[[1, 1, 1], [2, 2, 2]],
    ] {
        let found = touch(cells);
        assert_eq!((unbalanced(&found), split_vertices(&found)), (0, 0), "{cells:?}");
        assert_eq!(euler_characteristic(&found), 2, "{cells:?}");
    }
    // Cells that do not touch stay apart.
    assert_eq!(euler_characteristic(&touch(&[[0, 0, 0], [2, 0, 0]])), 4);
}

#[test]
fn a_gap_between_layers_is_black() {
    let block = |_| 255;
    let layers: Vec<_> = (0..)
        .zip([[0.0, 500.0], [1000.0, 500.0]])
        .map(|(k, at)| layer(k, at, [10, 10], block))
        .collect();
    let found = surface(&layers, &options(15)).unwrap();
    assert!((volume(&found) - 1.0).abs() < 0.05, "{}", volume(&found));
    assert_eq!(euler_characteristic(&found), 4);
}

#[test]
fn a_stack_without_scale_counts_pixels() {
    let mut layers = stack(10, [10, 10], |_| 255);
    for layer in &mut layers {
        (layer.pitch, layer.info.z_um) = (None, None);
    }
    let found = surface(&layers, &options(10)).unwrap();
    assert_eq!(found.unit, SurfaceUnit::Pixels);
    assert!((volume(&found) - 1000.0).abs() < 30.0, "{}", volume(&found));
    assert!(found.vertices.iter().flatten().all(|at| (-1e-3..=10.001).contains(at)));
}

#[test]
fn what_has_no_surface_says_why() {
    let layers = stack(4, [10, 10], |_| 0);
    assert!(matches!(surface(&layers, &options(10)), Err(SurfaceError::Nothing { .. })));
    let few = SurfaceOptions { max_triangles: 100, ..options(40) };
    let balls = stack(40, [40, 40], ball);
    let refused = surface(&balls, &few);
    assert!(matches!(refused, Err(SurfaceError::TooManyTriangles { most: 100 })));
    let with = |change: &dyn Fn(&mut Layer)| {
        let mut layers = stack(4, [10, 10], |_| 255);
        change(&mut layers[2]);
        surface(&layers, &options(10))
    };
    let wild = [f64::NAN, f64::INFINITY, -1e300, 100.0, 1e10];
    for z in wild {
        let refused = with(&|layer| layer.info.z_um = Some(z));
        assert!(matches!(refused, Err(SurfaceError::Heights { layer: 2 })), "{z}: {refused:?}");
    }
    for origin in [[0.0, f64::NAN], [0.2, 1.0]] {
        let refused = with(&|layer| layer.info.origin_mm = Some(origin));
        assert!(matches!(refused, Err(SurfaceError::Unlike { layer: 2 })), "{origin:?}");
    }
    let refused = with(&|layer| layer.pitch = None);
    assert!(matches!(refused, Err(SurfaceError::Unlike { layer: 2 })));
}

#[test]
fn a_layer_that_grew_is_refused() {
    let layers = stack(4, [10, 10], |_| 255);
    let headers: Vec<_> = layers.iter().map(header).collect();
    let grown = stack(4, [11, 10], |_| 255);
    let grid = CellGrid::new(&headers, &options(10)).unwrap();
    let refused = grid.surface(|position| Ok::<_, SurfaceError>(&grown[position]));
    assert!(matches!(refused, Err(SurfaceError::Grown { layer: 0 })));
}

#[test]
fn the_page_gets_numbers_of_four_bytes() {
    let found = surface(&stack(1, [1, 1], |_| 255), &options(8)).unwrap();
    let bytes = found.to_bytes();
    let [vertices, triangles] = [found.vertices.len(), found.triangles.len()];
    assert_eq!((vertices, triangles), (8, 12));
    assert_eq!(bytes.len(), 16 + 24 * vertices + 12 * triangles);
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    assert_eq!((&bytes[..4], number(4), number(8), number(12)), (&b"LSRF"[..], 1, 8, 12));
    let place = |at: usize| f32::from_bits(number(16 + 4 * at));
    assert_eq!([place(3), place(4), place(5)], found.vertices[1]);
    assert_eq!([place(24), place(25), place(26)], found.normals[0]);
    assert_eq!([0, 1, 2].map(|k| number(16 + 4 * (48 + k))), found.triangles[0]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Levels at random touch along edges and at corners everywhere, over several slabs.
    #[test]
    fn any_surface_is_a_closed_manifold(
        width in 1u32..7,
        height in 1u32..7,
        levels in prop::collection::vec(any::<u8>(), 1..1500),
    ) {
        let layers = (levels.len() as u32).div_ceil(width * height);
        let level = |[x, y, z]: [f64; 3]| {
            let [x, y, z] = [x, y, z].map(|at| (at * 10.0) as usize);
            let place = (z * height as usize + y) * width as usize + x;
            levels.get(place).copied().unwrap_or(0)
        };
        match surface(&stack(layers, [width, height], level), &options(MAX_CELLS)) {
            Ok(found) => {
                prop_assert_eq!((unbalanced(&found), split_vertices(&found)), (0, 0));
                prop_assert!(volume(&found) > 0.0);
                let last = found.vertices.len() as u32;
                prop_assert!(found.triangles.iter().flatten().all(|&vertex| vertex < last));
                let places: HashSet<_> = found.vertices.iter().map(|v| v.map(f32::to_bits)).collect();
                prop_assert_eq!(places.len(), found.vertices.len());
            }
            Err(SurfaceError::Nothing { .. }) => prop_assert!(levels.iter().all(|&l| l < 128)),
            Err(other) => return Err(TestCaseError::fail(other.to_string())),
        }
    }
}
