//! Why a stack has no section, and why a file names no places.

use lamp_grayscale::resin::CureError;
use lamp_stack::{LengthError, TomlError};
use thiserror::Error;

use super::line::SectionPlane;

/// Why a text does not name a section's plane.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum UnknownPlane {
    /// It names no axis.
    #[error("`{0}` is not a section: write y=12mm or x=12mm")]
    NoAxis(String),
    /// The text after the axis is not a length.
    #[error(transparent)]
    Length(#[from] LengthError),
}

/// Why a stack has no section.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CureSectionError {
    /// Pages do not say where on the part they are.
    #[error("its pages do not state their position on the part")]
    NoPosition,
    /// Pages do not state the size of pixels.
    #[error("its pages do not state their resolution")]
    NoResolution,
    /// The plane misses the images.
    #[error("{plane} is outside its images: {low_mm:.3} to {high_mm:.3} mm")]
    Outside {
        /// The plane.
        plane: SectionPlane,
        /// Where the images begin.
        low_mm: f64,
        /// Where they end.
        high_mm: f64,
    },
    /// The requested stretch holds no pixel's center.
    #[error("no pixel of the section lies in this stretch")]
    EmptyStretch,
    /// A layer does not state its height and thickness.
    #[error("{0} does not state its height and thickness")]
    NoHeight(String),
    /// A layer's thickness or time is impossible.
    #[error("{0} states a thickness or an exposure that is not above zero")]
    NotPositive(String),
    /// A layer's image does not reach the section.
    #[error("{0} is smaller than the first")]
    TooSmall(String),
    /// A layer states no time, and the resin states none either.
    // No source: this message contains the problem's text.
    #[error("{layer} states no exposure: {problem}")]
    NoExposure {
        /// The layer.
        layer: String,
        /// Why white does not cure just the layer.
        problem: CureError,
    },
    /// A place has no section.
    #[error("the place {name}: {problem}")]
    Place {
        /// Its name.
        name: String,
        /// Why not.
        problem: Box<CureSectionError>,
    },
}

/// Why a file names no places.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PlacesError {
    /// The text is not TOML, or a key is unknown, missing or wrong.
    #[error("line {}: {}", .0.line, .0.problem)]
    Toml(TomlError),
    /// Two places have one name.
    #[error("two places have the name {0}")]
    Twice(String),
    /// A place is a point or a plane.
    #[error(
        "the place {0} is neither a line nor a box: give two of x, y and z as lengths for a line along \
         the third, and none for a box"
    )]
    Shape(String),
    /// A stated size cannot be read.
    #[error("the place {name}: {key}: {problem}")]
    Size {
        /// The place's name.
        name: String,
        /// The key: `wanted` or `measured`.
        key: &'static str,
        /// The fault.
        problem: String,
    },
}

impl From<TomlError> for PlacesError {
    fn from(error: TomlError) -> Self {
        Self::Toml(error)
    }
}
