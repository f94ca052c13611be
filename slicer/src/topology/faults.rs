//! Finds facets that repeat another facet, have no area or are not finite.

use lamp_brep::vector::{Vec3, cross, dot, sub};

use crate::topology::CornerTable;
use crate::topology::corner_table::facet_of;

/// A facet that joins the same three vertices as an earlier one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Doubled {
    /// The facet.
    pub facet: u32,
    /// The first facet with its vertices.
    pub of: u32,
    /// Whether they face the same way.
    pub is_same_way: bool,
}

impl Doubled {
    /// Finds all facets that repeat another facet, in ascending order.
    pub fn all(table: &CornerTable) -> Vec<Self> {
        let mut found = Vec::new();
        let mut add = |a: u32, b: u32| {
            let (of, facet) = (a.min(b), a.max(b));
            let is_same_way = is_same_way(table, of, facet);
            found.push(Self { facet, of, is_same_way });
        };
        // Facets that repeat each other share all three edges; each of these edges has no other
        // facets, or is crowded.
        for facet in 0..table.facet_count() as u32 {
            if let Some(across) = table.opposite(3 * facet)
                && table.vertex(across) == table.vertex(3 * facet)
                && facet < facet_of(across)
            {
                add(facet, facet_of(across));
            }
        }
        for corners in table.crowded() {
            let mut corners = corners.to_vec();
            corners.sort_unstable_by_key(|&corner| (table.vertex(corner), corner));
            for same in corners.chunk_by(|&a, &b| table.vertex(a) == table.vertex(b)) {
                let first = facet_of(same[0]);
                same[1..].iter().for_each(|&corner| add(first, facet_of(corner)));
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    }
}

/// Returns true if two facets with the same vertices run through them the same way.
fn is_same_way(table: &CornerTable, a: u32, b: u32) -> bool {
    let [first, then, _] = table.facet_vertices(a);
    let other = table.facet_vertices(b);
    let at = other.iter().position(|&vertex| vertex == first);
    at.is_some_and(|at| other[(at + 1) % 3] == then)
}

/// Returns true if a facet is degenerate (has no area): two corners share a vertex, or all corners
/// are on a line within the accuracy of 64 bits.
pub(crate) fn is_flat(table: &CornerTable, facet: u32) -> bool {
    is_flat_between(table.facet(facet))
}

/// Does the same as [`is_flat`] for three points.
pub(crate) fn is_flat_between([a, b, c]: [Vec3; 3]) -> bool {
    let (to_b, to_c) = (sub(b, a), sub(c, a));
    let across = cross(to_b, to_c);
    // Squares are compared, because roots cost time.
    // The sine of the angle at the first corner is within the rounding of the products.
    dot(across, across) <= (4.0 * f64::EPSILON).powi(2) * dot(to_b, to_b) * dot(to_c, to_c)
}

/// Returns true if all coordinates of a facet are finite.
pub(crate) fn is_finite(table: &CornerTable, facet: u32) -> bool {
    table.facet(facet).iter().flatten().all(|c| c.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topology::testing::{block, table_of};

    #[test]
    fn doubles_are_found_once_whichever_way_they_face() {
        let mut facets = block([0.0; 3], [1.0; 3]);
        let [a, b, c] = facets[4];
        facets.extend([[b, c, a], [c, b, a], facets[7]]);
        let doubled = |facet, of, is_same_way| Doubled { facet, of, is_same_way };
        let expected = [doubled(12, 4, true), doubled(13, 4, false), doubled(14, 7, true)];
        assert_eq!(Doubled::all(&table_of(&facets)), expected);
        assert_eq!(Doubled::all(&table_of(&[[a, b, c], [b, a, c]])), [doubled(1, 0, false)]);
        assert!(Doubled::all(&table_of(&block([0.0; 3], [1.0; 3]))).is_empty());
    }

    #[test]
    fn only_facets_without_area_are_flat() {
        let far = 1000.0;
        let table = table_of(&[
            [[far, 0.0, 0.0], [far + 1.0, 1.0, 0.0], [far + 2.0, 2.0, 0.0]],
            [[far, 0.0, 0.0], [far, 0.0, 0.0], [far + 2.0, 2.0, 0.0]],
            [[far, 0.0, 0.0], [far + 1.0, 1.0, 0.0], [far + 2.0, 2.0 + 2e-7, 0.0]],
            [[0.1, 0.2, 0.3], [0.2, 0.4, 0.6], [0.4, 0.8, 1.2]],
        ]);
        assert_eq!([0, 1, 2, 3].map(|facet| is_flat(&table, facet)), [true, true, false, true]);
    }
}
