//! Places a part on the machine: scaled, mirrored, turned and moved.
//!
//! Each corner is placed by itself, in 64 bits. Corners that are equal in the file
//! stay equal, so a closed mesh stays closed however it is turned.

use std::io;

use lamp_brep::Prepared;

use crate::exact::PlacedSurfaces;
use crate::facet::{Facet, Units};
use crate::file_blocks::FileBlock;
use crate::part::{Part, Piece};

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

/// Steps that place a part before it is sliced; none by default. Each acts about the
/// origin, after the steps before.
///
/// ```
/// use lamp_slicer::{Axis, Placement};
///
/// let placement = Placement::default().scaled([2.0; 3]).rotated(Axis::Z, 90.0);
/// assert_eq!(placement.at([1.0, 0.0, 0.5]), [0.0, 2.0, 1.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Coefficients of x, y, z and 1 for the x, y and z in place.
    rows: [[f64; 4]; 3],
}

impl Default for Placement {
    fn default() -> Self {
        Self { rows: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]] }
    }
}

impl Placement {
    /// Scales x, y and z. A factor below zero mirrors, and so turns every facet over;
    /// neither fill rule sees that.
    #[must_use]
    pub fn scaled(mut self, factors: [f64; 3]) -> Self {
        for (row, factor) in self.rows.iter_mut().zip(factors) {
            *row = row.map(|entry| entry * factor);
        }
        self
    }

    /// Turns counter-clockwise, as seen from the axis's tip. Quarter turns are exact.
    #[must_use]
    pub fn rotated(mut self, axis: Axis, degrees: f64) -> Self {
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

    /// Returns both placements as one: this one, and then another.
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

    /// Creates the placement that takes a point (x, y, z) to the sums of these
    /// coefficients times x, y, z and 1 mm.
    pub(crate) fn of_rows(rows: [[f64; 4]; 3]) -> Self {
        Self { rows }
    }

    /// Returns the coefficients for points in a unit.
    fn rows_of(&self, units: Units) -> [[f64; 4]; 3] {
        let unit = units.mm();
        self.rows.map(|[x, y, z, shift]| [x * unit, y * unit, z * unit, shift])
    }

    /// Returns true if it makes right hands left ones.
    pub(crate) fn is_mirror(&self) -> bool {
        let [a, b, c] = self.rows;
        let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
        a[0] * minor(1, 2) + a[1] * minor(2, 0) + a[2] * minor(0, 1) < 0.0
    }

    /// Returns a point in its place, in millimetres.
    pub fn at(&self, point_mm: [f64; 3]) -> [f64; 3] {
        self.rows.map(|row| affine(&row, point_mm))
    }
}

#[inline]
fn affine(row: &[f64; 4], [x, y, z]: [f64; 3]) -> f64 {
    row[0] * x + row[1] * y + row[2] * z + row[3]
}

#[inline]
fn scaled(scale: &[f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [x * scale[0], y * scale[1], z * scale[2]]
}

/// A facet in its place: x and y in millimetres, z in micrometres.
pub type PlacedFacet = [[f64; 3]; 3];

/// Returns the lowest and the highest z of a facet.
#[inline]
pub fn facet_heights(facet: &PlacedFacet) -> (f64, f64) {
    let [a, b, c] = facet.map(|corner| corner[2]);
    (lesser(lesser(a, b), c), greater(greater(a, b), c))
}

/// Returns the lesser of two numbers. `f64::min` looks for those that are none, and takes several
/// times as long.
#[inline]
pub(crate) fn lesser<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// Returns the greater of two numbers.
#[inline]
pub(crate) fn greater<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// A part in its place.
#[derive(Debug)]
pub(crate) struct PlacedPart {
    pub(crate) model: Part,
    /// Those of the pieces, each once.
    transforms: Vec<Transform>,
    /// The exact surfaces of each file that has some.
    surfaces: Vec<PlacedSurfaces>,
    pieces: Vec<PlacedPiece>,
}

/// A piece of a part in its place.
#[derive(Debug)]
struct PlacedPiece {
    /// Its number among the transforms.
    transform: usize,
    /// The number of its file's surfaces, if it has some.
    surfaces: Option<usize>,
}

/// The transform from file units to the place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Transform {
    /// Scales the axes. Most parts stay where they are, and need no more.
    Scale([f64; 3]),
    Affine([[f64; 4]; 3]),
}

impl Transform {
    pub(crate) fn new(placement: &Placement, units: Units) -> Self {
        let mut rows = placement.rows;
        // Straight to micrometres: z in file units times them is exact.
        for (row, (unit, per_mm)) in
            rows.iter_mut().zip([(units.mm(), 1.0), (units.mm(), 1.0), (units.um(), 1000.0)])
        {
            let [x, y, z, shift] = *row;
            *row = [x * unit, y * unit, z * unit, shift * per_mm];
        }
        let is_scale = (0..12).all(|k| k % 4 == k / 4 || rows[k / 4][k % 4] == 0.0);
        match is_scale {
            true => Self::Scale(std::array::from_fn(|axis| rows[axis][axis])),
            false => Self::Affine(rows),
        }
    }

