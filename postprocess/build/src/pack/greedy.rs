//! Packs greedily: puts each copy at the first place that is free for it.

use std::collections::HashMap;

use super::super::{CopyPlacement, Layout, PixelSize};
use super::Way;
use super::no_fit::{CellRun, NoFitRegion, NoFitRegions};

/// The free place that a copy takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PlacingRule {
    /// The one nearest to the top.
    Top,
    /// The one whose copy ends nearest to the top.
    Bottom,
}

impl PlacingRule {
    pub(super) const ALL: [Self; 2] = [Self::Top, Self::Bottom];
}

/// Places up to `wanted` copies of each part in its ways from the top left, large parts first, and
/// centers all of them.
pub(super) fn place(
    layout: &Layout,
    regions: &mut NoFitRegions,
    wanted: &[u32],
    ways: &[Vec<Way>],
    order: PlacingRule,
) -> Vec<CopyPlacement> {
    let mut free = FreeRoom { layout, regions, taken: HashMap::new(), placements: Vec::new() };
    let area = |part: &usize| {
        let (stack, turn) = ways[*part][0];
        let PixelSize { width, height } = layout.parts()[stack].size(turn);
        std::cmp::Reverse(u64::from(width) * u64::from(height))
    };
    let mut parts: Vec<usize> = (0..wanted.len()).collect();
    // Small parts still find room between large ones, but not the other way round.
    parts.sort_by_key(area);
    for part in parts {
        for _ in 0..wanted[part] {
            // Places only fill up, so no later copy of this part finds one.
            if !free.place(&ways[part], order) {
                break;
            }
        }
    }
    let mut placements = free.placements;
    centre(layout, &mut placements);
    // Copies are numbered in this order, so that numbers follow places.
    placements.sort_by_key(|at| (at.part, at.top, at.left));
    placements
}

/// Adds copies of the only part to the placed ones, up to `wanted`, and centers all of them.
pub(super) fn fill(
    layout: &Layout,
    regions: &mut NoFitRegions,
    mut placements: Vec<CopyPlacement>,
    wanted: u32,
    ways: &[Way],
) -> Vec<CopyPlacement> {
    placements.truncate(wanted as usize);
    let mut free = FreeRoom { layout, regions, taken: HashMap::new(), placements };
    while free.placements.len() < wanted as usize && free.place(ways, PlacingRule::Top) {}
    let mut placements = free.placements;
    centre(layout, &mut placements);
    placements.sort_by_key(|at| (at.part, at.top, at.left));
    placements
}

/// Adds copies of several parts to the placed ones, up to what is wanted of each, and centers all
/// of them. The part that has the smallest share of what is wanted comes first.
pub(super) fn fill_evenly(
    layout: &Layout,
    regions: &mut NoFitRegions,
    mut placements: Vec<CopyPlacement>,
    wanted: &[u32],
    ways: &[Vec<Way>],
) -> Vec<CopyPlacement> {
    // To the top and the left, so that the room is in one place.
    let left = placements.iter().map(|at| at.left).min().unwrap_or(0);
    let top = placements.iter().map(|at| at.top).min().unwrap_or(0);
    placements.iter_mut().for_each(|at| (at.left, at.top) = (at.left - left, at.top - top));
    let is_of = |part: usize, at: &CopyPlacement| ways[part].iter().any(|way| way.0 == at.part);
    let count = |part| placements.iter().filter(|at| is_of(part, at)).count() as u64;
    let mut counts: Vec<u64> = (0..wanted.len()).map(count).collect();
    let mut open: Vec<usize> = (0..wanted.len()).collect();
    let mut free = FreeRoom { layout, regions, taken: HashMap::new(), placements };
    loop {
        open.retain(|&part| counts[part] < u64::from(wanted[part]));
        let fewer = |&one: &usize, &other: &usize| {
            (counts[one] * u64::from(wanted[other])).cmp(&(counts[other] * u64::from(wanted[one])))
        };
        let Some(part) = open.iter().copied().min_by(fewer) else { break };
        if free.place(&ways[part], PlacingRule::Top) {
            counts[part] += 1;
        } else {
            // Places only fill up.
            open.retain(|&other| other != part);
        }
    }
    let mut placements = free.placements;
    centre(layout, &mut placements);
    placements.sort_by_key(|at| (at.part, at.top, at.left));
    placements
}

/// The room left on an area.
struct FreeRoom<'a> {
    layout: &'a Layout,
    regions: &'a mut NoFitRegions,
    /// The places taken for each way of a part.
    taken: HashMap<Way, TakenPlaces>,
    placements: Vec<CopyPlacement>,
}

