//! Sums what a layer lacks and has too much, for all tops it may have at once.
//!
//! Along a row, a facet is a line from one x and height to another. As a layer's
//! top rises past this line, it changes what the layer lacks and has too much by a
//! polynomial of the top's height; once the top is above all of the line, the change
//! stays. So a line adds its polynomial at the first top above its lower end, and
//! takes it away again at the first above its upper end. The cost of a line does not
//! depend on the number of tops.

use lamp_slicer::scan::count_at_or_below;

/// From this many tops between a line's ends on, a polynomial is cheaper than one
/// sum for each top. Between closer ends it would also suffer from rounding, as it
/// divides by their distance.
const MANY_TOPS: usize = 6;

/// A change as a layer's top rises past lines: of the section's width in millimetres,
/// and of areas along the row, in millimetres times micrometres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ProfileChange {
    pub(crate) width: f64,
    pub(crate) lost: f64,
    pub(crate) gained: f64,
}

impl ProfileChange {
    pub(crate) fn add(&mut self, other: Self) {
        self.width += other.width;
        self.lost += other.lost;
        self.gained += other.gained;
    }
}

/// A facet's line along a row. Along it, the heights lost and gained once tops are
/// past it go evenly from one end to the other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceLine {
    pub(crate) heights: [f64; 2],
    /// The extent along x; below zero if the part lies below the line.
    pub(crate) width: f64,
    pub(crate) lost: [f64; 2],
    pub(crate) gained: [f64; 2],
}

impl SurfaceLine {
    fn rising(self) -> Self {
        if self.heights[0] <= self.heights[1] {
            return self;
        }
        let turned = |[a, b]: [f64; 2]| [b, a];
        Self {
            heights: turned(self.heights),
            lost: turned(self.lost),
            gained: turned(self.gained),
            ..self
        }
    }

    /// Returns the change once a share of the line is passed.
    #[inline]
    fn passed(&self, share: f64) -> ProfileChange {
        let dx = self.width.abs();
        let area = |[a, b]: [f64; 2]| dx * share * (a + 0.5 * (b - a) * share);
        ProfileChange {
            width: self.width * share,
            lost: area(self.lost),
            gained: area(self.gained),
        }
    }
}

/// Coefficients of powers of the top's height.
type Polynomial = [f64; 3];

#[derive(Clone, Copy, Debug, Default)]
struct Polynomials {
    width: [f64; 2],
    lost: Polynomial,
    gained: Polynomial,
}

impl Polynomials {
    fn of(line: &SurfaceLine) -> Self {
        let [low, high] = line.heights;
        let slope = 1.0 / (high - low);
        let start = -low * slope;
        let dx = line.width.abs();
        let area = |[a, b]: [f64; 2]| {
            let half = 0.5 * (b - a);
            [
                dx * start * (a + half * start),
                dx * slope * (a + 2.0 * half * start),
                dx * slope * slope * half,
            ]
        };
        Self {
            width: [line.width * start, line.width * slope],
            lost: area(line.lost),
            gained: area(line.gained),
        }
    }

    fn constant(change: ProfileChange) -> Self {
        Self {
            width: [change.width, 0.0],
            lost: [change.lost, 0.0, 0.0],
            gained: [change.gained, 0.0, 0.0],
        }
    }

    fn add(&mut self, other: &Self, factor: f64) {
        let add = |to: &mut [f64], from: &[f64]| {
            to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
        };
        add(&mut self.width, &other.width);
        add(&mut self.lost, &other.lost);
        add(&mut self.gained, &other.gained);
    }

    fn at(&self, top: f64) -> ProfileChange {
        let area = |p: &Polynomial| p[0] + top * (p[1] + top * p[2]);
        ProfileChange {
            width: self.width[0] + top * self.width[1],
            lost: area(&self.lost),
            gained: area(&self.gained),
        }
    }
}

/// Changes by top, over many lines.
#[derive(Debug)]
pub(crate) struct Profile<'a> {
    /// Tops above the layer's bottom, in micrometres, rising.
    tops: &'a [f64],
    /// About how many tops lie in a micrometre.
    per_um: f64,
    /// The polynomials that begin at each top, and hold from there on.
    starts: Vec<Polynomials>,
    /// The changes at single tops.
    alone: Vec<ProfileChange>,
    /// The section's width at the bottom.
    pub(crate) bottom_width: f64,
    /// The least error, below the last top, of any layer up to this top or higher.
    pub(crate) unavoidable: f64,
}

