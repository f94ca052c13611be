//! The strips of a folder, as its index lists them.

use std::ops::Range;
use std::path::Path;

use super::index::StripIndex;
use super::{Seam, StripsError};

/// How a build was cut into strips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StripForm {
    /// The width of a strip in pixels.
    pub mirrors: u32,
    /// The number of columns that it shares with the next.
    pub overlap: u32,
    /// How they share them.
    pub seam: Seam,
}

impl StripForm {
    /// Reads how the strips of a folder were cut.
    ///
    /// # Errors
    /// Returns an error if the folder has no index, or a malformed one.
    pub fn of(folder: &Path) -> Result<Self, StripsError> {
        let StripIndex { mirrors, overlap, seam, .. } = StripIndex::read(folder)?;
        Ok(Self { mirrors, overlap, seam })
    }
}

/// A strip that an index lists.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StripFile {
    /// The name of its file in the folder.
    pub name: String,
    /// The columns of the build that it exposes.
    pub columns: Range<u32>,
}

/// Returns the strips of a folder, from the left.
///
/// # Errors
/// Returns an error if the folder has no index, or a malformed one.
pub fn strip_files(folder: &Path) -> Result<Vec<StripFile>, StripsError> {
    let lines = StripIndex::read(folder)?.strips.into_iter();
    Ok(lines
        .map(|line| StripFile { name: line.file, columns: line.columns[0]..line.columns[1] })
        .collect())
}
