//! Repairs degenerate facets whose three corners are different vertices.

use std::collections::VecDeque;

use lamp_brep::vector::{Vec3, distance};

use crate::topology::CornerTable;
use crate::topology::corner_table::{NONE, facet_of, next, previous};
use crate::topology::faults::is_flat_between;

/// The number of flips per facet. A side with n vertices along it takes about n flips, in any
/// order.
const FLIPS_PER_FACET: usize = 8;

/// The greatest number of facets around a vertex that are examined before a flip.
const MAX_AROUND: usize = 10_000;

/// Returns the facets, by number and with their vertices, that change when facets without area are
/// removed.
///
/// Such a facet has a corner on its longest side. That side is flipped: the facet across it becomes
/// two facets, which meet in the corner. No point of the surface moves. A facet stays where its
/// longest side has no neighbor, or where the flip would repeat an edge of the mesh.
pub(crate) fn without_slivers(table: &CornerTable) -> Vec<(u32, [u32; 3])> {
    let mut waiting: VecDeque<u32> =
        (0..table.facet_count() as u32).filter(|&facet| table.is_sliver(facet)).collect();
    if waiting.is_empty() {
        return Vec::new();
    }
    let corners = 0..table.corner_count();
    let mut work = Flips {
        points: table.points(),
        vertices: corners.clone().map(|corner| table.vertex(corner)).collect(),
        opposites: corners.map(|corner| table.opposite(corner).unwrap_or(NONE)).collect(),
    };
    let mut left = FLIPS_PER_FACET * table.facet_count();
    let mut touched = Vec::new();
    while let Some(facet) = waiting.pop_front() {
        let Some(corner) = work.to_flip(facet) else { continue };
        if left == 0 {
            break;
        }
        left -= 1;
        let across = facet_of(work.flip(corner));
        touched.extend([facet, across]);
        let around = [facet, across].into_iter().flat_map(|facet| work.facet_and_neighbours(facet));
        waiting.extend(around.filter(|&facet| work.is_flat(facet)));
    }
    touched.sort_unstable();
    touched.dedup();
    let vertices = |facet: u32| [0, 1, 2].map(|k| work.vertices[(3 * facet + k) as usize]);
    let is_changed = |&(facet, vertices): &(u32, [u32; 3])| table.facet_vertices(facet) != vertices;
    touched.into_iter().map(|facet| (facet, vertices(facet))).filter(is_changed).collect()
}

/// A corner table whose edges flip.
struct Flips<'a> {
    points: &'a [Vec3],
    vertices: Vec<u32>,
    opposites: Vec<u32>,
}

impl Flips<'_> {
    fn point(&self, corner: u32) -> Vec3 {
        self.points[self.vertices[corner as usize] as usize]
    }

    fn is_flat(&self, facet: u32) -> bool {
        is_flat_between([0, 1, 2].map(|k| self.point(3 * facet + k)))
    }

    fn opposite(&self, corner: u32) -> Option<u32> {
        Some(self.opposites[corner as usize]).filter(|&across| across != NONE)
    }

    /// Returns the corner opposite to a facet's longest side.
    fn between(&self, facet: u32) -> u32 {
        let side =
            |corner: &u32| distance(self.point(next(*corner)), self.point(previous(*corner)));
        let corners = 3 * facet..3 * facet + 3;
        corners.max_by(|a, b| side(a).total_cmp(&side(b))).unwrap_or(3 * facet)
    }

    /// Returns the corner of a degenerate facet whose opposite side can be flipped.
    fn to_flip(&self, facet: u32) -> Option<u32> {
        if !self.is_flat(facet) {
            return None;
        }
        let corner = self.between(facet);
        let across = self.opposite(corner)?;
        let vertex = |corner: u32| self.vertices[corner as usize];
        let runs_on = vertex(next(across)) == vertex(previous(corner))
            && vertex(previous(across)) == vertex(next(corner));
        // Of two on one line, the facet goes first whose longest side leads off the line: each flip
        // then shortens sides, so the flips end.
        let other = facet_of(across);
        let is_next = !self.is_flat(other) || self.between(other) == across;
        let is_apart = vertex(across) != vertex(corner);
        let is_free = runs_on && is_next && is_apart && !self.is_edge(corner, vertex(across));
        is_free.then_some(corner)
    }

    /// Returns true if an edge leads from a corner's vertex to another vertex.
    fn is_edge(&self, corner: u32, to: u32) -> bool {
        let ways: [fn(u32) -> u32; 2] = [next, previous];
        // Both ways around, as the first may end at the rim of the mesh.
        ways.into_iter().any(|way| {
            // Around the vertex, from facet to facet.
            let mut at = corner;
            // Beyond the limit the answer is yes, so that nothing is flipped.
            for _ in 0..MAX_AROUND {
                let ends = [next(at), previous(at)];
                if ends.iter().any(|&end| self.vertices[end as usize] == to) {
                    return true;
                }
                match self.opposite(way(at)) {
                    Some(across) if way(across) != corner => at = way(across),
                    _ => return false,
                }
            }
            true
        })
    }

    /// Flips the side opposite to a corner, so that it leads from the corner to the corner across,
    /// which it returns.
    fn flip(&mut self, corner: u32) -> u32 {
        let across = self.opposites[corner as usize];
        let (c, a) = (next(corner), next(across));
        self.vertices[previous(corner) as usize] = self.vertices[across as usize];
        self.vertices[previous(across) as usize] = self.vertices[corner as usize];
        let (beyond, before) = (self.opposites[a as usize], self.opposites[c as usize]);
        self.join(corner, beyond);
        self.join(across, before);
        self.join(c, a);
        across
    }

    fn join(&mut self, corner: u32, other: u32) {
        self.opposites[corner as usize] = other;
        if other != NONE {
            self.opposites[other as usize] = corner;
        }
    }

    fn facet_and_neighbours(&self, facet: u32) -> Vec<u32> {
        let corners = 3 * facet..3 * facet + 3;
        let across = corners.filter_map(|corner| self.opposite(corner)).map(facet_of);
        across.chain([facet]).collect()
    }
}

