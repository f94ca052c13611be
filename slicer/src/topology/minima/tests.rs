use lamp_fixtures as parts;
use lamp_fixtures::{Defect, Mesh, inject};
use proptest::prelude::*;

use super::*;
use crate::placement::{Axis, Placement};
use crate::topology::testing::{block, table_of, turned};
use MinimumKind::{Island, Pit};

const UP: [f64; 3] = [0.0, 0.0, 1.0];

/// Height, kind and depth of the minima of a part as it stands.
fn found(mesh: &Mesh) -> Vec<(f64, MinimumKind, f64)> {
    let table = table_of(&mesh.facets);
    minima(&table, UP).iter().map(|m| (m.height_mm, m.kind, m.depth_mm)).collect()
}

#[test]
fn parts_have_the_minima_that_they_document() {
    for facets in [1, 2_000] {
        let base = |height: f64| (0.0, Island, height);
        // The gantry's other post meets the first at the beam.
        let post = base(20.0);
        assert_eq!(found(&parts::mug(facets)), [base(30.0), (2.0, Pit, 28.0), (8.0, Island, 6.0)]);
        assert_eq!(found(&parts::needle(facets)), [base(24.0), post, (10.0, Island, 10.0)]);
        assert_eq!(found(&parts::lying_rod(facets)), [base(24.0), post, (10.0, Island, 10.0)]);
        assert_eq!(found(&parts::ring(facets)), [base(24.0), post, (10.0, Island, 10.0)]);
        let twins = [base(24.0), post, (8.0, Island, 12.0), (10.0, Island, 4.0)];
        assert_eq!(found(&parts::twin_islands(facets)), twins);
        assert_eq!(found(&parts::cup(facets)), [base(12.0), (2.0, Pit, 10.0)]);
        assert_eq!(found(&parts::closed_void(facets)), [base(12.0), (3.0, Pit, 6.0)]);
        assert_eq!(found(&parts::arch(facets)), [base(20.0), base(16.0)]);
        assert_eq!(found(&parts::slanted_wall(0.5, 1.0, facets)), [base(20.0)]);
        // The floors below the second and third leg, and below the last two.
        let floors = [(2.0, Pit, 16.0); 2];
        assert_eq!(found(&parts::serpentine(facets)), [&[base(24.0)][..], &floors].concat());
        let cores = [(8.0, Island, 20.0), (12.0, Island, 16.0)];
        assert_eq!(found(&parts::cavity_core(facets)), [&[base(30.0)][..], &cores].concat());
    }
}

#[test]
fn a_region_is_a_face_a_line_or_a_point() {
    let region = |mesh: Mesh| minima(&table_of(&mesh.facets), UP).pop().unwrap();
    assert_eq!(region(parts::needle(2_000)).point, [0.0, 0.0, 10.0]);
    assert_eq!(region(parts::needle(2_000)).region.len(), 1);
    let table = table_of(&parts::lying_rod(2_000).facets);
    let line = minima(&table, UP).pop().unwrap().region;
    assert!(line.len() > 2 && line.is_sorted());
    assert!(line.iter().all(|&vertex| table.points()[vertex as usize][0] == 0.0));
    assert!(region(parts::ring(2_000)).region.len() > 50);
}

#[test]
fn the_blade_has_the_islands_of_its_images() {
    let table = table_of(&parts::blade(100_000).facets);
    let relief = Relief::new(&table);
    // The layers of 100 um in which islands begin and join, unless these are one.
    let layers = |axis: Axis, degrees: f64, least_mm: f64| -> Vec<[u32; 2]> {
        let placed = Placement::default().rotated(axis, degrees);
        let up = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], UP].map(|unit| placed.at(unit)[2]);
        let heights = relief.heights(up);
        let found = relief.minima(up, &heights, f64::INFINITY);
        let layer = |height_mm: f64| ((height_mm - found[0].height_mm) / 0.1 + 1e-6) as u32;
        let islands = found.iter().skip(1).filter(|m| m.kind == Island && m.depth_mm > least_mm);
        islands.map(|m| [m.height_mm, m.height_mm + m.depth_mm].map(layer)).collect()
    };
    assert_eq!(layers(Axis::X, 0.0, 0.1), [[0; 2]; 0]);
    assert_eq!(layers(Axis::X, 180.0, 0.1), [[80, 312], [150, 262]]);
    assert_eq!(layers(Axis::X, 30.0, 0.1), [[1124, 1153]]);
    assert_eq!(layers(Axis::Y, 90.0, 0.1), [[300, 346], [436, 458]]);
    // An island of 43 um, whose neck is too narrow for pixels at first.
    assert_eq!(layers(Axis::Y, 90.0, 0.04), [[300, 346], [347, 347], [436, 458]]);
}

