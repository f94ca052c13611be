//! Errors of strips and fields.

use lamp_stack::StackError;
use thiserror::Error;

use super::index::{IndexError, MAX_FIELD_SIDE, MAX_FIELDS};
use super::read::FieldDifference;
use super::{FieldKind, JoinSwathsError, SwathsError};

/// An error in writing strips or fields, or in making a build of them.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FieldsError {
    /// There are no such swaths.
    #[error(transparent)]
    Swaths(#[from] SwathsError),
    /// Fields share half of a side or more, so a pixel would be in three of a row.
    #[error(
        "fields of {} x {} pixels cannot share {overlap} of them: they share less than half of \
         either side", .size[0], .size[1]
    )]
    Overlap {
        /// The width and height of a field in pixels.
        size: [u32; 2],
        /// The columns, and the rows, that it shares with the next.
        overlap: u32,
    },
    /// A swath is wider than any image.
    #[error("a swath of {mirrors} mirrors is wider than any image: at most {max} are read again")]
    Mirrors {
        /// The width of a swath in pixels.
        mirrors: u32,
        /// The width of the widest image.
        max: u32,
    },
    /// A field has more pixels than any display.
    #[error(
        "a field of {} x {} pixels is larger than any display: at most {MAX_FIELD_SIDE} on a side",
        .size[0], .size[1]
    )]
    LargeField {
        /// The width and height of a field in pixels.
        size: [u32; 2],
    },
    /// There are more strips than files may be open at once.
    #[error(
        "a build {width} pixels wide would be {strips} strips of {mirrors} mirrors, and at most \
         {MAX_FIELDS} are written"
    )]
    TooManyStrips {
        /// The width of the build in pixels.
        width: u32,
        /// The number of strips.
        strips: u32,
        /// The width of a strip in pixels.
        mirrors: u32,
    },
    /// There are more fields than files may be open at once.
    #[error(
        "a build of {} x {} pixels would be {} x {} fields of {} x {}, and at most {MAX_FIELDS} \
         are written",
        .build[0], .build[1], .grid[0], .grid[1], .size[0], .size[1]
    )]
    TooManyFields {
        /// The width and height of the build in pixels.
        build: [u32; 2],
        /// The number of columns and of rows of fields.
        grid: [u32; 2],
        /// The width and height of a field in pixels.
        size: [u32; 2],
    },
    /// A layer has another size than the first.
    #[error(
        "{layer} has {} x {} pixels, and the first layer {} x {}: a build has one size",
        .size[0], .size[1], .first[0], .first[1]
    )]
    Size {
        /// The layer's name.
        layer: String,
        /// Its width and height in pixels.
        size: [u32; 2],
        /// The width and height of the first.
        first: [u32; 2],
    },
    /// A page says that it is a strip or a field.
    #[error("{layer} is a {kind} already")]
    Already {
        /// The layer's name.
        layer: String,
        /// The kind of field.
        kind: FieldKind,
    },
    /// The index is malformed.
    #[error("{index}: this is not an index of {kind}s", index = .kind.index())]
    Index {
        /// The kind of field that it should list.
        kind: FieldKind,
        /// The fault.
        source: IndexError,
    },
    /// A file has the name of a strip or a field, and is of another build.
    #[error("{file} is not a {kind} of this build: {index} does not list it", index = .kind.index())]
    More {
        /// The file's name.
        file: String,
        /// The kind of field.
        kind: FieldKind,
    },
    /// A strip or a field cannot be read.
    #[error("{file}")]
    In {
        /// The file's name.
        file: String,
        /// The error.
        source: StackError,
    },
    /// A file is not the strip or the field that the index lists.
    #[error("{file} is not that {kind} of the build: {difference}")]
    Unlike {
        /// The file's name.
        file: String,
        /// The kind of field.
        kind: FieldKind,
        /// The difference.
        difference: FieldDifference,
    },
    /// The strips or fields do not make a layer.
    #[error("{layer}")]
    Join {
        /// The layer's name.
        layer: String,
        /// The error.
        source: JoinSwathsError,
    },
    /// The strips or fields of a 1-bit layer add up to gray.
    #[error("{layer} was black and white, and its {kind}s add up to gray: they were changed")]
    Gray {
        /// The layer's name.
        layer: String,
        /// The kind of field.
        kind: FieldKind,
    },
    /// Reading or writing failed.
    #[error(transparent)]
    Stack(#[from] StackError),
}
