//! Follows the boundary edges of open meshes around holes.

use std::collections::HashMap;

use lamp_brep::vector::{Vec3, distance};

use crate::topology::CornerTable;
use crate::topology::corner_table::{next, previous};

/// Rims (boundary edges) that follow one another around a hole.
#[derive(Clone, Debug, PartialEq)]
pub struct RimLoop {
    /// The corners opposite to its rims, in order.
    pub corners: Vec<u32>,
    /// Its vertices, in order: rim k is between vertices k and k + 1. If the loop is closed, the
    /// last rim is between the last vertex and the first.
    pub vertices: Vec<u32>,
    /// Whether it returns to its start. Otherwise it ends at crowded edges.
    pub is_closed: bool,
    /// Its length.
    pub length_mm: f64,
    /// The least and the greatest corner of its box.
    pub box_mm: [[f64; 3]; 2],
}

impl RimLoop {
    /// Follows all rims of a mesh, from the lowest corner on. Each rim belongs to one loop. A
    /// closed loop visits no vertex twice.
    pub fn all(table: &CornerTable) -> Vec<Self> {
        let rims: Vec<u32> = (0..table.corner_count()).filter(|&c| table.is_rim(c)).collect();
        let mut is_done = vec![false; rims.len()];
        let mut loops = Vec::new();
        for first in 0..rims.len() {
            if is_done[first] {
                continue;
            }
            let mut take = |corner: u32| {
                let at = rims.binary_search(&corner).ok();
                at.is_some_and(|at| !std::mem::replace(&mut is_done[at], true))
            };
            let from = table.vertex(next(rims[first]));
            let (mut ahead, is_closed) = follow(table, rims[first], from, &mut take);
            if !is_closed {
                // It began in the middle, so the rims before it come first.
                let other = table.vertex(previous(rims[first]));
                let before = across_vertex(table, rims[first], from);
                let (mut behind, _) = match before {
                    Some(corner) => follow(table, corner, from, &mut take),
                    None => (vec![(rims[first], other)], false),
                };
                // `ahead` begins with this rim.
                behind.retain(|(corner, _)| *corner != rims[first]);
                ahead = reversed(table, behind).into_iter().chain(ahead).collect();
            }
            match is_closed {
                true => {
                    let simple = without_repeats(ahead);
                    loops.extend(simple.iter().map(|rims| Self::of(table, rims, true)));
                }
                false => loops.push(Self::of(table, &ahead, false)),
            }
        }
        loops
    }

    fn of(table: &CornerTable, rims: &[(u32, u32)], is_closed: bool) -> Self {
        let corners: Vec<u32> = rims.iter().map(|&(corner, _)| corner).collect();
        let mut vertices: Vec<u32> = rims.iter().map(|&(_, from)| from).collect();
        if let Some(&(corner, from)) = rims.last().filter(|_| !is_closed) {
            vertices.push(other_end(table, corner, from));
        }
        let point = |vertex: u32| table.points()[vertex as usize];
        let length = |&corner: &u32| {
            let [a, b] = table.edge_ends(corner).map(point);
            distance(a, b)
        };
        let length_mm = corners.iter().map(length).sum();
        let box_mm = box_of(vertices.iter().map(|&vertex| point(vertex)));
        Self { corners, vertices, is_closed, length_mm, box_mm }
    }

    /// Returns the width of the hole: the diagonal of the loop's box, which is at least the
    /// greatest distance between two of its points and at most 1.74 times this distance.
    pub fn width_mm(&self) -> f64 {
        distance(self.box_mm[0], self.box_mm[1])
    }
}

/// Splits a closed path where it visits a vertex again, as around holes that touch in a vertex.
fn without_repeats(way: Vec<(u32, u32)>) -> Vec<Vec<(u32, u32)>> {
    let (mut loops, mut left) = (Vec::new(), Vec::new());
    let mut places = HashMap::new();
    for (corner, from) in way {
        if let Some(&place) = places.get(&from) {
            let closed = left.split_off(place);
            // The rest of the path may visit these vertices again, in a loop of its own.
            closed.iter().for_each(|(_, from)| _ = places.remove(from));
            loops.push(closed);
        }
        places.insert(from, left.len());
        left.push((corner, from));
    }
    loops.push(left);
    loops
}

/// Returns the least and the greatest corner of a box around points.
pub(crate) fn box_of(points: impl IntoIterator<Item = Vec3>) -> [Vec3; 2] {
    let mut ends = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    points.into_iter().for_each(|point| widen(&mut ends, point));
    ends
}

/// Widens a box to hold a point.
#[inline]
pub(crate) fn widen([low, high]: &mut [Vec3; 2], point: Vec3) {
    *low = std::array::from_fn(|axis| low[axis].min(point[axis]));
    *high = std::array::from_fn(|axis| high[axis].max(point[axis]));
}

/// Follows rims from a rim that begins at a vertex, until a rim is not new. Returns each rim with
/// the vertex at which it begins, and whether the path returned to its start.
fn follow(
    table: &CornerTable,
    first: u32,
    from: u32,
    take: &mut impl FnMut(u32) -> bool,
) -> (Vec<(u32, u32)>, bool) {
    let mut way = Vec::new();
    let (mut corner, mut at) = (first, from);
    while take(corner) {
        way.push((corner, at));
        at = other_end(table, corner, at);
        match across_vertex(table, corner, at) {
            Some(onward) => corner = onward,
            None => return (way, false),
        }
    }
    (way, corner == first && at == from)
}