    /// Places a facet.
    #[inline]
    pub(crate) fn placed(&self, facet: &Facet) -> PlacedFacet {
        match self {
            Self::Scale(scale) => placed(facet, |corner| scaled(scale, corner)),
            Self::Affine(rows) => placed(facet, |corner| rows.map(|row| affine(&row, corner))),
        }
    }
}

impl PlacedPart {
    /// Places a part. Files that state no unit are in `units`.
    pub(crate) fn new(model: Part, placement: &Placement, units: Units) -> Self {
        let (mut transforms, mut surfaces) = (Vec::new(), Vec::new());
        let mut file_before = None;
        let mut place = |(body, piece): (u32, &Piece)| {
            let units = piece.units.unwrap_or(units);
            let from_corner =
                Placement::default().translated(piece.offset.map(|offset| offset * units.mm()));
            let placement = from_corner.then(&piece.placement).then(placement);
            let transform = Transform::new(&placement, units);
            // Pieces that stand alike follow each other.
            if transforms.last() != Some(&transform) {
                transforms.push(transform);
            }
            let is_of_next_file = file_before.replace(piece.file) != Some(piece.file);
            if let Some(prepared) = piece.surfaces().filter(|_| is_of_next_file) {
                let Prepared { kernel, mesh, .. } = &**prepared;
                let rows = placement.rows_of(units);
                let placed = PlacedSurfaces::new(kernel.clone(), mesh.clone(), rows);
                surfaces.push(placed.numbered_from(body));
            }
            let surfaces = piece.surfaces().map(|_| surfaces.len() - 1);
            PlacedPiece { transform: transforms.len() - 1, surfaces }
        };
        let pieces = (0..).zip(model.pieces()).map(&mut place).collect();
        Self { model, transforms, surfaces, pieces }
    }

    /// Drops the surfaces, so that only facets are left.
    pub(crate) fn on_facets(mut self) -> Self {
        self.pieces.iter_mut().for_each(|piece| piece.surfaces = None);
        self.surfaces.clear();
        self
    }

    /// Returns the surfaces of all files.
    pub(crate) fn surfaces(&self) -> &[PlacedSurfaces] {
        &self.surfaces
    }

    /// Returns the surfaces of a block's piece, if it has some, and the number there of
    /// the block's first facet.
    pub(crate) fn surfaces_of_block(&self, block: usize) -> Option<(&PlacedSurfaces, u32)> {
        let (piece, facets) = self.model.place_of(block);
        let surfaces = &self.surfaces[self.pieces[piece].surfaces?];
        let first = self.model.pieces()[piece].first_facet + facets.start;
        Some((surfaces, first as u32))
    }

    /// Returns what was seen of a block when its file was opened, and the scales of its axes from
    /// file units to the place; none unless that is all that places it.
    pub(crate) fn seen_block(&self, block: usize) -> Option<(&FileBlock, [f64; 3])> {
        let (piece, facets) = self.model.place_of(block);
        let Transform::Scale(scale) = self.transform_of(piece) else { return None };
        Some((self.model.pieces()[piece].facets.seen_block(facets.start)?, scale))
    }

    /// Calls `each` with every facet of a block.
    pub(crate) fn for_each_in_block(
        &self,
        block: usize,
        mut each: impl FnMut(&PlacedFacet),
    ) -> io::Result<()> {
        // Two loops, so that neither asks at every facet which one it is.
        let (piece, _) = self.model.place_of(block);
        match self.transform_of(piece) {
            Transform::Scale(scale) => self.model.for_each_in_block(block, |facet| {
                each(&placed(facet, |corner| scaled(&scale, corner)));
            }),
            Transform::Affine(rows) => self.model.for_each_in_block(block, |facet| {
                each(&placed(facet, |corner| rows.map(|row| affine(&row, corner))));
            }),
        }
    }

    /// Returns the transform of a piece.
    pub(crate) fn transform_of(&self, piece: usize) -> Transform {
        self.transforms[self.pieces[piece].transform]
    }
}

#[inline]
fn placed(facet: &Facet, place: impl Fn([f64; 3]) -> [f64; 3]) -> PlacedFacet {
    facet.map(|corner| place(corner.map(f64::from)))
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
