//! Reads cure depths and widths from tables.

use lamp_stack::{Dpi, Length};
use thiserror::Error;

use super::columns::{Column, DOSE, DoseColumn, EXPOSURE, LENGTHS, check_columns};
use super::csv_table::{CsvTable, TableRow};
use super::fit_scan::{LineKind, ScanDirection};
use crate::material::LawVariable;
use crate::resin::{Dose, GrayLevel, Intensity, cure_width_of_square, plausible};

/// A measured cure depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthPoint {
    /// The gray level that was exposed.
    pub gray: GrayLevel,
    /// The dose of white in the same exposure.
    pub dose: Dose,
    /// The cure depth.
    pub depth: Length,
}

impl DepthPoint {
    /// Returns the dose that arrived (002 eq. 34).
    pub fn arriving(&self) -> Dose {
        self.dose * self.gray
    }
}

/// A measured cure depth under a lamp of some light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LampPoint {
    /// The lamp's light.
    pub lamp: Intensity,
    /// The film, of full white.
    pub film: DepthPoint,
}

/// A measured cure width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WidthPoint {
    /// The square's side in the image, to the nanometer.
    pub feature_size: Length,
    /// The dose.
    pub dose: Dose,
    /// The distance of the edges outside the image.
    pub width: Length,
    /// The direction of the width, if it was measured along and across the scan apart.
    pub direction: Option<ScanDirection>,
    /// How many layers the square has, one on another.
    pub layers: u32,
}

/// A measured cure depth or cure width of a resin of some composition, or under some lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LawPoint {
    /// The quantity over which the law is.
    pub at: f64,
    /// The dose.
    pub dose: Dose,
    /// The depth or the width.
    pub measured: Length,
}

/// The films and squares of resins that differ in one quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct LawTable {
    /// The quantity.
    pub over: LawVariable,
    /// The other ingredient, in g for each 100 g of monomer, if the table has it.
    pub held: Option<f64>,
    /// Cure depths.
    pub films: Vec<LawPoint>,
    /// Cure widths.
    pub squares: Vec<LawPoint>,
    /// The side of all squares, if there are some.
    pub feature_size: Option<Length>,
}

/// The measured width of a line or a gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinePoint {
    /// The direction of the width.
    pub direction: ScanDirection,
    /// Whether the line is white, or black in white.
    pub kind: LineKind,
    /// The width in the image.
    pub drawn: Length,
    /// The dose of full white.
    pub dose: Dose,
    /// The width after curing.
    pub cured: Length,
}

/// The points of a table, and the numbers of rows without a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured<T> {
    /// The measurements.
    pub points: Vec<T>,
    /// The number of rows with nothing left to measure: films that did not cure, squares that were
    /// washed away, gaps that closed.
    pub none: usize,
    /// The number of rows with an empty measurement.
    pub blank: usize,
}

/// Why measurements cannot be read from a table.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum DataError {
    /// A column is missing.
    #[error("there is no column {0}")]
    NoColumn(&'static str),
    /// Two columns mean the same.
    #[error("columns {0} and {1} say the same thing twice: keep one")]
    Both(&'static str, &'static str),
    /// A column is not known.
    #[error("column `{column}` is not known: the possible columns are {}, and `note` for remarks", known.join(", "))]
    Unknown {
        /// Its name.
        column: String,
        /// The known columns.
        known: &'static [&'static str],
    },
    /// There are exposure times but no light.
    #[error("exposure_ms gives doses only if the intensity of full white is known, and it is not")]
    NoLight,
    /// A cell is not a number.
    #[error("line {line}, column {column}: `{text}` is not a number")]
    NotANumber {
        /// The line, from 1.
        line: usize,
        /// The column.
        column: &'static str,
        /// The cell's text.
        text: String,
    },
    /// A number is out of range.
    #[error("line {line}, column {column}: {text} is not {wanted}")]
    Impossible {
        /// The line, from 1.
        line: usize,
        /// The column.
        column: &'static str,
        /// The cell's text.
        text: String,
        /// The allowed values.
        wanted: &'static str,
    },
    /// Two ingredients change from row to row.
    #[error(
        "both {0} and {1} change from row to row: keep one of them, and fit the other in a table of \
         its own"
    )]
    BothChange(&'static str, &'static str),
    /// No ingredient is in the table.
    #[error("there is neither a column {0} nor {1}")]
    NoIngredient(&'static str, &'static str),
    /// No row has a measurement.
    #[error(
        "no row below the header holds a measurement: write a row for each film, square or line, with \
         its measurement"
    )]
    NoRows,
}

