//! Distances of pixels from the nearest point of an outline.
//!
//! A side of an outline is nearest only to pixels straight above it, and a corner only to pixels in
//! the wedge between its two sides: both are filled row by row (closest point transform, Mauch
//! 2000). So each pixel near an edge is visited about once, however far edges move.
//!
//! Where edges move further along one axis, outlines come stretched along the other, so that the
//! ellipse of the moves is a disc: pixels are rectangles there.

use super::edge_map::{Cut, EdgeMap, NearestPlace};
use super::outline::Outline;
use super::row_runs::Run;

/// How far beyond the outline pixels may lie, in sides of pixels: their color and the mean line
/// disagree by less.
const BEYOND: f64 = 1.5;
/// Up to this length in pixels a side may stand for the wedge beyond its end.
const MAX_SLACK: f64 = 0.5;
/// A column beyond all images.
const MAX_COLUMN: f64 = (1 << 28) as f64;
/// Room for rounding where sides and wedges meet, in pixels.
const SLACK: f64 = 1e-6;

/// Which pixels are measured, and how far from outlines.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeasuredPixels {
    /// Whether the measured pixels lie on the right of outlines.
    pub(super) is_right: bool,
    /// The greatest distance in pixels.
    pub(super) reach: f64,
    /// The width and the height of a pixel in the outlines' unit: 1 or more.
    pub(super) pixel: [f64; 2],
}

impl MeasuredPixels {
    /// Returns how far beyond the outline pixels may lie.
    fn beyond(&self) -> f64 {
        BEYOND * greater(self.pixel[0], self.pixel[1])
    }
}

/// Measures the pixels of a map from outlines, at each corner of which edges move by `by` pixels,
/// by outline and corner.
pub(super) fn measure(
    map: &mut EdgeMap,
    outlines: &[Outline],
    by: impl Fn(usize, usize) -> f64,
    measured: MeasuredPixels,
) {
    for_each_piece(outlines, by, measured, |piece| match piece {
        OutlinePiece::Side(side, slack) => side.measure(map, measured, slack),
        OutlinePiece::Corner(before, after) => measure_corner(map, before, after, measured),
    });
}

/// Calls `each` with the columns of rows that are measured from outlines, in any order.
pub(super) fn for_each_measured(
    outlines: &[Outline],
    measured: MeasuredPixels,
    height: u32,
    mut each: impl FnMut(u32, Run),
) {
    let mut show = |row: u32, _down: f64, columns: Run| each(row, columns);
    for_each_piece(
        outlines,
        |_, _| 0.0,
        measured,
        |piece| match piece {
            OutlinePiece::Side(side, slack) => {
                side.for_each_row(measured, slack, height, &mut show);
            }
            OutlinePiece::Corner(before, after) => {
                for_each_row_at_corner(before, after, measured, height, &mut show);
            }
        },
    );
}

/// A piece of an outline to which pixels may be nearest.
enum OutlinePiece<'a> {
    /// A side, and by how much it is longer at its ends.
    Side(&'a Side, [f64; 2]),
    /// The corner between two sides.
    Corner(&'a Side, &'a Side),
}

