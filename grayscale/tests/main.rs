//! Tests of gray levels, dots and materials as other crates use them: one program, linked once.

mod dots;
mod material;
mod overshoot;
mod print_through;
mod round_trip;
mod solid;
