//! The process and its terminal: help, progress, notes, hints, early ends.

pub(crate) mod allocator;
pub(crate) mod help;
pub(crate) mod hints;
pub(crate) mod licences;
#[cfg(feature = "occt")]
pub(crate) mod occt_process;
pub(crate) mod out_of_memory;
pub(crate) mod progress;
pub(crate) mod signals;
pub(crate) mod stack_notes;
pub(crate) mod terminal_picture;
pub(crate) mod usage;
