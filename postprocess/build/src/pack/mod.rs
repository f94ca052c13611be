//! Packs copies: finds places for as many as fit, or as are asked for.
//!
//! Simple strategies come first: a grid, then boxes wherever they fit, then outlines,
//! each before and after parts may be turned, and lattices of one part. A later strategy is
//! taken only if it places more copies. Several parts are then brought closer by a search.

mod greedy;
mod grid;
mod job;
mod lattice;
mod mix;
mod no_fit;
mod options;
#[cfg(test)]
mod pack_tests;
mod packing;
mod shares;

pub use options::{Pack, PackBy, Turns};
pub(super) use packing::pack_turned;

use options::{MAX_COPIES, Way};
