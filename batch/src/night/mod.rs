//! Night files: parts, their stages, and builds, as TOML.

mod read;
#[cfg(test)]
mod tests;
mod walk;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use thiserror::Error;

use walk::Walk;

/// What a night file asks for.
#[derive(Clone, Debug, PartialEq)]
pub struct Night {
    /// Parts in the order of the file, each with a name of its own.
    pub parts: Vec<Part>,
    /// Builds in the order of the file.
    pub builds: Vec<Build>,
    /// The folder of the store.
    pub store: PathBuf,
    /// Where it is named, if it is.
    pub store_place: Option<Place>,
    /// Where results go.
    pub output: NightOutput,
}

/// A part, and what becomes of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The name that builds and results have.
    pub name: String,
    /// The part's file, or a folder that it may be in, from the folder of the night file.
    pub file: PathBuf,
    /// Why no file can be had, if that is known already.
    pub fault: Option<String>,
    /// The stages, the slicing first.
    pub stages: Vec<Stage>,
    /// The `check` command, with its options.
    pub check: Stage,
    /// How many ranges of layers it is cut into, if that is given.
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

/// The form of stacks for people.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NightFormat {
    /// As the store has them.
    Lamp,
    /// Multipage TIFFs.
    Tif,
}

impl NightFormat {
    /// Returns how names end.
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

/// What is wrong with a night file, and where.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{place}: {problem}")]
pub struct NightError {
    /// Where.
    pub place: Place,
    /// What, and what to do.
    pub problem: String,
}

impl Night {
    /// Reads the text of a night file. Names of files are those from its folder.
    ///
    /// # Errors
    /// Returns an error if it is no night file: one sentence, with its place.
    pub fn parse(text: &str, path: &Path) -> Result<Self, NightError> {
        read::night(text, path)
    }

    /// Returns the part of a name.
    pub fn part(&self, name: &str) -> Option<&Part> {
        self.parts.iter().find(|part| part.name == name)
    }
}

/// Returns `: did you mean X?` for the nearest of some words, if one is near.
fn did_you_mean<'a>(word: &str, words: impl IntoIterator<Item = &'a str>) -> String {
    let near = words.into_iter().map(|other| (strsim::jaro_winkler(word, other), other));
    match near.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((likeness, other)) if likeness > 0.75 => format!(": did you mean {other}?"),
        _ => String::new(),
    }
}

/// Returns the first name that stands twice.
fn twice<'a, T>(items: &'a [T], name: impl Fn(&'a T) -> &'a str) -> Option<(&'a T, &'a T)> {
    let mut seen = BTreeMap::new();
    items.iter().find_map(|item| seen.insert(name(item), item).map(|before| (before, item)))
}
