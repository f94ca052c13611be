//! Outlines of shapes at the true places of their edges: the mean lines of straight parts,
//! joined.

use super::contours;
use super::row_runs::RowRuns;
use super::straight::{StraightPart, straight_parts};

/// A closed outline, by its corners in pixels. White is on its right, seen on the screen.
pub(super) type Outline = Vec<[f64; 2]>;

/// The least cosine of the turn between two parts of one smooth edge.
///
/// Straight parts of a disc of 15 pixels turn by 35 degrees; a corner of 45 stays one.
const SMOOTH: f64 = 0.75;
/// The least cosine of a turn at which lines that cross need not cross near the corner.
const BLUNT: f64 = 0.7;
/// The most by which the tip of a corner may exceed its pixels, in pixels.
const MAX_TIP: f64 = 1.0;
/// The greatest rise of an arc above its chord, in pixels, that a straight part can hide.
const MAX_RISE: f64 = 1.1;
/// The least rise that is worth corners between.
const MIN_RISE: f64 = 0.02;
/// The rise above chords from which on there are more of them.
const CHORD_RISE: f64 = 0.06;
/// The most chords of an arc.
const MAX_CHORDS: f64 = 4.0;

/// Returns the outlines of white pixels.
pub(super) fn outlines(rows: &RowRuns) -> Vec<Outline> {
    let (mut parts, mut outlines) = (Vec::new(), Vec::new());
    contours::for_each(rows, |contour| {
        straight_parts(contour, &mut parts);
        outlines.push(joined(&parts));
    });
    outlines
}

/// Returns the outline of the parts of a contour.
fn joined(parts: &[StraightPart]) -> Outline {
    let count = parts.len();
    let joint = |of: usize| ContourJoint::new(parts, of);
    let joints: Vec<ContourJoint> = (0..count).map(joint).collect();
    let arcs: Vec<ParabolicArc> = (0..count)
        .map(|of| ParabolicArc::new(&parts[of], &joints[(of + count - 1) % count], &joints[of]))
        .collect();
    let mut outline = Outline::with_capacity(2 * count);
    let mut push = |point: [f64; 2]| {
        if outline.last() != Some(&point) {
            outline.push(point);
        }
    };
    for of in 0..count {
        let before = &joints[(of + count - 1) % count];
        arcs[of].between(before.after, joints[of].before, &mut push);
        let next = &arcs[(of + 1) % count];
        let ContourJoint { before, after, is_smooth, .. } = joints[of];
        if is_smooth {
            let [a, b] = [arcs[of].at_end(), next.at_end()];
            push([before[0] + (a[0] + b[0]) / 2.0, before[1] + (a[1] + b[1]) / 2.0]);
        } else {
            push(before);
            push(after);
        }
    }
    if outline.len() > 1 && outline.first() == outline.last() {
        outline.pop();
    }
    outline
}

/// Where a part of a contour ends and the next begins.
#[derive(Clone, Copy, Debug)]
struct ContourJoint {
    /// The end of the part before.
    before: [f64; 2],
    /// The start of the part after.
    after: [f64; 2],
    /// The turn towards white, in radians.
    turn: f64,
    /// Whether both are parts of one smooth edge.
    is_smooth: bool,
}

impl ContourJoint {
    /// Joins part `of` of a contour and the next.
    fn new(parts: &[StraightPart], of: usize) -> Self {
        let [a, b] = [&parts[of], &parts[(of + 1) % parts.len()]];
        let corner = a.end;
        let sine = cross(a.along, b.along);
        let cosine = dot(a.along, b.along);
        let (turn, is_smooth) = (sine.atan2(cosine), cosine > SMOOTH);
        let [on_a, on_b] = [a, b].map(|part| {
            let away = dot(minus(corner, part.point), part.along);
            plus(part.point, part.along, away)
        });
        if cosine > BLUNT {
            // Weighed by their lengths, the parts give up as much area as they gain.
            let [long_a, long_b] = [a, b].map(|part| dot(minus(part.end, part.start), part.along));
            let middle = plus(on_a, minus(on_b, on_a), long_b / (long_a + long_b));
            return Self { before: middle, after: middle, turn, is_smooth };
        }
        if sine.abs() > 0.1 {
            let away = cross(minus(b.point, a.point), b.along) / sine;
            let crossing = plus(a.point, a.along, away);
            let off = minus(crossing, corner);
            if off[0].hypot(off[1]) <= MAX_TIP {
                return Self { before: crossing, after: crossing, turn, is_smooth };
            }
        }
        Self { before: on_a, after: on_b, turn, is_smooth }
    }
}

/// The arc that a part of a smooth edge is taken for: a parabola with the area of its mean line.
struct ParabolicArc {
    /// Away from white.
    outwards: [f64; 2],
    /// The rise of its middle above its chord, in pixels; zero if it is straight.
    rise: f64,
}

impl ParabolicArc {
    fn new(part: &StraightPart, start: &ContourJoint, end: &ContourJoint) -> Self {
        let outwards = [part.along[1], -part.along[0]];
        // An arc that turns by an angle θ rises about θ / 8 of its length above its chord.
        let length = dot(minus(end.before, start.after), part.along);
        // Each joint turns by half the angle of the parts on both sides of it.
        let rise = (start.turn + end.turn) / 2.0 * length / 8.0;
        let is_arc = start.is_smooth
            && end.is_smooth
            && start.turn * end.turn > 0.0
            && (MIN_RISE..MAX_RISE).contains(&rise.abs());
        Self { outwards, rise: if is_arc { rise } else { 0.0 } }
    }

    /// The number of chords that it is made of.
    fn chords(&self) -> u32 {
        (self.rise.abs() / CHORD_RISE).sqrt().ceil().clamp(1.0, MAX_CHORDS) as u32
    }

    /// Returns its rise above the mean line at a place from -1 to 1 along it.
    fn above(&self, place: f64) -> f64 {
        // The chords take this much of the arc's area away.
        let chords = f64::from(self.chords());
        // The mean of 1 - p² over -1 to 1 is 2/3, so about its mean line the parabola is 1/3 - p².
        self.rise * (1.0 / 3.0 - place * place + 2.0 / 3.0 / (chords * chords))
    }

    fn at_end(&self) -> [f64; 2] {
        if self.rise == 0.0 { [0.0; 2] } else { self.outwards.map(|v| v * self.above(1.0)) }
    }

    /// Adds the corners between its ends, of which the mean line has these.
    fn between(&self, start: [f64; 2], end: [f64; 2], mut push: impl FnMut([f64; 2])) {
        for corner in 1..self.chords() {
            let share = f64::from(corner) / f64::from(self.chords());
            let on_line = plus(start, minus(end, start), share);
            push(plus(on_line, self.outwards, self.above(2.0 * share - 1.0)));
        }
    }
}

pub(super) fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

pub(super) fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

pub(super) fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

pub(super) fn plus(a: [f64; 2], b: [f64; 2], times: f64) -> [f64; 2] {
    [a[0] + times * b[0], a[1] + times * b[1]]
}
