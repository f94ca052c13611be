//! The stages of a part, in one process: from the part to layers to layers, without files between.
//!
//! Each stage is what its command does between a reader and a writer. [`Chain`] runs them for a
//! range of layers; ranges that are joined have the bytes of the pipeline typed by hand.

pub(crate) mod after;
pub(crate) mod calls;
mod chain;
pub(crate) mod compensate;
pub(crate) mod dither;
pub(crate) mod edit;
mod findings;
pub(crate) mod fix;
#[cfg(test)]
mod goldens;
mod names;
mod parse;
pub(crate) mod slice;
mod survey;
#[cfg(test)]
mod tests;

use std::path::Path;

pub(crate) use after::After;
pub(crate) use chain::Chain;
pub(crate) use parse::StageError;
#[allow(unused_imports, reason = "`lamp batch` uses them")]
pub(crate) use {
    findings::RangeFindings,
    names::{Names, stored_name},
    survey::Survey,
};

use lamp_stack::Layer;

use crate::exit::Exit;

/// Layers on their way from stage to stage.
pub(crate) type Layers<'a> = Box<dyn Iterator<Item = Result<Layer, Exit>> + 'a>;

/// What is done to a part: first layer by layer, in ranges, then to the whole stack.
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
