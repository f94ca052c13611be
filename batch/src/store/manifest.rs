//! The manifest of a result: how it was made, its digest, and findings on the way.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::key::Recipe;

/// The record of a task. The same task always gives the same manifest: times are in the journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// The recipe that decided the result.
    pub recipe: Recipe,
    /// The result, if the task has one besides facts.
    pub result: Option<Written>,
    /// The task's findings, by name.
    pub facts: Map<String, Value>,
}

impl Manifest {
    /// Returns a fact that is a count; zero if it is not recorded.
    pub fn count(&self, fact: &str) -> u64 {
        self.facts.get(fact).and_then(Value::as_u64).unwrap_or(0)
    }
}

/// A result as it was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Written {
    /// `blake3:` and 64 hexadecimal digits.
    pub digest: String,
    /// Its size.
    pub bytes: u64,
}
