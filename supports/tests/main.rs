//! Tests of checks as other crates use them: one program, linked once.

mod check;
