//! Repairs rows near extrema and saddles, where facets miss crossings or have surplus crossings.
//!
//! There are three repairs. Each adds or removes crossings whose windings sum to zero, so a
//! balanced row stays balanced. Added crossings are on the surface. Removed crossings were found
//! twice or were kept on their facet; they are at most as far from the contour as the facets, so a
//! wrong guess leaves the row no worse than with facets alone.

use std::collections::HashMap;
use std::ops::{Range, RangeInclusive};

use super::critical::Saddle;
use super::extrema::Extremum;
use super::facet_point::{FacetPoint, RowContact};
use super::lens::LensPlane;
use super::placed::PlacedSurfaces;
use super::switch::{RowCrossings, Switch};
use super::tally::SolverTally;
use crate::crossing::Crossing;
use crate::cutter::Cutter;

/// A row near an extremum or a saddle, or with crossings that were kept on facets.
#[derive(Default)]
struct UnsettledRow {
    /// The crossings on surfaces, as polishing found them.
    found: Vec<Crossing>,
    /// The row's crossings, as repaired.
    lists: RowCrossings,
    /// Pending changes next to curved edges.
    switches: Vec<Switch>,
}

/// The rows to settle, by body and number.
type UnsettledRows = HashMap<(u32, u32), UnsettledRow>;

/// Returns the crossings to add to a layer's crossings on surfaces.
///
/// These are the crossings `kept` on facets, except pairs near extrema and saddles that the
/// surfaces do not have; the surfaces' pairs there that facets miss; and the reverses of surplus
/// crossings on surfaces. Each body is settled by itself.
pub(crate) fn settle(
    surfaces: &[PlacedSurfaces],
    tally: &SolverTally,
    layer: usize,
    cutter: Cutter<'_>,
    crossings: impl Iterator<Item = (u32, Crossing)>,
    kept: impl Iterator<Item = (u32, Crossing)>,
) -> Vec<(u32, Crossing)> {
    let mut rows = UnsettledRows::new();
    let mut all_near = Vec::new();
    for planes in cutter.planes.each_at(layer) {
        let z_mm = planes.z_um(layer) / 1000.0;
        let plane = LensPlane::of_layer(cutter.grid, planes, layer);
        // Bodies with planes of their own are cut at another height.
        let is_cut = |body: u32| cutter.planes.of_body(body).z_um(layer) == planes.z_um(layer);
        for surfaces in surfaces {
            for edge in &surfaces.curved_edges().all {
                let body = surfaces.body_of(edge.facets[0]);
                for point in plane.lens(surfaces, edge).iter().filter(|_| is_cut(body)) {
                    let key = (cutter.rule.name_of(body), point.cell);
                    let switch = Switch::new(surfaces, edge.facets, point, cutter);
                    rows.entry(key).or_default().switches.push(switch);
                }
            }
            let extrema = surfaces.extrema(z_mm).into_iter();
            let extrema = extrema.filter(|extremum| is_cut(extremum.body(surfaces)));
            let extrema = extrema.map(|extremum| Near::extremum(extremum, surfaces, cutter));
            let saddles = surfaces.critical_points().saddles.iter();
            let saddles = saddles.filter(|saddle| is_cut(saddle.body(surfaces)));
            let saddles = saddles.filter_map(|saddle| Near::saddle(saddle, surfaces, z_mm, cutter));
            for near in extrema.chain(saddles) {
                for row in near.rows.clone() {
                    rows.entry((near.body, row)).or_default();
                }
                all_near.push((surfaces, near, z_mm));
            }
        }
    }
    for (body, crossing) in kept {
        rows.entry((body, crossing.row() as u32)).or_default().lists.kept.push(crossing);
    }
    if rows.is_empty() {
        return Vec::new();
    }
    for (body, crossing) in crossings {
        // Most rows have nothing to settle, and need no list.
        if let Some(row) = rows.get_mut(&(body, crossing.row() as u32)) {
            row.found.push(crossing);
            row.lists.exact.push(crossing);
        }
    }
    let max_columns = (MAX_FOLD_MM / cutter.grid.pitch.x.pitch().mm()) as u32;
    for row in rows.values_mut() {
        row.unfold(tally, max_columns);
        row.switch(tally);
    }
    for (surfaces, near, z_mm) in all_near {
        near.settle(surfaces, tally, z_mm, cutter, &mut rows);
    }
    // Settling has noted the sides for which some switches wait.
    for row in rows.values_mut() {
        row.switch(tally);
        row.add_sides(tally);
    }
    // A map is unordered, but the table sorts.
    let changes = |((body, _), row): ((u32, u32), UnsettledRow)| {
        row.changes().map(move |crossing| (body, crossing))
    };
    rows.into_iter().flat_map(changes).collect()
}

/// The greatest length of a fold along its row, in millimeters.
///
/// A fold is as long as the two or three facets that make it. Facets are long only where
/// the surface is straight, which has no folds. The limit bounds the damage where two
/// touching contours look like a fold.
const MAX_FOLD_MM: f64 = 3.0;

