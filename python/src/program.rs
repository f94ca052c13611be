//! The program, within the process of Python: a wheel that had it as a file, too, would be twice as large.

use std::ffi::OsString;
use std::path::PathBuf;

use lamp_cli::{Host, run_lamp, run_stage};
use pyo3::prelude::*;

/// Runs `lamp`, or a stage of the pipeline under its own name, and returns its status. `program` is
/// the file that starts it again, and `words` are the words of its command line. Once in a process.
#[pyfunction]
pub(crate) fn run_program(
    py: Python<'_>,
    program: PathBuf,
    words: Vec<OsString>,
    stage: Option<&str>,
) -> u8 {
    Host { program, words }.note();
    py.detach(|| stage.map_or_else(run_lamp, run_stage))
}
