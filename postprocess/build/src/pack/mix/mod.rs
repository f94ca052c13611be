//! Packs several parts: lets copies overlap, and moves them apart.
//!
//! The area is made lower, a little at a time, and the copies are pushed into it. Where they
//! overlap then, each is moved to the place of the whole area, and to the turn, at which it is
//! least deep in others ([`board`]). Pairs that go on overlapping count more and more
//! ([`separate`]). Where no way is found, the area is made lower by less, and two copies change
//! places.
//!
//! Source: S. Umetani et al., Solving the irregular strip packing problem via guided local search
//! for overlap minimization, Int. Trans. Oper. Res. 16, 2009.

mod board;
mod depth;
mod random;
mod search;
mod separate;
mod slide;
mod ways;

use super::super::{CopyPlacement, Layout};
use board::PlacedCopy;

pub(super) use ways::Ways;

/// The additions and look-ups that a search may make at most.
pub(super) const MOST_WORK: u64 = 4_000_000_000;
/// More copies than these stay as they are.
pub(super) const MOST_COPIES: usize = 512;
/// Parts in more ways stay as they are, too: each two of them have depths of their own.
pub(super) const MOST_WAYS: usize = 256;

/// Returns the copies closer to the top, as far as the search gets, or until they take `enough`
/// rows or no work is left: never lower than they were.
pub(super) fn shorten(
    layout: &Layout,
    gap: u32,
    ways: &Ways,
    placements: Vec<CopyPlacement>,
    enough: u32,
    left_work: &mut u64,
) -> Vec<CopyPlacement> {
    let left = placements.iter().map(|at| at.left).min().unwrap_or(0);
    let top = placements.iter().map(|at| at.top).min().unwrap_or(0);
    // To the nearest cell; the search begins by separating copies that overlap then.
    let cells = |pixels: u32| ((pixels + ways.cell / 2) / ways.cell) as i32;
    let copy = |at: &CopyPlacement| {
        let (part, way) = ways.of(layout, at);
        PlacedCopy { part, way, at: [cells(at.left - left), cells(at.top - top)] }
    };
    let copies: Vec<PlacedCopy> = placements.iter().map(copy).collect();
    let found = search::lowest(layout, ways, &copies, enough, left_work);
    let Some(found) = found else { return placements };
    let shorter = slide::up(layout, gap, ways, &found);
    if height(layout, &shorter) < height(layout, &placements) { shorter } else { placements }
}

/// Returns how many rows copies take.
pub(super) fn height(layout: &Layout, placements: &[CopyPlacement]) -> u32 {
    let bottom = |at: &CopyPlacement| at.top + layout.parts()[at.part].size(at.turn).height;
    let bottom = placements.iter().map(bottom).max().unwrap_or(0);
    bottom - placements.iter().map(|at| at.top).min().unwrap_or(0)
}

#[cfg(test)]
mod mix_tests;
