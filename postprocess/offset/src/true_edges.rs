//! Outlines where levels are shares of areas: pixels say where edges are within them.
//!
//! Along a column of pixels, the white of all gray pixels of an edge adds up to the place at which
//! the edge crosses the column on average, and that is where a straight edge crosses its middle
//! (the height function of volumes of fluid: Cummins et al. 2005). Steep edges have such places
//! along rows. So straight edges are exact to the rounding of levels, and curves to the rise of an
//! arc above a chord of a pixel.

use lamp_stack::{GrayMask, Image, Mask, Op};

use super::contours::{self, Contour, Direction};
use super::edge_map::{EdgeMap, Edges};
use super::outline::{Outline, cross, dot, minus, plus};
use super::row_runs::{RowRuns, join_runs, subtract};
use super::scale::{Enlargement, scaled};
use super::straight::{StraightPart, straight_parts};
use super::{grow_one_bit, shrink_one_bit};

/// The level of pixels that an edge leaves whole.
const WHOLE: u8 = 255;
/// The pixels along a column in which an edge ends, or both edges of a wall without whole pixels.
/// One that is steeper has its places along rows.
const REACH: usize = 6;
/// The most by which places of a straight edge are off its line, in pixels: two pixels of
/// half a level each, and as much again.
const STRAIGHT: f64 = 0.008;
/// The least places of a straight edge: fewer are near a line on a curve, too.
const LEAST_PLACES: usize = 4;
/// The pixels of parts that may be of no edge of their own, at the corner of two long ones.
const TIP: usize = 12;
/// The most by which such a corner is off the nearest place of these parts, in pixels.
const TIP_OFF: f64 = 1.2;
/// The least sine of a turn at which two lines cross at a place that is worth a corner.
const TURN: f64 = 0.05;
/// The least cosine of a turn that a curve makes from place to place.
const SMOOTH: f64 = 0.5;
/// The most by which the tip of a corner is off the corner of pixels, in pixels.
const MAX_TIP: f64 = 3.0;

/// A shape by its pixels, and its outlines at the true places of its edges.
pub(super) struct TrueShape {
    /// The pixels inside the outlines, by halves: pixels at least half white, and pixels of walls
    /// that have no whole one, without the pixels of gaps that have no black one.
    pub(super) mask: Mask,
    /// All pixels that are partly white.
    pub(super) all: Mask,
    /// The pixels that no edge passes.
    pub(super) whole: Mask,
    pub(super) outlines: Vec<Outline>,
}

impl TrueShape {
    /// Finds the shape of an image of shares.
    pub(super) fn of(shares: &GrayMask) -> Self {
        let all = shares.at_least(1);
        let [half, whole] = [128, WHOLE].map(|level| shares.at_least(level));
        // Of a wall or a gap thinner than a pixel no pixel may have the half, and none may go
        // missing. Where both are so thin, only the halves are known.
        let walls = distant(&all, &whole);
        let gaps = distant(&whole.inverted(), &all.inverted());
        let both = |a: &Mask, op: Op, b: &Mask| a.combined(op, b).expect("they have few runs");
        let mask = both(&half, Op::Union, &both(&walls, Op::Difference, &gaps));
        let mask = both(&mask, Op::Difference, &both(&gaps, Op::Difference, &walls));
        let rows = RowRuns::white(&mask);
        let places = EdgePlaces { shares, shape: &rows };
        let (mut parts, mut outlines) = (Vec::new(), Vec::new());
        contours::for_each(&rows, |contour| {
            straight_parts(contour, &mut parts);
            outlines.push(joined(&places.parts(contour, &parts)));
        });
        outlines.retain(|outline| outline.len() > 2);
        Self { mask, all, whole, outlines }
    }

