//! Joins vertices of open rims (boundary edges) within a tolerance of each other.

use std::collections::HashMap;

use lamp_brep::vector::{Vec3, distance};

use crate::topology::CornerTable;

/// The number of steps of 32-bit numbers at the greatest coordinate, within which rounding alone
/// may separate corners.
const STEPS: f64 = 4.0;

/// The upper limit of the usual tolerance, as a share of the diagonal of the box: 5 um for 100 mm.
/// Programs that write few digits write at least five.
const OF_SIZE: f64 = 5e-5;

/// The upper limit, as a share of the shortest side at a rim.
const OF_SIDES: f64 = 0.25;

impl CornerTable {
    /// Returns the distance within which vertices at rims are meant to be one vertex, in the unit
    /// of the points: 1/20 000 of the diagonal of the box, but at most a quarter of the shortest
    /// side at a rim, so that no facet collapses, and at least four steps of a 32-bit number at the
    /// greatest coordinate. Sides as short as these steps do not count.
    pub fn usual_weld(&self) -> f64 {
        let finite = self.points().iter().filter(|point| point.iter().all(|c| c.is_finite()));
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in finite {
            low = [0, 1, 2].map(|axis| point[axis].min(low[axis]));
            high = [0, 1, 2].map(|axis| point[axis].max(high[axis]));
        }
        let greatest = low.into_iter().chain(high).map(f64::abs).fold(0.0, f64::max);
        let least = STEPS * f64::from(f32::EPSILON) * greatest;
        let rims = (0..self.corner_count()).filter(|&corner| self.is_rim(corner));
        let sides = rims.map(|corner| {
            let [a, b] = self.edge_ends(corner).map(|vertex| self.points()[vertex as usize]);
            distance(a, b)
        });
        let shortest = sides.filter(|side| *side > least).fold(f64::INFINITY, f64::min);
        let usual = (OF_SIZE * distance(low, high)).min(OF_SIDES * shortest).max(least);
        if usual.is_finite() { usual } else { 0.0 }
    }

    /// Joins each vertex at a rim with the nearest earlier vertex at a rim within a tolerance in
    /// millimeters. Returns the table and the corners that moved.
    ///
    /// The seed examines all vertices (002 figure 21). But where facets are closed, vertices close
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

    /// Returns the vertices that move, and their target vertices.
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
            let mut cells = VertexCubes { side: within_mm, vertices: HashMap::new() };
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

/// Cubes as wide as the tolerance, and the vertices in each cube. The vertices are farther apart
/// than the tolerance, so a cube has few.
struct VertexCubes {
    side: f64,
    vertices: HashMap<[u64; 3], Vec<u32>>,
}

impl VertexCubes {
    fn key(&self, point: Vec3) -> [u64; 3] {
        self.key_beside(point, [0.0; 3])
    }

    /// Returns the key of a cell some cells away. Far from the origin, where steps of floating
    /// point are wider than cells, it is the same key.
    fn key_beside(&self, point: Vec3, steps: Vec3) -> [u64; 3] {
        // Adding 0 gives -0 the bits of 0.
        [0, 1, 2].map(|axis| ((point[axis] / self.side).floor() + steps[axis] + 0.0).to_bits())
    }

    /// Returns the nearest vertex within the tolerance; of several, the first.
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
    fn the_usual_tolerance_follows_the_part() {
        let good = sphere(10.0, 5_000);
        // The same part in every size and place: gaps of 1/100 000 of its size close, details do
        // not.
        for (scale, shift) in [(1.0, 0.0), (1e-3, 0.0), (50.0, 0.0), (1.0, 90.0), (1.0, -1e4)] {
            let mut mesh = good.clone();
            let gap = if shift < -1e3 { 0.003 } else { 2e-4 };
            inject(&mut mesh, Defect::Nudge { by_mm: gap }, 12, 5);
            let mesh = mesh.map(|point| point.map(|c| c * scale + shift));
            let table = table_of(&mesh.facets);
            let within = table.usual_weld();
            let (table, moved) = table.welded(within);
            assert!(MeshCheck::new(&table).is_clean() && !moved.is_empty(), "{scale} {shift}");
            let size = 20.0 * 3f64.sqrt() * scale;
            let steps = 4.0 * 2f64.powi(-23) * (f64::abs(shift) + 21.0);
            assert!(within <= f64::max(size / 19_900.0, steps), "{within}");
        }
        // Steps of a comb, 1 um wide on a part of a meter, are not gaps.
        let tooth = |k: usize| [k as f32 * 1e-3, 0.0, 0.0f32];
        let far = [1000.0, 1000.0, 0.0f32];
        let comb: Vec<_> = (0..50).map(|k| [tooth(k), tooth(k + 1), far]).collect();
        let table = table_of(&comb);
        let within = table.usual_weld();
        assert!(within < 5e-4, "{within}");
        assert!(table.welded(within).1.is_empty());
        assert_eq!(table_of(&[[[f32::NAN; 3]; 3]]).usual_weld(), 0.0);
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
