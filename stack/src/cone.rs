//! Cones and frustums between two points, and their sections in the rows of images.

use crate::length::{Dpi, Length};
use crate::pitch::Pitch;

/// A round cone or frustum with flat ends, in part coordinates.
///
/// A point is in it if it lies between the planes through the ends that the axis stands on, and
/// nearer to the axis than the radius there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    from_mm: [f64; 3],
    direction: [f64; 3],
    length_mm: f64,
    radii_mm: [f64; 2],
}

impl Cone {
    /// Creates a cone between the middles of its ends, with these diameters there, or returns
    /// `None` if they coincide.
    pub fn new(ends: [[Length; 3]; 2], diameters: [Length; 2]) -> Option<Self> {
        let [from_mm, to_mm] = ends.map(|end| end.map(Length::mm));
        let along: [f64; 3] = std::array::from_fn(|k| to_mm[k] - from_mm[k]);
        let length_mm = along.iter().map(|part| part * part).sum::<f64>().sqrt();
        let radii_mm = diameters.map(|diameter| diameter.mm() / 2.0);
        let direction = along.map(|part| part / length_mm);
        (length_mm > 0.0).then_some(Self { from_mm, direction, length_mm, radii_mm })
    }

    /// Returns the heights of its lowest and its highest point.
    pub fn heights(&self) -> [Length; 2] {
        self.reach_mm(2).map(Length::from_mm)
    }

    /// Returns the least and the greatest coordinate of an axis.
    fn reach_mm(&self, axis: usize) -> [f64; 2] {
        let along = self.direction[axis];
        // A flat end is a disc across the axis, which reaches r √(1 - d²) along a coordinate whose
        // share of the direction is d.
        let across = (1.0 - along * along).max(0.0).sqrt();
        let ends = [self.from_mm[axis], self.from_mm[axis] + self.length_mm * along];
        let reach = |sign: f64, k: usize| ends[k] + sign * self.radii_mm[k] * across;
        [reach(-1.0, 0).min(reach(-1.0, 1)), reach(1.0, 0).max(reach(1.0, 1))]
    }

    /// Returns the pixels whose centers are in its section at a height: at most one run a row, as
    /// the row, the first column and the column after the last, from the top. The image's top left
    /// corner is at `origin_mm`, and it has `size` columns and rows.
    pub fn section(
        &self,
        height: Length,
        origin_mm: [f64; 2],
        pitch: Pitch,
        size: [u32; 2],
    ) -> impl Iterator<Item = (u32, u32, u32)> + use<> {
        let (cone, [x0, y1]) = (*self, origin_mm);
        let up_mm = height.mm() - self.from_mm[2];
        // Pixel centers are whole numbers; the casts make negative values zero.
        let pixels = move |mm: f64, [by, of]: [f64; 2]| mm * by / of - 0.5;
        let [x_scale, y_scale] = [pitch.x, pitch.y].map(Dpi::pixels_in_mm);
        let row_mm = pitch.y.pitch().mm();
        let [low, high] = self.reach_mm(1);
        let end = (pixels(y1 - low, y_scale).floor() + 1.0) as u32;
        (pixels(y1 - high, y_scale).ceil() as u32..end.min(size[1])).filter_map(move |row| {
            let y_mm = y1 - (f64::from(row) + 0.5) * row_mm;
            let run = cone.run_mm(y_mm - cone.from_mm[1], up_mm)?;
            let column =
                |x: f64| (pixels(cone.from_mm[0] + x - x0, x_scale).ceil() as u32).min(size[0]);
            let [start, end] = run.map(column);
            (start < end).then_some((row, start, end))
        })
    }

    /// Returns the run along x at a y and z; all are distances from the first end. A cone is
    /// convex, so there is one at most.
    fn run_mm(&self, y: f64, z: f64) -> Option<[f64; 2]> {
        let [dx, dy, dz] = self.direction;
        // A point at x is `x dx + s` along the axis, where the radius is `r + k x dx`.
        let s = y * dy + z * dz;
        let k = (self.radii_mm[1] - self.radii_mm[0]) / self.length_mm;
        let r = self.radii_mm[0] + k * s;
        let [low, high] = if dx == 0.0 {
            (0.0..self.length_mm).contains(&s).then_some([f64::NEG_INFINITY, f64::INFINITY])?
        } else {
            let [a, b] = [-s / dx, (self.length_mm - s) / dx];
            [a.min(b), a.max(b)]
        };
        // In it is where a x^2 + 2 b x + c < 0.
        let a = dy * dy + dz * dz - k * k * dx * dx;
        let b = -dx * (s + k * r);
        let c = y * y + z * z - s * s - r * r;
        let within = |[from, to]: [f64; 2]| {
            let run = [from.max(low), to.min(high)];
            (run[0] < run[1]).then_some(run)
        };
        // The row is parallel to a side of the cone, and the equation linear. Coefficient a has no
        // unit.
        if a.abs() < 1e-12 {
            return match b {
                0.0 => (c < 0.0).then(|| within([low, high]))?,
                b if b > 0.0 => within([low, -c / (2.0 * b)]),
                b => within([-c / (2.0 * b), high]),
            };
        }
        let square = b * b - a * c;
        // Without two roots the sign is the same everywhere, and it is a's.
        if square <= 0.0 {
            return (a < 0.0).then(|| within([low, high]))?;
        }
        let root = square.sqrt();
        let ends = [(-b - root) / a, (-b + root) / a];
        if a > 0.0 {
            within(ends)
        } else {
            // Below zero on both sides of the roots: one is the cone, the other its image beyond
            // the tip, which the planes of the ends cut off.
            within([low, ends[1]]).or_else(|| within([ends[0], high]))
        }
    }
}
