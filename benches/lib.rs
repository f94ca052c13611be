//! What the benches share: breaking a part and slicing it beside the whole one,
//! and scoring what a correction makes of that. See `README.md` for figures.

pub mod score;
pub mod sliced;
