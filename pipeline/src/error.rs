//! Why a stage cannot begin, or ends early.

use std::error::Error as StdError;
use std::fmt;

use lamp_adaptive::HeightsError;
use lamp_edit::EditError;
use lamp_grayscale::DitherError;
use lamp_grayscale::exposure::ExposureError;
use lamp_machine::MachineLimit;
use lamp_offset::CompensateError;
use lamp_slicer::SliceError;
use lamp_stack::StackError;

/// Why a stage cannot begin, or ends early: the cause, and the places that it was met at.
#[derive(Debug)]
pub struct Error {
    kind: ErrorKind,
    /// From the cause outwards.
    places: Vec<String>,
    cause: Box<dyn StdError + Send + Sync>,
}

/// The side that an error is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// Settings contradict each other, or what they are for: others may do.
    Settings,
    /// A file cannot be used, or a stage failed on its layers.
    Work,
}

impl Error {
    /// Returns an error of the settings, in a sentence.
    pub fn settings(sentence: impl Into<String>) -> Self {
        Self::new(ErrorKind::Settings, sentence.into())
    }

    /// Returns an error of a file or its layers, in a sentence.
    pub fn work(sentence: impl Into<String>) -> Self {
        Self::new(ErrorKind::Work, sentence.into())
    }

    /// Returns an error with a cause.
    pub fn new(kind: ErrorKind, cause: impl Into<Box<dyn StdError + Send + Sync>>) -> Self {
        Self { kind, places: Vec::new(), cause: cause.into() }
    }

    /// Puts a place before the message: a file, a layer.
    #[must_use]
    pub fn at(mut self, place: impl Into<String>) -> Self {
        self.places.push(place.into());
        self
    }

    /// Returns the side that the error is on.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// Returns the cause, if it is of that type.
    pub fn cause<E: StdError + 'static>(&self) -> Option<&E> {
        self.cause.downcast_ref()
    }

    /// Returns the cause, and the places that it was met at, from the cause outwards.
    pub fn into_parts(self) -> (Box<dyn StdError + Send + Sync>, Vec<String>) {
        (self.cause, self.places)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.places.iter().rev().try_for_each(|place| write!(f, "{place}: "))?;
        write!(f, "{}", self.cause)?;
        let mut next = self.cause.source();
        while let Some(source) = next {
            write!(f, ": {source}")?;
            next = source.source();
        }
        Ok(())
    }
}

impl StdError for Error {
    // The message has the whole chain.
}

/// Errors of libraries are errors of the work, unless a stage says otherwise.
macro_rules! of_work {
    ($($error:ty),+ $(,)?) => {
        $(impl From<$error> for Error {
            fn from(error: $error) -> Self {
                Self::new(ErrorKind::Work, error)
            }
        })+
    };
}

of_work!(
    SliceError,
    StackError,
    HeightsError,
    ExposureError,
    DitherError,
    CompensateError,
    EditError,
    MachineLimit,
    std::io::Error,
);
