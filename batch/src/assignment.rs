//! The work of tasks, as a store keeps it for the processes that do it.

use std::ops::Range;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::path_bytes;

/// The work of a task, and its place.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Assignment {
    /// The folder that names of files are from.
    #[serde(with = "path_bytes")]
    pub(crate) folder: PathBuf,
    pub(crate) what: Work,
}

/// The work of a task.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Work {
    /// Makes layers of a part.
    Range {
        #[serde(with = "path_bytes")]
        part: PathBuf,
        /// The name that stands for the part's in the store.
        stored_name: String,
        stages: Vec<Vec<String>>,
        layers: Range<u32>,
    },
    /// Joins ranges.
    Join,
    /// Applies a stage to a whole stack: `which` is its index among the stages that need one.
    Whole {
        #[serde(with = "path_bytes")]
        part: PathBuf,
        stages: Vec<Vec<String>>,
        which: usize,
    },
    /// Finds what needs a person.
    Check { words: Vec<String> },
    /// Lays out copies.
    Tile { words: Vec<String>, copies: Vec<Option<u32>> },
}
