//! Turns a face's loops into closed polygons in the parameters of its surface.
//!
//! A loop may go around a closed surface. It is then joined to the loop on the other side,
//! or to the pole there.

use super::join::Joining;
use super::points::{FaceNode, FacePoints, PointRing};
use super::unwrap::{Unwrapped, between, unwrap};
use crate::geometry::{Pole, Surface};
use crate::kernel::FaceFault;
use crate::model::Face;

/// The number of nodes that represent a pole.
const POLE_PARTS: usize = 16;

/// Returns the polygons of a face, the outer one last. A point is on the face if an odd number of
/// polygons contain it.
pub(super) fn polygons(
    face: &Face,
    rings: &[PointRing],
    points: &mut FacePoints,
    chord_mm: f64,
) -> Result<Vec<Vec<FaceNode>>, FaceFault> {
    let poles = face.surface.poles();
    let mut tips = Vec::new();
    let mut loops = Vec::new();
    for (number, ring) in rings.iter().enumerate() {
        match ring {
            PointRing::Point(point) => tips.push(*point),
            PointRing::Points(None) => return Err(FaceFault::Broken),
            PointRing::Points(Some(ring)) => {
                let unwrapped = unwrap(face, &poles, ring, points, chord_mm);
                if unwrapped.nodes.is_empty() {
                    // The whole loop lies at a pole.
                    tips.extend(ring.first());
                } else {
                    loops.push(Unwrapped { is_outer: face.outer == Some(number), ..unwrapped });
                }
            }
        }
    }
    let mut work = FaceOutline { face, poles: &poles, tips, points, chord_mm };
    let (around, mut closed): (Vec<_>, Vec<_>) =
        loops.into_iter().partition(|around| around.turns != [0, 0]);
    let outer = match around.as_slice() {
        [] => work.outer(&mut closed)?,
        [one] => {
            let (pole, is_left) = work.pole_beside(one)?;
            work.joined([one.clone(), pole], is_left, &mut closed)?
        }
        [one, other] => {
            let is_left = work.is_left(one, other)?;
            work.joined([one.clone(), other.clone()], is_left, &mut closed)?
        }
        _ => return Err(FaceFault::Unbounded),
    };
    let mut polygons: Vec<Vec<FaceNode>> =
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
    /// Removes the outer loop from the loops that do not go around the surface. If there is no
    /// outer loop, makes it from the surface's whole domain.
    fn outer(&mut self, closed: &mut Vec<Unwrapped>) -> Result<Vec<FaceNode>, FaceFault> {
        let areas: Vec<f64> = closed.iter().map(|hole| area(&hole.nodes)).collect();
        // A hole is smaller than the loop around it.
        let largest = (0..areas.len()).max_by(|&a, &b| areas[a].abs().total_cmp(&areas[b].abs()));
        let sense = if self.face.along_normal { 1.0 } else { -1.0 };
        match largest {
            // A hole cannot be the outer loop, whatever its sense; but a loop that encloses nothing
            // bounds no hole.
            Some(k) if areas[k] * sense > 0.0 || closed[k].is_outer && self.is_wide(areas[k]) => {
                Ok(closed.remove(k).nodes)
            }
            Some(k) if !self.face.surface.is_closed() => Ok(closed.remove(k).nodes),
            _ => self.whole(closed),
        }
    }

    /// Returns whether twice an area is more than nothing compared with the surface's domain.
    fn is_wide(&self, doubled: f64) -> bool {
        let sides = self.face.surface.domain().map(|side| side.map_or(1.0, |[a, b]| b - a));
        doubled.abs() > 1e-3 * sides[0] * sides[1]
    }

    /// Returns the polygon of a closed surface that has only holes.
    fn whole(&mut self, holes: &mut Vec<Unwrapped>) -> Result<Vec<FaceNode>, FaceFault> {
        if !self.face.surface.is_closed() {
            return Err(FaceFault::Unbounded);
        }
        let is_left = self.face.along_normal;
        let rings = match self.poles {
            [] => self.seam(holes)?,
            poles => {
                let mut ends: Vec<Pole> = poles.to_vec();
                ends.sort_by(|a, b| a.at.total_cmp(&b.at));
                let [first, last] = ends[..] else { return Err(FaceFault::Unbounded) };
                // The face lies on the left of the least v and of the greatest u.
                let turn = if (first.axis == 1) == is_left { 1 } else { -1 };
                [self.ring_at(first, turn), self.ring_at(last, -turn)]
            }
        };
        self.joined(rings, is_left, holes)
    }

    /// Returns both sides of a line around a torus that meets no hole.
    fn seam(&mut self, holes: &[Unwrapped]) -> Result<[Unwrapped; 2], FaceFault> {
        let surface = &self.face.surface;
        let [Some(u), Some(v)] = surface.domain() else { return Err(FaceFault::Unbounded) };
        let domain = [u, v];
        let free = |axis: usize| {
            let [low, high] = domain[axis];
            let spans: Vec<[f64; 2]> = holes.iter().map(|hole| span(hole, axis)).collect();
            gap(&spans, low, high - low).map(|at| (axis, at))
        };
        // The line is constant in `axis` and goes along the other.
        let (axis, at) = free(1).or_else(|| free(0)).ok_or(FaceFault::Unbounded)?;
        let along = 1 - axis;
        let [low, high] = domain[along];
        let place = |t: f64| {
            let mut uv = [at; 2];
            uv[along] = t;
            uv
        };
        let inner = between(surface, place(low), place(high), self.chord_mm);
        let points = &mut *self.points;
        let nodes: Vec<FaceNode> = [place(low)]
            .into_iter()
            .chain(inner)
            .map(|uv| FaceNode { uv, point: points.push(surface.point(uv)) })
            .collect();
        // The face lies on the left of a line along u, above it, or on the right of one
        // along v.
        let turn = if (along == 0) == self.face.along_normal { 1 } else { -1 };
        let mut back = nodes.clone();
        let period = domain[axis][1] - domain[axis][0];
        back.iter_mut().for_each(|node| node.uv[axis] += period);
        let ring = |mut nodes: Vec<FaceNode>, turn: i32| {
            if turn < 0 {
                nodes.reverse();
            }
            let mut turns = [0; 2];
            turns[along] = turn;
            Unwrapped { nodes, turns, is_outer: false }
        };
        Ok([ring(nodes, turn), ring(back, -turn)])
    }

    /// Returns a pole as a loop around the surface.
    fn ring_at(&mut self, pole: Pole, turn: i32) -> Unwrapped {
        let at_pole =
            |point: &&u32| crate::vector::distance(self.points.get(**point), pole.point) < 1e-4;
        let tip = self.tips.iter().find(at_pole).copied();
        let tip = tip.unwrap_or_else(|| self.points.push(pole.point));
        let along = 1 - pole.axis;
        let [low, high] = self.face.surface.domain()[along].unwrap_or([0.0, 1.0]);
        let node = |k: usize| {
            let part = k as f64 / POLE_PARTS as f64;
            let mut uv = [pole.at; 2];
            uv[along] = low + (high - low) * if turn > 0 { part } else { 1.0 - part };
            FaceNode { uv, point: tip }
        };
        let mut turns = [0; 2];
        turns[along] = turn;
        Unwrapped { nodes: (0..POLE_PARTS).map(node).collect(), turns, is_outer: false }
    }

    /// Returns the pole to which a face with one loop around the surface reaches, and
    /// whether the face lies on the left of the loop.
    fn pole_beside(&mut self, around: &Unwrapped) -> Result<(Unwrapped, bool), FaceFault> {
        let axis = axis(around)?;
        let across = 1 - axis;
        let middle = mean(around, across);
        // The left of a loop along u is toward greater v; the left of one along v is
        // toward smaller u.
        let left = f64::from(around.turns[axis] * if axis == 0 { 1 } else { -1 });
        let is_on_left = |pole: &Pole| (pole.at - middle) * left > 0.0;
        let mut poles = self.poles.iter().copied().filter(|pole| pole.axis == across);
        let is_wanted = |pole: &Pole| is_on_left(pole) == self.face.along_normal;
        let pole = match [poles.next(), poles.next()] {
            [Some(only), None] => only,
            // Both sides are finite, so the sense of the loop decides.
            [Some(a), Some(b)] if is_wanted(&a) != is_wanted(&b) => {
                if is_wanted(&a) {
                    a
                } else {
                    b
                }
            }
            _ => return Err(FaceFault::Unbounded),
        };
        let is_left = is_on_left(&pole);
        Ok((self.ring_at(pole, -around.turns[axis]), is_left))
    }

    /// Returns whether a face between two loops around the surface lies on their left.
    fn is_left(&self, one: &Unwrapped, other: &Unwrapped) -> Result<bool, FaceFault> {
        let axis = axis(one)?;
        if other.turns.map(|turn| -turn) != one.turns {
            return Err(FaceFault::Unbounded);
        }
        let across = 1 - axis;
        if self.face.surface.periods()[across].is_some() {
            // On a torus both sides are finite, so the sense of the loops decides.
            return Ok(self.face.along_normal);
        }
        let is_above = mean(other, across) > mean(one, across);
        Ok(is_above == ((one.turns[axis] > 0) == (axis == 0)))
    }

    /// Joins two loops around the surface, and removes the holes between them from the list.
    fn joined(
        &mut self,
        rings: [Unwrapped; 2],
        is_left: bool,
        holes: &mut Vec<Unwrapped>,
    ) -> Result<Vec<FaceNode>, FaceFault> {
        let loops = rings.into_iter().chain(std::mem::take(holes)).collect();
        let joining = Joining::new(&self.face.surface, is_left, loops);
        let (outer, free) = joining.polygon(self.points, self.chord_mm)?;
        *holes = free;
        Ok(outer)
    }
}

