//! Serial numbers of copies, from a list of comma-separated values.

use std::collections::{BTreeMap, HashMap};

use thiserror::Error;

use super::csv::{CsvRow, csv_rows};

/// The name of the column that says which copy a row is for.
const COPY: &str = "copy";

/// A list of serial numbers that a label names.
#[derive(Clone, Debug)]
pub struct LabelList {
    /// The name in messages.
    pub name: String,
    /// The digest of the file, for the first page.
    pub digest: String,
    /// The comma-separated values.
    pub text: String,
}

/// Why a list of serial numbers cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ListProblem {
    /// It has no rows.
    #[error("there is no serial number in it: write one on each line")]
    Empty,
    /// Cells are not separated by commas.
    #[error("line {line}: separate cells by commas, or put them in quotes")]
    Separator {
        /// The line, from 1.
        line: usize,
    },
    /// A quote stands before or behind something else.
    #[error("line {line}: a quote is not around a whole cell: in quotes, write \"\" for one")]
    Quote {
        /// The line, from 1.
        line: usize,
    },
    /// The file ends within quotes.
    #[error("line {line}: the quote that opens here is not closed")]
    OpenQuote {
        /// The line, from 1.
        line: usize,
    },
    /// A row has another number of cells than the first.
    #[error("line {line}: it has {cells} cells, and the first line {count}")]
    Ragged {
        /// The line, from 1.
        line: usize,
        /// The number of cells in it.
        cells: usize,
        /// The number of cells in the first.
        count: usize,
    },
    /// No column has the name that the label gives.
    #[error("line {line}: no column is called `{column}`: there are {}", columns.join(", "))]
    NoColumn {
        /// The header's line, from 1.
        line: usize,
        /// The name that the label gives.
        column: String,
        /// The names that there are.
        columns: Vec<String>,
    },
    /// Two columns have the same name.
    #[error("line {line}: two columns are called `{column}`")]
    ColumnTwice {
        /// The header's line, from 1.
        line: usize,
        /// The name.
        column: String,
    },
    /// There are several columns and the label names none.
    #[error(
        "line {line}: it has several cells: write their names on the first line, and which \
         column = \"NAME\" has the serial numbers"
    )]
    WhichColumn {
        /// The first line, from 1.
        line: usize,
    },
    /// A row has no serial number.
    #[error("line {line}: the serial number is missing")]
    EmptyCell {
        /// The line, from 1.
        line: usize,
    },
    /// A serial number has a letter that the font lacks.
    #[error("line {line}: labels have no `{}`, only the letters of ASCII", letter.escape_debug())]
    Letter {
        /// The line, from 1.
        line: usize,
        /// The letter.
        letter: char,
    },
    /// A serial number stands twice.
    #[error("line {line}: {serial} is also on line {first}")]
    SerialTwice {
        /// The line, from 1.
        line: usize,
        /// The serial number.
        serial: String,
        /// The line of the first.
        first: usize,
    },
    /// A row does not say which copy it is for.
    #[error("line {line}: `{cell}` is not the number of a copy: copies count from 1")]
    CopyNumber {
        /// The line, from 1.
        line: usize,
        /// The text in its place.
        cell: String,
    },
    /// Two rows are for one copy.
    #[error("line {line}: copy {copy} has its serial number on line {first}")]
    CopyTwice {
        /// The line, from 1.
        line: usize,
        /// The number of the copy.
        copy: u32,
        /// The line of the first.
        first: usize,
    },
    /// A row is for a copy, or place, that there is not.
    #[error("line {line}: there is no {what} {number}, the last one is {count}")]
    TooMany {
        /// The line, from 1.
        line: usize,
        /// The object of a row: a copy, or a place.
        what: &'static str,
        /// The number of the copy or place.
        number: u32,
        /// How many there are.
        count: u32,
    },
    /// A copy, or place, has no row.
    #[error("line {line}: the list ends, but {what} {number} of {count} has no serial number")]
    TooFew {
        /// The last line, from 1.
        line: usize,
        /// The object of a row: a copy, or a place.
        what: &'static str,
        /// The number of the first without one.
        number: u32,
        /// How many there are.
        count: u32,
    },
}

/// The serial numbers of a list.
#[derive(Clone, Debug)]
pub(super) struct SerialList {
    pub(super) name: String,
    pub(super) digest: String,
    /// By the number of the copy, or of the place, from 1.
    rows: BTreeMap<u32, SerialRow>,
    /// Whether rows say which copy they are for.
    is_numbered: bool,
    last_line: usize,
}