#[test]
fn what_touches_in_a_point_meets_there() {
    // The second block stands on a corner of the first, according to the vertices.
    let facets = [block([0.0; 3], [1.0; 3]), block([1.0; 3], [2.0; 3])].concat();
    assert_eq!(found(&Mesh { facets }), [(0.0, Island, 2.0)]);
}

#[test]
fn a_mesh_turned_inside_out_has_pits() {
    let facets = turned(&block([0.0; 3], [1.0; 3]));
    assert_eq!(found(&Mesh { facets }), [(0.0, Pit, 1.0)]);
}

#[test]
fn open_flat_and_broken_meshes_get_an_answer() {
    let sheet = vec![[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0f32]]];
    assert_eq!(found(&Mesh { facets: sheet }), [(0.0, Island, 0.0)]);
    let nan = vec![[[f32::NAN; 3], [0.0; 3], [1.0; 3]], [[0.0; 3]; 3]];
    assert_eq!(found(&Mesh { facets: nan }), []);
    let [a, b, c] = [[0.0; 3], [1.0, 0.0, 1.0], [0.0, 1.0, 2.0f32]];
    let crowded = vec![[a, b, c], [a, b, c], [b, a, c], [a, b, [0.0, 0.0, -1.0]]];
    assert_eq!(found(&Mesh { facets: crowded }).len(), 1);
    for defect in [Defect::Drop, Defect::Duplicate, Defect::Flip, Defect::Gap { by_mm: 0.05 }] {
        let mut mesh = parts::mug(2_000);
        inject(&mut mesh, defect, 100, 3);
        assert!(found(&mesh).len() >= 3);
    }
}

/// Finds the depth of a minimum by searching for the height of the lowest path to a lower minimum.
fn depth_by_search(field: &HeightField<'_>, all: &[Minimum], one: usize) -> f64 {
    let heights = field.heights;
    let mut levels: Vec<f64> =
        heights.iter().copied().filter(|&height| height >= all[one].height_mm).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let elder: Vec<u32> = all[..one].iter().flat_map(|m| m.region.clone()).collect();
    let mut top = all[one].height_mm;
    for level in levels {
        let mut reached = all[one].region.clone();
        let mut done = 0;
        while let Some(&vertex) = reached.get(done) {
            done += 1;
            for beside in field.beside(vertex) {
                if field.height(beside) <= level && !reached.contains(&beside) {
                    reached.push(beside);
                }
            }
        }
        if reached.iter().any(|vertex| elder.contains(vertex)) {
            return level - all[one].height_mm;
        }
        top = reached.iter().map(|&vertex| field.height(vertex)).fold(top, f64::max);
    }
    top - all[one].height_mm
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// On a sphere whose vertices rise and fall at random, by few steps so that many are level.
    #[test]
    fn depths_are_those_that_a_search_finds(
        steps in prop::collection::vec(0..6_i32, 64),
        deepest in 0..6_i32,
    ) {
        let mesh = parts::sphere(10.0, 60);
        let table = table_of(&mesh.facets);
        let relief = Relief::new(&table);
        let heights: Vec<f64> =
            (0..table.points().len()).map(|vertex| f64::from(steps[vertex % 64])).collect();
        let all = relief.minima(UP, &heights, f64::INFINITY);
        let field = HeightField { relief: &relief, heights: &heights };
        for (one, minimum) in all.iter().enumerate() {
            prop_assert_eq!(minimum.depth_mm, depth_by_search(&field, &all, one));
        }
        // Depths that are cut off are the same up to the limit.
        let deepest = f64::from(deepest);
        let shallow = relief.minima(UP, &heights, deepest);
        prop_assert_eq!(shallow.len(), all.len());
        for (shallow, all) in shallow.iter().zip(&all) {
            prop_assert_eq!(shallow.depth_mm, all.depth_mm.min(deepest));
        }
    }
}
