//! Finds columns in tables of measurements and reads their cells.

use std::ops::RangeInclusive;

use lamp_stack::Length;

use super::csv_table::{CsvTable, TableRow};
use super::measurements::DataError;
use crate::resin::{Dose, ExposureTime, Intensity, plausible};

pub(super) const DOSE: &str = "dose_mj_per_cm2";
pub(super) const EXPOSURE: &str = "exposure_ms";

/// The plausible depths, widths and sides in um, from a nanometer to a meter. No measurement
/// lies outside, but a typing error may.
pub(super) const LENGTHS: RangeInclusive<f64> = 1e-3..=1e6;

/// Checks that all columns are known: a misspelt one must not be silently left out.
pub(super) fn check_columns(
    table: &CsvTable,
    known: &'static [&'static str],
) -> Result<(), DataError> {
    let is_known = |column: &&String| known.contains(&column.as_str()) || column.as_str() == "note";
    match table.columns().iter().find(|column| !is_known(column)) {
        Some(column) => Err(DataError::Unknown { column: column.clone(), known }),
        None => Ok(()),
    }
}

/// The numbers of a row of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberRow<const N: usize> {
    /// Its line in the file, from 1.
    pub line: usize,
    /// The numbers; blank cells and missing columns have none.
    pub numbers: [Option<f64>; N],
}

impl CsvTable {
    /// Returns the line and the numbers of each row, in known columns. The first `needed` of them
    /// must have numbers in all rows; of others, a column or a cell may be missing.
    ///
    /// # Errors
    /// Returns an error if a column is needed and missing or is not known, or if a cell is not a
    /// number.
    pub fn numbers<const N: usize>(
        &self,
        columns: &'static [&'static str; N],
        needed: usize,
    ) -> Result<Vec<NumberRow<N>>, DataError> {
        check_columns(self, columns)?;
        let found = columns.map(|name| Column::find(self, name));
        for (column, name) in found.iter().zip(columns).take(needed) {
            column.ok_or(DataError::NoColumn(name))?;
        }
        let numbers = |row: &TableRow| {
            let mut numbers = [None; N];
            for (index, column) in found.iter().enumerate() {
                numbers[index] = match column {
                    Some(column) if index < needed => Some(column.number(row)?),
                    Some(column) => column.number_or_blank(row)?,
                    None => None,
                };
            }
            Ok(NumberRow { line: row.line, numbers })
        };
        self.rows().iter().map(numbers).collect()
    }
}

/// A column of a table.
#[derive(Clone, Copy)]
pub(super) struct Column {
    name: &'static str,
    index: usize,
}

impl Column {
    pub(super) fn find(table: &CsvTable, name: &'static str) -> Option<Self> {
        table.find(name).map(|index| Self { name, index })
    }

    /// Returns the one of two columns that is there, and whether it is the first.
    pub(super) fn either(
        table: &CsvTable,
        first: &'static str,
        second: &'static str,
    ) -> Result<(Self, bool), DataError> {
        match (Self::find(table, first), Self::find(table, second)) {
            (Some(_), Some(_)) => Err(DataError::Both(first, second)),
            (Some(column), None) => Ok((column, true)),
            (None, Some(column)) => Ok((column, false)),
            (None, None) => Err(DataError::NoColumn(first)),
        }
    }

    pub(super) fn text(self, row: &TableRow) -> &str {
        row.cell(self.index)
    }

    pub(super) fn number_or_blank(self, row: &TableRow) -> Result<Option<f64>, DataError> {
        match row.cell(self.index) {
            "" => Ok(None),
            _ => self.number(row).map(Some),
        }
    }

    pub(super) fn number(self, row: &TableRow) -> Result<f64, DataError> {
        let text = row.cell(self.index);
        let (line, column) = (row.line, self.name);
        let number: Option<f64> = text.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| DataError::NotANumber { line, column, text: text.to_owned() })
    }

    /// Returns a length in um, or `None` if the cell is blank. Lengths may be zero, as of
    /// films that did not cure, and below zero by errors of measurement.
    pub(super) fn length_or_blank(self, row: &TableRow) -> Result<Option<Length>, DataError> {
        let Some(um) = self.number_or_blank(row)? else { return Ok(None) };
        if LENGTHS.contains(&um) || (um <= 0.0 && -um <= *LENGTHS.end()) {
            return Ok(Some(Length::from_um(um)));
        }
        Err(self.impossible(row, "a length from 0.001 um to 1 m"))
    }

    pub(super) fn impossible(self, row: &TableRow, wanted: &'static str) -> DataError {
        let text = row.cell(self.index).to_owned();
        DataError::Impossible { line: row.line, column: self.name, text, wanted }
    }
}

/// The doses, given directly or as exposure times under a light.
pub(super) struct DoseColumn {
    column: Column,
    light: Option<Intensity>,
}

impl DoseColumn {
    pub(super) fn find(table: &CsvTable, light: Option<Intensity>) -> Result<Self, DataError> {
        let (column, is_dose) = Column::either(table, DOSE, EXPOSURE)?;
        if is_dose {
            return Ok(Self { column, light: None });
        }
        Ok(Self { column, light: Some(light.ok_or(DataError::NoLight)?) })
    }

    pub(super) fn of(&self, row: &TableRow) -> Result<Dose, DataError> {
        let number = self.column.number(row)?;
        let (dose, wanted) = match self.light {
            None => (Dose::from_mj_per_cm2(number), "a dose from 1e-6 to 1e9 mJ/cm2"),
            Some(light) => (
                // 002 eq. 27: E = I t.
                light * ExposureTime::from_ms(number),
                "a time that makes a dose from 1e-6 to 1e9 mJ/cm2 under that light",
            ),
        };
        let plausible = plausible::DOSE.contains(&dose);
        if plausible { Ok(dose) } else { Err(self.column.impossible(row, wanted)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_needed_are_there() {
        let numbers = |text| CsvTable::parse(text).unwrap().numbers(&["a", "b"], 1);
        let row = |line, a, b| NumberRow { line, numbers: [Some(a), b] };
        assert_eq!(numbers("a,b\n1,\n2,3\n"), Ok(vec![row(2, 1.0, None), row(3, 2.0, Some(3.0))]));
        assert_eq!(numbers("note,a\nx,5\n"), Ok(vec![row(2, 5.0, None)]));
        assert_eq!(numbers("b\n1\n"), Err(DataError::NoColumn("a")));
        for wrong in ["a\n\"\"\n", "a\nNaN\n", "a\nx\n", "a,c\n1,2\n", "a,b\n1,inf\n"] {
            assert!(numbers(wrong).is_err(), "{wrong}");
        }
    }
}
