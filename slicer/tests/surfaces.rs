//! Compares crossings, boxes and extrema on exact surfaces with closed forms.

use std::path::Path;
use std::sync::Arc;

use lamp_brep::{KernelModel, StepModel, Tessellation};
use lamp_fixtures::{StepSample, StepUnit, blade_area_mm2, step};
use lamp_slicing::exact::{FacetPoint, PlacedSurfaces, RowContact, polish};

use crate::kernels::OTHERS;

/// A nanometre, in millimetres.
const NM: f64 = 1e-6;

const AS_IT_IS: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// Rotates the part about all axes, so that nothing lies along the rows.
const ASKEW: [[f64; 4]; 3] =
    [[0.36, 0.48, -0.8, 3.0], [-0.8, 0.6, 0.0, -1.0], [0.48, 0.64, 0.6, 2.0]];

fn at(rows: &[[f64; 4]; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    rows.map(|row| row[0] * x + row[1] * y + row[2] * z + row[3])
}

/// Reads a STEP text with each kernel.
fn kernels(text: &str, chord_mm: f64) -> Vec<(Arc<dyn KernelModel>, Tessellation)> {
    let own: Arc<dyn KernelModel> = Arc::new(StepModel::read(text.as_bytes()).unwrap());
    let meshed = |kernel: Arc<dyn KernelModel>| {
        let mesh = kernel.tessellate(chord_mm).unwrap();
        (kernel, mesh)
    };
    let others = OTHERS.iter().map(|(_, read)| read(text.as_bytes(), 0.0).unwrap().kernel);
    [own].into_iter().chain(others).map(meshed).collect()
}

fn placed(part: StepSample, chord_mm: f64, rows: [[f64; 4]; 3]) -> PlacedSurfaces {
    let model = StepModel::read(step(part, StepUnit::Millimetre).as_bytes()).unwrap();
    let mesh = model.tessellate(chord_mm).unwrap();
    PlacedSurfaces::new(Arc::new(model), Arc::new(mesh), rows)
}

#[test]
fn crossings_of_a_blade_give_its_sections_exactly() {
    // The total length of the rows inside the section times their spacing. Rows that
    // touch the section but no facet are missing.
    let surfaces = placed(StepSample::Blade, 0.02, AS_IT_IS);
    let (step_mm, z_mm) = (0.002, 17.0123);
    let length = |points: &[FacetPoint]| {
        let mut rows: Vec<(f64, f64)> =
            points.iter().map(|point| (point.at_mm[1], point.at_mm[0])).collect();
        rows.sort_by(|a, b| a.partial_cmp(b).unwrap());
        let runs = rows.chunks(2).map(|run| run[1].1 - run[0].1);
        runs.sum::<f64>() * step_mm
    };
    let facets = crossings(&surfaces, z_mm, step_mm);
    let mut exact = facets.clone();
    polish(&surfaces, 0, &mut exact);
    let [before, after] = [&facets, &exact].map(|all| length(all) / blade_area_mm2(z_mm) - 1.0);
    println!("blade: area {before:+.1e} before, {after:+.1e} after");
    assert!(before.abs() > 1e-3 && after.abs() < 1e-4, "{before} {after}");
}

/// Lists the crossings of facets with a plane and equally spaced rows.
fn crossings(surfaces: &PlacedSurfaces, z_mm: f64, step_mm: f64) -> Vec<FacetPoint> {
    let mesh = surfaces.mesh();
    let mut list = Vec::new();
    for (number, facet) in (0u32..).zip(&mesh.facets) {
        let corners = mesh.corners(facet);
        let mut ends = Vec::new();
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            if (a[2] >= z_mm) != (b[2] >= z_mm) {
                let t = (z_mm - a[2]) / (b[2] - a[2]);
                ends.push([0, 1].map(|axis| a[axis] + t * (b[axis] - a[axis])));
            }
        }
        let &[a, b] = &ends[..] else { continue };
        let (low, high) = (a[1].min(b[1]), a[1].max(b[1]));
        for row in (low / step_mm).ceil() as i64..(high / step_mm).ceil() as i64 {
            let y_mm = row as f64 * step_mm;
            let x_mm = a[0] + (y_mm - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            let at_mm = [x_mm, y_mm, z_mm];
            let [p, q, r] = corners;
            let across_x = (q[1] - p[1]) * (r[2] - p[2]) - (q[2] - p[2]) * (r[1] - p[1]);
            let uv = surfaces.chart(number).uv_at(at_mm);
            list.push(FacetPoint::new(number, uv, at_mm, across_x < 0.0));
        }
    }
    list
}

/// Polishes the crossings of a part with many planes. Returns, for each kernel, the greatest
/// errors of the moved crossings before and after, in millimetres, and the share that was kept.
fn errors(
    part: StepSample,
    heights_mm: &[f64],
    x_mm: impl Fn([f64; 3]) -> f64,
) -> Vec<(f64, f64, f64)> {
    let kernels = kernels(&step(part, StepUnit::Millimetre), 0.01).into_iter();
    let placed =
        kernels.map(|(kernel, mesh)| PlacedSurfaces::new(kernel, Arc::new(mesh), AS_IT_IS));
    placed.map(|surfaces| errors_of(&surfaces, heights_mm, &x_mm)).collect()
}

fn errors_of(
    surfaces: &PlacedSurfaces,
    heights_mm: &[f64],
    x_mm: impl Fn([f64; 3]) -> f64,
) -> (f64, f64, f64) {
    let (mut before, mut after): (f64, f64) = (0.0, 0.0);
    let (mut kept, mut all) = (0, 0);
    for &z_mm in heights_mm {
        let facets = crossings(surfaces, z_mm, 0.127);
        let mut exact = facets.clone();
        polish(surfaces, 0, &mut exact);
        for (old, new) in facets.iter().zip(&exact) {
            assert!(old.facet == new.facet && old.at_mm[1..] == new.at_mm[1..]);
            if new.is_exact {
                before = before.max((old.at_mm[0] - x_mm(old.at_mm)).abs());
                after = after.max((new.at_mm[0] - x_mm(new.at_mm)).abs());
            }
        }
        kept += exact.iter().filter(|point| !point.is_exact).count();
        all += exact.len();
    }
    (before, after, f64::from(kept as u32) / f64::from(all as u32))
}

#[test]
fn crossings_of_a_sphere_are_exact_to_a_nanometre() {
    let x_mm = |[x, y, z]: [f64; 3]| {
        let square = 225.0 - y.powi(2) - (z - 15.0).powi(2);
        square.max(0.0).sqrt().copysign(x)
    };
    let heights: Vec<f64> = (1..60).map(|k| 0.5 * f64::from(k) + 0.0123).collect();
    for (before, after, kept) in errors(StepSample::Sphere, &heights, x_mm) {
        println!("sphere: {before} mm before, {after} after, {kept} kept");
        assert!(before > 0.005 && after < NM && kept < 0.02, "{before} {after} {kept}");
    }
}

#[test]
fn crossings_of_a_torus_are_exact_to_a_nanometre() {
    // The nearest of up to four.
    let x_mm = |[x, y, z]: [f64; 3]| {
        let half = (64.0 - (z - 8.0).powi(2)).max(0.0).sqrt();
        let x_at = |radius: f64| (radius * radius - y * y).max(0.0).sqrt().copysign(x);
        let (outer, inner) = (x_at(20.0 + half), x_at(20.0 - half));
        if (outer - x).abs() < (inner - x).abs() { outer } else { inner }
    };
    let heights: Vec<f64> = (1..32).map(|k| 0.5 * f64::from(k) + 0.0123).collect();
    for (before, after, kept) in errors(StepSample::Torus, &heights, x_mm) {
        println!("torus: {before} mm before, {after} after, {kept} kept");
        assert!(before > 0.005 && after < NM && kept < 0.02, "{before} {after} {kept}");
    }
}

#[test]
#[ignore = "it measures a rate, which only a release build has"]
fn how_fast_polish_is() {
    // Two packages compile this file, in folders of different depth.
    let blade = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().find_map(|folder| {
        std::fs::read_to_string(folder.join("shared/data/step/synthetic_cooled_blade.step")).ok()
    });
    let torus = step(StepSample::Torus, StepUnit::Millimetre);
    for (name, text) in [("torus", Some(torus)), ("cooled blade", blade)] {
        let Some(text) = text else { continue };
        for (kernel, mesh) in kernels(&text, 0.01) {
            let surfaces = PlacedSurfaces::new(kernel, Arc::new(mesh), AS_IT_IS);
            let heights = (0..400).map(|k| 0.1 * f64::from(k) + 0.0123);
            let mut list: Vec<FacetPoint> =
                heights.flat_map(|z_mm| crossings(&surfaces, z_mm, 0.02)).collect();
            let start = std::time::Instant::now();
            polish(&surfaces, 0, &mut list);
            let rate = list.len() as f64 / start.elapsed().as_secs_f64();
            let moved = list.iter().filter(|point| point.is_exact).count();
            println!("{name}: {rate:.0} crossings a second, {moved} of {} moved", list.len());
            assert!(moved > 9 * list.len() / 10);
        }
    }
}

#[test]
fn round_parts_reach_exactly_as_far_as_they_do() {
    let is_near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < NM);
    for rows in [AS_IT_IS, ASKEW] {
        let centre = at(&rows, [0.0, 0.0, 15.0]);
        let [low, high] = placed(StepSample::Sphere, 0.02, rows).box_mm().unwrap();
        assert!(is_near(low, centre.map(|c| c - 15.0)), "{low:?}");
        assert!(is_near(high, centre.map(|c| c + 15.0)), "{high:?}");
    }
    let [low, high] = placed(StepSample::Torus, 0.02, AS_IT_IS).box_mm().unwrap();
    assert!(is_near(low, [-28.0, -28.0, 0.0]) && is_near(high, [28.0, 28.0, 16.0]), "{high:?}");
}

