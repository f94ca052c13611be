//! Finds dense lattices.
//!
//! The first vector, and the way from a copy to its half turn, lead to the border of a no-fit
//! region, where copies touch. The second vector takes the least area of all vectors that leave
//! room. The densest lattices are then moved cell by cell.

use super::super::no_fit::{CellRun, NoFitRegion};
use super::motif::Motif;
use super::{CopyLattice, Shift};

/// The steps along a region's height in which places of the half turn, the first and the
/// second vector are tried.
const PARTNERS: i32 = 48;
const ALONGS: i32 = 32;
const ACROSSES: i32 = 96;
/// The number of lattices, upright and not, that are moved cell by cell.
const KEPT: usize = 16;

/// Returns dense lattices, the densest first.
pub(super) fn lattices(motif: &Motif) -> Vec<CopyLattice> {
    let partners = motif.turned().map(|region| border(region, PARTNERS)).unwrap_or_default();
    let mut found = Vec::new();
    for partner in std::iter::once(None).chain(partners.into_iter().map(Some)) {
        let region = motif.region(partner);
        let white = motif.white * if partner.is_some() { 2 } else { 1 };
        for along in alongs(&region) {
            let lattice = CopyLattice { along, across: [0, 0], partner };
            found.extend(with_across(&region, lattice, white, i32::MAX));
            if along[0] == 0 {
                found.extend(with_across(&region, lattice, white, 1));
            }
        }
    }
    found.sort_by_key(|lattice| (lattice.cells_of_two(), *lattice));
    found.dedup();
    // A slanted lattice may be denser and still fit the area worse, so some of each kind are kept.
    let kinds = [[true, true], [true, false], [false, false]];
    let of_kind = |kind| found.iter().filter(move |lattice| kind_of(lattice) == kind).take(KEPT);
    kinds.into_iter().flat_map(of_kind).copied().collect()
}

/// Whether the first vector is upright, and whether the second is level, too.
fn kind_of(lattice: &CopyLattice) -> [bool; 2] {
    let upright = lattice.along[0] == 0;
    [upright, upright && lattice.across[1] == 0]
}

/// Returns free places at the border of a region, in some rows and columns.
fn border(region: &NoFitRegion, steps: i32) -> Vec<Shift> {
    let [wide, high] = region.reach;
    let mut all = Vec::new();
    let step = (2 * high / steps).max(1);
    for y in (-high..=high).step_by(step as usize) {
        for &(from, to) in region.row(y) {
            all.extend([[from - 1, y], [to, y]]);
        }
    }
    for x in (-wide..=wide).step_by(step as usize) {
        for y in -high..=high + 1 {
            let (above, here) = (region.holds([x, y - 1]), region.holds([x, y]));
            if above != here {
                all.push(if here { [x, y - 1] } else { [x, y] });
            }
        }
    }
    all.sort_unstable();
    all.dedup();
    all
}

/// Returns steep vectors to the border of a region, and the shortest upright one that is free.
fn alongs(region: &NoFitRegion) -> Vec<Shift> {
    let mut all = border(region, ALONGS);
    all.retain(|[x, y]| *y > 0 && x.abs() <= *y);
    let [_, high] = region.reach;
    let upright = (1..=high + 1).map(|y| [0, y]);
    all.extend(upright.clone().find(|&along| is_row(region, along)));
    all.retain(|&along| is_row(region, along));
    all
}

/// Whether copies fit next to each other at all multiples of a vector.
fn is_row(region: &NoFitRegion, [x, y]: Shift) -> bool {
    let [_, high] = region.reach;
    (1..=high / y.max(1)).all(|k| !region.holds([k * x, k * y]))
}

