//! Reads parts of other programs with one bad fillet, and a torus whose tube touches itself. The
//! tests run if the folder `shared/data` is next to the project.

use std::path::PathBuf;

use lamp_brep::{BodyFault, Prepared, prepare, read_step};

fn read(name: &str, chord_mm: f64) -> Option<Prepared> {
    read_of("step3", name, chord_mm)
}

fn read_of(folder: &str, name: &str, chord_mm: f64) -> Option<Prepared> {
    let folder =
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(folder);
    let bytes = std::fs::read(folder.join(name)).ok()?;
    Some(prepare(&bytes, read_step, chord_mm).unwrap())
}

#[test]
fn one_bad_fillet_is_no_reason_to_refuse_at_any_tolerance() {
    // Volumes by OpenCASCADE 8.0.
    for (name, volume_mm3) in [
        ("klicky-pro__Klicky_-_Eva_2.4_mount.step", 3760.390),
        ("klicky-pro__Klicky_probe_dock_VzBot.step", 22038.387),
    ] {
        for chord_mm in [0.02, 0.004, 0.001] {
            let Some(part) = read(name, chord_mm) else { return };
            assert!(part.is_good(), "{name} {chord_mm}: {:?}", part.reports[0].faults);
            let share = part.reports[0].exact_volume_mm3 / volume_mm3 - 1.0;
            assert!(share.abs() < 1e-4, "{name} {chord_mm}: {share}");
        }
    }
}

#[test]
fn a_tube_that_touches_itself_is_the_reason_given() {
    let Some(part) = read("moteus__XT30PW-M.step", 0.01) else { return };
    for body in [4, 5] {
        let faults = &part.reports[body].faults;
        assert!(matches!(faults[..], [BodyFault::Horn { .. }]), "{faults:?}");
    }
}

#[test]
fn edges_through_the_ends_of_spline_surfaces_are_followed_at_any_tolerance() {
    // Four edges off their surfaces meet in the pole of each half of a ball. The volume is the
    // volume of OpenCASCADE's facets: see docs/brep.md.
    for chord_mm in [0.02, 0.004, 0.001] {
        let Some(part) = read_of("step", "axom_boxed_sphere.step", chord_mm) else { return };
        assert!(part.is_good(), "{chord_mm}: {:?}", part.reports);
        let volume: f64 = part.reports.iter().map(|report| report.exact_volume_mm3).sum();
        assert!((volume / 733.601 - 1.0).abs() < 3e-4, "{chord_mm}: {volume}");
    }
}

#[test]
fn a_coarse_chord_is_no_reason_to_refuse_slots_close_to_a_rim() {
    for chord_mm in [0.1, 0.02, 0.004] {
        let Some(part) = read_of("step2", "original-pru_LCD-knob.stp", chord_mm) else { return };
        assert!(part.is_good(), "{chord_mm}: {:?}", part.reports[0].faults);
        let share = part.reports[0].exact_volume_mm3 / 2298.5627 - 1.0;
        assert!(share.abs() < 1e-3, "{chord_mm}: {share}");
    }
}
