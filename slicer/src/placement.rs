//! Places a part on the machine: scaled, mirrored, turned and moved.
//!
//! Each corner is placed separately, in 64 bits. Corners that are equal in the file stay equal, so
//! a closed mesh stays closed however it is turned.

use crate::facet::Units;

/// An axis of part coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Along the rows.
    X,
    /// Up the columns.
    Y,
    /// Up the build.
    Z,
}

lamp_stack::named!(Axis { X = "x", Y = "y", Z = "z" });

/// Steps that place a part before it is sliced; no steps by default. Each step acts about the
/// origin, after the steps before.
///
/// ```
/// use lamp_slicing::{Axis, Placement};
///
/// let placement = Placement::default().scaled([2.0; 3]).rotated(Axis::Z, 90.0);
/// assert_eq!(placement.at([1.0, 0.0, 0.5]), [0.0, 2.0, 1.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Coefficients of x, y, z and 1 for the placed x, y and z.
    rows: [[f64; 4]; 3],
}

impl Default for Placement {
    fn default() -> Self {
        Self { rows: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]] }
    }
}

impl Placement {
    /// Scales x, y and z. A negative factor mirrors, and so turns every facet over; neither fill
    /// rule is affected.
    #[must_use]
    pub fn scaled(mut self, factors: [f64; 3]) -> Self {
        for (row, factor) in self.rows.iter_mut().zip(factors) {
            *row = row.map(|entry| entry * factor);
        }
        self
    }

    /// Turns counterclockwise, as seen from the axis's tip. Quarter turns are exact.
    #[must_use]
    pub fn rotated(mut self, axis: Axis, degrees: f64) -> Self {
        // Sine and cosine of 90° in radians are not exactly 1 and 0.
        let quarters = (degrees / 90.0).round();
        let (mut sin, mut cos) = (degrees - 90.0 * quarters).to_radians().sin_cos();
        for _ in 0..quarters.rem_euclid(4.0) as u32 {
            (sin, cos) = (cos, -sin);
        }
        let (i, j) = match axis {
            Axis::X => (1, 2),
            Axis::Y => (2, 0),
            Axis::Z => (0, 1),
        };
        let (a, b) = (self.rows[i], self.rows[j]);
        self.rows[i] = std::array::from_fn(|k| cos * a[k] - sin * b[k]);
        self.rows[j] = std::array::from_fn(|k| sin * a[k] + cos * b[k]);
        self
    }

    /// Moves along x, y and z.
    #[must_use]
    pub fn translated(mut self, by_mm: [f64; 3]) -> Self {
        for (row, mm) in self.rows.iter_mut().zip(by_mm) {
            row[3] += mm;
        }
        self
    }

    /// Returns both placements as one: this one, then `next`.
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        let rows = next.rows.map(|[x, y, z, shift]| {
            let mut row: [f64; 4] = std::array::from_fn(|k| {
                x * self.rows[0][k] + y * self.rows[1][k] + z * self.rows[2][k]
            });
            row[3] += shift;
            row
        });
        Self { rows }
    }

    /// Creates the placement that maps a point (x, y, z) to the sums of these coefficients times x,
    /// y, z and 1 mm.
    pub(crate) fn of_rows(rows: [[f64; 4]; 3]) -> Self {
        Self { rows }
    }

    /// Returns the coefficients of x, y, z and 1 mm for each placed coordinate.
    pub(crate) fn rows(&self) -> [[f64; 4]; 3] {
        self.rows
    }

    /// Returns the coefficients for points in a unit.
    pub(crate) fn rows_of(&self, units: Units) -> [[f64; 4]; 3] {
        let unit = units.mm();
        self.rows.map(|[x, y, z, shift]| [x * unit, y * unit, z * unit, shift])
    }

    /// Returns true if it changes the handedness of the part.
    pub(crate) fn is_mirror(&self) -> bool {
        let [a, b, c] = self.rows;
        let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
        // The determinant is negative.
        a[0] * minor(1, 2) + a[1] * minor(2, 0) + a[2] * minor(0, 1) < 0.0
    }

    /// Returns placed heights, in millimeters. `None` if they depend on x or y, or fall.
    pub(crate) fn heights_mm(&self, heights_mm: &[f64]) -> Option<Vec<f64>> {
        let [x, y, z, shift] = self.rows[2];
        let is_upright = x == 0.0 && y == 0.0 && z > 0.0;
        is_upright.then(|| heights_mm.iter().map(|height| z * height + shift).collect())
    }

    /// Returns a placed point, in millimeters.
    pub fn at(&self, point_mm: [f64; 3]) -> [f64; 3] {
        self.rows.map(|row| affine(&row, point_mm))
    }
}

/// Returns the sum of coefficients times x, y, z and 1.
#[inline]
pub(crate) fn affine(row: &[f64; 4], [x, y, z]: [f64; 3]) -> f64 {
    row[0] * x + row[1] * y + row[2] * z + row[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarter_turns_are_exact_and_right_handed() {
        let point = [0.1, 0.7, -1.3];
        for (axis, next) in [(Axis::X, [1, 2]), (Axis::Y, [2, 0]), (Axis::Z, [0, 1])] {
            for (degrees, quarters) in [(90.0, 1), (-270.0, 1), (180.0, 2), (-90.0, 3), (720.0, 0)]
            {
                let mut expected = point;
                for _ in 0..quarters {
                    let [i, j] = next;
                    (expected[i], expected[j]) = (-expected[j], expected[i]);
                }
                assert_eq!(Placement::default().rotated(axis, degrees).at(point), expected);
            }
        }
    }

    #[test]
    fn steps_follow_one_another() {
        let there = Placement::default()
            .scaled([2.0, 1.0, -1.0])
            .rotated(Axis::Z, 90.0)
            .translated([10.0, 0.0, 0.5])
            .rotated(Axis::X, -90.0);
        assert_eq!(there.at([1.0, 2.0, 3.0]), [8.0, -2.5, -2.0]);
    }

    #[test]
    fn other_angles_keep_lengths_and_add_up() {
        let turned = Placement::default().rotated(Axis::Y, 30.0);
        let [x, _, z] = turned.at([1.0, 0.0, 0.0]);
        assert!((x - 0.75f64.sqrt()).abs() < 1e-15 && (z + 0.5).abs() < 1e-15);
        let [once, twice] = [turned.rotated(Axis::Y, 107.3), turned]
            .map(|placement| placement.at([0.3, -2.0, 5.0]));
        let length = |p: [f64; 3]| p.iter().map(|v| v * v).sum::<f64>().sqrt();
        assert!((length(once) - length(twice)).abs() < 1e-14);
        let back = turned.rotated(Axis::Y, 107.3).rotated(Axis::Y, -137.3).at([0.3, -2.0, 5.0]);
        assert!(back.iter().zip([0.3, -2.0, 5.0]).all(|(a, b)| (a - b).abs() < 1e-14));
    }
}
