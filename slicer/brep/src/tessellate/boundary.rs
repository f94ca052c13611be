//! Turns a face's loops into closed polygons in the parameters of its surface.
//!
//! A loop may go around a closed surface. The polygon is then cut open along a line to
//! the loop on the other side, or to the pole there. Both sides of the cut have the
//! same points.

use super::unwrap::{Unwrapped, between, near, unwrap};
use super::{FacePoints, Node, PointRing};
use crate::geometry::{Pole, Surface};
use crate::kernel::Fault;
use crate::model::Face;

/// Returns the polygons of a face. A point is on the face if an odd number of them
/// contain it.
pub(super) fn polygons(
    face: &Face,
    rings: &[PointRing],
    points: &mut FacePoints,
    chord_mm: f64,
) -> Result<Vec<Vec<Node>>, Fault> {
    let poles = face.surface.poles();
    let mut tips = Vec::new();
    let mut loops = Vec::new();
    for ring in rings {
        match ring {
            PointRing::Point(point) => tips.push(*point),
            PointRing::Points(None) => return Err(Fault::Broken),
            PointRing::Points(Some(ring)) => loops.push(unwrap(face, &poles, ring, points)),
        }
    }
    let mut work = FaceOutline { face, poles: &poles, tips, points, chord_mm };
    let (around, mut closed): (Vec<_>, Vec<_>) =
        loops.into_iter().partition(|loop_| loop_.turns != [0, 0]);
    let outer = match around.as_slice() {
        [] => work.outer(&mut closed)?,
        [one] => work.up_to_pole(one)?,
        [one, other] => work.band(one, other)?,
        _ => return Err(Fault::Unbounded),
    };
    let mut polygons: Vec<Vec<Node>> =
        closed.into_iter().map(|hole| moved_into(hole.nodes, &outer, &face.surface)).collect();
    polygons.push(outer);
    Ok(polygons)
}

struct FaceOutline<'a, 'b> {
    face: &'a Face,
    poles: &'a [Pole],
    tips: Vec<u32>,
    points: &'a mut FacePoints<'b>,
    chord_mm: f64,
}

impl FaceOutline<'_, '_> {
    /// Removes the outer loop from the loops that do not go around the surface. If
    /// there is none, makes it from the surface's whole domain.
    fn outer(&mut self, closed: &mut Vec<Unwrapped>) -> Result<Vec<Node>, Fault> {
        let areas: Vec<f64> = closed.iter().map(|loop_| area(&loop_.nodes)).collect();
        let largest = (0..areas.len()).max_by(|&a, &b| areas[a].abs().total_cmp(&areas[b].abs()));
        let sense = if self.face.along_normal { 1.0 } else { -1.0 };
        match largest {
            Some(k) if areas[k] * sense > 0.0 || !self.is_closed() => Ok(closed.remove(k).nodes),
            _ => self.whole(closed),
        }
    }

    /// Returns whether the surface is closed both ways, and so bounds a body by itself.
    fn is_closed(&self) -> bool {
        let periods = self.face.surface.periods();
        (0..2).all(|axis| {
            periods[axis].is_some()
                || self.poles.iter().filter(|pole| pole.axis == axis).count() == 2
        })
    }

    /// Returns the boundary of a closed surface's whole domain, cut open away from its
    /// holes.
    fn whole(&mut self, holes: &[Unwrapped]) -> Result<Vec<Node>, Fault> {
        let surface = &self.face.surface;
        let [Some(u), Some(v)] = surface.domain() else { return Err(Fault::Unbounded) };
        if !self.is_closed() {
            return Err(Fault::Unbounded);
        }
        let periods = surface.periods();
        let mut low = [u[0], v[0]];
        let mut high = [u[1], v[1]];
        for axis in 0..2 {
            if let (Some(period), Some(hole)) = (periods[axis], holes.first()) {
                let ends = hole.nodes.iter().map(|node| node.uv[axis]);
                let (least, most) =
                    ends.fold((f64::MAX, f64::MIN), |(a, b), t| (a.min(t), b.max(t)));
                low[axis] = (least + most - period) / 2.0;
                high[axis] = low[axis] + period;
            }
        }
        let corners = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
        let tips: Vec<u32> = self.poles.iter().map(|pole| self.points.push(pole.point)).collect();
        let tip_at = |uv: [f64; 2]| {
            let is_here = |pole: &Pole| (uv[pole.axis] - pole.at).abs() < 1e-9;
            self.poles.iter().position(is_here).map(|k| tips[k])
        };
        // The four corners are one point unless they are poles.
        let shared = self.points.push(surface.point(corners[0]));
        let corner = corners.map(|uv| Node { uv, point: tip_at(uv).unwrap_or(shared) });
        let bottom = self.side(corner[0], corner[1], tip_at([f64::NAN, low[1]]));
        let right = self.side(corner[1], corner[2], tip_at([high[0], f64::NAN]));
        let top = match tip_at([f64::NAN, high[1]]) {
            Some(tip) => self.side(corner[2], corner[3], Some(tip)),
            None => opposite(&bottom, corner[2], 1),
        };
        let left = match tip_at([low[0], f64::NAN]) {
            Some(tip) => self.side(corner[3], corner[0], Some(tip)),
            None => opposite(&right, corner[3], 0),
        };
        let mut polygon = [bottom, right, top, left].concat();
        if !self.face.along_normal {
            polygon.reverse();
        }
        Ok(polygon)
    }

