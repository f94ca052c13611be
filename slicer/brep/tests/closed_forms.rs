//! Compares STEP parts with their closed forms: volumes, areas and positions.

use std::f64::consts::PI;
use std::sync::Arc;

use lamp_brep::{BodyReport, BrepFacet, KernelModel, StepModel, Tessellation, check};
use lamp_fixtures::{
    StepSample, StepUnit, blade_area_mm2, blade_volume_mm3, step, step_behind_tip, step_thin_tube,
};

use crate::kernels::OTHERS;

fn read(part: StepSample, unit: StepUnit, chord_mm: f64) -> (StepModel, Tessellation) {
    let model = StepModel::read(step(part, unit).as_bytes()).unwrap();
    let mesh = model.tessellate(chord_mm).unwrap();
    (model, mesh)
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

/// Returns a part's bodies, after checking that all kernels agree within the chord.
fn bodies(part: StepSample, unit: StepUnit, chord_mm: f64) -> Vec<BodyReport> {
    let reports = |(kernel, mesh): &(Arc<dyn KernelModel>, Tessellation)| {
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

/// Returns the greatest relative error of the volume of surfaces: the error of patches of second
/// degree is of the fourth order in the facets' size, so of the second in the chord.
fn patched(chord_mm: f64) -> f64 {
    1e-2 * chord_mm * chord_mm
}

#[test]
fn volumes_come_near_to_closed_forms_in_every_unit() {
    let parts = [
        (StepSample::Sphere, 4.0 / 3.0 * PI * 15f64.powi(3)),
        (StepSample::Torus, 2.0 * PI * PI * 20.0 * 64.0),
        (StepSample::Cone, PI * 225.0 * 30.0 / 3.0),
    ];
    for unit in [StepUnit::Millimetre, StepUnit::Metre, StepUnit::Inch] {
        for (part, volume_mm3) in parts {
            for chord_mm in [0.1, 0.005] {
                let [report] = &bodies(part, unit, chord_mm)[..] else { panic!("one body") };
                let off = report.volume_mm3 / volume_mm3 - 1.0;
                assert!(off < 0.0 && off > -0.5 * chord_mm, "{part:?} {chord_mm}: {off}");
                let off = report.exact_volume_mm3 / volume_mm3 - 1.0;
                // The edge at the cone's foot is a polygon for both faces.
                let most =
                    if part == StepSample::Cone { 0.05 * chord_mm } else { patched(chord_mm) };
                assert!(off.abs() < most, "{part:?} {chord_mm}: exact {off}");
            }
        }
    }
}

#[test]
fn parts_of_a_torus_that_meets_itself_are_told_apart() {
    // The apple is the profile x = R + a cos v, z = a sin v revolved about z, between
    // the points where x is 0; the lemon is the rest of the full turn.
    let (major, minor): (f64, f64) = (5.0, 8.0);
    let end = (-major / minor).acos();
    let (sin, cos) = end.sin_cos();
    let apple = PI
        * minor
        * (major * major * 2.0 * sin
            + 2.0 * major * minor * (end + sin * cos)
            + minor * minor * (2.0 * sin - 2.0 / 3.0 * sin.powi(3)));
    let lemon = apple - 2.0 * PI * PI * major * minor * minor;
    for (part, volume_mm3) in [(StepSample::Apple, apple), (StepSample::Lemon, lemon)] {
        for chord_mm in [0.1, 0.005] {
            // OpenCASCADE makes both parts one body: see docs/occt.md.
            let (model, mesh) = read(part, StepUnit::Inch, chord_mm);
            let [report] = &check(&model, &mesh)[..] else { panic!("one body") };
            assert!(report.faults.is_empty() && mesh.findings.is_empty(), "{part:?}: {report:?}");
            let off = report.volume_mm3 / volume_mm3 - 1.0;
            assert!(off < 0.0 && off > -chord_mm, "{part:?} {chord_mm}: {off}");
            let off = report.exact_volume_mm3 / volume_mm3 - 1.0;
            // The lemon is small compared with its curvature.
            assert!(off.abs() < 10.0 * patched(chord_mm), "{part:?} {chord_mm}: exact {off}");
        }
    }
}

#[test]
fn a_cone_behind_its_tip_holds_what_the_one_before_it_does() {
    let frustum = PI * 30.0 / 3.0 * (225.0 + 112.5 + 56.25);
    for (kernel, mesh) in kernels(&step_behind_tip(), 0.01) {
        let [report] = &check(&*kernel, &mesh)[..] else { panic!("one body") };
        assert!(report.faults.is_empty() && mesh.findings.is_empty(), "{report:?}");
        assert!((report.volume_mm3 / frustum - 1.0).abs() < 1e-3, "{report:?}");
        assert!((report.exact_volume_mm3 / frustum - 1.0).abs() < 1e-4, "{report:?}");
    }
}

#[test]
fn a_wall_thinner_than_the_chord_keeps_its_sides_apart() {
    // Chords of the outer circle cross the inner one, unless its edges get more points.
    for (wall_mm, chord_mm) in [(0.02, 0.05), (0.05, 0.2), (0.01, 0.01), (0.01, 0.001)] {
        let model = StepModel::read(step_thin_tube(wall_mm).as_bytes()).unwrap();
        let mesh = model.tessellate(chord_mm).unwrap();
        let [report] = &check(&model, &mesh)[..] else { panic!("one body") };
        assert!(report.faults.is_empty(), "{wall_mm} {chord_mm}: {:?}", report.faults);
        let off = report.exact_volume_mm3 / (PI * 64.0 * 5.0) - 1.0;
        assert!(off.abs() < 1e-3, "{wall_mm} {chord_mm}: {off}");
    }
}

#[test]
fn flat_and_slanted_walls_hold_what_they_should() {
    let frustum = PI * 30.0 / 3.0 * (225.0 + 112.5 + 56.25);
    for (part, volume_mm3, most) in
        [(StepSample::Block, 6000.0, 1e-12), (StepSample::Frustum, frustum, 1e-3)]
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
        let (model, mesh) = read(StepSample::Blade, StepUnit::Inch, chord_mm);
        let report = &check(&model, &mesh)[0];
        assert!(report.faults.is_empty() && mesh.findings.is_empty(), "{report:?}");
        let off = (report.volume_mm3 / blade_volume_mm3() - 1.0).abs();
        // Facets are within the chord; the blade is about 4 mm thick.
        assert!(off < chord_mm / 4.0 && off < before / 3.0, "{chord_mm}: {off}");
        before = off;
        for part in 1..20 {
            let z_mm = 60.0 * f64::from(part) / 20.0 + 0.0123;
            let off = area_mm2(&mesh, z_mm) / blade_area_mm2(z_mm) - 1.0;
            assert!(off.abs() < chord_mm / 2.0, "{chord_mm}, z = {z_mm}: {off}");
        }
    }
}

/// Returns the area of the facets' section with a plane.
fn area_mm2(mesh: &Tessellation, z_mm: f64) -> f64 {
    let double = |facet: &BrepFacet| {
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
        let [report] = &bodies(StepSample::Tower, StepUnit::Inch, chord_mm)[..] else {
            panic!("one body")
        };
        let [low, high] = report.box_mm;
        let expected = [(low[2], 0.0), (high[2], 76.2), (high[0], 12.7)];
        assert!(expected.iter().all(|(a, b)| (a - b).abs() < 1e-9), "{:?}", report.box_mm);
    }
}

#[test]
fn an_assembly_has_its_parts_in_their_places() {
    let reports = bodies(StepSample::Pair, StepUnit::Inch, 0.01);
    assert_eq!(reports.len(), 2);
    // The second body is at x = 50 mm, at the height of the first one's center.
    let expected = [[-15.0, -15.0, 0.0], [50.0, -15.0, 0.0]];
    for (report, least) in reports.iter().zip(expected) {
        for k in 0..3 {
            let [low, high] = report.box_mm;
            assert!((low[k] - least[k]).abs() < 0.02, "{:?}", report.box_mm);
            assert!((high[k] - low[k] - 30.0).abs() < 0.04);
        }
    }
}
