//! Reasons that no supports can be planned.

use thiserror::Error;

use super::plan::MOST_SUPPORTS;

/// A reason that no supports can be planned for a stack.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SupportError {
    /// The pages do not say how large pixels are.
    #[error("the stack has no resolution, so it cannot be compared with the part")]
    NoResolution,
    /// The pages do not say where the images lie in the part.
    #[error("the stack does not state where its images are in the part")]
    NoOrigin,
    /// A page does not say the layer's height and thickness.
    #[error("layer {index} does not state its height and thickness")]
    NoHeight {
        /// The layer's index.
        index: u32,
    },
    /// There are more islands, or pieces of them, than a person can look at.
    #[error("the islands need more than {MOST_SUPPORTS} supports")]
    TooMany,
    /// The layers differ from the checked ones.
    #[error("the stack has fewer layers than when it was checked")]
    MissingLayers,
}
