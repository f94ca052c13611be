//! Notes on what a part's file holds and slicing does not use.

use std::fmt;

/// Something that a part's file holds and slicing does not use. As text it is one sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReadNote {
    /// Items of a 3MF file that are no solids: supports, surfaces and others.
    NoSolids {
        /// The number of items.
        items: usize,
    },
}

impl fmt::Display for ReadNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSolids { items: 1 } => write!(f, "1 item is left out: it is no solid"),
            Self::NoSolids { items } => {
                write!(f, "{items} items are left out: they are no solids")
            }
        }
    }
}
