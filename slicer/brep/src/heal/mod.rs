//! Joins edges that faces do not share, within a tolerance.
//!
//! Healing changes only open parts: edges used by one face, their ends, and gaps between the edges
//! of a loop. It merges vertices within the tolerance, splits edges at vertices on them, and merges
//! edges that run within the tolerance of each other between the same vertices. Validation then
//! decides whether the facets close.

mod edge_curve;
mod vertices;

use std::collections::{BTreeMap, HashMap, HashSet};

use self::edge_curve::EdgeCurve;
use crate::geometry::edge_range;
use crate::kernel::{BrepFinding, FaceFault};
use crate::model::{BrepEdge, BrepModel, Face, Loop};
use crate::vector::Vec3;

/// Joins vertices and edges within the tolerance, and returns a finding for each face
/// changed.
pub(crate) fn heal(model: &mut BrepModel, tolerance_mm: f64) -> Vec<BrepFinding> {
    let mut findings = Vec::new();
    for body in model.bodies.clone() {
        let faces = body.faces.start as usize..body.faces.end as usize;
        let mut healing = Healing {
            faces: &mut model.faces[faces],
            edges: &mut model.edges,
            vertices: &mut model.vertices,
            tolerance_mm,
            widest_mm: BTreeMap::new(),
        };
        // In this order: edges pair up by their vertices, and a long edge fits short ones only once
        // it is cut.
        healing.join_vertices();
        healing.settle();
        healing.cut_edges();
        healing.join_edges();
        for (face, (joints, off_mm)) in healing.joined() {
            let face = body.faces.start + face as u32;
            let entity = model.faces[face as usize].entity;
            findings.push(BrepFinding {
                face,
                entity,
                fault: FaceFault::Joined { joints, off_mm },
            });
        }
    }
    findings
}

/// The healing process of one body.
struct Healing<'a> {
    faces: &'a mut [Face],
    edges: &'a mut Vec<BrepEdge>,
    vertices: &'a mut [Vec3],
    tolerance_mm: f64,
    /// The gap closed at each edge that was joined or whose ends were joined, in millimeters.
    /// In order, so that sums over the edges at a vertex have the same last bits in each run.
    widest_mm: BTreeMap<usize, f64>,
}

