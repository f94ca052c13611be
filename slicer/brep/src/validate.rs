//! Validates that the facets of bodies are closed and enclose the surfaces' volume.

use std::collections::{HashMap, HashSet};

use crate::body_report::{BodyFault, BodyReport};
use crate::geometry::HORN_TORUS;
use crate::kernel::{BrepFacet, BrepFinding, FaceFault, KernelModel, Tessellation};
use crate::measure::{MOST_OFF, bounds, doubled, sides};
use crate::nest::crossed;
use crate::vector::{length, scale, sub};
use crate::volume::{facet_volume, surface_volume};

/// The greatest relative difference of a body's two volumes.
pub(crate) const VOLUMES_APART: f64 = 1e-3;

/// The least volume of a body, as a part of the volume of a cube whose face has the body's area: a
/// smaller volume is within rounding errors.
const LEAST_VOLUME: f64 = 1e-9;

/// Checks every body: facets follow each edge as often in one direction as in the other; no face
/// leaves the box of its control points; and the volumes of facets and surfaces agree within 0.1 %,
/// or within the error that the chord allows.
pub fn check(kernel: &dyn KernelModel, mesh: &Tessellation) -> Vec<BodyReport> {
    let report = |body: &crate::kernel::Body| {
        let facets = mesh.of_faces(&body.faces);
        let box_mm = bounds(mesh, facets);
        // Volumes about a point within the body lose the fewest digits when they cancel.
        let middle = scale(crate::vector::add(box_mm[0], box_mm[1]), 0.5);
        let mut report = BodyReport {
            name: body.name.clone(),
            facets: facets.len(),
            volume_mm3: facet_volume(mesh, facets, middle),
            exact_volume_mm3: surface_volume(kernel, mesh, body, middle),
            area_mm2: facets.iter().map(|facet| length(doubled(mesh, facet)) / 2.0).sum(),
            box_mm,
            faults: Vec::new(),
        };
        report.faults = faults(kernel, mesh, facets, &report);
        report
    };
    kernel.bodies().iter().map(report).collect()
}

/// Returns a fault if a body's two volumes differ by more than the chord allows.
fn apart(report: &BodyReport, chord_mm: f64) -> Option<BodyFault> {
    let (facets_mm3, surfaces_mm3) = (report.volume_mm3, report.exact_volume_mm3);
    // Between facets and surfaces is at most a layer as thick as the chord.
    let most = f64::max(VOLUMES_APART * facets_mm3.abs(), chord_mm * report.area_mm2);
    // `NaN` must fail the comparison.
    let is_within = (facets_mm3 - surfaces_mm3).abs() <= most;
    (!is_within).then_some(BodyFault::Volumes { facets_mm3, surfaces_mm3 })
}

fn faults(
    kernel: &dyn KernelModel,
    mesh: &Tessellation,
    facets: &[BrepFacet],
    report: &BodyReport,
) -> Vec<BodyFault> {
    if facets.is_empty() {
        return vec![BodyFault::Empty];
    }
    let faces = facets[0].face..=facets[facets.len() - 1].face;
    let horn = faces.map(|face| kernel.face(face)).find(|face| face.kind == HORN_TORUS);
    let mut faults: Vec<BodyFault> = open(kernel, mesh, facets).into_iter().collect();
    // Loops with an unknown side give facets anywhere.
    faults.extend(off(kernel, mesh, facets, report).map(|off| match (&horn, &off) {
        (Some(face), BodyFault::Off { entity, what: FACETS, .. }) if face.entity == *entity => {
            BodyFault::Horn { entity: *entity }
        }
        _ => off,
    }));
    faults.extend(outside(kernel, mesh, facets));
    if let Some(fault) = apart(report, mesh.chord_mm) {
        faults.push(fault);
    } else if report.volume_mm3.abs() < LEAST_VOLUME * report.area_mm2.powf(1.5) {
        faults.push(BodyFault::Flat);
    } else if report.volume_mm3 < 0.0 {
        faults.push(BodyFault::InsideOut { volume_mm3: report.volume_mm3 });
    }
    // Rays through an open body find crossings that are only its gaps.
    if faults.is_empty() {
        let crossed = crossed(kernel, mesh, facets);
        faults.extend(crossed.map(|crossed| match horn {
            Some(face) => BodyFault::Horn { entity: face.entity },
            None => crossed,
        }));
    }
    faults
}

/// Returns a fault unless facets follow each edge as often in one direction as in the other.
fn open(kernel: &dyn KernelModel, mesh: &Tessellation, facets: &[BrepFacet]) -> Option<BodyFault> {
    // The number of uses of each edge, with ascending and with descending point indices.
    // In a closed mesh an edge takes two of the facets' three sides.
    let mut edges: HashMap<[u32; 2], [u32; 2]> = HashMap::with_capacity(facets.len() * 3 / 2);
    for [a, b] in facets.iter().flat_map(sides) {
        edges.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)] += 1;
    }
    // Four facets may meet where solids touch along an edge.
    let is_even = |[up, down]: &[u32; 2]| up == down;
    let count = edges.values().filter(|uses| !is_even(uses)).count();
    let is_open = |side: &[u32; 2]| !is_even(&edges[&[side[0].min(side[1]), side[0].max(side[1])]]);
    let first = facets.iter().find_map(|facet| {
        let side = sides(facet).into_iter().find(is_open)?;
        Some((facet.face, side[0]))
    });
    first.map(|(face, point)| BodyFault::Open {
        edges: count,
        at_mm: mesh.points[point as usize],
        entity: kernel.face(face).entity,
    })
}