#[test]
fn contours_of_a_sphere_turn_at_its_highest_and_lowest_rows() {
    for rows in [AS_IT_IS, ASKEW] {
        let surfaces = placed(StepSample::Sphere, 0.02, rows);
        let centre = at(&rows, [0.0, 0.0, 15.0]);
        // The last plane is above all facets.
        for z in [-14.999f64, -14.9, -3.3, 0.0, 7.7, 14.99, 14.9995] {
            let radius = (225.0 - z * z).sqrt();
            let found = surfaces.extrema(centre[2] + z);
            let [low, high] = &found[..] else { panic!("z {z}: {found:?}") };
            for (extremum, y) in [(low, -radius), (high, radius)] {
                let [x_mm, y_mm, _] = extremum.at_mm;
                assert!((x_mm - centre[0]).abs() < NM && (y_mm - centre[1] - y).abs() < NM);
                // The contour lies towards the other extremum.
                let inwards = -1e-4 * y.signum();
                for (by, is_met) in [(inwards, true), (-inwards, false)] {
                    let contact = extremum.contact(&surfaces, y_mm + by);
                    assert_eq!(contact != RowContact::Nothing, is_met, "z {z}: {contact:?}");
                }
            }
            for by in [1e-6, 1e-4, 0.001] {
                let y = radius - by;
                if by > high.reach_mm {
                    continue;
                }
                let RowContact::Pair(pair) = high.contact(&surfaces, centre[1] + y) else {
                    panic!("z {z} by {by}: not crossed")
                };
                let half = (radius * radius - y * y).max(0.0).sqrt();
                for (point, x) in pair.iter().zip([-half, half]) {
                    assert!((point.at_mm[0] - centre[0] - x).abs() < NM, "z {z} by {by}");
                    assert_eq!(point.enters, x < 0.0);
                }
            }
        }
    }
}
