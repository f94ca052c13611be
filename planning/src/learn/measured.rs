//! Reads the measurements of a print.

use std::collections::{BTreeSet, HashMap, HashSet};

use lamp_grayscale::calibrate::{CsvTable, NumberRow};

use super::error::MeasuredError;
use crate::cure_section::{Place, PlaceSize, Places};

const HEIGHTS: [&str; 5] = ["x_mm", "y_mm", "z_mm", "measured_mm", "sd_um"];
const AREAS: [&str; 3] = ["layer", "over_px", "under_px"];
/// The standard deviation of heights that do not state one.
const USUAL_SD_UM: f64 = 20.0;
/// The standard deviation of volumes that do not state one, as a share, and the least one, of a cube of
/// 10 um.
const USUAL_VOLUME_SD: f64 = 0.02;
const LEAST_VOLUME_MM3: f64 = 1e-6;
/// The least standard deviation of heights, in micrometers: steps between atoms are not much smaller.
const LEAST_SD_UM: f64 = 0.001;

/// The measurements of a print.
#[derive(Clone, Debug, PartialEq)]
pub enum PrintMeasurements {
    /// Heights of faces that look down.
    Heights(Vec<HeightRow>),
    /// Wrongly cured pixels of layers.
    Areas(Vec<AreaRow>),
    /// Sizes of named places, all of which are wanted and measured.
    Places {
        /// The places.
        places: Places,
        /// Another table of the same print.
        table: Option<Box<PrintMeasurements>>,
    },
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

/// Returns a size as a length in micrometers: a volume is a cube's.
fn length_um(size: Option<PlaceSize>) -> f64 {
    match size {
        Some(PlaceSize::Length(length)) => length.um(),
        Some(PlaceSize::Volume(mm3)) => 1000.0 * mm3.cbrt(),
        None => 0.0,
    }
}

/// Returns whether a text is a file of places, and no table.
fn is_places(text: &str) -> bool {
    // A comma comes before any equals sign in the header of a table.
    let first =
        text.lines().map(str::trim).find(|line| !(line.is_empty() || line.starts_with('#')));
    first.is_some_and(|line| line.starts_with("[[") || line.contains('='))
}

/// Returns the standard deviation of a place's measured size, in its unit.
pub(crate) fn sd_of_place(place: &Place, size: f64) -> f64 {
    match (place.sd, place.unit()) {
        (Some(sd), _) => sd.number(),
        (None, "mm3") => (USUAL_VOLUME_SD * size).max(LEAST_VOLUME_MM3),
        (None, _) => USUAL_SD_UM,
    }
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
            (
                Self::Places { places: own, table: own_table },
                Self::Places { places: other, table },
            ) => {
                let is_same = |(own, other): (&Place, &Place)| {
                    own.shape == other.shape && own.wanted == other.wanted
                };
                let are_same = own.all().len() == other.all().len()
                    && own.all().iter().zip(other.all()).all(is_same);
                match (own_table, table) {
                    // The error is the table's.
                    (Some(own), Some(other)) => own.is_comparable(other),
                    (None, None) => are_same,
                    _ => false,
                }
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
            Self::Places { table: Some(table), .. } => table.error(),
            Self::Places { places, table: None } => {
                let square = |place: &Place| {
                    let [measured, wanted] = [place.measured, place.wanted].map(length_um);
                    (measured - wanted).powi(2)
                };
                let squares: f64 = places.all().iter().map(square).sum();
                PrintError::Micrometers((squares / places.all().len() as f64).sqrt())
            }
        }
    }

    /// Joins the texts of two tables of one print, one of which has named places. Returns `None` if not
    /// just one has.
    pub fn joined(texts: [&str; 2]) -> Option<String> {
        let [one, other] = texts;
        let (places, table) = match [one, other].map(is_places) {
            [true, false] => (one, other),
            [false, true] => (other, one),
            _ => return None,
        };
        // A key of the file stands before its places.
        Some(format!("csv = {}\n\n{places}", toml::Value::from(table)))
    }

