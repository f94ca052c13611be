//! Triangulates faces whose loops cross themselves within the tolerance.
//!
//! Where edges are off their surface, or two edges run within the tolerance of each other, loops
//! cross in the surface's parameters. Cutting ears off works for crossing loops too: every side of
//! a loop becomes a side of exactly one triangle, so the face still closes with its neighbors.
//! Triangles at a crossing are upside down; their area shows whether the loops cross by more than
//! the tolerance.

use std::collections::{HashMap, HashSet};

use spade::Point2;

/// A polygon's corner: its place in the plane of cells, and its number.
#[derive(Clone, Copy)]
pub(super) struct Corner {
    pub(super) at: Point2<f64>,
    pub(super) number: usize,
}

/// Returns triangles between an outer polygon, counterclockwise, and holes, clockwise.
pub(super) fn ears(outer: Vec<Corner>, mut holes: Vec<Vec<Corner>>) -> Vec<[usize; 3]> {
    let mut ring = outer;
    // From right to left, so that a hole is joined to the loop on its right.
    let right = |hole: &[Corner]| hole.iter().map(|corner| corner.at.x).fold(f64::MIN, f64::max);
    holes.sort_by(|a, b| right(b).total_cmp(&right(a)));
    for hole in holes {
        join(&mut ring, &hole);
    }
    cut(ring)
}

