//! Sums what a layer lacks and has too much, for all tops it may have at once.
//!
//! A facet rises from one height to another, and so does its line along a row. As a
//! layer's top rises past it, it changes what the layer lacks and has too much by a
//! polynomial of the top's height; once the top is above all of it, the change
//! stays. So it adds its polynomial at the first top above its lower end, and
//! takes it away again at the first above its upper end. Its cost does not
//! depend on the number of tops.

use lamp_slicing::PLANE_TOLERANCE;
use lamp_slicing::scan::count_at_or_below;

/// From this many tops between a surface's ends on, a polynomial is cheaper than one
/// sum for each top.
const MANY_TOPS: usize = 6;

/// A polynomial divides by the distance of the ends: where that is less than this part of
/// all tops, it would suffer from rounding.
const SMALL_PART: usize = 50;

/// A change as a layer's top rises past lines: of areas in square millimeters, and of volumes in
/// square millimeters times micrometers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ProfileChange {
    /// The change of the section's area.
    pub(crate) area: f64,
    /// The change of the area of all sections up to the top, united or intersected by the part's
    /// side.
    pub(crate) outline: f64,
    pub(crate) lost: f64,
    pub(crate) gained: f64,
}

impl ProfileChange {
    pub(crate) fn add(&mut self, other: Self) {
        self.area += other.area;
        self.outline += other.outline;
        self.lost += other.lost;
        self.gained += other.gained;
    }
}

/// Surfaces that rise by no more are level, however rounding left them. Rows over slopes have as short
/// pieces, which must add what their facets do.
const LEVEL_UM: f64 = 1e-4;

/// A piece of surface. Between its ends, what it changes once tops are past it goes evenly
/// from one value to the other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePiece {
    pub(crate) heights: [f64; 2],
    /// The area that it covers, seen from above, in square millimeters.
    pub(crate) extent: f64,
    /// How dense this area is at its ends, as a share of its mean.
    pub(crate) density: [f64; 2],
    /// How much of it the section gains once the top is past it: less than 0 if the part
    /// lies below.
    pub(crate) section: f64,
    /// The same for all sections up to the top, united or intersected.
    pub(crate) outline: f64,
    /// The heights lost and gained once the top is past its ends.
    pub(crate) lost: [f64; 2],
    pub(crate) gained: [f64; 2],
}

/// The density of a line along a row.
pub(crate) const EVEN: [f64; 2] = [1.0; 2];

/// A polynomial's coefficients, from the first power of its argument on.
type Cubic = [f64; 3];

impl SurfacePiece {
    fn rising(self) -> Self {
        if self.heights[0] <= self.heights[1] {
            return self;
        }
        let turned = |[a, b]: [f64; 2]| [b, a];
        Self {
            heights: turned(self.heights),
            density: turned(self.density),
            lost: turned(self.lost),
            gained: turned(self.gained),
            ..self
        }
    }

    /// Returns the change of a value that goes from `a` to `b`, over the share passed.
    fn integral(&self, [a, b]: [f64; 2]) -> Cubic {
        let ([d, e], dx) = (self.density, self.extent);
        // ∫ (a + rise s)(d + thickening s) dx ds, power by power of the share s.
        let (rise, thickening) = (b - a, e - d);
        [dx * a * d, dx * (a * thickening + rise * d) / 2.0, dx * rise * thickening / 3.0]
    }

    /// Returns what changes the section and the outline, what is lost and what is gained, over the
    /// share passed.
    fn integrals(&self) -> [Cubic; 4] {
        [[self.section; 2], [self.outline; 2], self.lost, self.gained]
            .map(|ends| self.integral(ends))
    }

    /// Returns the change once a share of the surface's heights is passed.
    #[inline]
    fn passed(&self, share: f64) -> ProfileChange {
        let [area, outline, lost, gained] =
            self.integrals().map(|[a, b, c]| share * (a + share * (b + share * c)));
        ProfileChange { area, outline, lost, gained }
    }
}

/// Coefficients of powers of the top's height, from 1 on.
type Polynomial = [f64; 4];

/// Polynomials of the areas of the section and the outline, what is lost, and what is gained.
#[derive(Clone, Copy, Debug, Default)]
struct Polynomials([Polynomial; 4]);

impl Polynomials {
    fn of(surface: &SurfacePiece) -> Self {
        let [low, high] = surface.heights;
        let slope = 1.0 / (high - low);
        let start = -low * slope;
        // The share passed is `start + slope top`.
        Self(surface.integrals().map(|[a, b, c]| {
            [
                start * (a + start * (b + start * c)),
                slope * (a + start * (2.0 * b + 3.0 * start * c)),
                slope * slope * (b + 3.0 * start * c),
                slope * slope * slope * c,
            ]
        }))
    }

    fn constant(change: ProfileChange) -> Self {
        let ProfileChange { area, outline, lost, gained } = change;
        Self([area, outline, lost, gained].map(|value| [value, 0.0, 0.0, 0.0]))
    }

    fn add(&mut self, other: &Self, factor: f64) {
        let (to, from) = (self.0.as_flattened_mut(), other.0.as_flattened());
        to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
    }

    fn at(&self, top: f64) -> ProfileChange {
        let [area, outline, lost, gained] =
            self.0.map(|p| p[0] + top * (p[1] + top * (p[2] + top * p[3])));
        ProfileChange { area, outline, lost, gained }
    }
}

