//! Defines the faults of contour files and layouts.

use thiserror::Error;

/// A fault in a contour file or a layout.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ContourFault {
    /// The file ends too early.
    #[error("is the last one: the file was cut off")]
    CutOff,
    /// The file ends before its header does.
    #[error("is the last one: the file was cut off within its header")]
    CutHeader,
    /// Something else stands where a word or number should be.
    #[error("is not {0}")]
    Malformed(&'static str),
    /// A coordinate is infinite, not a number or beyond 32 bits.
    #[error("has a coordinate that is not a finite number, or too large for 32 bits")]
    NotFinite,
    /// A polygon is not closed.
    #[error("has a polygon whose last corner is not its first: export closed polygons")]
    Open,
    /// Lines do not close.
    #[error("has {0} lines that form no closed polygon: export closed polylines")]
    OpenLines(usize),
    /// There is no polygon, and this was left out.
    #[error("has no polygon to slice{0}")]
    NoArea(String),
    /// A name stands for two things.
    #[error("defines {0} twice: export it again with one cell of each name")]
    Twice(String),
    /// Arrays make too many copies.
    #[error("makes more copies of {0} than can be read: arrays are too large")]
    TooManyCopies(String),
    /// A polygon comes before the first layer.
    #[error("has a polygon before the first layer")]
    NoLayer,
    /// Contents come before a definition that they need.
    #[error("is before {0}")]
    Early(&'static str),
    /// A command that would change the picture, and is not read.
    #[error("has the command {0}, which is not read")]
    Command(String),
    /// Polarity changes too often.
    #[error("has dark and clear areas on each other more than {0} times: export them merged")]
    TooManyCoats(u32),
    /// Layers do not rise.
    #[error("has a layer that is not above the layer before it")]
    Falling,
    /// There are too many corners.
    #[error("makes more than {0} corners: arrays or curves are too large")]
    TooManyCorners(usize),
    /// Too many polygons cross themselves.
    #[error("is one of more than {0} polygons that cross themselves: clean them first")]
    Crossed(usize),
    /// References nest without end, or too deep.
    #[error("refers to {0}, which contains itself or nests too deep")]
    Endless(String),
    /// A reference to something that is not there.
    #[error("refers to {0}, which is not in the file")]
    Missing(String),
    /// Contents that would change the picture, and are not read.
    #[error("has {0}, which is not read")]
    Unread(&'static str),
}