impl Healing<'_> {
    fn loops(&self) -> impl Iterator<Item = &Vec<(usize, bool)>> {
        self.faces.iter().flat_map(|face| &face.loops).filter_map(|around| match around {
            Loop::Edges(edges) => Some(edges),
            Loop::Vertex(_) => None,
        })
    }

    /// Returns the edges that are used once, in ascending order.
    fn open(&self) -> Vec<usize> {
        let mut uses: HashMap<usize, usize> = HashMap::new();
        self.loops().flatten().for_each(|(edge, _)| *uses.entry(*edge).or_default() += 1);
        let mut open: Vec<usize> =
            uses.into_iter().filter(|(_, uses)| *uses == 1).map(|(edge, _)| edge).collect();
        // Hash maps have no order, and results must not depend on it.
        open.sort_unstable();
        open
    }

    /// Returns the pairs of vertices between which a loop has a gap.
    fn breaks(&self) -> Vec<[usize; 2]> {
        let end = |&(edge, is_along): &(usize, bool)| self.edges[edge].ends[usize::from(is_along)];
        let start = |&(edge, is_along): &(usize, bool)| end(&(edge, !is_along));
        let pairs = self.loops().flat_map(|edges| {
            let next = edges.iter().cycle().skip(1);
            edges.iter().zip(next).map(|(a, b)| [end(a), start(b)]).collect::<Vec<_>>()
        });
        pairs.filter(|[a, b]| a != b).collect()
    }

    /// Returns the ends of open edges, and the vertices at gaps of loops.
    fn loose(&self) -> Vec<usize> {
        let ends = self.open().into_iter().flat_map(|edge| self.edges[edge].ends);
        let mut loose: Vec<usize> = ends
            .chain(self.breaks().into_iter().flatten())
            .collect::<HashSet<_>>()
            .into_iter()
            .collect();
        loose.sort_unstable();
        loose
    }

    fn range(&self, edge: &BrepEdge) -> [f64; 2] {
        let [start, end] = edge.ends.map(|vertex| self.vertices[vertex]);
        edge_range(&edge.curve, start, end, edge.forward)
    }

    /// Splits open edges at the ends of other open edges on them.
    fn cut_edges(&mut self) {
        let mut ends: Vec<usize> = self.loose();
        // Sorted along x, so that each edge examines only the vertices near it.
        ends.sort_by(|&a, &b| self.vertices[a][0].total_cmp(&self.vertices[b][0]));
        let mut pieces: HashMap<usize, Vec<usize>> = HashMap::new();
        for edge in self.open() {
            let cuts = self.cuts(&self.edges[edge], &ends);
            if cuts.is_empty() {
                continue;
            }
            let BrepEdge { ref curve, ends: [first, last], forward } = self.edges[edge];
            let curve = curve.clone();
            let stops: Vec<usize> = [first].into_iter().chain(cuts).chain([last]).collect();
            let new = self.edges.len();
            let parts = stops.windows(2).map(|pair| BrepEdge {
                curve: curve.clone(),
                ends: [pair[0], pair[1]],
                forward,
            });
            self.edges.extend(parts);
            pieces.insert(edge, (new..self.edges.len()).collect());
        }
        for around in self.faces.iter_mut().flat_map(|face| &mut face.loops) {
            if let Loop::Edges(edges) = around {
                let cut = |&(edge, is_along): &(usize, bool)| {
                    let mut parts = pieces.get(&edge).cloned().unwrap_or_else(|| vec![edge]);
                    if !is_along {
                        parts.reverse();
                    }
                    parts.into_iter().map(move |part| (part, is_along))
                };
                *edges = edges.iter().flat_map(cut).collect();
            }
        }
    }

    /// Returns the vertices on an edge away from its ends, in order along it. `ends` are sorted by
    /// x.
    fn cuts(&self, edge: &BrepEdge, ends: &[usize]) -> Vec<usize> {
        let span = EdgeCurve::new(edge, self.range(edge), self.tolerance_mm);
        let low = span.low[0] - 2.0 * self.tolerance_mm;
        let high = span.high[0] + 2.0 * self.tolerance_mm;
        let first = ends.partition_point(|&end| self.vertices[end][0] < low);
        let near = ends[first..].iter().take_while(|&&end| self.vertices[end][0] <= high);
        let mut cuts: Vec<(f64, usize)> = near
            .filter(|end| !edge.ends.contains(end))
            .filter_map(|&end| Some((span.inner_part(self.vertices[end])?, end)))
            .collect();
        cuts.sort_by(|a, b| a.0.total_cmp(&b.0));
        cuts.into_iter().map(|(_, end)| end).collect()
    }

    /// Merges open edges that run within the tolerance of each other.
    fn join_edges(&mut self) {
        let mut between: HashMap<[usize; 2], Vec<usize>> = HashMap::new();
        let mut becomes: HashMap<usize, (usize, bool)> = HashMap::new();
        for edge in self.open() {
            let [a, b] = self.edges[edge].ends;
            let waiting = between.entry([a.min(b), a.max(b)]).or_default();
            let twin = waiting.iter().enumerate().find_map(|(k, &other)| {
                let (is_along, apart) = self.is_twin(&self.edges[other], &self.edges[edge])?;
                Some((k, other, is_along, apart))
            });
            match twin {
                Some((k, other, is_along, apart)) => {
                    // An edge joins at most two faces, so a pair takes no third edge.
                    waiting.swap_remove(k);
                    becomes.insert(edge, (other, is_along));
                    let widest = self.widest_mm.remove(&edge).unwrap_or(0.0).max(apart);
                    let of_other = self.widest_mm.entry(other).or_default();
                    *of_other = of_other.max(widest);
                }
                None => waiting.push(edge),
            }
        }
        for around in self.faces.iter_mut().flat_map(|face| &mut face.loops) {
            let Loop::Edges(edges) = around else { continue };
            for (edge, is_along) in edges {
                if let Some(&(other, is_same)) = becomes.get(edge) {
                    (*edge, *is_along) = (other, *is_along == is_same);
                }
            }
        }
    }

    /// Returns whether an edge runs in the same direction as another, and their
    /// distance, if both have the same vertices and are within the tolerance.
    fn is_twin(&self, edge: &BrepEdge, other: &BrepEdge) -> Option<(bool, f64)> {
        let span = EdgeCurve::new(edge, self.range(edge), self.tolerance_mm);
        let [from, to] = self.range(other);
        let (mut parts, mut widest) = (Vec::new(), 0.0f64);
        // The ends are common vertices already.
        for k in 1..SAMPLES {
            let at = other.curve.place(from + (to - from) * k as f64 / SAMPLES as f64);
            parts.push(span.part(at)?);
            widest = widest.max(span.apart(at));
        }
        let is_along = parts.first() < parts.last();
        Some((is_along, widest))
    }

    /// Returns the number of joints of each face, and the greatest gap.
    fn joined(&self) -> Vec<(usize, (usize, f64))> {
        let mut joined = Vec::new();
        for (number, face) in self.faces.iter().enumerate() {
            let edges = face.loops.iter().flat_map(|around| match around {
                Loop::Edges(edges) => edges.as_slice(),
                Loop::Vertex(_) => &[],
            });
            let widths: Vec<f64> =
                edges.filter_map(|(edge, _)| self.widest_mm.get(edge).copied()).collect();
            if !widths.is_empty() {
                joined.push((number, (widths.len(), widths.iter().copied().fold(0.0, f64::max))));
            }
        }
        joined
    }
}

/// The number of intervals at whose ends edges are compared.
const SAMPLES: usize = 8;

#[cfg(test)]
mod tests;
