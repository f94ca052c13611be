//! Finds the corners that share an edge: O and E of 002 section 2.3.2.1.

use lamp_stack::Grouped;

use crate::topology::around_edge::neighbours;
use crate::topology::corner_table::{NONE, next, previous};

/// The edges of a mesh, as seen from its corners.
#[derive(Clone, Debug)]
pub(crate) struct MeshEdges {
    /// For each corner, the corner across the opposite edge.
    pub(crate) opposites: Vec<u32>,
    /// For each corner, the opposite edge.
    pub(crate) numbers: Vec<u32>,
    /// The number of edges.
    pub(crate) count: u32,
    /// The corners opposite to each crowded edge, which has three or more facets.
    pub(crate) crowded: Vec<Box<[u32]>>,
    /// The corners opposite to crowded edges, sorted.
    crowded_corners: Vec<u32>,
}

impl MeshEdges {
    /// Finds the edges of facets, given by the vertices of their corners.
    ///
    /// Corners are put into bins by the lower vertex of their opposite edge, as in algorithm 2 of
    /// 002, and the corners of a bin are sorted by the upper vertex.
    pub(crate) fn of(points: &[[f64; 3]], vertices: &[u32]) -> Self {
        let is_finite = |point: &[f64; 3]| point.iter().all(|c| c.is_finite());
        // Nearly every mesh is finite. One pass here saves three look-ups for each facet.
        let all_are_finite = points.iter().all(is_finite);
        let is_busy = |corners: &[u32]| {
            let is_finite = |&vertex: &u32| is_finite(&points[vertex as usize]);
            let [a, b, c] = [corners[0], corners[1], corners[2]];
            a != b && b != c && c != a && (all_are_finite || corners.iter().all(is_finite))
        };
        let low_ends = || {
            let facets = (0..).step_by(3).zip(vertices.chunks_exact(3));
            let busy = facets.filter(|(_, corners)| is_busy(corners));
            busy.flat_map(|(first, corners): (u32, &[u32])| {
                let [a, b, c] = [corners[0], corners[1], corners[2]];
                [(b.min(c), first), (c.min(a), first + 1), (a.min(b), first + 2)]
            })
        };
        let mut bins =
            Grouped::new(points.len(), || low_ends().map(|(low, corner)| (low as usize, corner)));
        let mut edges = Self {
            opposites: vec![NONE; vertices.len()],
            numbers: vec![NONE; vertices.len()],
            count: 0,
            crowded: Vec::new(),
            crowded_corners: Vec::new(),
        };
        let high_end = |corner: u32| {
            let [a, b] = [next(corner), previous(corner)].map(|c| vertices[c as usize]);
            a.max(b)
        };
        let mut by_high_end = Vec::new();
        for vertex in 0..points.len() {
            let bin = bins.group_mut(vertex);
            by_high_end.clear();
            by_high_end.extend(bin.iter().map(|&corner| (high_end(corner), corner)));
            by_high_end.sort_unstable();
            for (place, &(_, corner)) in bin.iter_mut().zip(&by_high_end) {
                *place = corner;
            }
            let mut start = 0;
            for same in by_high_end.chunk_by(|a, b| a.0 == b.0) {
                edges.add(&bin[start..start + same.len()], points, vertices);
                start += same.len();
            }
        }
        // Crowded edges are few, so a sorted list takes less than a flag for each corner.
        edges.crowded_corners = edges.crowded.iter().flatten().copied().collect();
        edges.crowded_corners.sort_unstable();
        edges
    }

    /// Adds an edge, given by the corners opposite to it.
    fn add(&mut self, corners: &[u32], points: &[[f64; 3]], vertices: &[u32]) {
        for &corner in corners {
            self.numbers[corner as usize] = self.count;
        }
        self.count += 1;
        match *corners {
            [_] => {}
            [a, b] => self.join(a, b),
            _ => {
                let pairs = neighbours(corners, points, vertices);
                pairs.into_iter().for_each(|[a, b]| self.join(a, b));
                self.crowded.push(corners.into());
            }
        }
    }

    fn join(&mut self, a: u32, b: u32) {
        self.opposites[a as usize] = b;
        self.opposites[b as usize] = a;
    }

    /// Returns true if the edge opposite to a corner has three or more facets.
    pub(crate) fn is_crowded(&self, corner: u32) -> bool {
        self.crowded_corners.binary_search(&corner).is_ok()
    }
}
