//! Makes the area lower, and the copies keep apart.

use super::super::super::Layout;
use super::MOST_WORK;
use super::board::{Board, PlacedCopy};
use super::random::Random;
use super::separate::separate;
use super::ways::Ways;

/// The additions and look-ups that the search may make: for each copy, for each cell of the area
/// that the copies take at first. They are counted, not timed, so that every machine finds the same
/// layout.
const WORK_OF_COPY: u64 = 100_000_000;
const WORK_OF_CELL: u64 = 20_000;
/// The part of the work, in tenths, in which copies change places where they find no room.
const EXPLORING: u64 = 7;
/// The number of layouts with the least overlap that are kept to start from.
const KEPT: usize = 10;

/// A search for a low layout.
struct LayoutSearch<'a> {
    board: Board<'a>,
    random: Random,
    work: u64,
    best: Vec<PlacedCopy>,
    /// The height of the best, and by how much the next try is lower, in pixels.
    height: u32,
    step: u32,
    /// Layouts that overlap, with how much.
    kept: Vec<(u64, Vec<PlacedCopy>)>,
}

/// Returns copies as close to the top as the search finds, or as is enough, or nothing if it never
/// separates them. Takes what it does from the work that is left.
pub(super) fn lowest(
    layout: &Layout,
    ways: &Ways,
    copies: &[PlacedCopy],
    enough: u32,
    left: &mut u64,
) -> Option<Vec<PlacedCopy>> {
    let area = layout.pixels();
    let cells = |pixels: u32| u64::from(pixels.div_ceil(ways.cell));
    let cells = cells(area.width) * cells(bottom(ways, copies));
    let work = WORK_OF_COPY * copies.len() as u64;
    let work = MOST_WORK.min(work).min(WORK_OF_CELL * cells).min(*left);
    let mut board = Board::new(ways, [area.width, area.height], copies);
    // A fixed seed gives the same layout on every run.
    let mut random = Random(1);
    // Rounded to cells, copies overlap a little.
    if !separate(&mut board, &mut random, work) {
        *left = left.saturating_sub(board.work);
        return None;
    }
    let best = board.copies.clone();
    let height = bottom(ways, &best);
    let step = (height / 50).max(ways.cell);
    let mut search = LayoutSearch { board, random, work, best, height, step, kept: Vec::new() };
    let least = search.least_height().max(enough.saturating_sub(ways.cell));
    while search.board.work < work && search.height >= least + ways.cell {
        search.step = search.step.min(search.height - least);
        search.go_on();
    }
    *left = left.saturating_sub(search.board.work);
    Some(search.best)
}

/// Returns the row below all copies.
fn bottom(ways: &Ways, copies: &[PlacedCopy]) -> u32 {
    let end = |copy: &PlacedCopy| copy.at[1] as u32 * ways.cell + ways.size(copy.way)[1];
    copies.iter().map(end).max().unwrap_or(0)
}

impl LayoutSearch<'_> {
    /// Returns the height below which a copy does not fit in any way.
    fn least_height(&self) -> u32 {
        let ways = self.board.ways;
        let least = |copy: &PlacedCopy| {
            let heights = ways.of_part[copy.part].iter().map(|&way| ways.size(way)[1]);
            heights.min().unwrap_or(0)
        };
        self.best.iter().map(least).max().unwrap_or(0)
    }

    /// Tries once.
    fn go_on(&mut self) {
        let cell = self.board.ways.cell;
        let explores = self.board.work / EXPLORING < self.work / 10;
        self.board.area[1] = self.height - self.step;
        let start =
            if explores && !self.kept.is_empty() { self.swapped() } else { self.pushed_up() };
        self.board.set(&start);
        if separate(&mut self.board, &mut self.random, self.work) {
            self.best.clone_from(&self.board.copies);
            self.height = bottom(self.board.ways, &self.best);
            self.kept.clear();
        } else if explores && (self.step <= 2 * cell || self.kept.is_empty()) {
            self.kept.push((self.board.overlap(), self.board.copies.clone()));
            self.kept.sort_by_key(|(overlap, _)| *overlap);
            self.kept.truncate(KEPT);
        } else {
            self.step = (self.step / 2).max(cell);
            self.kept.clear();
        }
    }

    /// Returns the best with the copies below some row moved up by the step.
    fn pushed_up(&mut self) -> Vec<PlacedCopy> {
        let cell = self.board.ways.cell;
        let from = self.random.below((self.height / cell).max(1) as usize) as i32;
        let by = (self.step / cell) as i32;
        let moved = |copy: &PlacedCopy| {
            let [x, y] = copy.at;
            PlacedCopy { at: [x, if y > from { y - by } else { y }], ..*copy }
        };
        self.best.iter().map(moved).collect()
    }

    /// Returns a kept layout, rather one that overlaps little, in which two copies have changed
    /// places.
    fn swapped(&mut self) -> Vec<PlacedCopy> {
        let [one, other] = [0, 1].map(|_| self.random.below(self.kept.len()));
        // The list is sorted by overlap: the lesser of two random numbers prefers its front.
        let mut copies = self.kept[one.min(other)].1.clone();
        let [one, other] = [0, 1].map(|_| self.random.below(copies.len()));
        (copies[one].at, copies[other].at) = (copies[other].at, copies[one].at);
        copies
    }
}
