//! Rows that facets miss, or cross too often, where contours turn.

use std::collections::HashMap;
use std::ops::{Range, RangeInclusive};

use lamp_brep::Turn;

use super::{Exact, Tally};
use crate::cut::{Crossing, Cutter};

/// A row near a turn.
#[derive(Default)]
struct Row {
    /// Its crossings on surfaces.
    exact: Vec<Crossing>,
    /// Those that were kept on facets.
    kept: Vec<Crossing>,
    /// Those that are to be added.
    added: Vec<Crossing>,
}

/// Returns what is to be added to a layer's crossings on surfaces: those that were
/// kept on facets, but for pairs that the surfaces do not make where contours turn,
/// and the pairs there that facets do not make.
pub(crate) fn settle(
    surfaces: &[&Exact],
    tally: &Tally,
    layer: usize,
    cutter: Cutter<'_>,
    crossings: impl Iterator<Item = Crossing>,
    kept: Vec<Crossing>,
) -> Vec<Crossing> {
    let z_mm = cutter.planes.z_um(layer) / 1000.0;
    let mut rows: HashMap<u32, Row> = HashMap::new();
    let mut turns = Vec::new();
    for exact in surfaces {
        for turn in exact.turns().at(&exact.placed, z_mm) {
            let near = Near::new(&turn, cutter);
            for row in near.inside.clone().chain(near.beyond.clone()) {
                rows.entry(row).or_default();
            }
            turns.push((*exact, turn, near));
        }
    }
    if rows.is_empty() {
        return kept;
    }
    let mut rest = Vec::new();
    for crossing in kept {
        match rows.get_mut(&(crossing.row() as u32)) {
            Some(row) => row.kept.push(crossing),
            None => rest.push(crossing),
        }
    }
    for crossing in crossings {
        if let Some(row) = rows.get_mut(&(crossing.row() as u32)) {
            row.exact.push(crossing);
        }
    }
    for (exact, turn, near) in turns {
        near.settle(exact, tally, &turn, cutter, &mut rows);
    }
    // A map has no order; the table sorts.
    rest.extend(rows.into_values().flat_map(|row| row.kept.into_iter().chain(row.added)));
    rest
}

/// The rows about a turn.
struct Near {
    /// The columns where facets may have crossings for those of the contour.
    columns: RangeInclusive<i64>,
    /// Rows that cross the contour, those next to the turn first or last.
    inside: Range<u32>,
    /// Rows that do not, although facets may cross them.
    beyond: Range<u32>,
    /// Whether the contour goes down from the turn, to rows that come later.
    down: bool,
}

impl Near {
    fn new(turn: &Turn, cutter: Cutter<'_>) -> Self {
        let grid = cutter.grid;
        let [x, y, _] = turn.at_mm;
        let [column, row] = grid.to_pixels(x, y);
        let reach = turn.reach_mm / grid.dpi.pitch().mm();
        let clamped = |row: f64| row.ceil().clamp(0.0, f64::from(grid.height)) as u32;
        let [above, at, below] = [row - reach, row, row + reach].map(clamped);
        let down = turn.leaves < 0.0;
        let (inside, beyond) = if down { (at..below, above..at) } else { (above..at, at..below) };
        let width = turn.width_mm() / grid.dpi.pitch().mm() + 1.0;
        let columns = (column - width).floor() as i64..=(column + width).ceil() as i64;
        Self { columns, inside, beyond, down }
    }

    fn settle(
        &self,
        exact: &Exact,
        tally: &Tally,
        turn: &Turn,
        cutter: Cutter<'_>,
        rows: &mut HashMap<u32, Row>,
    ) {
        for row in self.beyond.clone() {
            let row = rows.get_mut(&row).expect("rows near turns are in the map");
            self.take(tally, row);
        }
        let mut inside = self.inside.clone();
        while let Some(number) = if self.down { inside.next() } else { inside.next_back() } {
            let row = rows.get_mut(&number).expect("rows near turns are in the map");
            let Some(pair) = pair(exact, turn, cutter, number) else { return };
            self.put(tally, pair, row);
        }
    }

    /// The crossings of a row that were kept on facets near the turn.
    fn kept(&self, row: &Row) -> Vec<Crossing> {
        let is_near =
            |crossing: &&Crossing| self.columns.contains(&i64::from(crossing.place().column()));
        row.kept.iter().filter(is_near).copied().collect()
    }

    /// Takes the crossings of a row away that facets make beyond the turn.
    fn take(&self, tally: &Tally, row: &mut Row) {
        let kept = self.kept(row);
        if winding(&kept) == 0 {
            row.kept.retain(|crossing| !kept.contains(crossing));
            tally.mend(kept.len(), kept.len());
        }
    }

    /// Sees to it that a row has a pair of crossings near the turn, each once.
    fn put(&self, tally: &Tally, pair: [Crossing; 2], row: &mut Row) {
        let kept = self.kept(row);
        let there = pair.map(|crossing| {
            let others = row.exact.iter().chain(&row.added).copied();
            others.filter(|other| is_same(crossing, *other)).collect::<Vec<_>>()
        });
        if winding(&kept) + there.iter().map(|there| winding(there)).sum::<i32>() != 0 {
            return;
        }
        let before = row.added.len();
        row.kept.retain(|crossing| !kept.contains(crossing));
        for (crossing, there) in pair.into_iter().zip(there) {
            match &there[..] {
                [] => row.added.push(crossing),
                // In one column there and back is nothing.
                [_, again @ ..] => row.added.extend(again.iter().map(|it| it.reversed())),
            }
        }
        tally.mend(row.added.len() - before, kept.len());
    }
}

fn winding(crossings: &[Crossing]) -> i32 {
    crossings.iter().map(|crossing| crossing.place().winding()).sum()
}

/// Whether two crossings are the same, found twice; which may round to two columns.
fn is_same(a: Crossing, b: Crossing) -> bool {
    let [a, b] = [a.place(), b.place()];
    a.winding() == b.winding() && a.column().abs_diff(b.column()) <= 1
}

/// The crossings of a row with the contour on both sides of a turn, if they are
/// in the image.
fn pair(exact: &Exact, turn: &Turn, cutter: Cutter<'_>, row: u32) -> Option<[Crossing; 2]> {
    let [_, y_mm] = cutter.grid.to_mm(0.0, f64::from(row));
    let [a, b] = exact.turns().pair(&exact.placed, turn, y_mm)?;
    let placed = |crossing: lamp_brep::Crossing| {
        let [column, _] = cutter.grid.to_pixels(crossing.x_mm, y_mm);
        Crossing::at(cutter.grid, row, column, crossing.enters)
    };
    Some([placed(a), placed(b)])
}
