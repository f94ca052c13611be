//! Variants of a list of edits, by tables of comma-separated values: one for each row.
//!
//! Source: 002 sections 2.4.3 and 6.2 f.

use std::collections::HashMap;

use lamp_stack::{one_line, read_toml};
use thiserror::Error;
use toml::{Table, Value};

use super::csv::{CsvRow, csv_rows};
use super::edit_error::EditError;
use super::list::Edits;
use super::serials::ListProblem;

/// The column with the names of variants.
const NAME: &str = "name";

/// The most variants of a table.
const MAX_VARIANTS: usize = 10_000;

/// The variants of a list of edits. Each row of a table is one: its cells replace values of the
/// list.
///
/// ```
/// use lamp_edit::Variants;
///
/// let list = "[[edit]]\ncylinder = { at = [\"0mm\", \"0mm\"], diameter = \"1mm\" }\n";
/// let variants = Variants::read(list, "name,1.cylinder.diameter\nthin,0.8mm\nwide,2mm\n")?;
/// assert_eq!(variants.names().collect::<Vec<_>>(), ["thin", "wide"]);
/// assert!(variants.list(1).contains("\"2mm\""));
/// # Ok::<(), lamp_edit::VariantError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Variants {
    list: Table,
    /// The path of each column's value in the list; the names have none.
    columns: Vec<Option<Vec<ListStep>>>,
    rows: Vec<Variant>,
}

#[derive(Clone, Debug)]
struct Variant {
    name: String,
    row: CsvRow,
}

/// A step to a value of the list.
#[derive(Clone, Debug)]
enum ListStep {
    Key(String),
    Item(usize),
}

/// Why a list has no such variants.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum VariantError {
    /// The list itself is wrong.
    #[error(transparent)]
    List(#[from] EditError),
    /// The table has no row below its names.
    #[error("it has no variant: write columns on the first line, and a variant on each other")]
    NoRows,
    /// The table has too many rows.
    #[error("it has {0} variants, and may have 10000")]
    ManyRows(usize),
    /// A line within the table is blank.
    #[error("line {0} is blank")]
    BlankRow(usize),
    /// The table is no table.
    #[error(transparent)]
    Table(ListProblem),
    /// A column does not name a value of the list.
    #[error(
        "column `{0}`: the list has no such value: a column is the number of the edit, from 1, and its \
         keys, such as 1.cylinder.diameter; write a key that the edit lacks into the list first"
    )]
    UnknownColumn(String),
    /// Two columns have one name.
    #[error("two columns are called `{0}`")]
    ColumnTwice(String),
    /// A cell is no value.
    #[error("line {line}: column `{column}`: `{cell}` is no value as TOML has them")]
    Cell {
        /// The line, from 1.
        line: usize,
        /// The column's name.
        column: String,
        /// The text.
        cell: String,
    },
    /// The list is wrong with a row's values.
    #[error("line {line}: {problem}")]
    Variant {
        /// The line, from 1.
        line: usize,
        /// The problem with the edit and its key.
        problem: String,
    },
    /// A name is no name of a file.
    #[error("line {line}: `{name}` is no name of a file")]
    Name {
        /// The line, from 1.
        line: usize,
        /// The name.
        name: String,
    },
    /// Two variants have one name.
    #[error("line {line}: `{name}` is also the name on line {first}")]
    NameTwice {
        /// The line, from 1.
        line: usize,
        /// The name.
        name: String,
        /// The line of the first.
        first: usize,
    },
}

