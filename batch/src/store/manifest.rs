//! The manifest of a result: how it was made, its digest, and findings on the way.

use lamp_pipeline::RangeFindings;
use serde::{Deserialize, Serialize};

use crate::key::TaskRecipe;

/// The record of a task. The same task always gives the same manifest: times are in the journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// The recipe that decided the result.
    pub recipe: TaskRecipe,
    /// The result, if the task has one besides facts.
    pub result: Option<Written>,
    /// Counts and findings of the task.
    pub facts: Facts,
}

/// Counts and findings of a task. A fact that the task does not have is left out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Facts {
    /// The layers of its stack.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layers: Option<u64>,
    /// The findings of stages in those layers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stages: Option<RangeFindings>,
    /// Remarks on the way.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// The findings of its check.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub check: Option<CheckCounts>,
}

/// The number of findings of a check.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CheckCounts {
    /// Islands.
    pub islands: u64,
    /// All findings that need a person.
    pub findings: u64,
}

/// A result as it was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Written {
    /// `blake3:` and 64 hexadecimal digits.
    pub digest: String,
    /// Its size.
    pub bytes: u64,
}
