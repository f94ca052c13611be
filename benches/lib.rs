//! Benchmarks only: see `benches/layers.rs`, and `README.md` for figures.