impl Variants {
    /// Reads the variants of a list, as TOML, from a table. The first row names the columns: `name`
    /// for the variants' names, which are their numbers without it, and for each other the value of
    /// the list that its cells replace. An empty cell keeps the list's value.
    ///
    /// # Errors
    /// Returns an error if a column names no value of the list, or a variant is no list of edits.
    pub fn read(list: &str, table: &str) -> Result<Self, VariantError> {
        Edits::from_toml(list)?;
        let mut rows = csv_rows(table).map_err(|problem| match problem {
            ListProblem::Empty => VariantError::NoRows,
            ListProblem::EmptyCell { line } => VariantError::BlankRow(line),
            problem => VariantError::Table(problem),
        })?;
        // `csv_rows` returns at least one row.
        let header = rows.remove(0);
        if rows.is_empty() || rows.len() > MAX_VARIANTS {
            let count = rows.len();
            return Err(if count == 0 {
                VariantError::NoRows
            } else {
                VariantError::ManyRows(count)
            });
        }
        let list: Table = read_toml(list).expect("it is a list of edits");
        let twice = (1..header.cells.len()).find(|&k| header.cells[..k].contains(&header.cells[k]));
        if let Some(k) = twice {
            return Err(VariantError::ColumnTwice(one_line(&header.cells[k])));
        }
        let columns = header.cells.iter().map(|column| {
            if column == NAME {
                return Ok(None);
            }
            let steps = steps(&list, column);
            steps.map(Some).ok_or_else(|| VariantError::UnknownColumn(one_line(column)))
        });
        let columns = columns.collect::<Result<Vec<_>, _>>()?;
        let name = header.cells.iter().position(|column| column == NAME);
        let rows = named(rows, name)?;
        let variants = Self { list, columns, rows };
        for (k, Variant { row, .. }) in variants.rows.iter().enumerate() {
            let list = variants.table(k).map_err(|(column, cell)| VariantError::Cell {
                line: row.line,
                column: one_line(&header.cells[column]),
                cell: one_line(&cell),
            })?;
            Edits::from_toml(&list.to_string()).map_err(|error| VariantError::Variant {
                line: row.line,
                problem: match error {
                    // The line is of the variant's list, which nobody has seen.
                    EditError::Key { key, problem, .. } => format!("{key}: {problem}"),
                    error => error.to_string(),
                },
            })?;
        }
        Ok(variants)
    }

    /// Returns the variants' names.
    pub fn names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.rows.iter().map(|row| &*row.name)
    }

    /// Returns the list of edits of a variant, from 0, as TOML.
    ///
    /// # Panics
    /// Panics if there is no such variant.
    pub fn list(&self, variant: usize) -> String {
        self.table(variant).expect("cells were read before").to_string()
    }

    /// Returns a variant's list, or the column and the text of a cell that is no value.
    fn table(&self, variant: usize) -> Result<Table, (usize, String)> {
        let mut list = self.list.clone();
        let cells = &self.rows[variant].row.cells;
        for (column, (steps, cell)) in self.columns.iter().zip(cells).enumerate() {
            let Some(steps) = steps.as_ref().filter(|_| !cell.is_empty()) else { continue };
            let value = value_at(&mut list, steps).expect("columns name values");
            *value = value_of(cell, value).ok_or_else(|| (column, cell.clone()))?;
        }
        Ok(list)
    }
}

/// Returns rows with their names, in the column of names or else their numbers.
fn named(rows: Vec<CsvRow>, column: Option<usize>) -> Result<Vec<Variant>, VariantError> {
    let mut lines = HashMap::new();
    let named = (1..).zip(rows).map(|(number, row): (usize, CsvRow)| {
        let name = column.map_or_else(|| number.to_string(), |column| row.cells[column].clone());
        let line = row.line;
        let is_plain = |letter: char| !letter.is_control() && !"/\\:*?\"<>|".contains(letter);
        if name.is_empty() || name.starts_with('.') || !name.chars().all(is_plain) {
            return Err(VariantError::Name { line, name: one_line(&name) });
        }
        // Some file systems see one name in letters of either case.
        if let Some(first) = lines.insert(name.to_lowercase(), line) {
            return Err(VariantError::NameTwice { line, name, first });
        }
        Ok(Variant { name, row })
    });
    named.collect()
}

/// Returns the steps of a column's name to a value of the list, if it has that.
fn steps(list: &Table, column: &str) -> Option<Vec<ListStep>> {
    let mut value = list.get("edit")?;
    let mut steps = vec![ListStep::Key("edit".to_owned())];
    for word in column.split('.') {
        let step = match value {
            Value::Array(_) => ListStep::Item(word.parse::<usize>().ok()?.checked_sub(1)?),
            _ => ListStep::Key(word.to_owned()),
        };
        value = match &step {
            ListStep::Item(item) => value.get(*item)?,
            ListStep::Key(key) => value.get(key)?,
        };
        steps.push(step);
    }
    // A whole edit is no value.
    (steps.len() > 2).then_some(steps)
}

fn value_at<'a>(list: &'a mut Table, steps: &[ListStep]) -> Option<&'a mut Value> {
    let (ListStep::Key(first), rest) = steps.split_first()? else { return None };
    rest.iter().try_fold(list.get_mut(first)?, |value, step| match step {
        ListStep::Item(item) => value.get_mut(*item),
        ListStep::Key(key) => value.get_mut(key),
    })
}