    /// Returns the nodes of a straight side from `from` to `to`, without the last. All
    /// of them are the point `tip` if there is one.
    fn side(&mut self, from: Node, to: Node, tip: Option<u32>) -> Vec<Node> {
        let surface = &self.face.surface;
        let inner = match tip {
            Some(_) => (1..16).map(|k| mix(from.uv, to.uv, f64::from(k) / 16.0)).collect(),
            None => between(surface, from.uv, to.uv, self.chord_mm),
        };
        let mut side = vec![from];
        for uv in inner {
            let point = tip.unwrap_or_else(|| self.points.push(surface.point(uv)));
            side.push(Node { uv, point });
        }
        side
    }

    /// Returns a polygon from a loop that goes around the surface to the pole on the
    /// loop's left.
    fn up_to_pole(&mut self, around: &Unwrapped) -> Result<Vec<Node>, Fault> {
        let axis = self.axis(around)?;
        let across = 1 - axis;
        let ring = opened(around, axis, &self.face.surface);
        let [first, last] = [ring[0], ring[ring.len() - 1]];
        // The left of a loop along u is towards greater v; the left of one along v is
        // towards smaller u.
        let left = around.turns[axis] * if axis == 0 { 1 } else { -1 };
        let left = f64::from(if self.face.along_normal { left } else { -left });
        let is_there =
            |pole: &&Pole| pole.axis == across && (pole.at - first.uv[across]) * left > 0.0;
        let pole = *self.poles.iter().find(is_there).ok_or(Fault::Unbounded)?;
        let at_pole =
            |point: &&u32| crate::vector::distance(self.points.get(**point), pole.point) < 1e-4;
        let tip = self.tips.iter().find(at_pole).copied();
        let tip = tip.unwrap_or_else(|| self.points.push(pole.point));
        let on_pole = |node: Node| {
            let mut uv = node.uv;
            uv[across] = pole.at;
            Node { uv, point: tip }
        };
        let (there, back) = (on_pole(last), on_pole(first));
        let mut polygon = ring;
        let up = self.side(last, there, None);
        polygon.extend(&up[1..]);
        polygon.extend(self.side(there, back, Some(tip)));
        polygon.push(back);
        let moved = first.uv[axis] - last.uv[axis];
        polygon.extend(up[1..].iter().rev().map(|node| shifted(*node, axis, moved)));
        Ok(polygon)
    }

    /// Returns the polygon between two loops that go around the surface in opposite
    /// directions.
    fn band(&mut self, one: &Unwrapped, other: &Unwrapped) -> Result<Vec<Node>, Fault> {
        let axis = self.axis(one)?;
        if other.turns.map(|turn| -turn) != one.turns {
            return Err(Fault::Unbounded);
        }
        let ring = opened(one, axis, &self.face.surface);
        let [first, last] = [ring[0], ring[ring.len() - 1]];
        let period = self.face.surface.periods()[axis];
        // The other loop starts at its point nearest to the end of this one, for a
        // short cut.
        let apart =
            |node: &Node| (near(node.uv[axis], last.uv[axis], period) - last.uv[axis]).abs();
        let nearest = (0..other.nodes.len())
            .min_by(|&a, &b| apart(&other.nodes[a]).total_cmp(&apart(&other.nodes[b])));
        let turned = rotated(other, nearest.unwrap_or(0), axis, &self.face.surface);
        let start = turned.nodes[0].uv;
        let mut back = opened(&turned, axis, &self.face.surface);
        let mut by = [0.0; 2];
        for k in 0..2 {
            let period = self.face.surface.periods()[k];
            by[k] = near(start[k], last.uv[k], period) - start[k];
        }
        back.iter_mut().for_each(|node| (0..2).for_each(|k| node.uv[k] += by[k]));
        let cut = self.side(last, back[0], None);
        let moved = first.uv[axis] - last.uv[axis];
        let mut polygon = ring;
        polygon.extend(&cut[1..]);
        polygon.extend(back);
        polygon.extend(cut[1..].iter().rev().map(|node| shifted(*node, axis, moved)));
        Ok(polygon)
    }

