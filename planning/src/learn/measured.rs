//! Reads the measurements of a print.

use std::collections::{BTreeSet, HashMap, HashSet};

use lamp_grayscale::calibrate::{CsvTable, NumberRow};

use super::error::MeasuredError;

const HEIGHTS: [&str; 5] = ["x_mm", "y_mm", "z_mm", "measured_mm", "sd_um"];
const AREAS: [&str; 3] = ["layer", "over_px", "under_px"];
/// The standard deviation of heights that do not state one.
const USUAL_SD_UM: f64 = 20.0;
/// The least standard deviation of heights, in micrometers: steps between atoms are not much smaller.
const LEAST_SD_UM: f64 = 0.001;

/// The measurements of a print.
#[derive(Clone, Debug, PartialEq)]
pub enum PrintMeasurements {
    /// Heights of faces that look down.
    Heights(Vec<HeightRow>),
    /// Wrongly cured pixels of layers.
    Areas(Vec<AreaRow>),
}

/// A measured height, in part coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightRow {
    /// Its line in the table, from 1.
    pub line: usize,
    /// Where the face is, along x and y.
    pub place_mm: [f64; 2],
    /// The height of the face in the part.
    pub z_mm: f64,
    /// The height where resin is cured.
    pub measured_mm: f64,
    /// The standard deviation of the measurement.
    pub sd_um: f64,
}

impl HeightRow {
    /// Returns the place and the height of the face, for comparisons: 0 and -0 are the same.
    fn place(&self) -> [u64; 3] {
        let [x, y] = self.place_mm;
        [x, y, self.z_mm].map(|number| (number + 0.0).to_bits())
    }
}

/// A layer's wrongly cured pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaRow {
    /// Its line in the table, from 1.
    pub line: usize,
    /// The number of the layer.
    pub layer: u32,
    /// Pixels that are cured but not wanted.
    pub over: f64,
    /// Pixels that are wanted but not cured.
    pub under: f64,
}

/// The error of a print.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PrintError {
    /// Wrong pixels of all layers.
    Pixels(f64),
    /// Root mean square by which heights are off, in micrometers.
    Micrometers(f64),
}

impl PrintError {
    /// Returns the number.
    pub fn number(self) -> f64 {
        let (Self::Pixels(number) | Self::Micrometers(number)) = self;
        number
    }
}

