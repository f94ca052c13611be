//! Tests of layer heights as other crates use them: one program, linked once.

mod closed_forms;
mod search;
mod told;
mod twin;
