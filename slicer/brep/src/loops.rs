//! Finds loops that run against their neighbours, and reverses them.
//!
//! In a closed shell two loops follow each edge, in opposite directions. On a sphere the
//! direction of a loop alone tells which side of it is the face, so it must be right before
//! facets are made.

use std::collections::HashMap;

use crate::kernel::{Fault, Finding};
use crate::model::{BrepModel, Loop};
use crate::orient::{neighbours, pieces};

/// A loop, by its face and its place in it.
type LoopPlace = (usize, usize);

/// Reverses loops on closed surfaces that follow edges in the same direction as their
/// neighbours, and returns a finding for each face changed. Of loops that run against each
/// other, the fewer are wrong; where both are as many, all stay.
pub(crate) fn reverse_contrary(model: &mut BrepModel) -> Vec<Finding> {
    let mut findings = Vec::new();
    for body in model.bodies.clone() {
        let faces = body.faces.start as usize..body.faces.end as usize;
        let places = loops(model, faces);
        let pieces = pieces(&neighbours(uses(model, &places).values(), places.len()));
        let contrary = pieces.iter().flat_map(|piece| minority(piece)).map(|at| places[at]);
        // Elsewhere a loop bounds one region alone, and the face is turned over instead.
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
        findings.extend(contrary.into_iter().map(|(face, _)| Finding {
            face: face as u32,
            entity: model.faces[face].entity,
            fault: Fault::Contrary,
        }));
    }
    findings
}

fn loops(model: &BrepModel, faces: std::ops::Range<usize>) -> Vec<LoopPlace> {
    let of_face =
        |face: usize| (0..model.faces[face].loops.len()).map(move |number| (face, number));
    faces.flat_map(of_face).collect()
}

/// Returns for each edge the loops that follow it, by their index in a list, and which way they
/// do.
fn uses(model: &BrepModel, places: &[LoopPlace]) -> HashMap<usize, Vec<(usize, bool)>> {
    let mut uses: HashMap<usize, Vec<(usize, bool)>> = HashMap::new();
    for (at, &(face, number)) in places.iter().enumerate() {
        let face = &model.faces[face];
        // Loops are counter-clockwise seen from where the face's own normal points.
        let is_outwards = face.along_normal == face.outwards;
        if let Loop::Edges(edges) = &face.loops[number] {
            for &(edge, is_along) in edges {
                uses.entry(edge).or_default().push((at, is_along == is_outwards));
            }
        }
    }
    uses
}

/// Returns the loops of the side with fewer of them, if there is one.
fn minority(piece: &[(usize, bool)]) -> Vec<usize> {
    let on = |side: bool| piece.iter().filter(move |(_, other)| *other == side);
    let [one, other] = [false, true].map(|side| on(side).count());
    if one == other {
        return Vec::new();
    }
    on(other < one).map(|(number, _)| *number).collect()
}
