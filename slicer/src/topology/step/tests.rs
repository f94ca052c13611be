use lamp_fixtures as parts;
use lamp_fixtures::{Defect, Mesh, inject};

use super::*;
use crate::facet::{Facet, Units};
use crate::open::{KernelName, OpenOptions};
use crate::part::Part;
use crate::placement::Placement;
use crate::topology::testing::{block, table_of, turned};

/// The facets and kilobytes of 002 table 3.
const TABLE_3: [[f64; 2]; 7] = [
    [12.0, 12.0],
    [24.0, 24.0],
    [540.0, 593.0],
    [2376.0, 2935.0],
    [2376.0, 2935.0],
    [3872.0, 4763.0],
    [6162.0, 7668.0],
];

/// Returns the slope and the intercept of the line that best fits points.
fn fit(points: &[[f64; 2]]) -> [f64; 2] {
    let count = points.len() as f64;
    let mean = [0, 1].map(|k| points.iter().map(|point| point[k]).sum::<f64>() / count);
    let moment = |k: usize| points.iter().map(|p| (p[0] - mean[0]) * (p[k] - mean[k])).sum::<f64>();
    let slope = moment(1) / moment(0);
    [slope, mean[1] - slope * mean[0]]
}

fn step(mesh: &Mesh) -> (String, usize) {
    let table = table_of(&mesh.facets);
    let solids = StepSolids::new(table).unwrap();
    let mut text = Vec::new();
    solids.write("part", &mut text).unwrap();
    (String::from_utf8(text).unwrap(), solids.faces())
}

/// The volume of a STEP file, and the number of its bodies.
fn volume(text: &str, kernel: KernelName) -> (f64, usize) {
    let options = OpenOptions { kernel, ..OpenOptions::default() };
    let part = Part::from_step("part", text.as_bytes().to_vec(), &options).unwrap();
    let table = CornerTable::of_part(&part, &Placement::default(), Units::Millimetres).unwrap();
    let check = MeshCheck::new(&table);
    let volumes = check.lumps.iter().map(|lump| lump.mass.as_ref().unwrap().volume_mm3);
    (volumes.sum(), table.bodies().count())
}

fn kernels() -> Vec<KernelName> {
    vec![
        KernelName::Lamp,
        #[cfg(feature = "occt")]
        KernelName::Occt,
    ]
}

fn assert_same_volume(mesh: &Mesh, text: &str) {
    for kernel in kernels() {
        let (found, _) = volume(text, kernel);
        let exact = mesh.volume_mm3();
        assert!((found / exact - 1.0).abs() < 1e-9, "{kernel:?}: {found} for {exact}");
    }
}

#[test]
fn a_facet_takes_less_than_half_of_what_table_3_says() {
    let [per_facet, first] = fit(&TABLE_3);
    assert_eq!((per_facet * 1e3).round(), 1246.0);
    assert_eq!(((per_facet * 5.5e6 + first) / 1e4).round(), 685.0);
    // No facets of a ball are in one plane, except at its poles.
    let ball = parts::sphere(15.0, 6_162);
    let (text, faces) = step(&ball);
    assert!(faces as f64 > 0.9 * ball.facets.len() as f64);
    let kilobytes = text.len() as f64 / 1e3 / ball.facets.len() as f64;
    assert!(kilobytes < per_facet / 2.0, "{kilobytes}");
    assert_same_volume(&ball, &text);
}

#[test]
fn flat_sides_are_single_faces() {
    // The same sides and corners as the part, for any number of facets.
    let has = |part: fn(usize) -> Mesh, faces: usize, corners: usize| {
        for facets in [1, 3_000] {
            let mesh = part(facets);
            let (text, found) = step(&mesh);
            assert_eq!((found, text.matches("CARTESIAN_POINT").count()), (faces, corners));
            assert_same_volume(&mesh, &text);
        }
    };
    has(parts::cup, 11, 16);
    has(parts::closed_void, 12, 16);
    has(parts::arch, 10, 16);
    has(parts::ring, 25, 48);
}

#[test]
fn solids_have_their_voids_and_faces_their_holes() {
    let (void, _) = step(&parts::closed_void(1));
    assert!(void.contains("BREP_WITH_VOIDS('',#") && void.contains("ORIENTED_CLOSED_SHELL"));
    let (hole, _) = step(&parts::cube_with_hole(20.0, 5.0, 500));
    assert_eq!(hole.matches("FACE_BOUND('',").count(), 2);
    assert_same_volume(&parts::cube_with_hole(20.0, 5.0, 500), &hole);
    let far = parts::cup(1).map(|[x, y, z]| [x + 50.0, y, z]);
    let both = Mesh { facets: [parts::cup(1).facets, far.facets].concat() };
    let (two, _) = step(&both);
    assert_eq!(two.matches("FACETED_BREP('',").count(), 2);
    for kernel in kernels() {
        assert_eq!(volume(&two, kernel).1, 2);
    }
}

