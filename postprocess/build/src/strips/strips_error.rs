//! Errors of strips.

use lamp_stack::StackError;
use thiserror::Error;

use super::index::IndexError;
use super::read::StripDifference;
use super::{JoinSwathsError, SwathsError};

/// An error in writing strips, or in making a build of them.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StripsError {
    /// There are no such swaths.
    #[error(transparent)]
    Swaths(#[from] SwathsError),
    /// A swath is wider than any image.
    #[error("a swath of {mirrors} mirrors is wider than any image: at most {max} are read again")]
    Mirrors {
        /// The width of a swath in pixels.
        mirrors: u32,
        /// The width of the widest image.
        max: u32,
    },
    /// There are more strips than files may be open at once.
    #[error(
        "a build {width} pixels wide would be {strips} strips of {mirrors} mirrors, and at most {max} are written"
    )]
    TooMany {
        /// The width of the build in pixels.
        width: u32,
        /// The number of strips.
        strips: u32,
        /// The width of a strip in pixels.
        mirrors: u32,
        /// The greatest number of strips.
        max: u32,
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
    /// A page says that it is a strip.
    #[error("{layer} is a strip already")]
    Already {
        /// The layer's name.
        layer: String,
    },
    /// The index is malformed.
    #[error("{index}: this is not an index of strips", index = super::INDEX)]
    Index(#[source] IndexError),
    /// A file has the name of a strip, and is of another build.
    #[error("{file} is not a strip of this build: {index} does not list it", index = super::INDEX)]
    More {
        /// The file's name.
        file: String,
    },
    /// A strip cannot be read.
    #[error("{file}")]
    In {
        /// The file's name.
        file: String,
        /// The error.
        source: StackError,
    },
    /// A file is not the strip that the index lists.
    #[error("{file} is not that strip of the build: {difference}")]
    Unlike {
        /// The file's name.
        file: String,
        /// The difference.
        difference: StripDifference,
    },
    /// The strips do not make a layer.
    #[error("{layer}")]
    Join {
        /// The layer's name.
        layer: String,
        /// The error.
        source: JoinSwathsError,
    },
    /// The strips of a 1-bit layer add up to gray.
    #[error("{layer} was black and white, and its strips add up to gray: they were changed")]
    Gray {
        /// The layer's name.
        layer: String,
    },
    /// Reading or writing failed.
    #[error(transparent)]
    Stack(#[from] StackError),
}
