//! The edge map of an image: runs deep inside, and the distance and level of every pixel near an
//! edge.

use lamp_stack::GrayMask;

use super::aligned_rows::AlignedRows;
use super::closest::{Measured, measure};
use super::erode::{Disc, Erosion, SourceColour, Sources, at_least, more_than};
use super::outline::Outline;
use super::row_runs::{RowRuns, Run, first_past, subtract};

/// Edges, and by how many pixels they move away from the sources.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edges<'a> {
    /// The outlines of white.
    pub(super) outlines: &'a [Outline],
    /// The distance at each corner of each outline; the same for all if `None`.
    pub(super) by: Option<&'a [Vec<f64>]>,
    /// The least and the greatest distance, not below zero.
    pub(super) range: [f64; 2],
}

/// The nearest place of an edge, as seen from a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    /// The distance of the pixel's middle in pixels, below zero beyond the edge.
    pub(super) distance: f32,
    /// The distance that the edge moves there.
    pub(super) by: f32,
    /// How slanted the edge is: the smaller side of its normal of length one.
    pub(super) slant: f32,
}

/// Depths are counted in such parts of a pixel.
pub(super) const SIXTEENTHS: u32 = 16;
/// The greatest depth in pixels.
const MAX_DEPTH: f32 = 256.0;

/// The most by which the distance from the nearest source, middle to middle, differs from the
/// distance from the edge between.
const STAIR: f64 = 2.0;

/// A run of a row of an [`EdgeMap`].
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeRun {
    pub(super) columns: Run,
    /// The index of its first pixel in the map's arrays; `None` for a run deep inside.
    pub(super) first: Option<u32>,
}

/// A pixel near an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgePixel {
    pub(super) column: i32,
    pub(super) row: u32,
    /// The index in the map's arrays.
    pub(super) index: u32,
}

/// The runs of an image, with the distances and levels of the pixels near its edges.
#[derive(Debug, Default)]
pub(super) struct EdgeMap {
    ends: Vec<usize>,
    runs: Vec<EdgeRun>,
    /// The nearest edge of each pixel near one.
    near: Vec<Near>,
    /// The level of each of these pixels after the edge has moved.
    pub(super) levels: Vec<u8>,
}

impl EdgeMap {
    /// Moves the edges of a region, in which no pixel is a source. Pixels at least `depth` further
    /// inside are deep inside. If `all`, the map has all pixels of level zero, too.
    pub(super) fn new(
        sources: &Sources,
        region: &RowRuns,
        width: u32,
        edges: Edges<'_>,
        depth: f64,
        all: bool,
    ) -> Self {
        let [least, most] = edges.range;
        let outer = if all { 0 } else { more_than(least - STAIR) };
        let reach = most + f64::max(depth, STAIR);
        let discs = [outer, at_least(reach)].map(|square| Disc::below(square, region.height()));
        let mut map = Self::runs(sources, region, width, &discs);
        let is_right = sources.colour() == SourceColour::Black;
        let by = |of: usize, corner: usize| edges.by.map_or(most, |by| by[of][corner]);
        measure(&mut map, edges.outlines, by, Measured { is_right, reach: reach + STAIR });
        map.levels = map.near.iter().map(Near::level).collect();
        map
    }

    /// Finds the pixels outside of the first disc around each source, and of these as runs deep
    /// inside those outside of the second.
    fn runs(sources: &Sources, region: &RowRuns, width: u32, discs: &[Disc; 2]) -> Self {
        let mut map = Self { ends: vec![0], ..Self::default() };
        let [mut outer, mut inner] = [Erosion::default(), Erosion::default()];
        let mut along = AlignedRows::new(sources, [&discs[0], &discs[1]], width);
        let (mut aligned, mut runs) = (Vec::new(), Vec::new());
        for row in 0..region.height() {
            if along.row(row, &mut aligned) {
                for &[outer, inner] in &aligned {
                    map.push_near((outer.0, inner.0));
                    map.runs.push(EdgeRun { columns: inner, first: None });
                    map.push_near((inner.1, outer.1));
                }
            } else {
                let first = map.runs.len();
                sources.erode(&discs[0], row, region.row(row), &mut outer);
                sources.erode(&discs[1], row, &outer.runs, &mut inner);
                let deep = inner.runs.iter().map(|&run| EdgeRun { columns: run, first: None });
                map.runs.extend(deep);
                subtract(&outer.runs, &inner.runs, &mut runs);
                runs.iter().for_each(|&run| map.push_near(run));
                map.runs[first..].sort_unstable_by_key(|run| run.columns);
            }
            map.ends.push(map.runs.len());
        }
        map
    }

    /// Adds a run near an edge, unless it is empty.
    fn push_near(&mut self, run: Run) {
        if run.0 < run.1 {
            let first = u32::try_from(self.near.len()).expect("an image has fewer pixels at edges");
            self.runs.push(EdgeRun { columns: run, first: Some(first) });
            self.near.resize(self.near.len() + (run.1 - run.0) as usize, Near::FAR);
        }
    }

    /// Calls `look` with each pixel near an edge in some columns of a row, from the first up to,
    /// but without, the second. `place` is the place of a run near there, as in the row before.
    pub(super) fn for_each_near(
        &mut self,
        row: u32,
        (start, end): Run,
        place: &mut usize,
        mut look: impl FnMut(i32, &mut Near),
    ) {
        if start >= end {
            return;
        }
        let runs = &self.runs[self.ends[row as usize]..self.ends[row as usize + 1]];
        *place = first_past(runs, |run| run.columns.1, start, *place);
        for run in runs[*place..].iter().take_while(|run| run.columns.0 < end) {
            let Some(first) = run.first else { continue };
            let [from, to] = [run.columns.0.max(start), run.columns.1.min(end)];
            let places =
                [from, to].map(|column| first as usize + (column - run.columns.0) as usize);
            for (column, near) in (from..to).zip(&mut self.near[places[0]..places[1]]) {
                look(column, near);
            }
        }
    }

