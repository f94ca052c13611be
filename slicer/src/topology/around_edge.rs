//! Finds which of many facets around one edge are neighbors.

use lamp_brep::vector::{Vec3, cross, dot, length, sub};

use crate::topology::corner_table::{next, previous};

/// Facets whose angles differ by less, in radians, have no order.
const SAME_ANGLE: f64 = 1e-7;

/// Pairs the facets around an edge, given by the corners opposite to it: any two facets with solid
/// between them. There are no pairs unless the facets face each other alternately, as they do where
/// solids touch in an edge.
pub(crate) fn neighbours(corners: &[u32], points: &[Vec3], vertices: &[u32]) -> Vec<[u32; 2]> {
    let Some(around) = sorted(corners, points, vertices) else { return Vec::new() };
    let alternate = |k: usize| around[k].is_forward != around[(k + 1) % around.len()].is_forward;
    if !(0..around.len()).all(alternate) {
        return Vec::new();
    }
    // By ascending angle, solid follows a facet that runs backward along the edge.
    let start = usize::from(around[0].is_forward);
    let pair = |k: usize| [around[k].corner, around[(k + 1) % around.len()].corner];
    (start..around.len()).step_by(2).map(pair).collect()
}

/// A facet at an edge.
struct Leaf {
    corner: u32,
    /// Whether it runs along the edge from the lower vertex to the upper one.
    is_forward: bool,
    /// The angle around the edge, counterclockwise seen against its direction.
    angle: f64,
}

/// Returns the facets by ascending angle, if all angles differ.
fn sorted(corners: &[u32], points: &[Vec3], vertices: &[u32]) -> Option<Vec<Leaf>> {
    let vertex = |corner: u32| vertices[corner as usize];
    let point = |vertex: u32| points[vertex as usize];
    let ends = [next(corners[0]), previous(corners[0])].map(vertex);
    let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
    let along = sub(point(high), point(low));
    let apex = |corner: u32| sub(point(vertex(corner)), point(low));
    // Axes across the edge, with the first facet at angle zero.
    let up = cross(along, apex(corners[0]));
    let out = cross(up, along);
    let scales = (length(up), length(out));
    let leaf = |&corner: &u32| Leaf {
        corner,
        is_forward: vertex(next(corner)) == low,
        angle: (dot(apex(corner), up) / scales.0).atan2(dot(apex(corner), out) / scales.1),
    };
    let mut leaves: Vec<Leaf> = corners.iter().map(leaf).collect();
    leaves.sort_by(|a, b| a.angle.total_cmp(&b.angle));
    // The first facet follows the last one.
    let full = leaves[0].angle + std::f64::consts::TAU;
    let ends = leaves.iter().skip(1).map(|leaf| leaf.angle).chain([full]);
    let differ = leaves.iter().zip(ends).all(|(leaf, end)| end - leaf.angle > SAME_ANGLE);
    differ.then_some(leaves)
}

#[cfg(test)]
mod tests {
    use crate::topology::Shells;
    use crate::topology::testing::{block, table_of};

    #[test]
    fn blocks_that_touch_in_an_edge_are_two_shells() {
        let mut facets = block([0.0; 3], [1.0; 3]);
        facets.extend(block([1.0, 1.0, 0.0], [2.0, 2.0, 1.0]));
        let table = table_of(&facets);
        assert_eq!(table.crowded().map(<[u32]>::len).collect::<Vec<_>>(), [4]);
        assert!((0..table.corner_count()).all(|corner| table.opposite(corner).is_some()));
        let shells = Shells::new(&table);
        assert_eq!(shells.count(), 2);
        assert!((0..12).all(|facet| shells.of(facet) == 0 && shells.of(facet + 12) == 1));
    }

    #[test]
    fn a_facet_that_repeats_has_no_neighbours() {
        let mut facets = block([0.0; 3], [1.0; 3]);
        facets.push(facets[3]);
        let table = table_of(&facets);
        assert_eq!(table.crowded().map(<[u32]>::len).collect::<Vec<_>>(), [3; 3]);
        let alone = (0..table.corner_count()).filter(|&corner| table.opposite(corner).is_none());
        assert_eq!(alone.count(), 9);
        assert_eq!(Shells::new(&table).count(), 1);
    }

    #[test]
    fn flat_facets_around_an_edge_are_in_no_order() {
        let at = |x: f32, y: f32| [x, y, 0.0];
        let [low, high] = [at(0.0, 0.0), at(0.0, 1.0)];
        let facet = |x: f32| [low, high, at(x, 0.5)];
        let table = table_of(&[facet(1.0), facet(2.0), facet(-1.0), facet(-2.0), facet(0.0)]);
        assert!((0..table.corner_count()).all(|corner| table.opposite(corner).is_none()));
    }
}
