//! Why something is not a target.

use std::io;

use lamp_slicing::SliceError;
use lamp_stack::{CatalogueError, Length};
use png::ColorType;
use thiserror::Error;

use super::map::Place;
use super::{Grid, ShapesError};

/// Why a target cannot be read, or its heights cannot be computed. Each error names the place.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TargetError {
    /// Shapes that cannot be read.
    #[error(transparent)]
    Shapes(#[from] CatalogueError<ShapesError>),
    /// A part that cannot be read.
    #[error(transparent)]
    Part(#[from] SliceError),
    /// A picture that cannot be read.
    #[error("it is not a complete PNG")]
    Png(#[from] png::DecodingError),
    /// A file that cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A text too long for shapes.
    #[error("more than 1 MiB is not a target file")]
    LargeFile,
    /// A picture too large for a target.
    #[error("a height map of {width} x {height} pixels is too large: 67 million are the most")]
    LargePicture {
        /// Pixels of a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A picture whose pixels are not heights.
    #[error(
        "a picture with gray pixels of 16 or 8 bits is needed: this has {colour:?} ones of {bits} bits"
    )]
    NotGray {
        /// Bits of each color.
        bits: u8,
        /// The color type.
        colour: ColorType,
    },
    /// A picture whose pixels have no scale yet.
    #[error("a PNG height map does not state how wide a pixel is and how high white is")]
    NoScale,
    /// Pixels or heights that no target has.
    #[error(
        "the width of a height map's pixels and the height of its white must be above zero and at \
         most 1 m: {pixel}, {full}"
    )]
    Scale {
        /// The side of a pixel.
        pixel: Length,
        /// The height of full white.
        full: Length,
    },
    /// No column has a height.
    #[error(
        "there is nothing to cure: no middle of {} x {} columns of {}um is in it",
        grid.columns, grid.rows, grid.pitch_um
    )]
    Empty {
        /// Where the columns are.
        grid: Grid,
    },
    /// A column does not begin on the glass.
    #[error(
        "{place} begins {from} above the part's lowest point: the bottom must be flat, because \
         light through the glass cures from there up"
    )]
    NotOnGlass {
        /// The column.
        place: Place,
        /// The height where it begins.
        from: Length,
    },
    /// A column has a gap.
    #[error(
        "{place} is empty from {from} to {to}: light cures a column without gaps, so no overhang or hole can be cured"
    )]
    Overhang {
        /// The column.
        place: Place,
        /// The height where the gap begins.
        from: Length,
        /// The height where it ends.
        to: Length,
    },
    /// A column enters the part more often than it leaves it.
    #[error(
        "{place} meets the surface only once at a height: the mesh is open or turned over there"
    )]
    Open {
        /// The column.
        place: Place,
    },
    /// Too many facets above each other.
    #[error("columns meet more than {most} facets each: too many for a target")]
    Crowded {
        /// The largest allowed average.
        most: usize,
    },
    /// A column higher than the resin.
    #[error("{place} is {height} high, and the chamber {chamber}")]
    AboveChamber {
        /// The highest column.
        place: Place,
        /// Its height.
        height: Length,
        /// The chamber's height.
        chamber: Length,
    },
    /// A target wider than the light.
    #[error("the target is {} x {} wide, and the projector lights {} x {}", size[0], size[1], light[0], light[1])]
    Wide {
        /// The target's width and height.
        size: [Length; 2],
        /// The width and height that the projector lights.
        light: [Length; 2],
    },
    /// Shapes that are not round about the axis.
    #[error("it is not round about the axis: {why}")]
    NotRoundShape {
        /// The shape that is not.
        why: String,
    },
    /// A map that is not round about the axis.
    #[error(
        "it is not round about the axis: {place} is {height:.1}um high, its ring {mean:.1}um on average"
    )]
    NotRound {
        /// The first column that differs.
        place: Place,
        /// Its height, in micrometers.
        height: f64,
        /// The mean height of all columns at the same distance from the axis, in micrometers.
        mean: f64,
    },
}