    /// Returns the shape of an image that is enlarged as [`scaled`] does.
    pub(super) fn enlarged(&self, columns: &Enlargement, rows: &Enlargement, width: u32) -> Self {
        let larger = |mask: &Mask| match scaled(&Image::Mask(mask.clone()), columns, rows, width) {
            Image::Mask(mask) => mask,
            Image::Gray(_) => unreachable!("a mask stays one"),
        };
        let enlarge = |outline: &Outline| {
            outline.iter().map(|&[x, y]| [columns.place(x), rows.place(y)]).collect()
        };
        let mask = larger(&self.mask);
        Self {
            whole: shrink_one_bit(&mask, [1.0; 2]),
            mask,
            // An edge may pass more pixels than the ones whose middles lie in pixels that it passed.
            all: grow_one_bit(&larger(&self.all), [1.0; 2]),
            outlines: self.outlines.iter().map(enlarge).collect(),
        }
    }

    /// Returns the shares of pixels' areas in the outlines.
    pub(super) fn shares(&self) -> GrayMask {
        let edges = Edges { outlines: &self.outlines, by: None, range: [0.0; 2] };
        let [mask, all] = [&self.mask, &self.all].map(RowRuns::white);
        EdgeMap::around(&mask, &all, edges, 0.0, true).gray(self.mask.width(), 0)
    }
}

/// Returns the pixels of a mask that touch no pixel of another, at sides or corners.
fn distant(all: &Mask, others: &Mask) -> Mask {
    let width = all.width();
    let [all, others] = [all, others].map(RowRuns::white);
    let (mut out, mut near, mut row) = (RowRuns::new(), Vec::new(), Vec::new());
    for number in 0..all.height() {
        near.clear();
        let around = i64::from(number) - 1..=i64::from(number) + 1;
        let around = around.flat_map(|row| others.row_or_none(row));
        near.extend(around.map(|&(start, end)| (start - 1, end + 1)));
        join_runs(&mut near);
        subtract(all.row(number), &near, &mut row);
        out.push(&row);
    }
    out.mask(width)
}

/// The places of edges between pixels of a shape and others.
struct EdgePlaces<'a> {
    shares: &'a GrayMask,
    shape: &'a RowRuns,
}

/// The edge along a straight part of pixels.
struct EdgePart {
    /// Its places, and for a straight one the ends of its line.
    places: Vec<[f64; 2]>,
    is_straight: bool,
    /// The corners of pixels at its ends.
    start: [f64; 2],
    end: [f64; 2],
    /// The length along rows or columns in pixels.
    length: usize,
}

impl EdgePlaces<'_> {
    /// Returns the edges along the parts of a contour.
    fn parts(&self, contour: &Contour, parts: &[StraightPart]) -> Vec<EdgePart> {
        let mut at = contour.start;
        let moves = contour.moves.iter();
        let mut steps = moves.flat_map(|&(way, length)| std::iter::repeat_n(way, length as usize));
        let mut edges = Vec::with_capacity(parts.len());
        for part in parts {
            let [right, down] = minus(part.end, part.start).map(f64::abs);
            let mut places = Vec::new();
            for way in steps.by_ref().take((right + down) as usize) {
                // A part around a single pixel has a place on each side.
                if (way.0 != 0) == (right >= down) || right.max(down) < 2.0 {
                    places.extend(self.place(at, way));
                }
                at = (at.0 + way.0, at.1 + way.1);
            }
            edges.push(EdgePart::new(&places, part, right >= down));
        }
        without_tips(edges)
    }

    /// Returns where the edge crosses the middle line across a side of a pixel, which goes from a
    /// corner in a direction, with the shape on its right.
    fn place(&self, (x, y): (i32, i32), way: Direction) -> Option<[f64; 2]> {
        let inwards = (-way.1, way.0);
        let pixel = (x + way.0.min(0) + inwards.0.min(0), y + way.1.min(0) + inwards.1.min(0));
        // Black inside, and white outside.
        let missing = self.sum(pixel, inwards, |level| WHOLE - level)?;
        let outside = (pixel.0 - inwards.0, pixel.1 - inwards.1);
        let left = self.sum(outside, (-inwards.0, -inwards.1), |level| level)?;
        let away = left - missing;
        let middle = [f64::from(x) + f64::from(way.0) / 2.0, f64::from(y) + f64::from(way.1) / 2.0];
        Some(plus(middle, [f64::from(-inwards.0), f64::from(-inwards.1)], away))
    }

    /// Returns the sum of `share` of levels from a pixel on in a direction, in pixels, up to one
    /// that has none. If the pixels are all as the first, in or out of the shape, the half that is
    /// nearer counts: the other half is another edge's.
    fn sum(&self, from: (i32, i32), way: Direction, share: impl Fn(u8) -> u8) -> Option<f64> {
        let mut shares = [0.0; REACH];
        let is_in = self.is_in(from);
        let mut at = from;
        for count in 0..REACH {
            let here = share(self.level(at));
            if here == 0 {
                return Some(shares[..count].iter().sum());
            }
            if self.is_in(at) != is_in {
                let middle = if count % 2 == 1 { shares[count / 2] / 2.0 } else { 0.0 };
                return Some(shares[..count / 2].iter().sum::<f64>() + middle);
            }
            shares[count] = f64::from(here) / f64::from(WHOLE);
            at = (at.0 + way.0, at.1 + way.1);
        }
        None
    }

    fn level(&self, (column, row): (i32, i32)) -> u8 {
        match (u32::try_from(column), u32::try_from(row)) {
            (Ok(column), Ok(row)) if column < self.shares.width() && row < self.shares.height() => {
                self.shares.level(column, row)
            }
            _ => 0,
        }
    }

    fn is_in(&self, (column, row): (i32, i32)) -> bool {
        let row = u32::try_from(row).ok().filter(|&row| row < self.shape.height());
        row.is_some_and(|row| self.shape.find(column, row).is_some())
    }
}