const LAMP: &str = "lamp_mw_per_cm2";
const GRAY: &str = "gray";
const DEPTH: &str = "depth_um";
const SIZE_PIXELS: &str = "feature_px";
const SIZE: &str = "feature_um";
const CURED: &str = "cured_um";
const WIDTH: &str = "width_um";
const DIRECTION: &str = "direction";
const SIDE: &str = "side_um";
const PLACE: &str = "x_um";
const KIND: &str = "kind";
const ABSORBER: &str = "uv_absorber_g_per_100g";
const LAYERS: &str = "layers";
const INITIATOR: &str = "photoinitiator_g_per_100g";

/// Reads cure depths from a table of `dose_mj_per_cm2` or, under a light, `exposure_ms`;
/// `depth_um`; and `gray`, white if that is absent. The doses are doses of full white. Rows of
/// depth zero or below cured nothing.
///
/// # Errors
/// Returns an error if a column is missing or unknown, or a cell is not a number in its range.
pub fn depth_points(
    table: &CsvTable,
    light: Option<Intensity>,
) -> Result<Measured<DepthPoint>, DataError> {
    check_columns(table, &[DOSE, EXPOSURE, GRAY, DEPTH])?;
    let dose = DoseColumn::find(table, light)?;
    let gray = Column::find(table, GRAY);
    let depth = Column::find(table, DEPTH).ok_or(DataError::NoColumn(DEPTH))?;
    measured(table, |row| {
        let dose = dose.of(row)?;
        let gray = gray.map_or(Ok(GrayLevel::WHITE), |gray| {
            let level = gray.number(row)?;
            let wanted = "a gray level from 0 (black) to 1 (white)";
            GrayLevel::new(level).ok_or_else(|| gray.impossible(row, wanted))
        })?;
        let Some(of_row) = depth.length_or_blank(row)? else { return Ok(RowContent::Blank) };
        // A film that did not cure has no depth on the curve, which begins at E_c.
        if of_row.um() <= 0.0 {
            return Ok(RowContent::Nothing);
        }
        let point = DepthPoint { gray, dose, depth: of_row };
        // Fits take the logarithm of the dose that arrives, and black has none.
        if !plausible::DOSE.contains(&point.arriving()) {
            return Err(depth.impossible(row, "what so dark a gray level cures"));
        }
        Ok(RowContent::Point(point))
    })
}

/// Reads cure depths under several lights from a table of `lamp_mw_per_cm2`, the light;
/// `dose_mj_per_cm2` or `exposure_ms`, the time under that light; and `depth_um`. Depths of zero and
/// below cured nothing.
///
/// # Errors
/// Returns an error if a column is missing or unknown, or a cell is not a number in its range.
pub fn lamp_points(table: &CsvTable) -> Result<Measured<LampPoint>, DataError> {
    check_columns(table, &[LAMP, DOSE, EXPOSURE, DEPTH])?;
    let lamp = Column::find(table, LAMP).ok_or(DataError::NoColumn(LAMP))?;
    let depth = Column::find(table, DEPTH).ok_or(DataError::NoColumn(DEPTH))?;
    measured(table, |row| {
        let light = lamp.number(row)?;
        if !(1e-6..=1e9).contains(&light) {
            return Err(lamp.impossible(row, "a light from 1e-6 to 1e9 mW/cm2"));
        }
        let lamp = Intensity::from_mw_per_cm2(light);
        let dose = DoseColumn::find(table, Some(lamp))?.of(row)?;
        Ok(match depth.length_or_blank(row)? {
            None => RowContent::Blank,
            Some(depth) if depth.um() <= 0.0 => RowContent::Nothing,
            Some(depth) => RowContent::Point(LampPoint {
                lamp,
                film: DepthPoint { gray: GrayLevel::WHITE, dose, depth },
            }),
        })
    })
}

