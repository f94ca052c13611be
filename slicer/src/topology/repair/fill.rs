//! Closes holes with the facets of least area.

use std::collections::HashSet;

use lamp_brep::vector::{Vec3, cross, length, sub};

use crate::topology::corner_table::facet_of;
use crate::topology::{CornerTable, RimLoop};

/// Loops with more boundary edges stay open: the time grows with the third power of their number.
const MAX_RIMS: usize = 100;

/// An edge, by its vertices in ascending order.
type Edge = [u32; 2];

fn edge(a: u32, b: u32) -> Edge {
    [a.min(b), a.max(b)]
}

/// Returns the facets, by their vertices, that close all loops no wider than `close`. No facet
/// makes an edge that the mesh already has.
pub(super) fn closing(table: &CornerTable, loops: &[RimLoop], close: f64) -> Vec<[u32; 3]> {
    let is_narrow = |rims: &&RimLoop| {
        rims.is_closed
            && rims.width_mm() <= close
            && (3..=MAX_RIMS).contains(&rims.corners.len())
            && runs_along(table, rims)
            && !is_around_facet(rims)
    };
    let narrow: Vec<&RimLoop> = loops.iter().filter(is_narrow).collect();
    let mut edges = edges_between(table, &narrow);
    let mut added = Vec::new();
    for rims in narrow {
        // Facets in the hole run in the opposite direction to facets around it.
        let vertices: Vec<u32> = rims.vertices.iter().rev().copied().collect();
        let Some(facets) = least_area(table.points(), &vertices, &edges) else { continue };
        for [a, b, c] in facets {
            // Facets in a later hole must not repeat these edges.
            edges.extend([edge(a, b), edge(b, c), edge(c, a)]);
            added.push([a, b, c]);
        }
    }
    added
}

/// Returns true if all facets at a loop run along it.
fn runs_along(table: &CornerTable, rims: &RimLoop) -> bool {
    rims.corners
        .iter()
        .zip(&rims.vertices)
        .all(|(&corner, &from)| table.edge_ends(corner)[0] == from)
}

/// Returns true if a loop surrounds a facet without neighbors, whose other side is not missing.
fn is_around_facet(rims: &RimLoop) -> bool {
    let first = facet_of(rims.corners[0]);
    rims.corners.len() == 3 && rims.corners.iter().all(|&corner| facet_of(corner) == first)
}

/// Returns the edges of a mesh between vertices of loops.
fn edges_between(table: &CornerTable, loops: &[&RimLoop]) -> HashSet<Edge> {
    if loops.is_empty() {
        return HashSet::new();
    }
    let mut is_on_loop = vec![false; table.points().len()];
    let vertices = loops.iter().flat_map(|rims| &rims.vertices);
    vertices.for_each(|&vertex| is_on_loop[vertex as usize] = true);
    let ends = (0..table.corner_count()).map(|corner| table.edge_ends(corner));
    let between = ends.filter(|ends| ends.iter().all(|&vertex| is_on_loop[vertex as usize]));
    between.map(|[a, b]| edge(a, b)).collect()
}

/// Returns the facets between the vertices of a loop with the least sum of areas (G. Barequet and
/// M. Sharir, "Filling gaps in the boundary of a polyhedron", CAGD 12, 1995), without degenerate
/// facets where possible. Returns `None` if every solution makes a forbidden edge.
fn least_area(
    points: &[Vec3],
    vertices: &[u32],
    forbidden: &HashSet<Edge>,
) -> Option<Vec<[u32; 3]>> {
    let count = vertices.len();
    let point = |k: usize| points[vertices[k] as usize];
    let may_join = |a: usize, b: usize| {
        b == a + 1
            || (a == 0 && b == count - 1)
            || !forbidden.contains(&edge(vertices[a], vertices[b]))
    };
    // For the first and last vertex of each piece of the loop: its cost, and where to cut it.
    let mut best = vec![vec![(FillCost::default(), 0); count]; count];
    // Short pieces first, as longer ones consist of them.
    for reach in 2..count {
        for first in 0..count - reach {
            let last = first + reach;
            best[first][last] = (FillCost::NONE, 0);
            if !may_join(first, last) {
                continue;
            }
            for cut in first + 1..last {
                let cost = FillCost::of(point(first), point(cut), point(last));
                let cost = cost.plus(best[first][cut].0).plus(best[cut][last].0);
                if cost < best[first][last].0 {
                    best[first][last] = (cost, cut);
                }
            }
        }
    }
    if best[0][count - 1].0 == FillCost::NONE {
        return None;
    }
    let mut facets = Vec::with_capacity(count - 2);
    let mut pieces = vec![(0, count - 1)];
    while let Some((first, last)) = pieces.pop() {
        if last - first > 1 {
            let cut = best[first][last].1;
            facets.push([first, cut, last].map(|k| vertices[k]));
            pieces.extend([(first, cut), (cut, last)]);
        }
    }
    Some(facets)
}

/// The cost of facets: first the number of degenerate facets, then the sum of areas.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
struct FillCost {
    flat: u32,
    twice_area: f64,
}

impl FillCost {
    /// The cost if there is no solution.
    const NONE: Self = Self { flat: u32::MAX, twice_area: f64::INFINITY };

    fn of(a: Vec3, b: Vec3, c: Vec3) -> Self {
        let twice_area = length(cross(sub(b, a), sub(c, a)));
        Self { flat: u32::from(twice_area == 0.0), twice_area }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            flat: self.flat.saturating_add(other.flat),
            twice_area: self.twice_area + other.twice_area,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polygon in a plane, slightly slanted.
    fn polygon(corners: &[[f64; 2]]) -> Vec<Vec3> {
        corners.iter().map(|&[x, y]| [x, y, 0.25 * x]).collect()
    }

    fn area(points: &[Vec3], facets: &[[u32; 3]]) -> f64 {
        let of = |facet: &[u32; 3]| {
            let [a, b, c] = facet.map(|vertex| points[vertex as usize]);
            0.5 * length(cross(sub(b, a), sub(c, a)))
        };
        facets.iter().map(of).sum()
    }

    #[test]
    fn a_hole_with_a_bay_is_closed_within_its_border() {
        let points = polygon(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]]);
        let facets = least_area(&points, &[0, 1, 2, 3, 4], &HashSet::new()).unwrap();
        assert_eq!(facets.len(), 3);
        let slanted = (1.0_f64 + 0.0625).sqrt();
        assert!((area(&points, &facets) - 10.0 * slanted).abs() < 1e-12);
    }

    #[test]
    fn edges_of_the_mesh_are_not_made_again() {
        let points = polygon(&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.1]]);
        let square = [0, 1, 2, 3];
        let has = |facets: &[[u32; 3]], a: u32, b: u32| {
            facets.iter().all(|facet| facet.contains(&a) && facet.contains(&b))
        };
        for (forbidden, made) in [([0, 2], [1, 3]), ([1, 3], [0, 2])] {
            let facets = least_area(&points, &square, &HashSet::from([forbidden])).unwrap();
            assert!(has(&facets, made[0], made[1]));
        }
        assert_eq!(least_area(&points, &square, &HashSet::from([[0, 2], [1, 3]])), None);
    }

    #[test]
    fn points_on_a_line_make_no_flat_facets_if_there_is_another_way() {
        let points = polygon(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [1.0, 1.0]]);
        let facets = least_area(&points, &[0, 1, 2, 3, 4], &HashSet::new()).unwrap();
        assert!(facets.iter().all(|facet| area(&points, &[*facet]) > 0.1));
    }
}
