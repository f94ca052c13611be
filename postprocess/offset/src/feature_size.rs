//! The size of the feature at each place of an outline, and how far edges move there.
//!
//! Across a feature, a ray from its edge along the normal finds the other edge. At the tip of a rib
//! the ray runs along the rib: there the largest disc that touches the edge from inside gives the
//! width. Towards a convex corner those discs shrink though the feature does not, so the width is
//! carried on along the edge, but never beyond what the ray finds: into no rib from the block that
//! it stands on, and into no corner that is thinner.

use super::outline::Outline;
use super::row_runs::RowRuns;
use super::widths::Widths;

/// The greatest distance in pixels between places whose size is taken.
const STEP: f64 = 6.0;
/// Overlaps of a disc with black up to this depth, in pixels, are the roughness of its own edge.
const ROUGHNESS: f64 = 3.0;
/// Sides of outlines that are shorter, in pixels, take the size of their neighbors.
const SHORT: f64 = 2.5;
/// The cosine of a turn that is sharp.
const SHARP: f64 = 0.9;
/// The slope of a ray beside the normal.
const TILT: f64 = 0.1;
/// The rows of a band of places.
const BAND: f64 = 64.0;
/// The greatest change of a distance along an edge, from one side of a place to both: half of it
/// per pixel. So the distance changes no faster than the light has spread.
const MAX_CHANGE: f64 = 1.0;
/// A change of distances in pixels that makes no difference.
const NO_CHANGE: f64 = 0.01;

/// Outlines and the distances that edges move at their corners, in pixels.
pub(super) struct MovedOutlines {
    pub(super) outlines: Vec<Outline>,
    pub(super) by: Vec<Vec<f64>>,
    /// The least and the greatest of the distances.
    pub(super) range: [f64; 2],
}

/// Finds how far each place of outlines moves: as `widths` say for the size of its feature.
pub(super) fn moved(white: &RowRuns, outlines: &[Outline], widths: &Widths) -> MovedOutlines {
    let places: Vec<Vec<SidePiece>> = outlines.iter().map(places).collect();
    let bands = Bands::new(&places, white.height());
    let mut moved = MovedOutlines {
        outlines: Vec::new(),
        by: Vec::new(),
        range: [f64::INFINITY, f64::NEG_INFINITY],
    };
    for places in &places {
        let sizes = sizes(white, places, &bands, widths.largest_size());
        let by = steadied(sizes.into_iter().map(|size| widths.at(size)).collect(), places);
        let (outline, by) = corners(places, &by);
        for &by in &by {
            moved.range = [moved.range[0].min(by), moved.range[1].max(by)];
        }
        moved.outlines.push(outline);
        moved.by.push(by);
    }
    moved
}

/// A short piece of a side of an outline.
#[derive(Clone, Copy, Debug)]
struct SidePiece {
    start: [f64; 2],
    /// The middle, where the size is taken.
    middle: [f64; 2],
    /// The direction into white, of length one.
    inwards: [f64; 2],
    length: f64,
    /// Whether it starts at a corner of the outline.
    is_first: bool,
    /// Whether it starts or ends where the outline turns sharply.
    is_at_turn: bool,
}

/// Returns the places of an outline.
fn places(outline: &Outline) -> Vec<SidePiece> {
    let count = outline.len();
    let along = |of: usize| {
        let [a, b] = [outline[of % count], outline[(of + 1) % count]];
        [b[0] - a[0], b[1] - a[1]]
    };
    let turns = |corner: usize| {
        let [a, b] = [along(corner + count - 1), along(corner)];
        let cosine = (a[0] * b[0] + a[1] * b[1]) / (a[0].hypot(a[1]) * b[0].hypot(b[1]));
        cosine < SHARP
    };
    let mut places = Vec::new();
    for (of, &[x, y]) in outline.iter().enumerate() {
        let next = outline[(of + 1) % outline.len()];
        let [right, down] = [next[0] - x, next[1] - y];
        let side = right.hypot(down);
        // An odd number, as the disc is largest at the middle of a side.
        let count = f64::from((side / STEP).ceil() as u32 | 1);
        let at = |share: f64| [x + share * right, y + share * down];
        places.extend((0..count as u32).map(|step| SidePiece {
            start: at(f64::from(step) / count),
            middle: at((f64::from(step) + 0.5) / count),
            inwards: [-down / side, right / side],
            length: side / count,
            is_first: step == 0,
            is_at_turn: (step == 0 && turns(of)) || (step + 1 == count as u32 && turns(of + 1)),
        }));
    }
    places
}