#[derive(Clone, Debug)]
struct SerialRow {
    line: usize,
    serial: String,
}

impl SerialList {
    /// Reads the serial numbers in the column of a name, if one is given. The first row has names
    /// if one is given or one of them is `copy`.
    ///
    /// # Errors
    /// Returns an error if a row has no serial number, or the same as another, or if it is for the
    /// same copy.
    pub(super) fn read(file: &LabelList, column: Option<&str>) -> Result<Self, ListProblem> {
        let table = csv_rows(&file.text)?;
        // `csv_rows` returns at least one row.
        let header = &table[0];
        let copy = header.cells.iter().position(|cell| cell.eq_ignore_ascii_case(COPY));
        let serial = serial_column(header, column, copy)?;
        let has_header = column.is_some() || copy.is_some();
        let last_line = table.last().map_or(1, |row| row.line);
        let (mut rows, mut lines) = (BTreeMap::new(), HashMap::new());
        for (row, next) in table.iter().skip(usize::from(has_header)).zip(1..) {
            let (line, text) = (row.line, row.cells[serial].clone());
            check_serial(line, &text)?;
            if let Some(first) = lines.insert(text.clone(), line) {
                return Err(ListProblem::SerialTwice { line, serial: text, first });
            }
            let number = copy.map_or(Ok(next), |copy| copy_number(line, &row.cells[copy]))?;
            if let Some(SerialRow { line: first, .. }) = rows.get(&number) {
                return Err(ListProblem::CopyTwice { line, copy: number, first: *first });
            }
            rows.insert(number, SerialRow { line, serial: text });
        }
        if rows.is_empty() {
            return Err(ListProblem::Empty);
        }
        let (name, digest) = (file.name.clone(), file.digest.clone());
        Ok(Self { name, digest, rows, is_numbered: copy.is_some(), last_line })
    }

    /// Returns the serial numbers of the `wanted` ones of `count` copies or places, from 1. `what`
    /// is the word for them.
    ///
    /// # Errors
    /// Returns an error if there are more rows than `count`, or if a row is missing: of any of them
    /// if rows do not say which one they are for, else of a wanted one.
    pub(super) fn of(
        &self,
        wanted: impl Iterator<Item = u32>,
        count: u32,
        what: &'static str,
    ) -> Result<Vec<&str>, ListProblem> {
        if let Some((&number, row)) = self.rows.range(count.saturating_add(1)..).next() {
            return Err(ListProblem::TooMany { line: row.line, what, number, count });
        }
        let serial = |number: u32| {
            let row = self.rows.get(&number).map(|row| row.serial.as_str());
            row.ok_or(ListProblem::TooFew { line: self.last_line, what, number, count })
        };
        // Then row n is for copy n, and a row too few may be missing anywhere.
        if !self.is_numbered && self.rows.len() < count as usize {
            serial(self.rows.len() as u32 + 1)?;
        }
        wanted.map(serial).collect()
    }
}

/// Returns the index of the column that has the serial numbers.
fn serial_column(
    header: &CsvRow,
    column: Option<&str>,
    copy: Option<usize>,
) -> Result<usize, ListProblem> {
    let (line, cells) = (header.line, &header.cells);
    let Some(column) = column else {
        let mut others = (0..cells.len()).filter(|&k| Some(k) != copy);
        return match (others.next(), others.next()) {
            (Some(only), None) => Ok(only),
            _ => Err(ListProblem::WhichColumn { line }),
        };
    };
    let mut called = (0..cells.len()).filter(|&k| cells[k] == column);
    let index = called.next().ok_or_else(|| {
        let (column, columns) = (column.to_owned(), cells.clone());
        ListProblem::NoColumn { line, column, columns }
    })?;
    match called.next() {
        Some(_) => Err(ListProblem::ColumnTwice { line, column: column.to_owned() }),
        None => Ok(index),
    }
}

fn check_serial(line: usize, text: &str) -> Result<(), ListProblem> {
    if text.trim().is_empty() {
        return Err(ListProblem::EmptyCell { line });
    }
    // The font of labels is a subset that has these letters.
    match text.chars().find(|letter| !(' '..='~').contains(letter)) {
        Some(letter) => Err(ListProblem::Letter { line, letter }),
        None => Ok(()),
    }
}

