//! Packed stacks: the pages of a stack with their images coded against the layer below.
//!
//! Source: 002 §6.2 (a). `docs/pack.md` has the format byte by byte.
//!
//! ```text
//! signature | key frame | frame | ... | key frame | ... | index
//! ```
//!
//! A frame holds the lines of up to 64 layers and then their images. Its first image is coded
//! against the last of the frame before, except in a key frame, whose first image stands alone.

mod blocks;
mod encode;
mod frame;
mod image;
mod join;
mod levels;
mod numbers;
mod predict;
mod read;
mod rows;
mod streams;
mod tokens;
mod write;

#[cfg(test)]
mod packed_tests;

pub use join::{copy_packed, join_packed};
pub(crate) use read::Unpacker;
pub use write::{PackLevel, write_packed};

/// Layers whose index is a multiple of this start a key frame, and a frame has at most as many.
pub const KEY_LAYERS: u32 = 64;
/// The most changes and rows of a frame's images together, unless it has a single image: the amount
/// that a reader decodes at once.
const FRAME_COST: u64 = 4 << 20;
/// A frame with more bytes than this, before they are packed, takes no other layer.
const FRAME_BYTES: usize = 1 << 20;
/// The most rows of an image: rows like others take memory without any bytes behind them.
const MOST_ROWS: u32 = 1 << 22;

/// The first bytes of a packed stack, the last of them its version. As in PNG's, a byte that is no
/// text and both ends of lines show what a transfer as text does to it.
pub(crate) const SIGNATURE: [u8; 8] = [0x93, b'L', b'A', b'M', b'P', b'\r', b'\n', 1];
