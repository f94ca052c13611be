//! Errors of LAMP as exceptions, with the sentences of the program.

use std::fmt;
use std::io;

use lamp_pipeline::{Error, ErrorKind};
use lamp_planning::target::TargetError;
use lamp_slicing::SliceError;
use lamp_stack::StackError;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// The cause of an error that Python code raised on the way.
#[derive(Debug)]
struct Raised(PyErr);

impl fmt::Display for Raised {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for Raised {}

/// Work that nobody waits for anymore.
#[derive(Debug)]
struct Stopped;

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the work was stopped")
    }
}

impl std::error::Error for Stopped {}

/// Returns an exception on its way through stages.
pub(crate) fn raised(error: PyErr) -> Error {
    Error::new(ErrorKind::Work, Raised(error))
}

/// Returns the error of work that nobody waits for.
pub(crate) fn stopped() -> Error {
    Error::new(ErrorKind::Work, Stopped)
}

/// Returns an error of settings as an exception.
pub(crate) fn settings(py: Python<'_>, sentence: impl Into<String>) -> PyErr {
    exception(py, &Error::settings(sentence))
}

/// Returns the exception of an error. An exception that Python code raised comes back as it was.
pub(crate) fn exception(py: Python<'_>, error: &Error) -> PyErr {
    if let Some(Raised(error)) = error.cause() {
        return error.clone_ref(py);
    }
    let name = match (error.kind(), io_cause(error)) {
        (_, Some(cause)) if cause.kind() == io::ErrorKind::NotFound => "LampFileNotFoundError",
        (_, Some(_)) => "LampFileError",
        (ErrorKind::Settings, None) => "LampSettingsError",
        (ErrorKind::Work, None) => "LampError",
    };
    let made = || -> PyResult<PyErr> {
        let class = py.import("lamp_slicer._errors")?.getattr(name)?.cast_into::<PyType>()?;
        let value = class.call1((error.to_string(),))?;
        if let Some(number) = io_cause(error).and_then(io::Error::raw_os_error) {
            value.setattr("errno", number)?;
        }
        Ok(PyErr::from_value(value))
    };
    made().unwrap_or_else(|error| error)
}

fn io_cause(error: &Error) -> Option<&io::Error> {
    let of_stack = match error.cause() {
        Some(StackError::Io(error)) => Some(error),
        _ => None,
    };
    let of_part = match error.cause() {
        Some(SliceError::Io(error)) => Some(error),
        _ => None,
    };
    let of_target = match error.cause() {
        Some(TargetError::Io(error) | TargetError::Part(SliceError::Io(error))) => Some(error),
        _ => None,
    };
    error.cause().or(of_stack).or(of_part).or(of_target)
}
