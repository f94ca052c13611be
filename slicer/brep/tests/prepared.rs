//! Checks which broken files are healed, and the reason and place given for rejected files.

use lamp_brep::{BodyFault, FaceFault, Prepared, prepare, read_step};
use lamp_fixtures::{StepDefect, StepSample, StepUnit, broken_step, step};

/// The block's volume, in cubic millimeters.
const BLOCK_MM3: f64 = 6000.0;

fn prepared(text: &str, chord_mm: f64) -> Prepared {
    prepare(text.as_bytes(), read_step, chord_mm).unwrap()
}

fn broken(defect: StepDefect, chord_mm: f64) -> Prepared {
    prepared(&broken_step(defect), chord_mm)
}

/// Returns the volume of the only body.
fn volume_mm3(prepared: &Prepared) -> f64 {
    let [report] = &prepared.reports[..] else { panic!("one body") };
    assert!(report.faults.is_empty(), "{:?} {:?}", report.faults, prepared.tries);
    report.volume_mm3
}

#[test]
fn what_is_right_is_taken_as_it_is() {
    for part in StepSample::ALL {
        let prepared = prepared(&step(part, StepUnit::Inch), 0.05);
        assert!(prepared.is_good(), "{part:?}: {:?}", prepared.reports);
        assert_eq!((prepared.heal_mm, prepared.chord_mm), (0.0, 0.05));
        assert!(prepared.tries.is_empty() && prepared.mesh.findings.is_empty(), "{part:?}");
    }
}

#[test]
fn edges_that_faces_do_not_share_are_joined() {
    // The usual tolerance (a tighter one would do), a looser one, and the chord.
    for (gap_nm, heal_mm) in [(0, 0.001), (1000, 0.01), (20_000, 0.05)] {
        let prepared = broken(StepDefect::Apart { gap_nm }, 0.05);
        let volume_mm3 = volume_mm3(&prepared);
        let most = f64::from(gap_nm) * 1e-6 * 2200.0;
        assert!((volume_mm3 - BLOCK_MM3).abs() <= most + 1e-9, "{gap_nm}: {volume_mm3}");
        assert!((prepared.heal_mm - heal_mm).abs() < 1e-12, "{gap_nm}: {}", prepared.heal_mm);
        assert!(!prepared.tries.is_empty() && prepared.tries[0].heal_mm == 0.0);
        let faces: Vec<u32> = prepared.mesh.findings.iter().map(|finding| finding.face).collect();
        assert_eq!(faces, [0, 1, 2, 3, 4, 5]);
        for finding in &prepared.mesh.findings {
            let FaceFault::Joined { joints: 4, off_mm } = finding.fault else {
                panic!("{finding:?}")
            };
            assert!((off_mm - f64::from(gap_nm) * 1e-6).abs() < 1e-9, "{gap_nm}: {off_mm}");
        }
    }
}

#[test]
fn a_gap_wider_than_the_limit_stays_open() {
    let prepared = broken(StepDefect::Apart { gap_nm: 100_000 }, 0.02);
    let [BodyFault::Open { edges, .. }] = prepared.reports[0].faults[..] else {
        panic!("{:?}", prepared.reports)
    };
    // Four sides of each of six faces.
    assert_eq!(edges, 24);
    // Within a thousandth of the block, nothing can be joined.
    assert!(prepared.tries.is_empty() && prepared.heal_mm == 0.0);
    assert!(prepared.mesh.findings.is_empty());
    // It is open, whatever its facets.
    assert_eq!(prepared.chord_mm, 0.08);
    // A chord as long as the gap heals it, but the file is as far off as before.
    let prepared = broken(StepDefect::Apart { gap_nm: 100_000 }, 0.2);
    let [BodyFault::Off { what: "edges", off_mm, .. }] = prepared.reports[0].faults[..] else {
        panic!("{:?}", prepared.reports)
    };
    assert!((0.05..=0.1).contains(&off_mm), "{off_mm}");
}

#[test]
fn a_missing_face_is_refused_where_it_is() {
    let prepared = broken(StepDefect::Missing, 0.05);
    let [BodyFault::Open { edges: 4, at_mm, .. }] = prepared.reports[0].faults[..] else {
        panic!("{:?}", prepared.reports)
    };
    assert_eq!(at_mm[2], 10.0);
}

#[test]
fn an_inverted_face_is_turned_over_and_named() {
    let prepared = broken(StepDefect::Inverted, 0.05);
    assert!((volume_mm3(&prepared) - BLOCK_MM3).abs() < 1e-9);
    let [finding] = &prepared.mesh.findings[..] else { panic!("{:?}", prepared.mesh.findings) };
    assert_eq!((finding.face, &finding.fault), (2, &FaceFault::Inverted));
    assert_eq!(finding.entity, prepared.kernel.face(2).entity);
}

#[test]
fn a_body_that_is_inside_out_is_turned_over() {
    let prepared = broken(StepDefect::InsideOut, 0.05);
    assert!((volume_mm3(&prepared) - BLOCK_MM3).abs() < 1e-9);
    let [finding] = &prepared.mesh.findings[..] else { panic!("{:?}", prepared.mesh.findings) };
    assert_eq!(finding.fault, FaceFault::InsideOut);
}

#[test]
fn loops_that_cross_themselves_are_named() {
    let prepared = broken(StepDefect::Crossing, 0.05);
    assert!(!prepared.is_good());
    // Bottom and top.
    let named: Vec<(u32, &FaceFault)> =
        prepared.mesh.findings.iter().map(|finding| (finding.face, &finding.fault)).collect();
    assert_eq!(named, [(0, &FaceFault::Crossing), (5, &FaceFault::Crossing)]);
    let entities = prepared.mesh.findings.iter().map(|finding| finding.entity);
    assert!(entities.eq([0, 5].map(|face| prepared.kernel.face(face).entity)));
}