impl CornerTable {
    /// Returns true if a facet has no area although its corners are three vertices.
    fn is_sliver(&self, facet: u32) -> bool {
        !self.is_idle(facet) && is_flat_between(self.facet(facet))
    }

    /// Returns the table with some facets changed to other vertices.
    pub(crate) fn with_facets(self, changed: &[(u32, [u32; 3])]) -> Self {
        let (points, mut vertices, body_ends) = self.into_parts();
        for &(facet, of_facet) in changed {
            let first = 3 * facet as usize;
            vertices[first..first + 3].copy_from_slice(&of_facet);
        }
        Self::of_bodies(points, vertices, body_ends)
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::SplitMix;

    use super::*;
    use crate::facet::Facet;
    use crate::topology::MeshCheck;
    use crate::topology::testing::table_of;

    /// A prism over a triangle, with vertices along the upper side of its front. The front has
    /// degenerate facets between them: the strip is cut as `cut` specifies.
    fn prism(along: &[f32], mut cut: impl FnMut(usize) -> usize) -> Vec<Facet> {
        let [a, b, c] = [[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 6.0, 0.0f32]];
        let up = |[x, y, z]: [f32; 3]| [x, y, z + 4.0];
        let [d, e, f] = [a, b, c].map(up);
        let mut facets = vec![[a, c, b], [a, b, e], [a, e, d], [b, c, f], [b, f, e]];
        facets.extend([[c, a, d], [c, d, f]]);
        // The lid uses the vertices, the front does not.
        let line: Vec<[f32; 3]> =
            [d].into_iter().chain(along.iter().map(|&x| [x, 0.0, 4.0])).chain([e]).collect();
        facets.extend(line.windows(2).map(|side| [side[0], side[1], f]));
        let mut pieces = vec![(0, line.len() - 1)];
        while let Some((first, last)) = pieces.pop() {
            if last - first > 1 {
                let middle = first + 1 + cut(last - first - 1);
                facets.push([line[first], line[last], line[middle]]);
                pieces.extend([(first, middle), (middle, last)]);
            }
        }
        facets
    }

    #[test]
    fn sides_with_vertices_along_them_keep_their_volume_and_lose_their_slivers() {
        let mut numbers = SplitMix(11);
        for round in 0..40 {
            let count = 1 + round * round / 8;
            let mut along: Vec<f32> =
                (0..count).map(|_| (1 + numbers.below(8190)) as f32 / 1024.0).collect();
            along.sort_by(f32::total_cmp);
            along.dedup();
            let facets = prism(&along, |count| match round % 3 {
                0 => 0,
                1 => count - 1,
                _ => numbers.below(count),
            });
            let table = table_of(&facets);
            assert_eq!(MeshCheck::new(&table).flat.len(), along.len());
            let changed = without_slivers(&table);
            let mended = MeshCheck::new(&table.with_facets(&changed));
            assert!(mended.is_clean(), "round {round}: {:?}", mended.flat);
            let volume = mended.lumps[0].mass.unwrap().volume_mm3;
            assert!((volume - 96.0).abs() < 1e-9, "{volume}");
        }
    }

    #[test]
    fn a_sliver_at_a_rim_stays() {
        let line = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0f32]];
        let facets = [line, [[0.0; 3], [5.0, 5.0, 5.0], [1.0, 0.0, 0.0]]];
        assert!(without_slivers(&table_of(&facets)).is_empty());
    }
}
