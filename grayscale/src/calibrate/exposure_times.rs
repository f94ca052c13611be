//! Reads exposure times by layer thickness from a table.

use std::ops::RangeInclusive;

use lamp_stack::Length;

use super::columns::{Column, EXPOSURE, LENGTHS, check_columns};
use super::csv_table::CsvTable;
use super::measurements::DataError;
use crate::resin::ExposureTime;

const THICKNESS: &str = "thickness_um";

/// The plausible times in ms, from a microsecond to eleven days.
const TIMES: RangeInclusive<f64> = 1e-3..=1e9;

/// Exposure times by thickness.
#[derive(Clone, Debug, PartialEq)]
pub struct ExposureTimes {
    /// Thickness in micrometers and time in milliseconds, by thickness.
    times: Vec<(f64, f64)>,
}

impl ExposureTimes {
    /// Reads times from a table of `thickness_um` and `exposure_ms`.
    ///
    /// # Errors
    /// Returns an error if a column is missing or unknown, a cell is not a number in its range,
    /// or a thickness stands twice.
    pub fn new(table: &CsvTable) -> Result<Self, DataError> {
        check_columns(table, &[THICKNESS, EXPOSURE])?;
        let column = |name| Column::find(table, name).ok_or(DataError::NoColumn(name));
        let (thickness, exposure) = (column(THICKNESS)?, column(EXPOSURE)?);
        let mut times: Vec<(f64, f64)> = Vec::new();
        for row in table.rows() {
            let um = thickness.number(row)?;
            if !LENGTHS.contains(&um) {
                return Err(thickness.impossible(row, "a thickness from 0.001 um to 1 m"));
            }
            if times.iter().any(|time| time.0 == um) {
                return Err(thickness.impossible(row, "a thickness that stands once"));
            }
            let ms = exposure.number(row)?;
            if !TIMES.contains(&ms) {
                return Err(exposure.impossible(row, "a time from 0.001 to 1e9 ms"));
            }
            times.push((um, ms));
        }
        if times.is_empty() {
            return Err(DataError::NoRows);
        }
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(Self { times })
    }

    /// Returns the time for a thickness, interpolated linearly; `None` outside the table.
    pub fn of(&self, thickness: Length) -> Option<ExposureTime> {
        let um = thickness.um();
        // Outside the table nothing is known: times are not extrapolated.
        let above = self.times.partition_point(|time| time.0 < um);
        let &(high_um, high_ms) = self.times.get(above)?;
        if high_um == um {
            return Some(ExposureTime::from_ms(high_ms));
        }
        let (low_um, low_ms) = self.times[above.checked_sub(1)?];
        let share = (um - low_um) / (high_um - low_um);
        Some(ExposureTime::from_ms(low_ms + share * (high_ms - low_ms)))
    }

    /// Returns the least and the greatest thickness of the table.
    pub fn limits(&self) -> [Length; 2] {
        [self.times[0], self.times[self.times.len() - 1]].map(|time| Length::from_um(time.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(text: &str) -> Result<ExposureTimes, DataError> {
        ExposureTimes::new(&CsvTable::parse(text).unwrap())
    }

    #[test]
    fn times_lie_between_those_of_the_table() {
        let times = times("exposure_ms,thickness_um\n300,100\n120,25\n200,50\n").unwrap();
        let ms = |um| times.of(Length::from_um(um)).map(ExposureTime::ms);
        assert_eq!(
            [25.0, 37.5, 50.0, 75.0, 100.0].map(ms),
            [120.0, 160.0, 200.0, 250.0, 300.0].map(Some)
        );
        assert_eq!([24.9, 100.1].map(ms), [None; 2]);
        assert_eq!(times.limits().map(Length::um), [25.0, 100.0]);
    }

    #[test]
    fn what_is_no_table_of_times_is_refused() {
        for text in [
            "thickness_um,exposure_ms\n",
            "thickness_um\n25\n",
            "thickness_um,exposure_ms\n0,5\n",
            "thickness_um,exposure_ms\n25,-5\n",
            "thickness_um,exposure_ms\n25,5\n25,6\n",
            "thickness_um,exposure_ms,dose\n25,5,1\n",
        ] {
            assert!(times(text).is_err(), "{text}");
        }
    }
}
