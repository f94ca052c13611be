//! Parts of which everything is known, read back from STEP.

use std::f64::consts::PI;
use std::sync::Arc;

use lamp_brep::{
    BodyReport, Crossing, Facet, Fate, Kernel, Meets, Placed, StepModel, Tessellation, Turns,
    check, polish,
};
use lamp_fixtures::{StepPart, StepUnit, blade_area_mm2, blade_volume_mm3, step};

fn read(part: StepPart, unit: StepUnit, chord_mm: f64) -> (StepModel, Tessellation) {
    let model = StepModel::read(step(part, unit).as_bytes()).unwrap();
    let mesh = model.tessellate(chord_mm).unwrap();
    (model, mesh)
}

/// A text as each kernel reads it.
fn kernels(text: &str, chord_mm: f64) -> Vec<(Arc<dyn Kernel>, Tessellation)> {
    let own: Arc<dyn Kernel> = Arc::new(StepModel::read(text.as_bytes()).unwrap());
    let meshed = |kernel: Arc<dyn Kernel>| {
        let mesh = kernel.tessellate(chord_mm).unwrap();
        (kernel, mesh)
    };
    [own].into_iter().chain(by_occt(text)).map(meshed).collect()
}

#[cfg(feature = "occt")]
fn by_occt(text: &str) -> Option<Arc<dyn Kernel>> {
    Some(Arc::new(lamp_brep::OcctModel::read(text.as_bytes()).unwrap()))
}

#[cfg(not(feature = "occt"))]
fn by_occt(_: &str) -> Option<Arc<dyn Kernel>> {
    None
}

/// The bodies of a part, which must be right by each kernel and the same to the chord.
fn bodies(part: StepPart, unit: StepUnit, chord_mm: f64) -> Vec<BodyReport> {
    let reports = |(kernel, mesh): &(Arc<dyn Kernel>, Tessellation)| {
        let reports = check(&**kernel, mesh);
        assert!(mesh.findings.is_empty(), "{part:?}: {:?}", mesh.findings);
        for report in &reports {
            assert!(report.faults.is_empty(), "{part:?}: {:?}", report.faults);
        }
        reports
    };
    let by_kernel: Vec<_> = kernels(&step(part, unit), chord_mm).iter().map(reports).collect();
    for other in &by_kernel[1..] {
        assert_eq!(other.len(), by_kernel[0].len(), "{part:?}");
        for (a, b) in by_kernel[0].iter().zip(other) {
            let most_mm3 = chord_mm * a.area_mm2;
            assert!((a.volume_mm3 - b.volume_mm3).abs() < most_mm3, "{part:?}: {a:?} {b:?}");
        }
    }
    by_kernel.into_iter().next().unwrap_or_default()
}

#[test]
fn volumes_come_near_to_closed_forms_in_every_unit() {
    let parts = [
        (StepPart::Sphere, 4.0 / 3.0 * PI * 15f64.powi(3)),
        (StepPart::Torus, 2.0 * PI * PI * 20.0 * 64.0),
        (StepPart::Cone, PI * 225.0 * 30.0 / 3.0),
    ];
    for unit in [StepUnit::Millimetre, StepUnit::Metre, StepUnit::Inch] {
        for (part, volume_mm3) in parts {
            for chord_mm in [0.1, 0.005] {
                let [report] = &bodies(part, unit, chord_mm)[..] else { panic!("one body") };
                let off = report.volume_mm3 / volume_mm3 - 1.0;
                assert!(off < 0.0 && off > -0.5 * chord_mm, "{part:?} {chord_mm}: {off}");
                let off = report.exact_volume_mm3 / volume_mm3 - 1.0;
                // The edge of the cone's foot is a polygon for both of its faces.
                let most = if part == StepPart::Cone { 0.05 * chord_mm } else { 1e-6 };
                assert!(off.abs() < most, "{part:?} {chord_mm}: exact {off}");
            }
        }
    }
}

#[test]
fn parts_of_a_torus_that_meets_itself_are_told_apart() {
    // The profile x = R + a cos v turned around z = a sin v, between the points
    // where x is 0, for the apple; the lemon is what is missing to the whole turn.
    let (major, minor): (f64, f64) = (5.0, 8.0);
    let end = (-major / minor).acos();
    let (sin, cos) = end.sin_cos();
    let apple = PI
        * minor
        * (major * major * 2.0 * sin
            + 2.0 * major * minor * (end + sin * cos)
            + minor * minor * (2.0 * sin - 2.0 / 3.0 * sin.powi(3)));
    let lemon = apple - 2.0 * PI * PI * major * minor * minor;
    for (part, volume_mm3) in [(StepPart::Apple, apple), (StepPart::Lemon, lemon)] {
        for chord_mm in [0.1, 0.005] {
            // OpenCASCADE makes both parts of it one body: see docs/occt.md.
            let (model, mesh) = read(part, StepUnit::Inch, chord_mm);
            let [report] = &check(&model, &mesh)[..] else { panic!("one body") };
            assert!(report.faults.is_empty() && mesh.findings.is_empty(), "{part:?}: {report:?}");
            let off = report.volume_mm3 / volume_mm3 - 1.0;
            assert!(off < 0.0 && off > -chord_mm, "{part:?} {chord_mm}: {off}");
            let off = report.exact_volume_mm3 / volume_mm3 - 1.0;
            assert!(off.abs() < 1e-6, "{part:?} {chord_mm}: exact {off}");
        }
    }
}

