//! Dithers by Bayer's pattern.
//!
//! Source: B. E. Bayer, An optimum method for two-level rendition of
//! continuous-tone pictures, 1973.

use std::sync::LazyLock;

use crate::screen::Screen;

/// The bits of a column or row of the pattern.
const BITS: u32 = 4;
/// The side of the pattern. Its 256 thresholds distinguish 8-bit levels.
const SIDE: u32 = 1 << BITS;

/// Bayer's pattern as thresholds.
pub(crate) static SCREEN: LazyLock<Screen> = LazyLock::new(|| {
    let places = (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| [column, row]));
    Screen::new(SIDE as usize, places.map(bayer_rank))
});

/// Returns a pixel's rank in Bayer's order of filling. The lowest bits of its column and
/// row become the highest bits of the rank.
fn bayer_rank([column, row]: [u32; 2]) -> usize {
    let bits = (0..BITS).map(|bit| (column >> bit & 1, row >> bit & 1));
    bits.fold(0, |rank, (c, r)| rank << 2 | ((c ^ r) << 1 | r) as usize)
}

/// Returns the column and row at which a layer's pattern starts: the place whose rank is
/// the layer's index with its 8 bits reversed (van der Corput's sequence). In each
/// aligned group of 4, 16, 64 or 256 layers, a pixel's thresholds then fall once into
/// each quarter, sixteenth and so on.
pub(crate) fn shift(layer: u32) -> [u32; 2] {
    let bits = (0..BITS).map(|bit| (bit, layer >> (2 * bit) & 1, layer >> (2 * bit + 1) & 1));
    bits.fold([0, 0], |[column, row], (bit, c_xor_r, r)| {
        [column | (c_xor_r ^ r) << bit, row | r << bit]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pattern_begins_as_bayers_does() {
        // Bayer's 2 x 2 pattern, 0 2 / 3 1, in steps of 64 of 256.
        let corner = [[0, 2], [3, 1]].map(|row| row.map(|rank: usize| rank * 64));
        for (r, row) in (0..).zip(corner) {
            for (c, rank) in (0..).zip(row) {
                assert_eq!(bayer_rank([c, r]), rank);
            }
        }
    }

    #[test]
    fn layers_start_at_all_places_in_the_order_of_reversed_ranks() {
        for layer in 0..600 {
            let reversed = (layer as u8).reverse_bits();
            assert_eq!(bayer_rank(shift(layer)), usize::from(reversed), "{layer}");
        }
    }
}
