//! Measured heights and widths of films and lines, from tables.

use lamp_grayscale::calibrate::{CsvTable, DataError, Measured, NumberRow};
use lamp_grayscale::resin::{Dose, ExposureTime, Intensity, plausible};
use lamp_stack::Length;

use super::setting::KineticSetting;

/// A measured height or width of a film or a line of mirrors that was exposed at once (003 section 4.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KineticPoint {
    /// The mirrors across the line; `None` is a film under a wide field.
    pub pixels: Option<u32>,
    /// The light of a wide white field.
    pub light: Intensity,
    /// Its exposure time.
    pub time: ExposureTime,
    /// The measurement.
    pub size: KineticSize,
}

/// A measured size of a film or a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KineticSize {
    /// Its height above the glass.
    Height {
        /// The height.
        height: Length,
        /// The distance from the middle of the line.
        place: Length,
    },
    /// The width of the solid on the glass.
    Width(Length),
}

impl KineticPoint {
    /// Returns the dose of a wide white field.
    pub fn dose(&self) -> Dose {
        self.light * self.time
    }
}

/// The columns of a table of films and lines.
const COLUMNS: &[&str; 6] =
    &["exposure_ms", "line_px", "x_um", "height_um", "width_um", "light_mw_per_cm2"];

/// The longest exposure, in milliseconds: a day would take hours to simulate, and cures any resin through.
pub const LONGEST_MS: f64 = 600_000.0;

/// The widest length in um, a meter: a typing error beyond.
const WIDEST_UM: f64 = 1e6;

/// Reads heights and widths of films and lines from a table of `exposure_ms`; `line_px`, the mirrors across
/// a line, empty for a film under a wide field; `height_um`, at `x_um` from the middle of the line, and
/// `width_um` on the glass, one of the two or both; and `light_mw_per_cm2`, the light of a wide white
/// field, the setting's where that is missing. Heights and widths of zero and below cured nothing.
///
/// # Errors
/// Returns an error if a column is missing or unknown, or a cell is not a number in its range.
pub fn kinetic_points(
    table: &CsvTable,
    setting: &KineticSetting,
) -> Result<Measured<KineticPoint>, DataError> {
    let mut measured = Measured { points: Vec::new(), none: 0, blank: 0 };
    for row in table.numbers(COLUMNS, 1)? {
        let (sizes, cells) = sizes(&row, setting)?;
        match (cells, sizes.is_empty()) {
            (0, _) => measured.blank += 1,
            (_, true) => measured.none += 1,
            _ => measured.points.extend(sizes),
        }
    }
    if measured.points.is_empty() && measured.none == 0 {
        return Err(DataError::NoRows);
    }
    Ok(measured)
}

/// Returns the points of a row, and how many of its cells hold a measurement.
fn sizes(
    row: &NumberRow<6>,
    setting: &KineticSetting,
) -> Result<(Vec<KineticPoint>, usize), DataError> {
    let refused = |column: usize, wanted| DataError::Impossible {
        line: row.line,
        column: COLUMNS[column],
        text: row.numbers[column].map_or_else(String::new, |number| number.to_string()),
        wanted,
    };
    let [exposure, line, place, height, width, light] = row.numbers;
    let time = ExposureTime::from_ms(exposure.unwrap_or(f64::NAN));
    if !(time.ms() > 0.0 && time.ms() <= LONGEST_MS) {
        return Err(refused(0, "a time above zero, ten minutes at most"));
    }
    let pixels = match line {
        None => None,
        Some(number) => {
            let most = 2.0 * f64::from(setting.pixels);
            let whole = number.fract() == 0.0 && (1.0..=most).contains(&number);
            Some(if whole {
                number as u32
            } else {
                return Err(refused(1, "a whole number of mirrors, from 1 to the display's"));
            })
        }
    };
    let light = light.map_or(setting.light, Intensity::from_mw_per_cm2);
    if !plausible::INTENSITY.contains(&light) {
        return Err(refused(5, "a light that a projector has"));
    }
    // No light cures further from a line than the chamber is high.
    let line_um = f64::from(pixels.unwrap_or(0)) * setting.pixel_um;
    let place = match (place, pixels) {
        (None, _) => 0.0,
        (Some(_), None) => return Err(refused(2, "empty for a film, which is alike everywhere")),
        (Some(um), _) if um.abs() <= line_um / 2.0 + setting.chamber_um => um.abs(),
        _ => {
            return Err(refused(
                2,
                "within the line, or outside of it by the height of the chamber at most",
            ));
        }
    };
    if let Some(um) = height
        && !(-WIDEST_UM..setting.chamber_um).contains(&um)
    {
        return Err(refused(3, "a height in micrometers, below the chamber's"));
    }
    if let Some(um) = width {
        if pixels.is_none() {
            return Err(refused(4, "empty for a film, which has no edge"));
        }
        // A width of less than a micrometer is a slip for millimeters.
        let possible = 1.0..=line_um + 2.0 * setting.chamber_um;
        if um > 0.0 && !possible.contains(&um) {
            return Err(refused(
                4,
                "a width from 1 um to the line's and twice the chamber's height",
            ));
        }
    }
    let above_zero = |um: &f64| *um > 0.0;
    let [height, wide] = [height, width].map(|um| um.filter(above_zero).map(Length::from_um));
    let place = Length::from_um(place);
    let sizes =
        [height.map(|height| KineticSize::Height { height, place }), wide.map(KineticSize::Width)];
    let points = sizes.into_iter().flatten().map(|size| KineticPoint { pixels, light, time, size });
    let cells = row.numbers[3..5].iter().flatten().count();
    Ok((points.collect(), cells))
}

