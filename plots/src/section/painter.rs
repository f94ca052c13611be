//! Paints the picture of a section, row by row from the top.

use std::ops::Range;

use lamp_grayscale::{OutlinePiece, SolidHeights};

use crate::picture::PictureScale;

pub(super) const EMPTY: [u8; 3] = [24, 26, 30];
pub(super) const CURED: [u8; 3] = [200, 204, 208];
pub(super) const OVERSHOOT: [u8; 3] = [226, 72, 52];
pub(super) const MISSING: [u8; 3] = [52, 130, 226];
pub(super) const OUTLINE: [u8; 3] = [255, 205, 60];

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
            let mut rgb = Vec::with_capacity(3 * width * cured.len());
            for columns in &mut cured {
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

/// Columns of pixels from the picture's left, and the heights between which they have one color.
pub(super) type ColoredRun = (Range<u32>, [f64; 2]);

impl SectionScene<'_> {
    /// Returns the colored areas of a picture, color by color. Neighbors with equal heights are one.
    pub(super) fn shapes(&self, number: usize) -> Vec<([u8; 3], Vec<ColoredRun>)> {
        let inks = [CURED, OVERSHOOT, MISSING];
        let mut shapes = inks.map(|ink| (ink, Vec::<ColoredRun>::new()));
        let mut last: Vec<([u8; 3], [f64; 2])> = Vec::new();
        let mut since = 0;
        let mut close = |runs: &[([u8; 3], [f64; 2])], columns: Range<u32>| {
            for &(ink, heights) in runs {
                let shape = shapes.iter_mut().find(|(of, _)| *of == ink).expect("it is an ink");
                shape.1.push((columns.clone(), heights));
            }
        };
        for (column, pixel) in (0..).zip(self.pixels.clone()) {
            let runs = self.colored(number, pixel as usize);
            if runs != last {
                close(&last, since..column);
                (last, since) = (runs, column);
            }
        }
        close(&last, since..self.pixels.len() as u32);
        shapes.into()
    }

    /// Returns the colors over the height at the center of a pixel.
    fn colored(&self, number: usize, pixel: usize) -> Vec<([u8; 3], [f64; 2])> {
        let cured = &self.cured[number][pixel];
        let part = self.part.map(|part| part_at(&part[pixel], 0.5)).unwrap_or_default();
        let Range { start, end } = self.heights_um;
        let mut ends: Vec<f64> = cured.iter().chain(&part).flatten().copied().collect();
        ends.iter_mut().for_each(|um| *um = um.clamp(start, end));
        ends.sort_by(f64::total_cmp);
        ends.dedup();
        let mut runs: Vec<([u8; 3], [f64; 2])> = Vec::new();
        for heights in ends.windows(2).map(|pair| [pair[0], pair[1]]) {
            let middle = f64::midpoint(heights[0], heights[1]);
            let holds =
                |solid: &[[f64; 2]]| solid.iter().any(|it| it[0] <= middle && middle < it[1]);
            let is_cured = holds(cured);
            let is_part = if self.part.is_some() { holds(&part) } else { is_cured };
            let ink = color(false, is_cured, is_part);
            match runs.last_mut() {
                Some((below, [_, end])) if *below == ink && *end == heights[0] => *end = heights[1],
                _ if ink != EMPTY => runs.push((ink, heights)),
                _ => {}
            }
        }
        runs
    }

    /// Returns the part's outline: lines between places, in pixels from the picture's left, and
    /// heights.
    pub(super) fn edges(&self) -> Vec<[(f64, f64); 2]> {
        let Range { start, end } = self.heights_um;
        let (mut edges, mut walls) = (Vec::new(), Vec::new());
        for (column, pixel) in (0..).zip(self.pixels.clone()) {
            for piece in self.part.map_or(&[][..], |part| &part[pixel as usize]) {
                let places = piece.along.map(|along| f64::from(column) + along);
                let ends = [0, 1].map(|k| {
                    let heights = [piece.from_um[k], piece.to_um[k]];
                    (places[k], heights.map(|um| um.clamp(start, end)))
                });
                walls.extend(ends);
                for um in [piece.from_um, piece.to_um] {
                    edges.push([(places[0], um[0]), (places[1], um[1])]);
                }
            }
        }
        edges.retain(|line| line.iter().all(|(_, um)| (start..=end).contains(um)));
        // Where a piece ends and no other goes on at that height, the part has a wall.
        walls.sort_by(|a, b| a.0.total_cmp(&b.0));
        for ends in walls.chunk_by(|a, b| a.0 == b.0) {
            let mut heights: Vec<f64> = ends.iter().flat_map(|(_, heights)| *heights).collect();
            heights.sort_by(f64::total_cmp);
            for pair in heights.windows(2).filter(|pair| pair[0] < pair[1]) {
                let middle = f64::midpoint(pair[0], pair[1]);
                let count = ends.iter().filter(|(_, it)| it[0] < middle && middle < it[1]).count();
                if count % 2 == 1 {
                    edges.push([(ends[0].0, pair[0]), (ends[0].0, pair[1])]);
                }
            }
        }
        edges
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
