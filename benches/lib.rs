//! Breaks parts, slices them beside the whole ones and scores corrections, for the benches. See
//! `README.md` for figures.

pub mod score;
pub mod sliced;
