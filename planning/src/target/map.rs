//! Heights of columns on a grid.

use lamp_stack::Length;
use rayon::prelude::*;

use super::TargetError;

/// Square columns on the glass, with their middle on the optical axis. x grows along a row; the
/// first row has the greatest y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Columns in a row.
    pub columns: usize,
    /// The number of rows.
    pub rows: usize,
    /// The side of a column.
    pub pitch_um: f64,
}

impl Grid {
    /// Returns the smallest grid that holds a rectangle centered on the axis.
    pub fn over(size: [Length; 2], pitch: Length) -> Self {
        // Rounding may raise decimal sizes slightly above whole columns.
        let count = |side: Length| (side.um() / pitch.um() - 1e-9).ceil().max(1.0) as usize;
        Self { columns: count(size[0]), rows: count(size[1]), pitch_um: pitch.um() }
    }

    /// Returns the smallest odd grid that holds a rectangle: the middle of one column is on the
    /// axis.
    pub(super) fn around([width, height]: [Length; 2], pitch: Length) -> Self {
        // An odd number, so that the middle of a column is on the axis.
        let count = |side: Length| 2 * (side.um() / pitch.um() / 2.0).ceil() as usize + 1;
        Self { columns: count(width), rows: count(height), pitch_um: pitch.um() }
    }

    /// Returns the number of columns in all.
    pub fn count(&self) -> usize {
        self.columns * self.rows
    }

    /// Returns the x of the middle of a column, in micrometers.
    pub fn x_um(&self, column: usize) -> f64 {
        (column as f64 - (self.columns as f64 - 1.0) / 2.0) * self.pitch_um
    }

    /// Returns the y of the middle of a row, in micrometers.
    pub fn y_um(&self, row: usize) -> f64 {
        ((self.rows as f64 - 1.0) / 2.0 - row as f64) * self.pitch_um
    }

    /// Returns the map of a shape that is round about the axis, by its height at a distance from
    /// it.
    pub fn round(&self, height_um: impl Fn(f64) -> f64 + Sync) -> HeightMap {
        HeightMap { grid: *self, heights_um: self.map(|x, y| height_um(x.hypot(y))) }
    }

    /// Returns the value of each column at its middle, row by row.
    pub(super) fn map(&self, value: impl Fn(f64, f64) -> f64 + Sync) -> Vec<f64> {
        let mut values = vec![0.0; self.count()];
        values.par_chunks_mut(self.columns.max(1)).enumerate().for_each(|(row, values)| {
            let y = self.y_um(row);
            for (column, place) in values.iter_mut().enumerate() {
                *place = value(self.x_um(column), y);
            }
        });
        values
    }
}

/// The height of each column of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMap {
    /// Where the columns are.
    pub grid: Grid,
    /// Their heights in micrometers, row by row; 0 where nothing is wanted.
    pub heights_um: Vec<f64>,
}

impl HeightMap {
    /// Returns the row nearest to the middle that holds a highest column.
    pub fn highest_row(&self) -> usize {
        let (grid, most) = (self.grid, self.highest_um());
        // Rounding makes equal shapes differ.
        let is_highest = |row: &usize| {
            self.heights_um[row * grid.columns..][..grid.columns]
                .iter()
                .any(|&um| um >= most - 1e-6)
        };
        // Twice the distance, which is whole for odd and even numbers of rows.
        let from_middle = |row: &usize| (2 * row + 1).abs_diff(grid.rows);
        (0..grid.rows).filter(is_highest).min_by_key(from_middle).unwrap_or(grid.rows / 2)
    }

    /// Returns each column's height minus its height in another map of the same grid.
    pub fn less(&self, other: &Self) -> Vec<f64> {
        self.heights_um.iter().zip(&other.heights_um).map(|(one, other)| one - other).collect()
    }

    /// Returns the height of a column, in micrometers.
    pub fn height_um(&self, column: usize, row: usize) -> f64 {
        self.heights_um[row * self.grid.columns + column]
    }

    /// Returns the greatest height, in micrometers.
    pub fn highest_um(&self) -> f64 {
        self.heights_um.iter().copied().fold(0.0, f64::max)
    }

    /// Returns the number of columns that have a height below `least`.
    pub fn lower_than(&self, least: Length) -> usize {
        self.heights_um.iter().filter(|&&um| um > 0.0 && um < least.um()).count()
    }

    /// Returns the number of columns that have a height outside of a range.
    pub fn outside(&self, least: Length, most: Length) -> usize {
        let range = least.um()..=most.um();
        self.heights_um.iter().filter(|&um| *um > 0.0 && !range.contains(um)).count()
    }

    /// Checks that no column is higher than the chamber.
    ///
    /// # Errors
    /// Returns an error that names the highest one.
    pub fn check_chamber(&self, chamber: Length) -> Result<(), TargetError> {
        let highest = self.highest_um();
        if highest <= chamber.um() {
            return Ok(());
        }
        let at = self.heights_um.iter().position(|&um| um == highest).unwrap_or(0);
        let place = Place::of(&self.grid, at);
        Err(TargetError::AboveChamber { place, height: Length::from_um(highest), chamber })
    }
}

/// A column, for messages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Its number in the row, from 0.
    pub column: usize,
    /// Its row, from 0.
    pub row: usize,
    /// The x of its middle.
    pub x: Length,
    /// The y of its middle.
    pub y: Length,
}

impl Place {
    pub(crate) fn of(grid: &Grid, at: usize) -> Self {
        let (column, row) = (at % grid.columns, at / grid.columns);
        let [x, y] = [grid.x_um(column), grid.y_um(row)];
        let [x, y] = [x, y].map(|um| Length::from_um(um).to_whole_nm());
        Self { column, row, x, y }
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { column, row, x, y } = self;
        write!(f, "column {column} of row {row} (x {x}, y {y})")
    }
}