impl UnsettledRow {
    /// Removes folds: facets nearly along a row may cross it forward, back and forward
    /// again, where the surface crosses it once.
    ///
    /// Polishing moves both forward crossings to the same point of the surface, and finds no point
    /// for the crossing back, because the surface faces the other way. So a fold is a kept crossing
    /// next to two equal crossings of the other winding. Removing it and one of the two leaves the
    /// surface's crossing. Otherwise even-odd filling would cancel the two and leave the kept one,
    /// which is off by the fold.
    ///
    /// Two contours of a body that touch within a column, next to a kept crossing of a third
    /// contour, look the same. Then the third contour moves by at most the fold.
    fn unfold(&mut self, tally: &SolverTally, max_columns: u32) {
        let kept = std::mem::take(&mut self.lists.kept);
        for crossing in kept {
            let there = &self.lists.exact;
            let away = |k: &usize| there[*k].in_row().column().abs_diff(crossing.in_row().column());
            let is_double = |k: &usize| {
                let same = there.iter().filter(|other| is_same(there[*k], **other)).count();
                there[*k].in_row().winding() != crossing.in_row().winding() && same > 1
            };
            let near = (0..there.len()).filter(|k| away(k) <= max_columns);
            match near.filter(is_double).min_by_key(away) {
                Some(double) => {
                    self.lists.exact.swap_remove(double);
                    tally.mend(2, 1);
                }
                None => self.lists.kept.push(crossing),
            }
        }
    }

    /// Changes the faces of crossings next to curved edges, where both faces are known.
    fn switch(&mut self, tally: &SolverTally) {
        if self.switches.is_empty() {
            return;
        }
        let before = self.lists.kept.len();
        let made = self.lists.switch(&mut self.switches);
        tally.mend(2 * made, before - self.lists.kept.len());
    }

    /// Adds the outer sides of two extrema between which the contour turns back, so that neither
    /// extremum has a pair of its own.
    ///
    /// Both are crossings of the row with the surface that no facet has, and they balance, so the
    /// part is between them. With another number of sides, or a kept crossing that may represent a
    /// side, the pairing is ambiguous and no sides are added.
    fn add_sides(&mut self, tally: &SolverTally) {
        let mut sides: Vec<Crossing> = Vec::new();
        for side in std::mem::take(&mut self.lists.sides) {
            if !self.lists.exact.iter().chain(&sides).any(|other| is_same(side, *other)) {
                sides.push(side);
            }
        }
        if sides.len() == 2 && winding(&sides) == 0 && self.lists.kept.is_empty() {
            self.lists.exact.extend(sides);
            tally.mend(2, 0);
        }
    }

    /// Returns the crossings to add to the found crossings. A surplus crossing is canceled by its
    /// reverse in the same column.
    fn changes(mut self) -> impl Iterator<Item = Crossing> {
        // The table has the found crossings already, so only differences are returned.
        let mut cancelled = Vec::new();
        for crossing in self.found {
            match self.lists.exact.iter().position(|other| *other == crossing) {
                Some(at) => drop(self.lists.exact.swap_remove(at)),
                None => cancelled.push(crossing.reversed()),
            }
        }
        self.lists.kept.into_iter().chain(self.lists.exact).chain(cancelled)
    }
}

/// An extremum or a saddle, and the pixels around it where facets may cross too many or too few
/// rows.
struct Near {
    point: CriticalPoint,
    body: u32,
    /// The columns where facets may have crossings instead of the contour's.
    columns: RangeInclusive<i64>,
    rows: Range<u32>,
}

enum CriticalPoint {
    Extremum(Extremum),
    Saddle(Saddle),
}

impl Near {
    fn new(
        point: CriticalPoint,
        body: u32,
        at: [f64; 3],
        reach_mm: [f64; 2],
        cutter: Cutter<'_>,
    ) -> Self {
        let grid = cutter.grid;
        let [column, row] = grid.to_pixels(at[0], at[1]);
        // Along y, and along x.
        let [reach_mm, width_mm] = reach_mm;
        let [x_mm, y_mm] = grid.pitch.mm();
        let [reach, width] = [reach_mm / y_mm + 1.0, width_mm / x_mm + 1.0];
        let clamped = |row: f64| row.ceil().clamp(0.0, f64::from(grid.height)) as u32;
        let columns = (column - width).floor() as i64..=(column + width).ceil() as i64;
        let body = cutter.rule.name_of(body);
        Self { point, body, columns, rows: clamped(row - reach)..clamped(row + reach) }
    }

    fn extremum(extremum: Extremum, surfaces: &PlacedSurfaces, cutter: Cutter<'_>) -> Self {
        let reach_mm = [extremum.reach_mm, extremum.width_mm()];
        let (at_mm, body) = (extremum.at_mm, extremum.body(surfaces));
        Self::new(CriticalPoint::Extremum(extremum), body, at_mm, reach_mm, cutter)
    }

