//! A picture in memory.

use std::io::{self, Write};
use std::ops::Range;

use lamp_stack::write_rgb_png;

use crate::caption::{CAPTION_HEIGHT, caption};

pub(super) type Color = [u8; 3];
/// The level behind panels and texts.
pub(super) const BACKGROUND: u8 = 28;

/// Rows of colors.
pub(super) struct Raster {
    pub(super) width: u32,
    pub(super) height: u32,
    colors: Vec<Color>,
}

impl Raster {
    pub(super) fn new([width, height]: [u32; 2], color: Color) -> Self {
        Self { width, height, colors: vec![color; width as usize * height as usize] }
    }

    /// Makes a picture of rows of red, green and blue.
    pub(super) fn of_rows([width, height]: [u32; 2], rows: impl Iterator<Item = Vec<u8>>) -> Self {
        let colors = rows.flat_map(|row| row.as_chunks::<3>().0.to_vec()).collect();
        Self { width, height, colors }
    }

    /// Paints a rectangle, cut off at the edges of the picture.
    pub(super) fn fill(&mut self, columns: Range<u32>, rows: Range<u32>, color: Color) {
        let columns = columns.start as usize..columns.end.min(self.width) as usize;
        for row in rows.start..rows.end.min(self.height) {
            let start = row as usize * self.width as usize;
            if columns.start < columns.end {
                self.colors[start + columns.start..start + columns.end].fill(color);
            }
        }
    }

    /// Draws a rectangle's border, two pixels wide.
    pub(super) fn frame(&mut self, columns: Range<u32>, rows: Range<u32>, color: Color) {
        let [left, right, top, bottom] = [columns.start, columns.end, rows.start, rows.end];
        self.fill(left..right, top..top + 2, color);
        self.fill(left..right, bottom.saturating_sub(2)..bottom, color);
        self.fill(left..left + 2, top..bottom, color);
        self.fill(right.saturating_sub(2)..right, top..bottom, color);
    }

    /// Puts a picture at a place.
    pub(super) fn put(&mut self, other: &Self, [left, top]: [u32; 2]) {
        for row in 0..other.height {
            for column in 0..other.width {
                let color = other.colors[(row * other.width + column) as usize];
                self.fill(left + column..left + column + 1, top + row..top + row + 1, color);
            }
        }
    }

    pub(super) fn write_png(&self, out: impl Write) -> io::Result<()> {
        let rows = self.colors.chunks(self.width.max(1) as usize).map(<[Color]>::concat);
        write_rgb_png(out, self.width, self.height, rows)
    }
}

/// Returns a line of text.
pub(super) fn text(words: &str) -> io::Result<Raster> {
    let rows = caption(words, BACKGROUND).map_err(io::Error::other)?;
    let width = rows.first().map_or(0, Vec::len) as u32;
    let rows = rows.into_iter().map(|row| row.into_iter().flat_map(|level| [level; 3]).collect());
    Ok(Raster::of_rows([width, CAPTION_HEIGHT], rows))
}
