//! Struts: straight rods, round or streamlined, and their sections in the rows of images.

use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use crate::length::{Dpi, Length};
use crate::pitch::Pitch;

/// The section of a strut, square to its axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StrutSection {
    /// A circle.
    #[default]
    Round,
    /// An ellipse; its long axis is the chord.
    Ellipse,
    /// A symmetric aerofoil of the four-digit family of NACA.
    Aerofoil,
}

crate::named!(StrutSection {
    Round = "round",
    Ellipse = "ellipse",
    Aerofoil = "aerofoil",
});

/// A section that lies along a flow: its chord, from the leading to the trailing edge, is the flow's
/// direction across the strut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowSection {
    /// The form.
    pub section: StrutSection,
    /// The thickness as a share of the chord, up to 1. Round sections have none.
    pub thickness_ratio: f64,
    /// The flow's direction, of any length.
    pub flow: [f64; 3],
}

impl FlowSection {
    /// The least share of the chord that the thickness of a strut may be: thinner ones break.
    pub const LEAST_RATIO: f64 = 0.05;

    /// Returns the area of a section with a chord, in mm².
    pub fn area_mm2(&self, chord: Length) -> f64 {
        let chord_mm = chord.mm();
        match self.section {
            StrutSection::Round => PI / 4.0 * chord_mm * chord_mm,
            StrutSection::Ellipse => PI / 4.0 * chord_mm * chord_mm * self.thickness_ratio,
            StrutSection::Aerofoil => {
                let corners = AEROFOIL.iter().zip(AEROFOIL.iter().cycle().skip(1));
                let twice: f64 = corners.map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum();
                twice / 2.0 * (chord_mm / 2.0).powi(2) * self.thickness_ratio
            }
        }
    }

    /// Returns the corners of a section about an axis, counterclockwise as seen from its tip, as
    /// distances from the axis in mm; `None` if the flow goes along the axis. Curves become polygons
    /// of about `sides` corners and of nearly the same area.
    pub fn corners_mm(&self, axis: [f64; 3], chord: Length, sides: u32) -> Option<Vec<[f64; 3]>> {
        let profile = Profile::new(self, axis, chord)?;
        let corner = |[x, y]: [f64; 2]| {
            let [x, y] = [x * profile.half_mm[0], y * profile.half_mm[1]];
            std::array::from_fn(|k| x * profile.chord[k] + y * profile.aside[k])
        };
        if self.section == StrutSection::Aerofoil {
            return Some(AEROFOIL.iter().copied().map(corner).collect());
        }
        // As much outside the ellipse as inside.
        let outside = 0.5 * (1.0 + (PI / f64::from(sides)).cos());
        let point = |k: u32| {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(sides)).sin_cos();
            corner([cos / outside, sin / outside])
        };
        Some((0..sides).map(point).collect())
    }
}

/// The corners of an aerofoil of half a chord and half a thickness 1, counterclockwise from the
/// trailing edge; the leading edge is at -1.
///
/// Source: E. N. Jacobs, K. E. Ward and R. M. Pinkerton, NACA report 460, 1933; with the last
/// coefficient that closes the trailing edge.
static AEROFOIL: LazyLock<Vec<[f64; 2]>> = LazyLock::new(|| {
    const STEPS: u32 = 40;
    let half_thickness = |x: f64| {
        let polynomial = -0.1260 + x * (-0.3516 + x * (0.2843 - x * 0.1036));
        10.0 * (0.2969 * x.sqrt() + x * polynomial)
    };
    // Steps of equal angles are finest at the edges.
    let place = |k: u32| f64::midpoint(1.0, (PI * f64::from(k) / f64::from(STEPS)).cos());
    let upper = (0..=STEPS).map(|k| (place(k), 1.0));
    let lower = (1..STEPS).rev().map(|k| (place(k), -1.0));
    let corner = |(x, side): (f64, f64)| [2.0 * x - 1.0, side * half_thickness(x)];
    upper.chain(lower).map(corner).collect()
});

/// A streamlined section of a strut.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Profile {
    is_ellipse: bool,
    /// The directions of chord and thickness, of length 1.
    chord: [f64; 3],
    aside: [f64; 3],
    /// Half of chord and thickness.
    half_mm: [f64; 2],
}

