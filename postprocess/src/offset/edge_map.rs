//! The edge map of an image: runs deep inside, and the distance and level of every pixel near an
//! edge.

use lamp_stack::GrayMask;

use super::aligned_rows::{AlignedRows, AlignedRun};
use super::erode::{Disc, Erosion, Sources, at_least, more_than};
use super::row_runs::{RowRuns, Run, subtract};

/// A region of an image whose edges move by one distance.
#[derive(Debug)]
pub(super) struct SizeClass {
    /// The pixels of the region, none of them sources.
    pub(super) region: RowRuns,
    /// The distance in pixels, not below zero.
    pub(super) by: f64,
}

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
    /// The squared distance of each pixel near an edge from the nearest source.
    pub(super) squares: Vec<u32>,
    /// The level of each of these pixels after the edge has moved.
    pub(super) levels: Vec<u8>,
}

impl EdgeMap {
    /// Moves the edges of `classes`. Pixels at least `depth` further inside are deep inside. If
    /// `all`, the map has pixels of level zero, too.
    pub(super) fn new(
        sources: &Sources,
        width: u32,
        classes: &[SizeClass],
        depth: f64,
        all: bool,
    ) -> Self {
        let height = classes.first().map_or(0, |class| class.region.height());
        let discs: Vec<_> = classes
            .iter()
            .map(|class| {
                let outer = if all { 0 } else { more_than(class.by) };
                let inner = at_least(class.by + depth);
                let discs = [Disc::below(outer, height), Disc::below(inner, height)];
                (discs, LevelTable::new(class.by, inner))
            })
            .collect();
        let mut edge = Self { ends: vec![0], ..Self::default() };
        let [mut outer, mut inner] = [Erosion::default(), Erosion::default()];
        let mut runs = Vec::new();
        let mut squares = Vec::new();
        let mut along = match &discs[..] {
            [([outer, inner], levels)] => {
                Some((AlignedRows::new(sources, [outer, inner], width), levels))
            }
            _ => None,
        };
        let mut sides = Vec::new();
        for row in 0..height {
            if let Some((along, levels)) = &mut along
                && along.row(row, &mut sides)
            {
                edge.push_along(&sides, discs[0].0[1].halves().len(), levels, &mut squares);
                edge.ends.push(edge.runs.len());
                continue;
            }
            let first = edge.runs.len();
            for (class, ([outer_disc, inner_disc], levels)) in classes.iter().zip(&discs) {
                sources.erode(outer_disc, row, class.region.row(row), &mut outer);
                sources.erode(inner_disc, row, &outer.runs, &mut inner);
                let deep = inner.runs.iter().map(|&run| EdgeRun { columns: run, first: None });
                edge.runs.extend(deep);
                subtract(&outer.runs, &inner.runs, &mut runs);
                for &run in &runs {
                    sources.squares(row, run, levels.limit, &mut squares);
                    edge.push(run, levels, &squares);
                }
            }
            edge.runs[first..].sort_unstable_by_key(|run| run.columns);
            edge.ends.push(edge.runs.len());
        }
        edge
    }

    /// Adds a row of aligned runs.
    fn push_along(
        &mut self,
        runs: &[AlignedRun],
        reach: usize,
        levels: &LevelTable,
        squares: &mut Vec<u32>,
    ) {
        for sides in runs {
            let [outer, inner] = [sides.outer, sides.inner];
            if outer.0 < inner.0 {
                sides.squares(reach, true, squares);
                self.push((outer.0, inner.0), levels, squares);
            }
            self.runs.push(EdgeRun { columns: inner, first: None });
            if inner.1 < outer.1 {
                sides.squares(reach, false, squares);
                self.push((inner.1, outer.1), levels, squares);
            }
        }
    }

    fn push(&mut self, run: Run, levels: &LevelTable, squares: &[u32]) {
        let first = u32::try_from(self.squares.len()).expect("an image has fewer pixels at edges");
        self.runs.push(EdgeRun { columns: run, first: Some(first) });
        self.squares.extend_from_slice(squares);
        self.levels.extend(squares.iter().map(|&square| levels.of(square)));
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

/// Levels of pixels by their squared distance. Most squares are small, so a table spares roots.
struct LevelTable {
    by: f64,
    /// The end of the squares.
    limit: u64,
    /// The levels of the first squares.
    table: Vec<u8>,
}

impl LevelTable {
    fn new(by: f64, limit: u64) -> Self {
        let table = (0..limit.min(4096) as u32).map(|square| Self::level(square, by)).collect();
        Self { by, limit, table }
    }

    fn of(&self, square: u32) -> u8 {
        let known = self.table.get(square as usize).copied();
        known.unwrap_or_else(|| Self::level(square, self.by))
    }

    fn level(square: u32, by: f64) -> u8 {
        level(f64::from(square).sqrt() - by)
    }
}

/// Returns the level of a pixel of which a share, from 0 to 1, is exposed.
pub(super) fn level(share: f64) -> u8 {
    (255.0 * share.clamp(0.0, 1.0)).round() as u8
}