    fn places(text: &str) -> Result<Self, MeasuredError> {
        let (places, table) = Places::parse_with_table(text)?;
        let table = table.map(|table| match is_places(&table) {
            true => Err(MeasuredError::PlacesTwice),
            false => Self::parse(&table).map(Box::new),
        });
        let table = table.transpose()?;
        let measured: Vec<_> =
            places.all().iter().filter(|place| place.measured.is_some()).cloned().collect();
        for place in &measured {
            let name = || place.name.clone();
            if place.wanted.is_none() {
                return Err(MeasuredError::NoWanted(name()));
            }
            let least = match place.sd {
                Some(PlaceSize::Length(_)) => LEAST_SD_UM,
                _ => f64::MIN_POSITIVE,
            };
            if let Some(sd) = place.sd.filter(|sd| !(least..1e9).contains(&sd.number())) {
                return Err(MeasuredError::PlaceDeviation { name: name(), sd });
            }
        }
        match measured.is_empty() {
            true => Err(MeasuredError::NoPlaceMeasured),
            false => Ok(Self::Places { places: Places::of(measured), table }),
        }
    }

    /// Reads a table: of heights, or of areas if it has the column `layer`; or a file of places.
    ///
    /// # Errors
    /// Returns an error if a column is missing or unknown, a number is impossible, a place or
    /// layer is listed twice, or a measured place has no wanted size.
    pub fn parse(text: &str) -> Result<Self, MeasuredError> {
        if is_places(text) {
            return Self::places(text);
        }
        let table = CsvTable::parse(text)?;
        let has = |column: &str| table.columns().iter().any(|name| name == column);
        let measured = if has("layer") { Self::areas(&table)? } else { Self::heights(&table)? };
        let count = match &measured {
            Self::Heights(rows) => rows.len(),
            Self::Areas(rows) => rows.len(),
            Self::Places { places, .. } => places.all().len(),
        };
        if count == 0 {
            return Err(MeasuredError::Empty);
        }
        Ok(measured)
    }

    /// Returns the table or the file of places, which [`parse`](Self::parse) reads.
    pub fn to_text(&self) -> String {
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
            Self::Places { places, table } => {
                let table = table.as_ref().map(|table| table.to_text());
                let csv = table.map(|csv| format!("csv = {}\n\n", toml::Value::from(csv)));
                return csv.unwrap_or_default() + &places.to_toml();
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
    fn places_are_told_from_tables() {
        let place =
            |keys: &str| format!("# measured\n[[place]]\nname = 'p'\nx = '1mm'\ny = '1mm'\n{keys}");
        let parse = PrintMeasurements::parse;
        let known = parse(&place("wanted = '500um'\nmeasured = '480um'")).unwrap();
        assert_eq!(known.error(), PrintError::Micrometers(20.0));
        let other = parse(&place("wanted = '500um'\nmeasured = '490um'")).unwrap();
        assert!(known.is_comparable(&other));
        let wider = parse(&place("wanted = '501um'\nmeasured = '490um'")).unwrap();
        assert!(!known.is_comparable(&wider));
        let refused = |keys: &str| parse(&place(keys)).unwrap_err();
        assert_eq!(refused("measured = '480um'"), MeasuredError::NoWanted("p".to_owned()));
        assert_eq!(refused("wanted = '480um'"), MeasuredError::NoPlaceMeasured);
        let both = "wanted = '480um'\nmeasured = '480um'\n";
        let exact = refused(&format!("{both}sd = '0um'")).to_string();
        assert_eq!(exact, "the place p: a standard deviation of 0.0 um is impossible");
        let joined = |other: &str| PrintMeasurements::joined([other, &place(both)]).unwrap();
        let table = "layer,over_px,under_px\n7,5,0\n";
        assert_eq!(parse(&joined(table)).unwrap().error(), PrintError::Pixels(5.0));
        assert!(!parse(&joined(table)).unwrap().is_comparable(&known));
        assert_eq!(PrintMeasurements::joined([table, table]), None);
        let twice = format!("csv = \"\"\"\n{}\"\"\"\n{}", place(both), place(both));
        assert_eq!(parse(&twice), Err(MeasuredError::PlacesTwice));
        // A volume counts as the side of its cube.
        let volume = "[[place]]\nname = 'all'\nwanted = '8mm3'\nmeasured = '1mm3'\n";
        assert_eq!(parse(volume).unwrap().error(), PrintError::Micrometers(1000.0));
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
