//! Defines the errors of reading and tessellating a model.

use crate::step::StepError;

/// The reason why a B-rep model cannot be sliced.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BrepError {
    /// The STEP file is invalid or not supported.
    #[error(transparent)]
    Step(#[from] StepError),
    /// A kernel's library failed on the file.
    #[error("{library} says: {message}")]
    Library {
        /// The library's name.
        library: &'static str,
        /// The library's message.
        message: String,
    },
    /// The last line of an IGES file is missing.
    #[error("it is cut off: its last line does not end an IGES file, with T in column 73")]
    IgesEnd,
    /// The chord is not a positive length.
    #[error("a chord of {chord_mm} mm is not a positive length")]
    Chord {
        /// In millimeters.
        chord_mm: f64,
    },
    /// A face has no size, or is too large to be built.
    #[error("#{entity} is too large to build, or has no size")]
    Size {
        /// The entity's number, or 0 if unknown.
        entity: u64,
    },
    /// The healing tolerance is not a positive length.
    #[error("a tolerance of {heal_mm} mm is not a positive length")]
    Heal {
        /// In millimeters.
        heal_mm: f64,
    },
    /// The surfaces bend too much for facets within the chord.
    #[error(
        "its faces would be divided into about {cells:.0} cells, {of_face:.0} of them for \
         #{entity} alone: these are too many; give a longer chord"
    )]
    Fine {
        /// The number of cells.
        cells: f64,
        /// The entity of the face with the most of them.
        entity: u64,
        /// The number of its cells.
        of_face: f64,
    },
    /// There would be too many facets.
    #[error("it takes more than {most} facets; give a longer chord")]
    TooMany {
        /// The greatest number of facets.
        most: usize,
    },
    /// The kernel panicked: an error of the program, not of the file.
    #[error("{doing} failed within the program: {what}")]
    Panicked {
        /// The work that failed.
        doing: &'static str,
        /// The panic's message.
        what: String,
    },
}
