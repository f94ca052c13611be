//! Correction of a band from the good rows next to it.
//!
//! Source: 002 section 2.4.1, algorithm 11.

use std::ops::Range;

use lamp_stack::{Mask, white_in_row};

use super::combine::{difference, majority};

/// Gives each pixel the color that the good rows above and below the band share, and leaves it
/// where they differ. Rows outside the image are black. Returns the rows and the confidence in
/// them, which is lower the more the good rows differ.
pub(super) fn nearest(mask: &Mask, band: &Range<u32>) -> (Vec<Vec<u32>>, f64) {
    let row_or_black = |row: Option<u32>| {
        row.filter(|&row| row < mask.height()).map_or(&[][..], |row| mask.row(row))
    };
    let (above, below) = (row_or_black(band.start.checked_sub(1)), row_or_black(Some(band.end)));
    let rows: Vec<_> = band.clone().map(|row| majority([above, mask.row(row), below])).collect();
    let pixels = |a: &[u32], b: &[u32]| white_in_row(&difference(a, b), mask.width()) as f64;
    // Where the good rows differ, nobody knows the color: these pixels are the doubt.
    let undecided = pixels(above, below);
    let changed = band.clone().zip(&rows).map(|(row, new)| pixels(mask.row(row), new));
    // Without undecided pixels the row is certain. If nothing changes either, the share would be
    // 0/0.
    let confidence =
        changed.map(|changed| if undecided == 0.0 { 1.0 } else { changed / (changed + undecided) });
    let least = confidence.fold(1.0, f64::min);
    (rows, least)
}