/// A slab whose top has two dents, with rims that touch in one point.
fn dented() -> Mesh {
    const SIDE: usize = 4;
    let node = |x: usize, y: usize, z: f32| {
        let is_dent = z > 0.0 && matches!((x, y), (1, 1) | (3, 3));
        [x as f32, y as f32, if is_dent { z - 0.5 } else { z }]
    };
    let mut facets: Vec<Facet> = Vec::new();
    let mut quad = |[a, b, c, d]: [[f32; 3]; 4]| facets.extend([[a, b, c], [a, c, d]]);
    for (x, y) in (0..SIDE * SIDE).map(|k| (k % SIDE, k / SIDE)) {
        let around = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
        quad(around.map(|(x, y)| node(x, y, 1.0)));
        quad([0, 3, 2, 1].map(|k| around[k]).map(|(x, y)| node(x, y, 0.0)));
    }
    for k in 0..SIDE {
        let sides = [
            [(k, 0), (k + 1, 0)],
            [(SIDE, k), (SIDE, k + 1)],
            [(k + 1, SIDE), (k, SIDE)],
            [(0, k + 1), (0, k)],
        ];
        for [(x, y), (u, v)] in sides {
            quad([node(x, y, 0.0), node(u, v, 0.0), node(u, v, 1.0), node(x, y, 1.0)]);
        }
    }
    Mesh { facets }
}

#[test]
fn a_face_that_touches_itself_stays_in_facets() {
    let mesh = dented();
    let (text, faces) = step(&mesh);
    let top = mesh.facets.iter().filter(|facet| facet.iter().all(|corner| corner[2] > 0.0)).count();
    // Its dents have at least four flat sides each.
    assert!(faces > 5 + 8 && faces <= 5 + top, "{faces} {top}");
    assert_same_volume(&mesh, &text);
}

#[test]
fn what_is_no_solid_is_refused() {
    let refused = |mesh: &Mesh| StepSolids::new(table_of(&mesh.facets)).unwrap_err();
    for (defect, is_open) in [(Defect::Drop, true), (Defect::Flip, false)] {
        let mut mesh = parts::sphere(5.0, 500);
        inject(&mut mesh, defect, 3, 1);
        assert_eq!(matches!(refused(&mesh), NoSolid::Open { .. }), is_open, "{defect:?}");
    }
    let inwards = Mesh { facets: turned(&block([0.0; 3], [1.0; 3])) };
    assert!(matches!(refused(&inwards), NoSolid::Faulty { shells: 1, .. }));
    let mut nan = parts::sphere(5.0, 500);
    nan.facets.push([[f32::NAN; 3]; 3]);
    assert!(matches!(refused(&nan), NoSolid::Faulty { flat: 1.., .. }));
}

/// All coordinates of a file, by axis, sorted and each once.
fn coordinates(text: &str) -> [Vec<f64>; 3] {
    let points = text.lines().filter_map(|line| line.split_once("CARTESIAN_POINT('',("));
    let points: Vec<Vec<f64>> = points
        .map(|(_, numbers)| {
            let numbers = numbers.trim_end_matches([')', ';']);
            numbers.split(',').map(|number| number.parse().unwrap()).collect()
        })
        .collect();
    [0, 1, 2].map(|axis| {
        let mut along: Vec<f64> = points.iter().map(|point| point[axis]).collect();
        along.sort_by(f64::total_cmp);
        along.dedup();
        along
    })
}

/// The volume of a file's only body, by its surfaces.
fn exact_volume(text: &str) -> f64 {
    let read = lamp_brep::prepare(text.as_bytes(), lamp_brep::read_step, 0.01).unwrap();
    assert!(read.is_good() && read.reports.len() == 1, "{:?}", read.reports);
    read.reports[0].exact_volume_mm3
}

