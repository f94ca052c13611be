//! Night files: parts, their stages, and builds, as TOML.

mod read;
#[cfg(test)]
mod tests;
mod walk;
mod watched;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use lamp_pipeline::documents::nearest;
use thiserror::Error;

use walk::Walk;
pub use watched::WatchedNames;

/// The contents of a night file.
#[derive(Clone, Debug, PartialEq)]
pub struct Night {
    /// Parts in the order of the file, each with a name of its own.
    pub parts: Vec<Part>,
    /// Builds in the order of the file.
    pub builds: Vec<Build>,
    /// The folder of the store.
    pub store: PathBuf,
    /// The place that names it, if any.
    pub store_place: Option<Place>,
    /// Where results go.
    pub output: NightOutput,
}

/// A part, and its stages.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The name that builds and results have.
    pub name: String,
    /// The part's file, or a folder that it may be in, from the folder of the night file.
    pub file: PathBuf,
    /// Why there is no file, if that is known already.
    pub fault: Option<String>,
    /// The stages, the slicing first.
    pub stages: Vec<Stage>,
    /// The `check` command, with its options.
    pub check: Stage,
    /// The number of ranges of layers, if given.
    pub ranges: Option<u32>,
    /// Where the file is named.
    pub place: Place,
}

/// A stage as on the command line, without `lamp` and without files.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// The command, and its options.
    pub words: Vec<String>,
    /// Where it stands.
    pub place: Place,
}

/// A build of parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Build {
    /// The name that its result has.
    pub name: String,
    /// Names of parts, each with a number of copies, if that is given.
    pub parts: Vec<(String, Option<u32>)>,
    /// The `tile` command, with its machine and options, and without stacks.
    pub tile: Stage,
}

/// Where results go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NightOutput {
    /// The folder, made if need be.
    pub folder: PathBuf,
    /// The form of stacks in it.
    pub format: NightFormat,
}

/// The form of delivered stacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NightFormat {
    /// As the store has them.
    Lamp,
    /// Multipage TIFFs.
    Tif,
}

impl NightFormat {
    /// Returns the extension of file names.
    pub fn end(self) -> &'static str {
        match self {
            Self::Lamp => "lamp",
            Self::Tif => "tif",
        }
    }
}

/// A place in a night file, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Place {
    /// The line.
    pub line: usize,
    /// The column, in letters.
    pub column: usize,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "line {}, column {}", self.line, self.column)
    }
}

/// An error in a night file, and its place.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{place}: {problem}")]
pub struct NightError {
    /// The place.
    pub place: Place,
    /// The problem, and how to solve it.
    pub problem: String,
}

impl Night {
    /// Reads the text of a night file. File names are relative to its folder.
    ///
    /// # Errors
    /// Returns an error if it is no night file: one sentence, with its place.
    pub fn parse(text: &str, path: &Path) -> Result<Self, NightError> {
        read::night(text, path, None)
    }

    /// Reads the text of a night file, which may name no part. Each file of `others` that it does not
    /// name is a part with the defaults. It has the name that `names` has for it, unless the night file
    /// gives that to another; names of new files are added.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_with(
        text: &str,
        path: &Path,
        others: &[PathBuf],
        names: &mut WatchedNames,
    ) -> Result<Self, NightError> {
        read::night(text, path, Some((others, names)))
    }

    /// Returns the part with a name.
    pub fn part(&self, name: &str) -> Option<&Part> {
        self.parts.iter().find(|part| part.name == name)
    }
}

/// Returns a name for the part of each file that no other has and a night file accepts: the file's own,
/// with its ending where several would have the same.
pub fn part_names(files: &[PathBuf]) -> Vec<String> {
    read::part_names(files, [])
}

/// Returns `: did you mean X?` for the nearest of some words, if one is near.
fn did_you_mean<'a>(word: &str, words: impl IntoIterator<Item = &'a str>) -> String {
    nearest(word, words).map(|other| format!(": did you mean {other}?")).unwrap_or_default()
}

/// Returns the first name that occurs twice.
fn twice<'a, T>(items: &'a [T], name: impl Fn(&'a T) -> &'a str) -> Option<(&'a T, &'a T)> {
    let mut seen = BTreeMap::new();
    items.iter().find_map(|item| seen.insert(name(item), item).map(|before| (before, item)))
}