/// Returns a fault if an edge or facets are off their surface by more than the numbers of another
/// part would explain: no other check shows that the edge belongs to another surface.
///
/// Facets may be some chords off. For edges, the chord does not count: an error in the file stays
/// the same at any tolerance.
fn off(
    kernel: &dyn KernelModel,
    mesh: &Tessellation,
    facets: &[BrepFacet],
    report: &BodyReport,
) -> Option<BodyFault> {
    let sides = sub(report.box_mm[1], report.box_mm[0]);
    let longest_mm = sides.into_iter().fold(0.0, f64::max);
    // The accuracy that a file states counts, but only up to a limit.
    let stated_mm = kernel.uncertainty_mm().unwrap_or(0.0).min(LOCAL_OFF * longest_mm);
    let most_mm = f64::max(MOST_OFF * longest_mm, stated_mm);
    let faces = facets.first()?.face..=facets.last()?.face;
    let of_body = || mesh.findings.iter().filter(|finding| faces.contains(&finding.face));
    let off = of_body().filter_map(|finding| match finding.fault {
        FaceFault::Off { off_mm } | FaceFault::Rebuilt { off_mm } => {
            (off_mm > most_mm).then_some((finding, "edges", off_mm))
        }
        FaceFault::Coarse { off_mm } => {
            (off_mm > f64::max(4.0 * mesh.chord_mm, most_mm)).then_some((finding, FACETS, off_mm))
        }
        _ => None,
    });
    let off: Vec<_> = off.collect();
    let alone = |face: u32| {
        !neighbours(facets, face).iter().any(|near| {
            off.iter().any(|(it, ..)| it.face == *near && matches!(it.fault, FaceFault::Off { .. }))
        })
    };
    let is_local = |(finding, what, off_mm): &(&BrepFinding, &str, f64)| {
        *what == "edges"
            && *off_mm <= LOCAL_OFF * longest_mm
            && face_mm2(mesh, facets, finding.face) * off_mm <= LOCAL_VOLUME * report.volume_mm3
            && (matches!(finding.fault, FaceFault::Rebuilt { .. }) || alone(finding.face))
    };
    let worst = off.iter().filter(|off| !is_local(off)).max_by(|a, b| a.2.total_cmp(&b.2));
    worst.map(|&(finding, what, off_mm)| BodyFault::Off { entity: finding.entity, what, off_mm })
}

/// The parts that are off, if not edges.
const FACETS: &str = "facets";

/// The greatest accepted distance of edges, as a part of the body's longest side, for a small face
/// whose neighbors are on their edges, or where the surfaces meet near the edge. A face is small if
/// its area times the distance is below a share of the volume.
const LOCAL_OFF: f64 = 4e-3;
const LOCAL_VOLUME: f64 = 1e-4;

/// Returns the area of a face's facets.
fn face_mm2(mesh: &Tessellation, facets: &[BrepFacet], face: u32) -> f64 {
    let of_face = facets.iter().filter(|facet| facet.face == face);
    of_face.map(|facet| length(doubled(mesh, facet)) / 2.0).sum()
}

/// Returns the faces that share an edge of facets with a face.
fn neighbours(facets: &[BrepFacet], face: u32) -> Vec<u32> {
    let own = facets.iter().filter(|facet| facet.face == face);
    // A neighbor follows the common edge in the other direction.
    let edges: HashSet<[u32; 2]> = own.flat_map(sides).map(|[a, b]| [b, a]).collect();
    let others = facets.iter().filter(|facet| facet.face != face);
    let near = others.filter(|facet| sides(facet).iter().any(|side| edges.contains(side)));
    let mut near: Vec<u32> = near.map(|facet| facet.face).collect();
    // Facets are sorted by face, so equal faces are adjacent.
    near.dedup();
    near
}

/// Returns the distance of a face's edges from its surface, if it exceeds the limit for facets.
fn off_edges_mm(mesh: &Tessellation, face: u32) -> f64 {
    let findings = mesh.findings.iter().filter(|finding| finding.face == face);
    let off = findings.filter_map(|finding| match finding.fault {
        FaceFault::Off { off_mm } => Some(off_mm),
        _ => None,
    });
    off.fold(0.0, f64::max)
}

fn outside(
    kernel: &dyn KernelModel,
    mesh: &Tessellation,
    facets: &[BrepFacet],
) -> Option<BodyFault> {
    let of_face = facets.chunk_by(|a, b| a.face == b.face);
    let off = |facets: &[BrepFacet]| {
        let info = kernel.face(facets[0].face);
        let [least, most] = info.control_box_mm?;
        let [low, high] = bounds(mesh, facets);
        let over = (0..3).map(|k| (least[k] - low[k]).max(high[k] - most[k]));
        let off_mm = over.fold(0.0, f64::max);
        // Points of edges may be as far off the surface as facets.
        let is_off = off_mm > mesh.chord_mm.max(off_edges_mm(mesh, facets[0].face));
        is_off.then_some(BodyFault::Outside { entity: info.entity, off_mm })
    };
    of_face.into_iter().find_map(off)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volumes_may_be_apart_as_far_as_the_chord_lets_them() {
        let report = BodyReport {
            name: String::new(),
            facets: 12,
            volume_mm3: 1000.0,
            exact_volume_mm3: 1003.0,
            area_mm2: 600.0,
            box_mm: [[0.0; 3], [10.0; 3]],
            faults: Vec::new(),
        };
        assert_eq!(apart(&report, 0.01), None);
        let fault = BodyFault::Volumes { facets_mm3: 1000.0, surfaces_mm3: 1003.0 };
        assert_eq!(apart(&report, 0.001), Some(fault));
        let near = BodyReport { exact_volume_mm3: 1000.9, ..report.clone() };
        assert_eq!(apart(&near, 0.0), None);
        assert!(apart(&BodyReport { exact_volume_mm3: f64::NAN, ..report }, 1.0).is_some());
    }
}
