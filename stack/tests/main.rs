//! Tests of stacks as other crates use them: one program, linked once.

mod checks;
mod foreign;
mod format;
mod pictures;
mod png;
