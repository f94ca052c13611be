//! Joins adjacent tiles to the rows of a page, on their runs.

use crate::image::frame::place_row;
use crate::image::runs::{Change, RunImage};

/// Adds the rows of adjacent tiles of equal size to a page, cut to its width.
pub(super) fn join_tiles<C: Change>(tiles: &[RunImage<C>], page: &mut RunImage<C>) {
    let mut row = Vec::new();
    for index in 0..tiles[0].height() {
        row.clear();
        let mut left = 0;
        for tile in tiles {
            place_row(tile.row(index), tile.width(), left, page.width(), &mut row);
            left += i64::from(tile.width());
        }
        page.push(&row);
    }
}