fn other_end(table: &CornerTable, corner: u32, end: u32) -> u32 {
    let [a, b] = table.edge_ends(corner);
    if a == end { b } else { a }
}

/// Returns the other rim at one end of a rim: goes around that vertex from facet to facet. Returns
/// `None` if this ends at a crowded edge.
fn across_vertex(table: &CornerTable, rim: u32, vertex: u32) -> Option<u32> {
    let mut entered = rim;
    loop {
        let at =
            if table.vertex(next(entered)) == vertex { next(entered) } else { previous(entered) };
        // Of the two edges at the vertex, takes the one not entered by.
        let left = if next(at) == entered { previous(at) } else { next(at) };
        match table.opposite(left) {
            Some(across) => entered = across,
            None => return table.is_rim(left).then_some(left),
        }
    }
}

/// Reverses a path along rims.
fn reversed(table: &CornerTable, mut way: Vec<(u32, u32)>) -> Vec<(u32, u32)> {
    way.reverse();
    way.iter_mut().for_each(|(corner, at)| *at = other_end(table, *corner, *at));
    way
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facet::Facet;
    use crate::topology::testing::{block, table_of};

    /// A flat square of unit cells without some of them, each cell of two facets.
    fn plate(side: usize, holes: &[[usize; 2]]) -> Vec<Facet> {
        let at = |x: usize, y: usize| [x as f32, y as f32, 0.0];
        let cells = (0..side * side).map(|k| [k % side, k / side]);
        let solid = cells.filter(|cell| !holes.contains(cell));
        let facets = |[x, y]: [usize; 2]| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [[a, b, c], [a, c, d]]
        };
        solid.flat_map(facets).collect()
    }

    #[test]
    fn holes_of_a_plate_are_loops_with_length_and_box() {
        let table = table_of(&plate(6, &[[1, 1], [3, 3], [3, 4]]));
        let mut loops = RimLoop::all(&table);
        assert!(loops.iter().all(|rims| rims.is_closed));
        loops.sort_by(|a, b| a.length_mm.total_cmp(&b.length_mm));
        assert_eq!(loops.iter().map(|rims| rims.length_mm).collect::<Vec<_>>(), [4.0, 6.0, 24.0]);
        assert_eq!(loops[1].box_mm, [[3.0, 3.0, 0.0], [4.0, 5.0, 0.0]]);
        assert_eq!(loops[1].width_mm(), 5f64.sqrt());
        for rims in &loops {
            assert_eq!(rims.corners.len(), rims.vertices.len());
            for (k, &corner) in rims.corners.iter().enumerate() {
                let ends = [rims.vertices[k], rims.vertices[(k + 1) % rims.vertices.len()]];
                assert_eq!(table.edge_ends(corner), ends);
            }
        }
    }

    #[test]
    fn holes_that_touch_in_a_point_are_two_loops() {
        let loops = RimLoop::all(&table_of(&plate(4, &[[1, 1], [2, 2]])));
        let lengths: Vec<f64> = loops.iter().map(|rims| rims.length_mm).collect();
        assert_eq!((lengths.len(), lengths.iter().sum::<f64>()), (3, 24.0));
        assert!(loops.iter().all(|rims| rims.is_closed));
    }

    #[test]
    fn a_facet_turned_over_does_not_break_a_loop() {
        let mut facets = plate(4, &[[1, 1]]);
        facets[0].swap(1, 2);
        facets[9].swap(0, 1);
        let loops = RimLoop::all(&table_of(&facets));
        assert_eq!(loops.len(), 2);
        assert!(loops.iter().all(|rims| rims.is_closed));
        assert_eq!(loops.iter().map(|rims| rims.corners.len()).sum::<usize>(), 20);
    }

    #[test]
    fn a_fin_on_a_block_has_an_open_way_of_rims() {
        let mut facets = block([0.0; 3], [1.0; 3]);
        // A fin along the diagonal of the upper side, which then has an edge of three facets.
        let [a, b] = [[0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
        facets.extend([[a, b, [1.0, 1.0, 2.0f32]], [a, [1.0, 1.0, 2.0], [0.0, 0.0, 2.0]]]);
        let table = table_of(&facets);
        let loops = RimLoop::all(&table);
        assert_eq!(table.crowded().len(), 1);
        assert_eq!(loops.len(), 1);
        assert!(!loops[0].is_closed);
        assert_eq!((loops[0].corners.len(), loops[0].vertices.len()), (3, 4));
        let ends = [loops[0].vertices[0], loops[0].vertices[3]];
        let points = ends.map(|vertex| table.points()[vertex as usize]);
        assert!(points.contains(&[0.0, 0.0, 1.0]) && points.contains(&[1.0, 1.0, 1.0]));
    }

    #[test]
    fn a_facet_alone_is_a_loop_and_a_closed_mesh_has_none() {
        let alone = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0f32]];
        let loops = RimLoop::all(&table_of(&[alone]));
        assert_eq!((loops.len(), loops[0].vertices.len()), (1, 3));
        assert!(RimLoop::all(&table_of(&lamp_fixtures::sphere(3.0, 500).facets)).is_empty());
    }
}
