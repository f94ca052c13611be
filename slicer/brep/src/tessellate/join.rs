//! Joins the loops of a face on a closed surface into one polygon.
//!
//! A loop that goes around the surface has no inside of its own. Straight cuts through the face
//! join it to the loop on the other side, through the holes between them. Walking along loops and
//! cuts, always with the face on the same hand, gives a closed polygon; both sides of a cut have
//! the same points.

use super::points::{FaceNode, FacePoints};
use super::unwrap::{Unwrapped, between};
use crate::geometry::Surface;
use crate::kernel::FaceFault;

/// The greatest number of nodes of a loop from which cuts are tried.
const ENDS: usize = 48;
/// The greatest number of cuts that are tried between two loops.
const TRIES: usize = 500;

/// A straight line from one node to another, each given by its loop and its index in the loop.
#[derive(Clone, Copy)]
struct NodeLine {
    ends: [(usize, usize); 2],
    /// The periods to add to the second end to bring it next to the first.
    shift: [f64; 2],
}

/// A cut along a line.
struct LineCut {
    line: NodeLine,
    /// The nodes strictly between the ends, as seen from the first.
    inner: Vec<FaceNode>,
}

/// The loops to be joined.
pub(super) struct Joining<'a> {
    surface: &'a Surface,
    /// Whether the face lies on the left of its loops.
    is_left: bool,
    loops: Vec<Unwrapped>,
    cuts: Vec<LineCut>,
    /// Whether each loop is joined to the first.
    is_joined: Vec<bool>,
}

impl<'a> Joining<'a> {
    /// Takes two loops around the surface, then the loops that close.
    pub(super) fn new(surface: &'a Surface, is_left: bool, loops: Vec<Unwrapped>) -> Self {
        let is_joined = (0..loops.len()).map(|k| k == 0).collect();
        Self { surface, is_left, loops, cuts: Vec::new(), is_joined }
    }

    /// Returns the polygon of the first two loops and of the holes between them, and the other
    /// holes.
    pub(super) fn polygon(
        mut self,
        points: &mut FacePoints,
        chord_mm: f64,
    ) -> Result<(Vec<FaceNode>, Vec<Unwrapped>), FaceFault> {
        let mut cut = self.cut(0, 1);
        while !self.is_joined[1] {
            let line = cut.or_else(|| self.nearest()).ok_or(FaceFault::Unbounded)?;
            let NodeLine { ends, shift } = line;
            let [a, b] = ends.map(|(number, k)| self.loops[number].nodes[k].uv);
            let inner = between(self.surface, a, plus(b, shift), chord_mm).into_iter();
            let inner = inner
                .map(|uv| FaceNode { uv, point: points.push(self.surface.point(uv)) })
                .collect();
            self.is_joined[ends[1].0] = true;
            self.cuts.push(LineCut { line, inner });
            cut = if self.is_joined[1] { None } else { self.cut(ends[1].0, 1) };
        }
        let outer = self.walk()?;
        let free = self.loops.into_iter().zip(self.is_joined);
        Ok((outer, free.filter(|(_, is_joined)| !is_joined).map(|(hole, _)| hole).collect()))
    }

    /// Returns the first cut found from a joined loop to a free one.
    fn nearest(&self) -> Option<NodeLine> {
        let count = self.loops.len();
        let pairs = (0..count).flat_map(|a| (1..count).rev().map(move |b| (a, b)));
        let mut pairs = pairs.filter(|&(a, b)| self.is_joined[a] && !self.is_joined[b]);
        pairs.find_map(|(a, b)| self.cut(a, b))
    }

    /// Returns the shortest cut tried between two loops that crosses no loop.
    fn cut(&self, a: usize, b: usize) -> Option<NodeLine> {
        let (from, to) = (&self.loops[a].nodes, &self.loops[b].nodes);
        let long = self.lengths();
        let is_free = |end: &(usize, usize)| self.cut_at(*end).is_none();
        let mut tries = Vec::new();
        // With at most one cut per node, the walk is unambiguous.
        for i in spread(from.len()).filter(|&i| is_free(&(a, i))) {
            for k in spread(to.len()).filter(|&k| is_free(&(b, k))) {
                for shift in self.shifts(from[i].uv, to[k].uv) {
                    let way = minus(plus(to[k].uv, shift), from[i].uv);
                    if self.is_inwards(a, i, way) && self.is_inwards(b, k, way.map(|x| -x)) {
                        tries.push(((way[0] * long[0]).hypot(way[1] * long[1]), i, k, shift));
                    }
                }
            }
        }
        tries.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Short lines seldom cross anything, and each test passes over all loops.
        let mut tries = tries.into_iter().take(TRIES);
        let found =
            tries.find(|&(_, i, k, shift)| !self.is_crossed([from[i].uv, plus(to[k].uv, shift)]));
        found.map(|(_, i, k, shift)| NodeLine { ends: [(a, i), (b, k)], shift })
    }

