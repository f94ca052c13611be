//! JSON that people read, too: an object whose last list has a line for each
//! item.

use std::io::{self, Write};
use std::path::PathBuf;

use serde::Serialize;

/// Writes the items of a JSON list, each on a line of its own.
pub(crate) fn write_lines(
    lines: impl Iterator<Item = impl Serialize>,
    out: &mut dyn Write,
) -> io::Result<()> {
    for (k, line) in lines.enumerate() {
        write!(out, "{}\n{}", if k == 0 { "" } else { "," }, serde_json::to_string(&line)?)?;
    }
    Ok(())
}

/// To the nanometre: more digits say nothing. Adding zero turns -0 into 0.
pub(crate) fn to_nm(mm: f64) -> f64 {
    (mm * 1e6).round() / 1e6 + 0.0
}

/// Parses the name of a report. Standard output is for the stack.
pub(crate) fn parse_report(text: &str) -> Result<PathBuf, String> {
    match text {
        "-" => Err("standard output is for the stack: name a file, as report.json".to_owned()),
        "" => Err("name a file, as report.json".to_owned()),
        name => Ok(PathBuf::from(name)),
    }
}
