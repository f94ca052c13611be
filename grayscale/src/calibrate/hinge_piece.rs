//! The hinges whose onsets lie between the same two points.

/// Onsets between two neighboring x. All points from the upper one on are on the line, which their
/// sums determine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HingePiece {
    /// The lowest onset; ranges use only onsets of zero or more.
    pub(super) from: f64,
    /// The highest onset.
    to: f64,
    /// The points on the line.
    count: f64,
    mean_x: f64,
    mean_y: f64,
    /// The sum of squared distances of their x from the mean, and of the products with y.
    xx: f64,
    xy: f64,
    /// The squares that the best line through them leaves, plus the squares of the points before.
    left: f64,
}

/// The best hinge of a piece.
pub(super) struct BestHinge {
    pub(super) onset: f64,
    pub(super) slope: f64,
    pub(super) squares: f64,
}

/// Returns the pieces of points, from the lowest onset.
pub(super) fn pieces(mut points: Vec<(f64, f64)>) -> Vec<HingePiece> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut pieces: Vec<HingePiece> = Vec::new();
    let (mut count, mut mean_x, mut mean_y) = (0.0, 0.0, 0.0);
    let (mut xx, mut xy, mut yy): (f64, f64, f64) = (0.0, 0.0, 0.0);
    let groups: Vec<&[(f64, f64)]> = points.chunk_by(|a, b| a.0 == b.0).collect();
    let squares = |group: &&[(f64, f64)]| group.iter().map(|point| point.1 * point.1).sum::<f64>();
    let sum = |sum: &mut f64, squares: f64| Some(std::mem::replace(sum, *sum + squares));
    let before: Vec<f64> = groups.iter().map(squares).scan(0.0, sum).collect();
    for (index, group) in groups.iter().enumerate().rev() {
        for &(x, y) in *group {
            count += 1.0;
            let (dx, dy) = (x - mean_x, y - mean_y);
            mean_x += dx / count;
            mean_y += dy / count;
            xx += dx * (x - mean_x);
            xy += dx * (y - mean_y);
            yy += dy * (y - mean_y);
        }
        let explained = if xx > 0.0 { xy * xy / xx } else { 0.0 };
        let from = index.checked_sub(1).map_or(f64::NEG_INFINITY, |below| groups[below][0].0);
        let to = group[0].0;
        let left = (yy - explained).max(0.0) + before[index];
        pieces.push(HingePiece { from, to, count, mean_x, mean_y, xx, xy, left });
    }
    pieces.reverse();
    pieces
}

impl HingePiece {
    /// Returns the slope of the line that fits best, without regard to the onset.
    fn line(&self) -> f64 {
        if self.xx > 0.0 { self.xy / self.xx } else { 0.0 }
    }

    /// Returns the distance of the points' mean from an onset.
    fn reach(&self, onset: f64) -> f64 {
        self.mean_x - onset
    }

    /// Returns the best slope from an onset at this distance from the mean, and by how much its
    /// squares exceed the line's squares.
    fn best_at_reach(&self, reach: f64) -> (f64, f64) {
        let Self { count, mean_y, xx, .. } = *self;
        let (line, stiffness) = (self.line(), count * reach * reach + xx);
        let slope = (count * reach * mean_y + xx * line) / stiffness;
        if slope > 0.0 {
            (slope, count * xx * (mean_y - reach * line).powi(2) / stiffness)
        } else {
            (0.0, count * mean_y * mean_y + xx * line * line)
        }
    }

    /// Returns the best hinge, if one rises.
    pub(super) fn best(&self) -> Option<BestHinge> {
        let line = self.line();
        let crossing = self.mean_x - self.mean_y / line;
        if line > 0.0 && self.from <= crossing && crossing <= self.to {
            return Some(BestHinge { onset: crossing, slope: line, squares: self.left });
        }
        let ends = [self.from, self.to].into_iter().filter(|end| end.is_finite());
        let hinge = |onset| {
            let (slope, more) = self.best_at_reach(self.reach(onset));
            BestHinge { onset, slope, squares: self.left + more }
        };
        let rising = ends.map(hinge).filter(|best| best.slope > 0.0);
        rising.min_by(|a, b| a.squares.total_cmp(&b.squares))
    }

