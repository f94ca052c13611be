//! Defines the error for a STEP file that cannot be read.

use crate::notice::Matter;

/// The reason why a STEP file cannot be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// It does not begin with the signature of STEP files.
    #[error("it is not a STEP file: it does not begin with ISO-10303-21")]
    NotStep,
    /// It ends before its end mark.
    #[error("it is cut off: END-ISO-10303-21 is missing")]
    CutOff,
    /// A part of the text is not valid syntax.
    #[error("the text makes no sense at byte {offset}")]
    Unreadable {
        /// The offset of the byte, from 0.
        offset: usize,
    },
    /// An entity is defined twice.
    #[error("#{id} is defined twice")]
    Twice {
        /// The entity's number.
        id: u64,
    },
    /// An entity is referenced but not defined.
    #[error("#{id} is referenced, but not defined")]
    Missing {
        /// The entity's number.
        id: u64,
    },
    /// An entity's type is not the required type.
    #[error("#{id} is not {expected}")]
    Unexpected {
        /// The entity's number.
        id: u64,
        /// The required type.
        expected: &'static str,
    },
    /// An attribute is missing or has the wrong type.
    #[error("attribute {attribute} of #{id} is missing or has the wrong type")]
    Attribute {
        /// The entity's number.
        id: u64,
        /// The attribute's number, from 1.
        attribute: usize,
    },
    /// The numbers describe no valid shape: a negative radius, for example.
    #[error("the numbers of #{id} give no {what}")]
    Numbers {
        /// The entity's number.
        id: u64,
        /// The shape they should describe.
        what: &'static str,
    },
    /// An entity type is not supported.
    #[error("#{id} is a {name}, which is not supported")]
    Unsupported {
        /// The entity's number.
        id: u64,
        /// Its type.
        name: String,
    },
    /// A shape has no length unit.
    #[error("the shape #{id} has no length unit")]
    NoUnit {
        /// The number of the representation.
        id: u64,
    },
    /// There is no solid and no face.
    #[error("it holds neither a solid nor a face")]
    Empty,
    /// There are only other contents.
    #[error("it holds nothing that can be sliced: #{id} is {matter}")]
    Other {
        /// The first such entity's number.
        id: u64,
        /// The kind of these contents.
        matter: Matter,
    },
    /// There is only a mesh of finite elements.
    #[error("it holds nothing that can be sliced: #{id} is a finite element")]
    Elements {
        /// The first element's number.
        id: u64,
    },
    /// Bodies share curves or surfaces that are too large.
    #[error("its bodies have more than {most} points, edges and faces in all")]
    TooMuch {
        /// The greatest number.
        most: usize,
    },
    /// An assembly contains itself, or has too many parts.
    #[error("its assembly holds itself, or more than {most} parts")]
    Endless {
        /// The greatest number of parts.
        most: usize,
    },
}