/// Returns the value of a cell in place of another: a text for a text.
fn value_of(cell: &str, before: &Value) -> Option<Value> {
    if before.is_str() {
        return Some(Value::String(cell.to_owned()));
    }
    let mut table: Table = read_toml(&format!("value = {cell}")).ok()?;
    let value = table.remove("value")?;
    // A cell with several lines may have more keys.
    table.is_empty().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIST: &str = r#"
        [[edit]]
        op = "subtract"
        [edit.film_hole]
        exit = ["1mm", "0mm", "10mm"]
        flow = [1, 0, 0]
        normal = [0, 0, 1]
        angle = 30
        diameter = "0.8mm"
        length_ratio = 4

        [[edit]]
        label = { text = "7", at = ["0mm", "0mm"], height = "2mm" }
    "#;

    fn lists(table: &str) -> Vec<(String, Table)> {
        let variants = Variants::read(LIST, table).unwrap();
        let names: Vec<_> = variants.names().map(ToOwned::to_owned).collect();
        let lists = (0..names.len()).map(|k| read_toml(&variants.list(k)).unwrap());
        names.into_iter().zip(lists).collect()
    }

    #[test]
    fn cells_replace_values_of_the_list() {
        let base: Table = read_toml(LIST).unwrap();
        let found = lists(
            "name,1.film_hole.angle,2.label.text,1.film_hole.exit.2\na,35.5,,1mm\nb c,,42,\n",
        );
        let mut expected = [base.clone(), base];
        expected[0]["edit"][0]["film_hole"]["angle"] = Value::Float(35.5);
        expected[0]["edit"][0]["film_hole"]["exit"][1] = Value::String("1mm".to_owned());
        expected[1]["edit"][1]["label"]["text"] = Value::String("42".to_owned());
        let [first, second] = expected;
        assert_eq!(found, [("a".to_owned(), first), ("b c".to_owned(), second)]);
        // Without names, variants have numbers.
        let names: Vec<_> =
            lists("1.film_hole.angle\n20\n40\n").into_iter().map(|of| of.0).collect();
        assert_eq!(names, ["1", "2"]);
        let exit = lists("1.film_hole.exit\n\"[\"\"0mm\"\", \"\"0mm\"\", \"\"1mm\"\"]\"\n");
        assert_eq!(exit[0].1["edit"][0]["film_hole"]["exit"][2].as_str(), Some("1mm"));
    }

    #[test]
    fn tables_that_do_not_fit_the_list_are_refused() {
        for (table, words) in [
            ("", "no variant"),
            ("1.film_hole.angle\n", "no variant"),
            ("1.film_hole.angel\n30\n", "column `1.film_hole.angel`: the list has no such value"),
            ("3.film_hole.angle\n30\n", "no such value"),
            ("0.film_hole.angle\n30\n", "no such value"),
            ("angle\n30\n", "no such value"),
            ("1\n30\n", "no such value"),
            ("1.film_hole.angle.deg\n30\n", "no such value"),
            ("1.film_hole.angle,1.film_hole.angle\n30,40\n", "two columns"),
            (
                "1.film_hole.angle\nsteep\n",
                "line 2: column `1.film_hole.angle`: `steep` is no value",
            ),
            ("1.film_hole.angle\n\"1\nx = 2\"\n", "is no value"),
            ("1.film_hole.angle\n30\n100\n", "line 3: edit 1: angle"),
            (
                "1.film_hole.diameter\n0mm\n",
                "line 2: edit 1, film_hole.diameter: it must be above zero",
            ),
            ("name,1.film_hole.angle\na/b,30\n", "line 2: `a/b` is no name"),
            ("name,1.film_hole.angle\n,30\n", "is no name"),
            ("name,1.film_hole.angle\na,30\nA,40\n", "line 3: `A` is also the name on line 2"),
            ("1.film_hole.angle;name\n30;a\n", "commas"),
        ] {
            let error = Variants::read(LIST, table).unwrap_err().to_string();
            assert!(error.contains(words), "{error} for {table:?}");
        }
        let many = "1.film_hole.angle\n".to_owned() + &"30\n".repeat(10_001);
        assert!(Variants::read(LIST, &many).unwrap_err().to_string().contains("10001 variants"));
        assert!(matches!(Variants::read("edit = 3", "a\n1\n"), Err(VariantError::List(_))));
    }
}