/// Reads cure widths from a table of `dose_mj_per_cm2` or, under a light, `exposure_ms`;
/// `feature_px` or `feature_um`, the squares' side in the image; and `cured_um`, their side after
/// curing, or `width_um`, the cure width itself (002 eq. 60). `direction`, `across` or `along`, is that
/// of the width, and `layers` says how many layers a square has. Squares that did not grow count, as
/// do squares that are smaller than their image by an error of measurement. Squares of a side of
/// zero or below were washed away.
///
/// # Errors
/// Returns an error if a column is missing or unknown, or a cell is not a number in its range.
pub fn width_points(
    table: &CsvTable,
    light: Option<Intensity>,
    dpi: Dpi,
) -> Result<Measured<WidthPoint>, DataError> {
    check_columns(table, &[SIZE_PIXELS, SIZE, DOSE, EXPOSURE, CURED, WIDTH, DIRECTION, LAYERS])?;
    let [direction, layers] = [DIRECTION, LAYERS].map(|name| Column::find(table, name));
    let dose = DoseColumn::find(table, light)?;
    let (size, in_pixels) = Column::either(table, SIZE_PIXELS, SIZE)?;
    let (width, is_side) = Column::either(table, CURED, WIDTH)?;
    measured(table, |row| {
        let dose = dose.of(row)?;
        let pitch = if in_pixels { dpi.pitch().um() } else { 1.0 };
        let side = Length::from_um(size.number(row)? * pitch);
        if !LENGTHS.contains(&side.um()) {
            return Err(size.impossible(row, "a size from 0.001 um to 1 m"));
        }
        let Some(of_row) = width.length_or_blank(row)? else { return Ok(RowContent::Blank) };
        if is_side && of_row.um() <= 0.0 {
            return Ok(RowContent::Nothing);
        }
        // 002 eq. 60: both edges moved.
        let width = if is_side { cure_width_of_square(of_row, side) } else { of_row };
        let layers = match layers {
            None => 1,
            Some(layers) => match layers.text(row) {
                "" => 1,
                text => {
                    let count = text.parse().ok().filter(|count| (1..=1_000_000).contains(count));
                    count.ok_or_else(|| layers.impossible(row, "a number of layers from 1"))?
                }
            },
        };
        let direction = match direction {
            Some(direction) if !direction.text(row).is_empty() => {
                Some(direction_of(direction, row)?)
            }
            _ => None,
        };
        let feature_size = side.to_whole_nm();
        Ok(RowContent::Point(WidthPoint { feature_size, dose, width, direction, layers }))
    })
}

/// Reads cure depths and cure widths from a table of `uv_absorber_g_per_100g` and
/// `photoinitiator_g_per_100g`: one changes from row to row, and the other may be missing;
/// `dose_mj_per_cm2` or, under a light, `exposure_ms`; and for each row either `depth_um`, or
/// `cured_um` or `width_um` with `feature_px` or `feature_um`, as [`depth_points`] and
/// [`width_points`] read them. With `by_lamp`, `lamp_mw_per_cm2` takes the place of the ingredients,
/// and is the light of exposure times.
///
/// # Errors
/// Returns an error if a column is missing or unknown, if both ingredients change, if squares have
/// several sizes, or if a cell is not a number in its range.
pub fn law_points(
    table: &CsvTable,
    light: Option<Intensity>,
    dpi: Dpi,
    by_lamp: bool,
) -> Result<(LawTable, Measured<()>), DataError> {
    let columns: &'static [&'static str] = if by_lamp {
        &[LAMP, SIZE_PIXELS, SIZE, DOSE, EXPOSURE, CURED, WIDTH]
    } else {
        &[ABSORBER, INITIATOR, SIZE_PIXELS, SIZE, DOSE, EXPOSURE, DEPTH, CURED, WIDTH]
    };
    check_columns(table, columns)?;
    let (over, column, held) = law_columns(table, by_lamp)?;
    let least = if over == LawVariable::UvAbsorber { 0.0 } else { 1e-6 };
    let depth = Column::find(table, DEPTH);
    let has_squares = [CURED, WIDTH].iter().any(|name| Column::find(table, name).is_some());
    let squares = if has_squares {
        Some((Column::either(table, SIZE_PIXELS, SIZE)?, Column::either(table, CURED, WIDTH)?))
    } else {
        None
    };
    if depth.is_none() && squares.is_none() {
        return Err(DataError::NoColumn(if by_lamp { CURED } else { DEPTH }));
    }
    let (mut films, mut grown, mut feature_size) = (Vec::new(), Vec::new(), None);
    let counts = measured(table, |row| {
        let at = column.number(row)?;
        if !(least..=1e9).contains(&at) {
            return Err(column.impossible(
                row,
                match over {
                    LawVariable::UvAbsorber => "zero or more grams",
                    LawVariable::Photoinitiator => "more than zero grams",
                    LawVariable::Lamp => "a light from 1e-6 to 1e9 mW/cm2",
                },
            ));
        }
        let light = if by_lamp { Some(Intensity::from_mw_per_cm2(at)) } else { light };
        let dose = DoseColumn::find(table, light)?.of(row)?;
        let film = depth.map_or(Ok(None), |depth| depth.length_or_blank(row))?;
        let square = squares.map_or(Ok(None), |(_, (width, _))| width.length_or_blank(row))?;
        let (measured, is_film) = match (film, square) {
            (None, None) => return Ok(RowContent::Blank),
            (Some(_), Some(_)) => {
                let width = squares.map_or(column, |(_, (width, _))| width);
                return Err(width.impossible(
                    row,
                    "empty, though the row has a depth: give films and squares a row each",
                ));
            }
            (Some(depth), None) if depth.um() <= 0.0 => return Ok(RowContent::Nothing),
            (Some(depth), None) => (depth, true),
            (None, Some(width)) => (width, false),
        };
        if is_film {
            films.push(LawPoint { at, dose, measured });
            return Ok(RowContent::Point(()));
        }
        let ((size, in_pixels), (_, is_side)) = squares.expect("a square has columns");
        let pitch = if in_pixels { dpi.pitch().um() } else { 1.0 };
        let side = Length::from_um(size.number(row)? * pitch).to_whole_nm();
        if !LENGTHS.contains(&side.um()) {
            return Err(size.impossible(row, "a size from 0.001 um to 1 m"));
        }
        if *feature_size.get_or_insert(side) != side {
            return Err(size.impossible(row, "the size of the squares above: a law is of one size"));
        }
        if is_side && measured.um() <= 0.0 {
            return Ok(RowContent::Nothing);
        }
        let measured = if is_side { cure_width_of_square(measured, side) } else { measured };
        grown.push(LawPoint { at, dose, measured });
        Ok(RowContent::Point(()))
    })?;
    Ok((LawTable { over, held, films, squares: grown, feature_size }, counts))
}