fn copy_number(line: usize, cell: &str) -> Result<u32, ListProblem> {
    let wrong = || {
        let cell = lamp_stack::one_line(cell);
        ListProblem::CopyNumber { line, cell }
    };
    // `of` looks for numbers from count + 1 on, which saturates at the last u32.
    cell.parse().ok().filter(|&number| (1..u32::MAX).contains(&number)).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, column: Option<&str>) -> Result<SerialList, ListProblem> {
        let (name, digest) = ("serials.csv".to_owned(), "blake3:00".to_owned());
        SerialList::read(&LabelList { name, digest, text: text.to_owned() }, column)
    }

    fn error(text: &str, column: Option<&str>) -> String {
        read(text, column).unwrap_err().to_string()
    }

    fn all(list: &SerialList, count: u32) -> Result<Vec<&str>, ListProblem> {
        list.of(1..=count, count, "copy")
    }

    #[test]
    fn rows_are_for_copies_in_order_or_name_them() {
        for (text, column) in [
            ("A1\nB2\nC3\n", None),
            ("\u{feff}\"A1\"\r\n B2 \r\nC3\r\n\r\n", None),
            ("serial\nA1\nB2\nC3", Some("serial")),
            ("id,\"serial\",note\n1,A1,\n2,B2,\"x,y\"\n3,C3,", Some("serial")),
            ("copy,serial\n3,C3\n1,A1\n2,B2\n", None),
            ("note,serial,Copy\n,B2,2\n,A1,1\n,C3,3\n", Some("serial")),
        ] {
            assert_eq!(
                all(&read(text, column).unwrap(), 3).unwrap(),
                ["A1", "B2", "C3"],
                "{text:?}"
            );
        }
        let chosen = read("copy,serial\n9,C3\n2,A1\n", None).unwrap();
        assert_eq!(chosen.of([2, 9].into_iter(), 12, "copy").unwrap(), ["A1", "C3"]);
    }

    #[test]
    fn what_does_not_suit_is_said_with_its_line() {
        let no_column = "line 1: no column is called `sn`: there are id, serial";
        for (text, column, said) in [
            ("\n\n", None, "there is no serial number in it"),
            ("serial\n", Some("serial"), "there is no serial number in it"),
            ("id,serial\n1,2", Some("sn"), no_column),
            ("sn,sn\n1,2", Some("sn"), "line 1: two columns are called `sn`"),
            ("1,2\n3,4", None, "line 1: it has several cells"),
            ("copy,a,b\n1,2,3", None, "line 1: it has several cells"),
            ("A\n\nB", None, "line 2: the serial number is missing"),
            ("id,sn\n1,A\n2,\" \"", Some("sn"), "line 3: the serial number is missing"),
            ("A\nB\u{e9}", None, "line 2: labels have no `\u{e9}`"),
            ("\"A\nB\"", None, "line 1: labels have no `\\n`"),
            ("A\nB\nA", None, "line 3: A is also on line 1"),
            ("copy,sn\nx,A", None, "line 2: `x` is not the number of a copy"),
            ("copy,sn\n0,A", None, "line 2: `0` is not the number of a copy"),
            ("copy,sn\n4294967295,A", None, "line 2: `4294967295` is not the number"),
            ("copy,sn\n2,A\n2,B", None, "line 3: copy 2 has its serial number on line 2"),
        ] {
            let error = error(text, column);
            assert!(error.starts_with(said), "{text:?}: {error}");
        }
    }

    #[test]
    fn as_many_rows_are_needed_as_there_are_copies() {
        let said = |text: &str, wanted: &[u32], count| {
            let list = read(text, None).unwrap();
            list.of(wanted.iter().copied(), count, "copy").unwrap_err().to_string()
        };
        let few = "line 2: the list ends, but copy 3 of 3 has no serial number";
        assert_eq!(said("A\nB\n", &[1], 3), few);
        assert_eq!(said("A\nB\nC\n", &[1], 2), "line 3: there is no copy 3, the last one is 2");
        let missing = "line 3: the list ends, but copy 2 of 3 has no serial number";
        assert_eq!(said("copy,sn\n1,A\n3,B\n", &[1, 2], 3), missing);
        assert_eq!(
            said("copy,sn\n9,A\n1,B\n", &[1], 3),
            "line 2: there is no copy 9, the last one is 3"
        );
    }
}