#[test]
fn flat_and_slanted_walls_hold_what_they_should() {
    let frustum = PI * 30.0 / 3.0 * (225.0 + 112.5 + 56.25);
    for (part, volume_mm3, most) in
        [(StepPart::Block, 6000.0, 1e-12), (StepPart::Frustum, frustum, 1e-3)]
    {
        let [report] = &bodies(part, StepUnit::Metre, 0.01)[..] else { panic!("one body") };
        for volume in [report.volume_mm3, report.exact_volume_mm3] {
            assert!((volume / volume_mm3 - 1.0).abs() < most, "{part:?}: {volume}");
        }
    }
}

#[test]
fn a_lofted_blade_has_its_sections() {
    let mut before = f64::INFINITY;
    for chord_mm in [0.05, 0.005] {
        let (model, mesh) = read(StepPart::Blade, StepUnit::Inch, chord_mm);
        let report = &check(&model, &mesh)[0];
        assert!(report.faults.is_empty() && mesh.findings.is_empty(), "{report:?}");
        let off = (report.volume_mm3 / blade_volume_mm3() - 1.0).abs();
        // Facets within the chord of a blade that is about 4 mm thick.
        assert!(off < chord_mm / 4.0 && off < before / 3.0, "{chord_mm}: {off}");
        before = off;
        for part in 1..20 {
            let z_mm = 60.0 * f64::from(part) / 20.0 + 0.0123;
            let off = area_mm2(&mesh, z_mm) / blade_area_mm2(z_mm) - 1.0;
            assert!(off.abs() < chord_mm / 2.0, "{chord_mm}, z = {z_mm}: {off}");
        }
    }
}

#[test]
fn crossings_of_a_blade_give_its_sections_exactly() {
    // The length of rows within the section, times their distance. Rows that touch
    // the section but no facet are missing.
    let placed = placed(StepPart::Blade, 0.02, AS_IT_IS);
    let (step_mm, z_mm) = (0.002, 17.0123);
    let length = |crossings: &[Crossing]| {
        let mut rows: Vec<(f64, f64)> = crossings.iter().map(|at| (at.y_mm, at.x_mm)).collect();
        rows.sort_by(|a, b| a.partial_cmp(b).unwrap());
        let runs = rows.chunks(2).map(|run| run[1].1 - run[0].1);
        runs.sum::<f64>() * step_mm
    };
    let facets = crossings(&placed, z_mm, step_mm);
    let mut exact = facets.clone();
    polish(&placed, &mut exact);
    let [before, after] = [&facets, &exact].map(|all| length(all) / blade_area_mm2(z_mm) - 1.0);
    println!("blade: area {before:+.1e} before, {after:+.1e} after");
    assert!(before.abs() > 1e-3 && after.abs() < 1e-4, "{before} {after}");
}

/// The area between the crossings of facets with a plane.
fn area_mm2(mesh: &Tessellation, z_mm: f64) -> f64 {
    let double = |facet: &Facet| {
        let corners = mesh.corners(facet);
        let is_above = corners.map(|corner| corner[2] >= z_mm);
        let cross = |from_above: bool| {
            let k = (0..3)
                .find(|&k| is_above[k] == from_above && is_above[(k + 1) % 3] != from_above)?;
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let t = (z_mm - a[2]) / (b[2] - a[2]);
            Some([0, 1].map(|axis| a[axis] + t * (b[axis] - a[axis])))
        };
        let (Some(p), Some(q)) = (cross(true), cross(false)) else { return 0.0 };
        p[0] * q[1] - q[0] * p[1]
    };
    (mesh.facets.iter().map(double).sum::<f64>() / 2.0).abs()
}

#[test]
fn a_tower_of_all_kinds_of_surfaces_is_closed() {
    for chord_mm in [0.2, 0.02] {
        let [report] = &bodies(StepPart::Tower, StepUnit::Inch, chord_mm)[..] else {
            panic!("one body")
        };
        let [low, high] = report.box_mm;
        let expected = [(low[2], 0.0), (high[2], 76.2), (high[0], 12.7)];
        assert!(expected.iter().all(|(a, b)| (a - b).abs() < 1e-9), "{:?}", report.box_mm);
    }
}

