//! Writes JSON: answers of commands (`--json`), and reports that people can read, too, with a
//! list item on each line.

use std::path::Path;

use serde::Serialize;

use crate::exit::Exit;
use crate::streams::{print, write_file};

/// Prints a command's answer as one line: an object with the name of its schema, then `fields`.
/// docs/json.md describes each schema; keys may be added to one, but not change.
pub(crate) fn print_answer(schema: &str, fields: &impl Serialize) -> Result<(), Exit> {
    #[derive(Serialize)]
    struct Answer<'a, T> {
        schema: &'a str,
        #[serde(flatten)]
        fields: &'a T,
    }
    print(&(json(&Answer { schema, fields }) + "\n"))
}

/// A JSON object that is being written: first some fields, then lists.
pub(crate) struct JsonReport(String);

impl JsonReport {
    /// Starts a report with the fields of `head`.
    pub(crate) fn new(head: &impl Serialize) -> Self {
        let mut text = json(head);
        // Lists follow before the closing brace.
        text.pop();
        Self(text)
    }

    /// Adds a list.
    pub(crate) fn list(
        mut self,
        name: &str,
        items: impl IntoIterator<Item = impl Serialize>,
    ) -> Self {
        let lines: Vec<_> = items.into_iter().map(|item| format!("\n{}", json(&item))).collect();
        self.0 += &format!(",\n\"{name}\":[{}]", lines.join(","));
        self
    }

    /// Ends the report and writes it to a file.
    pub(crate) fn write(self, path: &Path) -> Result<(), Exit> {
        write_file(path, |out| writeln!(out, "{}}}", self.0))
    }
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("reports have text keys")
}