    /// Returns the parameter, 0 for u or 1 for v, around which a loop goes once.
    fn axis(&self, around: &Unwrapped) -> Result<usize, Fault> {
        match around.turns {
            [1 | -1, 0] => Ok(0),
            [0, 1 | -1] => Ok(1),
            _ => Err(Fault::Unbounded),
        }
    }
}

fn mix(a: [f64; 2], b: [f64; 2], part: f64) -> [f64; 2] {
    [0, 1].map(|k| a[k] + (b[k] - a[k]) * part)
}

fn shifted(mut node: Node, axis: usize, by: f64) -> Node {
    node.uv[axis] += by;
    node
}

/// Returns the opposite side of a whole domain, backwards from its corner `start`, with
/// the same points.
fn opposite(side: &[Node], start: Node, axis: usize) -> Vec<Node> {
    let inner = side[1..].iter().rev().map(|node| {
        let mut node = *node;
        node.uv[axis] = start.uv[axis];
        node
    });
    [start].into_iter().chain(inner).collect()
}

/// Returns the loop's nodes, and the first once more, one period further.
fn opened(around: &Unwrapped, axis: usize, surface: &Surface) -> Vec<Node> {
    let period = surface.periods()[axis].unwrap_or(0.0);
    let mut nodes = around.nodes.clone();
    nodes.push(shifted(nodes[0], axis, period * f64::from(around.turns[axis])));
    nodes
}

/// Returns the loop, starting at node `start`.
fn rotated(around: &Unwrapped, start: usize, axis: usize, surface: &Surface) -> Unwrapped {
    let by = surface.periods()[axis].unwrap_or(0.0) * f64::from(around.turns[axis]);
    let (before, after) = around.nodes.split_at(start);
    let before = before.iter().map(|node| shifted(*node, axis, by));
    Unwrapped { nodes: after.iter().copied().chain(before).collect(), turns: around.turns }
}

/// Returns whether the outer polygon is counter-clockwise. One made from a whole domain
/// takes its direction from the face.
pub(super) fn is_counter_clockwise(polygons: &[Vec<Node>]) -> bool {
    polygons.last().is_none_or(|outer| area(outer) > 0.0)
}

/// Returns twice the signed area of a polygon.
fn area(nodes: &[Node]) -> f64 {
    let next = nodes.iter().cycle().skip(1);
    nodes.iter().zip(next).map(|(a, b)| a.uv[0] * b.uv[1] - b.uv[0] * a.uv[1]).sum()
}

/// Returns whether a point lies in a polygon, from the sides crossed to its right.
fn is_within(p: [f64; 2], polygon: &[Node]) -> bool {
    let next = polygon.iter().cycle().skip(1);
    let crosses = |(a, b): &(&Node, &Node)| {
        let ([ax, ay], [bx, by]) = (a.uv, b.uv);
        (ay > p[1]) != (by > p[1]) && p[0] < ax + (p[1] - ay) / (by - ay) * (bx - ax)
    };
    polygon.iter().zip(next).filter(crosses).count() % 2 == 1
}

/// Returns a hole, moved by periods until it lies in the outer polygon.
fn moved_into(mut hole: Vec<Node>, outer: &[Node], surface: &Surface) -> Vec<Node> {
    let [u, v] = surface.periods().map(|period| match period {
        Some(period) => (-2..=2).map(|k| f64::from(k) * period).collect(),
        None => vec![0.0],
    });
    let all = u.iter().flat_map(|&u| v.iter().map(move |&v| [u, v]));
    let within = |by: &[f64; 2]| {
        let is_in = |node: &&Node| is_within([node.uv[0] + by[0], node.uv[1] + by[1]], outer);
        hole.iter().filter(is_in).count()
    };
    // Chooses the move that puts most nodes inside; if none does, the hole stays.
    let best = all.map(|by| (within(&by), by)).max_by(|a, b| {
        let far = |by: [f64; 2]| by[0].abs() + by[1].abs();
        a.0.cmp(&b.0).then(far(b.1).total_cmp(&far(a.1)))
    });
    if let Some((_, by)) = best {
        hole.iter_mut().for_each(|node| (0..2).for_each(|k| node.uv[k] += by[k]));
    }
    hole
}