impl Profile {
    fn new(section: &FlowSection, axis: [f64; 3], chord: Length) -> Option<Self> {
        let along = dot(section.flow, axis);
        let across: [f64; 3] = std::array::from_fn(|k| section.flow[k] - along * axis[k]);
        let length = dot(across, across).sqrt();
        // Also false of directions that are not finite.
        let direction = (length > 1e-6 * dot(section.flow, section.flow).sqrt())
            .then(|| across.map(|part| part / length))?;
        let [x, y, z] = axis;
        let [a, b, c] = direction;
        let half_mm = chord.mm() / 2.0;
        Some(Self {
            is_ellipse: section.section != StrutSection::Aerofoil,
            chord: direction,
            aside: [y * c - z * b, z * a - x * c, x * b - y * a],
            half_mm: [half_mm, half_mm * section.thickness_ratio],
        })
    }

    /// Returns its least and its greatest distance from the axis along a coordinate.
    fn reach_mm(&self, axis: usize) -> [f64; 2] {
        let [x, y] = [self.half_mm[0] * self.chord[axis], self.half_mm[1] * self.aside[axis]];
        if self.is_ellipse {
            let reach = x.hypot(y);
            return [-reach, reach];
        }
        let places = AEROFOIL.iter().map(|corner| corner[0] * x + corner[1] * y);
        places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], place| {
            [low.min(place), high.max(place)]
        })
    }

    /// Returns the run along x inside of it at a y and z from a point of the axis.
    fn run_mm(&self, y: f64, z: f64) -> Option<[f64; 2]> {
        // The place in units of half a chord and half a thickness is `slope x + at`.
        let of = |direction: [f64; 3], half: f64| {
            [direction[0] / half, (direction[1] * y + direction[2] * z) / half]
        };
        let [[x, u], [w, v]] = [of(self.chord, self.half_mm[0]), of(self.aside, self.half_mm[1])];
        if self.is_ellipse {
            // Inside where (x t + u)² + (w t + v)² < 1.
            let (a, b, c) = (x * x + w * w, x * u + w * v, u * u + v * v - 1.0);
            if a == 0.0 {
                return (c < 0.0).then_some([f64::NEG_INFINITY, f64::INFINITY]);
            }
            let square = b * b - a * c;
            let root = (square > 0.0).then(|| square.sqrt())?;
            return Some([(-b - root) / a, (-b + root) / a]);
        }
        let [mut low, mut high] = [f64::NEG_INFINITY, f64::INFINITY];
        for (from, to) in AEROFOIL.iter().zip(AEROFOIL.iter().cycle().skip(1)) {
            // The aerofoil is convex: inside is left of each edge.
            let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
            let (slope, at) = (dx * w - dy * x, dx * (v - from[1]) - dy * (u - from[0]));
            if slope > 0.0 {
                low = low.max(-at / slope);
            } else if slope < 0.0 {
                high = high.min(-at / slope);
            } else if at <= 0.0 {
                return None;
            }
        }
        (low < high).then_some([low, high])
    }
}

/// A straight rod with flat ends, in part coordinates: a cylinder, or of another section along a
/// flow.
///
/// A point is in it if it is nearer to the axis than the radius, or in the section, and between the
/// planes through the ends that the axis stands on.
///
/// ```
/// use lamp_stack::{Length, Pitch, Strut};
///
/// let mm = |point: [f64; 3]| point.map(Length::from_mm);
/// let strut = Strut::new(mm([0.5, 2.5, 0.0]), mm([4.5, 2.5, 4.0]), Length::from_mm(2.0)).unwrap();
/// // At 25.4 dpi a pixel is a millimetre.
/// let runs = strut.section(Length::from_mm(2.0), [0.0, 5.0], Pitch::of_dpi(25.4).unwrap(), [6, 5]);
/// // An ellipse: sqrt(2) to each side along x, and 1 along y.
/// assert_eq!(runs.collect::<Vec<_>>(), [(2, 1, 4)]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strut {
    from_mm: [f64; 3],
    direction: [f64; 3],
    length_mm: f64,
    radius_mm: f64,
    profile: Option<Profile>,
}

impl Strut {
    /// Creates a strut between the middles of its ends, or returns `None` if they coincide.
    pub fn new(from: [Length; 3], to: [Length; 3], diameter: Length) -> Option<Self> {
        let [from_mm, to_mm] = [from, to].map(|end| end.map(Length::mm));
        let along: [f64; 3] = std::array::from_fn(|k| to_mm[k] - from_mm[k]);
        let length_mm = dot(along, along).sqrt();
        // A length of zero makes these NaN; then there is no strut.
        let direction = along.map(|part| part / length_mm);
        let radius_mm = diameter.mm() / 2.0;
        let profile = None;
        (length_mm > 0.0).then_some(Self { from_mm, direction, length_mm, radius_mm, profile })
    }