/// A stair of blocks as one shell: an outline of steps in x and z, as wide as `y`.
fn stair(x: &[f64], y: [f64; 2], z: &[f64]) -> Mesh {
    let mut facets: Vec<Facet> = Vec::new();
    let mut quad = |corners: [[f64; 3]; 4]| {
        let [a, b, c, d] = corners.map(|corner| corner.map(|c| c as f32));
        facets.extend([[a, b, c], [a, c, d]]);
    };
    let steps = z.len() - 1;
    // Column k reaches from the lowest height up to z[steps - k].
    let is_in = |k: usize, row: usize| k < steps && row < steps - k;
    for k in 0..steps {
        for row in 0..steps - k {
            let ([x0, x1], [z0, z1]) = ([x[k], x[k + 1]], [z[row], z[row + 1]]);
            quad([[x0, y[0], z0], [x1, y[0], z0], [x1, y[0], z1], [x0, y[0], z1]]);
            quad([[x0, y[1], z0], [x0, y[1], z1], [x1, y[1], z1], [x1, y[1], z0]]);
            if row == 0 {
                quad([[x0, y[0], z0], [x0, y[1], z0], [x1, y[1], z0], [x1, y[0], z0]]);
            }
            if k == 0 {
                quad([[x0, y[0], z0], [x0, y[0], z1], [x0, y[1], z1], [x0, y[1], z0]]);
            }
            if !is_in(k, row + 1) {
                quad([[x0, y[0], z1], [x1, y[0], z1], [x1, y[1], z1], [x0, y[1], z1]]);
            }
            if !is_in(k + 1, row) {
                quad([[x1, y[0], z0], [x1, y[1], z0], [x1, y[1], z1], [x1, y[0], z1]]);
            }
        }
    }
    Mesh { facets }
}

#[test]
fn files_hold_the_decimals_that_were_meant() {
    let mut numbers = lamp_fixtures::SplitMix(23);
    // Whole micrometers, up to a meter from the origin: 32 bits distinguish them up to 8 m.
    for _ in 0..40 {
        let steps = 2 + numbers.below(6);
        let mut along = |most: usize| -> Vec<f64> {
            let mut at = numbers.below(most) as f64 / 1e3 - most as f64 / 2e3;
            (0..=steps)
                .map(|_| {
                    at += (1 + numbers.below(3000)) as f64 / 1e3;
                    (at * 1e3).round() / 1e3
                })
                .collect()
        };
        let [x, y, z] = [along(2_000_000), along(100_000), along(1_000)];
        let y = [y[0], y[1]];
        let mesh = stair(&x, y, &z);
        let (text, faces) = step(&mesh);
        assert_eq!(coordinates(&text), [x.clone(), y.to_vec(), z.clone()]);
        assert_eq!(faces, 2 * steps + 4);
        let areas = (0..steps).map(|k| (x[k + 1] - x[k]) * (z[steps - k] - z[0]));
        let meant = areas.sum::<f64>() * (y[1] - y[0]);
        let found = exact_volume(&text);
        assert!((found / meant - 1.0).abs() < 1e-10, "{found} {meant}");
    }
}

#[test]
fn slanted_sides_stay_flat_and_slivers_join_their_neighbours() {
    // A wedge whose slanted side has vertices that only decimals align.
    let [a, b, c] = [[0.0, 0.0, 0.1f32], [7.0, 0.0, 0.1], [0.0, 0.0, 2.2]];
    let back = |[x, _, z]: [f32; 3]| [x, 5.0, z];
    let on = [[2.0, 0.0, 1.6f32], [4.0, 0.0, 1.0], [6.0, 0.0, 0.4]];
    let line: Vec<_> = [c].into_iter().chain(on).chain([b]).collect();
    let [d, e, f] = [a, b, c].map(back);
    let mut facets = vec![[d, f, e], [a, e, b], [a, d, e], [a, f, d], [a, c, f], [a, b, c]];
    // The slanted side uses the vertices; the front has slivers along its edge.
    facets.extend(line.windows(2).map(|side| [side[0], side[1], e]));
    facets.push([c, e, f]);
    facets.extend((1..4).map(|k| [b, line[k], line[k - 1]]));
    let mesh = Mesh { facets };
    let table = table_of(&mesh.facets);
    assert_eq!(MeshCheck::new(&table).loops.len(), 0);
    let (text, faces) = step(&mesh);
    assert_eq!((faces, text.matches("CARTESIAN_POINT").count()), (5, 6));
    // Normals have eleven digits.
    assert!((exact_volume(&text) - 0.5 * 7.0 * 2.1 * 5.0).abs() < 1e-8);
}

