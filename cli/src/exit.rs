//! Why a command exits early, and with which status.

use std::fmt;
use std::io;

use lamp_batch::BatchError;
use lamp_build::{FieldsError, LayoutError, RecipeError, TileError};
use lamp_edit::EditError;
use lamp_gantry::GantryError;
use lamp_grayscale::DitherError;
use lamp_grayscale::calibrate::{DataError, FitError};
use lamp_grayscale::exposure::{ExposureError, LampError};
use lamp_machine::MachineLimit;
use lamp_offset::CompensateError;
use lamp_pipeline::ErrorKind;
use lamp_planning::learn::{JobError, LearnError};
use lamp_planning::speed::{PartError, PlatformError, SpeedPlanError};
use lamp_planning::voxels::VoxelPlanError;
use lamp_planning::{LightError, NoLight};
use lamp_plots::PlotError;
use lamp_slicing::SliceError;
use lamp_slicing::topology::NoSolid;
use lamp_stack::{JoinError, SplitError, StackError};
use lamp_supports::{CheckError, SupportError};
use lamp_view::SurfaceError;

use crate::terminal::hints::hint;
use crate::terminal::usage::in_given_words;

/// Why a command exits early. The cause decides the status.
#[derive(Debug)]
pub(crate) enum Exit {
    /// Wrong usage: status 2.
    Usage(anyhow::Error),
    /// Bad input, or a failure on the way: status 1.
    Failed(anyhow::Error),
    /// Writing the output failed: status 1, or none if its reader went away.
    Output(anyhow::Error),
    /// The work is done, but found what needs a person: status 3.
    Findings(String),
    /// A task of a batch failed, with the status by which its engine decides what to do.
    Task(u8, String),
    /// The work is done, and two stacks differ: status 1, as of `cmp` and `diff`. All is reported.
    Different,
}

impl Exit {
    pub(crate) fn usage(message: impl Into<String>) -> Self {
        Self::Usage(anyhow::Error::msg(message.into()))
    }

    /// Returns a library's error as wrong usage, where options caused it.
    pub(crate) fn wrong_options(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self::Usage(error.into())
    }

    pub(crate) fn output(error: io::Error, place: &'static str) -> Self {
        Self::Output(anyhow::Error::new(error).context(place))
    }

    /// Puts what was being worked on before the message.
    pub(crate) fn at(self, place: impl fmt::Display + Send + Sync + 'static) -> Self {
        match self {
            Self::Usage(error) => Self::Usage(error.context(place)),
            Self::Failed(error) => Self::Failed(error.context(place)),
            Self::Output(error) => Self::Output(error.context(place)),
            Self::Findings(message) => Self::Findings(format!("{place}: {message}")),
            Self::Task(status, message) => Self::Task(status, format!("{place}: {message}")),
            Self::Different => Self::Different,
        }
    }

    /// Returns the error of one type that caused it, if any.
    pub(crate) fn cause<E: std::error::Error + Send + Sync + 'static>(&self) -> Option<&E> {
        let Self::Failed(error) = self else { return None };
        causes(error).find_map(|cause| cause.downcast_ref())
    }

    /// Returns what kind of reading or writing failed, if that is the cause.
    pub(crate) fn io_kind(&self) -> Option<io::ErrorKind> {
        let (Self::Failed(error) | Self::Output(error)) = self else { return None };
        let kind = |cause: &(dyn std::error::Error + 'static)| match cause.downcast_ref() {
            // It is transparent, so that its error is no cause of its own.
            Some(StackError::Io(error)) => Some(error.kind()),
            _ => cause.downcast_ref().map(io::Error::kind),
        };
        causes(error).find_map(kind)
    }

    pub(crate) fn status(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::Failed(_) | Self::Output(_) | Self::Different => 1,
            Self::Findings(_) => 3,
            Self::Task(status, _) => *status,
        }
    }

    /// Returns whether the program that reads the output has ended, as `head` does. That is no
    /// failure of this one.
    pub(crate) fn is_reader_gone(&self) -> bool {
        let Self::Output(error) = self else { return false };
        // Writers wrap the error in their own.
        causes(error).any(|cause| {
            let io = match cause.downcast_ref::<StackError>() {
                Some(StackError::Io(io)) => Some(io),
                _ => cause.downcast_ref::<io::Error>(),
            };
            io.is_some_and(|io| io.kind() == io::ErrorKind::BrokenPipe)
        })
    }
}

