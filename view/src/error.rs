//! Reasons why something is not shown.

use lamp_stack::StackError;
use thiserror::Error;

/// A reason why something is not shown.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ViewError {
    /// There is nothing with that number.
    #[error("there is no such {0}")]
    NoSuch(&'static str),
    /// A number of a request is malformed or out of range.
    #[error("{0}")]
    Malformed(&'static str),
    /// The request does not fit the state of the work.
    #[error("{0}")]
    Refused(String),
    /// The folder has another file of this name.
    #[error("the folder has another file named {0}")]
    Taken(String),
    /// The stack has changed since it was opened.
    #[error("{0}")]
    Changed(String),
    /// A page cannot be read or decoded.
    #[error("{0}")]
    Unreadable(String),
    /// Nobody waits for the answer any more.
    #[error("the request was given up")]
    GivenUp,
}

impl From<StackError> for ViewError {
    fn from(error: StackError) -> Self {
        Self::from(&error)
    }
}

impl From<&StackError> for ViewError {
    fn from(error: &StackError) -> Self {
        let mut sentence = error.to_string();
        let mut source = std::error::Error::source(error);
        while let Some(cause) = source {
            sentence = format!("{sentence}: {cause}");
            source = cause.source();
        }
        match error {
            StackError::Changed => Self::Changed(sentence),
            _ => Self::Unreadable(sentence),
        }
    }
}
