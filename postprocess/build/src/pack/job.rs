//! Tries strategy after strategy.

use std::collections::HashMap;

use lamp_stack::{MAX_SIDE, Orientation};

use super::super::{CopyPlacement, Layout, PixelSize, TileError};
use super::greedy::{self, PlacingRule};
use super::no_fit::NoFitRegions;
use super::{MAX_COPIES, Pack, PackBy, Turns, Way, grid, lattice, mix, shares};

/// Copies to be placed on an area.
pub(super) struct PackingJob<'a> {
    /// The area without its edges, and the stacks.
    layout: &'a Layout,
    /// The pixels between copies.
    gap: u32,
    how: Pack,
    /// The stacks of each part, where it has several.
    stacks: Option<&'a [Vec<usize>]>,
    boxes: NoFitRegions,
    outlines: NoFitRegions,
    /// The regions of lattices, by the pixels on a side of their cells.
    of_lattices: HashMap<u32, NoFitRegions>,
    /// How deep parts overlap, once a search has needed it.
    depths: Option<mix::Ways>,
}

/// A way to find places.
#[derive(Clone, Copy, Debug)]
enum Strategy {
    /// Puts all copies of the only part in rows and columns, after these quarter turns.
    Grid(u32),
    /// Puts copy after copy where there is room.
    Greedy(PackBy, Turns, PlacingRule),
    /// Puts copies of the only part on a lattice of one of its stacks, and more where there is
    /// room.
    Lattice(usize),
}

impl<'a> PackingJob<'a> {
    pub(super) fn new(layout: &'a Layout, gap: u32, how: Pack) -> Self {
        let [boxes, outlines] =
            [PackBy::Boxes, PackBy::Outlines].map(|by| NoFitRegions::new(layout, gap, by));
        let of_lattices = HashMap::new();
        Self { layout, gap, how, stacks: None, boxes, outlines, of_lattices, depths: None }
    }

    /// Creates one whose parts have several stacks each.
    pub(super) fn turned(
        layout: &'a Layout,
        gap: u32,
        how: Pack,
        stacks: &'a [Vec<usize>],
    ) -> Self {
        Self { stacks: Some(stacks), ..Self::new(layout, gap, how) }
    }

    /// Finds places for copies of each part.
    pub(super) fn pack(mut self, counts: &[Option<u32>]) -> Result<Vec<CopyPlacement>, TileError> {
        let alone = counts.len() == 1;
        for part in 0..counts.len() {
            self.check_fits(part)?;
        }
        // Without a count, a single part gets more copies than fit.
        let usual = if alone { u32::MAX } else { 1 };
        let wanted: Vec<u32> =
            counts.iter().map(|count| count.unwrap_or(usual).min(MAX_COPIES)).collect();
        let best = if self.how.shares && !alone {
            shares::most(&mut self, &wanted, MAX_COPIES)
        } else {
            let simple = self.simply_placed(&wanted);
            if alone { simple } else { self.searched_for_each(&wanted, simple) }
        };
        let short = (0..counts.len()).find_map(|part| {
            let stacks = self.stacks_of(part);
            let most = best.iter().filter(|at| stacks.contains(&at.part)).count() as u32;
            let one = (!alone && (self.how.shares || counts[part].is_none())).then_some(1);
            let asked = one.or(counts[part])?;
            let least = if alone { asked } else { 1 };
            (most < least).then_some((part, asked, most))
        });
        match short {
            None => Ok(best),
            Some((part, asked, most)) => {
                let name = self.layout.parts()[part].name().to_owned();
                Err(TileError::TooMany { name, asked, most, area_mm: self.layout.area() })
            }
        }
    }