impl SidePiece {
    /// Returns how far the white goes on from the place along its normal, up to `most` pixels.
    fn across(&self, white: &RowRuns, most: f64) -> f64 {
        let straight = across(white, self.middle, self.inwards, most);
        if straight >= most || !self.is_at_turn {
            return straight;
        }
        // Next to a square corner the ray runs along the other side, and must not hit its stairs.
        let [right, down] = self.inwards;
        [TILT, -TILT].into_iter().fold(straight, |widest, tilt| {
            let tilted = [right - tilt * down, down + tilt * right];
            across(white, self.middle, tilted, most).max(widest)
        })
    }
}

/// Returns how far the white goes on from a point in a direction, up to `most` pixels.
fn across(white: &RowRuns, [x, y]: [f64; 2], [right, down]: [f64; 2], most: f64) -> f64 {
    // The mean line may pass through black pixels: one of the next is white.
    let place = |away: &f64| white.place(x + away * right, (y + away * down).floor() as i64, 0);
    let Some((mut away, mut place)) =
        [0.5, 1.0, 1.5].into_iter().find_map(|away| Some((away, place(&away)?)))
    else {
        return 1.0;
    };
    let by = [right, down].map(|slope| (slope.abs() > 1e-9).then(|| 1.0 / slope));
    let to = |way: f64, by: Option<f64>| by.map_or(f64::INFINITY, |by| way * by);
    let mut row = (y + away * down).floor() as i64;
    let (mut next_row, step) = if down > 0.0 { (row + 1, 1) } else { (row, -1) };
    while away < most {
        let Some(here) = white.place(x + away * right, row, place) else { return away };
        place = here;
        // Up to the next row, or the end of the run if that comes first.
        let (start, end) = white.row(row as u32)[here];
        let to_side = to(f64::from(if right > 0.0 { end } else { start }) - x, by[0]);
        let to_next = to(next_row as f64 - y, by[1]);
        if to_side <= to_next {
            return to_side.min(most);
        }
        away = to_next;
        row += step;
        next_row += step;
    }
    most
}

/// Returns the places of an outline at which the size is found; others take the size of their
/// neighbors. A side that cuts a corner by a pixel or two has no direction of its own, and of short
/// sides of a curve one in each step is enough.
fn known(places: &[SidePiece]) -> Vec<bool> {
    let are_short = places.iter().all(|place| place.length < SHORT);
    let mut since = STEP;
    let is_known = |place: &SidePiece| {
        since += place.length;
        let is_known =
            are_short || (place.length >= SHORT && (since >= STEP / 2.0 || place.is_at_turn));
        since = if is_known { 0.0 } else { since };
        is_known
    };
    places.iter().map(is_known).collect()
}

/// Returns the sizes of the feature at the places of an outline, up to `most` pixels.
fn sizes(white: &RowRuns, places: &[SidePiece], bands: &Bands, most: f64) -> Vec<f64> {
    let is_known = known(places);
    let size = |(place, is_known): (&SidePiece, &bool)| {
        if !is_known {
            return (most, 0.0);
        }
        let across = place.across(white, most);
        (across, bands.disc(place, across))
    };
    let (across, discs): (Vec<f64>, Vec<f64>) = places.iter().zip(&is_known).map(size).unzip();
    carried(discs, &across)
}

/// Returns sizes carried on along an outline, as far as each place is so wide `across`.
fn carried(mut sizes: Vec<f64>, across: &[f64]) -> Vec<f64> {
    let count = sizes.len();
    // Twice around, as a size may pass the start.
    for step in 1..2 * count {
        let [from, to] = [(step - 1) % count, step % count];
        sizes[to] = sizes[to].max(sizes[from].min(across[to]));
    }
    for step in (1..2 * count).rev() {
        let [from, to] = [step % count, (step - 1) % count];
        sizes[to] = sizes[to].max(sizes[from].min(across[to]));
    }
    sizes
}

