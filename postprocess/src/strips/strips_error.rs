//! What can be wrong with a build's strips.

use lamp_stack::StackError;
use thiserror::Error;

use super::{JoinSwathsError, SwathsError};

/// Why strips cannot be written, or put back together.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StripsError {
    /// Such swaths cannot be.
    #[error(transparent)]
    Swaths(#[from] SwathsError),
    /// No image is so wide.
    #[error("a swath of {mirrors} mirrors is wider than any image: at most {most} are read again")]
    Mirrors {
        /// How wide a swath would be.
        mirrors: u32,
        /// The widest image.
        most: u32,
    },
    /// More files than may be open at once.
    #[error(
        "a build {width} pixels wide would be {strips} strips of {mirrors} mirrors, and at most {most} are written: give more mirrors"
    )]
    TooMany {
        /// How wide the build is.
        width: u32,
        /// How many strips there would be.
        strips: u32,
        /// How wide they would be.
        mirrors: u32,
        /// The most strips.
        most: u32,
    },
    /// A layer has another size than the first.
    #[error("{layer} has {size} pixels, and the first layer {first}: a build has one size")]
    Size {
        /// The layer's name.
        layer: String,
        /// Its width and height, as `640 x 480`.
        size: String,
        /// Those of the first.
        first: String,
    },
    /// A page says that it is a strip.
    #[error("{layer} is a strip already: lamp join makes the build of its folder again")]
    Already {
        /// The layer's name.
        layer: String,
    },
    /// The index is none.
    #[error("{index}: this is no index of strips: {problem}", index = super::INDEX)]
    Index {
        /// What is wrong with it.
        problem: String,
    },
    /// A strip cannot be read.
    #[error("{file}")]
    In {
        /// The file's name.
        file: String,
        /// What is wrong with it.
        source: StackError,
    },
    /// A strip is not the one of the build that the index says.
    #[error("{file} is not that strip of the build: {difference}")]
    Unlike {
        /// The file's name.
        file: String,
        /// In what it differs.
        difference: String,
    },
    /// The strips make no layer.
    #[error("{layer}")]
    Join {
        /// The layer's name.
        layer: String,
        /// Why.
        source: JoinSwathsError,
    },
    /// A layer of a 1-bit page has grays.
    #[error("{layer} was black and white, and its strips add up to gray: they were changed")]
    Gray {
        /// The layer's name.
        layer: String,
    },
    /// Reading or writing failed.
    #[error(transparent)]
    Stack(#[from] StackError),
}
