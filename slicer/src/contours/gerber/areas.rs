//! Makes polygons of strokes, and of primitives that are painted one over the other.

use std::f64::consts::{PI, TAU};

use crate::contours::curves::{TOLERANCE_MM, chords_of_arc};
use crate::contours::error::ContourFault;
use crate::contours::rows::{Rows, at};
use crate::prisms::Ring;

/// A limit on the heights where sides of an aperture end or cross.
const MAX_HEIGHTS: usize = 1 << 20;

const CROSSED: ContourFault = ContourFault::Unread("a macro with too many crossings");

/// A shape that darkens or clears what lies below it in an aperture.
#[derive(Debug)]
pub(super) struct Primitive {
    pub(super) is_dark: bool,
    /// Polygons that turn left around its area, and right around its holes.
    pub(super) rings: Vec<Ring>,
    /// Whether it is a single convex polygon.
    pub(super) is_convex: bool,
}

impl Primitive {
    pub(super) fn convex(is_dark: bool, ring: Ring) -> Self {
        Self { is_dark, rings: vec![ring], is_convex: true }
    }
}

/// Polygons that unite.
#[derive(Debug)]
pub(super) struct Area {
    corners: Vec<[f64; 2]>,
    /// The end of each polygon among the corners.
    ends: Vec<usize>,
    /// Whether no polygon crosses itself.
    pub(super) is_simple: bool,
    low: [f64; 2],
    high: [f64; 2],
}

impl Area {
    pub(super) fn new() -> Self {
        let (low, high) = ([f64::MAX; 2], [f64::MIN; 2]);
        Self { corners: Vec::new(), ends: Vec::new(), is_simple: true, low, high }
    }

    pub(super) fn add(&mut self, ring: impl IntoIterator<Item = [f64; 2]>) {
        let first = self.corners.len();
        self.corners.extend(ring);
        for corner in &self.corners[first..] {
            for (axis, &to) in corner.iter().enumerate() {
                self.low[axis] = self.low[axis].min(to);
                self.high[axis] = self.high[axis].max(to);
            }
        }
        self.ends.push(self.corners.len());
    }

    pub(super) fn corner_count(&self) -> usize {
        self.corners.len()
    }

    pub(super) fn rings(&self) -> impl Iterator<Item = &[[f64; 2]]> {
        let starts = [0].into_iter().chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.corners[start..end])
    }

    /// Returns the least rectangle around it in its place. `None` without polygons.
    pub(super) fn bounds(&self, rows: &Rows) -> Option<[[f64; 2]; 2]> {
        if self.corners.is_empty() {
            return None;
        }
        let ([left, bottom], [right, top]) = (self.low, self.high);
        let corners = [[left, bottom], [right, bottom], [right, top], [left, top]];
        let corners = corners.map(|corner| at(rows, corner));
        let along = |axis: usize| corners.map(|corner| corner[axis]).into_iter();
        Some([
            [0, 1].map(|axis| along(axis).fold(f64::MAX, f64::min)),
            [0, 1].map(|axis| along(axis).fold(f64::MIN, f64::max)),
        ])
    }

    /// Returns the area of primitives in their place, painted in their order.
    pub(super) fn of_primitives(
        primitives: &mut Vec<Primitive>,
        rows: &Rows,
        steps_left: &mut u64,
    ) -> Result<Self, ContourFault> {
        for corner in primitives.iter_mut().flat_map(|it| &mut it.rings).flatten() {
            *corner = at(rows, *corner);
            if !corner.iter().all(|c| c.is_finite()) {
                return Err(ContourFault::NotFinite);
            }
        }
        let mut area = Self::new();
        if primitives.iter().all(|it| it.is_dark && it.is_convex) {
            primitives.drain(..).flat_map(|it| it.rings).for_each(|ring| area.add(ring));
        } else {
            painted(primitives, steps_left)?.into_iter().for_each(|ring| area.add(ring));
        }
        Ok(area)
    }

    /// Returns the area that a circle passes along lines: a rectangle for each side, a sector where
    /// sides meet, and half circles at the ends.
    pub(super) fn of_stroke(points: &[[f64; 2]], half: f64) -> Result<Self, ContourFault> {
        let mut area = Self::new();
        let mut points = points.to_vec();
        points.dedup();
        let (first, last) = (points[0], points[points.len() - 1]);
        if points.len() == 1 {
            area.add(circle(first, half, TOLERANCE_MM)?);
            return Ok(area);
        }
        let offset = |[x, y]: [f64; 2], angle: f64| {
            let (sin, cos) = angle.sin_cos();
            [x + half * cos, y + half * sin]
        };
        let angles = points.windows(2).map(|ends| {
            let [x, y] = [0, 1].map(|axis| ends[1][axis] - ends[0][axis]);
            y.atan2(x)
        });
        let angles: Vec<f64> = angles.collect();
        // All corners where polygons meet are the same, so that no gap is between them.
        let right = |k: usize| angles[k] - PI / 2.0;
        let left = |k: usize| angles[k] + PI / 2.0;
        for k in 0..angles.len() {
            let [from, to] = [points[k], points[k + 1]];
            let ends = [
                from,
                offset(from, right(k)),
                offset(to, right(k)),
                to,
                offset(to, left(k)),
                offset(from, left(k)),
            ];
            area.add(ends);
            if k + 1 < angles.len() {
                let turn = (angles[k + 1] - angles[k] + PI).rem_euclid(TAU) - PI;
                let (start, end) = match turn > 0.0 {
                    true => (right(k), right(k + 1)),
                    false => (left(k), left(k + 1)),
                };
                let chords = chords_of_arc(half, turn, TOLERANCE_MM)?;
                let between = (1..chords).map(|j| start + turn * j as f64 / chords as f64);
                let arc = [start].into_iter().chain(between).chain([end]);
                area.add([to].into_iter().chain(arc.map(|angle| offset(to, angle))));
            }
        }
        let chords = chords_of_arc(half, PI, TOLERANCE_MM)?;
        let mut cap = |end: [f64; 2], from: f64, to: f64| {
            let between = (1..chords).map(|j| from + PI * j as f64 / chords as f64);
            let arc = [from].into_iter().chain(between).chain([to]);
            area.add([end].into_iter().chain(arc.map(|angle| offset(end, angle))));
        };
        cap(first, left(0), right(0));
        cap(last, right(angles.len() - 1), left(angles.len() - 1));
        Ok(area)
    }

    /// Returns the area that a convex polygon passes along lines: the hull of both of its places at
    /// the ends of each side.
    pub(super) fn of_swept(points: &[[f64; 2]], ring: &[[f64; 2]]) -> Self {
        let mut area = Self::new();
        for ends in points.windows(2) {
            let moved =
                ends.iter().flat_map(|[x, y]| ring.iter().map(move |c| [x + c[0], y + c[1]]));
            area.add(hull(moved.collect()));
        }
        area
    }
}