    /// Creates a strut of a section along a flow. Its chord has its middle in the axis. Returns `None`
    /// if the ends coincide, or the flow goes along the strut.
    pub fn streamlined(
        from: [Length; 3],
        to: [Length; 3],
        chord: Length,
        section: &FlowSection,
    ) -> Option<Self> {
        let round = Self::new(from, to, chord)?;
        if section.section == StrutSection::Round {
            return Some(round);
        }
        let profile = Profile::new(section, round.direction, chord)?;
        Some(Self { profile: Some(profile), ..round })
    }

    /// Returns the heights of its lowest and its highest point.
    pub fn heights(&self) -> [Length; 2] {
        self.reach_mm(2).map(Length::from_mm)
    }

    /// Returns the pixels whose centers are in its section at a height: at most one run a
    /// row, as the row, the first column and the column after the last, from the top. The
    /// image's top left corner is at `origin_mm`, and it has `size` columns and rows.
    pub fn section(
        &self,
        height: Length,
        origin_mm: [f64; 2],
        pitch: Pitch,
        size: [u32; 2],
    ) -> impl Iterator<Item = (u32, u32, u32)> + use<> {
        let strut = *self;
        let up_mm = height.mm() - self.from_mm[2];
        let [x0, y1] = origin_mm;
        // Pixel centers are whole numbers; the casts make negative values zero.
        let pixels = move |mm: f64, [by, of]: [f64; 2]| mm * by / of - 0.5;
        let [x_scale, y_scale] = [pitch.x, pitch.y].map(Dpi::pixels_in_mm);
        let row_mm = pitch.y.pitch().mm();
        let [low, high] = self.rows_mm(up_mm);
        let rows = pixels(y1 - high, y_scale).ceil() as u32
            ..(pixels(y1 - low, y_scale).floor() + 1.0) as u32;
        (rows.start..rows.end.min(size[1])).filter_map(move |row| {
            let y_mm = y1 - (f64::from(row) + 0.5) * row_mm;
            let run = strut.run_mm(y_mm - strut.from_mm[1], up_mm)?;
            let [start, end] = run.map(|x| {
                let column = pixels(strut.from_mm[0] + x - x0, x_scale).ceil() as u32;
                column.min(size[0])
            });
            (start < end).then_some((row, start, end))
        })
    }

    /// Returns the least and the greatest coordinate of an axis.
    fn reach_mm(&self, axis: usize) -> [f64; 2] {
        let along = self.direction[axis];
        let (a, b) = (self.from_mm[axis], self.from_mm[axis] + self.length_mm * along);
        if let Some(profile) = &self.profile {
            let [low, high] = profile.reach_mm(axis);
            return [a.min(b) + low, a.max(b) + high];
        }
        // Half the extent of the round ends: r sqrt(1 - d²). Rounding may take d² past 1.
        let across = self.radius_mm * (1.0 - along * along).max(0.0).sqrt();
        [a.min(b) - across, a.max(b) + across]
    }

    /// Returns the least and the greatest y of the section `up_mm` above the first end.
    fn rows_mm(&self, up_mm: f64) -> [f64; 2] {
        let [_, dy, dz] = self.direction;
        let [low, high] = self.reach_mm(1);
        if dz == 0.0 || self.profile.is_some() {
            return [low, high];
        }
        let middle = self.from_mm[1] + up_mm * dy / dz;
        // Not by 1 - dx^2, which is 0 for a strut that is a trifle off the x axis.
        let half = self.radius_mm * dy.hypot(dz) / dz.abs();
        // Flat ends cut the ellipse off, so the whole strut's reach limits it, too.
        [low.max(middle - half), high.min(middle + half)]
    }