impl fmt::Display for Exit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Findings(message) | Self::Task(_, message) => f.write_str(message),
            Self::Different => f.write_str("the stacks differ"),
            Self::Usage(error) | Self::Failed(error) | Self::Output(error) => {
                let hint = causes(error).find_map(hint).map(|hint| format!(": {hint}"));
                let text = format!("{error:#}{}", hint.unwrap_or_default());
                // Wrong usage names options as they are meant.
                let is_usage = matches!(self, Self::Usage(_));
                f.write_str(&if is_usage { text } else { in_given_words(text) })
            }
        }
    }
}

/// The cause in an error of a room, which has its type in a box.
#[derive(Debug)]
struct Boxed(Box<dyn std::error::Error + Send + Sync>);

impl fmt::Display for Boxed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for Boxed {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.0.source()
    }
}

/// Returns an error whose type is in a box, so that [`Exit::cause`] and hints know it.
pub(crate) fn boxed(cause: Box<dyn std::error::Error + Send + Sync>) -> anyhow::Error {
    anyhow::Error::new(Boxed(cause))
}

/// Returns an error and its causes, each under its own type.
fn causes(error: &anyhow::Error) -> impl Iterator<Item = &(dyn std::error::Error + 'static)> {
    error.chain().map(|cause| match cause.downcast_ref() {
        Some(Boxed(cause)) => &**cause as &(dyn std::error::Error + 'static),
        None => cause,
    })
}

/// Makes errors of libraries failures.
macro_rules! failures {
    ($($error:ty),+ $(,)?) => {
        $(impl From<$error> for Exit {
            fn from(error: $error) -> Self {
                Self::Failed(error.into())
            }
        })+
    };
}

failures!(
    LightError,
    NoLight,
    VoxelPlanError,
    PartError,
    SpeedPlanError,
    JobError,
    LearnError,
    PlatformError,
    SliceError,
    CheckError,
    SupportError,
    SurfaceError,
    DitherError,
    EditError,
    TileError,
    FieldsError,
    GantryError,
    LayoutError,
    RecipeError,
    MachineLimit,
    NoSolid,
    CompensateError,
    JoinError,
    SplitError,
    DataError,
    FitError,
    ExposureError,
    LampError,
);

/// Distinguishes failures to write from stacks without layers and from pages that stages cannot
/// decode; errors of the layers pass through as they are.
impl From<StackError> for Exit {
    fn from(error: StackError) -> Self {
        match error {
            // A stack without layers and a page that cannot be decoded are bad input, though only
            // the writer notices.
            StackError::NoLayers | StackError::InFile { .. } => Self::Failed(error.into()),
            error => Self::Output(error.into()),
        }
    }
}

impl From<BatchError> for Exit {
    fn from(error: BatchError) -> Self {
        match error {
            BatchError::Night { .. } | BatchError::Stage(_) | BatchError::Options(_) => {
                Self::Usage(error.into())
            }
            BatchError::Begin(_) | BatchError::Result(_) => Self::Output(error.into()),
            BatchError::Join(error) => error.into(),
            BatchError::Stages(error) => error.into(),
            error => Self::Failed(error.into()),
        }
    }
}

impl From<PlotError> for Exit {
    fn from(error: PlotError) -> Self {
        match error {
            PlotError::Name(_) | PlotError::PictureName(_) => Self::Usage(error.into()),
            error => Self::Failed(error.into()),
        }
    }
}

impl From<lamp_pipeline::Error> for Exit {
    fn from(error: lamp_pipeline::Error) -> Self {
        let kind = error.kind();
        let (cause, places) = error.into_parts();
        // Places come from the cause outwards, as contexts wrap.
        let error = places.into_iter().fold(boxed(cause), anyhow::Error::context);
        match kind {
            ErrorKind::Settings => Self::Usage(error),
            ErrorKind::Work => Self::Failed(error),
        }
    }
}

impl From<anyhow::Error> for Exit {
    fn from(error: anyhow::Error) -> Self {
        Self::Failed(error)
    }
}
