//! Measures poses: islands, pits, overhangs and size.

use lamp_slicing::PLANE_TOLERANCE;
use lamp_slicing::topology::{CornerTable, Minimum, MinimumKind, Relief};
use rayon::prelude::*;

use super::Pose;

/// Limits from which a pose counts islands, pits and overhangs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseLimits {
    /// The thickness of layers, in millimeters. Islands and pits less deep do not count, nor do
    /// islands and overhangs in the layer that stands on the platform.
    pub thickness_mm: f64,
    /// The angle in degrees, from upright, beyond which a facet that faces down is an overhang.
    pub max_overhang_deg: f64,
}

impl Default for PoseLimits {
    /// Layers of 100 um, and 45°.
    fn default() -> Self {
        Self { thickness_mm: 0.1, max_overhang_deg: 45.0 }
    }
}

/// A pose, and the measures of a build in it.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseFacts {
    /// The pose.
    pub pose: Pose,
    /// How many islands there are: minima with solid above that do not stand on the platform.
    pub islands: usize,
    /// How many pits there are, which hold slurry: minima with solid below.
    pub pits: usize,
    /// The area of the facets that overhang, in square millimeters.
    pub overhang_mm2: f64,
    /// The part's height, in millimeters.
    pub height_mm: f64,
    /// The sides of the part's box seen from above, along x and y, in millimeters.
    pub footprint_mm: [f64; 2],
}

/// Measures poses of a part, in their order. All threads share the poses; the number of threads
/// changes nothing.
///
/// Besides the table it takes 28 bytes a facet and 28 a vertex, and each thread 15 a vertex.
///
/// Bodies that only overlap do not meet here: each has its own islands.
pub fn measure(table: &CornerTable, poses: &[Pose], limits: &PoseLimits) -> Vec<PoseFacts> {
    let part = MeasuredPart {
        table,
        relief: Relief::new(table),
        points: points(table),
        areas: areas(table),
    };
    poses.par_iter().map(|pose| part.facts(*pose, limits)).collect()
}

/// A part that is measured in many poses.
struct MeasuredPart<'a> {
    table: &'a CornerTable,
    relief: Relief<'a>,
    /// The points that facets have.
    points: Vec<[f64; 3]>,
    /// By facet, the outward normal as long as the area, and the area.
    areas: Vec<[f32; 4]>,
}

fn points(table: &CornerTable) -> Vec<[f64; 3]> {
    let mut is_used = vec![false; table.points().len()];
    for facet in (0..table.facet_count() as u32).filter(|&facet| !table.is_idle(facet)) {
        table.facet_vertices(facet).iter().for_each(|&vertex| is_used[vertex as usize] = true);
    }
    let used = table.points().iter().zip(&is_used).filter(|(_, is_used)| **is_used);
    used.map(|(&point, _)| point).collect()
}

fn areas(table: &CornerTable) -> Vec<[f32; 4]> {
    let area = |facet: u32| {
        let [a, b, c] = table.facet(facet);
        let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
        let normal = [0, 1, 2].map(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            0.5 * (u[i] * v[j] - u[j] * v[i])
        });
        let area = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
        [normal[0], normal[1], normal[2], area].map(|value| value as f32)
    };
    let facets = 0..table.facet_count() as u32;
    facets.map(|facet| if table.is_idle(facet) { [0.0; 4] } else { area(facet) }).collect()
}

impl MeasuredPart<'_> {
    fn facts(&self, pose: Pose, limits: &PoseLimits) -> PoseFacts {
        let axes = pose.axes();
        let up = axes[2];
        let heights = self.relief.heights(up);
        let extents = self.extents(axes);
        let [lowest, _] = extents[2];
        let minima = self.relief.minima(up, &heights, limits.thickness_mm);
        // Files round heights, and whole layers are common.
        let hair = PLANE_TOLERANCE.mm().min(0.5 * limits.thickness_mm);
        let is_deep = |minimum: &&Minimum| minimum.depth_mm >= limits.thickness_mm - hair;
        let platform = lowest + limits.thickness_mm - hair;
        let (islands, pits): (Vec<_>, Vec<_>) =
            minima.iter().filter(is_deep).partition(|minimum| minimum.kind == MinimumKind::Island);
        PoseFacts {
            pose,
            islands: islands.iter().filter(|island| island.height_mm >= platform).count(),
            pits: pits.len(),
            overhang_mm2: self.overhang(up, &heights, platform, limits.max_overhang_deg),
            height_mm: length(extents[2]),
            footprint_mm: [length(extents[0]), length(extents[1])],
        }
    }

    /// Returns the least and the greatest coordinates along three unit vectors.
    fn extents(&self, axes: [[f64; 3]; 3]) -> [[f64; 2]; 3] {
        let mut extents = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for point in &self.points {
            for ([x, y, z], extent) in axes.iter().zip(&mut extents) {
                let at = x * point[0] + y * point[1] + z * point[2];
                // Points are finite, so the special cases of min and max are not needed.
                *extent = [
                    if at < extent[0] { at } else { extent[0] },
                    if at > extent[1] { at } else { extent[1] },
                ];
            }
        }
        extents
    }

    fn overhang(&self, up: [f64; 3], heights: &[f64], platform: f64, max_deg: f64) -> f64 {
        // Faces that lean by exactly the limit count as held, however their normals are rounded.
        let limit = -(max_deg.to_radians().sin() + 1e-6) as f32;
        let [x, y, z] = up.map(|c| c as f32);
        let leans = |&[nx, ny, nz, area]: &[f32; 4]| nx * x + ny * y + nz * z < limit * area;
        let overhanging = (0..).zip(&self.areas).filter(|(_, area)| leans(area));
        let above = overhanging.filter(|&(facet, _)| self.is_above(facet, heights, platform));
        above.map(|(_, area)| f64::from(area[3])).sum()
    }

    fn is_above(&self, facet: u32, heights: &[f64], platform: f64) -> bool {
        let heights = self.table.facet_vertices(facet).map(|vertex| heights[vertex as usize]);
        heights.iter().any(|&height| height > platform)
    }
}

