//! Struts: straight round rods, and their sections in the rows of images.

use crate::length::{Dpi, Length};
use crate::pitch::Pitch;

/// A straight cylinder with flat ends, in part coordinates.
///
/// A point is in it if it is nearer to the axis than the radius, and between the planes
/// through the ends that the axis stands on.
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
        (length_mm > 0.0).then_some(Self { from_mm, direction, length_mm, radius_mm })
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
        // Half the extent of the round ends: r sqrt(1 - d²). Rounding may take d² past 1.
        let across = self.radius_mm * (1.0 - along * along).max(0.0).sqrt();
        [a.min(b) - across, a.max(b) + across]
    }

    /// Returns the least and the greatest y of the section `up_mm` above the first end.
    fn rows_mm(&self, up_mm: f64) -> [f64; 2] {
        let [_, dy, dz] = self.direction;
        let [low, high] = self.reach_mm(1);
        if dz == 0.0 {
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
        let within = if a > 0.0 {
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