#[cfg(test)]
mod tests {
    use lamp_grayscale::material::Material;
    use lamp_stack::Catalogued;

    use super::*;
    use crate::projector::Projector;

    fn read(text: &str) -> Result<Measured<KineticPoint>, DataError> {
        let kinetics = Material::builtin("tmpta").unwrap().kinetics().unwrap().unwrap();
        let projector = Projector::builtin("jariwala").unwrap();
        let setting = KineticSetting::of(&projector, kinetics).unwrap();
        kinetic_points(&CsvTable::parse(text).unwrap(), &setting)
    }

    #[test]
    fn rows_are_heights_and_widths_of_films_and_lines() {
        let table = "exposure_ms,line_px,x_um,height_um,width_um,light_mw_per_cm2\n\
                     5000,,,80,,\n5000,60,-20,75.5,390,1.3\n9000,10,,,0,\n1000,,,-2,,\n700,10,,,,\n";
        let measured = read(table).unwrap();
        assert_eq!((measured.points.len(), measured.none, measured.blank), (3, 2, 1));
        let [film, height, width] = measured.points[..] else { panic!("three points") };
        assert_eq!((film.pixels, film.light.mw_per_cm2(), film.time.ms()), (None, 2.57, 5000.0));
        assert!((film.dose().mj_per_cm2() - 12.85).abs() < 1e-9);
        let um = Length::from_um;
        assert_eq!(height.size, KineticSize::Height { height: um(75.5), place: um(20.0) });
        assert_eq!((width.pixels, width.light.mw_per_cm2()), (Some(60), 1.3));
        assert_eq!(width.size, KineticSize::Width(um(390.0)));
    }

    #[test]
    fn rows_that_cannot_be_are_refused_by_their_line() {
        for (row, column) in [
            ("0,10,0,50,,", "exposure_ms"),
            ("700000,10,0,50,,", "exposure_ms"),
            ("5000,0,0,50,,", "line_px"),
            ("5000,2.5,0,50,,", "line_px"),
            ("5000,5000,0,50,,", "line_px"),
            ("5000,,3,50,,", "x_um"),
            ("5000,10,1e9,50,,", "x_um"),
            ("5000,10,0,200,,", "height_um"),
            ("5000,,,50,60,", "width_um"),
            ("5000,10,,50,1e9,", "width_um"),
            ("5000,10,0,50,,0", "light_mw_per_cm2"),
        ] {
            let table =
                format!("exposure_ms,line_px,x_um,height_um,width_um,light_mw_per_cm2\n{row}\n");
            let error = read(&table).unwrap_err().to_string();
            assert!(error.starts_with(&format!("line 2, column {column}: ")), "{error}");
        }
        assert_eq!(read("exposure_ms,height_um\n"), Err(DataError::NoRows));
        assert_eq!(read("height_um\n50\n"), Err(DataError::NoColumn("exposure_ms")));
    }
}
