//! Why nothing can be printed or measured.

use lamp_stack::Length;
use thiserror::Error;

use crate::column::NoHeights;
use crate::learn::LearnError;
use crate::light::LightError;
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
    #[error("the truth has `{0}`, which is not a number of this job's model: leave it out")]
    OtherModel(&'static str),
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
    /// A standard deviation of heights is not above zero.
    #[error("a standard deviation of {} um is not above zero", .0.um())]
    Deviation(Length),
}
