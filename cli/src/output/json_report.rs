//! Writes JSON: answers of commands (`--json`), and reports that people can read, too, with a
//! list item on each line.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use clap::Args;
use serde::Serialize;

use crate::exit::Exit;
use crate::output::endings::parse_report;
use crate::streams::{is_stream, print, write_file};

/// Tests that `docs/schemas` has the schemas of answers: for each, its name, the type with its keys, and
/// for a report the lists that follow, with the types of their items.
macro_rules! schemas {
    ($($name:literal: $head:ty $(, $list:literal: [$item:ty])*;)+) => {
        #[test]
        fn schemas_are_as_the_types() {
            $(
                let lists = &[$(($list, <$item as schemars::JsonSchema>::json_schema as _)),*];
                crate::output::schema::check::<$head>($name, lists);
            )+
        }
    };
}

pub(crate) use schemas;

#[derive(Serialize)]
struct Answer<'a, T> {
    schema: &'a str,
    #[serde(flatten)]
    fields: &'a T,
}

/// Prints a command's answer as one line: an object with the name of its schema, then `fields`.
/// docs/json.md describes each schema; keys may be added to one, but not change.
pub(crate) fn print_answer(schema: &str, fields: &impl Serialize) -> Result<(), Exit> {
    write_answer(schema, fields, Path::new("-"))
}

/// Writes a command's answer, as [`print_answer`] does, to a file, or prints it if `path` is `-`.
pub(crate) fn write_answer(schema: &str, fields: &impl Serialize, path: &Path) -> Result<(), Exit> {
    let line = json(&Answer { schema, fields }) + "\n";
    if is_stream(path) {
        print(&line)
    } else {
        write_file(path, |out| out.write_all(line.as_bytes()))
    }
}

/// Where the results of a command go as JSON.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct ReportTo {
    /// Write the results as JSON (docs/json.md): a file, or - for standard output
    #[arg(long, value_name = "FILE.json", value_parser = parse_report)]
    report: Option<PathBuf>,

    /// Print the results as JSON: short for --report -
    #[arg(long, conflicts_with = "report")]
    json: bool,
}

impl ReportTo {
    /// Returns the file that is wanted, if any; `-` is standard output.
    pub(crate) fn path(&self) -> Option<&PathBuf> {
        static PRINTED: LazyLock<PathBuf> = LazyLock::new(|| "-".into());
        if self.json { Some(&PRINTED) } else { self.report.as_ref() }
    }

    /// Returns whether standard output is for JSON, so that no text goes there.
    pub(crate) fn is_printed(&self) -> bool {
        self.path().is_some_and(|path| is_stream(path))
    }

    /// Refuses to print JSON where `output` goes to standard output.
    pub(crate) fn check_output(&self, output: &Path) -> Result<(), Exit> {
        if !self.is_printed() || !is_stream(output) {
            return Ok(());
        }
        let text = "standard output cannot take both the output and its JSON: name a file with -o, or \
                    write --report report.json";
        Err(Exit::usage(text))
    }
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

    /// Starts a report with the name of its schema, and then the fields of `head`.
    pub(crate) fn of_schema(schema: &str, head: &impl Serialize) -> Self {
        Self::new(&Answer { schema, fields: head })
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

    /// Ends the report and writes it to a file, or prints it if `path` is `-`.
    pub(crate) fn write(self, path: &Path) -> Result<(), Exit> {
        if is_stream(path) {
            return print(&format!("{}}}\n", self.0));
        }
        write_file(path, |out| writeln!(out, "{}}}", self.0))
    }
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("reports have text keys")
}