    /// Returns the run along x at a y and z; all are distances from the first end.
    fn run_mm(&self, y: f64, z: f64) -> Option<[f64; 2]> {
        let [dx, dy, dz] = self.direction;
        // A point at x is `x dx + s` along the axis, and `x^2 + y^2 + z^2` less the square of
        // that from it, squared.
        let s = y * dy + z * dz;
        // 1 - dx², without its cancellation where dx is near 1.
        let a = dy * dy + dz * dz;
        let c = y * y + z * z - s * s - self.radius_mm * self.radius_mm;
        let within = if let Some(profile) = &self.profile {
            profile.run_mm(y, z)?
        } else if a > 0.0 {
            // Inside where a x² - 2 dx s x + c < 0: between the roots.
            let square = dx * s * dx * s - a * c;
            let root = (square > 0.0).then(|| square.sqrt())?;
            [(dx * s - root) / a, (dx * s + root) / a]
        } else {
            // Along x, the distance from the axis is the same everywhere.
            (c < 0.0).then_some([f64::NEG_INFINITY, f64::INFINITY])?
        };
        let between = if dx == 0.0 {
            (0.0..self.length_mm).contains(&s).then_some([f64::NEG_INFINITY, f64::INFINITY])?
        } else {
            // The planes through the ends: x dx + s is between 0 and the length.
            let [a, b] = [-s / dx, (self.length_mm - s) / dx];
            [a.min(b), a.max(b)]
        };
        Some([within[0].max(between[0]), within[1].min(between[1])])
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Quarters of a millimeter, so that struts also stand upright and lie along an axis.
    fn end() -> impl Strategy<Value = [f64; 3]> {
        [-8i32..60, -12i32..32, -4i32..20].prop_map(|end| end.map(|q| f64::from(q) / 4.0 + 0.013))
    }

    proptest! {
        #[test]
        fn a_pixel_is_in_a_section_when_its_centre_is(
            (from, to, diameter) in (end(), end(), 1i32..30),
            height in -4i32..24,
        ) {
            let radius = f64::from(diameter) / 8.0;
            let mm = |point: [f64; 3]| point.map(Length::from_mm);
            let Some(strut) = Strut::new(mm(from), mm(to), Length::from_mm(2.0 * radius)) else {
                prop_assert_eq!(from, to);
                return Ok(());
            };
            let z = f64::from(height) / 4.0;
            let dpi = Pitch::of_dpi(25.4).unwrap();
            let runs: Vec<_> = strut.section(Length::from_mm(z), [3.0, 7.0], dpi, [12, 9]).collect();
            prop_assert!(runs.is_sorted_by(|a, b| a.0 < b.0));
            let along: Vec<f64> = to.iter().zip(from).map(|(b, a)| b - a).collect();
            let square: f64 = along.iter().map(|d| d * d).sum();
            for (row, column) in (0..9).flat_map(|row| (0..12).map(move |column| (row, column))) {
                let centre = [3.5 + f64::from(column), 6.5 - f64::from(row), z];
                let part = (0..3).map(|k| (centre[k] - from[k]) * along[k]).sum::<f64>() / square;
                let away = (0..3).map(|k| (centre[k] - from[k] - part * along[k]).powi(2));
                let [beyond, away] = [part.min(1.0 - part), radius - away.sum::<f64>().sqrt()];
                // A center on the surface may be in it or not.
                if beyond.abs().min(away.abs()) < 1e-9 {
                    continue;
                }
                let is_in = runs.iter().any(|&(at, start, end)| at == row && (start..end).contains(&column));
                prop_assert_eq!(is_in, beyond > 0.0 && away > 0.0, "{} {}", column, row);
                let [low, high] = strut.heights().map(Length::mm);
                prop_assert!(!is_in || (low..high).contains(&z));
            }
        }
    }

    /// Returns the half thickness of an aerofoil of chord 1 and thickness 1, as NACA prints it.
    fn naca(x: f64) -> f64 {
        5.0 * (0.2969 * x.sqrt() - 0.1260 * x - 0.3516 * x.powi(2) + 0.2843 * x.powi(3)
            - 0.1036 * x.powi(4))
    }

    proptest! {
        #[test]
        fn a_pixel_is_in_a_streamlined_strut_when_its_centre_is(
            (from, to, chord, ratio) in (end(), end(), 8i32..40, 2i32..9),
            flow in [-3i32..4, -3i32..4, -3i32..4],
            is_ellipse in any::<bool>(),
            height in -4i32..24,
        ) {
            let flow = flow.map(|part| f64::from(part) + 0.01);
            let (chord, ratio) = (f64::from(chord) / 4.0, f64::from(ratio) / 8.0);
            let section = if is_ellipse { StrutSection::Ellipse } else { StrutSection::Aerofoil };
            let of_flow = FlowSection { section, thickness_ratio: ratio, flow };
            let mm = |point: [f64; 3]| point.map(Length::from_mm);
            let strut = Strut::streamlined(mm(from), mm(to), Length::from_mm(chord), &of_flow);
            prop_assume!(strut.is_some());
            let (strut, z) = (strut.unwrap(), f64::from(height) / 4.0);
            let pitch = Pitch::of_dpi(25.4).unwrap();
            let runs: Vec<_> =
                strut.section(Length::from_mm(z), [3.0, 7.0], pitch, [12, 9]).collect();
            let along: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
            let square = dot(along, along);
            for (row, column) in (0..9).flat_map(|row| (0..12).map(move |column| (row, column))) {
                let center = [3.5 + f64::from(column), 6.5 - f64::from(row), z];
                let off: [f64; 3] = std::array::from_fn(|k| center[k] - from[k]);
                let part = dot(off, along) / square;
                // Off the axis, and its share along the flow, by angles.
                let away: [f64; 3] = std::array::from_fn(|k| off[k] - part * along[k]);
                let lean = dot(flow, along) / square;
                let across: [f64; 3] = std::array::from_fn(|k| flow[k] - lean * along[k]);
                let x = dot(away, across) / dot(across, across).sqrt() / chord + 0.5;
                let y = (dot(away, away) - ((x - 0.5) * chord).powi(2)).max(0.0).sqrt();
                let half = if is_ellipse {
                    (x * (1.0 - x)).max(0.0).sqrt()
                } else if (0.0..=1.0).contains(&x) {
                    naca(x)
                } else {
                    0.0
                };
                let inside = half * chord * ratio - y;
                let beyond = part.min(1.0 - part);
                // Centers on the surface may be in it or not, and the polygon cuts some off.
                let slack = if is_ellipse { 1e-6 } else { 0.02 * chord * ratio };
                if beyond.abs() < 1e-9 || inside.abs() < slack {
                    continue;
                }
                let is_in = runs.iter().any(|&(at, start, end)| at == row && (start..end).contains(&column));
                let expected = beyond > 0.0 && inside > 0.0;
                prop_assert_eq!(is_in, expected, "{} {} {}", column, row, inside);
                let [low, high] = strut.heights().map(Length::mm);
                prop_assert!(!is_in || (low..=high).contains(&z));
            }
        }
    }

    #[test]
    fn areas_of_sections_are_their_closed_forms() {
        let of = |section| FlowSection { section, thickness_ratio: 0.25, flow: [2.0, 0.0, 0.0] };
        let chord = Length::from_mm(4.0);
        let area = |section| of(section).area_mm2(chord);
        assert!((area(StrutSection::Ellipse) - PI).abs() < 1e-12);
        // The integral of the profile: 10 t c² (0.2969 · 2/3 - 0.1260/2 - 0.3516/3 + 0.2843/4 - 0.1036/5).
        let exact = 10.0
            * 0.25
            * 16.0
            * (0.2969 * 2.0 / 3.0 - 0.1260 / 2.0 - 0.3516 / 3.0 + 0.2843 / 4.0 - 0.1036 / 5.0);
        let found = area(StrutSection::Aerofoil);
        assert!(found < exact && found > 0.998 * exact, "{found} {exact}");
        // The thickest place is at 30 percent of the chord.
        let upper = AEROFOIL.iter().map(|corner| corner[1]).fold(0.0, f64::max);
        assert!((upper - 1.0).abs() < 1e-3, "{upper}");
        // All corners turn left: it is convex.
        let n = AEROFOIL.len();
        for k in 0..n {
            let [a, b, c] = [k, (k + 1) % n, (k + 2) % n].map(|k| AEROFOIL[k]);
            assert!((b[0] - a[0]) * (c[1] - b[1]) > (b[1] - a[1]) * (c[0] - b[0]), "{k}");
        }
    }

    #[test]
    fn a_strut_that_rises_by_next_to_nothing_is_level() {
        let runs = |rise: f64| {
            let end = |mm: [f64; 3]| mm.map(Length::from_mm);
            let strut =
                Strut::new(end([1.0, 4.3, 2.1]), end([7.0, 4.3, 2.1 + rise]), Length::from_mm(3.0));
            let dpi = Pitch::of_dpi(25.4).unwrap();
            let runs = strut.unwrap().section(Length::from_mm(2.5), [0.0, 9.0], dpi, [9, 9]);
            runs.collect::<Vec<_>>()
        };
        assert_eq!(runs(0.0), [(3, 1, 7), (4, 1, 7), (5, 1, 7)]);
        for rise in [5e-16, -1e-15, 1e-12, -1e-9] {
            assert_eq!(runs(rise), runs(0.0), "{rise}");
        }
    }

    #[test]
    fn what_is_far_outside_costs_nothing() {
        let far = |mm: f64| [mm; 3].map(Length::from_mm);
        let strut = Strut::new(far(-1e9), far(1e9), Length::from_mm(1e9)).unwrap();
        let dpi = Pitch::of_dpi(100_000.0).unwrap();
        assert_eq!(strut.section(Length::from_mm(0.0), [0.0, 0.0], dpi, [7, 3]).count(), 3);
        assert_eq!(strut.section(Length::from_mm(3e9), [0.0, 0.0], dpi, [7, 3]).count(), 0);
    }
}
