//! The images below islands.

use std::collections::VecDeque;
use std::ops::Range;

use lamp_stack::{Frame, Length, Mask, Pitch, white_runs};

use super::SupportError;
use crate::check::{Findings, Metric, Region};

/// How the pixels of a stack lie in the part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Raster {
    pub(super) origin_mm: [f64; 2],
    pub(super) pitch: Pitch,
    pub(super) size: [u32; 2],
}

impl Raster {
    /// Returns how the pixels of a checked stack lie.
    pub(super) fn of(found: &Findings) -> Result<Self, SupportError> {
        Ok(Self {
            origin_mm: found.origin_mm.ok_or(SupportError::NoOrigin)?,
            pitch: found.pitch.ok_or(SupportError::NoResolution)?,
            size: found.size,
        })
    }

    /// Returns the x and y of a column and row; the first pixel's center is at (0.5, 0.5).
    pub(super) fn place_mm(&self, [column, row]: [f64; 2]) -> [f64; 2] {
        let [across, down] = self.pitch.mm();
        let [x0, y1] = self.origin_mm;
        [x0 + column * across, y1 - row * down]
    }

    /// Returns the pixel at x and y, as column and row, if the images have one there.
    pub(super) fn pixel_at(&self, [x, y]: [f64; 2]) -> Option<[u32; 2]> {
        let [across, down] = self.pitch.mm();
        let [x0, y1] = self.origin_mm;
        let at = [(x - x0) / across, (y1 - y) / down];
        let is_within = (0..2).all(|k| (0.0..f64::from(self.size[k])).contains(&at[k]));
        is_within.then_some(at.map(|place| place as u32))
    }

    /// Returns the shape of pixels. Lengths in images are in widths of a pixel.
    pub(super) fn metric(&self) -> Metric {
        Metric::of(Some(self.pitch))
    }

    /// Returns the width of a pixel.
    pub(super) fn width_mm(&self) -> f64 {
        let [width, _] = self.pitch.mm();
        width
    }

    /// Returns a length in widths of a pixel, not rounded.
    pub(super) fn widths(&self, length: Length) -> f64 {
        length.pixels(self.pitch.x)
    }

    /// Returns a length in columns and in rows, at least one of each.
    pub(super) fn pixels(&self, length: Length) -> [u32; 2] {
        self.pitch.pixels(length).map(|pixels| pixels.ceil().max(1.0) as u32)
    }
}

/// The images below islands, cropped to what supports may reach.
#[derive(Debug, Default)]
pub(super) struct SupportWindow {
    /// The number of the first layer that is kept.
    first: u32,
    kept: VecDeque<Cropped>,
}

#[derive(Debug)]
struct Cropped {
    region: Region,
    mask: Mask,
    /// The white that stands, unless all does.
    standing: Option<Mask>,
}

impl Cropped {
    fn standing(&self) -> &Mask {
        self.standing.as_ref().unwrap_or(&self.mask)
    }
}

impl SupportWindow {
    /// Adds the next layer and what of it stands, unless all does; or nothing of it.
    pub(super) fn push(&mut self, mask: &Mask, standing: Option<&Mask>, region: Option<&Region>) {
        let nothing = Region { columns: 0..0, rows: 0..0 };
        // Even an empty layer takes its place, for layers are found by their number.
        let region = region.cloned().unwrap_or(nothing);
        let frame = Frame {
            left: region.columns.start.into(),
            top: region.rows.start.into(),
            width: region.columns.len() as u32,
            height: region.rows.len() as u32,
        };
        let (mask, standing) = (mask.framed(frame), standing.map(|mask| mask.framed(frame)));
        self.kept.push_back(Cropped { region, mask, standing });
    }

    /// Forgets the layers below one.
    pub(super) fn forget_below(&mut self, layer: u32) {
        while self.first < layer && self.kept.pop_front().is_some() {
            self.first += 1;
        }
    }

    /// Returns the white runs of a layer within a run of a row. Pixels not kept are black.
    pub(super) fn white_in(
        &self,
        layer: u32,
        row: u32,
        run: &Range<u32>,
    ) -> impl Iterator<Item = Range<u32>> + use<'_> {
        self.runs_in(layer, row, run.clone(), |cropped| &cropped.mask)
    }

    /// Returns the white runs of a layer that stand, within a run of a row.
    pub(super) fn standing_in(
        &self,
        layer: u32,
        row: u32,
        run: &Range<u32>,
    ) -> impl Iterator<Item = Range<u32>> + use<'_> {
        self.runs_in(layer, row, run.clone(), Cropped::standing)
    }

    fn runs_in<'a>(
        &'a self,
        layer: u32,
        row: u32,
        run: Range<u32>,
        image: impl Fn(&'a Cropped) -> &'a Mask,
    ) -> impl Iterator<Item = Range<u32>> {
        let cropped = layer.checked_sub(self.first).and_then(|k| self.kept.get(k as usize));
        let cropped = cropped.filter(|cropped| cropped.region.rows.contains(&row));
        let clipped = cropped.into_iter().flat_map(move |cropped| {
            let (region, mask) = (&cropped.region, image(cropped));
            let (run, left) = (run.clone(), region.columns.start);
            let runs = white_runs(mask.row(row - region.rows.start), mask.width());
            runs.map(move |(start, end)| run.start.max(left + start)..run.end.min(left + end))
        });
        clipped.filter(|run| !run.is_empty())
    }
}
