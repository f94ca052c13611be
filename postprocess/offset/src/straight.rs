//! Stairs that a straight edge may have left, and their mean lines.
//!
//! Pixels are white if their centers are inside, so a straight edge leaves a path whose corners lie
//! between two parallel lines: a standard digital line. Such lines are recognized corner by corner
//! (Debled-Rennesson and Reveilles 1995), each as long as possible. The true edge lies at the
//! middle of the stair's treads, or risers where it is steep: rounding to whole pixels errs to both
//! sides alike. So their line of least squares has the stair's own area.

use super::contours::{Contour, Direction};

/// The greatest length of a part in pixels, so that sums of squares stay within numbers.
const MAX_LENGTH: i64 = 1 << 20;

/// A stretch of a contour that a straight edge may have left.
#[derive(Clone, Copy, Debug)]
pub(super) struct StraightPart {
    /// A point of the mean line.
    pub(super) point: [f64; 2],
    /// The direction of the mean line, of length one.
    pub(super) along: [f64; 2],
    /// The corner of pixels where the part starts.
    pub(super) start: [f64; 2],
    /// The corner of pixels where it ends.
    pub(super) end: [f64; 2],
}

/// Makes `out` the straight parts of a contour, in order.
pub(super) fn straight_parts(contour: &Contour, out: &mut Vec<StraightPart>) {
    out.clear();
    let mut at = contour.start;
    let mut part: Option<OpenPart> = None;
    for &(direction, length) in &contour.moves {
        let mut left = length;
        while left > 0 {
            let open = part.get_or_insert_with(|| OpenPart::new(at, direction));
            let taken = open.take(direction, left);
            if taken == 0 {
                out.push(open.finish(at));
                part = None;
            }
            at = (at.0 + direction.0 * taken as i32, at.1 + direction.1 * taken as i32);
            left -= taken;
        }
    }
    out.extend(part.map(|part| part.finish(at)));
}

/// A part that may go on: the digital line `low <= a x - b y < low + a + b` that it lies on, by
/// steps `x` in the direction of the first and `y` across.
struct OpenPart {
    start: (i32, i32),
    first: Direction,
    second: Option<Direction>,
    at: [i64; 2],
    a: i64,
    b: i64,
    low: i64,
    /// The first and last corners where `a x - b y` is least, and where it is greatest.
    least: [[i64; 2]; 2],
    greatest: [[i64; 2]; 2],
    treads: LineMoments,
    risers: LineMoments,
}

/// Sums over the middles of treads, or of risers: half-pixels along, pixels across.
#[derive(Clone, Copy, Default)]
struct LineMoments {
    count: i64,
    along: i64,
    across: i64,
    along_squared: i64,
    along_across: i64,
}

impl LineMoments {
    fn add(&mut self, at: [i64; 2]) {
        let half = 2 * at[0] + 1;
        self.count += 1;
        self.along += half;
        self.across += at[1];
        self.along_squared += half * half;
        self.along_across += half * at[1];
    }

    /// Returns the middle, (along, across), and the slope of the line of least squares.
    fn line(&self) -> ([f64; 2], f64) {
        let count = self.count as f64;
        // The sum of squares stays below 2^62 and the count below 2^21: products need 128 bits.
        let spread =
            i128::from(self.count) * i128::from(self.along_squared) - i128::from(self.along).pow(2);
        let joint = i128::from(self.count) * i128::from(self.along_across)
            - i128::from(self.along) * i128::from(self.across);
        // Twice, because `along` counts half-pixels. A single tread has no slope.
        let slope = if spread > 0 { 2.0 * joint as f64 / spread as f64 } else { 0.0 };
        ([self.along as f64 / count / 2.0, self.across as f64 / count], slope)
    }
}

impl OpenPart {
    fn new(start: (i32, i32), first: Direction) -> Self {
        let [least, greatest] = [[[0; 2]; 2]; 2];
        let [treads, risers] = [LineMoments::default(); 2];
        let (at, a, b, low) = ([0; 2], 0, 1, 0);
        Self { start, first, second: None, at, a, b, low, least, greatest, treads, risers }
    }

