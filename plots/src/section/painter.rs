//! Paints the picture of a section, row by row from the top.

use std::ops::Range;

use lamp_grayscale::{OutlinePiece, SolidHeights};

use crate::picture::PictureScale;

/// Black pixels between two pictures.
const GAP: usize = 8;

const EMPTY: [u8; 3] = [24, 26, 30];
const CURED: [u8; 3] = [200, 204, 208];
const OVERSHOOT: [u8; 3] = [226, 72, 52];
const MISSING: [u8; 3] = [52, 130, 226];
const OUTLINE: [u8; 3] = [255, 205, 60];

/// The contents of the pictures of a section.
pub(super) struct SectionScene<'a> {
    pub(super) pixels: Range<u32>,
    pub(super) heights_um: Range<f64>,
    pub(super) pitch_um: f64,
    pub(super) cured: Vec<&'a [SolidHeights]>,
    pub(super) part: Option<&'a [Vec<OutlinePiece>]>,
}

impl SectionScene<'_> {
    /// Returns the width and height of one picture, at least a pixel.
    pub(super) fn size(&self, scale: PictureScale) -> [usize; 2] {
        let height = (self.heights_um.end - self.heights_um.start) / self.pitch_um;
        [self.pixels.len() as f64, height]
            .map(|pixels| (pixels * factor(scale)).ceil().max(1.0) as usize)
    }

    /// Returns the width of all pictures side by side.
    pub(super) fn whole_width(&self, scale: PictureScale) -> usize {
        (self.size(scale)[0] + GAP) * self.cured.len() - GAP
    }

    /// Returns the rows of the pictures side by side: the material at their pixels' centers.
    pub(super) fn rows(&self, scale: PictureScale) -> impl Iterator<Item = Vec<u8>> {
        let [width, height] = self.size(scale);
        let step_um = self.pitch_um / factor(scale);
        let (top_um, bottom_um) = (self.heights_um.end, self.heights_um.start);
        let z_at = move |row: usize| top_um - (row as f64 + 0.5) * step_um;
        // Places outside the picture make no edge.
        let below_um = move |row: usize| z_at(row + 1).max(bottom_um);
        let place = |column: usize| (column as f64 + 0.5) / factor(scale);
        let pixel = |column: usize| {
            let pixel = self.pixels.start + place(column) as u32;
            // The picture's width is rounded up, and may reach past the last pixel.
            pixel.min(self.pixels.end - 1) as usize
        };
        let part = self.part.map(|part| {
            (0..width).map(|k| Falling::new(part_at(&part[pixel(k)], place(k).fract()))).collect()
        });
        let mut part: Option<Vec<Falling<SolidHeights>>> = part;
        let panel = |cured: &&'_ [SolidHeights]| -> Vec<Falling<SolidHeights>> {
            (0..width).map(|column| Falling::new(cured[pixel(column)].clone())).collect()
        };
        let mut cured: Vec<_> = self.cured.iter().map(panel).collect();
        let holds = |columns: &mut Vec<Falling<SolidHeights>>, z_um: f64| -> Vec<bool> {
            columns.iter_mut().map(|column| column.holds(z_um)).collect()
        };
        let mut next_part = part.as_mut().map(|part| holds(part, z_at(0)));
        (0..height).map(move |row| {
            // Each row is asked once, though an edge needs the row below, too: answers move up by
            // one.
            let here = next_part.take();
            next_part = part.as_mut().map(|part| holds(part, below_um(row)));
            let mut rgb = Vec::with_capacity(3 * (width + GAP) * cured.len());
            for columns in &mut cured {
                if !rgb.is_empty() {
                    rgb.extend([0; 3 * GAP]);
                }
                let is_cured = holds(columns, z_at(row));
                match (&here, &next_part) {
                    (Some(here), Some(below)) => {
                        for (column, &is_cured) in is_cured.iter().enumerate() {
                            let is_part = here[column];
                            // The first column has no neighbor to the left, so it makes no edge by
                            // itself.
                            let left = here[column.saturating_sub(1)];
                            let is_edge = is_part != left || is_part != below[column];
                            rgb.extend(color(is_edge, is_cured, is_part));
                        }
                    }
                    _ => rgb.extend(is_cured.iter().flat_map(
                        |&is_cured| {
                            if is_cured { CURED } else { EMPTY }
                        },
                    )),
                }
            }
            rgb
        })
    }
}

fn color(is_edge: bool, is_cured: bool, is_part: bool) -> [u8; 3] {
    match (is_edge, is_cured, is_part) {
        (true, ..) => OUTLINE,
        (_, true, true) => CURED,
        (_, true, false) => OVERSHOOT,
        (_, false, true) => MISSING,
        (_, false, false) => EMPTY,
    }
}

pub(super) fn factor(scale: PictureScale) -> f64 {
    match scale {
        PictureScale::Up(up) => f64::from(up),
        PictureScale::Down(down) => 1.0 / f64::from(down),
    }
}

/// Returns the heights of the part at a place of a pixel.
fn part_at(pieces: &[OutlinePiece], along: f64) -> SolidHeights {
    let mut heights: SolidHeights = pieces.iter().filter_map(|piece| piece.at(along)).collect();
    // `Falling` needs intervals in rising order.
    heights.sort_by(|a, b| a[0].total_cmp(&b[0]));
    heights
}

/// Heights that are asked from above: each question takes a constant time.
struct Falling<S> {
    solid: S,
    /// The number of intervals that begin at or below the last height.
    left: usize,
}

impl Falling<SolidHeights> {
    fn new(solid: SolidHeights) -> Self {
        let left = solid.len();
        Self { solid, left }
    }

    /// Returns whether a height is within; heights must fall.
    fn holds(&mut self, z_um: f64) -> bool {
        while self.left > 0 && self.solid[self.left - 1][0] > z_um {
            self.left -= 1;
        }
        self.left > 0 && z_um < self.solid[self.left - 1][1]
    }
}