/// Returns a circle that turns left.
pub(super) fn circle([x, y]: [f64; 2], radius: f64, tolerance: f64) -> Result<Ring, ContourFault> {
    let chords = chords_of_arc(radius, TAU, tolerance)?.next_multiple_of(4);
    let corner = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / chords as f64).sin_cos();
        [x + radius * cos, y + radius * sin]
    };
    Ok((0..chords).map(corner).collect())
}

/// Returns the convex hull of points, which turns left (Andrew's monotone chain).
fn hull(mut points: Vec<[f64; 2]>) -> Ring {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    let mut ring: Ring = Vec::with_capacity(points.len());
    let turns_left = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
    };
    let add = |from: usize, point: [f64; 2], ring: &mut Ring| {
        while ring.len() > from + 1
            && !turns_left(ring[ring.len() - 2], ring[ring.len() - 1], point)
        {
            ring.pop();
        }
        ring.push(point);
    };
    points.iter().for_each(|&point| add(0, point, &mut ring));
    let from = ring.len().saturating_sub(1);
    points.iter().rev().skip(1).for_each(|&point| add(from, point, &mut ring));
    ring.pop();
    ring
}

/// A side of a polygon that rises.
struct Edge {
    low: [f64; 2],
    high: [f64; 2],
    primitive: usize,
    winding: i32,
}

impl Edge {
    /// Returns x at a height. At its ends, no digit is lost.
    fn x_at(&self, y: f64) -> f64 {
        match y {
            _ if y == self.low[1] => self.low[0],
            _ if y == self.high[1] => self.high[0],
            _ => {
                let share = (y - self.low[1]) / (self.high[1] - self.low[1]);
                self.low[0] + share * (self.high[0] - self.low[0])
            }
        }
    }

    /// Returns the height where two edges cross.
    fn crossing(&self, other: &Self) -> Option<f64> {
        let [a, b] = [self, other].map(|edge| [0, 1].map(|axis| edge.high[axis] - edge.low[axis]));
        let between = [0, 1].map(|axis| other.low[axis] - self.low[axis]);
        let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        let all = cross(a, b);
        let shares = [cross(between, b) / all, cross(between, a) / all];
        let is_within = shares.iter().all(|share| (0.0..=1.0).contains(share));
        is_within.then(|| self.low[1] + shares[0] * a[1])
    }
}