/// Returns the parameter, 0 for u or 1 for v, around which a loop goes once.
fn axis(around: &Unwrapped) -> Result<usize, FaceFault> {
    match around.turns {
        [1 | -1, 0] => Ok(0),
        [0, 1 | -1] => Ok(1),
        _ => Err(FaceFault::Unbounded),
    }
}

fn mean(around: &Unwrapped, axis: usize) -> f64 {
    around.nodes.iter().map(|node| node.uv[axis]).sum::<f64>() / around.nodes.len() as f64
}

/// Returns the least and the greatest value of a loop's parameter.
fn span(around: &Unwrapped, axis: usize) -> [f64; 2] {
    let ends = around.nodes.iter().map(|node| node.uv[axis]);
    ends.fold([f64::MAX, f64::MIN], |[a, b], t| [a.min(t), b.max(t)])
}

/// Returns the middle of the longest part of a period that no span covers.
fn gap(spans: &[[f64; 2]], low: f64, period: f64) -> Option<f64> {
    let mut parts: Vec<[f64; 2]> = spans
        .iter()
        .map(|[a, b]| {
            let start = low + (a - low).rem_euclid(period);
            [start, start + (b - a)]
        })
        .collect();
    parts.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let Some(first) = parts.first().copied() else { return Some(low) };
    // A span across the end of the period covers its start too.
    let mut end = parts.iter().map(|part| part[1] - period).fold(f64::MIN, f64::max);
    let mut longest = (0.0, low);
    for [a, b] in parts.into_iter().chain([first.map(|t| t + period)]) {
        if a - end > longest.0 {
            longest = (a - end, (a + end) / 2.0);
        }
        end = end.max(b);
    }
    (longest.0 > 1e-6 * period).then_some(longest.1)
}

