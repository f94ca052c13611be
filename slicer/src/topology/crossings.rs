//! Finds facets that pass through each other.

use lamp_brep::vector::{Vec3, add, cross as cross_product, dot, scale, sub, unit};
use robust::{Coord3D, orient3d};
use rstar::RTree;
use rstar::primitives::{GeomWithData, Rectangle};

use crate::topology::CornerTable;
use crate::topology::rims::box_of;

/// Facets that pass through each other.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Crossings {
    /// The first pairs, each in ascending order, and sorted.
    pub pairs: Vec<[u32; 2]>,
    /// The total number of pairs found.
    pub count: usize,
    /// Whether too many boxes of facets overlap to examine all pairs.
    pub is_partial: bool,
}

/// The greatest number of examined pairs of overlapping boxes: per facet, and in addition
/// regardless of facets. A facet of a usual mesh meets some twenty boxes.
const PAIRS_PER_FACET: usize = 1000;
const PAIRS_BESIDE: usize = 10_000_000;

impl Crossings {
    /// Finds all pairs of a body's facets where an edge of one facet passes through the other, and
    /// keeps the first `most` pairs.
    ///
    /// An edge passes through a facet if its ends are on both sides of the facet's plane, and the
    /// point between is inside the facet or on its border; signs are exact. Facets with a common
    /// edge, facets that only touch, and facets in one plane do not count.
    pub fn new(table: &CornerTable, most: usize) -> Self {
        Self::of_pairs(table, most, |_, _| true)
    }

    /// Does the same as [`new`](Self::new), for the pairs that `counts` accepts.
    pub(crate) fn of_pairs(
        table: &CornerTable,
        most: usize,
        counts: impl Fn(u32, u32) -> bool,
    ) -> Self {
        let mut found = Self::default();
        for facets in table.bodies() {
            let busy = facets.filter(|&facet| !table.is_idle(facet));
            let boxes = busy.map(|facet| {
                let [low, high] = box_of(table.facet(facet));
                GeomWithData::new(Rectangle::from_corners(low, high), facet)
            });
            let tree = RTree::bulk_load(boxes.collect());
            let budget = PAIRS_BESIDE + PAIRS_PER_FACET * tree.size();
            let mut looked_at = 0;
            for (a, b) in tree.intersection_candidates_with_other_tree(&tree) {
                looked_at += 1;
                if looked_at > budget {
                    found.is_partial = true;
                    break;
                }
                // The tree meets itself, so each pair comes twice.
                if a.data < b.data && cross(table, a.data, b.data) && counts(a.data, b.data) {
                    found.count += 1;
                    found.pairs.push([a.data, b.data]);
                    // Sorted only when twice as many are found, so that each pair costs little.
                    if found.pairs.len() / 2 > most {
                        found.keep(most);
                    }
                }
            }
        }
        found.keep(most);
        found
    }

    fn keep(&mut self, most: usize) {
        self.pairs.sort_unstable();
        self.pairs.truncate(most);
    }
}

/// Returns true if an edge of one of two facets passes through the other.
fn cross(table: &CornerTable, a: u32, b: u32) -> bool {
    let (of_a, of_b) = (table.facet_vertices(a), table.facet_vertices(b));
    let common = of_a.iter().filter(|vertex| of_b.contains(vertex)).count();
    common < 2 && (pierces(table, of_a, of_b) || pierces(table, of_b, of_a))
}

/// Returns true if an edge of the first facet, without a vertex of the second facet, passes through
/// the second facet.
fn pierces(table: &CornerTable, edges: [u32; 3], facet: [u32; 3]) -> bool {
    let point = |vertex: u32| {
        let [x, y, z] = table.points()[vertex as usize];
        Coord3D { x, y, z }
    };
    let [a, b, c] = facet.map(point);
    // The sides of the plane for the ends.
    // A common vertex only touches. Other signs are exact, by Shewchuk's predicate.
    let sides = edges.map(|vertex| match facet.contains(&vertex) {
        true => 0.0,
        false => orient3d(a, b, c, point(vertex)),
    });
    (0..3).any(|k| {
        let [from, to] = [k, (k + 1) % 3];
        let are_apart = sides[from].min(sides[to]) < 0.0 && sides[from].max(sides[to]) > 0.0;
        if !are_apart {
            return false;
        }
        let (p, q) = (point(edges[from]), point(edges[to]));
        let turns = [orient3d(p, q, a, b), orient3d(p, q, b, c), orient3d(p, q, c, a)];
        turns.iter().all(|turn| *turn >= 0.0) || turns.iter().all(|turn| *turn <= 0.0)
    })
}

