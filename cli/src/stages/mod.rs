//! Stages as they stand on a command line, and what follows on the stages of parts, for nights.

pub(crate) mod after;
pub(crate) mod calls;
#[cfg(test)]
mod goldens;
pub(crate) mod parse;
#[cfg(test)]
mod tests;
