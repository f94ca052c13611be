//! Documents in TOML, read so that an error names its line and key.

use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use crate::{line_of, one_line};

/// A step from a table or list to a value in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TomlStep {
    /// A key of a table.
    Key(String),
    /// An index of a list, from 0.
    Index(usize),
}

/// Why a text is no document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TomlError {
    /// The line, from 1.
    pub line: usize,
    /// The steps to the value at fault, or to the table that lacks a key or has an unknown one;
    /// `None` if the text is no TOML.
    pub path: Option<Vec<TomlStep>>,
    /// The fault, as one line.
    pub problem: String,
}

/// Reads a document from TOML.
///
/// # Errors
/// Returns an error if the text is no TOML, or a key is unknown, missing or wrong.
pub fn read_toml<T: DeserializeOwned>(text: &str) -> Result<T, TomlError> {
    let table = DeTable::parse(text).map_err(|error| TomlError {
        line: line_of(text, error.span()),
        path: None,
        problem: one_line(error.message()),
    })?;
    let span = table.span();
    let root = Spanned::new(span.clone(), DeValue::Table(table.into_inner()));
    T::deserialize(ValueDeserializer::from(root)).map_err(|error| {
        let at = error.span().unwrap_or(span);
        let mut path = Vec::new();
        // The text is parsed again rather than kept for the few documents that have faults. Recording
        // the path on the way would have the compiler write each type's reader several times over.
        if let Ok(table) = DeTable::parse(text) {
            find_in_table(table.get_ref(), &at, &mut path);
        }
        let problem = plain(&one_line(error.message()).replace(" field ", " key "));
        TomlError { line: line_of(text, Some(at)), path: Some(path), problem }
    })
}

/// Puts what serde says of a value in the words of people: `the text "30s" is not a number`.
fn plain(problem: &str) -> String {
    let of_value = ["invalid type: ", "invalid value: ", "invalid length "];
    let found = of_value.iter().find_map(|start| problem.strip_prefix(start));
    let Some((found, expected)) = found.and_then(|found| found.split_once(", expected ")) else {
        return problem.to_owned();
    };
    let of_word = |word: &str| found.strip_prefix(word).map(str::trim_start);
    let number = ["integer", "floating point", "boolean"].iter().find_map(|word| of_word(word));
    let found = match (number, of_word("string"), found) {
        (Some(number), ..) => number.to_owned(),
        (None, Some(text), _) => format!("the text {text}"),
        (.., "sequence") => "a list".to_owned(),
        (.., "map") => "a table".to_owned(),
        (.., length) if length.parse::<u64>().is_ok() => format!("a list of {length}"),
        (.., other) => other.to_owned(),
    };
    let whole = |most: &str| format!("a whole number from 0 to {most}");
    let of_length = expected.rsplit_once(' ').filter(|(words, _)| words.ends_with("length"));
    let expected = match (expected, of_length) {
        (_, Some((_, length))) => format!("a list of {length}"),
        ("f32" | "f64", _) => "a number".to_owned(),
        ("u8", _) => whole("255"),
        ("u16", _) => whole("65535"),
        ("u32", _) => whole("4294967295"),
        ("u64" | "usize", _) => "a whole number from 0 on".to_owned(),
        ("i8" | "i16" | "i32" | "i64" | "isize", _) => "a whole number in range".to_owned(),
        ("a string" | "a borrowed string", _) => "a text in quotes".to_owned(),
        ("a boolean", _) => "true or false".to_owned(),
        ("a sequence", _) => "a list".to_owned(),
        ("a map", _) => "a table".to_owned(),
        (other, _) if other.starts_with("struct ") => "a table".to_owned(),
        (other, _) => other.to_owned(),
    };
    format!("{found} is not {expected}")
}

/// Leads `path` to the innermost value at a place of the text, or to the table that has a key there.
fn find_in_table(table: &DeTable<'_>, at: &Range<usize>, path: &mut Vec<TomlStep>) -> bool {
    table.iter().any(|(key, value)| {
        if key.span() == *at && value.span() != *at {
            return true;
        }
        find(TomlStep::Key(key.get_ref().to_string()), value, at, path)
    })
}

