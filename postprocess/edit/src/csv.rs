//! Reads rows of comma-separated values (RFC 4180), as spreadsheets and hands write them.

use std::iter::Peekable;
use std::str::Chars;

use super::serials::ListProblem;

/// A row of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct CsvRow {
    /// The line on which it begins, from 1.
    pub(super) line: usize,
    pub(super) cells: Vec<String>,
}

impl CsvRow {
    fn is_blank(&self) -> bool {
        self.cells.iter().all(String::is_empty)
    }
}

/// Returns the rows of a text without blank ones at its end. A mark of UTF-8 and blanks around
/// cells that have no quotes are removed; cells in quotes may hold commas and lines.
///
/// # Errors
/// Returns an error if quotes do not pair, cells are separated by anything but commas, or a row has
/// another number of cells than the first.
pub(super) fn csv_rows(text: &str) -> Result<Vec<CsvRow>, ListProblem> {
    // Spreadsheets put this mark before UTF-8.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader = CsvReader { rest: text.chars().peekable(), line: 1 };
    let mut rows = Vec::new();
    while reader.rest.peek().is_some() {
        rows.push(reader.row()?);
    }
    while rows.pop_if(|row| row.is_blank()).is_some() {}
    let Some(first) = rows.first() else { return Err(ListProblem::Empty) };
    let count = first.cells.len();
    // Where the comma is the decimal sign, spreadsheets separate cells by semicolons.
    if let [only] = &first.cells[..]
        && only.contains([';', '\t'])
    {
        return Err(ListProblem::Separator { line: first.line });
    }
    let unlike = rows.iter().find(|row| row.cells.len() != count);
    match unlike {
        Some(row) if row.is_blank() => Err(ListProblem::EmptyCell { line: row.line }),
        Some(row) => Err(ListProblem::Ragged { line: row.line, cells: row.cells.len(), count }),
        None => Ok(rows),
    }
}

struct CsvReader<'a> {
    rest: Peekable<Chars<'a>>,
    line: usize,
}