    /// Returns the surroundings of a saddle, or `None` if it is too far from the section.
    fn saddle(
        saddle: &Saddle,
        surfaces: &PlacedSurfaces,
        z_mm: f64,
        cutter: Cutter<'_>,
    ) -> Option<Self> {
        let reach_mm = saddle.reach_mm(surfaces, z_mm)?;
        let (at_mm, body) = (saddle.at_mm, saddle.body(surfaces));
        Some(Self::new(CriticalPoint::Saddle(*saddle), body, at_mm, reach_mm, cutter))
    }

    fn settle(
        &self,
        surfaces: &PlacedSurfaces,
        tally: &SolverTally,
        z_mm: f64,
        cutter: Cutter<'_>,
        rows: &mut UnsettledRows,
    ) {
        for number in self.rows.clone() {
            let row =
                rows.get_mut(&(self.body, number)).expect("the map has all rows near the point");
            let [_, y_mm] = cutter.grid.to_mm(0.0, f64::from(number));
            let contact = match &self.point {
                CriticalPoint::Extremum(extremum) => extremum.contact(surfaces, y_mm),
                CriticalPoint::Saddle(saddle) => saddle.contact(surfaces, y_mm, z_mm),
            };
            let crossing = |point: FacetPoint| {
                let [column, _] = cutter.grid.to_pixels(point.at_mm[0], y_mm);
                Crossing::at(cutter.grid, number, column, point.enters)
            };
            match contact {
                RowContact::Pair(pair) => self.set_pair(tally, pair.map(crossing), row),
                RowContact::OneSide(point) => self.set_side(tally, crossing(point), row),
                RowContact::Nothing => self.remove_kept(tally, row),
                RowContact::Unknown => {}
            }
        }
    }

    /// Returns a row's kept crossings near the point, or near the row's pair there.
    fn kept(&self, row: &UnsettledRow, pair: &[Crossing]) -> Vec<Crossing> {
        let width = (self.columns.end() - self.columns.start()) / 2;
        let column = |crossing: &Crossing| i64::from(crossing.in_row().column());
        let is_near = |crossing: &&Crossing| {
            let at = column(crossing);
            self.columns.contains(&at) || pair.iter().any(|one| (column(one) - at).abs() <= width)
        };
        row.lists.kept.iter().filter(is_near).copied().collect()
    }

    /// Removes a row's crossings on facets where the surface has none.
    fn remove_kept(&self, tally: &SolverTally, row: &mut UnsettledRow) {
        let kept = self.kept(row, &[]);
        if winding(&kept) == 0 {
            row.lists.kept.retain(|crossing| !kept.contains(crossing));
            tally.mend(kept.len(), kept.len());
        }
    }

    /// Moves the crossing kept on a facet near the point to the surface's only crossing there. If
    /// there is no kept crossing, notes the surface's crossing.
    fn set_side(&self, tally: &SolverTally, side: Crossing, row: &mut UnsettledRow) {
        let kept = self.kept(row, &[side]);
        let is_there = row.lists.exact.iter().any(|other| is_same(side, *other));
        // With another number of kept crossings, none of them is sure to be this one.
        if is_there || kept.len() != 1 || winding(&kept) != side.in_row().winding() {
            row.lists.sides.push(side);
            return;
        }
        row.lists.kept.retain(|crossing| *crossing != kept[0]);
        row.lists.exact.push(side);
        tally.mend(1, 1);
    }

    /// Gives a row the surface's pair of crossings near the point, each once.
    fn set_pair(&self, tally: &SolverTally, pair: [Crossing; 2], row: &mut UnsettledRow) {
        let kept = self.kept(row, &pair);
        let is_one = |other: &Crossing| pair.iter().any(|crossing| is_same(*crossing, *other));
        let there: Vec<Crossing> =
            row.lists.exact.iter().filter(|other| is_one(other)).copied().collect();
        let has_both = pair
            .iter()
            .all(|crossing| there.iter().filter(|other| is_same(*crossing, **other)).count() == 1);
        // The pair's windings sum to zero, so the crossings that it replaces must do so too.
        let is_settled = kept.is_empty() && has_both;
        if is_settled || winding(&kept) + winding(&there) != 0 {
            return;
        }
        row.lists.kept.retain(|crossing| !kept.contains(crossing));
        row.lists.exact.retain(|other| !is_one(other));
        row.lists.exact.extend(pair);
        tally.mend(kept.len() + there.len().abs_diff(2), kept.len());
    }
}

fn winding(crossings: &[Crossing]) -> i32 {
    crossings.iter().map(|crossing| crossing.in_row().winding()).sum()
}

/// Returns whether two crossings are the same crossing found twice: rounding may put it in either
/// of two columns.
pub(super) fn is_same(a: Crossing, b: Crossing) -> bool {
    let [a, b] = [a.in_row(), b.in_row()];
    a.winding() == b.winding() && a.column().abs_diff(b.column()) <= 1
}