/// A polygon between a left and a right chain of sides, while it grows upward.
struct Growing {
    chains: [Ring; 2],
    edges: [usize; 2],
    top: [f64; 2],
}

/// Returns polygons of the area that is dark once primitives are painted in their order. They touch
/// in horizontal sides.
fn painted(primitives: &[Primitive], steps_left: &mut u64) -> Result<Vec<Ring>, ContourFault> {
    let mut spend = |steps: usize| match steps_left.checked_sub(steps as u64) {
        Some(left) => {
            *steps_left = left;
            Ok(())
        }
        None => Err(CROSSED),
    };
    let mut edges = Vec::new();
    for (primitive, of) in primitives.iter().enumerate() {
        for ring in &of.rings {
            for (k, &a) in ring.iter().enumerate() {
                let b = ring[(k + 1) % ring.len()];
                if a[1] < b[1] {
                    edges.push(Edge { low: a, high: b, primitive, winding: 1 });
                } else if b[1] < a[1] {
                    edges.push(Edge { low: b, high: a, primitive, winding: -1 });
                }
            }
        }
    }
    edges.sort_by(|a, b| a.low[1].total_cmp(&b.low[1]));
    let mut heights: Vec<f64> = edges.iter().flat_map(|edge| [edge.low[1], edge.high[1]]).collect();
    for (k, edge) in edges.iter().enumerate() {
        let others = edges[k + 1..].iter().take_while(|other| other.low[1] < edge.high[1]);
        let mut compared = 0;
        for other in others {
            compared += 1;
            let ends = |of: &Edge| [of.low[0].min(of.high[0]), of.low[0].max(of.high[0])];
            let ([left, right], [of_left, of_right]) = (ends(edge), ends(other));
            if of_left <= right && left <= of_right {
                heights.extend(edge.crossing(other));
            }
        }
        spend(compared)?;
        if heights.len() > MAX_HEIGHTS {
            return Err(CROSSED);
        }
    }
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    let mut rings = Vec::new();
    let (mut next, mut active) = (0, Vec::<usize>::new());
    let mut growing: Vec<Growing> = Vec::new();
    let mut end = |grown: Growing, y: f64| {
        let [left, right] = grown.chains;
        let [top_left, top_right] = grown.top.map(|x| [x, y]);
        let around = right.into_iter().chain([top_right, top_left]);
        let mut ring: Ring = around.chain(left.into_iter().rev()).collect();
        ring.dedup();
        rings.push(ring);
    };
    let mut windings = vec![0i32; primitives.len()];
    for slab in heights.windows(2) {
        let [low, high] = [slab[0], slab[1]];
        active.retain(|&edge| edges[edge].high[1] > low);
        while edges.get(next).is_some_and(|edge| edge.low[1] <= low) {
            active.push(next);
            next += 1;
        }
        spend(active.len() * (primitives.len() + 4))?;
        let middle = low + (high - low) / 2.0;
        active.sort_by(|&a, &b| edges[a].x_at(middle).total_cmp(&edges[b].x_at(middle)));
        windings.fill(0);
        let (mut start, mut spans) = (None, Vec::new());
        for &edge in &active {
            let Edge { primitive, winding, .. } = edges[edge];
            windings[primitive] += winding;
            let topmost = windings.iter().rposition(|&winding| winding != 0);
            let is_dark = topmost.is_some_and(|top| primitives[top].is_dark);
            match start {
                None if is_dark => start = Some(edge),
                Some(left) if !is_dark => {
                    spans.push([left, edge]);
                    start = None;
                }
                _ => {}
            }
        }
        let mut below = std::mem::take(&mut growing).into_iter().peekable();
        for sides in spans {
            let [bottom, top] = [low, high].map(|y| sides.map(|edge| edges[edge].x_at(y)));
            if bottom[0] >= bottom[1] && top[0] >= top[1] {
                continue;
            }
            let mut lower = None;
            while let Some(other) = below.next_if(|other| other.top[0] <= bottom[0]) {
                if other.top == bottom && lower.is_none() {
                    lower = Some(other);
                } else {
                    end(other, low);
                }
            }
            let mut grown = lower.unwrap_or_else(|| Growing {
                chains: bottom.map(|x| vec![[x, low]]),
                edges: sides,
                top,
            });
            for side in 0..2 {
                if grown.edges[side] != sides[side] {
                    grown.chains[side].push([bottom[side], low]);
                }
            }
            growing.push(Growing { edges: sides, top, ..grown });
        }
        below.for_each(|other| end(other, low));
    }
    let highest = heights.last().copied().unwrap_or_default();
    growing.into_iter().for_each(|grown| end(grown, highest));
    Ok(rings)
}
