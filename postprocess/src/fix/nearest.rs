//! A band's rows from the good rows beside it.

use std::ops::Range;

use lamp_stack::{Mask, white_in_row};

use super::combine::{difference, majority};

/// Each pixel takes the colour that the good rows above and below the band
/// share, and keeps its own where they differ. Rows outside the image are
/// black. Says, too, how sure that is: less the more the good rows differ.
///
/// Source: 002 section 2.4.1, algorithm 11.
pub(super) fn nearest(mask: &Mask, band: &Range<u32>) -> (Vec<Vec<u32>>, f64) {
    let row_or_black = |row: Option<u32>| match row {
        Some(row) if row < mask.height() => mask.row(row),
        _ => &[],
    };
    let (above, below) = (row_or_black(band.start.checked_sub(1)), row_or_black(Some(band.end)));
    let rows: Vec<_> = band.clone().map(|row| majority([above, mask.row(row), below])).collect();
    let pixels = |a: &[u32], b: &[u32]| white_in_row(&difference(a, b), mask.width()) as f64;
    let unsure = pixels(above, below);
    let changed = band.clone().zip(&rows).map(|(row, new)| pixels(mask.row(row), new));
    let sure =
        changed.map(|changed| if unsure == 0.0 { 1.0 } else { changed / (changed + unsure) });
    let confidence = sure.fold(1.0, f64::min);
    (rows, confidence)
}