    /// Returns the lengths in space of a step along each parameter.
    fn lengths(&self) -> [f64; 2] {
        let nodes = self.loops.iter().flat_map(|around| &around.nodes);
        let mut most = [1e-12_f64; 2];
        // A sample is enough, as the lengths only rank lines.
        for node in nodes.step_by(16) {
            let jet = self.surface.at(node.uv);
            for (most, slope) in most.iter_mut().zip([jet.du, jet.dv]) {
                *most = most.max(crate::vector::length(slope));
            }
        }
        most
    }

    /// Returns the periods that bring `to` next to `from`: the nearest along an axis around which
    /// loops go, and also the next periods along another axis.
    fn shifts(&self, from: [f64; 2], to: [f64; 2]) -> Vec<[f64; 2]> {
        let axis = usize::from(self.loops[0].turns[0] == 0);
        let periods = self.surface.periods();
        let nearest = |k: usize| periods[k].map_or(0.0, |p| ((from[k] - to[k]) / p).round() * p);
        let across = nearest(1 - axis);
        let others: &[f64] = if periods[1 - axis].is_some() { &[0.0, 1.0, -1.0] } else { &[0.0] };
        let shift = |by: &f64| {
            let mut shift = [0.0; 2];
            shift[axis] = nearest(axis);
            shift[1 - axis] = across + by * periods[1 - axis].unwrap_or(0.0);
            shift
        };
        others.iter().map(shift).collect()
    }

    /// Returns the ways to the node before and after a node.
    fn sides(&self, number: usize, k: usize) -> [[f64; 2]; 2] {
        let around = &self.loops[number];
        let (count, here) = (around.nodes.len(), around.nodes[k].uv);
        let turn = self.turn(number);
        let before = around.nodes[(k + count - 1) % count].uv;
        let before = if k == 0 { minus(before, turn) } else { before };
        let after = around.nodes[(k + 1) % count].uv;
        let after = if k + 1 == count { plus(after, turn) } else { after };
        [minus(before, here), minus(after, here)]
    }

    /// Returns the displacement of a loop on its return to its first node.
    fn turn(&self, number: usize) -> [f64; 2] {
        let (turns, periods) = (self.loops[number].turns, self.surface.periods());
        [0, 1].map(|k| f64::from(turns[k]) * periods[k].unwrap_or(0.0))
    }

    /// Returns whether a way from a node leads into the face.
    fn is_inwards(&self, number: usize, k: usize, way: [f64; 2]) -> bool {
        let [before, after] = self.sides(number, k);
        // From the way onward, the face's side sweeps to the way back.
        let to = |w: [f64; 2]| self.sweep(after, w);
        let (way, back) = (to(way), to(before));
        way > 1e-9 && way < back - 1e-9
    }

    /// Returns the angle from one direction to another on the face's side, from 0 to a
    /// full turn.
    fn sweep(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        let cross = from[0] * to[1] - from[1] * to[0];
        let angle = cross.atan2(from[0] * to[0] + from[1] * to[1]);
        let angle = if self.is_left { angle } else { -angle };
        angle.rem_euclid(std::f64::consts::TAU)
    }

    /// Returns whether a straight line meets a side of any loop or a cut, other than at its
    /// ends.
    fn is_crossed(&self, line: [[f64; 2]; 2]) -> bool {
        let is_met = |side: [[f64; 2]; 2]| self.copies(line, side).any(|side| meet(line, side));
        let by_loop = (0..self.loops.len()).any(|number| {
            let nodes = &self.loops[number].nodes;
            let last = plus(nodes[0].uv, self.turn(number));
            let next = nodes[1..].iter().map(|node| node.uv).chain([last]);
            nodes.iter().zip(next).any(|(node, next)| is_met([node.uv, next]))
        });
        by_loop
            || self.cuts.iter().any(|cut| {
                let [a, b] = cut.line.ends.map(|(number, k)| self.loops[number].nodes[k].uv);
                is_met([a, plus(b, cut.line.shift)])
            })
    }

