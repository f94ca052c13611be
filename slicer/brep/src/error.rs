//! Why a model was refused.

use crate::step::StepError;

/// Why a B-rep model cannot be sliced.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BrepError {
    /// The file is not what it should be.
    #[error(transparent)]
    Step(#[from] StepError),
    /// The file cannot be read.
    #[error("cannot read it")]
    Io(#[from] std::io::Error),
    /// The chord is not a positive length.
    #[error("a chord of {chord_mm} mm is not a positive length")]
    Chord {
        /// In millimetres.
        chord_mm: f64,
    },
    /// There would be more facets than can be numbered.
    #[error("it takes more than {most} facets; give a longer chord")]
    TooMany {
        /// The most that are made.
        most: usize,
    },
    /// A panic: an error of the program, not of the file.
    #[error("{doing} failed within the program: {what}")]
    Panicked {
        /// What was done.
        doing: &'static str,
        /// The panic's message.
        what: String,
    },
}
