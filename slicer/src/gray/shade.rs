//! Shades a layer's rows by the depth of the part below its section.

use lamp_stack::{DepthLevels, GrayMask, Image, Length, LevelChange, MaskBuilder};

use crate::cut::RowCrossing;
use crate::gray::DepthSpan;
use crate::planes::Planes;
use crate::table::Fill;

/// Makes a layer's rows gray, from the top.
pub(crate) struct Shader<'a> {
    levels: &'a DepthLevels,
    fill: Fill,
    /// The depth of the layer's plane below its top.
    plane_depth_um: f64,
    /// The spans of the rows to come, by row.
    spans: &'a [DepthSpan],
    /// The spans over a column, in the order of their starts.
    open: Vec<&'a DepthSpan>,
    met: Vec<(f64, &'a DepthSpan)>,
    changes: Vec<LevelChange>,
    image: GrayMask,
}

impl<'a> Shader<'a> {
    /// Starts a layer, given the sorted spans below its section.
    pub(crate) fn new(
        levels: &'a DepthLevels,
        fill: Fill,
        planes: &Planes,
        layer: usize,
        spans: &'a [DepthSpan],
        width: u32,
    ) -> Self {
        Self {
            levels,
            fill,
            plane_depth_um: planes.top_um(layer) - planes.z_um(layer),
            spans,
            open: Vec::new(),
            met: Vec::new(),
            changes: Vec::new(),
            image: GrayMask::new(width),
        }
    }

    /// Adds the next row, given its sorted crossings with the section's contours.
    pub(crate) fn push_row(&mut self, row: u32, places: &[RowCrossing]) {
        let count = self.spans.iter().take_while(|span| span.row <= row).count();
        let (mut spans, rest) = self.spans.split_at(count);
        self.spans = rest;
        self.changes.clear();
        self.open.clear();
        let mut winding = 0;
        for (k, place) in places.iter().enumerate() {
            winding += place.winding();
            let end = places.get(k + 1).map_or(self.image.width(), |next| next.column());
            if place.column() < end {
                self.shade(place.column(), end, winding, &mut spans);
            }
        }
        self.image.push_row(&self.changes).expect("changes come from the left");
    }

    /// Adds columns between two crossings of the row.
    fn shade(&mut self, start: u32, end: u32, winding: i32, spans: &mut &'a [DepthSpan]) {
        if !self.fill.is_inside(winding) {
            return self.push(start, 0);
        }
        let mut column = start;
        while column < end {
            let begun = spans.partition_point(|span| span.start <= column);
            self.open.extend(&spans[..begun]);
            *spans = &spans[begun..];
            self.open.retain(|span| span.end > column);
            let ends = self.open.iter().map(|span| span.end);
            let next = ends.chain(spans.first().map(|span| span.start)).fold(end, u32::min);
            self.shade_evenly(column, next, winding);
            column = next;
        }
    }

    /// Adds columns over the same facets.
    fn shade_evenly(&mut self, start: u32, end: u32, winding: i32) {
        if self.open.is_empty() {
            return self.push(start, 255);
        }
        let end = if self.open.iter().all(|span| span.is_level()) { start + 1 } else { end };
        for column in start..end {
            let exit = self.exit_um(column, winding).map(Length::from_um);
            let level = exit.map_or(255, |depth| self.levels.level(depth));
            self.push(column, level);
        }
    }

    /// Returns the depth at which the line down from a white pixel first leaves the part.
    fn exit_um(&mut self, column: u32, winding: i32) -> Option<f64> {
        self.met.clear();
        self.met.extend(self.open.iter().map(|&span| (span.depth_um(column), span)));
        self.met.sort_by(|a, b| a.partial_cmp(b).expect("depths are numbers"));
        let touching =
            |a: &(f64, &DepthSpan), b: &(f64, &DepthSpan)| b.0 - a.0 <= a.1.tie_um() + b.1.tie_um();
        let mut left = winding;
        for group in self.met.chunk_by(touching) {
            let (depth, first) = group[0];
            let lost = group.iter().map(|(_, span)| span.winding()).sum::<i32>();
            let below = depth > self.plane_depth_um + first.tie_um();
            // The section accounts for facets within rounding of the plane that lead
            // into the part.
            if !below && lost * winding.signum() <= 0 {
                continue;
            }
            left -= lost;
            let leaves = match self.fill {
                Fill::EvenOdd => lost % 2 != 0,
                Fill::NonZero => left == 0,
            };
            if leaves {
                return Some(if below { depth } else { 0.0 });
            }
        }
        None
    }

    fn push(&mut self, column: u32, level: u8) {
        let here = self.changes.last().map_or(0, |change| change.level);
        if level != here {
            self.changes.push(LevelChange { column, level });
        }
    }

    /// Returns the image: 1-bit if no pixel is gray.
    pub(crate) fn finish(self) -> Image {
        let image = self.image;
        if image.rows().flatten().any(|change| change.level % 255 != 0) {
            return Image::Gray(image);
        }
        let mut mask = MaskBuilder::new(image.width());
        for row in image.rows() {
            let transitions: Vec<u32> = row.iter().map(|change| change.column).collect();
            mask.push_row(&transitions).expect("levels change at increasing columns");
        }
        Image::Mask(mask.finish())
    }
}
