//! Finds loops that run against their neighbors, and reverses them.
//!
//! In a closed shell, two loops follow each edge, in opposite directions. On a sphere, only the
//! direction of a loop shows which side of it is the face, so it must be right before facets are
//! made.

use std::collections::HashMap;

use crate::kernel::{BrepFinding, FaceFault};
use crate::model::{BrepModel, Loop};
use crate::orient::{neighbours, pieces};

/// A loop, by its face and its index in the face.
type LoopPlace = (usize, usize);

/// Reverses loops on closed surfaces that follow edges in the same direction as their neighbors.
/// Returns a finding for each changed face. Of loops that run against each other, the smaller
/// number is wrong; if the numbers are equal, all stay.
pub(crate) fn reverse_contrary(model: &mut BrepModel) -> Vec<BrepFinding> {
    let mut findings = Vec::new();
    for body in model.bodies.clone() {
        let faces = body.faces.start as usize..body.faces.end as usize;
        let places = loops(model, faces);
        let pieces = pieces(&neighbours(uses(model, &places).values(), places.len()));
        let contrary = pieces.iter().flat_map(|piece| minority(piece)).map(|at| places[at]);
        // Elsewhere a loop bounds a single region, so the face is turned over instead.
        let is_closed = |&(face, _): &LoopPlace| model.faces[face].surface.is_closed();
        let mut contrary: Vec<LoopPlace> = contrary.filter(is_closed).collect();
        contrary.sort_unstable();
        for &(face, number) in &contrary {
            if let Loop::Edges(edges) = &mut model.faces[face].loops[number] {
                edges.reverse();
                edges.iter_mut().for_each(|(_, is_along)| *is_along = !*is_along);
            }
        }
        contrary.dedup_by_key(|(face, _)| *face);
        findings.extend(contrary.into_iter().map(|(face, _)| BrepFinding {
            face: face as u32,
            entity: model.faces[face].entity,
            fault: FaceFault::Contrary,
        }));
    }
    findings
}

fn loops(model: &BrepModel, faces: std::ops::Range<usize>) -> Vec<LoopPlace> {
    let of_face =
        |face: usize| (0..model.faces[face].loops.len()).map(move |number| (face, number));
    faces.flat_map(of_face).collect()
}

/// Returns the loops that follow each edge, by their index in a list, and their directions.
fn uses(model: &BrepModel, places: &[LoopPlace]) -> HashMap<usize, Vec<(usize, bool)>> {
    let mut uses: HashMap<usize, Vec<(usize, bool)>> = HashMap::new();
    for (at, &(face, number)) in places.iter().enumerate() {
        let face = &model.faces[face];
        // Loops are counterclockwise seen from where the face's own normal points.
        let is_outwards = face.along_normal == face.outwards;
        if let Loop::Edges(edges) = &face.loops[number] {
            for &(edge, is_along) in edges {
                uses.entry(edge).or_default().push((at, is_along == is_outwards));
            }
        }
    }
    uses
}

/// Returns the loops of the side with fewer loops, if there is one.
fn minority(piece: &[(usize, bool)]) -> Vec<usize> {
    let on = |side: bool| piece.iter().filter(move |(_, other)| *other == side);
    let [one, other] = [false, true].map(|side| on(side).count());
    if one == other {
        return Vec::new();
    }
    on(other < one).map(|(number, _)| *number).collect()
}