/// Completes a lattice by the second vector that takes the least area, of the vectors that lead
/// less than `below` cells down.
fn with_across(
    region: &NoFitRegion,
    lattice: CopyLattice,
    white: i64,
    below: i32,
) -> Option<CopyLattice> {
    let [ux, uy] = lattice.along;
    let [_, high] = region.reach;
    let step = (2 * high / ACROSSES).max(1);
    let mut best: Option<(i64, CopyLattice)> = None;
    let mut runs: Vec<CellRun> = Vec::new();
    // Multiples of the first vector added to the second change nothing, so rows below `uy` are
    // enough.
    for y in (0..uy.min(below)).step_by(step as usize) {
        runs.clear();
        for k in (-high - y).div_euclid(uy)..=(high - y).div_euclid(uy) {
            let row = region.row(y + k * uy).iter();
            runs.extend(row.map(|&(from, to)| (from - k * ux, to - k * ux)));
        }
        runs.sort_unstable();
        let aside = i64::from(ux) * i64::from(y);
        // No lattice takes less area than its white cells: uy x - ux y >= white.
        let mut x = ((white + aside) / i64::from(uy)) as i32;
        for &(from, to) in &runs {
            if from > x {
                break;
            }
            x = x.max(to);
        }
        let lattice = CopyLattice { across: [x, y], ..lattice };
        let cells = i64::from(uy) * i64::from(x) - aside;
        if best.is_none_or(|(least, _)| cells < least)
            && lattice.is_clear([region.reach], |at| region.holds(at))
        {
            best = Some((cells, lattice));
        }
    }
    best.map(|(_, lattice)| lattice)
}

/// Returns a lattice moved closer: as dense as it gets and, if it is of rectangles, once more as
/// near to squares, as the area holds a whole number of either side.
pub(super) fn closer_ways(motif: &Motif, lattice: CopyLattice) -> Vec<CopyLattice> {
    let mut ways = vec![closer(motif, lattice, CopyLattice::cells_of_two)];
    if kind_of(&lattice) == [true, true] {
        let squares = |side: i32| i64::from(side) * i64::from(side);
        ways.push(closer(motif, lattice, |at| squares(at.along[1]) + squares(at.across[0])));
    }
    ways
}

/// Moves the vectors of a lattice, and its half turn, as long as its cost shrinks.
fn closer(
    motif: &Motif,
    mut lattice: CopyLattice,
    cost: impl Fn(&CopyLattice) -> i64,
) -> CopyLattice {
    let moves = moves(kind_of(&lattice), lattice.partner.is_some());
    let mut by = (lattice.along[1] / 32).max(1);
    loop {
        let most = cost(&lattice);
        let cheaper = moves
            .iter()
            .map(|change| lattice.moved(change, by))
            .find(|moved| cost(moved) < most && motif.allows(moved));
        // A cost is a whole number and falls with each move, so this ends.
        match cheaper {
            Some(cheaper) => lattice = cheaper,
            None if by == 1 => return lattice,
            None => by /= 2,
        }
    }
}

/// Returns changes of up to three coordinates by one: of the first vector, the second and the way
/// to the half turn.
fn moves([upright, level]: [bool; 2], pair: bool) -> Vec<[i32; 6]> {
    let is_fixed = |k: &usize| (*k == 0 && upright) || (*k == 3 && level);
    let coordinates: Vec<usize> = (0..if pair { 6 } else { 4 }).filter(|k| !is_fixed(k)).collect();
    let mut all: Vec<[i32; 6]> = vec![[0; 6]];
    for changed in 1..=3 {
        let fewer: Vec<[i32; 6]> = all.clone();
        for change in fewer {
            if change.iter().filter(|by| **by != 0).count() + 1 != changed {
                continue;
            }
            let last = change.iter().rposition(|by| *by != 0);
            for &k in coordinates.iter().filter(|k| last.is_none_or(|last| **k > last)) {
                for by in [-1, 1] {
                    let mut more = change;
                    more[k] = by;
                    all.push(more);
                }
            }
        }
    }
    all
}

impl CopyLattice {
    fn moved(&self, change: &[i32; 6], by: i32) -> Self {
        let moved = |[x, y]: Shift, k: usize| [x + by * change[k], y + by * change[k + 1]];
        Self {
            along: moved(self.along, 0),
            across: moved(self.across, 2),
            partner: self.partner.map(|partner| moved(partner, 4)),
        }
    }
}
