//! The pieces that a page is stored in: strips, or tiles.

use std::ops::Range;

/// How a page is cut into pieces, which stand row by row. A strip is as wide
/// as the page.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) tiled: bool,
    /// A piece's width; tiles may stick out on the right.
    pub(super) width: u32,
    /// A piece's rows; the last strip has fewer, and tiles stick out below.
    rows: u32,
    /// How many pieces lie side by side.
    pub(super) across: usize,
    pub(super) page_height: u32,
}

impl Layout {
    pub(super) fn strips(page_width: u32, page_height: u32, rows: u32) -> Self {
        Self { tiled: false, width: page_width, rows, across: 1, page_height }
    }

    pub(super) fn tiles(page_width: u32, page_height: u32, (width, rows): (u32, u32)) -> Self {
        let across = page_width.div_ceil(width) as usize;
        Self { tiled: true, width, rows, across, page_height }
    }

    /// How many pieces the page has.
    pub(super) fn count(&self) -> u64 {
        self.across as u64 * u64::from(self.page_height.div_ceil(self.rows))
    }

    /// More bytes than the pieces take, however they are coded: a pixel never
    /// takes two, and a row has its ends and fill bits. 4 GiB is the end, since
    /// an endless stream must have one.
    pub(super) fn most_bytes(&self) -> u64 {
        let rows = self.count().saturating_mul(self.rows.into());
        rows.saturating_mul(2 * u64::from(self.width) + 16).saturating_add(1 << 16).min(4 << 30)
    }

    /// The rows of the page that each strip, or row of tiles, holds.
    pub(super) fn row_ranges(&self) -> impl Iterator<Item = Range<u32>> {
        let (rows, height) = (self.rows, self.page_height);
        (0..height.div_ceil(rows)).map(move |i| i * rows..height.min((i + 1).saturating_mul(rows)))
    }
}
