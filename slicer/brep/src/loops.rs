//! Finds loops that run against their neighbours, and reverses them.
//!
//! In a closed shell two loops follow each edge, in opposite directions. On a sphere the
//! direction of a loop alone tells which side of it is the face, so it must be right before
//! facets are made.

use std::collections::HashMap;

use crate::kernel::{Fault, Finding};
use crate::model::{BrepModel, Loop};

/// A loop, by its face and its place in it.
type LoopPlace = (usize, usize);

/// Reverses loops on closed surfaces that follow edges in the same direction as their
/// neighbours, and returns a finding for each face changed. Of loops that run against each
/// other, the fewer are wrong; where both are as many, all stay.
pub(crate) fn reverse_contrary(model: &mut BrepModel) -> Vec<Finding> {
    let mut findings = Vec::new();
    for body in model.bodies.clone() {
        let faces = body.faces.start as usize..body.faces.end as usize;
        let mut contrary: Vec<LoopPlace> =
            pieces(&neighbours(model, faces)).iter().flat_map(|piece| minority(piece)).collect();
        // Elsewhere a loop bounds one region alone, and the face is turned over instead.
        contrary.retain(|&(face, _)| model.faces[face].surface.is_closed());
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

/// Returns the neighbours of each loop, and whether both follow an edge in one direction.
fn neighbours(
    model: &BrepModel,
    faces: std::ops::Range<usize>,
) -> HashMap<LoopPlace, Vec<(LoopPlace, bool)>> {
    let mut uses: HashMap<usize, Vec<(LoopPlace, bool)>> = HashMap::new();
    for face in faces {
        let of_face = &model.faces[face];
        // Loops are counter-clockwise seen from where the face's own normal points.
        let is_outwards = of_face.along_normal == of_face.outwards;
        for (number, around) in of_face.loops.iter().enumerate() {
            if let Loop::Edges(edges) = around {
                for &(edge, is_along) in edges {
                    let way = is_along == is_outwards;
                    uses.entry(edge).or_default().push(((face, number), way));
                }
            }
        }
    }
    let mut neighbours: HashMap<LoopPlace, Vec<(LoopPlace, bool)>> = HashMap::new();
    for uses in uses.values() {
        if let &[(a, way), (b, other)] = uses.as_slice()
            && a.0 != b.0
        {
            neighbours.entry(a).or_default().push((b, way == other));
            neighbours.entry(b).or_default().push((a, way == other));
        }
    }
    neighbours
}

/// Returns the connected groups of loops, each loop with its side: loops on different sides
/// run against each other.
fn pieces(neighbours: &HashMap<LoopPlace, Vec<(LoopPlace, bool)>>) -> Vec<Vec<(LoopPlace, bool)>> {
    let mut sides: HashMap<LoopPlace, bool> = HashMap::new();
    let mut pieces = Vec::new();
    let mut all: Vec<LoopPlace> = neighbours.keys().copied().collect();
    all.sort_unstable();
    for first in all {
        if sides.contains_key(&first) {
            continue;
        }
        sides.insert(first, false);
        let mut piece = vec![(first, false)];
        let mut at = 0;
        while let Some(&(place, side)) = piece.get(at) {
            for &(other, is_contrary) in &neighbours[&place] {
                if sides.contains_key(&other) {
                    continue;
                }
                sides.insert(other, side != is_contrary);
                piece.push((other, side != is_contrary));
            }
            at += 1;
        }
        pieces.push(piece);
    }
    pieces
}

/// Returns the loops of the side with fewer of them, if there is one.
fn minority(piece: &[(LoopPlace, bool)]) -> Vec<LoopPlace> {
    let on = |side: bool| piece.iter().filter(move |(_, other)| *other == side);
    let [one, other] = [false, true].map(|side| on(side).count());
    if one == other {
        return Vec::new();
    }
    on(other < one).map(|(place, _)| *place).collect()
}
