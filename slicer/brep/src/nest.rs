//! Finds which shells of a body are voids, and whether its faces enclose it.

use std::collections::HashMap;

use crate::body_report::{BodyFault, BodyReport};
use crate::kernel::{Body, BrepFacet, BrepFinding, FaceFault, KernelModel, Tessellation};
use crate::rays::{RayHit, RayPoint, SHARES, hits, seen_mm2};
use crate::volume::facet_volume;

/// The greatest accepted overlap of faces, as a multiple of the chord, and of the distance of edges
/// from their surfaces.
const LOOSE: f64 = 8.0;
const LOOSE_EDGES: f64 = 2.0;

/// Turns over shells whose faces point into the body: an outermost shell must point outward, a
/// shell inside it into its void, and so on. Returns whether any shell was turned over.
pub(crate) fn turn_shells(
    kernel: &dyn KernelModel,
    mesh: &mut Tessellation,
    reports: &[BodyReport],
) -> bool {
    let mut is_turned = false;
    let is_open = |fault: &BodyFault| matches!(fault, BodyFault::Open { .. });
    for (body, report) in kernel.bodies().iter().zip(reports) {
        // An open shell has no inside: the sign of its volume and its hits mean nothing.
        if report.faults.iter().any(is_open) {
            continue;
        }
        let facets = mesh.of_faces(&body.faces);
        let shells = shells(facets);
        // The volume's sign alone decides about a single shell, in `orient.rs`.
        let Some(count) = shells.iter().max().map(|last| last + 1).filter(|count| *count > 1)
        else {
            continue;
        };
        let turned = turned(mesh, facets, &shells, count);
        if !turned.contains(&true) {
            continue;
        }
        is_turned = true;
        turn(kernel, mesh, body, &shells, &turned);
    }
    is_turned
}

/// Returns, for each shell, whether it points the wrong way.
fn turned(mesh: &Tessellation, facets: &[BrepFacet], shells: &[usize], count: usize) -> Vec<bool> {
    let mut volumes = vec![0.0; count];
    let mut widest = vec![(0.0, 0); count];
    // Near the body, products stay small and lose few digits when their sum cancels.
    let about = facets.first().map_or([0.0; 3], |facet| mesh.corners(facet)[0]);
    for (number, facet) in facets.iter().enumerate() {
        let shell = shells[number];
        volumes[shell] += facet_volume(mesh, std::slice::from_ref(facet), about);
        let seen = seen_mm2(mesh, facet).abs();
        if seen > widest[shell].0 {
            widest[shell] = (seen, number);
        }
    }
    let best = widest.iter().map(|(_, facet)| RayPoint { facet: *facet, shares: SHARES[0] });
    let rays: Vec<RayPoint> = best.collect();
    let is_wrong = |(shell, hits): (usize, Vec<RayHit>)| {
        let own = hits.iter().position(|hit| hit.facet == rays[shell].facet).unwrap_or(0);
        let others = hits[..own].iter().filter(|hit| shells[hit.facet] != shell);
        // An odd number of surfaces before the point puts this shell within another one.
        let is_void = others.count() % 2 == 1;
        // A void's facets point into it, so they enclose a negative volume.
        is_void == (volumes[shell] > 0.0)
    };
    hits(mesh, facets, &rays).into_iter().enumerate().map(is_wrong).collect()
}

/// Numbers the shell of each facet: facets that share a point.
fn shells(facets: &[BrepFacet]) -> Vec<usize> {
    let mut parents: HashMap<u32, u32> = HashMap::new();
    fn root(parents: &mut HashMap<u32, u32>, mut point: u32) -> u32 {
        loop {
            let parent = *parents.entry(point).or_insert(point);
            if parent == point {
                return point;
            }
            // Path halving: each search shortens the way for the next one.
            let above = *parents.entry(parent).or_insert(parent);
            parents.insert(point, above);
            point = above;
        }
    }
    for facet in facets {
        let [a, b, c] = facet.corners.map(|corner| root(&mut parents, corner));
        parents.insert(b, a);
        let c = if c == b { a } else { c };
        parents.insert(c, a);
    }
    let mut numbers: HashMap<u32, usize> = HashMap::new();
    let of_facet = |facet: &BrepFacet| {
        let root = root(&mut parents, facet.corners[0]);
        let next = numbers.len();
        *numbers.entry(root).or_insert(next)
    };
    facets.iter().map(of_facet).collect()
}

