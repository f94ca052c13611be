//! Finds faces that are inside out relative to their neighbors, and turns them over.

use std::collections::HashMap;

use crate::body_report::BodyReport;
use crate::kernel::{Body, BrepFacet, BrepFinding, FaceFault, KernelModel, Tessellation};
use crate::measure::{bounds, doubled, sides};
use crate::vector::{length, middle};
use crate::volume::facet_volume;

/// Of two groups of faces that contradict each other, the smaller is inside out if its
/// area is less than this part of the other's.
const CLEARLY_SMALLER: f64 = 0.8;

/// The result of [`turn_over`].
#[derive(Debug, Default)]
pub(crate) struct Turned {
    /// Whether any face was turned over.
    pub(crate) is_changed: bool,
    /// The faces that contradict their neighbors and cannot be turned over: the number of the face
    /// and the number of its body.
    pub(crate) undecided: Vec<(u32, usize)>,
}

/// Turns over faces that follow a shared edge in the same direction as a neighbor, and
/// bodies that are inside out.
///
/// Of contradicting groups, the one with less area is turned. If their areas are similar, the sign
/// of the body's volume decides. Changes are added to the findings. A face on a surface closed both
/// ways stays: if its loop runs the wrong way, it is not inside out, but on the wrong side of the
/// loop.
pub(crate) fn turn_over(
    kernel: &dyn KernelModel,
    mesh: &mut Tessellation,
    reports: &[BodyReport],
) -> Turned {
    let mut all = Turned::default();
    for (number, (body, report)) in kernel.bodies().iter().zip(reports).enumerate() {
        // A good body needs no change, which could only spoil it.
        if report.faults.is_empty() || report.facets == 0 {
            continue;
        }
        let mut turned = inverted(mesh, body);
        // If all faces turn, their loops agree with each other and only the body's sign is wrong.
        if !turned.iter().all(|&turned| turned) {
            for (face, turned) in body.faces.clone().zip(&mut turned) {
                if *turned && kernel.face(face).is_closed {
                    *turned = false;
                    all.undecided.push((face, number));
                }
            }
        }
        if turned.contains(&true) {
            all.is_changed = true;
            turn(kernel, mesh, body, &turned);
        }
    }
    all
}

fn turn(kernel: &dyn KernelModel, mesh: &mut Tessellation, body: &Body, turned: &[bool]) {
    let is_turned = |facet: &&mut BrepFacet| {
        body.faces.contains(&facet.face) && turned[(facet.face - body.faces.start) as usize]
    };
    mesh.facets.iter_mut().chain(&mut mesh.tips).filter(is_turned).for_each(BrepFacet::turn_over);
    let finding = |face: u32, fault| BrepFinding { face, entity: kernel.face(face).entity, fault };
    if turned.iter().all(|&turned| turned) {
        mesh.findings.push(finding(body.faces.start, FaceFault::InsideOut));
    } else {
        let faces = body.faces.clone().zip(turned).filter(|(_, turned)| **turned);
        mesh.findings.extend(faces.map(|(face, _)| finding(face, FaceFault::Inverted)));
    }
}

/// Returns, for each face of a body, whether it is inside out.
fn inverted(mesh: &Tessellation, body: &Body) -> Vec<bool> {
    let facets = mesh.of_faces(&body.faces);
    let count = body.faces.len();
    let index = |facet: &BrepFacet| (facet.face - body.faces.start) as usize;
    let mut areas = vec![0.0; count];
    facets.iter().for_each(|facet| areas[index(facet)] += length(doubled(mesh, facet)));
    let pieces = pieces(&neighbours(uses(facets, index).values(), count));
    let mut turned = vec![false; count];
    for piece in &pieces {
        let area = |side: bool| -> f64 {
            piece.iter().filter(|(_, other)| *other == side).map(|(face, _)| areas[*face]).sum()
        };
        let [one, other] = [area(false), area(true)];
        let is_clear = one.min(other) < CLEARLY_SMALLER * one.max(other);
        // The choice may be wrong for a single piece, as the volume's sign corrects it below.
        if is_clear || pieces.len() == 1 {
            let smaller = other <= one;
            piece.iter().for_each(|(face, side)| turned[*face] = *side == smaller);
        }
    }
    // A body without volume has no sign to decide by.
    let [low, high] = bounds(mesh, facets);
    let about = middle(low, high);
    let signed = |facet: &BrepFacet| {
        let volume = facet_volume(mesh, std::slice::from_ref(facet), about);
        if turned[index(facet)] { -volume } else { volume }
    };
    if facets.iter().map(signed).sum::<f64>() < 0.0 {
        turned.iter_mut().for_each(|turned| *turned = !*turned);
    }
    turned
}

/// Returns, for each edge of facets, the faces that follow it, and their directions.
fn uses(
    facets: &[BrepFacet],
    index: impl Fn(&BrepFacet) -> usize,
) -> HashMap<[u32; 2], Vec<(usize, bool)>> {
    let mut uses: HashMap<[u32; 2], Vec<(usize, bool)>> = HashMap::new();
    for facet in facets {
        for [a, b] in sides(facet) {
            uses.entry([a.min(b), a.max(b)]).or_default().push((index(facet), a > b));
        }
    }
    uses
}

/// Returns the neighbors of each of `count` faces or loops, and whether they contradict it by
/// following a shared edge in the same direction. `uses` lists, for each edge, the faces or loops
/// that follow it, and their directions.
pub(crate) fn neighbours<'a>(
    uses: impl Iterator<Item = &'a Vec<(usize, bool)>>,
    count: usize,
) -> Vec<Vec<(usize, bool)>> {
    let mut list = vec![Vec::new(); count];
    for uses in uses {
        // Four uses belong to solids that touch along an edge, and do not show who is whose
        // neighbor.
        if let &[(a, way), (b, other)] = uses.as_slice()
            && a != b
        {
            list[a].push((b, way == other));
            list[b].push((a, way == other));
        }
    }
    for list in &mut list {
        list.sort_unstable();
        list.dedup();
    }
    list
}

/// Returns the connected groups of faces or loops, each member with its side: members on different
/// sides contradict each other. A member without neighbors is a group of its own.
pub(crate) fn pieces(neighbours: &[Vec<(usize, bool)>]) -> Vec<Vec<(usize, bool)>> {
    let mut pieces = Vec::new();
    let mut seen = vec![false; neighbours.len()];
    for first in 0..neighbours.len() {
        if std::mem::replace(&mut seen[first], true) {
            continue;
        }
        let mut piece = vec![(first, false)];
        let mut at = 0;
        while let Some(&(face, side)) = piece.get(at) {
            for &(other, is_contrary) in &neighbours[face] {
                if !std::mem::replace(&mut seen[other], true) {
                    piece.push((other, side != is_contrary));
                }
            }
            at += 1;
        }
        pieces.push(piece);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_have_sides() {
        // Four faces in a ring, the third of which contradicts its neighbors, and a
        // single face.
        let neighbours = vec![
            vec![(1, false), (3, false)],
            vec![(0, false), (2, true)],
            vec![(1, true), (3, true)],
            vec![(0, false), (2, true)],
            vec![],
        ];
        let pieces = pieces(&neighbours);
        assert_eq!(pieces.len(), 2);
        let mut ring = pieces[0].clone();
        ring.sort_unstable();
        assert_eq!(ring, [(0, false), (1, false), (2, true), (3, false)]);
        assert_eq!(pieces[1], [(4, false)]);
    }
}
