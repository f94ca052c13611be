//! Moves copies up and to the left, in finer cells, as long as there is room.

use super::super::super::{CopyPlacement, Layout};
use super::super::no_fit::NoFitRegions;
use super::board::PlacedCopy;
use super::ways::Ways;

/// Copies at fine cells.
struct Slide<'a> {
    layout: &'a Layout,
    ways: &'a Ways,
    regions: NoFitRegions,
    gap: u32,
    copies: Vec<PlacedCopy>,
}

/// Moves copies as close to the top and the left as possible, and returns their places.
pub(super) fn up(
    layout: &Layout,
    gap: u32,
    ways: &Ways,
    copies: &[PlacedCopy],
) -> Vec<CopyPlacement> {
    let regions = NoFitRegions::in_cells(layout, gap, ways.fine);
    let times = (ways.cell / ways.fine) as i32;
    let copies =
        copies.iter().map(|copy| PlacedCopy { at: copy.at.map(|cell| cell * times), ..*copy });
    let mut slide = Slide { layout, ways, regions, gap, copies: copies.collect() };
    slide.copies.sort_by_key(|copy| (copy.at[1], copy.at[0]));
    // Every step leads up, or left in its row, so the passes end.
    while slide.pass() {}
    let placement = |copy: &PlacedCopy| {
        let ((part, turn), [left, top]) =
            (ways.way(copy.way), copy.at.map(|cell| cell as u32 * ways.fine));
        CopyPlacement { part, turn, left, top }
    };
    slide.copies.iter().map(placement).collect()
}

impl Slide<'_> {
    /// Moves each copy as far as possible. Returns whether any moved.
    fn pass(&mut self) -> bool {
        let mut moved = false;
        for copy in 0..self.copies.len() {
            for [right, down] in [[0, -1], [-1, 0], [1, -1], [-1, -1]] {
                loop {
                    let [x, y] = self.copies[copy].at;
                    if !self.is_free(copy, [x + right, y + down]) {
                        break;
                    }
                    self.copies[copy].at = [x + right, y + down];
                    moved = true;
                }
            }
        }
        moved
    }

    fn is_free(&mut self, copy: usize, at: [i32; 2]) -> bool {
        let own = PlacedCopy { at, ..self.copies[copy] };
        let last = (self.layout.pixels().width - self.ways.size(own.way)[0]) / self.ways.fine;
        let is_on = at[1] >= 0 && (0..=last as i32).contains(&at[0]);
        is_on && (0..self.copies.len()).all(|other| other == copy || !self.meet(&own, other))
    }

    /// Whether two copies are too near, by the regions that the depths were found from.
    fn meet(&mut self, own: &PlacedCopy, other: usize) -> bool {
        let other = self.copies[other];
        let by = [0, 1].map(|axis| own.at[axis] - other.at[axis]);
        let [own_size, other_size] = [own.way, other.way].map(|way| {
            self.ways.size(way).map(|side| ((side + self.gap) / self.ways.fine + 2) as i32)
        });
        // Most pairs are far apart, which their boxes show; two cells more allow for rounding.
        if (0..2).any(|axis| by[axis] >= other_size[axis] || -by[axis] >= own_size[axis]) {
            return false;
        }
        let [one, two] = [own.way, other.way].map(|way| self.ways.way(way));
        let (layout, back) = (self.layout, by.map(|cells| -cells));
        // As in `Ways::new`: the lower way is the one that moves, and either of two equal ones.
        own.way <= other.way && self.regions.meet(layout, [one, two], by)
            || other.way <= own.way && self.regions.meet(layout, [two, one], back)
    }
}
