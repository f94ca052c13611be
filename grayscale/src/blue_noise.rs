//! Blue noise: dots as far from each other as their number allows, in no
//! order that the eye or the resin could follow.
//!
//! Source: R. A. Ulichney, The void-and-cluster method for dither array
//! generation, 1993; `void_and_cluster.rs` has what is added to it.

use std::sync::LazyLock;

use crate::screen::Screen;

/// The mask's side in pixels.
pub(crate) const SIDE: usize = 128;

/// By how many columns and rows the mask moves from one layer to the next. It
/// was made for this step: points that are a few steps apart avoid each other,
/// so that the dots of a few layers fill each other's holes. It is back after
/// 128 layers. The step is one of those whose multiples keep farthest from each
/// other: the first 8 by 33 pixels, the first 16 by 22.
pub(crate) const STEP: [u32; 2] = [73, 97];

/// The order in which the mask's places become white, row by row, as 16-bit
/// little-endian numbers.
pub(crate) static RANKS: &[u8] = include_bytes!("../masks/blue_noise.ranks");

/// The mask.
pub(crate) static SCREEN: LazyLock<Screen> = LazyLock::new(|| {
    let (ranks, _) = RANKS.as_chunks::<2>();
    Screen::new(SIDE, ranks.iter().map(|&rank| u16::from_le_bytes(rank).into()))
});

/// Where a layer's mask starts.
pub(crate) fn shift(layer: u32) -> [u32; 2] {
    STEP.map(|step| layer.wrapping_mul(step) % SIDE as u32)
}
