//! Reads one file, in a separate process, and prints its findings as lines of JSON.

use std::path::Path;
use std::time::Instant;

use lamp_brep::{BrepFacet, Prepared, ReadFn, Tessellation, prepare};
use serde::{Deserialize, Serialize};

/// The argument that requests one file.
pub(crate) const TASK: &str = "one-file";
/// The message for a file whose process gave no answer.
pub(crate) const ENDED: &str = "the process was ended or ended itself";
/// The default tolerance at 1500 dpi: a quarter of a pixel.
const CHORD_MM: f64 = 25.4 / 1500.0 / 4.0;
/// The chord for volumes and sections is the part's size divided by this, or the default.
const CHORDS: f64 = 40_000.0;

/// The findings in a file.
#[derive(Deserialize, Serialize)]
pub(crate) struct Answer {
    /// The time and memory at the default tolerance.
    pub(crate) seconds: f64,
    pub(crate) peak_mb: Option<f64>,
    /// The part in facets fine enough to compare, or the reason why it is rejected at the default
    /// tolerance.
    pub(crate) read: Result<Part, String>,
}

/// The compared values of a part.
#[derive(Deserialize, Serialize)]
pub(crate) struct Part {
    pub(crate) bodies: u64,
    pub(crate) facets: usize,
    pub(crate) box_mm: [[f64; 3]; 2],
    /// The volume within the facets, and within the surfaces.
    pub(crate) volumes_mm3: [f64; 2],
    /// The sum of the sections of each body.
    pub(crate) areas_mm2: Vec<f64>,
    /// A description of the repairs.
    pub(crate) said: String,
}

impl Answer {
    /// Parses the last line that a process printed, and blames it if there is none.
    pub(crate) fn parse(text: &[u8], seconds: f64) -> Self {
        let ended = |_| Self { seconds, peak_mb: None, read: Err(ENDED.to_owned()) };
        let last = text.trim_ascii_end().rsplit(|byte| *byte == b'\n').next().unwrap_or_default();
        serde_json::from_slice(last).unwrap_or_else(ended)
    }
}

/// Reads a file and prints an [`Answer`], and a better one if the comparison needs shorter chords
/// than the default and time is left.
pub(crate) fn answer(kernel: ReadFn, path: &Path, size_mm: &str, heights_mm: &str) {
    let bytes = std::fs::read(path).expect("the file");
    let heights: Vec<f64> = heights_mm.split(',').filter_map(|z| z.parse().ok()).collect();
    let say = |answer: &Answer| println!("{}", serde_json::to_string(answer).expect("plain data"));
    let start = Instant::now();
    let read = part(&bytes, kernel, CHORD_MM, &heights);
    let (seconds, peak_mb) = (start.elapsed().as_secs_f64(), peak_mb());
    let first = Answer { seconds, peak_mb, read };
    say(&first);
    let fine_mm = size_mm.parse::<f64>().expect("a size") / CHORDS;
    if fine_mm > 0.0 && fine_mm < CHORD_MM && first.read.is_ok() {
        // A file that is good at the default tolerance stays good, however rough its edges are.
        if let Ok(part) = part(&bytes, kernel, fine_mm, &heights) {
            say(&Answer { read: Ok(part), ..first });
        }
    }
}

/// Returns the peak memory of this process, where Linux reports it.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix(" kB")?.parse::<f64>().ok()? / 1024.0)
}

fn part(bytes: &[u8], kernel: ReadFn, chord_mm: f64, heights_mm: &[f64]) -> Result<Part, String> {
    let prepared = prepare(bytes, kernel, chord_mm).map_err(|error| error.to_string())?;
    if !prepared.is_good() {
        return Err(faults(&prepared));
    }
    let reports = &prepared.reports;
    let corner = |side: usize, pick: fn(f64, f64) -> f64| {
        let corners = reports.iter().map(|report| report.box_mm[side]);
        corners.reduce(|a, b| [0, 1, 2].map(|k| pick(a[k], b[k]))).expect("a body")
    };
    Ok(Part {
        bodies: reports.len() as u64,
        facets: prepared.mesh.facets.len(),
        box_mm: [corner(0, f64::min), corner(1, f64::max)],
        volumes_mm3: [
            reports.iter().map(|report| report.volume_mm3).sum(),
            reports.iter().map(|report| report.exact_volume_mm3).sum(),
        ],
        areas_mm2: heights_mm.iter().map(|&z| areas(&prepared, z)).collect(),
        said: said(&prepared),
    })
}

/// Returns the faults of all bodies.
fn faults(prepared: &Prepared) -> String {
    let of_body = prepared.reports.iter().zip(1..).flat_map(|(report, body)| {
        report.faults.iter().map(move |fault| format!("body {body}: {fault}"))
    });
    let faults: Vec<String> = of_body.collect();
    faults.join("; ")
}

/// Returns a description of the repairs, and the first finding.
fn said(prepared: &Prepared) -> String {
    let mut said = Vec::new();
    if let Some(first) = prepared.tries.first() {
        let (heal_um, chord_um) = (1e3 * prepared.heal_mm, 1e3 * prepared.chord_mm);
        let why = &first.why;
        said.push(format!("healed within {heal_um:.1} µm, chord {chord_um:.1} µm: {why}"));
    }
    let findings = &prepared.mesh.findings;
    if let Some(first) = findings.first() {
        said.push(format!("{} findings: #{}: {}", findings.len(), first.entity, first.fault));
    }
    said.join("; ")
}

/// Returns the sum of the areas of the bodies' sections with a plane.
fn areas(prepared: &Prepared, z: f64) -> f64 {
    let of_faces = |body: &lamp_brep::Body| prepared.mesh.of_faces(&body.faces);
    let area = |body| section_area(&prepared.mesh, of_faces(body), z);
    prepared.kernel.bodies().iter().map(area).sum()
}

/// Returns the area of the facets' section with a plane.
fn section_area(mesh: &Tessellation, facets: &[BrepFacet], z: f64) -> f64 {
    let double = |facet: &BrepFacet| {
        let corners = mesh.corners(facet);
        let is_above = corners.map(|corner| corner[2] >= z);
        // The points where the contour crosses the facet's edges downward and upward.
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
    (facets.iter().map(double).sum::<f64>() / 2.0).abs()
}
