//! Stages as they stand on a command line, and what follows on the stages of parts, for nights.

pub(crate) mod after;
pub(crate) mod calls;
#[cfg(test)]
mod goldens;
mod parse;
#[cfg(test)]
mod tests;

use std::path::Path;

use lamp_pipeline::Chain;

pub(crate) use after::After;
pub(crate) use parse::StageError;

/// The stages of a part: first layer by layer, in ranges, then on the whole stack.
pub(crate) struct Stages {
    pub(crate) chain: Chain,
    pub(crate) after: Vec<After>,
}

impl Stages {
    /// Reads stages as they stand on a command line, split into words, the part left out. Files
    /// that options name stand in `folder`, unless their paths are absolute; they are read.
    ///
    /// # Errors
    /// Returns an error for the first stage that is refused.
    pub(crate) fn parse(stages: &[Vec<String>], folder: &Path) -> Result<Self, StageError> {
        parse::parse(stages, folder)
    }
}
