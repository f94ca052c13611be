//! Why a stack has no section.

use lamp_grayscale::resin::CureError;
use lamp_stack::LengthError;
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
}
