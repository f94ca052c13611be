//! Computes the layout of a page's strips or tiles.

use std::ops::Range;

use crate::error::PageFault;
use crate::limits::Limits;

/// The division of a page into strips or tiles, in row order. A strip has the page's width.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PageLayout {
    pub(super) tiled: bool,
    /// A piece's width; tiles may extend beyond the page's right side.
    pub(super) width: u32,
    /// A piece's rows; the last strip may have fewer, and tiles may extend below the page.
    rows: u32,
    /// The number of pieces side by side.
    pub(super) across: usize,
    pub(super) page_height: u32,
}

impl PageLayout {
    pub(super) fn strips(page_width: u32, page_height: u32, rows: u32) -> Self {
        Self { tiled: false, width: page_width, rows, across: 1, page_height }
    }

    pub(super) fn tiles(page_width: u32, page_height: u32, (width, rows): (u32, u32)) -> Self {
        let across = page_width.div_ceil(width) as usize;
        Self { tiled: true, width, rows, across, page_height }
    }

    /// Returns the number of pieces.
    pub(super) fn count(&self) -> u64 {
        self.across as u64 * u64::from(self.page_height.div_ceil(self.rows))
    }

    /// Returns the number of bytes of piece `i` without compression.
    pub(super) fn plain_bytes(&self, i: usize, gray: bool) -> u64 {
        let row = if gray { self.width } else { self.width.div_ceil(8) };
        let top = (i / self.across) as u64 * u64::from(self.rows);
        // Tiles are stored whole, with padding beyond the page (TIFF 6.0, section 15).
        let rows = match self.tiled {
            true => self.rows.into(),
            false => u64::from(self.rows).min(u64::from(self.page_height).saturating_sub(top)),
        };
        rows * u64::from(row)
    }

    /// Refuses pieces without data if their rows would cost much memory or time.
    pub(super) fn check_unwritten(&self, pieces: usize, limits: &Limits) -> Result<(), PageFault> {
        let rows = pieces as u64 * u64::from(self.rows.min(self.page_height));
        let is_high = self.page_height > limits.rows_from_columns;
        if pieces > 0 && (is_high || rows > limits.side.into()) {
            return Err(PageFault::Unwritten(rows));
        }
        Ok(())
    }

    /// Returns an upper bound of the pieces' bytes in any coding: less than two per pixel, and
    /// line ends and fill bits per row. At most 4 GiB, so that reading an endless stream ends.
    pub(super) fn most_bytes(&self) -> u64 {
        let rows = self.count().saturating_mul(self.rows.into());
        rows.saturating_mul(2 * u64::from(self.width) + 16).saturating_add(1 << 16).min(4 << 30)
    }

    /// Returns the page's rows in each strip or row of tiles.
    pub(super) fn row_ranges(&self) -> impl Iterator<Item = Range<u32>> {
        let (rows, height) = (self.rows, self.page_height);
        // The end of the last strip may pass 32 bits before it is cut to the page.
        (0..height.div_ceil(rows)).map(move |i| i * rows..height.min((i + 1).saturating_mul(rows)))
    }
}
