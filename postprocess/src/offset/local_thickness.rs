//! The local thickness of a shape.
//!
//! A place has the size `s` of the largest square, at any angle, that it lies in: it is at most
//! `s / sqrt(2)` away from the centre of a disc of diameter `s` inside the shape. So a wall has
//! the same thickness at any angle, to a pixel, and a square has its own up to its corners, as
//! 002 measured squares (section 3.4.3). Where a wall joins a block, the block's size reaches a
//! fifth of it into the wall.

use lamp_stack::Mask;

use super::erode::{Disc, SourceColour, Sources, at_least, more_than};
use super::row_runs::{RowRuns, subtract};

/// Splits a mask by the sizes of its places: first those smaller than the first of `sizes` (in
/// pixels, increasing), then those from each size up to the next.
pub(super) fn by_size(mask: &Mask, sizes: &[f64]) -> Vec<RowRuns> {
    let height = mask.height();
    let from_black = Sources::new(mask, SourceColour::Black);
    let mut left = RowRuns::white(mask);
    // The centres of larger discs are among those of smaller ones.
    let mut centres: Vec<RowRuns> = Vec::new();
    for size in sizes {
        let disc = Disc::below(at_least(size / 2.0), height);
        let smaller = centres.last().unwrap_or(&left);
        centres.push(from_black.erode_all(&disc, smaller));
    }
    let mut parts = Vec::new();
    for (size, centres) in sizes.iter().zip(&centres).rev() {
        let mut part = RowRuns::new();
        if centres.all().is_empty() {
            (0..height).for_each(|_| part.push(&[]));
        } else {
            let from_centres = Sources::new(&centres.mask(mask.width()), SourceColour::White);
            let reach = Disc::below(more_than(size / 2f64.sqrt()), height);
            let smaller = from_centres.erode_all(&reach, &left);
            let mut runs = Vec::new();
            for row in 0..height {
                subtract(left.row(row), smaller.row(row), &mut runs);
                part.push(&runs);
            }
            left = smaller;
        }
        parts.push(part);
    }
    parts.push(left);
    parts.reverse();
    parts
}
