//! Reads tables of comma-separated values under a header.

use thiserror::Error;

/// A table of measurements.
///
/// ```
/// use lamp_grayscale::calibrate::CsvTable;
///
/// let table = CsvTable::parse("dose_mj_per_cm2, depth_um\n# a comment\n320, 187.6\n")?;
/// assert_eq!(table.columns(), ["dose_mj_per_cm2", "depth_um"]);
/// # Ok::<(), lamp_grayscale::calibrate::TableError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CsvTable {
    columns: Vec<String>,
    rows: Vec<TableRow>,
}

/// The texts of a row, one for each column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct TableRow {
    /// Its line in the file, from 1.
    pub(super) line: usize,
    cells: Vec<String>,
}

/// Why a text cannot be read as a table.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum TableError {
    /// There are only blank lines and comments.
    #[error(
        "the file is empty: write a header, such as dose_mj_per_cm2,depth_um, and rows below it"
    )]
    Empty,
    /// The header's columns are not separated by commas.
    #[error("line {line}: separate columns by commas, and write 1.5 for one and a half")]
    Separator {
        /// The header's line, from 1.
        line: usize,
    },
    /// A column occurs twice.
    #[error("line {line}: column {column} appears twice")]
    Twice {
        /// The header's line, from 1.
        line: usize,
        /// The column.
        column: String,
    },
    /// A row has another number of cells than the header.
    #[error("line {line}: {cells} columns, where the header has {columns}")]
    Ragged {
        /// The line, from 1.
        line: usize,
        /// The number of cells in the row.
        cells: usize,
        /// The number of columns in the header.
        columns: usize,
    },
}

impl CsvTable {
    /// Reads a table: a header, then rows. Blank lines and lines that start with `#` are skipped;
    /// quotes around a cell are removed.
    ///
    /// # Errors
    /// Returns an error if there is no header, or a row has more or fewer cells than it.
    pub fn parse(text: &str) -> Result<Self, TableError> {
        // Spreadsheets mark their files as UTF-8.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut lines = (1..).zip(text.lines()).filter(|(_, line)| {
            let line = line.trim();
            !(line.is_empty() || line.starts_with('#'))
        });
        let (line, header) = lines.next().ok_or(TableError::Empty)?;
        if header.contains([';', '\t']) && !header.contains(',') {
            return Err(TableError::Separator { line });
        }
        let columns = cells(header);
        if let Some((_, column)) =
            (0..).zip(&columns).find(|(i, column)| columns[..*i].contains(column))
        {
            return Err(TableError::Twice { line, column: column.clone() });
        }
        let row = |(line, text)| {
            let cells = cells(text);
            if cells.len() == columns.len() {
                Ok(TableRow { line, cells })
            } else {
                Err(TableError::Ragged { line, cells: cells.len(), columns: columns.len() })
            }
        };
        let rows = lines.map(row).collect::<Result<_, _>>()?;
        Ok(Self { columns, rows })
    }

    /// Returns the columns' names, in order.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    pub(super) fn rows(&self) -> &[TableRow] {
        &self.rows
    }

    /// Returns the index of the column of a name.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }
}

impl TableRow {
    /// Returns the text of the cell in a column.
    pub(super) fn cell(&self, column: usize) -> &str {
        &self.cells[column]
    }
}

/// Returns the cells of a line, without control characters that could steer a terminal.
fn cells(line: &str) -> Vec<String> {
    let cell = |cell: &str| cell.trim().trim_matches('"').trim().replace(char::is_control, " ");
    line.split(',').map(cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreadsheets_and_hands_write_tables() {
        let table = CsvTable::parse("\u{feff}\"a\",\"b\"\r\n\r\n# c\r\n1,\r\n 2 , 3 \r\n").unwrap();
        assert_eq!(table.columns(), ["a", "b"]);
        let rows: Vec<_> = table.rows().iter().map(|row| (row.line, &row.cells[..])).collect();
        let text = |texts: [&str; 2]| texts.map(str::to_owned).to_vec();
        assert_eq!(rows, [(4, &text(["1", ""])[..]), (5, &text(["2", "3"])[..])]);
        assert_eq!((table.find("b"), table.find("c")), (Some(1), None));
        assert_eq!(CsvTable::parse("a\n").unwrap().rows(), []);
    }

    #[test]
    fn what_is_no_table_is_an_error() {
        let refused = |text| CsvTable::parse(text).unwrap_err().to_string();
        for text in ["", "\n \n", "# nothing"] {
            assert!(refused(text).starts_with("the file is empty"), "{text:?}");
        }
        assert!(refused("a;b\n1,5;2").contains("line 1: separate columns by commas"));
        assert_eq!(refused("\na,b,a"), "line 2: column a appears twice");
        assert_eq!(refused("a,b\n1,2\n1,2,3"), "line 3: 3 columns, where the header has 2");
        assert_eq!(refused("a,b\n1"), "line 2: 1 columns, where the header has 2");
    }
}