    /// Finds places for copies of several parts. Where not all fit, each part gets its share, and
    /// more where there is room.
    fn searched_for_each(
        &mut self,
        wanted: &[u32],
        simple: Vec<CopyPlacement>,
    ) -> Vec<CopyPlacement> {
        let all = sum(wanted);
        let is_whole = simple.len() == all;
        if is_whole || self.may_fit(wanted) {
            let mut work = mix::MOST_WORK;
            let found = self.searched(wanted, simple, 0, &mut work);
            if found.len() == all {
                return found;
            }
        }
        // So many copies by shares have no more of any part than is wanted.
        let shared = shares::most(self, wanted, all.min(MAX_COPIES as usize) as u32);
        let ways = self.all_ways(wanted.len(), self.how.turns);
        let regions = match self.how.by {
            PackBy::Boxes => &mut self.boxes,
            PackBy::Outlines => &mut self.outlines,
        };
        greedy::fill_evenly(self.layout, regions, shared, wanted, &ways)
    }

    /// Whether the area has as many pixels as all copies.
    fn may_fit(&mut self, wanted: &[u32]) -> bool {
        let PixelSize { width, height } = self.layout.pixels();
        let white = wanted.iter().enumerate().map(|(part, &count)| {
            let stacks = self.stacks_of(part).into_iter();
            let white = stacks.map(|stack| {
                let PixelSize { width, height } =
                    self.layout.parts()[stack].size(Orientation::default());
                match self.how.by {
                    PackBy::Boxes => u128::from(width) * u128::from(height),
                    PackBy::Outlines => {
                        let outline = self.layout.parts()[stack].silhouette(Orientation::default());
                        outline.white_pixels().into()
                    }
                }
            });
            white.min().unwrap_or(0) * u128::from(count)
        });
        white.sum::<u128>() <= u128::from(width) * u128::from(height)
    }

    fn check_fits(&self, part: usize) -> Result<(), TileError> {
        let area = self.layout.pixels();
        let fits = self.ways(part, self.how.turns).iter().any(|&(stack, turn)| {
            let size = self.layout.parts()[stack].size(turn);
            size.width <= area.width && size.height <= area.height
        });
        if fits {
            return Ok(());
        }
        let name = self.layout.parts()[part].name().to_owned();
        let size = self.layout.parts()[part].size(Orientation::default());
        Err(TileError::TooLarge { name, part: size, area, area_mm: self.layout.area() })
    }

    /// Returns the strategies to try, in order.
    fn strategies(&self, alone: bool) -> Vec<Strategy> {
        let Pack { by, turns, .. } = self.how;
        let greedy = |by, turns| PlacingRule::ALL.map(|order| Strategy::Greedy(by, turns, order));
        let mut all = Vec::new();
        let lattices = self.stacks_of(0).into_iter().filter(|_| alone).map(Strategy::Lattice);
        if self.stacks.is_some() {
            all.extend(greedy(PackBy::Outlines, turns));
            all.extend(lattices);
            return all;
        }
        if alone {
            all.push(Strategy::Grid(0));
            all.extend((turns == Turns::Quarters).then_some(Strategy::Grid(1)));
        } else {
            all.extend(greedy(PackBy::Boxes, Turns::None));
        }
        if turns == Turns::Quarters {
            all.extend(greedy(PackBy::Boxes, Turns::Quarters));
        }
        if by == PackBy::Outlines {
            let allowed = Turns::ALL.into_iter().filter(|allowed| *allowed <= turns);
            all.extend(allowed.flat_map(|turns| greedy(PackBy::Outlines, turns)));
            all.extend(lattices);
        }
        all
    }

    /// Returns the copies of the strategy that places most of them, the first of several.
    pub(super) fn simply_placed(&mut self, wanted: &[u32]) -> Vec<CopyPlacement> {
        let mut best: Vec<CopyPlacement> = Vec::new();
        for strategy in self.strategies(wanted.len() == 1) {
            let found = match strategy {
                Strategy::Grid(quarters) => {
                    let turn = Orientation::new(quarters, false);
                    grid::grid(self.layout, turn, wanted[0], self.gap)
                }
                Strategy::Greedy(by, turns, order) => {
                    let ways = self.all_ways(wanted.len(), turns);
                    let regions = match by {
                        PackBy::Boxes => &mut self.boxes,
                        PackBy::Outlines => &mut self.outlines,
                    };
                    greedy::place(self.layout, regions, wanted, &ways, order)
                }
                Strategy::Lattice(stack) => {
                    let ways = self.ways(0, self.how.turns);
                    let (regions, turns) = (&mut self.of_lattices, self.how.turns);
                    lattice::place(self.layout, self.gap, wanted[0], stack, turns, &ways, regions)
                }
            };
            if found.len() > best.len() {
                best = found;
            }
            if best.len() >= sum(wanted) {
                break;
            }
        }
        best
    }

