//! Tests of planners as other crates use them: one program, linked once.

mod appendix_a;
mod column_cure;
mod column_learn;
mod parts_of_001;
mod referee;
mod ring_learn;
mod rows_of_003;
mod tables_of_000;
mod wide_parts;