/// Returns the length of an extent; 0 if there are no points.
fn length([low, high]: [f64; 2]) -> f64 {
    (high - low).max(0.0)
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::{Mesh, cup, needle, slanted_wall, twin_islands};
    use lamp_slicing::{Part, Placement, Units};

    use super::super::poses;
    use super::*;

    fn table(mesh: Mesh) -> CornerTable {
        let part = Part::from_facets("test", mesh.facets);
        CornerTable::of_part(&part, &Placement::default(), Units::Millimetres).unwrap()
    }

    fn facts(mesh: Mesh, up: [f64; 3]) -> PoseFacts {
        measure(&table(mesh), &[Pose::with_up(up)], &PoseLimits::default()).remove(0)
    }

    fn counted(mesh: Mesh, up: [f64; 3]) -> (usize, usize, f64) {
        let PoseFacts { islands, pits, overhang_mm2, .. } = facts(mesh, up);
        (islands, pits, (overhang_mm2 * 1e3).round() / 1e3)
    }

    const UP: [f64; 3] = [0.0, 0.0, 1.0];
    const DOWN: [f64; 3] = [0.0, 0.0, -1.0];

    #[test]
    fn parts_have_their_islands_pits_and_overhangs() {
        // The beam's underside, except where something hangs from it.
        assert_eq!(counted(needle(2_000), UP), (1, 0, 96.0 - 16.0));
        assert_eq!(counted(needle(2_000), DOWN), (0, 0, 0.0));
        let undersides = 96.0 - 4.0 + 4.0 + 4.0 + (12.0 - 4.0) * 2.0;
        assert_eq!(counted(twin_islands(1), UP), (2, 0, undersides));
        assert_eq!(counted(cup(1), UP), (0, 1, 0.0));
        assert_eq!(counted(cup(1), DOWN), (0, 0, 96.0));
    }

    #[test]
    fn a_wall_that_leans_by_the_limit_is_no_overhang() {
        assert_eq!(counted(slanted_wall(2.0, 1.0, 500), UP), (0, 0, 0.0));
        let (.., overhang_mm2) = counted(slanted_wall(2.0, 1.001, 500), UP);
        assert!((overhang_mm2 - 400.0 * 2f64.sqrt()).abs() < 0.5);
    }

    #[test]
    fn size_is_that_of_the_turned_part() {
        let standing = facts(needle(1), UP);
        assert_eq!((standing.height_mm, standing.footprint_mm), (24.0, [28.0, 4.0]));
        let lying = facts(needle(1), [1.0, 0.0, 0.0]);
        assert_eq!((lying.pose.to_string(), lying.height_mm), ("y:-90".to_owned(), 28.0));
        assert_eq!(lying.footprint_mm, [24.0, 4.0]);
    }

    #[test]
    fn any_number_of_threads_finds_the_same() {
        let table = table(lamp_fixtures::mug(3_000));
        let poses = poses(40, 180.0);
        let found = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| measure(&table, &poses, &PoseLimits::default()))
        };
        assert_eq!(found(1), found(4));
        assert_eq!(found(1).len(), 46);
    }

    #[test]
    fn a_mesh_of_nothing_but_nonsense_is_measured() {
        let facets = vec![[[f32::NAN; 3], [0.0; 3], [1.0; 3]], [[2.0; 3]; 3]];
        let PoseFacts { islands, pits, height_mm, .. } = facts(Mesh { facets }, UP);
        assert_eq!((islands, pits, height_mm), (0, 0, 0.0));
    }
}
