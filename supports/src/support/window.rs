//! The images around an island and below it.

use std::ops::Range;

use lamp_stack::{Dpi, Frame, Length, Mask, Strut, white_runs};

/// How the pixels of a stack lie in the part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Raster {
    pub(super) origin_mm: [f64; 2],
    pub(super) dpi: Dpi,
    pub(super) size: [u32; 2],
}

impl Raster {
    /// Returns the x and y of a column and row; the first pixel's centre is at (0.5, 0.5).
    pub(super) fn place_mm(&self, [column, row]: [f64; 2]) -> [f64; 2] {
        let pitch = self.dpi.pitch().mm();
        let [x0, y1] = self.origin_mm;
        [x0 + column * pitch, y1 - row * pitch]
    }

    /// Returns a length in pixels, at least one.
    pub(super) fn pixels(&self, length: Length) -> u32 {
        length.pixels(self.dpi).ceil().max(1.0) as u32
    }

    /// Returns the section of a strut, a run a row.
    pub(super) fn section(&self, strut: &Strut, height: Length) -> Vec<(u32, Range<u32>)> {
        let runs = strut.section(height, self.origin_mm, self.dpi, self.size);
        runs.map(|(row, start, end)| (row, start..end)).collect()
    }
}

/// Layers below an island, cropped.
#[derive(Clone, Debug)]
pub(super) struct Window {
    columns: Range<u32>,
    rows: Range<u32>,
    /// The number of the first layer.
    pub(super) first: u32,
    masks: Vec<Mask>,
}

impl Window {
    pub(super) fn new(columns: Range<u32>, rows: Range<u32>, first: u32) -> Self {
        Self { columns, rows, first, masks: Vec::new() }
    }

    /// Adds the next layer.
    pub(super) fn push(&mut self, mask: &Mask) {
        self.masks.push(mask.framed(Frame {
            left: self.columns.start.into(),
            top: self.rows.start.into(),
            width: self.columns.len() as u32,
            height: self.rows.len() as u32,
        }));
    }

    /// Returns the number of the next layer to add.
    pub(super) fn end(&self) -> u32 {
        self.first + self.masks.len() as u32
    }

    /// Returns the white runs of a layer within a run of a row. What is not in the window is
    /// black.
    pub(super) fn white_in(
        &self,
        layer: u32,
        row: u32,
        run: &Range<u32>,
    ) -> impl Iterator<Item = Range<u32>> + use<'_> {
        let (run, left) = (run.clone(), self.columns.start);
        let mask = layer.checked_sub(self.first).and_then(|k| self.masks.get(k as usize));
        let runs = mask
            .filter(|_| self.rows.contains(&row))
            .map(|mask| white_runs(mask.row(row - self.rows.start), mask.width()));
        let clipped = runs
            .into_iter()
            .flatten()
            .map(move |(start, end)| run.start.max(left + start)..run.end.min(left + end));
        clipped.filter(|run| !run.is_empty())
    }
}
