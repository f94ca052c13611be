//! Checks that STEP files of other programs, where present, are read right or refused with a
//! reason, within a time limit.

use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use lamp_brep::{Facet, Finding, ReadFn, Tessellation, prepare, read_step};

/// The time limit, many times what any file takes.
const LIMIT: Duration = Duration::from_secs(300);
/// The tolerated relative error of volumes.
const SAME: f64 = 1e-3;
/// The tolerated relative error of section areas.
const SAME_AREA: f64 = 2e-3;
/// A file and its volume by OpenCASCADE's facets at a chord of 0.5 µm. The reference, 732.189 mm³,
/// is OpenCASCADE's integral over the surfaces, bounded by its own parameter curves, up to
/// 0.059 mm from the file's edges. The edges lie within 0.03 µm of the surfaces.
const LOOSE_VOLUME: (&str, f64) = ("axom_boxed_sphere.step", 733.601);
/// A section and its area by OpenCASCADE's facets at a chord of 0.02 mm, which changes steadily
/// around it. The reference, 64 791 mm², is from OpenCASCADE's Boolean operation; its classifier
/// gives 101 300 ± 1600 mm² by 20 000 random points.
const WRONG_SECTION: (&str, usize, f64) = ("nist_ctc_02_asme1_ap242.stp", 2, 103_560.4);
/// The share of files that must be read right; the rest may be refused.
const LEAST_RIGHT: f64 = 0.95;

/// Returns the folder of files and reference figures beside the project.
fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data")
}

/// The result of reading a file.
enum Outcome {
    Read { volume_mm3: f64, areas_mm2: Vec<f64>, bodies: usize, facets: usize, said: String },
    Refused(String),
}

fn read(path: &Path, kernel: ReadFn, chord_mm: f64, heights_mm: &[f64]) -> Outcome {
    let prepared = match prepare(&std::fs::read(path).unwrap(), kernel, chord_mm) {
        Ok(prepared) => prepared,
        Err(error) => return Outcome::Refused(error.to_string()),
    };
    let mesh = &prepared.mesh;
    let mut said: Vec<String> =
        prepared.tries.iter().map(|a_try| format!("before: {}", a_try.why)).collect();
    for report in &prepared.reports {
        said.extend(report.faults.iter().map(|fault| format!("{}: {fault}", report.name)));
    }
    said.extend(findings(&mesh.findings));
    if !prepared.is_good() {
        return Outcome::Refused(said.join("; "));
    }
    Outcome::Read {
        volume_mm3: prepared.reports.iter().map(|report| report.volume_mm3).sum(),
        areas_mm2: heights_mm.iter().map(|&z| section_area(mesh, z)).collect(),
        bodies: prepared.reports.len(),
        facets: mesh.facets.len(),
        said: said.join("; "),
    }
}

/// Returns the number of findings, and the first.
fn findings(list: &[Finding]) -> Option<String> {
    let first = list.first()?;
    Some(format!("{} findings, the first #{}: {}", list.len(), first.entity, first.fault))
}

/// Returns the area of the facets' section with a plane.
fn section_area(mesh: &Tessellation, z: f64) -> f64 {
    let double = |facet: &Facet| {
        let corners = mesh.corners(facet);
        let is_above = corners.map(|corner| corner[2] >= z);
        // The points where the contour crosses the facet's edges downwards and upwards.
        let crossing = |from_above: bool| {
            let k = (0..3)
                .find(|&k| is_above[k] == from_above && is_above[(k + 1) % 3] != from_above)?;
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let t = (z - a[2]) / (b[2] - a[2]);
            Some([0, 1].map(|axis| a[axis] + t * (b[axis] - a[axis])))
        };
        match (crossing(true), crossing(false)) {
            (Some(p), Some(q)) => p[0] * q[1] - q[0] * p[1],
            _ => 0.0,
        }
    };
    (mesh.facets.iter().map(double).sum::<f64>() / 2.0).abs()
}

/// Reads a file on its own thread, which is abandoned if it hangs.
fn within_limit(path: &Path, kernel: ReadFn, chord_mm: f64, heights_mm: Vec<f64>) -> Outcome {
    let (sender, receiver) = mpsc::channel();
    let path = path.to_owned();
    std::thread::spawn(move || {
        // The receiver is gone if time is up.
        let _ = sender.send(read(&path, kernel, chord_mm, &heights_mm));
    });
    match receiver.recv_timeout(LIMIT) {
        Ok(outcome) => outcome,
        Err(mpsc::RecvTimeoutError::Timeout) => Outcome::Refused("it takes too long".into()),
        Err(mpsc::RecvTimeoutError::Disconnected) => panic!("the reader panicked"),
    }
}

#[test]
fn every_file_is_right_or_refused() {
    every_file(read_step, LEAST_RIGHT);
}

#[cfg(feature = "occt")]
#[test]
fn every_file_is_right_or_refused_with_occt() {
    every_file(lamp_brep_occt::read, LEAST_RIGHT);
}

/// Reads every file of the folder, if it exists, and prints a table.
fn every_file(kernel: ReadFn, least_right: f64) {
    let Ok(figures) = std::fs::read(data().join("step_oracle.json")) else {
        println!("no files at hand");
        return;
    };
    let figures: serde_json::Value = serde_json::from_slice(&figures).unwrap();
    let figures = figures.as_object().unwrap();
    let only = std::env::var("LAMP_STEP_FILE").unwrap_or_default();
    let (mut right, mut wrong, mut all) = (0u32, Vec::new(), 0u32);
    for (name, of_file) in figures.iter().filter(|(name, _)| name.contains(&only)) {
        let corner = |k: usize| of_file["box_mm"][k].as_f64().unwrap();
        let size = (0..3).map(|k| corner(k + 3) - corner(k)).fold(0.0, f64::max);
        let start = Instant::now();
        let list = |key: &str| -> Vec<f64> {
            of_file[key].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
        };
        let path = data().join("step").join(name);
        let mut volume = of_file["volume_mm3"].as_f64().unwrap();
        let mut areas = list("section_area_mm2");
        if name == LOOSE_VOLUME.0 {
            volume = LOOSE_VOLUME.1;
        }
        if name == WRONG_SECTION.0 {
            areas[WRONG_SECTION.1] = WRONG_SECTION.2;
        }
        let outcome = within_limit(&path, kernel, size / 40_000.0, list("section_z_mm"));
        let seconds = start.elapsed().as_secs_f64();
        all += 1;
        let row = match outcome {
            Outcome::Read { volume_mm3, areas_mm2, bodies, facets, said } => {
                let off = volume_mm3 / volume - 1.0;
                let least = 1e-9 * size * size;
                let area_off = areas_mm2
                    .iter()
                    .zip(&areas)
                    .map(|(a, b)| (a - b).abs() / b.max(least))
                    .fold(0.0, f64::max);
                let is_right = off.abs() <= SAME && area_off <= SAME_AREA;
                right += u32::from(is_right);
                if !is_right {
                    wrong.push(name.clone());
                }
                let word = if is_right { "" } else { "WRONG " };
                let [off, area_off] = [off, area_off].map(|off| 100.0 * off);
                format!(
                    "{bodies} | {facets} | {word}{off:+.4} % | {area_off:.4} % | {seconds:.1} | {said}"
                )
            }
            Outcome::Refused(why) => format!("refused | | | | {seconds:.1} | {why}"),
        };
        println!("| `{name}` | {row} |");
    }
    println!("{right} of {all} right");
    assert!(wrong.is_empty(), "wrong: {wrong:?}");
    assert!(f64::from(right) >= least_right * f64::from(all), "{right} of {all} right");
}