impl EdgePart {
    fn new(places: &[[f64; 2]], part: &StraightPart, is_flat: bool) -> Self {
        let length = places.len();
        // Next to its ends, another edge may cut pixels, too.
        let rim = match length {
            0..4 => 0,
            4..8 => 1,
            _ => 2,
        };
        // A corner may have cut more, on one side.
        let rims = (0..=2).flat_map(|more| [[rim + more, rim], [rim, rim + more]]);
        let within = rims.filter_map(|[from, to]| places.get(from..length.checked_sub(to)?));
        let line = within.into_iter().find_map(|places| line_through(places, is_flat));
        let is_straight = line.is_some();
        let places = line.map_or_else(|| simplified(places), Vec::from);
        Self { places, is_straight, start: part.start, end: part.end, length }
    }

    /// Returns a place of the line at its start or end, and its direction; none if it has one place.
    fn line(&self, at_end: bool) -> Option<([f64; 2], [f64; 2])> {
        let count = self.places.len();
        let [a, b] = if at_end { [count.checked_sub(2)?, count - 1] } else { [0, 1] };
        let [a, b] = [*self.places.get(a)?, *self.places.get(b)?];
        let along = minus(b, a);
        let length = along[0].hypot(along[1]);
        (length > 0.0).then(|| (if at_end { b } else { a }, along.map(|side| side / length)))
    }
}

/// Returns the ends of the line of least squares through places, if all are on it.
fn line_through(places: &[[f64; 2]], is_flat: bool) -> Option<[[f64; 2]; 2]> {
    let [along, across] = if is_flat { [0, 1] } else { [1, 0] };
    let (first, last) = (places.first()?, places.last()?);
    if places.len() < LEAST_PLACES {
        return None;
    }
    let count = places.len() as f64;
    let mean = [along, across].map(|axis| places.iter().map(|at| at[axis]).sum::<f64>() / count);
    let off = |at: &[f64; 2]| [at[along] - mean[0], at[across] - mean[1]];
    let sums = places.iter().map(off).fold([0.0; 2], |[spread, joint], [along, across]| {
        [spread + along * along, joint + along * across]
    });
    let slope = sums[1] / sums[0];
    let is_on_line = |at: &[f64; 2]| {
        let [along, across] = off(at);
        (across - slope * along).abs() <= STRAIGHT
    };
    let end = |at: &[f64; 2]| {
        let mut end = *at;
        end[across] = mean[1] + slope * (at[along] - mean[0]);
        end
    };
    places.iter().all(is_on_line).then(|| [end(first), end(last)])
}