#[test]
fn an_assembly_has_its_parts_in_their_places() {
    let reports = bodies(StepPart::Pair, StepUnit::Inch, 0.01);
    assert_eq!(reports.len(), 2);
    // The second stands on x = 50 mm, at the height of the first one's centre.
    let expected = [[-15.0, -15.0, 0.0], [50.0, -15.0, 0.0]];
    for (report, least) in reports.iter().zip(expected) {
        for k in 0..3 {
            let [low, high] = report.box_mm;
            assert!((low[k] - least[k]).abs() < 0.02, "{:?}", report.box_mm);
            assert!((high[k] - low[k] - 30.0).abs() < 0.04);
        }
    }
}

/// All crossings of facets with a plane and with rows every so far.
fn crossings(placed: &Placed, z_mm: f64, step_mm: f64) -> Vec<Crossing> {
    let mesh = placed.mesh();
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
            let uv = placed.chart(number).uv_at([x_mm, y_mm, z_mm]);
            let [p, q, r] = corners;
            let across_x = (q[1] - p[1]) * (r[2] - p[2]) - (q[2] - p[2]) * (r[1] - p[1]);
            let enters = across_x < 0.0;
            list.push(Crossing {
                facet: number,
                uv,
                x_mm,
                y_mm,
                z_mm,
                enters,
                fate: Fate::OnFacet,
            });
        }
    }
    list
}

/// Polishes the crossings of a part with many planes, and says how far those that
/// moved are from where they should be, in millimetres, before and after, and
/// which part of them was kept; for each kernel.
fn errors(
    part: StepPart,
    heights_mm: &[f64],
    x_mm: impl Fn(&Crossing) -> f64,
) -> Vec<(f64, f64, f64)> {
    let kernels = kernels(&step(part, StepUnit::Millimetre), 0.01).into_iter();
    let placed = kernels.map(|(kernel, mesh)| Placed::new(kernel, Arc::new(mesh), AS_IT_IS));
    placed.map(|placed| errors_of(&placed, heights_mm, &x_mm)).collect()
}

fn errors_of(
    placed: &Placed,
    heights_mm: &[f64],
    x_mm: impl Fn(&Crossing) -> f64,
) -> (f64, f64, f64) {
    let (mut before, mut after): (f64, f64) = (0.0, 0.0);
    let (mut kept, mut all) = (0, 0);
    for &z_mm in heights_mm {
        let facets = crossings(placed, z_mm, 0.127);
        let mut exact = facets.clone();
        polish(placed, &mut exact);
        for (old, new) in facets.iter().zip(&exact) {
            assert!((old.facet, old.y_mm, old.z_mm) == (new.facet, new.y_mm, new.z_mm));
            if new.fate == Fate::Moved {
                before = before.max((old.x_mm - x_mm(old)).abs());
                after = after.max((new.x_mm - x_mm(new)).abs());
            }
        }
        kept += exact.iter().filter(|at| at.fate != Fate::Moved).count();
        all += exact.len();
    }
    (before, after, f64::from(kept as u32) / f64::from(all as u32))
}

/// A nanometre, in millimetres.
const NM: f64 = 1e-6;

#[test]
fn crossings_of_a_sphere_are_exact_to_a_nanometre() {
    let x_mm = |at: &Crossing| {
        let square = 225.0 - at.y_mm.powi(2) - (at.z_mm - 15.0).powi(2);
        square.max(0.0).sqrt().copysign(at.x_mm)
    };
    let heights: Vec<f64> = (1..60).map(|k| 0.5 * f64::from(k) + 0.0123).collect();
    for (before, after, kept) in errors(StepPart::Sphere, &heights, x_mm) {
        println!("sphere: {before} mm before, {after} after, {kept} kept");
        assert!(before > 0.005 && after < NM && kept < 0.02, "{before} {after} {kept}");
    }
}

#[test]
fn crossings_of_a_torus_are_exact_to_a_nanometre() {
    // Of up to four the one that is nearest.
    let x_mm = |at: &Crossing| {
        let half = (64.0 - (at.z_mm - 8.0).powi(2)).max(0.0).sqrt();
        let x = |radius: f64| {
            let x = (radius * radius - at.y_mm * at.y_mm).max(0.0).sqrt();
            x.copysign(at.x_mm)
        };
        let (outer, inner) = (x(20.0 + half), x(20.0 - half));
        if (outer - at.x_mm).abs() < (inner - at.x_mm).abs() { outer } else { inner }
    };
    let heights: Vec<f64> = (1..32).map(|k| 0.5 * f64::from(k) + 0.0123).collect();
    for (before, after, kept) in errors(StepPart::Torus, &heights, x_mm) {
        println!("torus: {before} mm before, {after} after, {kept} kept");
        assert!(before > 0.005 && after < NM && kept < 0.02, "{before} {after} {kept}");
    }
}