/// Returns whether the outer polygon is counterclockwise. A polygon made from a whole domain takes
/// its direction from the face.
pub(super) fn is_counter_clockwise(polygons: &[Vec<FaceNode>]) -> bool {
    polygons.last().is_none_or(|outer| area(outer) > 0.0)
}

/// Returns twice the signed area of a polygon.
fn area(nodes: &[FaceNode]) -> f64 {
    let next = nodes.iter().cycle().skip(1);
    nodes.iter().zip(next).map(|(a, b)| a.uv[0] * b.uv[1] - b.uv[0] * a.uv[1]).sum()
}

/// Returns whether a point lies in a polygon, from the sides crossed to its right.
fn is_within(p: [f64; 2], polygon: &[FaceNode]) -> bool {
    let next = polygon.iter().cycle().skip(1);
    let crosses = |(a, b): &(&FaceNode, &FaceNode)| {
        let ([ax, ay], [bx, by]) = (a.uv, b.uv);
        // Half-open sides keep the count right for a ray through a corner.
        (ay > p[1]) != (by > p[1]) && p[0] < ax + (p[1] - ay) / (by - ay) * (bx - ax)
    };
    polygon.iter().zip(next).filter(crosses).count() % 2 == 1
}

/// Returns a hole, moved by periods until it lies in the outer polygon.
fn moved_into(mut hole: Vec<FaceNode>, outer: &[FaceNode], surface: &Surface) -> Vec<FaceNode> {
    let [u, v] = surface.periods().map(|period| match period {
        Some(period) => (-2..=2).map(|k| f64::from(k) * period).collect(),
        None => vec![0.0],
    });
    let all = u.iter().flat_map(|&u| v.iter().map(move |&v| [u, v]));
    let within = |by: &[f64; 2]| {
        let is_in = |node: &&FaceNode| is_within([node.uv[0] + by[0], node.uv[1] + by[1]], outer);
        hole.iter().filter(is_in).count()
    };
    // Chooses the move that puts most nodes inside; if no move puts any inside, the hole stays.
    let best = all.map(|by| (within(&by), by)).max_by(|a, b| {
        let far = |by: [f64; 2]| by[0].abs() + by[1].abs();
        a.0.cmp(&b.0).then(far(b.1).total_cmp(&far(a.1)))
    });
    if let Some((_, by)) = best {
        hole.iter_mut().for_each(|node| (0..2).for_each(|k| node.uv[k] += by[k]));
    }
    hole
}