#[test]
fn a_surface_through_itself_is_refused_and_solids_through_each_other_are_not() {
    // A tower that leans through the floor that it stands on.
    let cube = block([0.0; 3], [4.0; 3]);
    let bar = block([1.0, 1.0, -1.0], [2.0, 2.0, 5.0]);
    let both = Mesh { facets: [cube.clone(), bar].concat() };
    let (text, _) = step(&both);
    assert_eq!(text.matches("FACETED_BREP('',").count(), 2);
    // The lid's middle is pushed through the floor.
    let push = |depth: f32| {
        let mut facets = cube.clone();
        let lid: Vec<Facet> = facets.drain(2..4).collect();
        let middle = [2.0, 2.0, depth];
        let [p, q, r, s] = [lid[0][0], lid[0][1], lid[0][2], lid[1][2]];
        facets.extend([[p, q, middle], [q, r, middle], [r, s, middle], [s, p, middle]]);
        StepSolids::new(table_of(&facets))
    };
    assert!(push(0.5).is_ok());
    assert!(push(-1e-6).is_ok(), "the rounding of 32 bits is no crossing");
    for depth in [-0.01, -1.0] {
        let NoSolid::Crossed { at_mm: [x, y, z], depth_mm, pairs, .. } = push(depth).unwrap_err()
        else {
            panic!("the surface passes through itself")
        };
        let is_there = (x - 2.0).abs() < 0.5 && (y - 2.0).abs() < 0.5 && z.abs() < 1e-6;
        assert!(is_there && depth_mm > 0.001 && pairs > 0, "{x} {y} {z} {depth_mm}");
    }
    // A cavity that leaves its block is not a solid, either.
    let cavity = turned(&block([1.0, 1.0, 1.0], [3.0, 3.0, 5.0]));
    assert!(StepSolids::new(table_of(&[cube, cavity].concat())).is_err());
}

/// Returns a block of 4 by 4 by 4 of a grid of unit cells, with a pit in one of them down to a
/// height. The pit's walls have no vertices between.
fn pitted(low: f32) -> Vec<Facet> {
    let quad = |[a, b, c, d]: [[f32; 3]; 4]| [[a, b, c], [a, c, d]];
    let floor = |x: f32, y: f32, z: f32| {
        quad([[x, y, z], [x + 1.0, y, z], [x + 1.0, y + 1.0, z], [x, y + 1.0, z]])
    };
    let wall = |[a, b]: [[f32; 2]; 2], [low, high]: [f32; 2]| {
        quad([[a[0], a[1], low], [b[0], b[1], low], [b[0], b[1], high], [a[0], a[1], high]])
    };
    let mut facets = Vec::new();
    for (x, y) in (0..16).map(|k| ((k % 4) as f32, (k / 4) as f32)) {
        facets.extend(floor(x, y, if (x, y) == (1.0, 1.0) { low } else { 4.0 }));
        facets.extend(turned(&floor(x, y, 0.0)));
    }
    for k in [0.0, 1.0, 2.0, 3.0f32] {
        let (from, to) = (4.0 - k, 3.0 - k);
        let sides = [
            [[k, 0.0], [k + 1.0, 0.0]],
            [[4.0, k], [4.0, k + 1.0]],
            [[from, 4.0], [to, 4.0]],
            [[0.0, from], [0.0, to]],
        ];
        facets.extend(sides.into_iter().flat_map(|side| wall(side, [0.0, 4.0])));
    }
    let around = [[1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [2.0, 1.0], [1.0, 1.0]];
    facets.extend(around.windows(2).flat_map(|side| wall([side[0], side[1]], [low, 4.0])));
    facets
}

#[test]
fn a_surface_through_itself_exactly_along_edges_is_refused() {
    assert!(StepSolids::new(table_of(&pitted(1.0))).is_ok());
    for low in [-1.0, -0.01] {
        let found = StepSolids::new(table_of(&pitted(low))).unwrap_err();
        let NoSolid::Wound { at_mm: [x, y, z], .. } = found else { panic!("{found}") };
        // In the cell of the pit, at the floor or below.
        assert!((1.0..2.0).contains(&x) && (1.0..2.0).contains(&y) && z < 0.1, "{x} {y} {z}");
    }
}

#[test]
fn numbers_and_texts_are_those_of_step() {
    let real = |number: f64| entities::StepReal(number).to_string();
    assert_eq!([0.0, -0.0, 1.0, -2.5].map(real), ["0.", "0.", "1.", "-2.5"]);
    assert_eq!(
        [1e-7, -1.5e20, 12.41950798034668].map(real),
        ["1.E-7", "-1.5E20", "12.41950798034668"]
    );
    for number in [1e-5, 0.1 + 0.2, 1e15, 123456.789e3, 5e-324, f64::MAX] {
        assert_eq!(real(number).parse(), Ok(number));
    }
    assert_eq!(text("it's a \\ Öl"), "it''s a \\\\ \\X2\\00D6\\X0\\l");
}
