//! Why nothing can be printed or measured.

use lamp_stack::Length;
use thiserror::Error;

use crate::column::NoHeights;
use crate::learn::{LearnError, PlaceError};
use crate::light::LightError;
use crate::projector::NoFieldLight;
use crate::resin_light::NoLight;
use crate::speed::PartError;

/// Why a text is not a truth.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum TruthError {
    /// The text is not TOML.
    #[error("line {line}: {problem}: a truth is a TOML file")]
    Syntax {
        /// The line, from 1.
        line: usize,
        /// The parser's message.
        problem: String,
    },
    /// A key is unknown, or its value is wrong.
    #[error("line {line}: {problem}")]
    Key {
        /// The line, from 1.
        line: usize,
        /// The parser's message, or the message of the value's type.
        problem: String,
    },
}

/// Why a job's print cannot be simulated.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PrintSimError {
    /// The true material has no light for doses.
    #[error(transparent)]
    NoLight(#[from] NoLight),
    /// A number of the truth is impossible.
    // No source: the message contains its text.
    #[error("the truth is impossible: {0}")]
    Truth(LightError),
    /// The model of the job does not have a number of the truth.
    #[error("the truth has `{0}`, which is not of this job's model: leave it out")]
    OtherModel(&'static str),
    /// Two pictures of one light.
    #[error(
        "the truth has `flat-field` and `layer-picture`: a picture of a layer shows the flat field, so \
         state one of them"
    )]
    TwoFields,
    /// A spread besides the picture of spread light.
    #[error(
        "the truth has `spread` and `layer-picture`: the picture shows the spread, so leave it out"
    )]
    SpreadTwice,
    /// A picture of one layer for layers that differ.
    #[error(
        "the layers' images differ, so no picture of one layer has the light of all: state a \
         `flat-field` instead"
    )]
    LayersDiffer,
    /// A picture without light.
    #[error(transparent)]
    NoFieldLight(#[from] NoFieldLight),
    /// Images too large for a light of each pixel.
    #[error(
        "images of {columns} x {rows} pixels are too large for a picture of their light: 67 million \
         pixels are the most"
    )]
    LargeField {
        /// Pixels of a row.
        columns: u32,
        /// Rows.
        rows: u32,
    },
    /// The model of a plan on a glass cannot be computed.
    #[error(transparent)]
    Model(#[from] LearnError),
    /// The model cannot expose the part.
    #[error(transparent)]
    Part(#[from] PartError),
    /// The material does not state how deep a dose cures.
    #[error(transparent)]
    Curve(#[from] NoHeights),
    /// The stack's pages do not state their position on the part.
    #[error(
        "the stack's pages do not state their position on the part: begin a job with a stack whose \
         pages do, as slice makes them"
    )]
    NoPosition,
    /// No face of the part looks down on resin.
    #[error(
        "no face of the part looks down on resin, so there are no heights to measure: count wrong \
         pixels instead"
    )]
    NoFace,
    /// Light cures nothing at any measured place.
    #[error(
        "nothing is cured at the {places} places, so there are no heights to measure: count wrong \
         pixels instead"
    )]
    Uncured {
        /// The number of places.
        places: usize,
    },
    /// A place has no size.
    // No source: this message contains the problem's text.
    #[error("the place {name}: {problem}")]
    Place {
        /// Its name.
        name: String,
        /// Why not.
        problem: PlaceError,
    },
    /// There are no places.
    #[error("there are no places to measure")]
    NoPlaces,
    /// A standard deviation of heights is not above zero.
    #[error("a standard deviation of {} um is not above zero", .0.um())]
    Deviation(Length),
}