fn find(
    step: TomlStep,
    value: &Spanned<DeValue<'_>>,
    at: &Range<usize>,
    path: &mut Vec<TomlStep>,
) -> bool {
    path.push(step);
    let is_within = match value.get_ref() {
        DeValue::Table(table) => find_in_table(table, at, path),
        DeValue::Array(list) => list
            .iter()
            .enumerate()
            .any(|(index, value)| find(TomlStep::Index(index), value, at, path)),
        _ => false,
    };
    let is_found = is_within || value.span() == *at;
    if !is_found {
        path.pop();
    }
    is_found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only errors are looked at")]
    struct Shelf {
        name: String,
        lamps: Vec<Lamp>,
        place: Option<Place>,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only errors are looked at")]
    struct Lamp {
        watts: f64,
        at: Option<[u8; 2]>,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(rename_all = "kebab-case")]
    enum Place {
        Wall,
        Table {
            #[expect(dead_code, reason = "only errors are looked at")]
            legs: u8,
        },
    }

    /// An error as `line: path: problem`.
    fn error(text: &str) -> String {
        let error = read_toml::<Shelf>(text).unwrap_err();
        let step = |step: &TomlStep| match step {
            TomlStep::Key(key) => key.clone(),
            TomlStep::Index(index) => index.to_string(),
        };
        let path = error.path.map(|path| path.iter().map(step).collect::<Vec<_>>().join("/"));
        format!("{}: {}: {}", error.line, path.as_deref().unwrap_or("-"), error.problem)
    }

    #[test]
    fn an_error_names_the_innermost_value_or_the_table_that_has_or_lacks_a_key() {
        for (text, words) in [
            ("name = 'a'\nlamps = [", "2: -: "),
            ("name = 1\nlamps = []", "1: name: `1` is not a text in quotes"),
            ("lamps = []", "1: : missing key `name`"),
            ("name = 'a'\nlamps = []\nq = 1", "3: : unknown key `q`"),
            (
                "name = 'a'\n[[lamps]]\nwatts = 1\n[[lamps]]\nwat = 2",
                "5: lamps/1: unknown key `wat`",
            ),
            ("name = 'a'\n[[lamps]]\nwatts = 1\n[[lamps]]\n", "4: lamps/1: missing key `watts`"),
            (
                "name = 'a'\nlamps = [{watts = 'b'}]",
                "2: lamps/0/watts: the text \"b\" is not a number",
            ),
            ("name = 'a'\nlamps = [3]", "2: lamps/0: `3` is not a table"),
            ("name = 'a'\nlamps = 3", "2: lamps: `3` is not a list"),
            ("name = true\nlamps = []", "1: name: `true` is not a text in quotes"),
            ("name = [1.5]\nlamps = []", "1: name: a list is not a text in quotes"),
            (
                "name = 'a'\nlamps = [{watts = 1, at = [1]}]",
                "2: lamps/0/at: a list of 1 is not a list of 2",
            ),
            (
                "name = 'a'\nlamps = [{watts = 1, at = [1, 1.5]}]",
                "2: lamps/0/at/1: `1.5` is not a whole number from 0 to 255",
            ),
            (
                "name = 'a'\nlamps = [{watts = 1, at = [1, 256]}]",
                "2: lamps/0/at/1: `256` is not a whole number from 0 to 255",
            ),
            ("name = 'a'\nlamps = []\nplace = 'floor'", "3: place: unknown variant `floor`"),
            ("name = 'a'\nlamps = []\nplace = { table = { legs = -1 } }", "3: place/table/legs: "),
            ("name = 'a'\nlamps = []\n[place.table]\nlegs = -1", "4: place/table/legs: "),
            ("name = 1979-05-27\nlamps = []", "1: name: "),
        ] {
            assert!(error(text).starts_with(words), "{text}: {}", error(text));
        }
        let shelf: Shelf = read_toml("name = 'a'\nlamps = []\nplace = 'wall'").unwrap();
        assert!(matches!(shelf.place, Some(Place::Wall)));
    }

    #[test]
    fn damaged_texts_are_read_or_refused() {
        const TEXT: &str =
            "name = 'a'\n[[lamps]]\nwatts = 1.5\nat = [1, 2]\n[place.table]\nlegs = 4\n";
        for at in 0..TEXT.len() {
            for with in ["", "=", "[", "'", "0", "."] {
                let text = format!("{}{with}{}", &TEXT[..at], &TEXT[at + 1..]);
                if let Err(error) = read_toml::<Shelf>(&text) {
                    assert!(error.line <= 7 && !error.problem.contains('\n'), "{text}: {error:?}");
                }
            }
        }
    }
}
