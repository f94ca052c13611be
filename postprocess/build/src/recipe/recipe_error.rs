//! Errors of recipes and of composing by them.

use std::io;

use lamp_stack::StackError;
use thiserror::Error;

use super::super::TileError;

/// Why a text is no recipe, or no pages can be made by it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecipeError {
    /// The text is no JSON, or has other keys.
    #[error("this is not a recipe: {problem}")]
    Json {
        /// The parser's message, with the line and column.
        problem: String,
    },
    /// It has another form.
    #[error("this is not a recipe of the form {known}, but {found:?}")]
    Schema {
        /// The form that it names.
        found: String,
        /// The form that is read.
        known: &'static str,
    },
    /// A value is not as it was written.
    #[error("this recipe has changed since tile wrote it: its digest does not match its values")]
    Changed,
    /// It was written by a version of `tile` that makes other pages.
    #[error(
        "this recipe is for pages by code {found} and here they are made by code {known}: they would not be the same"
    )]
    Code {
        /// The recipe's number.
        found: u32,
        /// The [number](super::TILE_CODE) of this version.
        known: u32,
    },
    /// A value makes no build.
    #[error("{place}: {why}")]
    Value {
        /// The key, as `copies[3].part`.
        place: String,
        /// The problem.
        why: String,
    },
    /// The recipe cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The recipe is larger than recipes are.
    #[error("more than {} MiB is not a recipe", .max >> 20)]
    TooLarge {
        /// The greatest number of bytes.
        max: u64,
    },
    /// A part's file cannot be opened.
    #[error("{file}: {source}")]
    NoPart {
        /// The part's file.
        file: String,
        /// Why.
        source: io::Error,
    },
    /// A part's file is not the one that the recipe was made for.
    #[error(
        "{file} is not the stack that the recipe is for: its digest is {found}, not {expected}"
    )]
    OtherPart {
        /// The part's file.
        file: String,
        /// Its digest.
        found: String,
        /// The digest in the recipe.
        expected: String,
    },
    /// A part's stack cannot be read.
    #[error("{file}: {source}")]
    Part {
        /// The part's file.
        file: String,
        /// Why.
        source: StackError,
    },
    /// The build has no such layer.
    #[error("the build has no layer {layer}: it has layers {first} to {last}")]
    NoLayer {
        /// The layer that was asked for.
        layer: u32,
        /// The first that there is.
        first: u32,
        /// The last.
        last: u32,
    },
    /// Pieces of mesh are not where the recipe has them.
    #[error("loose: layer {layer} has no piece of mesh at row {row}, column {column}")]
    NoPiece {
        /// The layer, as the parts count.
        layer: u32,
        /// The first row of the piece.
        row: u32,
        /// Its first column in that row.
        column: u32,
    },
    /// The parts cannot be laid out so, or their layers not be built.
    #[error(transparent)]
    Tile(#[from] TileError),
}