fn for_each_piece(
    outlines: &[Outline],
    by: impl Fn(usize, usize) -> f64,
    measured: MeasuredPixels,
    mut each: impl FnMut(OutlinePiece<'_>),
) {
    for (of, outline) in outlines.iter().enumerate() {
        let count = outline.len();
        let side = |corner: usize| {
            let next = (corner + 1) % count;
            Side::new([outline[corner], outline[next]], [by(of, corner), by(of, next)])
        };
        let Some(last) = count.checked_sub(1) else { continue };
        let (mut before, mut here) = (side(last), side(0));
        let mut turned = CornerTurn::between(&before, &here, measured.reach);
        for corner in 0..count {
            let next = side((corner + 1) % count);
            let turns = CornerTurn::between(&here, &next, measured.reach);
            each(OutlinePiece::Side(&here, [turned, turns].map(|turn| turn.slack(measured))));
            if turned == CornerTurn::Corner {
                each(OutlinePiece::Corner(&before, &here));
            }
            (before, here, turned) = (here, next, turns);
        }
    }
}

/// How an outline turns from a side to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
enum CornerTurn {
    /// By so little, of this sine, that both sides may stand for the wedge between them.
    Smooth(f64),
    Corner,
}

impl CornerTurn {
    fn between(before: &Side, after: &Side, reach: f64) -> Self {
        let [a, b] = [before.along, after.along];
        let sine = a[0] * b[1] - a[1] * b[0];
        let goes_on = a[0] * b[0] + a[1] * b[1] > 0.0;
        // At the distance `reach`, two sides are this far apart.
        if goes_on && sine.abs() * reach < MAX_SLACK {
            Self::Smooth(sine.abs())
        } else {
            Self::Corner
        }
    }

    /// By how much the sides are longer, so that no pixel lies between them.
    fn slack(self, measured: MeasuredPixels) -> f64 {
        match self {
            // Half of the wedge for each side, and a little for rounding.
            Self::Smooth(sine) => SLACK + 0.51 * sine * measured.reach.max(measured.beyond()),
            Self::Corner => SLACK,
        }
    }
}

/// A side of an outline.
#[derive(Clone, Copy, Debug)]
struct Side {
    start: [f64; 2],
    along: [f64; 2],
    length: f64,
    /// The distances that edges move at its ends.
    by: [f64; 2],
}

impl Side {
    fn new([start, end]: [[f64; 2]; 2], by: [f64; 2]) -> Self {
        let [x, y] = [end[0] - start[0], end[1] - start[1]];
        let length = x.hypot(y);
        Self { start, along: [x / length, y / length], length, by }
    }

    /// Returns the direction to the measured pixels.
    fn inwards(&self, measured: MeasuredPixels) -> [f64; 2] {
        let [x, y] = self.along;
        // Rows count down, so the right of (x, y) is (-y, x).
        if measured.is_right { [-y, x] } else { [y, -x] }
    }

    /// Calls `each` with the rows of pixels straight above the side: the row, the distance of its
    /// middle below the side's start, and the columns. At its ends there is room for turns.
    #[inline]
    fn for_each_row(
        &self,
        measured: MeasuredPixels,
        slack: [f64; 2],
        height: u32,
        mut each: impl FnMut(u32, f64, Run),
    ) {
        let MeasuredPixels { reach, pixel, .. } = measured;
        let beyond = measured.beyond();
        let inwards = self.inwards(measured);
        let ends = [-slack[0], self.length + slack[1]];
        let corners = [(ends[0], -beyond), (ends[1], -beyond), (ends[0], reach), (ends[1], reach)];
        let rows =
            corners.map(|(along, away)| self.start[1] + along * self.along[1] + away * inwards[1]);
        let along = PixelStrip::new(self.along, ends);
        let across = PixelStrip::new(inwards, [-beyond, reach]);
        for row in rows_between(rows, pixel[1], height) {
            let down = (f64::from(row) + 0.5) * pixel[1] - self.start[1];
            let columns = along.in_row(down).and(across.in_row(down));
            each(row, down, columns.pixels(self.start[0], pixel[0]));
        }
    }

    /// Measures the pixels straight above the side.
    fn measure(&self, map: &mut EdgeMap, measured: MeasuredPixels, slack: [f64; 2]) {
        let pixel = measured.pixel;
        let [x, y] = self.along;
        let inwards = self.inwards(measured);
        let slope = (self.by[1] - self.by[0]) / self.length;
        let cut = Cut::new(inwards, pixel);
        let mut place = 0;
        self.for_each_row(measured, slack, map.height(), |row, down, columns| {
            map.for_each_near(row, columns, &mut place, |column, near, level| {
                let right = (f64::from(column) + 0.5) * pixel[0] - self.start[0];
                let distance = right * inwards[0] + down * inwards[1];
                // Compared as it is stored: in f64, a tie with the side before could look nearer.
                if (distance as f32).abs() < near.distance.abs() {
                    let by = self.by[0] + slope * (right * x + down * y);
                    *near = NearestPlace { distance: distance as f32, by: by as f32 };
                    *level = cut.level(*near);
                }
            });
        });
    }
}

/// Returns the radius of the wedge between two sides whose pixels are measured, and the sign of
/// their distances.
fn wedge(before: &Side, after: &Side, measured: MeasuredPixels) -> (f64, f64) {
    let turn = before.along[0] * after.along[1] - before.along[1] * after.along[0];
    // A wedge beyond a corner that juts out of the measured pixels holds few of them.
    let juts_out = (turn > 0.0) == measured.is_right;
    if juts_out { (measured.beyond(), -1.0) } else { (measured.reach, 1.0) }
}

/// Calls `each` with the rows of pixels in the wedge between two sides: the row, the distance of its
/// middle below the corner, and the columns.
#[inline]
fn for_each_row_at_corner(
    before: &Side,
    after: &Side,
    measured: MeasuredPixels,
    height: u32,
    mut each: impl FnMut(u32, f64, Run),
) {
    let pixel = measured.pixel;
    let (radius, _) = wedge(before, after, measured);
    let past_before = PixelStrip::new(before.along, [-SLACK, f64::INFINITY]);
    let short_of_after = PixelStrip::new(after.along, [f64::NEG_INFINITY, SLACK]);
    let [x, y] = after.start;
    for row in rows_between([y - radius, y + radius, y, y], pixel[1], height) {
        let down = (f64::from(row) + 0.5) * pixel[1] - y;
        let half = (radius * radius - down * down).max(0.0).sqrt();
        let wedge = past_before.in_row(down).and(short_of_after.in_row(down));
        each(row, down, wedge.and(Interval { low: -half, high: half }).pixels(x, pixel[0]));
    }
}

/// Measures the pixels in the wedge between two sides.
fn measure_corner(map: &mut EdgeMap, before: &Side, after: &Side, measured: MeasuredPixels) {
    let pixel = measured.pixel;
    let (_, sign) = wedge(before, after, measured);
    let mut place = 0;
    for_each_row_at_corner(before, after, measured, map.height(), |row, down, columns| {
        map.for_each_near(row, columns, &mut place, |column, near, level| {
            let right = (f64::from(column) + 0.5) * pixel[0] - after.start[0];
            let distance = right.hypot(down);
            // Straight above a side, the side knows better on which side of it a pixel is.
            if distance + 4.0 * SLACK < f64::from(near.distance.abs()) {
                *near = NearestPlace { distance: (sign * distance) as f32, by: after.by[0] as f32 };
                *level = Cut::new([right / distance, down / distance], pixel).level(*near);
            }
        });
    });
}

/// Returns the rows, each `pixel` high, whose middles lie between the least and the greatest of
/// places.
fn rows_between(places: [f64; 4], pixel: f64, height: u32) -> std::ops::Range<u32> {
    let least = places.into_iter().fold(f64::INFINITY, f64::min) / pixel;
    let greatest = places.into_iter().fold(f64::NEG_INFINITY, f64::max) / pixel;
    let row = |place: f64| (place.max(0.0) as u32).min(height);
    row((least - 0.5).ceil())..row((greatest + 0.5).floor())
}

/// The pixels between two parallel lines, by rows.
struct PixelStrip {
    /// The two places where the lines cross row zero.
    at_zero: [f64; 2],
    /// By how much both go on in each row.
    by_row: f64,
}

/// The least slope of a line across rows: one along a row crosses it far beyond all images.
const LEAST_SLOPE: f64 = 1e-12;

impl PixelStrip {
    /// Takes the places whose products with a direction lie between two bounds.
    fn new([right, down]: [f64; 2], bounds: [f64; 2]) -> Self {
        let slope = if right.abs() < LEAST_SLOPE { LEAST_SLOPE } else { right };
        let [a, b] = bounds.map(|bound| bound / slope);
        Self { at_zero: [a.min(b), a.max(b)], by_row: -down / slope }
    }

    /// Returns the places along a row.
    fn in_row(&self, down: f64) -> Interval {
        let [low, high] = self.at_zero.map(|place| place + down * self.by_row);
        Interval { low, high }
    }
}

/// Places along a row, from a point on.
#[derive(Clone, Copy)]
struct Interval {
    low: f64,
    high: f64,
}

impl Interval {
    /// Returns the places in both.
    fn and(self, other: Self) -> Self {
        Self { low: greater(self.low, other.low), high: lesser(self.high, other.high) }
    }

    /// Returns the columns of the pixels, each `pixel` wide, with their middles there, of places
    /// from a place on.
    fn pixels(self, from: f64, pixel: f64) -> (i32, i32) {
        // Clamped to what images have, so that rounding needs no more than a comparison.
        let [low, high] = [(self.low + from) / pixel - 0.5, (self.high + from) / pixel + 0.5]
            .map(|at| lesser(greater(at, 0.0), MAX_COLUMN));
        let start = low as i32;
        (start + i32::from(f64::from(start) < low), high as i32)
    }
}

/// Returns the greater of two numbers, in one instruction as neither is NaN.
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Returns the lesser of two numbers, in one instruction as neither is NaN.
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
