//! Finds the corners that share an edge: O and E of 002 section 2.3.2.1.

use lamp_stack::Grouped;

use crate::topology::around_edge::neighbours;
use crate::topology::corner_table::{NONE, facet_of, next, previous};

/// The edges of a mesh, as its corners see them.
#[derive(Clone, Debug)]
pub(crate) struct Edges {
    /// By corner, the corner across the opposite edge.
    pub(crate) opposites: Vec<u32>,
    /// By corner, the opposite edge.
    pub(crate) numbers: Vec<u32>,
    /// The number of edges.
    pub(crate) count: u32,
    /// The corners opposite to each edge of three facets and more.
    pub(crate) crowded: Vec<Box<[u32]>>,
    /// Whether a corner is opposite to such an edge, sorted.
    crowded_corners: Vec<u32>,
}

impl Edges {
    /// Finds the edges of facets, given by the vertices of their corners.
    ///
    /// Corners are put into bins by the lower vertex of their opposite edge, as algorithm 2 of 002
    /// does, and those of a bin sorted by the upper one.
    pub(crate) fn of(points: &[[f64; 3]], vertices: &[u32]) -> Self {
        let finite: Vec<bool> =
            points.iter().map(|point| point.iter().all(|c| c.is_finite())).collect();
        let ends = |corner: u32| [next(corner), previous(corner)].map(|c| vertices[c as usize]);
        let is_idle = |facet: u32| {
            let [a, b, c] = [0, 1, 2].map(|k| vertices[3 * facet as usize + k]);
            a == b || b == c || c == a || [a, b, c].iter().any(|&v| !finite[v as usize])
        };
        let low_ends = || {
            let corners = 0..vertices.len() as u32;
            let busy = corners.filter(|&corner| !is_idle(facet_of(corner)));
            busy.map(|corner| (ends(corner).into_iter().min().unwrap_or(NONE) as usize, corner))
        };
        let mut bins = Grouped::new(points.len(), low_ends);
        let mut edges = Self {
            opposites: vec![NONE; vertices.len()],
            numbers: vec![NONE; vertices.len()],
            count: 0,
            crowded: Vec::new(),
            crowded_corners: Vec::new(),
        };
        let high_end = |corner: u32| ends(corner).into_iter().max();
        for vertex in 0..points.len() {
            let bin = bins.group_mut(vertex);
            bin.sort_unstable_by_key(|&corner| (high_end(corner), corner));
            for corners in bin.chunk_by(|&a, &b| high_end(a) == high_end(b)) {
                edges.add(corners, points, vertices);
            }
        }
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

    /// Returns true if the edge opposite to a corner is one of three facets and more.
    pub(crate) fn is_crowded(&self, corner: u32) -> bool {
        self.crowded_corners.binary_search(&corner).is_ok()
    }
}
