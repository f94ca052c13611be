//! Reads parts of other programs with one bad fillet, and a torus whose tube touches itself. The
//! tests run where the folder `shared/data/step3` stands beside the project.

use std::path::PathBuf;

use lamp_brep::{BodyFault, Prepared, prepare, read_step};

fn read(name: &str, chord_mm: f64) -> Option<Prepared> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/step3");
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
