//! The blue-noise mask: dots as far apart as their number allows, in no regular order.
//!
//! Source: R. A. Ulichney, The void-and-cluster method for dither array
//! generation, 1993; `void_and_cluster.rs` says what is added to it.

use std::sync::LazyLock;

use crate::screen::Screen;

/// The mask's side in pixels.
pub(crate) const SIDE: usize = 128;

/// The columns and rows by which the mask moves from one layer to the next. The mask
/// was made for this step: points a few steps apart avoid each other, so the dots of
/// successive layers fill each other's holes. It returns after 128 layers. The
/// multiples of this step stay far apart: the first 8 by 33 pixels, the first 16 by 22.
pub(crate) const STEP: [u32; 2] = [73, 97];

/// The order in which the mask's places become white, row by row, as 16-bit
/// little-endian numbers.
pub(crate) static RANKS: &[u8] = include_bytes!("../masks/blue_noise.ranks");

/// The mask as thresholds.
pub(crate) static SCREEN: LazyLock<Screen> = LazyLock::new(|| {
    let (ranks, _) = RANKS.as_chunks::<2>();
    Screen::new(SIDE, ranks.iter().map(|&rank| u16::from_le_bytes(rank).into()))
});

/// Returns the column and row of the mask at which a layer starts.
pub(crate) fn shift(layer: u32) -> [u32; 2] {
    STEP.map(|step| layer.wrapping_mul(step) % SIDE as u32)
}
