//! Halves a face's facets until they are near the surface.
//!
//! OpenCASCADE leaves facets on some B-spline surfaces hundreds of chords off, whatever its
//! parameters. Edges inside a face are halved here; border edges stay, since other faces
//! share them.

use std::collections::HashMap;

use crate::calls::Node;
use lamp_brep::vector::{Vec3, cross, dot, length, sub, unit};
use lamp_brep::{Jet, KernelModel};

/// Each round halves an edge once: after the last round, edges are a thousandth as long.
const MAX_ROUNDS: usize = 10;
/// The greatest number of added facets: a multiple of the face's own, plus a constant.
const MORE: [usize; 2] = [8, 20_000];

/// Facets of one face.
pub(super) struct Patch {
    pub(super) face: u32,
    /// The index of its first node in the mesh.
    pub(super) first: u32,
    /// The number of its nodes in the mesh; the others were added.
    pub(super) count: usize,
    pub(super) nodes: Vec<Node>,
    /// The nodes of each triangle.
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Patch {
    /// Halves edges between facets until the surface is within the chord. Returns the
    /// remaining distance in millimeters.
    pub(super) fn refine(&mut self, kernel: &dyn KernelModel, chord_mm: f64) -> f64 {
        let most = self.triangles.len() * (1 + MORE[0]) + MORE[1];
        for _ in 0..MAX_ROUNDS {
            let sides = Sides::new(&self.triangles);
            let halves = self.far_halves(&sides, kernel, chord_mm);
            if halves.iter().all(Option::is_none) || self.triangles.len() > most {
                break;
            }
            let split = |triangle: &[u32; 3], sides: &[usize; 3]| {
                split(*triangle, sides.map(|side| halves[side]))
            };
            let pairs = self.triangles.iter().zip(&sides.of_triangles);
            self.triangles = pairs.flat_map(|(triangle, sides)| split(triangle, sides)).collect();
        }
        self.off_mm(kernel)
    }

    /// Returns, for each side, the node at its middle if the surface is too far from it.
    fn far_halves(
        &mut self,
        sides: &Sides,
        kernel: &dyn KernelModel,
        chord_mm: f64,
    ) -> Vec<Option<u32>> {
        let middle = |[a, b]: [u32; 2]| {
            let [a, b] = [a, b].map(|node| self.nodes[node as usize].uv);
            [0, 1].map(|k| (a[k] + b[k]) / 2.0)
        };
        let at: Vec<[f64; 2]> = sides.ends.iter().map(|&ends| middle(ends)).collect();
        let jets = self.evaluated(kernel, &at);
        let mut is_far = vec![false; sides.ends.len()];
        for (triangle, of_triangle) in self.triangles.iter().zip(&sides.of_triangles) {
            let far = |point: Vec3| self.off(triangle, point).is_some_and(|off| off > chord_mm);
            for &side in of_triangle {
                is_far[side] |= sides.uses[side] == 2 && far(jets[side].point);
            }
        }
        let mut halves = vec![None; sides.ends.len()];
        for side in (0..halves.len()).filter(|&side| is_far[side]) {
            halves[side] = Some(self.nodes.len() as u32);
            let face = u64::from(self.face);
            self.nodes.push(Node { point: jets[side].point, uv: at[side], face });
        }
        halves
    }

    /// Returns the greatest distance of the surface from the middles of facets.
    fn off_mm(&self, kernel: &dyn KernelModel) -> f64 {
        let middle = |triangle: &[u32; 3]| {
            let uv = triangle.map(|node| self.nodes[node as usize].uv);
            [0, 1].map(|k| uv.iter().map(|uv| uv[k]).sum::<f64>() / 3.0)
        };
        let at: Vec<[f64; 2]> = self.triangles.iter().map(middle).collect();
        let jets = self.evaluated(kernel, &at);
        let pairs = self.triangles.iter().zip(&jets);
        pairs.filter_map(|(triangle, jet)| self.off(triangle, jet.point)).fold(0.0, f64::max)
    }

    /// Returns the greatest distance of the nodes on edges from the surface.
    pub(super) fn edges_off_mm(&self, kernel: &dyn KernelModel) -> f64 {
        let nodes = &self.nodes[..self.count];
        let at: Vec<[f64; 2]> = nodes.iter().map(|node| node.uv).collect();
        let jets = self.evaluated(kernel, &at);
        let pairs = nodes.iter().zip(&jets);
        pairs.map(|(node, jet)| length(sub(node.point, jet.point))).fold(0.0, f64::max)
    }

    fn evaluated(&self, kernel: &dyn KernelModel, at: &[[f64; 2]]) -> Vec<Jet> {
        let mut jets = vec![Jet::default(); at.len()];
        kernel.evaluate(self.face, at, &mut jets);
        jets
    }

    /// Returns a point's distance from a facet's plane, or `None` for a facet without area.
    fn off(&self, triangle: &[u32; 3], point: Vec3) -> Option<f64> {
        let [a, b, c] = triangle.map(|node| self.nodes[node as usize].point);
        let normal = unit(cross(sub(b, a), sub(c, a)))?;
        Some(dot(normal, sub(point, a)).abs())
    }
}

/// The sides of triangles, each once.
struct Sides {
    ends: Vec<[u32; 2]>,
    /// The number of triangles with each side.
    uses: Vec<u32>,
    /// Each triangle's sides: from corner 0 to 1, 1 to 2 and 2 to 0.
    of_triangles: Vec<[usize; 3]>,
}

impl Sides {
    fn new(triangles: &[[u32; 3]]) -> Self {
        let mut numbers = HashMap::with_capacity(triangles.len() * 3 / 2);
        let (mut ends, mut uses) = (Vec::new(), Vec::new());
        let mut side = |a: u32, b: u32| {
            let side = [a.min(b), a.max(b)];
            let number = *numbers.entry(side).or_insert(ends.len());
            if number == ends.len() {
                ends.push(side);
                uses.push(0);
            }
            uses[number] += 1;
            number
        };
        let of_triangles =
            triangles.iter().map(|&[a, b, c]| [side(a, b), side(b, c), side(c, a)]).collect();
        Self { ends, uses, of_triangles }
    }
}

/// Returns a triangle, split at the middles of some of its sides.
fn split([a, b, c]: [u32; 3], halves: [Option<u32>; 3]) -> Vec<[u32; 3]> {
    match halves {
        [None, None, None] => vec![[a, b, c]],
        [Some(ab), None, None] => vec![[a, ab, c], [ab, b, c]],
        [Some(ab), Some(bc), None] => vec![[ab, b, bc], [a, ab, bc], [a, bc, c]],
        [Some(ab), Some(bc), Some(ca)] => {
            vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        }
        [ab, bc, ca] => split([b, c, a], [bc, ca, ab]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cut_triangles_fill_the_whole_and_keep_its_sense() {
        // A triangle of area 1 in a plane, and the middles of its sides.
        let places = [[0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 0.5], [0.0, 0.5]];
        let area = |[a, b, c]: [u32; 3]| {
            let [[ax, ay], [bx, by], [cx, cy]] = [a, b, c].map(|k| places[k as usize]);
            ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2.0
        };
        for bits in 0..8u32 {
            let halves = [0, 1, 2].map(|k| (bits >> k & 1 == 1).then_some(k + 3));
            let parts = split([0, 1, 2], halves);
            assert_eq!(parts.len() as u32, 1 + bits.count_ones());
            assert!(parts.iter().all(|&part| area(part) > 0.0), "{bits}: {parts:?}");
            assert_eq!(parts.into_iter().map(area).sum::<f64>(), 1.0);
        }
    }
}
