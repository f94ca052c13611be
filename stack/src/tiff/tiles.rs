//! Tiles side by side to rows of a page, on runs.

use crate::gray::{GrayMask, gray_runs};
use crate::mask::{Mask, MaskBuilder};

/// Adds the rows of tiles of equal size, cut to the page's width.
pub(super) fn join_masks(tiles: &[Mask], width: u32, page: &mut MaskBuilder) {
    let mut row = Vec::new();
    for index in 0..tiles[0].height() {
        row.clear();
        let mut left = 0;
        for tile in tiles {
            // A tile starts black: behind one that ends white, it toggles.
            let starts = (row.len() % 2 == 1).then_some(left);
            for column in starts.into_iter().chain(tile.row(index).iter().map(|c| left + c)) {
                if row.last() == Some(&column) {
                    row.pop();
                } else {
                    row.push(column);
                }
            }
            left += tile.width();
        }
        row.truncate(row.partition_point(|&column| column < width));
        page.push_checked(&row);
    }
}

/// Adds the rows of gray tiles of equal size, cut to the page's width.
pub(super) fn join_grays(tiles: &[GrayMask], width: u32, page: &mut GrayMask) {
    let mut rows: Vec<_> = tiles.iter().map(GrayMask::rows).collect();
    for _ in 0..tiles[0].height() {
        let mut runs = Vec::new();
        let mut left = 0;
        let mut end = 0;
        for (tile, rows) in tiles.iter().zip(&mut rows) {
            let changes = rows.next().expect("tiles of a row are equally high");
            for (start, stop, level) in gray_runs(changes, tile.width()) {
                let (start, stop) = ((left + start).min(width), (left + stop).min(width));
                runs.extend([(start - end, 0), (stop - start, level)]);
                end = stop;
            }
            left += tile.width();
        }
        page.push_runs(runs).expect("runs are cut to the width");
    }
}