/// Returns distances that change slowly along an outline: halfway between the greatest slow ones
/// that are nowhere greater and the least that are nowhere less.
fn steadied(by: Vec<f64>, places: &[SidePiece]) -> Vec<f64> {
    let (mut low, mut high) = (by.clone(), by);
    let count = places.len();
    let mut pass = |from: usize, to: usize| {
        let change = MAX_CHANGE * (places[from].length + places[to].length) / 2.0;
        low[to] = low[to].min(low[from] + change);
        high[to] = high[to].max(high[from] - change);
    };
    (1..2 * count).for_each(|step| pass((step - 1) % count, step % count));
    (1..2 * count).rev().for_each(|step| pass(step % count, (step - 1) % count));
    low.iter().zip(&high).map(|(low, high)| (low + high) / 2.0).collect()
}

/// Returns the corners of an outline with the distances there, and more corners where the distance
/// changes along a side.
fn corners(places: &[SidePiece], by: &[f64]) -> (Outline, Vec<f64>) {
    let count = places.len();
    let (mut outline, mut at_corners) = (Outline::new(), Vec::new());
    for of in 0..count {
        let before = by[(of + count - 1) % count];
        let here = (before + by[of]) / 2.0;
        let changes = (before - by[of]).abs() > NO_CHANGE
            || at_corners.last().is_some_and(|last: &f64| (last - here).abs() > NO_CHANGE)
            || (by[(of + 1) % count] - by[of]).abs() > NO_CHANGE;
        if places[of].is_first || changes {
            outline.push(places[of].start);
            at_corners.push(here);
        }
    }
    (outline, at_corners)
}

/// The middles of places by bands of rows, each from the left.
struct Bands {
    bands: Vec<Vec<[f64; 2]>>,
}

impl Bands {
    fn new(places: &[Vec<SidePiece>], height: u32) -> Self {
        let mut bands = vec![Vec::new(); (f64::from(height) / BAND) as usize + 1];
        for place in places.iter().flatten() {
            let band = Self::band(place.middle[1], bands.len());
            bands[band].push(place.middle);
        }
        bands.iter_mut().for_each(|band| band.sort_by(|a, b| a[0].total_cmp(&b[0])));
        Self { bands }
    }

    fn band(row: f64, count: usize) -> usize {
        ((row / BAND).max(0.0) as usize).min(count - 1)
    }

    /// Returns the diameter of the largest disc inside the shape that touches a place, up to
    /// `most` pixels.
    fn disc(&self, place: &SidePiece, most: f64) -> f64 {
        let [x, y] = place.middle;
        let [right, down] = place.inwards;
        let mut size = most;
        let own = Self::band(y, self.bands.len());
        let look = |band: usize, size: &mut f64| {
            let band = &self.bands[band];
            let first = band.partition_point(|at| at[0] < x + (right - 1.0) * *size / 2.0);
            for at in &band[first..] {
                if at[0] > x + (right + 1.0) * *size / 2.0 {
                    break;
                }
                let [across, along] = [at[0] - x, at[1] - y];
                let depth = across * right + along * down;
                // A disc that touches the place and passes through a point p at this depth has
                // diameter |p|² / depth.
                if depth > ROUGHNESS {
                    *size = size.min((across * across + along * along) / depth);
                }
            }
        };
        look(own, &mut size);
        // The nearest bands first, as what they show spares others.
        for away in 1.. {
            let middle = y + down * size / 2.0;
            let [first, last] = [middle - size / 2.0, middle + size / 2.0]
                .map(|row| Self::band(row, self.bands.len()));
            let [up, below] = [own.checked_sub(away), Some(own + away)]
                .map(|band| band.filter(|band| (first..=last).contains(band)));
            up.into_iter().chain(below).for_each(|band| look(band, &mut size));
            if up.is_none() && below.is_none() {
                return size;
            }
        }
        size
    }
}