/// Joins a hole to a ring by the shortest line there and back that crosses neither.
fn join(ring: &mut Vec<Corner>, hole: &[Corner]) {
    let some = |list: &[Corner]| (0..list.len()).step_by(list.len().div_ceil(MOST_ENDS));
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for i in some(ring) {
        for k in some(hole) {
            let (a, b) = (ring[i], hole[k]);
            pairs.push(((a.at.x - b.at.x).hypot(a.at.y - b.at.y), i, k));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let is_free = |&&(_, i, k): &&(f64, usize, usize)| {
        let line = [ring[i].at, hole[k].at];
        !is_crossed(line, ring) && !is_crossed(line, hole)
    };
    let found = pairs.iter().take(MOST_LINES).find(is_free).or(pairs.first());
    let Some(&(_, i, k)) = found else { return };
    let around = (0..=hole.len()).map(|n| hole[(k + n) % hole.len()]);
    let way: Vec<Corner> = around.chain([ring[i]]).collect();
    ring.splice(i + 1..i + 1, way);
}

/// The greatest number of corners of a ring from which lines are tried.
const MOST_ENDS: usize = 500;
/// The greatest number of lines that are tried to join a hole.
const MOST_LINES: usize = 1000;

fn is_crossed([a, b]: [Point2<f64>; 2], ring: &[Corner]) -> bool {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).any(|(c, d)| {
        let (c, d) = (c.at, d.at);
        doubled(a, b, c) * doubled(a, b, d) < 0.0 && doubled(c, d, a) * doubled(c, d, b) < 0.0
    })
}

/// Cuts ears off until a triangle is left: corners that bulge out and whose triangle contains no
/// other corner; if there is no such corner, the flattest.
fn cut(mut ring: Vec<Corner>) -> Vec<[usize; 3]> {
    let mut triangles = Vec::with_capacity(ring.len());
    let mut at = 0;
    let mut misses = 0;
    while ring.len() > 2 {
        let count = ring.len();
        at %= count;
        let is_stuck = misses > count;
        if is_stuck {
            let flattest = |k: &usize| {
                let [a, b, c] = around(&ring, *k);
                doubled(a.at, b.at, c.at).abs()
            };
            let all = 0..count;
            at = all.min_by(|a, b| flattest(a).total_cmp(&flattest(b))).unwrap_or(0);
        }
        if is_stuck || is_ear(&ring, at) {
            triangles.push(around(&ring, at).map(|corner| corner.number));
            ring.remove(at);
            misses = 0;
            // Skipping a corner keeps the triangles from becoming a fan of slivers.
        } else {
            misses += 1;
        }
        at += 1;
    }
    triangles
}

fn around(ring: &[Corner], k: usize) -> [Corner; 3] {
    let count = ring.len();
    [ring[(k + count - 1) % count], ring[k], ring[(k + 1) % count]]
}

fn is_ear(ring: &[Corner], k: usize) -> bool {
    let [a, b, c] = around(ring, k);
    if doubled(a.at, b.at, c.at) <= 0.0 {
        return false;
    }
    let is_other = |corner: &&Corner| {
        [a, b, c].iter().all(|own| own.number != corner.number && own.at != corner.at)
    };
    let is_within = |p: Point2<f64>| {
        doubled(a.at, b.at, p) >= 0.0
            && doubled(b.at, c.at, p) >= 0.0
            && doubled(c.at, a.at, p) >= 0.0
    };
    !ring.iter().filter(is_other).any(|corner| is_within(corner.at))
}

/// Returns twice the signed area of a triangle.
pub(super) fn doubled(a: Point2<f64>, b: Point2<f64>, c: Point2<f64>) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

/// Triangles whose sides are halved where they are too long.
pub(super) struct Refined {
    pub(super) triangles: Vec<[usize; 3]>,
    /// Whether sides that are too long remain, because there would be too many triangles.
    pub(super) is_coarse: bool,
}

impl Refined {
    pub(super) fn sides(&self) -> impl Iterator<Item = [usize; 2]> {
        self.triangles.iter().flat_map(|&triangle| sides(triangle))
    }
}

/// Halves the sides that two triangles share and that are too long, and both triangles with them,
/// until no such side is left, or until there are more than `most` triangles. In between, sides are
/// turned to be Delaunay: ears reach across a strip much longer than wide, and halving alone would
/// never make them follow the strip.
///
/// `places` holds the corners; `is_long` decides for two corners; `halve` makes the corner between
/// them.
pub(super) fn refine(
    mut triangles: Vec<[usize; 3]>,
    places: &mut Vec<Point2<f64>>,
    most: usize,
    mut is_long: impl FnMut(usize, usize) -> bool,
    mut halve: impl FnMut(usize, usize) -> Point2<f64>,
) -> Refined {
    turn_sides(&mut triangles, places);
    // Sides found short need no second look.
    let mut short: HashSet<[usize; 2]> = HashSet::new();
    for _ in 0..MAX_ROUNDS {
        let mut uses: HashMap<[usize; 2], usize> = HashMap::new();
        for [a, b] in triangles.iter().flat_map(|&triangle| sides(triangle)) {
            *uses.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
        let shared = uses.into_iter().filter(|(side, uses)| *uses == 2 && !short.contains(side));
        let mut shared: Vec<[usize; 2]> = shared.map(|(side, _)| side).collect();
        shared.sort_unstable();
        let mut middles: HashMap<[usize; 2], usize> = HashMap::new();
        for [a, b] in shared {
            if is_long(a, b) {
                middles.insert([a, b], places.len());
                places.push(halve(a, b));
            } else {
                short.insert([a, b]);
            }
        }
        if middles.is_empty() {
            return Refined { triangles, is_coarse: false };
        }
        triangles = triangles.iter().flat_map(|&triangle| halved(triangle, &middles)).collect();
        turn_sides(&mut triangles, places);
        if triangles.len() > most {
            break;
        }
    }
    Refined { triangles, is_coarse: true }
}

/// The greatest number of rounds of halving.
const MAX_ROUNDS: usize = 30;
/// The greatest number of sides turned, per triangle.
const MOST_TURNS: usize = 30;

/// Turns sides that two triangles share to the other diagonal of both, where that is Delaunay.
///
/// Triangles that are upside down stay, and so do the sides next to them. Each turn lowers the
/// triangles lifted to a paraboloid, so that turning ends.
fn turn_sides(triangles: &mut [[usize; 3]], places: &[Point2<f64>]) {
    let key = |a: usize, b: usize| [a.min(b), a.max(b)];
    let mut beside: HashMap<[usize; 2], Vec<usize>> = HashMap::new();
    for (number, &triangle) in triangles.iter().enumerate() {
        for [a, b] in sides(triangle) {
            beside.entry(key(a, b)).or_default().push(number);
        }
    }
    let mut stack: Vec<[usize; 2]> = beside.keys().copied().collect();
    stack.sort_unstable();
    let mut left = MOST_TURNS * triangles.len();
    while let Some([a, b]) = stack.pop() {
        let Some(&[one, other]) = beside.get(&[a, b]).map(Vec::as_slice) else { continue };
        let Some((a, b, c, d)) = quad(triangles[one], triangles[other], [a, b]) else { continue };
        let is_new = !beside.contains_key(&key(c, d));
        if left == 0 || !is_new || !is_turned_better([a, b, c, d].map(|k| places[k])) {
            continue;
        }
        left -= 1;
        // a, b, c and b, a, d become a, d, c and d, b, c.
        triangles[one] = [a, d, c];
        triangles[other] = [d, b, c];
        beside.remove(&key(a, b));
        beside.insert(key(c, d), vec![one, other]);
        for (side, from, to) in [(key(a, d), other, one), (key(b, c), one, other)] {
            let uses = beside.entry(side).or_default();
            uses.iter_mut().filter(|number| **number == from).for_each(|number| *number = to);
        }
        stack.extend([key(a, d), key(d, b), key(b, c), key(c, a)]);
    }
}

/// Returns the ends of a side as the first triangle follows it, and the opposite corner of each
/// triangle; `None` if both follow it the same way.
fn quad(
    one: [usize; 3],
    other: [usize; 3],
    side: [usize; 2],
) -> Option<(usize, usize, usize, usize)> {
    let along = |triangle: [usize; 3]| {
        let is_side = |[a, b]: &[usize; 2]| side == [*a.min(b), *a.max(b)];
        let [a, b] = sides(triangle).into_iter().find(is_side)?;
        let far = triangle.into_iter().find(|k| *k != a && *k != b)?;
        Some((a, b, far))
    };
    let ((a, b, c), (e, f, d)) = (along(one)?, along(other)?);
    (a == f && b == e && c != d).then_some((a, b, c, d))
}

/// Returns whether a quadrilateral a, d, b, c, cut from a to b, should be cut from c to d.
fn is_turned_better([a, b, c, d]: [Point2<f64>; 4]) -> bool {
    let areas = [doubled(a, b, c), doubled(b, a, d), doubled(a, d, c), doubled(d, b, c)];
    if areas.iter().any(|area| *area <= 0.0) {
        return false;
    }
    // d is in the circle through a, b and c if the angles at c and d exceed a half turn.
    let angle = |p: Point2<f64>| {
        let (u, v) = ((a.x - p.x, a.y - p.y), (b.x - p.x, b.y - p.y));
        ((u.0 * v.1 - u.1 * v.0).abs(), u.0 * v.0 + u.1 * v.1)
    };
    let ((sin_c, cos_c), (sin_d, cos_d)) = (angle(c), angle(d));
    let scale = (sin_c.hypot(cos_c)) * (sin_d.hypot(cos_d));
    sin_c * cos_d + cos_c * sin_d < -1e-12 * scale
}

fn sides([a, b, c]: [usize; 3]) -> [[usize; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Returns the parts of a triangle whose sides were halved.
fn halved(triangle: [usize; 3], middles: &HashMap<[usize; 2], usize>) -> Vec<[usize; 3]> {
    let middle = |[a, b]: [usize; 2]| middles.get(&[a.min(b), a.max(b)]).copied();
    // Starts where the first side has a middle and the last has none, if there is such a corner.
    let [a, b, c] = triangle;
    let turns = [[a, b, c], [b, c, a], [c, a, b]];
    let turned = turns.into_iter().find(|&turn| {
        let [first, _, last] = sides(turn).map(middle);
        first.is_some() && last.is_none()
    });
    let [a, b, c] = turned.unwrap_or(triangle);
    match sides([a, b, c]).map(middle) {
        [Some(p), Some(q), Some(r)] => vec![[a, p, r], [p, b, q], [r, q, c], [p, q, r]],
        [Some(p), Some(q), None] => vec![[p, b, q], [a, p, q], [a, q, c]],
        [Some(p), None, None] => vec![[a, p, c], [p, b, c]],
        _ => vec![triangle],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(places: &[[f64; 2]], first: usize) -> Vec<Corner> {
        let corner =
            |(k, &[x, y]): (usize, &[f64; 2])| Corner { at: Point2::new(x, y), number: first + k };
        places.iter().enumerate().map(corner).collect()
    }

    /// Returns the sides that are not shared by two triangles, as directed, in order.
    fn border(triangles: &[[usize; 3]]) -> Vec<[usize; 2]> {
        let all: Vec<[usize; 2]> = triangles.iter().flat_map(|&triangle| sides(triangle)).collect();
        let mut free: Vec<[usize; 2]> =
            all.iter().copied().filter(|&[a, b]| !all.contains(&[b, a])).collect();
        free.sort_unstable();
        free
    }

    #[test]
    fn a_ring_and_its_hole_keep_all_their_sides() {
        let outer = ring(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]], 0);
        let hole = ring(&[[1.0, 1.0], [1.0, 3.0], [3.0, 3.0], [3.0, 1.0]], 4);
        let triangles = ears(outer, vec![hole]);
        assert_eq!(triangles.len(), 8);
        let sides = [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4]];
        assert_eq!(border(&triangles), sides);
    }

    #[test]
    fn a_crossed_ring_keeps_all_its_sides() {
        // The last corner lies a little beyond the first side.
        let crossed = ring(&[[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [2.0, -0.001], [0.0, 2.0]], 0);
        let mut places: Vec<_> = crossed.iter().map(|corner| corner.at).collect();
        let triangles = ears(crossed, Vec::new());
        assert_eq!(triangles.len(), 3);
        let sides = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 0]];
        assert_eq!(border(&triangles), sides);
        let at = places.clone();
        let half =
            |a: usize, b: usize| Point2::new((at[a].x + at[b].x) / 2.0, (at[a].y + at[b].y) / 2.0);
        let refined = refine(triangles, &mut places, 1000, |a, b| a.max(b) < 5, half);
        assert!(!refined.is_coarse);
        let triangles = refined.triangles;
        assert!(triangles.len() > 3);
        assert_eq!(border(&triangles), sides);
    }

    #[test]
    fn sides_follow_a_strip() {
        // A strip of 1 by 100, with ears that span all of it.
        let low = (0..=100).map(|k| [f64::from(k), 0.0]);
        let high = (0..=100).rev().map(|k| [f64::from(k), 1.0]);
        let strip = ring(&low.chain(high).collect::<Vec<_>>(), 0);
        let mut places: Vec<_> = strip.iter().map(|corner| corner.at).collect();
        let triangles = ears(strip, Vec::new());
        let none = |_, _| unreachable!("nothing is long");
        let refined = refine(triangles, &mut places, 1000, |_, _| false, none);
        for [a, b] in refined.triangles.iter().flat_map(|&triangle| sides(triangle)) {
            assert!((places[a].x - places[b].x).abs() <= 1.0, "{a} {b}");
        }
        assert_eq!(border(&refined.triangles).len(), 202);
    }
}