    /// Returns the copies of a side, moved by periods, whose boxes meet the box of a line.
    fn copies(
        &self,
        line: [[f64; 2]; 2],
        side: [[f64; 2]; 2],
    ) -> impl Iterator<Item = [[f64; 2]; 2]> {
        let periods = self.surface.periods();
        let moves = [0, 1].map(|k| match periods[k] {
            Some(period) => {
                let (low, high) = (line[0][k].min(line[1][k]), line[0][k].max(line[1][k]));
                let (least, most) = (side[0][k].min(side[1][k]), side[0][k].max(side[1][k]));
                let first = ((low - most) / period).ceil() as i32;
                let last = ((high - least) / period).floor() as i32;
                (first..=last).map(|n| f64::from(n) * period).collect::<Vec<_>>()
            }
            None => vec![0.0],
        });
        let [us, vs] = moves;
        us.into_iter()
            .flat_map(move |u| vs.clone().into_iter().map(move |v| side.map(|uv| plus(uv, [u, v]))))
    }

    /// Walks along loops and cuts with the face on the same hand.
    fn walk(&self) -> Result<Vec<FaceNode>, FaceFault> {
        let nodes = |number: usize| &self.loops[number].nodes;
        let count = |number: usize| nodes(number).len();
        let start = (0..count(0)).find(|&k| self.cut_at((0, k)).is_none());
        let start = (0, start.ok_or(FaceFault::Unbounded)?);
        let joined = (0..self.loops.len()).filter(|&number| self.is_joined[number]);
        let most: usize = joined.map(count).sum();
        let (mut at, mut shift) = (start, [0.0; 2]);
        let mut polygon = Vec::new();
        // Each node is passed once. A longer walk would repeat itself.
        for _ in 0..most {
            polygon.push(moved(nodes(at.0)[at.1], shift));
            if let Some((cut, is_first)) = self.cut_at(at) {
                let there = cut.line.ends[usize::from(is_first)];
                if is_first {
                    polygon.extend(cut.inner.iter().map(|node| moved(*node, shift)));
                    shift = plus(shift, cut.line.shift);
                } else {
                    shift = minus(shift, cut.line.shift);
                    polygon.extend(cut.inner.iter().rev().map(|node| moved(*node, shift)));
                }
                at = there;
                polygon.push(moved(nodes(at.0)[at.1], shift));
            }
            at.1 += 1;
            if at.1 == count(at.0) {
                at.1 = 0;
                shift = plus(shift, self.turn(at.0));
            }
        }
        // A walk that has not visited all loops has cut the face in two.
        if at == start { Ok(polygon) } else { Err(FaceFault::Unbounded) }
    }

    /// Returns the cut at a node, and whether the node is its first end.
    fn cut_at(&self, end: (usize, usize)) -> Option<(&LineCut, bool)> {
        let cut = self.cuts.iter().find(|cut| cut.line.ends.contains(&end))?;
        Some((cut, cut.line.ends[0] == end))
    }
}

fn plus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn moved(node: FaceNode, by: [f64; 2]) -> FaceNode {
    FaceNode { uv: plus(node.uv, by), ..node }
}

/// Returns some of the numbers below `count`, spread evenly.
fn spread(count: usize) -> impl Iterator<Item = usize> {
    let some = count.min(ENDS);
    (0..some).map(move |k| k * count / some)
}

/// Returns whether two lines meet in a point that is not an end of both.
fn meet([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    let side = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    };
    let is_same = |p: [f64; 2], q: [f64; 2]| {
        let near = |k: usize| (p[k] - q[k]).abs() <= 1e-9 * (a[k] - b[k]).abs().max(1e-3);
        near(0) && near(1)
    };
    if [c, d].into_iter().any(|end| is_same(a, end) || is_same(b, end)) {
        return false;
    }
    let (of_c, of_d) = (side(a, b, c), side(a, b, d));
    let (of_a, of_b) = (side(c, d, a), side(c, d, b));
    of_c * of_d <= 0.0 && of_a * of_b <= 0.0 && (of_c != of_d || of_a != of_b)
}