#[test]
#[ignore = "it measures a rate, which only a release build has"]
fn how_fast_polish_is() {
    let blade = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/step/");
    let blade = std::fs::read_to_string(format!("{blade}synthetic_cooled_blade.step"));
    let torus = step(StepPart::Torus, StepUnit::Millimetre);
    for (name, text) in [("torus", Some(torus)), ("cooled blade", blade.ok())] {
        let Some(text) = text else { continue };
        for (kernel, mesh) in kernels(&text, 0.01) {
            let placed = Placed::new(kernel, Arc::new(mesh), AS_IT_IS);
            let heights = (0..400).map(|k| 0.1 * f64::from(k) + 0.0123);
            let mut list: Vec<Crossing> =
                heights.flat_map(|z_mm| crossings(&placed, z_mm, 0.02)).collect();
            let start = std::time::Instant::now();
            polish(&placed, &mut list);
            let rate = list.len() as f64 / start.elapsed().as_secs_f64();
            let moved = list.iter().filter(|at| at.fate == Fate::Moved).count();
            println!("{name}: {rate:.0} crossings a second, {moved} of {} moved", list.len());
            assert!(moved > 9 * list.len() / 10);
        }
    }
}

fn placed(part: StepPart, chord_mm: f64, rows: [[f64; 4]; 3]) -> Placed {
    let (model, mesh) = read(part, StepUnit::Millimetre, chord_mm);
    Placed::new(Arc::new(model), Arc::new(mesh), rows)
}

/// Turned about all axes, so that nothing lies along the rows.
const ASKEW: [[f64; 4]; 3] =
    [[0.36, 0.48, -0.8, 3.0], [-0.8, 0.6, 0.0, -1.0], [0.48, 0.64, 0.6, 2.0]];

const AS_IT_IS: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

fn at(rows: &[[f64; 4]; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    rows.map(|row| row[0] * x + row[1] * y + row[2] * z + row[3])
}

#[test]
fn round_parts_reach_exactly_as_far_as_they_do() {
    let is_near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < NM);
    for rows in [AS_IT_IS, ASKEW] {
        let centre = at(&rows, [0.0, 0.0, 15.0]);
        let [low, high] = placed(StepPart::Sphere, 0.02, rows).box_mm().unwrap();
        assert!(is_near(low, centre.map(|c| c - 15.0)), "{low:?}");
        assert!(is_near(high, centre.map(|c| c + 15.0)), "{high:?}");
    }
    let [low, high] = placed(StepPart::Torus, 0.02, AS_IT_IS).box_mm().unwrap();
    assert!(is_near(low, [-28.0, -28.0, 0.0]) && is_near(high, [28.0, 28.0, 16.0]), "{high:?}");
}

#[test]
fn contours_of_a_sphere_turn_at_its_highest_and_lowest_rows() {
    for rows in [AS_IT_IS, ASKEW] {
        let placed = placed(StepPart::Sphere, 0.02, rows);
        let centre = at(&rows, [0.0, 0.0, 15.0]);
        let turns = Turns::find(&placed);
        // The last one is higher than any facet.
        for z in [-14.999f64, -14.9, -3.3, 0.0, 7.7, 14.99, 14.9995] {
            let radius = (225.0 - z * z).sqrt();
            let found = turns.at(&placed, centre[2] + z);
            let places: Vec<_> = found.iter().map(|turn| (turn.at_mm, turn.leaves)).collect();
            let &[(low, up), (high, down)] = &places[..] else { panic!("z {z}: {places:?}") };
            assert!((low[1] - centre[1] + radius).abs() < NM && up == 1.0);
            assert!((high[1] - centre[1] - radius).abs() < NM && down == -1.0);
            assert!((low[0] - centre[0]).abs() < NM && (high[0] - centre[0]).abs() < NM);
            for by in [1e-6, 1e-4, 0.001] {
                let y = radius - by;
                if by > found[1].reach_mm {
                    continue;
                }
                let Meets::Pair(pair) = turns.at_turn(&placed, &found[1], centre[1] + y) else {
                    panic!("z {z} by {by}: not crossed")
                };
                let half = (radius * radius - y * y).max(0.0).sqrt();
                for (crossing, x) in pair.iter().zip([-half, half]) {
                    assert!((crossing.x_mm - centre[0] - x).abs() < NM, "z {z} by {by}");
                    assert_eq!(crossing.enters, x < 0.0);
                }
            }
            let beyond = turns.at_turn(&placed, &found[1], centre[1] + radius + 1e-4);
            assert_eq!(beyond, Meets::Nothing);
        }
    }
}