impl PrintMeasurements {
    /// Returns whether the error of another print means the same: both are of the same layers, or of heights
    /// at the same places.
    pub fn is_comparable(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Areas(own), Self::Areas(other)) => {
                let layers = |rows: &[AreaRow]| -> BTreeSet<u32> {
                    rows.iter().map(|row| row.layer).collect()
                };
                layers(own) == layers(other)
            }
            (Self::Heights(own), Self::Heights(other)) => {
                let places = |rows: &[HeightRow]| -> HashSet<[u64; 3]> {
                    rows.iter().map(HeightRow::place).collect()
                };
                own.len() == other.len() && places(own) == places(other)
            }
            _ => false,
        }
    }

    /// Returns the error of the print.
    pub fn error(&self) -> PrintError {
        match self {
            Self::Areas(rows) => {
                PrintError::Pixels(rows.iter().map(|row| row.over + row.under).sum())
            }
            Self::Heights(rows) => {
                let square = |row: &HeightRow| (1000.0 * (row.measured_mm - row.z_mm)).powi(2);
                let squares: f64 = rows.iter().map(square).sum();
                PrintError::Micrometers((squares / rows.len() as f64).sqrt())
            }
        }
    }

    /// Reads a table: of heights, or of areas if it has the column `layer`.
    ///
    /// # Errors
    /// Returns an error if a column is missing or unknown, a number is impossible, or a place or
    /// layer is listed twice.
    pub fn parse(text: &str) -> Result<Self, MeasuredError> {
        let table = CsvTable::parse(text)?;
        let has = |column: &str| table.columns().iter().any(|name| name == column);
        let measured = if has("layer") { Self::areas(&table)? } else { Self::heights(&table)? };
        let count = match &measured {
            Self::Heights(rows) => rows.len(),
            Self::Areas(rows) => rows.len(),
        };
        if count == 0 {
            return Err(MeasuredError::Empty);
        }
        Ok(measured)
    }

    /// Returns the table, which [`parse`](Self::parse) reads.
    pub fn to_csv(&self) -> String {
        let (columns, rows): (&[&str], Vec<String>) = match self {
            Self::Heights(rows) => {
                let line = |row: &HeightRow| {
                    let [x, y] = row.place_mm;
                    format!("{x},{y},{},{},{}\n", row.z_mm, row.measured_mm, row.sd_um)
                };
                (&HEIGHTS, rows.iter().map(line).collect())
            }
            Self::Areas(rows) => {
                let line = |row: &AreaRow| format!("{},{},{}\n", row.layer, row.over, row.under);
                (&AREAS, rows.iter().map(line).collect())
            }
        };
        format!("{}\n{}", columns.join(","), rows.concat())
    }

    fn heights(table: &CsvTable) -> Result<Self, MeasuredError> {
        let (mut rows, mut known) = (Vec::new(), HashMap::new());
        for NumberRow { line, numbers: [x, y, z, measured, sd] } in table.numbers(&HEIGHTS, 4)? {
            let number = |number: Option<f64>| number.unwrap_or_default();
            let sd_um = sd.unwrap_or(USUAL_SD_UM);
            if sd_um < LEAST_SD_UM {
                return Err(MeasuredError::Deviation { line, sd_um, least: LEAST_SD_UM });
            }
            let row = HeightRow {
                line,
                place_mm: [number(x), number(y)],
                z_mm: number(z),
                measured_mm: number(measured),
                sd_um,
            };
            if let Some(first) = known.insert(row.place(), line) {
                return Err(MeasuredError::SamePlace { line, first });
            }
            rows.push(row);
        }
        Ok(Self::Heights(rows))
    }

    fn areas(table: &CsvTable) -> Result<Self, MeasuredError> {
        let mut rows: Vec<AreaRow> = Vec::new();
        for NumberRow { line, numbers: [layer, over, under] } in table.numbers(&AREAS, 3)? {
            let number = |number: Option<f64>| number.unwrap_or_default();
            let (layer, over, under) = (number(layer), number(over), number(under));
            if layer.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&layer) {
                return Err(MeasuredError::NotALayer { line, layer });
            }
            if over < 0.0 || under < 0.0 {
                return Err(MeasuredError::Negative { line });
            }
            let row = AreaRow { line, layer: layer as u32, over, under };
            if let Some(first) = rows.iter().find(|other| other.layer == row.layer) {
                let first = first.line;
                return Err(MeasuredError::SameLayer { line, layer: row.layer, first });
            }
            rows.push(row);
        }
        Ok(Self::Areas(rows))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_told_apart_by_their_columns() {
        let heights = PrintMeasurements::parse("x_mm,y_mm,z_mm,measured_mm\n1,2,3,2.9\n").unwrap();
        let row = HeightRow {
            line: 2,
            place_mm: [1.0, 2.0],
            z_mm: 3.0,
            measured_mm: 2.9,
            sd_um: USUAL_SD_UM,
        };
        assert_eq!(heights, PrintMeasurements::Heights(vec![row]));
        let areas = PrintMeasurements::parse("layer,over_px,under_px\n7,5,0\n").unwrap();
        let row = AreaRow { line: 2, layer: 7, over: 5.0, under: 0.0 };
        assert_eq!(areas, PrintMeasurements::Areas(vec![row]));
    }

    #[test]
    fn impossible_measurements_are_refused() {
        let refused = |text: &str| PrintMeasurements::parse(text).unwrap_err();
        assert_eq!(refused("layer,over_px,under_px\n"), MeasuredError::Empty);
        let negative = "layer,over_px,under_px\n7,-1,0\n";
        assert_eq!(refused(negative), MeasuredError::Negative { line: 2 });
        let half = "layer,over_px,under_px\n7.5,1,0\n";
        assert_eq!(refused(half), MeasuredError::NotALayer { line: 2, layer: 7.5 });
        let twice = "layer,over_px,under_px\n7,1,0\n7,2,0\n";
        assert_eq!(refused(twice), MeasuredError::SameLayer { line: 3, layer: 7, first: 2 });
        for sd_um in [0.0, -1.0, 1e-9] {
            let exact = format!("x_mm,y_mm,z_mm,measured_mm,sd_um\n1,2,3,2.9,{sd_um}\n");
            let refusal = MeasuredError::Deviation { line: 2, sd_um, least: LEAST_SD_UM };
            assert_eq!(refused(&exact), refusal);
        }
        let place = "x_mm,y_mm,z_mm,measured_mm\n1,2,3,2.9\n1,2,3,2.8\n";
        assert_eq!(refused(place), MeasuredError::SamePlace { line: 3, first: 2 });
    }
}