/// Returns the quantity that changes from row to row, its column, and the other ingredient.
fn law_columns(
    table: &CsvTable,
    by_lamp: bool,
) -> Result<(LawVariable, Column, Option<f64>), DataError> {
    if by_lamp {
        let lamp = Column::find(table, LAMP).ok_or(DataError::NoColumn(LAMP))?;
        return Ok((LawVariable::Lamp, lamp, None));
    }
    // Without rows, no ingredient changes.
    if table.rows().is_empty() {
        return Err(DataError::NoRows);
    }
    // The one number of a column, if all its rows have the same.
    let only = |column: Column| -> Result<Option<f64>, DataError> {
        let mut numbers = table.rows().iter().map(|row| column.number(row));
        let Some(first) = numbers.next().transpose()? else { return Ok(None) };
        let same = numbers.try_fold(true, |same, next| Ok(same && next? == first))?;
        Ok(same.then_some(first))
    };
    let [absorber, initiator] = [ABSORBER, INITIATOR].map(|name| Column::find(table, name));
    let (absorber, initiator) = match (absorber, initiator) {
        (None, None) => return Err(DataError::NoIngredient(ABSORBER, INITIATOR)),
        (Some(absorber), None) => return Ok((LawVariable::UvAbsorber, absorber, None)),
        (None, Some(initiator)) => return Ok((LawVariable::Photoinitiator, initiator, None)),
        (Some(absorber), Some(initiator)) => (absorber, initiator),
    };
    match (only(absorber)?, only(initiator)?) {
        // 002 section 3.4.8 d: effects of both together are not known.
        (None, None) => Err(DataError::BothChange(ABSORBER, INITIATOR)),
        (_, held @ Some(_)) => Ok((LawVariable::UvAbsorber, absorber, held)),
        (held, None) => Ok((LawVariable::Photoinitiator, initiator, held)),
    }
}