    /// Returns by how much a hinge's squares may exceed the line's.
    fn slack(&self, limit: f64) -> Option<f64> {
        (self.left <= limit).then_some(limit - self.left)
    }

    /// Returns the lowest onset of no less than zero.
    fn least(&self) -> f64 {
        self.from.max(0.0)
    }

    /// Returns the lowest and the highest onset whose squares are within the limit.
    pub(super) fn onsets(&self, limit: f64) -> Option<[f64; 2]> {
        let slack = self.slack(limit)?;
        let Self { count, mean_y, xx, .. } = *self;
        let line = self.line();
        let ends = [self.least(), self.to].map(|onset| self.reach(onset));
        let fits = |reach: &f64| self.best_at_reach(*reach).1 <= slack;
        // count xx (mean_y - reach line)² = slack (count reach² + xx)
        let square = count * (xx * line * line - slack);
        let middle = count * xx * mean_y * line;
        let rest = xx * (count * mean_y * mean_y - slack);
        let root = (middle * middle - square * rest).max(0.0).sqrt();
        let roots = [(middle - root) / square, (middle + root) / square];
        let inside = |reach: &f64| {
            ends[1] <= *reach && *reach <= ends[0] && self.best_at_reach(*reach).0 > 0.0
        };
        let roots = roots.into_iter().filter(inside);
        extent(ends.into_iter().filter(fits).chain(roots).map(|reach| self.mean_x - reach))
    }

    /// Returns the least and the greatest slope of hinges within the limit.
    pub(super) fn slopes(&self, limit: f64) -> Option<[f64; 2]> {
        self.extremes(limit, 0.0, 1.0)
    }

    /// Returns the least and the greatest height at an x of the lines of hinges within the limit.
    pub(super) fn heights(&self, x: f64, limit: f64) -> Option<[f64; 2]> {
        self.extremes(limit, 1.0, x - self.mean_x)
    }

    /// Returns the least and the greatest of `by_mean` times the height at the mean and `by_slope`
    /// times the slope. Hinges within the limit are an ellipse over the two, cut by the two lines
    /// of the lowest and the highest onset.
    fn extremes(&self, limit: f64, by_mean: f64, by_slope: f64) -> Option<[f64; 2]> {
        let slack = self.slack(limit)?;
        let Self { count, mean_y, xx, .. } = *self;
        let line = self.line();
        let [far, near] = [self.least(), self.to].map(|onset| self.reach(onset));
        let mut found = Vec::new();
        if xx > 0.0 {
            let lean = by_mean * by_mean / count + by_slope * by_slope / xx;
            let step = (slack / lean).sqrt();
            for step in [-step, step] {
                let mean = mean_y + step * by_mean / count;
                let slope = line + step * by_slope / xx;
                if slope >= 0.0 && near * slope <= mean && mean <= far * slope {
                    found.push(by_mean * mean + by_slope * slope);
                }
            }
        } else if by_slope > 0.0 {
            // One x: the nearer the onset is to it, the steeper is the slope.
            found.push(f64::INFINITY);
        }
        for reach in [near, far] {
            let (slope, more) = self.best_at_reach(reach);
            let stiffness = count * reach * reach + xx;
            if more <= slack && stiffness > 0.0 {
                let half = ((slack - more) / stiffness).sqrt();
                let slopes = [(slope - half).max(0.0), slope + half];
                found.extend(slopes.map(|slope| slope * (by_mean * reach + by_slope)));
            }
        }
        extent(found.into_iter())
    }

    /// Returns the piece of points whose x and y are multiplied by these factors.
    pub(super) fn times(self, x: f64, y: f64) -> Self {
        Self {
            from: self.from * x,
            to: self.to * x,
            count: self.count,
            mean_x: self.mean_x * x,
            mean_y: self.mean_y * y,
            xx: self.xx * x * x,
            xy: self.xy * x * y,
            left: self.left * y * y,
        }
    }
}

/// Returns the least and the greatest number, if there is one.
fn extent(numbers: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let finite = numbers.filter(|number| !number.is_nan());
    finite.fold(None, |extent, number| match extent {
        None => Some([number; 2]),
        Some([low, high]) => Some([low.min(number), high.max(number)]),
    })
}
