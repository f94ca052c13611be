//! Merges vertices within the tolerance.

use std::collections::{HashMap, HashSet};

use super::Healing;
use crate::model::Loop;
use crate::vector::{Vec3, add, distance, scale};

/// The greatest number of steps that move a vertex to the place where its edges meet.
const MAX_STEPS: usize = 50;
/// The length of the last step, in millimeters.
const SETTLED_MM: f64 = 1e-9;

impl Healing<'_> {
    /// Merges vertices within the tolerance of each other.
    pub(super) fn join_vertices(&mut self) {
        let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        // Each vertex becomes the first one within the tolerance.
        let mut becomes: HashMap<usize, usize> = HashMap::new();
        for vertex in self.loose() {
            let place = self.vertices[vertex];
            let cell = place.map(|x| (x / self.tolerance_mm).floor() as i64);
            // Cells are as wide as the tolerance, so a vertex within it is in one of 27 cells.
            let around = (0..27).map(|k| {
                [0, 1, 2].map(|axis| cell[axis].saturating_add(k / 3i64.pow(axis as u32) % 3 - 1))
            });
            let near = around
                .filter_map(|cell| cells.get(&cell))
                .flatten()
                .copied()
                .find(|&other| distance(self.vertices[other], place) <= self.tolerance_mm);
            match near {
                Some(other) => drop(becomes.insert(vertex, other)),
                None => cells.entry(cell).or_default().push(vertex),
            }
        }
        self.collapse(&becomes);
        self.rename(&becomes);
    }

    /// Moves merged vertices to the place where their edges' curves meet, or to a pole
    /// of their surface within the tolerance.
    pub(super) fn settle(&mut self) {
        let mut around: HashMap<usize, Vec<usize>> = HashMap::new();
        for &edge in self.widest_mm.keys() {
            self.edges[edge].ends.iter().for_each(|end| around.entry(*end).or_default().push(edge));
        }
        let near = |a: Vec3, b: Vec3| distance(a, b) <= self.tolerance_mm;
        for (&vertex, edges) in &around {
            let start = self.vertices[vertex];
            let mut place = start;
            for _ in 0..MAX_STEPS {
                // Averaging the feet on all curves converges to their common point.
                let feet = edges.iter().map(|edge| {
                    let curve = &self.edges[*edge].curve;
                    curve.place(curve.project(place))
                });
                let middle = scale(feet.fold([0.0; 3], add), 1.0 / edges.len() as f64);
                let way = distance(middle, std::mem::replace(&mut place, middle));
                if way < SETTLED_MM {
                    break;
                }
            }
            if near(place, start) {
                self.vertices[vertex] = place;
            }
        }
        for face in self.faces.iter() {
            let poles = face.surface.poles();
            let ends = face.loops.iter().flat_map(|around| match around {
                Loop::Edges(edges) => {
                    edges.iter().flat_map(|(edge, _)| self.edges[*edge].ends).collect()
                }
                Loop::Vertex(vertex) => vec![*vertex],
            });
            for end in ends.filter(|end| around.contains_key(end)) {
                if let Some(pole) = poles.iter().find(|pole| near(pole.point, self.vertices[end])) {
                    self.vertices[end] = pole.point;
                }
            }
        }
    }

    /// Removes edges from loops if their ends become one vertex and the whole edge is within twice
    /// the tolerance of its start.
    fn collapse(&mut self, becomes: &HashMap<usize, usize>) {
        let at = |vertex: &usize| *becomes.get(vertex).unwrap_or(vertex);
        let is_tiny = |&(edge, _): &(usize, bool)| {
            let edge = &self.edges[edge];
            let [a, b] = edge.ends;
            a != b && at(&a) == at(&b) && {
                let line = edge.curve.polyline(self.range(edge), self.tolerance_mm);
                line.iter().all(|p| distance(*p, line[0]) <= 2.0 * self.tolerance_mm)
            }
        };
        let tiny: HashSet<usize> =
            self.loops().flatten().filter(|edge| is_tiny(edge)).map(|(edge, _)| *edge).collect();
        for around in self.faces.iter_mut().flat_map(|face| &mut face.loops) {
            if let Loop::Edges(edges) = around
                // A loop of tiny edges alone would become empty.
                && edges.iter().any(|(edge, _)| !tiny.contains(edge))
            {
                edges.retain(|(edge, _)| !tiny.contains(edge));
            }
        }
    }

    fn rename(&mut self, becomes: &HashMap<usize, usize>) {
        let used: HashSet<usize> = self.loops().flatten().map(|(edge, _)| *edge).collect();
        for edge in used {
            for end in &mut self.edges[edge].ends {
                if let Some(&other) = becomes.get(end) {
                    let apart = distance(self.vertices[*end], self.vertices[other]);
                    let widest = self.widest_mm.entry(edge).or_default();
                    *widest = widest.max(apart);
                    *end = other;
                }
            }
        }
        for around in self.faces.iter_mut().flat_map(|face| &mut face.loops) {
            if let Loop::Vertex(vertex) = around {
                *vertex = *becomes.get(vertex).unwrap_or(vertex);
            }
        }
    }
}
