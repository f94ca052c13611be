//! Errors of planning, doing and delivering the work of a night.

use std::io;
use std::path::{Path, PathBuf};

use lamp_stack::JoinError;

use crate::commands::StageError;
use crate::key::Key;
use crate::night::Place;
use crate::store::{Damage, StoreError};

/// The error of a night's work.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BatchError {
    /// The night file asks for what there is not.
    #[error("{place}: {why}")]
    Night {
        /// The place in the night file.
        place: Place,
        /// The sentence.
        why: String,
    },
    /// A part cannot be made.
    #[error("{0}")]
    Part(String),
    /// A file or a folder cannot be read or made.
    #[error("{}", path.display())]
    File {
        /// Its path.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The result of a task could not be written to the store.
    #[error("the store")]
    Result(#[source] io::Error),
    /// The store takes no result.
    #[error(transparent)]
    Begin(StoreError),
    /// The store does not have the task.
    #[error("{}: the store has no such task: run its batch again", .0.short())]
    NoTask(Key),
    /// The task was planned by another version.
    #[error("the task is from a different lamp version: run its batch again")]
    OtherVersion(#[source] serde_json::Error),
    /// A file is not as it was when the task was planned.
    #[error("{}: it has changed since the batch was planned: run the batch again", .0.display())]
    Changed(PathBuf),
    /// A result that the task needs is damaged.
    #[error("the result of {name} is made again")]
    Damaged {
        /// The task whose result it is.
        name: String,
        /// The damage.
        source: Damage,
    },
    /// A stage of the task is refused.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// An option of the task is refused.
    #[error("{0}")]
    Options(String),
    /// Ranges of a part cannot be joined.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// A stage failed.
    #[error(transparent)]
    Stages(#[from] lamp_pipeline::Error),
}

impl BatchError {
    /// Returns what makes the error of a path.
    pub(crate) fn file(path: &Path) -> impl FnOnce(io::Error) -> Self + use<'_> {
        move |source| Self::File { path: path.to_owned(), source }
    }
}
