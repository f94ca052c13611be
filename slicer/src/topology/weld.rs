//! Joins vertices of open rims that lie within a tolerance of each other.

use std::collections::HashMap;

use lamp_brep::vector::{Vec3, distance};

use crate::topology::CornerTable;

impl CornerTable {
    /// Joins vertices at rims with the nearest vertex at a rim, among those numbered before, that
    /// lies within a tolerance in millimetres. Returns the table and the corners that moved.
    ///
    /// The seed looks at all vertices (002 figure 21); but where facets are closed, vertices close
    /// together are fine detail, which a tolerance would crush.
    #[must_use]
    pub fn welded(self, within_mm: f64) -> (Self, Vec<u32>) {
        let moved_to = self.near_vertices(within_mm);
        if moved_to.is_empty() {
            return (self, Vec::new());
        }
        let (points, mut vertices, body_ends) = self.into_parts();
        let mut moved = Vec::new();
        for (corner, vertex) in (0..).zip(&mut vertices) {
            if let Some(&to) = moved_to.get(vertex) {
                *vertex = to;
                moved.push(corner);
            }
        }
        (Self::of_bodies(points, vertices, body_ends), moved)
    }

    /// Returns the vertices that move, and the vertex to which each does.
    fn near_vertices(&self, within_mm: f64) -> HashMap<u32, u32> {
        let mut moved_to = HashMap::new();
        if !(within_mm > 0.0 && within_mm.is_finite()) {
            return moved_to;
        }
        for facets in self.bodies() {
            let rims = (3 * facets.start..3 * facets.end).filter(|&corner| self.is_rim(corner));
            let mut vertices: Vec<u32> = rims.flat_map(|corner| self.edge_ends(corner)).collect();
            vertices.sort_unstable();
            vertices.dedup();
            let mut cells = Cells { side: within_mm, vertices: HashMap::new() };
            for vertex in vertices {
                let point = self.points()[vertex as usize];
                match cells.nearest(point, self.points()) {
                    Some(near) => _ = moved_to.insert(vertex, near),
                    None => cells.vertices.entry(cells.key(point)).or_default().push(vertex),
                }
            }
        }
        moved_to
    }
}

/// Cubes as wide as the tolerance, and the vertices in each. These are farther apart than the
/// tolerance, so a cube has few.
struct Cells {
    side: f64,
    vertices: HashMap<[u64; 3], Vec<u32>>,
}

impl Cells {
    fn key(&self, point: Vec3) -> [u64; 3] {
        self.key_beside(point, [0.0; 3])
    }

    /// Returns the key of a cell some cells away. Far from the origin, where steps of floating
    /// point are wider than cells, it is the same.
    fn key_beside(&self, point: Vec3, steps: Vec3) -> [u64; 3] {
        [0, 1, 2].map(|axis| ((point[axis] / self.side).floor() + steps[axis] + 0.0).to_bits())
    }

    /// Returns the nearest vertex within the tolerance, the first one of several.
    fn nearest(&self, point: Vec3, points: &[Vec3]) -> Option<u32> {
        let steps = (0..27).map(|k| [k % 3, k / 3 % 3, k / 9].map(|step| f64::from(step) - 1.0));
        let near = steps.filter_map(|steps| self.vertices.get(&self.key_beside(point, steps)));
        let away = |vertex: u32| (distance(points[vertex as usize], point), vertex);
        let away = near.flatten().map(|&vertex| away(vertex)).filter(|(mm, _)| *mm <= self.side);
        let nearest = away.min_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
        nearest.map(|(_, vertex)| vertex)
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::{Defect, inject, sphere};

    use crate::topology::MeshCheck;
    use crate::topology::testing::table_of;

    #[test]
    fn nudged_corners_come_back_and_fine_detail_stays() {
        let good = sphere(10.0, 5_000);
        let mut mesh = good.clone();
        let chosen = inject(&mut mesh, Defect::Nudge { by_mm: 0.01 }, 12, 5);
        let (table, moved) = table_of(&mesh.facets).welded(0.011);
        assert!(MeshCheck::new(&table).is_clean());
        assert!(moved.iter().all(|corner| {
            let facet = corner / 3;
            chosen.contains(&(facet as usize)) || table.facet(facet) != good_facet(&good, facet)
        }));
        // A tolerance far above its edges changes nothing in a closed mesh.
        let closed = table_of(&good.facets);
        let (count, (table, moved)) = (closed.points().len(), closed.welded(5.0));
        assert_eq!((table.points().len(), moved.len()), (count, 0));
    }

    fn good_facet(mesh: &lamp_fixtures::Mesh, facet: u32) -> [[f64; 3]; 3] {
        mesh.facets[facet as usize].map(|corner| corner.map(f64::from))
    }

    #[test]
    fn the_nearest_earlier_vertex_wins() {
        let at = |x: f32| [x, 0.0, 0.0];
        let [up, down] = [[0.0, 9.0, 0.0], [0.0, -9.0, 0.0f32]];
        let facets =
            [[at(0.0), at(50.0), up], [at(1.0), at(60.0), down], [at(0.7), at(70.0), down]];
        let vertex = |within: f64| {
            let (table, _) = table_of(&facets).welded(within);
            [0, 3, 6].map(|corner| table.point(corner)[0])
        };
        // 1 is too far from 0, and 0.7 nearer to 1 than to 0.
        let last = f64::from(0.7f32);
        assert_eq!(vertex(0.9), [0.0, 1.0, 1.0]);
        assert_eq!(vertex(0.1), [0.0, 1.0, last]);
        assert_eq!(vertex(1.0), [0.0, 0.0, 0.0]);
        assert_eq!(vertex(f64::NAN), [0.0, 1.0, last]);
    }

    #[test]
    fn points_far_away_are_no_trouble() {
        let far = f32::MAX;
        let facets: Vec<_> = (0..200)
            .map(|k| [[far, k as f32, 0.0], [0.0, far, 1.0], [k as f32, -far, far]])
            .collect();
        let (_, moved) = table_of(&facets).welded(1e-9);
        assert!(moved.is_empty());
    }
}