/// Reads the widths of lines and gaps from a table of `direction`, `across` or `along`; `kind`,
/// `line` or `gap`; `feature_px` or `feature_um`, the width in the image; `dose_mj_per_cm2` or, under
/// a light, `exposure_ms`; and `cured_um`, the width after curing. Lines of a width of zero or below
/// did not cure, and such gaps closed.
///
/// # Errors
/// Returns an error if a column is missing or unknown, or a cell is not a number in its range or a
/// known word.
pub fn line_points(
    table: &CsvTable,
    light: Option<Intensity>,
    dpi: Dpi,
) -> Result<Measured<LinePoint>, DataError> {
    check_columns(table, &[DIRECTION, KIND, SIZE_PIXELS, SIZE, DOSE, EXPOSURE, CURED])?;
    let needed = |name| Column::find(table, name).ok_or(DataError::NoColumn(name));
    let [direction, kind, cured] = [needed(DIRECTION)?, needed(KIND)?, needed(CURED)?];
    let dose = DoseColumn::find(table, light)?;
    let (size, in_pixels) = Column::either(table, SIZE_PIXELS, SIZE)?;
    measured(table, |row| {
        let pitch = if in_pixels { dpi.pitch().um() } else { 1.0 };
        let drawn = Length::from_um(size.number(row)? * pitch);
        if !LENGTHS.contains(&drawn.um()) {
            return Err(size.impossible(row, "a width from 0.001 um to 1 m"));
        }
        let direction = direction_of(direction, row)?;
        let kind: LineKind =
            kind.text(row).parse().map_err(|_| kind.impossible(row, "`line` or `gap`"))?;
        let dose = dose.of(row)?;
        Ok(match cured.length_or_blank(row)? {
            None => RowContent::Blank,
            Some(cured) if cured.um() <= 0.0 => RowContent::Nothing,
            Some(cured) => RowContent::Point(LinePoint { direction, kind, drawn, dose, cured }),
        })
    })
}

/// A point at the edge of a square's light, seen from the side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfilePoint {
    /// The gray level of the square.
    pub gray: GrayLevel,
    /// The side of the square in the image.
    pub side: Length,
    /// The place, from the middle of the square.
    pub place: Length,
    /// How deep the edge is there.
    pub depth: Length,
    /// The dose of white in a wide field, if the edge is of a cured square.
    pub dose: Option<Dose>,
}

/// Reads the edges of squares seen from the side from a table of `gray`, the level from 0 (black) to 1
/// (white), white if that is absent; `side_um`, the square's side; `x_um`, the place from its middle;
/// `depth_um`; and, of cured squares, `dose_mj_per_cm2` or, under a light, `exposure_ms`. Rows of depth
/// zero or below are beyond the edge.
///
/// # Errors
/// Returns an error if a column is missing or unknown, or a cell is not a number in its range.
pub fn profile_points(
    table: &CsvTable,
    light: Option<Intensity>,
) -> Result<Measured<ProfilePoint>, DataError> {
    check_columns(table, &[GRAY, SIDE, PLACE, DEPTH, DOSE, EXPOSURE])?;
    let needed = |name| Column::find(table, name).ok_or(DataError::NoColumn(name));
    let [side, place, depth] = [needed(SIDE)?, needed(PLACE)?, needed(DEPTH)?];
    let gray = Column::find(table, GRAY);
    let has_doses = [DOSE, EXPOSURE].iter().any(|name| Column::find(table, name).is_some());
    let dose = has_doses.then(|| DoseColumn::find(table, light)).transpose()?;
    measured(table, |row| {
        let gray = gray.map_or(Ok(GrayLevel::WHITE), |gray| {
            let level = gray.number(row)?;
            let wanted = "a gray level above 0 (black) up to 1 (white)";
            let level = GrayLevel::new(level).filter(|level| level.get() > 0.0);
            level.ok_or_else(|| gray.impossible(row, wanted))
        })?;
        let um = side.number(row)?;
        // Less is in millimeters: no projector has such squares.
        if !(2.0..=*LENGTHS.end()).contains(&um) {
            return Err(side.impossible(row, "a side from 2 um to 1 m"));
        }
        let at = place.number(row)?;
        if at.abs() > *LENGTHS.end() {
            return Err(place.impossible(row, "a place within 1 m of the middle"));
        }
        let dose = dose.as_ref().map(|dose| dose.of(row)).transpose()?;
        let [side, place] = [um, at].map(Length::from_um);
        Ok(match depth.length_or_blank(row)? {
            None => RowContent::Blank,
            Some(depth) if depth.um() <= 0.0 => RowContent::Nothing,
            Some(depth) => RowContent::Point(ProfilePoint { gray, side, place, depth, dose }),
        })
    })
}

fn direction_of(column: Column, row: &TableRow) -> Result<ScanDirection, DataError> {
    column.text(row).parse().map_err(|_| column.impossible(row, "`across` or `along`"))
}

/// The content of a row.
enum RowContent<T> {
    Point(T),
    Nothing,
    Blank,
}