/// Changes by top, over many surfaces.
#[derive(Debug)]
pub(crate) struct ChangeProfile<'a> {
    /// Tops above the layer's bottom, in micrometers, rising.
    tops: &'a [f64],
    /// About how many tops lie in a micrometer.
    per_um: f64,
    /// The polynomials that begin at each top, and hold from there on.
    starts: Vec<Polynomials>,
    /// The changes at single tops.
    alone: Vec<ProfileChange>,
    /// The section's area at the bottom.
    pub(crate) bottom_area: f64,
    /// The least error, below the last top, of any layer up to this top or higher.
    pub(crate) unavoidable: f64,
}

impl<'a> ChangeProfile<'a> {
    pub(crate) fn new(tops: &'a [f64]) -> Self {
        let span = tops[tops.len() - 1] - tops[0];
        Self {
            tops,
            per_um: if span > 0.0 { (tops.len() - 1) as f64 / span } else { 0.0 },
            starts: vec![Polynomials::default(); tops.len() + 1],
            alone: vec![ProfileChange::default(); tops.len()],
            bottom_area: 0.0,
            unavoidable: 0.0,
        }
    }

    /// Returns the first top above a height.
    #[inline]
    pub(crate) fn first_above(&self, height: f64) -> usize {
        count_at_or_below(self.tops, height, (height - self.tops[0]) * self.per_um)
    }

    pub(crate) fn add(&mut self, surface: SurfacePiece) {
        let surface = surface.rising();
        let [low, high] = surface.heights;
        if high - low <= LEVEL_UM {
            // A level face within the tolerance of a plane counts as lying on it.
            let end = self.first_above(low + PLANE_TOLERANCE.um());
            return self.starts[end].add(&Polynomials::constant(surface.passed(1.0)), 1.0);
        }
        let (first, end) = (self.first_above(low), self.first_above(high));
        if end - first < MANY_TOPS.max(self.tops.len() / SMALL_PART) {
            for top in first..end {
                let passed = (self.tops[top] - low) / (high - low);
                self.alone[top].add(surface.passed(passed));
            }
        } else {
            let polynomials = Polynomials::of(&surface);
            self.starts[first].add(&polynomials, 1.0);
            self.starts[end].add(&polynomials, -1.0);
        }
        self.starts[end].add(&Polynomials::constant(surface.passed(1.0)), 1.0);
    }

    /// Adds the unavoidable error of columns. `within` is the height inside at the
    /// first and the last of them, less the top if they end inside.
    pub(crate) fn add_unavoidable(&mut self, extent: f64, within: [f64; 2], ends_inside: bool) {
        let last = self.tops[self.tops.len() - 1];
        let lesser = within.map(|within| {
            let within = if ends_inside { last + within } else { within };
            within.min(last - within).max(0.0)
        });
        // Between the ends the true one is no less: a minimum of lines is concave.
        self.unavoidable += extent * 0.5 * (lesser[0] + lesser[1]);
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
        let mut profile = ChangeProfile::new(&tops);
        let surface = |heights, section: f64, density| SurfacePiece {
            heights,
            extent: section.abs(),
            density,
            section: section.signum(),
            outline: section.signum().max(0.0),
            lost: [3.0, 40.0],
            gained: [1.5, -0.5],
        };
        let surfaces = [
            surface([-5.0, 90.0], 0.3, EVEN),
            surface([99.5, 10.0], -0.7, EVEN),
            surface([60.2, 60.3], 0.1, [0.0, 2.0]),
            surface([50.0, 50.0], 2.0, EVEN),
            surface([97.0, 130.0], 0.2, [2.0, 0.0]),
            surface([-3.0, 70.0], 0.4, [2.0, 0.0]),
            surface([0.0, 20.0], -0.4, [0.0, 2.0]),
        ];
        surfaces.iter().for_each(|&surface| profile.add(surface));
        for (k, change) in profile.changes().iter().enumerate() {
            let mut expected = ProfileChange::default();
            for surface in surfaces.map(SurfacePiece::rising) {
                let [low, high] = surface.heights;
                let passed = if tops[k] <= low || (low == high && tops[k] <= low + 1.0) {
                    0.0
                } else if tops[k] > high {
                    1.0
                } else {
                    (tops[k] - low) / (high - low)
                };
                expected.add(surface.passed(passed));
            }
            assert!((change.area - expected.area).abs() < 1e-12, "{k}");
            assert!((change.outline - expected.outline).abs() < 1e-12, "{k}");
            assert!((change.lost - expected.lost).abs() < 1e-10, "{k}");
            assert!((change.gained - expected.gained).abs() < 1e-10, "{k}");
        }
    }

    /// A flat face at a top is not in the layer below it: the section there is
    /// taken just under the face.
    #[test]
    fn a_flat_surface_counts_above_its_height() {
        let tops = [10.0, 20.0, 30.0];
        let mut profile = ChangeProfile::new(&tops);
        profile.add(SurfacePiece {
            heights: [20.0; 2],
            extent: 2.0,
            density: EVEN,
            section: 1.0,
            outline: 0.0,
            lost: [0.0; 2],
            gained: [20.0; 2],
        });
        let gained: Vec<f64> = profile.changes().iter().map(|change| change.gained).collect();
        assert_eq!(gained, [0.0, 0.0, 40.0]);
    }
}