/// The cells where an outline may not begin.
struct TakenPlaces {
    /// The taken columns of each row as runs that do not touch, from the left.
    rows: Vec<Vec<CellRun>>,
    /// The number of columns.
    columns: i32,
    /// The first row that is not known to be full.
    first: usize,
    /// The number of copies that were taken into account.
    known: usize,
}

impl FreeRoom<'_> {
    /// Finds a place for one more copy. Returns whether there was one.
    fn place(&mut self, ways: &[Way], order: PlacingRule) -> bool {
        let cell = self.regions.cell;
        let found = ways.iter().filter_map(|&(part, turn)| {
            let (column, row) = self.first_place((part, turn))?;
            let placement =
                CopyPlacement { part, turn, left: column as u32 * cell, top: row as u32 * cell };
            let rank = match order {
                PlacingRule::Top => placement.top,
                PlacingRule::Bottom => placement.top + self.layout.parts()[part].size(turn).height,
            };
            Some((rank, placement.left, placement))
        });
        let best = found.min_by_key(|&(rank, left, _)| (rank, left));
        self.placements.extend(best.map(|(_, _, placement)| placement));
        best.is_some()
    }

    /// Returns the first column of the first row where an outline may begin.
    fn first_place(&mut self, key: Way) -> Option<(i32, i32)> {
        let (pixels, cell) = (self.layout.pixels(), self.regions.cell);
        let size = self.layout.parts()[key.0].size(key.1);
        let room = PixelSize {
            width: pixels.width.checked_sub(size.width)? / cell + 1,
            height: pixels.height.checked_sub(size.height)? / cell + 1,
        };
        let taken = self.taken.entry(key).or_insert_with(|| TakenPlaces::new(room));
        for at in &self.placements[taken.known..] {
            let no_fit = self.regions.no_fit(self.layout, key, (at.part, at.turn));
            // A copy that begins within a cell takes what it would from either side of it.
            let ends = |pixels: u32| [pixels / cell, pixels.div_ceil(cell)].map(|at| at as i32);
            let ([left, right], [top, bottom]) = (ends(at.left), ends(at.top));
            for row in top..=bottom {
                (left..=right).for_each(|column| taken.add(&no_fit, column, row));
            }
        }
        taken.known = self.placements.len();
        taken.first_free()
    }
}

impl TakenPlaces {
    fn new(room: PixelSize) -> Self {
        let rows = vec![Vec::new(); room.height as usize];
        Self { rows, columns: room.width as i32, first: 0, known: 0 }
    }

    /// Takes the places at which an outline would overlap another that begins at a
    /// column and a row.
    fn add(&mut self, no_fit: &NoFitRegion, column: i32, row: i32) {
        let start = row - no_fit.top;
        let hidden = (-start).max(0) as usize;
        let rows = self.rows.iter_mut().skip(start.max(0) as usize);
        for (taken, runs) in rows.zip(no_fit.rows.iter().skip(hidden)) {
            for &(from, to) in runs.iter() {
                let run = ((from + column).max(0), (to + column).min(self.columns));
                if run.0 < run.1 {
                    insert(taken, run);
                }
            }
        }
    }

    fn first_free(&mut self) -> Option<(i32, i32)> {
        while let Some(runs) = self.rows.get(self.first) {
            let column = match runs.first() {
                Some(&(0, end)) => end,
                _ => 0,
            };
            if column < self.columns {
                return Some((column, self.first as i32));
            }
            // A full row stays full: no place is given back.
            self.first += 1;
        }
        None
    }
}

/// Adds a run to runs that do not touch, and joins the runs that it touches.
fn insert(runs: &mut Vec<CellRun>, (mut start, mut end): CellRun) {
    let first = runs.partition_point(|run| run.1 < start);
    let last = first + runs[first..].partition_point(|run| run.0 <= end);
    if let [met_first, ..] = runs[first..last] {
        start = start.min(met_first.0);
        end = end.max(runs[last - 1].1);
    }
    runs.splice(first..last, [(start, end)]);
}

/// Moves all copies together to the middle of the area.
pub(super) fn centre(layout: &Layout, placements: &mut [CopyPlacement]) {
    let ends = |at: &CopyPlacement| {
        let size = layout.parts()[at.part].size(at.turn);
        (at.left + size.width, at.top + size.height)
    };
    let right = placements.iter().map(|at| ends(at).0).max().unwrap_or(0);
    let bottom = placements.iter().map(|at| ends(at).1).max().unwrap_or(0);
    let left = placements.iter().map(|at| at.left).min().unwrap_or(0);
    let top = placements.iter().map(|at| at.top).min().unwrap_or(0);
    let pixels = layout.pixels();
    for at in placements {
        at.left = at.left - left + (pixels.width - (right - left)) / 2;
        at.top = at.top - top + (pixels.height - (bottom - top)) / 2;
    }
}
