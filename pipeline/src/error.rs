//! Why a stage cannot begin, or ends early.

use std::error::Error as StdError;
use std::fmt;

use lamp_adaptive::HeightsError;
use lamp_build::TileError;
use lamp_edit::EditError;
use lamp_grayscale::DitherError;
use lamp_grayscale::exposure::ExposureError;
use lamp_machine::MachineLimit;
use lamp_offset::CompensateError;
use lamp_slicing::SliceError;
use lamp_stack::StackError;
use lamp_supports::CheckError;

/// Why a stage cannot begin, or ends early: the cause, and the places where it occurred.
#[derive(Debug)]
pub struct Error {
    kind: ErrorKind,
    /// From the cause outwards.
    places: Vec<String>,
    cause: Box<dyn StdError + Send + Sync>,
}

/// Whether the settings or the work are at fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// Settings contradict each other, or their input: other settings may work.
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

    /// Returns whether the settings or the work are at fault.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// Returns the cause, if it is of that type.
    pub fn cause<E: StdError + 'static>(&self) -> Option<&E> {
        self.cause.downcast_ref()
    }

    /// Returns the cause, and the places where it occurred, from the cause outwards.
    pub fn into_parts(self) -> (Box<dyn StdError + Send + Sync>, Vec<String>) {
        (self.cause, self.places)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Places were added from the cause outwards; people read from the file inwards.
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

/// Errors of libraries count as errors of the work, unless a stage states otherwise.
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
    CheckError,
    TileError,
    MachineLimit,
    std::io::Error,
);