fn measured<T>(
    table: &CsvTable,
    mut read: impl FnMut(&TableRow) -> Result<RowContent<T>, DataError>,
) -> Result<Measured<T>, DataError> {
    let mut measured = Measured { points: Vec::new(), none: 0, blank: 0 };
    for row in table.rows() {
        match read(row)? {
            RowContent::Point(point) => measured.points.push(point),
            RowContent::Nothing => measured.none += 1,
            RowContent::Blank => measured.blank += 1,
        }
    }
    if measured.points.len() + measured.none == 0 {
        return Err(DataError::NoRows);
    }
    Ok(measured)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn depths(text: &str) -> Result<Measured<DepthPoint>, DataError> {
        depth_points(&CsvTable::parse(text).unwrap(), Some(Intensity::from_mw_per_cm2(1600.0)))
    }

    fn widths(text: &str) -> Result<Measured<WidthPoint>, DataError> {
        width_points(&CsvTable::parse(text).unwrap(), None, Dpi::new(1500.0).unwrap())
    }

    #[test]
    fn depths_over_doses_and_over_times() {
        let by_dose = depths("dose_mj_per_cm2,depth_um\n320,188\n100,0\n50,-1\n640,\n").unwrap();
        assert_eq!((by_dose.points.len(), by_dose.none, by_dose.blank), (1, 2, 1));
        let point = by_dose.points[0];
        assert_eq!((point.dose.mj_per_cm2(), point.depth.um()), (320.0, 188.0));
        assert_eq!(point.arriving(), point.dose);
        // 200 ms at 1.6 W/cm².
        let by_time = depths("note,gray,depth_um,exposure_ms\nclear,0.5,188,200\n").unwrap();
        assert_eq!(by_time.points[0].dose, point.dose);
        assert_eq!(by_time.points[0].arriving().mj_per_cm2(), 160.0);
    }

    #[test]
    fn times_under_a_lamp_make_doses_of_its_light() {
        let read = |text: &str| lamp_points(&CsvTable::parse(text).unwrap());
        let films =
            read("lamp_mw_per_cm2,exposure_ms,depth_um\n800,400,188\n1600,200,0\n").unwrap();
        assert_eq!((films.points.len(), films.none), (1, 1));
        assert_eq!(films.points[0].lamp.mw_per_cm2(), 800.0);
        assert_eq!(films.points[0].film.dose.mj_per_cm2(), 320.0);
        let wrong = read("lamp_mw_per_cm2,dose_mj_per_cm2,depth_um\n0,400,188\n").unwrap_err();
        assert!(wrong.to_string().contains("0 is not a light from 1e-6"), "{wrong}");
        let none = read("dose_mj_per_cm2,depth_um\n400,188\n").unwrap_err();
        assert_eq!(none, DataError::NoColumn("lamp_mw_per_cm2"));
    }

    #[test]
    fn widths_of_sides_and_widths() {
        // 25 pixels of 1500 dpi are 423.33 um.
        let sides =
            "feature_px,dose_mj_per_cm2,cured_um\n25,200,450\n25,100,420\n25,300,\n25,20,0\n";
        let by_side = widths(sides).unwrap();
        assert_eq!((by_side.points.len(), by_side.none, by_side.blank), (2, 1, 1));
        let [point, smaller] = by_side.points[..] else { panic!("two points") };
        assert!((smaller.width.um() + 1.666667).abs() < 1e-6);
        assert_eq!(point.feature_size.to_string(), "423.333um");
        assert!((point.width.um() - 13.333333).abs() < 1e-6);
        // No growth is a measurement.
        let none = "feature_um,dose_mj_per_cm2,width_um\n423,200,0\n";
        assert_eq!(widths(none).unwrap().points[0].width.um(), 0.0);
        let by_width = widths("feature_um,dose_mj_per_cm2,width_um\n423,200,13.3\n").unwrap();
        assert_eq!(by_width.points[0].feature_size.um(), 423.0);
        assert_eq!(by_width.points[0].width.um(), 13.3);
    }

    #[test]
    fn squares_may_have_directions_and_layers() {
        let head = "feature_um,dose_mj_per_cm2,width_um,direction,layers\n";
        let read = |row: &str| widths(&format!("{head}{row}\n"));
        let point = read("500,100,3,along,").unwrap().points[0];
        assert_eq!((point.direction, point.layers), (Some(ScanDirection::Along), 1));
        let point = read("500,100,3,,20").unwrap().points[0];
        assert_eq!((point.direction, point.layers), (None, 20));
        for (row, words) in [
            ("500,100,3,up,1", "column direction: up is not `across` or `along`"),
            ("500,100,3,,0", "column layers: 0 is not a number of layers"),
            ("500,100,3,,1.5", "column layers: 1.5 is not"),
        ] {
            let said = read(row).unwrap_err().to_string();
            assert!(said.contains(words), "{said}");
        }
    }

    #[test]
    fn films_and_squares_of_compositions() {
        let read = |text: &str, by_lamp| {
            let table = CsvTable::parse(text).unwrap();
            law_points(&table, None, Dpi::new(1000.0).unwrap(), by_lamp)
        };
        let text = "uv_absorber_g_per_100g,photoinitiator_g_per_100g,dose_mj_per_cm2,depth_um,\
                    feature_px,cured_um\n0,6,100,50,,\n0.1,6,100,-2,,\n0.1,6,200,,100,2560\n\
                    0.1,6,200,,,\n";
        let (law, counts) = read(text, false).unwrap();
        assert_eq!((law.over, law.held), (LawVariable::UvAbsorber, Some(6.0)));
        assert_eq!((counts.points.len(), counts.none, counts.blank), (2, 1, 1));
        assert_eq!((law.films[0].at, law.films[0].measured.um()), (0.0, 50.0));
        assert_eq!((law.squares[0].at, law.feature_size.unwrap().um()), (0.1, 2540.0));
        assert!((law.squares[0].measured.um() - 10.0).abs() < 1e-9);
        let other = read(&text.replace("0.1,6", "0,5"), false).unwrap().0;
        assert_eq!((other.over, other.held), (LawVariable::Photoinitiator, Some(0.0)));
        let lamp = "lamp_mw_per_cm2,exposure_ms,feature_um,width_um\n800,500,2540,12\n";
        let lamp = read(lamp, true).unwrap().0;
        assert_eq!((lamp.over, lamp.squares[0].at), (LawVariable::Lamp, 800.0));
        assert_eq!(lamp.squares[0].dose.mj_per_cm2(), 400.0);
        let refused = |text: &str| read(text, false).unwrap_err().to_string();
        for (text, words) in [
            (text.replacen("0,6,100", "0,5,100", 1), "both uv_absorber_g_per_100g and photo"),
            (text.lines().next().unwrap().to_owned(), "no row below the header"),
            (text.replace("50,,", "50,100,2560"), "each"),
            (
                text.to_owned() + "0.1,6,200,,101,2560\n",
                "column feature_px: 101 is not the size of",
            ),
            (text.replace("0.1,6", "-1,6"), "-1 is not zero or more grams"),
            (
                text.replace("uv_absorber_g_per_100g", "note")
                    .replace("photoinitiator_g_per_100g", "x"),
                "`x` is not known",
            ),
            ("dose_mj_per_cm2,depth_um\n1,1\n".to_owned(), "neither a column uv_absorber"),
            ("uv_absorber_g_per_100g,dose_mj_per_cm2\n0,1\n".to_owned(), "no column depth_um"),
        ] {
            let said = refused(&text);
            assert!(said.contains(words), "{said} for {words}");
        }
    }

    #[test]
    fn lines_have_directions_and_kinds() {
        let lines = |text: &str| {
            let table = CsvTable::parse(text).unwrap();
            line_points(&table, None, Dpi::new(1000.0).unwrap())
        };
        let head = "direction,kind,feature_px,dose_mj_per_cm2,cured_um\n";
        let read = lines(&format!("{head}across,line,2,90,55\nalong,gap,3,90,0\nalong,gap,4,9,\n"));
        let read = read.unwrap();
        assert_eq!((read.points.len(), read.none, read.blank), (1, 1, 1));
        let line = read.points[0];
        assert_eq!((line.direction, line.kind), (ScanDirection::Across, LineKind::Line));
        assert!((line.drawn.um() - 50.8).abs() < 1e-9 && line.cured.um() == 55.0);
        for (row, words) in [
            ("up,line,2,90,55", "column direction: up is not `across` or `along`"),
            ("along,hole,2,90,55", "column kind: hole is not `line` or `gap`"),
            ("along,gap,0,90,55", "column feature_px: 0 is not a width"),
            ("along,gap,2,90,NaN", "column cured_um: `NaN` is not a number"),
        ] {
            let said = lines(&format!("{head}{row}\n")).unwrap_err().to_string();
            assert!(said.contains(words), "{said}");
        }
        assert_eq!(lines("kind\nline\n"), Err(DataError::NoColumn(DIRECTION)));
    }

    #[test]
    fn profiles_have_places_and_perhaps_doses() {
        let profiles = |text: &str| profile_points(&CsvTable::parse(text).unwrap(), None);
        let head = "gray,side_um,x_um,depth_um\n";
        let read = profiles(&format!("{head}0.5,300,-20,55\n1,300,400,0\n1,300,40,\n")).unwrap();
        assert_eq!((read.points.len(), read.none, read.blank), (1, 1, 1));
        let point = read.points[0];
        assert_eq!((point.gray.get(), point.place.um(), point.dose), (0.5, -20.0, None));
        let dosed = profiles("side_um,x_um,depth_um,dose_mj_per_cm2\n300,0,55,90\n").unwrap();
        assert_eq!(dosed.points[0].dose, Some(Dose::from_mj_per_cm2(90.0)));
        assert_eq!(dosed.points[0].gray, GrayLevel::WHITE);
        for (row, words) in [
            ("0,300,0,55", "column gray: 0 is not a gray level above 0 (black)"),
            ("1,0.5,0,55", "column side_um: 0.5 is not a side from 2 um"),
            ("1,300,2e6,55", "column x_um: 2e6 is not a place within 1 m"),
            ("1,300,x,55", "column x_um: `x` is not a number"),
        ] {
            let said = profiles(&format!("{head}{row}\n")).unwrap_err().to_string();
            assert!(said.contains(words), "{said}");
        }
        assert_eq!(profiles("side_um,x_um\n1,1\n"), Err(DataError::NoColumn(DEPTH)));
    }

    #[test]
    fn errors_say_where() {
        for (text, words) in [
            ("depth_um\n1", "there is no column dose_mj_per_cm2"),
            ("dose_mj_per_cm2\n1", "there is no column depth_um"),
            ("dose_mj_per_cm2,exposure_ms,depth_um\n1,1,1", "say the same thing twice"),
            ("dose_mj_per_cm2,depth_um,grey\n1,1,1", "column `grey` is not known"),
            ("dose_mj_per_cm2,depth_um\n1,2\nx,1", "line 3, column dose_mj_per_cm2: `x` is not a"),
            ("dose_mj_per_cm2,depth_um\n1,inf", "line 2, column depth_um: `inf` is not a number"),
            ("dose_mj_per_cm2,depth_um\n,2", "line 2, column dose_mj_per_cm2: `` is not a number"),
            ("dose_mj_per_cm2,depth_um\n0,2", "column dose_mj_per_cm2: 0 is not a dose from"),
            ("dose_mj_per_cm2,depth_um\n1,2\n1e308,2", "line 3, column dose_mj_per_cm2: 1e308 is"),
            ("dose_mj_per_cm2,depth_um\n1e-7,2", "1e-7 is not a dose from 1e-6 to 1e9 mJ/cm2"),
            ("dose_mj_per_cm2,depth_um\n1,1e-300", "1e-300 is not a length from 0.001 um to 1 m"),
            ("dose_mj_per_cm2,depth_um\n1,1e7", "line 2, column depth_um: 1e7 is not a length"),
            ("dose_mj_per_cm2,depth_um\n1,-1e7", "line 2, column depth_um: -1e7 is not a length"),
            ("exposure_ms,depth_um\n-1,2", "column exposure_ms: -1 is not a time that makes a"),
            ("exposure_ms,depth_um\n1e300,2", "column exposure_ms: 1e300 is not a time that"),
            ("dose_mj_per_cm2,depth_um,gray\n1,2,1e-9", "2 is not what so dark a gray level"),
            ("dose_mj_per_cm2,depth_um,gray\n1,2,50", "column gray: 50 is not a gray level"),
            ("dose_mj_per_cm2,depth_um,gray\n1,2,0", "column depth_um: 2 is not what so dark"),
            ("dose_mj_per_cm2,depth_um\n", "no row below the header"),
            ("dose_mj_per_cm2,depth_um\n1,", "no row below the header"),
        ] {
            let error = depths(text).unwrap_err().to_string();
            assert!(error.contains(words), "{error} for {text:?}");
        }
        let error = widths("feature_px,exposure_ms,width_um\n25,1,1").unwrap_err().to_string();
        assert!(error.contains("intensity of full white"), "{error}");
        let error = widths("feature_px,dose_mj_per_cm2,width_um\n0,1,1").unwrap_err();
        assert!(error.to_string().contains("column feature_px: 0 is not a size"), "{error}");
        let error = widths("feature_um,dose_mj_per_cm2,cured_um\n9,1,1e9").unwrap_err();
        assert!(error.to_string().contains("column cured_um: 1e9 is not a length"), "{error}");
    }
}
