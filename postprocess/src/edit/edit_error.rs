//! Why a stack cannot be edited.

use thiserror::Error;

/// Why a stack cannot be edited.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum EditError {
    /// The list of edits is no TOML.
    #[error("line {line}: {problem}: edits are a TOML file with [[edit]] tables")]
    Syntax {
        /// From 1.
        line: usize,
        /// What stands there.
        problem: String,
    },
    /// A key of the list is wrong, unknown or missing.
    #[error("line {line}: {key}: {problem}")]
    Key {
        /// From 1.
        line: usize,
        /// The edit's number and the key's path, as `edit 2, box.x`.
        key: String,
        /// What is wrong.
        problem: String,
    },
    /// There is nothing to do.
    #[error("there is no edit: add an [[edit]] table")]
    NoEdits,
    /// An edit contradicts itself, or the stack.
    #[error("edit {number}: {problem}")]
    Edit {
        /// From 1.
        number: usize,
        /// What is wrong, and what would be right.
        problem: String,
    },
    /// The pages do not say how large pixels are, so lengths mean nothing.
    #[error("the stack has no resolution, so lengths have no meaning in it")]
    NoResolution,
    /// A layer is not like the first.
    #[error("{layer} has another size, place or resolution than the first layer: a stack has one")]
    Unlike {
        /// The layer's name.
        layer: String,
    },
    /// A layer cannot be edited.
    #[error("{layer}: {problem}")]
    Layer {
        /// The layer's name.
        layer: String,
        /// What is wrong, and what would be right.
        problem: String,
    },
}

impl EditError {
    pub(super) fn edit(number: usize, problem: impl Into<String>) -> Self {
        Self::Edit { number, problem: problem.into() }
    }

    pub(super) fn layer(layer: &lamp_stack::PageInfo, problem: impl Into<String>) -> Self {
        Self::Layer { layer: layer.name(), problem: problem.into() }
    }
}
