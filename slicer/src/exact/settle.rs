//! Rows that facets miss, or cross too often, where contours turn.

use std::collections::HashMap;
use std::ops::{Range, RangeInclusive};

use super::extrema::Extremum;
use super::locate::RowContact;
use super::placed::PlacedSurfaces;
use super::polish::FacetPoint;
use super::saddle::Saddle;
use super::tally::Tally;
use crate::cut::{Crossing, Cutter};

/// A row near a turn.
#[derive(Default)]
struct Row {
    /// Its crossings on surfaces, as they were found.
    found: Vec<Crossing>,
    /// And as they are to be.
    exact: Vec<Crossing>,
    /// Those that were kept on facets.
    kept: Vec<Crossing>,
    /// Those found on one side of a turn.
    sides: Vec<Crossing>,
}

/// Returns what is to be added to a layer's crossings on surfaces: those that were
/// kept on facets, but for pairs that the surfaces do not make where contours turn,
/// and the pairs there that facets do not make.
pub(crate) fn settle(
    surfaces: &[&PlacedSurfaces],
    tally: &Tally,
    layer: usize,
    cutter: Cutter<'_>,
    crossings: impl Iterator<Item = Crossing>,
    kept: Vec<Crossing>,
) -> Vec<Crossing> {
    let z_mm = cutter.planes.z_um(layer) / 1000.0;
    let mut rows: HashMap<u32, Row> = HashMap::new();
    let mut places = Vec::new();
    for surfaces in surfaces {
        let extrema = surfaces.extrema(z_mm).into_iter();
        let saddles = &surfaces.critical_points().saddles;
        let near = extrema.map(|extremum| Near::extremum(extremum, cutter)).chain(
            saddles.iter().filter_map(|saddle| Near::saddle(saddle, surfaces, z_mm, cutter)),
        );
        for near in near {
            rows.extend(near.rows.clone().map(|row| (row, Row::default())));
            places.push((*surfaces, near));
        }
    }
    for crossing in kept {
        rows.entry(crossing.row() as u32).or_default().kept.push(crossing);
    }
    if rows.is_empty() {
        return Vec::new();
    }
    for crossing in crossings {
        if let Some(row) = rows.get_mut(&(crossing.row() as u32)) {
            row.found.push(crossing);
            row.exact.push(crossing);
        }
    }
    let most = (FOLD_MM / cutter.grid.dpi.pitch().mm()) as u32;
    rows.values_mut().for_each(|row| row.unfold(tally, most));
    for (surfaces, near) in places {
        near.settle(surfaces, tally, z_mm, cutter, &mut rows);
    }
    rows.values_mut().for_each(|row| row.join_sides(tally));
    // A map has no order; the table sorts.
    rows.into_values().flat_map(Row::rest).collect()
}

/// No longer than this are the folds that facets make along rows.
const FOLD_MM: f64 = 3.0;

impl Row {
    /// Takes folds away: where facets go along a row they may cross it to and fro,
    /// while the surface does so once. Then two crossings have become the same, and the
    /// one between them was kept.
    fn unfold(&mut self, tally: &Tally, most: u32) {
        let kept = std::mem::take(&mut self.kept);
        for crossing in kept {
            let there = &self.exact;
            let away = |k: &usize| there[*k].in_row().column().abs_diff(crossing.in_row().column());
            let is_double = |k: &usize| {
                let same = there.iter().filter(|other| is_same(there[*k], **other)).count();
                there[*k].in_row().winding() != crossing.in_row().winding() && same > 1
            };
            let near = (0..there.len()).filter(|k| away(k) <= most);
            match near.filter(is_double).min_by_key(away) {
                Some(double) => {
                    self.exact.swap_remove(double);
                    tally.mend(2, 1);
                }
                None => self.kept.push(crossing),
            }
        }
    }

    /// Adds the outer sides of two turns between which the contour turns back, so that
    /// neither has a pair of its own.
    fn join_sides(&mut self, tally: &Tally) {
        let mut sides: Vec<Crossing> = Vec::new();
        for side in std::mem::take(&mut self.sides) {
            if !self.exact.iter().chain(&sides).any(|other| is_same(side, *other)) {
                sides.push(side);
            }
        }
        if sides.len() == 2 && winding(&sides) == 0 && self.kept.is_empty() {
            self.exact.extend(sides);
            tally.mend(2, 0);
        }
    }

    /// What is to be added to the crossings that were found: one to be taken away is
    /// undone in its column, where there and back is nothing.
    fn rest(mut self) -> impl Iterator<Item = Crossing> {
        let mut undone = Vec::new();
        for crossing in self.found {
            match self.exact.iter().position(|other| *other == crossing) {
                Some(at) => drop(self.exact.swap_remove(at)),
                None => undone.push(crossing.reversed()),
            }
        }
        self.kept.into_iter().chain(self.exact).chain(undone)
    }
}

/// The rows about a place where facets may cross too many or too few of them.
struct Near {
    place: Place,
    /// The columns where facets may have crossings for those of the contour.
    columns: RangeInclusive<i64>,
    rows: Range<u32>,
}