    /// Returns the depth of a pixel inside its edge, in sixteenths of a pixel, from 1 on.
    pub(super) fn depth(&self, index: u32) -> u32 {
        // A pixel at an upright edge is a pixel deep. Pixels that are too far to be measured are
        // as deep as any edge is searched.
        let distance = f64::from(self.near[index as usize].distance.min(MAX_DEPTH));
        (f64::from(SIXTEENTHS) * (distance + 0.5)).round().max(1.0) as u32
    }

    /// Returns the nearest edge of a pixel.
    pub(super) fn near(&self, index: u32) -> Near {
        self.near[index as usize]
    }

    /// Returns the number of pixels near edges.
    pub(super) fn near_count(&self) -> usize {
        self.near.len()
    }

    pub(super) fn height(&self) -> u32 {
        (self.ends.len() - 1) as u32
    }

    /// Returns the runs of a row from the left; none if the row lies outside the image.
    pub(super) fn row(&self, row: i64) -> &[EdgeRun] {
        match usize::try_from(row) {
            Ok(row) if row + 1 < self.ends.len() => &self.runs[self.ends[row]..self.ends[row + 1]],
            _ => &[],
        }
    }

    /// Returns the index of a pixel of the regions in the arrays: none inside deep runs.
    pub(super) fn at(&self, column: i32, row: i64) -> Option<Option<u32>> {
        let runs = self.row(row);
        let next = runs.partition_point(|run| run.columns.1 <= column);
        let run = runs.get(next).filter(|run| run.columns.0 <= column)?;
        Some(run.first.map(|first| first + (column - run.columns.0) as u32))
    }

    /// Calls `show` with each pixel near an edge, row by row, except in runs that are `plain`.
    pub(super) fn for_each(&self, plain: &[bool], mut show: impl FnMut(EdgePixel)) {
        let mut plain = plain.iter();
        for row in 0..self.height() {
            for run in self.row(row.into()) {
                let is_plain = *plain.next().expect("one for each run");
                let Some(first) = run.first.filter(|_| !is_plain) else { continue };
                for (index, column) in (first..).zip(run.columns.0..run.columns.1) {
                    show(EdgePixel { column, row, index });
                }
            }
        }
    }

    /// Returns the map as an image of `width` columns. Pixels outside the regions have
    /// `level_outside`, 0 or 255, and those deep inside the other.
    pub(super) fn gray(&self, width: u32, level_outside: u8) -> GrayMask {
        let mut gray = GrayMask::new(width);
        let mut runs = Vec::new();
        for row in 0..self.height() {
            self.levels_of_row(row, width, level_outside, &mut runs);
            gray.push_runs(runs.iter().copied()).expect("runs as wide as the image");
        }
        gray
    }

    /// Makes `runs` the runs of a row, (length, level).
    fn levels_of_row(&self, row: u32, width: u32, level_outside: u8, runs: &mut Vec<(u32, u8)>) {
        runs.clear();
        let mut column = 0;
        for run in self.row(row.into()) {
            let [start, end] = [run.columns.0, run.columns.1].map(|column| column as u32);
            runs.push((start - column, level_outside));
            let turned = |level: u8| if level_outside == 0 { level } else { 255 - level };
            match run.first {
                None => runs.push((end - start, turned(255))),
                Some(first) => {
                    let levels = &self.levels[first as usize..][..(end - start) as usize];
                    let equal = levels.chunk_by(|a, b| a == b);
                    runs.extend(equal.map(|run| (run.len() as u32, turned(run[0]))));
                }
            }
            column = end;
        }
        runs.push((width - column, level_outside));
    }
}

impl Near {
    /// Farther from all edges than is measured.
    const FAR: Self = Self { distance: f32::MAX, by: 0.0, slant: 0.0 };

    /// Returns how slanted the edge with a normal of length one is.
    pub(super) fn slant(normal: [f64; 2]) -> f32 {
        normal[0].abs().min(normal[1].abs()) as f32
    }

    /// Returns the level of the pixel: the share of its area that is inside the moved edge.
    fn level(&self) -> u8 {
        level(share_inside(f64::from(self.distance) - f64::from(self.by), f64::from(self.slant)))
    }
}

/// From this distance on no edge cuts a pixel.
const HALF_DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Returns the share of a pixel's area inside a straight edge, whose distance from the pixel's
/// middle is below zero if that is outside, and whose normal has the smaller side `slant`.
fn share_inside(distance: f64, slant: f64) -> f64 {
    let away = distance.abs();
    if away >= HALF_DIAGONAL {
        return if distance < 0.0 { 0.0 } else { 1.0 };
    }
    let steep = (1.0 - slant * slant).sqrt();
    let beyond = (steep + slant) / 2.0 - away;
    let share = if beyond <= 0.0 {
        1.0
    } else if beyond <= slant {
        // The edge cuts a corner off.
        1.0 - beyond * beyond / (2.0 * steep * slant)
    } else {
        0.5 + away / steep
    };
    if distance < 0.0 { 1.0 - share } else { share }
}

/// Returns the level of a pixel of which a share, from 0 to 1, is exposed.
pub(super) fn level(share: f64) -> u8 {
    // A cast rounds down, and is no call.
    (255.0 * share.clamp(0.0, 1.0) + 0.5) as u8
}