    /// Goes up to `length` pixels in a direction, as far as that stays straight. Returns how far.
    fn take(&mut self, direction: Direction, length: u32) -> u32 {
        let is_first = direction == self.first;
        if !is_first {
            // A digital line goes in two directions only, at a right angle.
            let is_across = direction.0 * self.first.0 + direction.1 * self.first.1 == 0;
            if !is_across || self.second.is_some_and(|second| second != direction) {
                return 0;
            }
        }
        for taken in 0..length {
            let from = self.at;
            let to = if is_first { [from[0] + 1, from[1]] } else { [from[0], from[1] + 1] };
            if !self.goes_on_to(to) {
                return taken;
            }
            self.at = to;
            if is_first {
                self.treads.add(from);
            } else {
                self.second = Some(direction);
                self.risers.add([from[1], from[0]]);
            }
        }
        length
    }

    /// Returns whether the part stays a digital line with a corner more, and makes it that line.
    fn goes_on_to(&mut self, [x, y]: [i64; 2]) -> bool {
        if x + y > MAX_LENGTH {
            return false;
        }
        // A corner just beyond the line, at -1 or `width`, makes it steeper or flatter, so that it
        // lies on its border. One farther away is on no digital line with the others.
        let place = self.a * x - self.b * y - self.low;
        let width = self.a + self.b;
        if place == -1 {
            self.greatest[0] = self.greatest[1];
            self.least[1] = [x, y];
            (self.a, self.b) = (y - self.least[0][1], x - self.least[0][0]);
            self.low = self.a * x - self.b * y;
        } else if place == width {
            self.least[0] = self.least[1];
            self.greatest[1] = [x, y];
            (self.a, self.b) = (y - self.greatest[0][1], x - self.greatest[0][0]);
            // This corner has the greatest value, low + a + b - 1.
            self.low = self.a * x - self.b * y - self.a - self.b + 1;
        } else if (0..width).contains(&place) {
            if place == 0 {
                self.least[1] = [x, y];
            }
            if place == width - 1 {
                self.greatest[1] = [x, y];
            }
        } else {
            return false;
        }
        true
    }

    fn finish(&self, end: (i32, i32)) -> StraightPart {
        let [x, y] = [self.first, self.second.unwrap_or_default()]
            .map(|(column, row)| [f64::from(column), f64::from(row)]);
        let (point, along) = if self.treads.count >= self.risers.count {
            let (point, slope) = self.treads.line();
            (point, [1.0, slope])
        } else {
            let (point, slope) = self.risers.line();
            ([point[1], point[0]], [slope, 1.0])
        };
        let length = along[0].hypot(along[1]);
        let turned = |v: [f64; 2]| [0, 1].map(|axis| v[0] * x[axis] + v[1] * y[axis]);
        let [from_start, along] = [turned(point), turned(along.map(|v| v / length))];
        let [column, row] = [self.start.0, self.start.1].map(f64::from);
        StraightPart {
            point: [column + from_start[0], row + from_start[1]],
            along,
            start: [column, row],
            end: [f64::from(end.0), f64::from(end.1)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_edge_is_of_several_parts_on_one_line() {
        let length = 3_000_000;
        let moves = vec![((1, 0), length), ((0, 1), 1), ((-1, 0), length), ((0, -1), 1)];
        let mut parts = Vec::new();
        straight_parts(&Contour { start: (5, 7), moves }, &mut parts);
        let is_upper = |part: &&StraightPart| part.along[0] > 0.0;
        let upper: Vec<_> = parts.iter().filter(is_upper).collect();
        assert_eq!(upper.len(), 3, "{upper:?}");
        assert!(upper.iter().all(|part| part.along == [1.0, 0.0] && part.point[1] == 7.0));
    }
}