    /// Returns the copies of several parts on fewer rows, or all of them where some were left out,
    /// if that is found. The search ends at `enough` rows, or where no work is left.
    pub(super) fn searched(
        &mut self,
        wanted: &[u32],
        best: Vec<CopyPlacement>,
        enough: u32,
        left_work: &mut u64,
    ) -> Vec<CopyPlacement> {
        let all = sum(wanted);
        if self.how.by != PackBy::Outlines || all > mix::MOST_COPIES {
            return best;
        }
        let (layout, gap) = (self.layout, self.gap);
        let area = layout.pixels();
        let fits = |&(stack, turn): &Way| {
            let size = layout.parts()[stack].size(turn);
            size.width <= area.width && size.height <= area.height
        };
        let mut ways = self.all_ways(wanted.len(), self.how.turns);
        ways.iter_mut().for_each(|ways| ways.retain(fits));
        if ways.iter().map(Vec::len).sum::<usize>() > mix::MOST_WAYS {
            return best;
        }
        // Where some were left out, they are placed below the area first.
        let mut tall = layout.clone();
        let longest = |part: usize| {
            let sizes = ways[part].iter().map(|&(stack, turn)| layout.parts()[stack].size(turn));
            let height = sizes.map(|size| size.height).max().unwrap_or(0);
            height.saturating_add(gap).saturating_mul(wanted[part])
        };
        let rows = (0..wanted.len()).map(longest).fold(layout.pixels().height, u32::saturating_add);
        tall.pixels.height = rows.min(MAX_SIDE);
        let mut start = (best.len() == all).then(|| best.clone());
        for order in PlacingRule::ALL {
            let found = greedy::place(&tall, &mut self.outlines, wanted, &ways, order);
            let is_lower = |start: &Vec<_>| mix::height(&tall, &found) < mix::height(&tall, start);
            if found.len() == all && start.as_ref().is_none_or(is_lower) {
                start = Some(found);
            }
        }
        let Some(start) = start else { return best };
        let depths = self.depths.get_or_insert_with(|| mix::Ways::new(layout, gap, &ways));
        let mut found = mix::shorten(&tall, gap, depths, start, enough, left_work);
        if mix::height(layout, &found) > layout.pixels().height {
            return best;
        }
        greedy::centre(layout, &mut found);
        found.sort_by_key(|at| (at.part, at.top, at.left));
        found
    }

    /// Returns the stacks of a part.
    fn stacks_of(&self, part: usize) -> Vec<usize> {
        self.stacks.map_or_else(|| vec![part], |stacks| stacks[part].clone())
    }

    /// Returns the ways in which copies of a part may lie.
    fn ways(&self, part: usize, turns: Turns) -> Vec<Way> {
        let stacks = self.stacks_of(part).into_iter();
        stacks
            .flat_map(|stack| turns.orientations().into_iter().map(move |turn| (stack, turn)))
            .collect()
    }

    fn all_ways(&self, parts: usize, turns: Turns) -> Vec<Vec<Way>> {
        (0..parts).map(|part| self.ways(part, turns)).collect()
    }

    /// Returns the rows of the area.
    pub(super) fn rows(&self) -> u32 {
        self.layout.pixels().height
    }
}

/// Returns the number of copies of all parts.
pub(super) fn sum(wanted: &[u32]) -> usize {
    wanted.iter().map(|&count| count as usize).fold(0, usize::saturating_add)
}
