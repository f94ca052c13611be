//! Maps loops to the parameters of their surface, across seams and poles.

use super::points::{FaceNode, FacePoints};
use crate::geometry::{Pole, Surface};
use crate::model::Face;
use crate::vector::distance;

/// A loop of nodes.
#[derive(Clone, Debug)]
pub(super) struct Unwrapped {
    pub(super) nodes: Vec<FaceNode>,
    /// The number of turns along u and along v around a closed surface, from start to
    /// start.
    pub(super) turns: [i32; 2],
    /// Whether the file marks it as the face's outer loop.
    pub(super) is_outer: bool,
}

/// The distance within which a point counts as at a pole, in millimeters.
pub(super) const AT_POLE_MM: f64 = 1e-5;
/// The number of corners that represent a pole, per full turn around it.
const POLE_PARTS: f64 = 16.0;

/// Finds a loop's parameters, each as near the previous one as periods allow.
pub(super) fn unwrap(
    face: &Face,
    poles: &[Pole],
    ring: &[u32],
    points: &FacePoints,
    chord_mm: f64,
) -> Unwrapped {
    let surface = &face.surface;
    let periods = surface.periods();
    let pole_at = |point: u32| {
        let place = points.get(point);
        poles.iter().find(|pole| distance(pole.point, place) < AT_POLE_MM)
    };
    // Start away from poles, where one parameter is arbitrary.
    let start = ring.iter().position(|&point| pole_at(point).is_none()).unwrap_or(0);
    let order = ring[start..].iter().chain(&ring[..start]).copied();
    let mut nodes: Vec<FaceNode> = Vec::with_capacity(ring.len() + 1);
    let mut waiting: Option<(&Pole, u32)> = None;
    // Points that share the pole with the previous point.
    let mut others = Vec::new();
    for point in order.chain([ring[start]]) {
        if let Some(pole) = pole_at(point) {
            match waiting {
                Some((_, tip)) if tip != point => others.push(point),
                _ => waiting = Some((pole, point)),
            }
            continue;
        }
        let before = nodes.last().map(|node| node.uv);
        let mut uv = surface.project_near(points.get(point), before, chord_mm);
        if let Some(before) = before {
            for axis in 0..2 {
                uv[axis] = near(uv[axis], before[axis], periods[axis]);
            }
            if let Some((pole, tip)) = waiting.take() {
                uv = around_pole(face, pole, tip, before, uv, &mut nodes);
                let at = nodes.last().map_or(uv, |node| node.uv);
                nodes.extend(others.drain(..).map(|point| FaceNode { uv: at, point }));
            }
        }
        nodes.push(FaceNode { uv, point });
    }
    let mut turns = [0; 2];
    if let (Some(first), Some(last)) = (nodes.first(), nodes.last()) {
        for axis in 0..2 {
            if let Some(period) = periods[axis] {
                turns[axis] = ((last.uv[axis] - first.uv[axis]) / period).round() as i32;
            }
        }
    }
    nodes.pop();
    Unwrapped { nodes, turns, is_outer: false }
}

/// Returns a parameter, moved by periods to be nearest to another.
pub(super) fn near(t: f64, other: f64, period: Option<f64>) -> f64 {
    match period {
        Some(period) => t - ((t - other) / period).round() * period,
        None => t,
    }
}

/// Adds the corners that represent a pole between two nodes, and returns the parameters of the
/// second node.
///
/// A pole is a side of the domain. The face lies on the left of its loop, which decides
/// the direction along that side.
fn around_pole(
    face: &Face,
    pole: &Pole,
    tip: u32,
    before: [f64; 2],
    mut after: [f64; 2],
    nodes: &mut Vec<FaceNode>,
) -> [f64; 2] {
    let free = 1 - pole.axis;
    if let Some(period) = face.surface.periods()[free] {
        let is_last = pole.at > before[pole.axis];
        // Counterclockwise is backward along the sides of greatest v and of least u.
        let is_forward = (is_last == (pole.axis == 0)) == face.along_normal;
        let way = (after[free] - before[free]).rem_euclid(period);
        let tiny = 1e-6 * period;
        let way = if way < tiny || way > period - tiny { period } else { way };
        let is_whole = way == period;
        let way = match (is_forward, is_whole) {
            (true, _) => way,
            (false, true) => -period,
            (false, false) => way - period,
        };
        after[free] = before[free] + way;
    }
    let way = after[free] - before[free];
    let span = face.surface.periods()[free].unwrap_or(way.abs());
    let parts = if span > 0.0 { (POLE_PARTS * way.abs() / span).ceil().max(1.0) } else { 1.0 };
    for k in 0..=parts as usize {
        let mut uv = [pole.at; 2];
        uv[free] = before[free] + way * k as f64 / parts;
        nodes.push(FaceNode { uv, point: tip });
    }
    after
}

/// Returns parameters strictly between two on a straight line, close enough that the
/// surface between them bends less than the chord.
pub(super) fn between(surface: &Surface, a: [f64; 2], b: [f64; 2], chord_mm: f64) -> Vec<[f64; 2]> {
    let mut list = Vec::new();
    halve(surface, [a, b], chord_mm, 0, &mut list);
    list
}

fn halve(
    surface: &Surface,
    [a, b]: [[f64; 2]; 2],
    chord_mm: f64,
    depth: usize,
    list: &mut Vec<[f64; 2]>,
) {
    let at = |part: f64| [0, 1].map(|k| a[k] + (b[k] - a[k]) * part);
    let [p, q] = [a, b].map(|uv| surface.point(uv));
    let is_straight = |part: f64| {
        let chord = crate::vector::along(p, crate::vector::sub(q, p), part);
        distance(surface.point(at(part)), chord) <= chord_mm
    };
    // Where it bends, halve at least twice: after a full turn the ends coincide and
    // look straight.
    let is_plain =
        matches!(surface, Surface::Plane(_) | Surface::Cylinder { .. } | Surface::Cone { .. });
    let least = if is_plain && a[0] == b[0] { 0 } else { 2 };
    if depth >= least && (depth > 14 || [0.25, 0.5, 0.75].into_iter().all(is_straight)) {
        return;
    }
    let middle = at(0.5);
    halve(surface, [a, middle], chord_mm, depth + 1, list);
    list.push(middle);
    halve(surface, [middle, b], chord_mm, depth + 1, list);
}
