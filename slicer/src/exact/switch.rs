//! Changes the faces of a row's crossings next to curved edges.

use super::facet_point::FacetPoint;
use super::lens::{LensPoint, LensSide};
use super::placed::PlacedSurfaces;
use crate::crossing::Crossing;
use crate::cutter::Cutter;

/// Next to a curved edge, a crossing that one face gains, and its reverse that another face gains.
pub(super) struct Switch {
    sides: [SwitchSide; 2],
}

struct SwitchSide {
    face: u32,
    winding: i32,
    /// The crossing of the surface on the face, if there is one.
    gained: Option<Crossing>,
    /// The crossing of the surface beyond the face, if there is one.
    lost: Option<Crossing>,
    /// The columns around the facet.
    columns: [f64; 2],
}

impl Switch {
    pub(super) fn new(
        surfaces: &PlacedSurfaces,
        facets: [u32; 2],
        point: &LensPoint,
        cutter: Cutter<'_>,
    ) -> Self {
        let crossing = |found: FacetPoint| {
            let [column, _] = cutter.grid.to_pixels(found.at_mm[0], found.at_mm[1]);
            Crossing::at(cutter.grid, point.cell, column, found.enters)
        };
        let side = |k: usize| {
            let LensSide { winding, gained, lost } = point.sides[k];
            SwitchSide {
                face: surfaces.facet(facets[k]).face,
                winding,
                gained: gained.map(crossing),
                lost: lost.map(crossing),
                columns: columns_around(surfaces, facets[k], cutter),
            }
        };
        Self { sides: [side(0), side(1)] }
    }
}

/// Returns the columns of a facet, and the same number of columns on both sides.
fn columns_around(surfaces: &PlacedSurfaces, facet: u32, cutter: Cutter<'_>) -> [f64; 2] {
    let columns = surfaces.corners(facet).map(|[x, y, _]| cutter.grid.to_pixels(x, y)[0]);
    let low = columns.into_iter().fold(f64::MAX, f64::min);
    let high = columns.into_iter().fold(f64::MIN, f64::max);
    let more = (high - low).max(1.0);
    [low - more, high + more]
}

/// A row's crossings.
#[derive(Clone, Default)]
pub(super) struct RowCrossings {
    /// The crossings on surfaces.
    pub(super) exact: Vec<Crossing>,
    /// The crossings kept on facets.
    pub(super) kept: Vec<Crossing>,
    /// The crossings located on only one side of an extremum or a saddle.
    pub(super) sides: Vec<Crossing>,
}

impl RowCrossings {
    /// Makes a row's switches that are known on both sides, and leaves the others. Returns the
    /// number of switches made.
    pub(super) fn switch(&mut self, switches: &mut Vec<Switch>) -> usize {
        let mut left = Vec::new();
        loop {
            // On a copy: a switch that fails may take another one's crossing with it.
            let mut lists = self.clone();
            let unknown = lists.take(switches);
            if unknown.is_empty() {
                *self = lists;
                return std::mem::replace(switches, left).len();
            }
            // Both sides stay unchanged, or neither does.
            let is_unknown =
                |switch: &mut Switch| switch.sides.iter().any(|it| unknown.contains(&it.face));
            left.extend(switches.extract_if(.., is_unknown));
        }
    }

    /// Makes all switches. Returns the faces of the crossings that were not found.
    fn take(&mut self, switches: &[Switch]) -> Vec<u32> {
        let sides = || switches.iter().flat_map(|switch| &switch.sides);
        let is_new = |crossing: &Crossing| !self.exact.contains(crossing);
        let gained = |side: &SwitchSide| side.gained.filter(is_new).map(|it| (side.face, it));
        let mut gains: Vec<(u32, Crossing)> = sides().filter_map(gained).collect();
        let is_gained = |side: &SwitchSide| gained(side).is_some();
        let rest: Vec<&SwitchSide> = sides().filter(|side| !is_gained(side)).collect();
        let mut missing: Vec<(u32, i32)> = Vec::new();
        for side in rest {
            if self.remove(side, &mut gains) || self.add_side(side.winding) {
                continue;
            }
            // A surface along the row has no crossing: the gain at one edge cancels the loss at
            // another.
            let reverse = (side.face, -side.winding);
            match missing.iter().position(|other| *other == reverse) {
                Some(at) => drop(missing.swap_remove(at)),
                None => missing.push((side.face, side.winding)),
            }
        }
        self.exact.extend(gains.into_iter().map(|(_, crossing)| crossing));
        missing.into_iter().map(|(face, _)| face).collect()
    }

    /// Removes the crossing that a side loses: the crossing on its surface, which may be gained at
    /// another edge, or the nearest crossing kept on its facets. Returns whether there was one.
    fn remove(&mut self, side: &SwitchSide, gains: &mut Vec<(u32, Crossing)>) -> bool {
        if let Some(lost) = side.lost {
            if let Some(at) = self.exact.iter().position(|it| *it == lost) {
                self.exact.swap_remove(at);
                return true;
            }
            if let Some(at) = gains.iter().position(|it| *it == (side.face, lost)) {
                gains.swap_remove(at);
                return true;
            }
        }
        let [low, high] = side.columns;
        let column = |at: &usize| f64::from(self.kept[*at].in_row().column());
        let from_middle = |at: &usize| (2.0 * column(at) - low - high).abs();
        let near = (0..self.kept.len())
            .filter(|at| winds(self.kept[*at], -side.winding) && from_middle(at) <= high - low);
        let nearest = near.min_by(|a, b| from_middle(a).total_cmp(&from_middle(b)));
        nearest.map(|at| self.kept.swap_remove(at)).is_some()
    }

    /// Adds the other side of an extremum for which the facets have no crossing: the pair minus the
    /// crossing beyond the edge.
    fn add_side(&mut self, winding: i32) -> bool {
        let at = self.sides.iter().position(|side| winds(*side, winding));
        self.exact.extend(at.map(|at| self.sides.swap_remove(at)));
        at.is_some()
    }
}

fn winds(crossing: Crossing, winding: i32) -> bool {
    crossing.in_row().winding() == winding
}
