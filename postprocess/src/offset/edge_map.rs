//! An image near its edges: what lies deep inside, and how far each other
//! pixel is from the edge.

use super::aligned_rows::{AlignedRows, AlignedRun};
use super::erode::{Disc, Erosion, Sources, at_least, more_than};
use super::row_runs::{RowRuns, Run, subtract};

/// A region of an image, and how far its edges move.
#[derive(Debug)]
pub(super) struct SizeClass {
    /// Pixels that are no sources of distance.
    pub(super) region: RowRuns,
    /// How far, in pixels; not below zero.
    pub(super) by: f64,
}

/// A run of a row of an [`EdgeMap`].
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeRun {
    pub(super) columns: Run,
    /// Where its pixels stand in the edge's arrays; a run deep inside has none.
    pub(super) first: Option<u32>,
}

/// A pixel along the edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgePixel {
    pub(super) column: i32,
    pub(super) row: u32,
    /// Where it stands in the edge's arrays.
    pub(super) index: u32,
}

/// The pixels of some regions, from a distance on that leaves nothing of them.
#[derive(Debug, Default)]
pub(super) struct EdgeMap {
    ends: Vec<usize>,
    runs: Vec<EdgeRun>,
    /// The squared distance of each pixel along the edge from the nearest
    /// source.
    pub(super) squares: Vec<u32>,
    /// How much is left of each of these, when the edge has moved.
    pub(super) levels: Vec<u8>,
}

impl EdgeMap {
    /// Where the edges of `classes` lie when they have moved. Pixels from
    /// `depth` further in on are deep inside. Where `all`, pixels of which
    /// nothing is left are there, too.
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

    /// Adds a row of runs whose sides are measured by themselves.
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

    /// The runs of a row, from the left; of rows outside the image none.
    pub(super) fn row(&self, row: i64) -> &[EdgeRun] {
        match usize::try_from(row) {
            Ok(row) if row + 1 < self.ends.len() => &self.runs[self.ends[row]..self.ends[row + 1]],
            _ => &[],
        }
    }

    /// Where a pixel of the regions stands in the arrays; deep inside, nowhere.
    pub(super) fn at(&self, column: i32, row: i64) -> Option<Option<u32>> {
        let runs = self.row(row);
        let next = runs.partition_point(|run| run.columns.1 <= column);
        let run = runs.get(next).filter(|run| run.columns.0 <= column)?;
        Some(run.first.map(|first| first + (column - run.columns.0) as u32))
    }

    /// Shows all pixels along the edge, row by row, but those of runs that are
    /// `plain`.
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

    /// Makes `runs` a row as runs of length and level, where the rest is
    /// `level_outside`, 0 or 255, and deep inside is the other.
    pub(super) fn levels_of_row(
        &self,
        row: u32,
        width: u32,
        level_outside: u8,
        runs: &mut Vec<(u32, u8)>,
    ) {
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

/// The levels of pixels by their squared distance.
struct LevelTable {
    by: f64,
    /// Squares are below.
    limit: u64,
    /// Of the first squares.
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

/// The level of which a share is exposed.
pub(super) fn level(share: f64) -> u8 {
    (255.0 * share.clamp(0.0, 1.0)).round() as u8
}