impl CsvReader<'_> {
    /// Reads a row and its end.
    fn row(&mut self) -> Result<CsvRow, ListProblem> {
        let line = self.line;
        let mut cells = Vec::new();
        loop {
            cells.push(self.cell()?);
            match self.rest.next() {
                Some(',') => {}
                end => {
                    // RFC 4180 (2.1) ends rows with CR LF, editors end them with LF, and old files
                    // have CR.
                    if end == Some('\r') {
                        self.rest.next_if_eq(&'\n');
                    }
                    self.line += 1;
                    return Ok(CsvRow { line, cells });
                }
            }
        }
    }

    /// Reads a cell up to the comma or the end of the row after it.
    fn cell(&mut self) -> Result<String, ListProblem> {
        let plain = self.until_end();
        if self.rest.next_if_eq(&'"').is_none() {
            // RFC 4180 (2.4) keeps blanks. People type them for looks, and a label would show them.
            return Ok(plain.trim().to_owned());
        }
        let quoted = plain.trim().is_empty().then(|| self.quoted());
        let quoted = quoted.ok_or(ListProblem::Quote { line: self.line })??;
        if !self.until_end().trim().is_empty() || self.rest.peek() == Some(&'"') {
            return Err(ListProblem::Quote { line: self.line });
        }
        Ok(quoted)
    }

    /// Reads up to a comma, a quote, or the end of the row.
    fn until_end(&mut self) -> String {
        let mut text = String::new();
        while let Some(letter) =
            self.rest.next_if(|letter| !matches!(letter, ',' | '"' | '\r' | '\n'))
        {
            text.push(letter);
        }
        text
    }

    /// Reads what stands between quotes, after the first of them. Two quotes stand for one.
    fn quoted(&mut self) -> Result<String, ListProblem> {
        let (mut text, line) = (String::new(), self.line);
        loop {
            match self.rest.next() {
                None => return Err(ListProblem::OpenQuote { line }),
                Some('"') if self.rest.next_if_eq(&'"').is_none() => return Ok(text),
                Some(letter) => {
                    // Of CR LF only LF counts, or the line would count twice.
                    let is_end =
                        letter == '\n' || letter == '\r' && self.rest.peek() != Some(&'\n');
                    self.line += usize::from(is_end);
                    text.push(letter);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn rows(text: &str) -> Vec<(usize, Vec<String>)> {
        csv_rows(text).unwrap().into_iter().map(|row| (row.line, row.cells)).collect()
    }

    fn row(line: usize, cells: &[&str]) -> (usize, Vec<String>) {
        (line, cells.iter().map(|&cell| cell.to_owned()).collect())
    }

    #[test]
    fn spreadsheets_and_hands_write_tables() {
        let two = [row(1, &["a", "b"]), row(2, &["1", "2"])];
        for text in [
            "a,b\n1,2",
            "a,b\r\n1,2\r\n",
            "a,b\r1,2\r",
            "\u{feff}a,b\n1,2\n\n\r\n,\n",
            "\u{feff}\"a\" , b\n  \"1\",\"2\"\n   \n",
        ] {
            assert_eq!(rows(text), two, "{text:?}");
        }
        assert_eq!(
            rows("\"a, \"\"b\"\"\n c\",d\n,\"\"\n e , f g \n"),
            [row(1, &["a, \"b\"\n c", "d"]), row(3, &["", ""]), row(4, &["e", "f g"])]
        );
        assert_eq!(rows("\"a\r\nb\rc\nd\"\ne\n")[1], row(5, &["e"]));
        assert_eq!(rows("\"a;b\",c"), [row(1, &["a;b", "c"])]);
    }

    #[test]
    fn what_is_no_table_is_an_error() {
        for (text, problem) in [
            ("", ListProblem::Empty),
            ("\u{feff}\n,\n", ListProblem::Empty),
            ("a;b\n1;2\n", ListProblem::Separator { line: 1 }),
            ("a\tb\n", ListProblem::Separator { line: 1 }),
            ("a\nb\"c\"\n", ListProblem::Quote { line: 2 }),
            ("\"a\"b\n", ListProblem::Quote { line: 1 }),
            ("\"a\" \"b\"\n", ListProblem::Quote { line: 1 }),
            ("a\n\"b\nc\n", ListProblem::OpenQuote { line: 2 }),
            ("a,b\n1\n2,3\n", ListProblem::Ragged { line: 2, cells: 1, count: 2 }),
            ("a\n1,\n", ListProblem::Ragged { line: 2, cells: 2, count: 1 }),
            ("a,b\n\n2,3\n", ListProblem::EmptyCell { line: 2 }),
        ] {
            assert_eq!(csv_rows(text), Err(problem), "{text:?}");
        }
    }

    proptest! {
        #[test]
        fn what_is_quoted_is_read_again(
            table in (1usize..4).prop_flat_map(|count| {
                prop::collection::vec(prop::collection::vec("[a-z,;\" \r\n]{0,5}x", count), 1..5)
            }),
        ) {
            let quoted = |cell: &String| format!("\"{}\"", cell.replace('"', "\"\""));
            let line = |row: &Vec<String>| row.iter().map(quoted).collect::<Vec<_>>().join(",");
            let text = table.iter().map(line).collect::<Vec<_>>().join("\r\n");
            let is_one = table[0].len() == 1 && table[0][0].contains(';');
            match csv_rows(&text) {
                Ok(read) => prop_assert_eq!(read.into_iter().map(|row| row.cells).collect::<Vec<_>>(), table),
                Err(error) => prop_assert!(is_one, "{}", error),
            }
        }

        #[test]
        fn any_text_is_read_or_refused(text in "[a,;\"\r\n ]{0,40}") {
            let _ = csv_rows(&text);
        }
    }
}
