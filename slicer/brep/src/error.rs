//! Errors of reading a model and making facets of it.

use crate::step::StepError;

/// Why a B-rep model cannot be sliced.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BrepError {
    /// The file is not what it should be.
    #[error(transparent)]
    Step(#[from] StepError),
    /// The library that a kernel is built on cannot work with the file.
    #[error("{library} says: {message}")]
    Library {
        /// The library's name.
        library: &'static str,
        /// Its own words.
        message: String,
    },
    /// The chord is not a positive length.
    #[error("a chord of {chord_mm} mm is not a positive length")]
    Chord {
        /// In millimetres.
        chord_mm: f64,
    },
    /// A face has no size, or none that can be built.
    #[error("#{entity} is larger than anything that can be built, or has no size")]
    Size {
        /// The entity, or 0.
        entity: u64,
    },
    /// The tolerance to mend with is not a positive length.
    #[error("a tolerance of {heal_mm} mm is not a positive length")]
    Heal {
        /// In millimetres.
        heal_mm: f64,
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
        /// The work that failed.
        doing: &'static str,
        /// The panic's message.
        what: String,
    },
}
