//! Packs copies of one part as lattices: translates of one copy, or of a copy and
//! its half turn.
//!
//! [`search`] finds dense lattices from the no-fit regions, [`area`] counts the copies of a lattice
//! that the area holds. The best are laid out, and copies that still fit at the edges are added one
//! by one.

mod area;
mod motif;
mod search;

use std::collections::HashMap;

use lamp_stack::Orientation;

use super::super::{CopyPlacement, Layout, PixelSize};
use super::no_fit::NoFitRegions;
use super::{MAX_COPIES, Turns, Way, greedy};
use area::{Fit, LastStart};
use motif::Motif;

/// A displacement in cells: right and down.
type Shift = [i32; 2];

/// Where copies stand: at all sums of whole multiples of two vectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct CopyLattice {
    /// The vector that is steep: it leads at least as far down as aside.
    along: Shift,
    /// A vector to the right of it.
    across: Shift,
    /// From each copy to one that is turned by half, if there are such.
    partner: Option<Shift>,
}

impl CopyLattice {
    /// Returns it in cells of which so many make one.
    fn times(&self, times: i32) -> Self {
        let of = |shift: Shift| shift.map(|cells| cells * times);
        let [along, across] = [self.along, self.across].map(of);
        Self { along, across, partner: self.partner.map(of) }
    }

    /// Returns the cells of the area that one copy takes, twice.
    fn cells_of_two(&self) -> i64 {
        let [[ux, uy], [vx, vy]] = [self.along, self.across].map(|side| side.map(i64::from));
        let both = uy * vx - ux * vy;
        // Of two, so that a copy's share of a pair is no half cell.
        if self.partner.is_some() { both } else { 2 * both }
    }
}

/// How the lattice lies on the area.
#[derive(Clone, Copy, Debug)]
struct View {
    /// The stack that its copies take their images from.
    stack: usize,
    /// Whether rows of the search are columns of the area.
    transposed: bool,
    /// Whether all of it is turned by a quarter.
    turned: bool,
}

/// The cells along a part, at most, in which lattices are searched, and are moved closer.
const SEARCH_CELLS: u32 = 256;
const CLOSE_CELLS: u32 = 2048;
/// The number of layouts whose edges are filled up, at most.
const FILLED: usize = 6;

/// Places up to `wanted` copies of the only part: lattices of one of its stacks, and others at
/// their edges in any way. `regions` are the known ones, by the pixels on a side of their cells.
pub(super) fn place(
    layout: &Layout,
    gap: u32,
    wanted: u32,
    stack: usize,
    turns: Turns,
    ways: &[Way],
    regions: &mut HashMap<u32, NoFitRegions>,
) -> Vec<CopyPlacement> {
    let PixelSize { width, height } = layout.parts()[stack].size(Orientation::default());
    // Regions cost the square of the runs in a row.
    let outline = layout.parts()[stack].silhouette(Orientation::default());
    let runs = (outline.change_count() / (2 * height.max(1) as usize)).max(1) as u32;
    let cell = width.max(height).div_ceil((CLOSE_CELLS / runs).max(1)).max(1);
    let times = (width.max(height) / cell).div_ceil(SEARCH_CELLS).max(1);
    // Taken out of the map until the end, since both are borrowed at once.
    let mut of_cells = |cell: u32| {
        let known = regions.remove(&cell);
        known.unwrap_or_else(|| NoFitRegions::in_cells(layout, gap, cell))
    };
    let [mut coarse, mut fine] = [cell * times, cell].map(&mut of_cells);
    let mut fits: Vec<(Fit, CopyLattice, View)> = Vec::new();
    for transposed in [false, true] {
        let [coarse, fine] = [&mut coarse, &mut fine]
            .map(|regions| Motif::new(layout, regions, stack, transposed, turns >= Turns::Half));
        let found = search::lattices(&coarse).into_iter().map(|found| found.times(times as i32));
        let lattices: Vec<CopyLattice> =
            found.flat_map(|found| search::closer_ways(&fine, found)).collect();
        for turned in [false, true] {
            if turned && turns < Turns::Quarters {
                continue;
            }
            let view = View { stack, transposed, turned };
            let Some(room) = view.room(layout, cell) else { continue };
            fits.extend(lattices.iter().map(|lattice| (room.best(lattice), *lattice, view)));
        }
    }
    // Of equal counts, the denser lattice leaves more room at the edges.
    fits.sort_by_key(|(fit, lattice, _)| (std::cmp::Reverse(fit.copies), lattice.cells_of_two()));
    // The same lattice in other vectors gives nothing new.
    fits.dedup_by_key(|(fit, lattice, _)| (fit.copies, lattice.cells_of_two()));
    let mut best = Vec::new();
    for (fit, lattice, view) in fits.into_iter().take(FILLED) {
        let Some(room) = view.room(layout, cell) else { continue };
        let shifts = room.shifts(&lattice, fit.start);
        let placed = shifts.map(|(shift, half)| view.placement(shift, half, room, cell));
        let mut placements: Vec<CopyPlacement> = placed.take(MAX_COPIES as usize).collect();
        placements.sort_by_key(|at| (at.top, at.left));
        let filled = greedy::fill(layout, &mut fine, placements, wanted, ways);
        if filled.len() > best.len() {
            best = filled;
        }
    }
    regions.extend([(cell * times, coarse), (cell, fine)]);
    best
}

impl View {
    /// Returns where copies may begin, in the lattice's own frame.
    fn room(self, layout: &Layout, cell: u32) -> Option<LastStart> {
        let (area, part) =
            (layout.pixels(), layout.parts()[self.stack].size(Orientation::default()));
        let area = if self.turned { [area.height, area.width] } else { [area.width, area.height] };
        let PixelSize { width, height } = part;
        let across = area[0].checked_sub(width)? / cell;
        let down = area[1].checked_sub(height)? / cell;
        let [across, down] = [across as i32, down as i32];
        Some(if self.transposed { LastStart([down, across]) } else { LastStart([across, down]) })
    }

    /// Returns where a copy at a cell of the lattice's frame stands on the area.
    fn placement(self, at: Shift, is_partner: bool, room: LastStart, cell: u32) -> CopyPlacement {
        let swapped = |[x, y]: Shift| if self.transposed { [y, x] } else { [x, y] };
        let ([x, y], [last, _]) = (swapped(at), swapped(room.0));
        // A quarter counterclockwise brings the right edge to the top.
        let [left, top] = if self.turned { [y, last - x] } else { [x, y] };
        let quarters = u32::from(self.turned) + if is_partner { 2 } else { 0 };
        let [left, top] = [left, top].map(|cells| cells as u32 * cell);
        CopyPlacement { part: self.stack, turn: Orientation::new(quarters, false), left, top }
    }
}

#[cfg(test)]
mod lattice_tests;