impl<'a> Profile<'a> {
    pub(crate) fn new(tops: &'a [f64]) -> Self {
        let span = tops[tops.len() - 1] - tops[0];
        Self {
            tops,
            per_um: if span > 0.0 { (tops.len() - 1) as f64 / span } else { 0.0 },
            starts: vec![Polynomials::default(); tops.len() + 1],
            alone: vec![ProfileChange::default(); tops.len()],
            bottom_width: 0.0,
            unavoidable: 0.0,
        }
    }

    /// Returns the first top above a height.
    #[inline]
    pub(crate) fn first_above(&self, height: f64) -> usize {
        count_at_or_below(self.tops, height, (height - self.tops[0]) * self.per_um)
    }

    pub(crate) fn add(&mut self, line: SurfaceLine) {
        let line = line.rising();
        let [low, high] = line.heights;
        let (first, end) = (self.first_above(low), self.first_above(high));
        if end - first < MANY_TOPS {
            for top in first..end {
                let passed = (self.tops[top] - low) / (high - low);
                self.alone[top].add(line.passed(passed));
            }
        } else {
            let polynomials = Polynomials::of(&line);
            self.starts[first].add(&polynomials, 1.0);
            self.starts[end].add(&polynomials, -1.0);
        }
        self.starts[end].add(&Polynomials::constant(line.passed(1.0)), 1.0);
    }

    /// Adds the unavoidable error of columns. `within` is the height inside at the
    /// first and the last of them, less the top if they end inside.
    pub(crate) fn add_unavoidable(&mut self, width: f64, within: [f64; 2], ends_inside: bool) {
        let last = self.tops[self.tops.len() - 1];
        let lesser = within.map(|within| {
            let within = if ends_inside { last + within } else { within };
            within.min(last - within).max(0.0)
        });
        // Between the ends the true one is no less: a minimum of lines is concave.
        self.unavoidable += width * 0.5 * (lesser[0] + lesser[1]);
    }

    /// Returns the changes from the layer's bottom to each top.
    pub(crate) fn changes(&self) -> Vec<ProfileChange> {
        let mut sum = Polynomials::default();
        let changes = self.tops.iter().enumerate().map(|(k, &top)| {
            sum.add(&self.starts[k], 1.0);
            let mut change = sum.at(top);
            change.add(self.alone[k]);
            change
        });
        changes.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_the_tops_one_by_one() {
        let tops: Vec<f64> = (25..=100).map(f64::from).collect();
        let mut profile = Profile::new(&tops);
        let line =
            |heights, width| SurfaceLine { heights, width, lost: [3.0, 40.0], gained: [1.5, -0.5] };
        let lines = [
            line([-5.0, 90.0], 0.3),
            line([99.5, 10.0], -0.7),
            line([60.2, 60.3], 0.1),
            line([50.0, 50.0], 2.0),
            line([97.0, 130.0], 0.2),
            line([0.0, 20.0], -0.4),
        ];
        lines.iter().for_each(|&line| profile.add(line));
        for (k, change) in profile.changes().iter().enumerate() {
            let mut expected = ProfileChange::default();
            for line in lines.map(SurfaceLine::rising) {
                let [low, high] = line.heights;
                let passed = if tops[k] <= low {
                    0.0
                } else if tops[k] > high {
                    1.0
                } else {
                    (tops[k] - low) / (high - low)
                };
                expected.add(line.passed(passed));
            }
            assert!((change.width - expected.width).abs() < 1e-12, "{k}");
            assert!((change.lost - expected.lost).abs() < 1e-10, "{k}");
            assert!((change.gained - expected.gained).abs() < 1e-10, "{k}");
        }
    }

    /// A flat face at a top is not in the layer below it: the section there is
    /// taken just under the face.
    #[test]
    fn a_flat_line_counts_above_its_height() {
        let tops = [10.0, 20.0, 30.0];
        let mut profile = Profile::new(&tops);
        profile.add(SurfaceLine {
            heights: [20.0; 2],
            width: 2.0,
            lost: [0.0; 2],
            gained: [20.0; 2],
        });
        let gained: Vec<f64> = profile.changes().iter().map(|change| change.gained).collect();
        assert_eq!(gained, [0.0, 0.0, 40.0]);
    }
}
