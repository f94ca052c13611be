//! The columns of tables of measurements.

use super::data::DataError;
use super::table::{Row, Table};
use crate::resin::{Dose, ExposureTime, Intensity};

pub(super) const DOSE: &str = "dose_mj_per_cm2";
pub(super) const EXPOSURE: &str = "exposure_ms";

/// A misspelt column must not be silently left out.
pub(super) fn check_columns(table: &Table, known: &[&str]) -> Result<(), DataError> {
    let is_known = |column: &&String| known.contains(&column.as_str()) || column.as_str() == "note";
    match table.columns().iter().find(|column| !is_known(column)) {
        Some(column) => Err(DataError::Unknown { column: column.clone(), known: known.join(", ") }),
        None => Ok(()),
    }
}

/// A column that a table has.
#[derive(Clone, Copy)]
pub(super) struct Column {
    name: &'static str,
    index: usize,
}

impl Column {
    pub(super) fn find(table: &Table, name: &'static str) -> Option<Self> {
        table.find(name).map(|index| Self { name, index })
    }

    /// The one of two columns that is there, and whether it is the first.
    pub(super) fn either(
        table: &Table,
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

    pub(super) fn number_or_blank(self, row: &Row) -> Result<Option<f64>, DataError> {
        match row.cell(self.index) {
            "" => Ok(None),
            _ => self.number(row).map(Some),
        }
    }

    pub(super) fn number(self, row: &Row) -> Result<f64, DataError> {
        let text = row.cell(self.index);
        let (line, column) = (row.line, self.name);
        let number: Option<f64> = text.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| DataError::NotANumber { line, column, text: text.to_owned() })
    }

    pub(super) fn positive(self, row: &Row, wanted: &'static str) -> Result<f64, DataError> {
        let number = self.number(row)?;
        if number > 0.0 { Ok(number) } else { Err(self.impossible(row, number, wanted)) }
    }

    pub(super) fn impossible(self, row: &Row, number: f64, wanted: &'static str) -> DataError {
        DataError::Impossible { line: row.line, column: self.name, number, wanted }
    }
}

/// The doses, as such or as exposures under a light.
pub(super) struct DoseColumn {
    column: Column,
    light: Option<Intensity>,
}

impl DoseColumn {
    pub(super) fn find(table: &Table, light: Option<Intensity>) -> Result<Self, DataError> {
        let (column, is_dose) = Column::either(table, DOSE, EXPOSURE)?;
        if is_dose {
            return Ok(Self { column, light: None });
        }
        Ok(Self { column, light: Some(light.ok_or(DataError::NoLight)?) })
    }

    pub(super) fn of(&self, row: &Row) -> Result<Dose, DataError> {
        Ok(match self.light {
            None => Dose::from_mj_per_cm2(self.column.positive(row, "a dose above zero")?),
            Some(light) => {
                let ms = self.column.positive(row, "a time above zero")?;
                light * ExposureTime::from_ms(ms)
            }
        })
    }
}
