//! The options of commands, as the settings of libraries.

pub(crate) mod exposure;
pub(crate) mod heights;
pub(crate) mod slicing;
pub(crate) mod solid;
pub(crate) mod stages;