enum Place {
    Extremum(Extremum),
    Saddle(Saddle),
}

impl Near {
    fn new(place: Place, at: [f64; 2], reach_mm: [f64; 2], cutter: Cutter<'_>) -> Self {
        let grid = cutter.grid;
        let [column, row] = grid.to_pixels(at[0], at[1]);
        let [reach, width] = reach_mm.map(|mm| mm / grid.dpi.pitch().mm() + 1.0);
        let clamped = |row: f64| row.ceil().clamp(0.0, f64::from(grid.height)) as u32;
        let columns = (column - width).floor() as i64..=(column + width).ceil() as i64;
        Self { place, columns, rows: clamped(row - reach)..clamped(row + reach) }
    }

    fn extremum(extremum: Extremum, cutter: Cutter<'_>) -> Self {
        let [x, y, _] = extremum.at_mm;
        let reach_mm = [extremum.reach_mm, extremum.width_mm()];
        Self::new(Place::Extremum(extremum), [x, y], reach_mm, cutter)
    }

    /// The rows about a saddle that is near the section.
    fn saddle(
        saddle: &Saddle,
        surfaces: &PlacedSurfaces,
        z_mm: f64,
        cutter: Cutter<'_>,
    ) -> Option<Self> {
        let [x, y, _] = saddle.at_mm;
        let reach_mm = saddle.reach_mm(surfaces, z_mm)?;
        Some(Self::new(Place::Saddle(*saddle), [x, y], reach_mm, cutter))
    }

    fn settle(
        &self,
        surfaces: &PlacedSurfaces,
        tally: &Tally,
        z_mm: f64,
        cutter: Cutter<'_>,
        rows: &mut HashMap<u32, Row>,
    ) {
        for number in self.rows.clone() {
            let row = rows.get_mut(&number).expect("rows near turns are in the map");
            let [_, y_mm] = cutter.grid.to_mm(0.0, f64::from(number));
            let contact = match &self.place {
                Place::Extremum(extremum) => extremum.contact(surfaces, y_mm),
                Place::Saddle(saddle) => saddle.contact(surfaces, y_mm, z_mm),
            };
            let at = |point: FacetPoint| {
                let [column, _] = cutter.grid.to_pixels(point.at_mm[0], y_mm);
                Crossing::at(cutter.grid, number, column, point.enters)
            };
            match contact {
                RowContact::Pair(pair) => self.put(tally, pair.map(at), row),
                RowContact::OneSide(point) => row.sides.push(at(point)),
                RowContact::Nothing => self.take(tally, row),
                RowContact::Unknown => {}
            }
        }
    }

    /// The crossings of a row that were kept on facets near the turn, or near a pair that
    /// the row has there.
    fn kept(&self, row: &Row, pair: &[Crossing]) -> Vec<Crossing> {
        let width = (self.columns.end() - self.columns.start()) / 2;
        let column = |crossing: &Crossing| i64::from(crossing.in_row().column());
        let is_near = |crossing: &&Crossing| {
            let at = column(crossing);
            self.columns.contains(&at) || pair.iter().any(|one| (column(one) - at).abs() <= width)
        };
        row.kept.iter().filter(is_near).copied().collect()
    }

    /// Takes the crossings of a row away that facets make where the surface has none.
    fn take(&self, tally: &Tally, row: &mut Row) {
        let kept = self.kept(row, &[]);
        if winding(&kept) == 0 {
            row.kept.retain(|crossing| !kept.contains(crossing));
            tally.mend(kept.len(), kept.len());
        }
    }

    /// Sees to it that a row has a pair of crossings near the turn, each once.
    fn put(&self, tally: &Tally, pair: [Crossing; 2], row: &mut Row) {
        let kept = self.kept(row, &pair);
        let is_one = |other: &Crossing| pair.iter().any(|crossing| is_same(*crossing, *other));
        let there: Vec<Crossing> =
            row.exact.iter().filter(|other| is_one(other)).copied().collect();
        let has_both = pair
            .iter()
            .all(|crossing| there.iter().filter(|other| is_same(*crossing, **other)).count() == 1);
        let is_settled = kept.is_empty() && has_both;
        if is_settled || winding(&kept) + winding(&there) != 0 {
            return;
        }
        row.kept.retain(|crossing| !kept.contains(crossing));
        row.exact.retain(|other| !is_one(other));
        row.exact.extend(pair);
        tally.mend(kept.len() + there.len().abs_diff(2), kept.len());
    }
}

fn winding(crossings: &[Crossing]) -> i32 {
    crossings.iter().map(|crossing| crossing.in_row().winding()).sum()
}

/// Whether two crossings are the same, found twice; which may round to two columns.
fn is_same(a: Crossing, b: Crossing) -> bool {
    let [a, b] = [a.in_row(), b.in_row()];
    a.winding() == b.winding() && a.column().abs_diff(b.column()) <= 1
}
