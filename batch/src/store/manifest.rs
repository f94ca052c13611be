//! What a result is: how it was made, its digest, and what was found on the way.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::key::Recipe;

/// What a task has done. The same task always gives the same manifest: times are in the journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// What decided the result.
    pub recipe: Recipe,
    /// The result, if the task has one besides facts.
    pub result: Option<Written>,
    /// What the task found, by its name.
    pub facts: Map<String, Value>,
}

impl Manifest {
    /// Returns a fact that is a count; zero where nothing is told.
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