/// Returns the place where one of two crossing facets enters the other, and the depth: the least
/// distance from there to the edge's ends and to the facet's sides. Coordinates must move at least
/// this far to separate the facets.
pub(crate) fn deepest(table: &CornerTable, a: u32, b: u32) -> (Vec3, f64) {
    let entries = [[a, b], [b, a]].into_iter().flat_map(|[of_edges, facet]| {
        let corners = table.facet(facet);
        let normal = unit(cross_product(sub(corners[1], corners[0]), sub(corners[2], corners[0])));
        let points = table.facet(of_edges);
        let ends = [[0, 1], [1, 2], [2, 0]].map(|side| side.map(|k| points[k]));
        ends.into_iter().filter_map(move |ends| entry(ends, corners, normal?))
    });
    entries.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((table.point(3 * a), 0.0))
}

/// Returns the place where an edge enters a facet with a normal, and the depth, if it does.
fn entry([p, q]: [Vec3; 2], corners: [Vec3; 3], normal: Vec3) -> Option<(Vec3, f64)> {
    let [above, below] = [p, q].map(|end| dot(sub(end, corners[0]), normal));
    if above * below >= 0.0 {
        return None;
    }
    let at = add(p, scale(sub(q, p), above / (above - below)));
    let inside = (0..3).map(|k| {
        let side = sub(corners[(k + 1) % 3], corners[k]);
        unit(cross_product(normal, side)).map_or(0.0, |inwards| dot(sub(at, corners[k]), inwards))
    });
    let depth = inside.fold(above.abs().min(below.abs()), f64::min);
    (depth >= 0.0).then_some((at, depth))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facet::Facet;
    use crate::topology::testing::{block, table_of};

    fn crossings(facets: &[Facet]) -> Crossings {
        Crossings::new(&table_of(facets), 1000)
    }

    #[test]
    fn a_bar_through_a_block_crosses_two_of_its_sides() {
        let mut facets = block([0.0; 3], [4.0; 3]);
        facets.extend(block([1.0, 2.0, -1.0], [1.5, 2.5, 5.0]));
        let found = crossings(&facets);
        assert!(found.count >= 8 && !found.is_partial);
        // The bottom and the top of the block are its facets 0 to 3, the ends of the bar 12 to 15.
        let inside = |pair: &[u32; 2]| pair[0] < 4 && pair[1] >= 16;
        assert!(found.pairs.iter().all(inside), "{:?}", found.pairs);
    }

    #[test]
    fn facets_that_touch_do_not_cross() {
        let block_at = |x: f32| block([x, 0.0, 0.0], [x + 1.0, 1.0, 1.0]);
        assert_eq!(crossings(&[block_at(0.0), block_at(1.0)].concat()), Crossings::default());
        assert_eq!(crossings(&lamp_fixtures::blade(20_000).facets), Crossings::default());
    }

    #[test]
    fn a_facet_through_its_own_vertex_fan_crosses() {
        let o = [0.0; 3];
        let across = [o, [-1.0, -1.0, -1.0], [-1.0, -1.0, 1.0f32]];
        let flat = [o, [4.0, 0.0, 0.0], [0.0, 4.0, 0.0f32]];
        assert_eq!(crossings(&[across, flat]).count, 0);
        let across = [o, [1.0, 1.0, -1.0], [1.0, 1.0, 1.0f32]];
        assert_eq!(crossings(&[across, flat]).pairs, [[0, 1]]);
    }

    #[test]
    fn pairs_are_those_of_a_slow_search() {
        let mut numbers = lamp_fixtures::SplitMix(3);
        let mut point = || [0; 3].map(|_| numbers.below(40) as f32);
        let facets: Vec<Facet> = (0..150).map(|_| [point(), point(), point()]).collect();
        let table = table_of(&facets);
        let all = (0..150).flat_map(|a| (a + 1..150).map(move |b| [a, b]));
        let busy = all.filter(|pair| pair.iter().all(|&facet| !table.is_idle(facet)));
        let slow: Vec<_> = busy.filter(|&[a, b]| cross(&table, a, b)).collect();
        assert!(slow.len() > 100);
        assert_eq!(Crossings::new(&table, usize::MAX).pairs, slow);
        let few = Crossings::new(&table, 10);
        assert_eq!((few.pairs.len(), few.count), (10, slow.len()));
    }
}