/// Returns places of a curve, except places on chords between others (Douglas and Peucker 1973).
fn simplified(places: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut kept = Vec::new();
    let mut open = vec![(0, places.len().saturating_sub(1))];
    while let Some((from, to)) = open.pop() {
        let [a, b] = match (places.get(from), places.get(to)) {
            (Some(a), Some(b)) => [*a, *b],
            _ => break,
        };
        let along = minus(b, a);
        let length = along[0].hypot(along[1]);
        let away = |of: usize| (cross(along, minus(places[of], a)) / length).abs();
        let farthest = (from + 1..to).max_by(|&a, &b| away(a).total_cmp(&away(b)));
        match farthest.filter(|&of| away(of) > STRAIGHT) {
            Some(of) => open.extend([(of, to), (from, of)]),
            None => kept.push(a),
        }
    }
    kept.extend(places.last());
    kept.dedup();
    kept
}

/// Removes short parts around the corner of two straight edges: both edges cut their pixels, so
/// their places are of neither.
fn without_tips(mut edges: Vec<EdgePart>) -> Vec<EdgePart> {
    let count = edges.len();
    let mut is_tip = vec![false; count];
    for (of, before) in edges.iter().enumerate().filter(|(_, edge)| edge.is_straight) {
        let between = (1..count).map(|step| (of + step) % count);
        let tip: Vec<usize> = between.take_while(|&of| !edges[of].is_straight).collect();
        let after = &edges[(of + tip.len() + 1) % count];
        let length: usize = tip.iter().map(|&of| edges[of].length).sum();
        if tip.is_empty() || length > TIP || !after.is_straight {
            continue;
        }
        let Some(corner) = corner(before, after) else { continue };
        let away = |at: [f64; 2]| (at[0] - corner[0]).hypot(at[1] - corner[1]);
        let parts = || tip.iter().map(|&of| &edges[of]);
        let places = || parts().flat_map(|part| part.places.iter().copied());
        // The corner of a chamfer is farther from its pixels.
        let ends = parts().flat_map(|part| [part.start, part.end]);
        let nearest = places().chain(ends).map(away).fold(f64::INFINITY, f64::min);
        if nearest <= TIP_OFF && places().all(|place| away(place) < TIP as f64) {
            tip.into_iter().for_each(|of| is_tip[of] = true);
        }
    }
    let mut is_tip = is_tip.into_iter();
    edges.retain(|_| !is_tip.next().expect("one for each"));
    edges
}

/// Returns where the line at the end of an edge crosses the line at the start of the next.
fn corner(before: &EdgePart, after: &EdgePart) -> Option<[f64; 2]> {
    let (a, along_a) = before.line(true)?;
    let (b, along_b) = after.line(false)?;
    let sine = cross(along_a, along_b);
    let smooth = dot(along_a, along_b) > SMOOTH && !(before.is_straight && after.is_straight);
    if sine.abs() < TURN || smooth {
        return None;
    }
    let crossing = plus(a, along_a, cross(minus(b, a), along_b) / sine);
    // Parts at the tip may have been between.
    let mut off = [before.end, after.start].into_iter().map(|end| minus(crossing, end));
    off.any(|[x, y]| x.hypot(y) <= MAX_TIP).then_some(crossing)
}

/// Returns the outline of the edges along the parts of a contour.
fn joined(edges: &[EdgePart]) -> Outline {
    let mut outline = Outline::new();
    for (of, edge) in edges.iter().enumerate() {
        let before = &edges[(of + edges.len() - 1) % edges.len()];
        let next = &edges[(of + 1) % edges.len()];
        let foot = |corner: [f64; 2]| {
            edge.line(false)
                .filter(|_| edge.is_straight)
                .map(|(at, along)| plus(at, along, dot(minus(corner, at), along)))
        };
        if corner(before, edge).is_none() {
            outline.extend(foot(before.end));
        }
        if !edge.is_straight {
            outline.extend(&edge.places);
        }
        match corner(edge, next) {
            Some(corner) => outline.push(corner),
            None => outline.extend(foot(edge.end)),
        }
    }
    outline.dedup();
    if outline.len() > 1 && outline.first() == outline.last() {
        outline.pop();
    }
    outline
}