fn turn(
    kernel: &dyn KernelModel,
    mesh: &mut Tessellation,
    body: &Body,
    shells: &[usize],
    turned: &[bool],
) {
    let start = mesh.facets.partition_point(|facet| facet.face < body.faces.start);
    let mut faces = Vec::new();
    for (facet, shell) in mesh.facets[start..].iter_mut().zip(shells) {
        if turned[*shell] {
            facet.turn_over();
            faces.push((facet.face, *shell));
        }
    }
    faces.dedup_by_key(|(face, _)| *face);
    // Facets are sorted by face, so these faces are sorted too.
    let is_in =
        |facet: &&mut BrepFacet| faces.binary_search_by_key(&facet.face, |(face, _)| *face).is_ok();
    mesh.tips.iter_mut().filter(is_in).for_each(BrepFacet::turn_over);
    // A stable sort: the finding names the shell's first face.
    faces.sort_by_key(|(_, shell)| *shell);
    faces.dedup_by_key(|(_, shell)| *shell);
    let finding = |(face, _): (u32, usize)| BrepFinding {
        face,
        entity: kernel.face(face).entity,
        fault: FaceFault::Shell,
    };
    mesh.findings.extend(faces.into_iter().map(finding));
}

/// Returns a fault if a ray through one of the faces does not enter and leave the body alternately.
pub(crate) fn crossed(
    kernel: &dyn KernelModel,
    mesh: &Tessellation,
    facets: &[BrepFacet],
) -> Option<BodyFault> {
    let loose_mm = LOOSE * mesh.chord_mm + LOOSE_EDGES * off_mm(mesh, facets);
    let mut left = samples(mesh, facets);
    for shares in SHARES {
        let rays: Vec<RayPoint> = left.iter().map(|&facet| RayPoint { facet, shares }).collect();
        let hits = hits(mesh, facets, &rays);
        let mut again = Vec::new();
        for (facet, hits) in left.into_iter().zip(hits) {
            // A ray that meets an edge misses a facet or meets a facet twice.
            if hits.iter().map(wound).sum::<i32>() != 0 {
                again.push(facet);
            } else if let Some(hit) = wrong(&hits, loose_mm) {
                let at = &facets[hit.facet];
                let at_mm = mesh.corners(at)[0];
                return Some(BodyFault::Crossed { entity: kernel.face(at.face).entity, at_mm });
            }
        }
        left = again;
    }
    None
}

/// Returns the distance of edges or facets of a body from their surfaces, if it exceeds the limit.
fn off_mm(mesh: &Tessellation, facets: &[BrepFacet]) -> f64 {
    let (Some(first), Some(last)) = (facets.first(), facets.last()) else { return 0.0 };
    let of_body = mesh.findings.iter().filter(|it| (first.face..=last.face).contains(&it.face));
    of_body.map(|finding| finding.fault.off_mm()).fold(0.0, f64::max)
}

/// Returns, for each face, the facet that the rays see best, and other facets spread over it.
fn samples(mesh: &Tessellation, facets: &[BrepFacet]) -> Vec<usize> {
    let mut samples = Vec::new();
    let mut start = 0;
    for of_face in facets.chunk_by(|a, b| a.face == b.face) {
        let seen = |k: &usize| seen_mm2(mesh, &of_face[*k]).abs();
        let best = (0..of_face.len()).max_by(|a, b| seen(a).total_cmp(&seen(b)));
        // A facet seen edge-on gives uncertain depths, and rays through it soon meet an edge.
        let least = best.map_or(0.0, |best| LEAST_SEEN * seen(&best));
        let spread = (0..of_face.len()).step_by(of_face.len().div_ceil(SAMPLES));
        let others = spread.filter(|k| Some(*k) != best && seen(k) > least);
        samples.extend(best.into_iter().chain(others).map(|k| start + k));
        start += of_face.len();
    }
    samples
}

/// The number of facets per face through which rays go.
const SAMPLES: usize = 8;
/// The least area of a facet as rays see it, as a part of the greatest such area.
const LEAST_SEEN: f64 = 0.05;

/// Returns the change after a hit in the number of times that a ray is inside the body.
fn wound(hit: &RayHit) -> i32 {
    if hit.cosine < 0.0 { 1 } else { -1 }
}

/// Returns the first hit after which, for more than a given length, a ray is inside the body twice
/// or a negative number of times.
fn wrong(hits: &[RayHit], loose_mm: f64) -> Option<RayHit> {
    let mut inside = 0;
    hits.windows(2).find_map(|pair| {
        inside += wound(&pair[0]);
        // A slanted ray is longer than the gap between two faces. The cosine makes up for that.
        let flat = pair[0].cosine.abs().min(pair[1].cosine.abs());
        let apart = (pair[1].depth_mm - pair[0].depth_mm) * flat;
        (!(0..=1).contains(&inside) && apart > loose_mm).then_some(pair[0])
    })
}
