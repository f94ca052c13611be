//! Correction of a band from the contours that cross it.
//!
//! Source: 002 section 2.4.1 and figure 29c.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ops::Range;

use lamp_stack::{Image, Mask};

use super::contours::{BandContours, ExpectedCrossing, LineId, Outlook};
use super::mend::{DROP, DROP_ENDED, Mended, mend};

/// The corrected rows of a band; the default corrects nothing.
#[derive(Debug, Default)]
pub(super) struct Correction {
    /// The transitions of each row.
    pub(super) rows: Vec<Vec<u32>>,
    /// The columns in which crossings were added.
    pub(super) gap: Option<Range<u32>>,
    /// The confidence in the least certain row, from 0 to 1.
    pub(super) confidence: f64,
    /// Whether neighboring rows lack different contours.
    pub(super) touching: bool,
    /// The confidence in each row. Empty if other layers show none of them.
    pub(super) by_row: Vec<f64>,
}

/// Rebuilds the rows of a band. Returns `None` if no good row is next to it.
///
/// Crossings near a contour's curve stay as they are, and the curve is then led through them;
/// only missed crossings come from the curve.
///
/// Between two rows of `open_rows`, where contours break off, all rows miss the same contours. So
/// no row misses a line that one of these rows crosses: where another row does not cross it, the
/// part itself has a slit or a wall.
pub(super) fn rebuild(
    mask: &Mask,
    band: &Range<u32>,
    is_good: impl Fn(u32) -> bool,
    is_ended: impl Fn(u32) -> bool,
    open_rows: Option<&[u32]>,
    neighbours: Option<[&Image; 2]>,
) -> Option<Correction> {
    let mut contours = BandContours::around(mask, band.clone(), is_good)?;
    let stretch = |row: u32| open_rows.map(|open| open.partition_point(|&open| open <= row));
    let mut crossed: BTreeSet<(usize, LineId)> = BTreeSet::new();
    let mend_row = |contours: &BandContours, crossed: &BTreeSet<_>, row: u32| {
        let mut outlook = contours.outlook(row);
        for crossing in &mut outlook.crossings {
            let is_crossed = |stretch| crossed.contains(&(stretch, crossing.side));
            crossing.may_be_missed = !stretch(row).is_some_and(is_crossed);
        }
        if let Some(neighbours) = neighbours {
            adjust(&mut outlook, &neighbours.map(|image| image.exposed_row(row)));
        }
        let drop = if is_ended(row) { DROP_ENDED } else { DROP };
        mend(mask.row(row), &outlook, mask.width(), drop)
    };
    // A first pass finds the crossings that rows have; with these known, the curves of the
    // second are better.
    let first: Vec<Mended> = band.clone().map(|row| mend_row(&contours, &crossed, row)).collect();
    for (row, mended) in band.clone().zip(first) {
        for (side, column) in mended.found {
            contours.found(side, row, column);
            crossed.extend(stretch(row).map(|stretch| (stretch, side)));
        }
    }
    contours.guess();
    let mended: Vec<Mended> = band.clone().map(|row| mend_row(&contours, &crossed, row)).collect();
    let rows = mended.iter().zip(band.clone());
    let least = rows
        .map(|(mended, row)| confidence(mended, mask.row(row), mask.width(), is_ended(row)))
        .fold(1.0, f64::min);
    let at_edge = band.start == 0 || band.end == mask.height();
    // One or two good rows between bands hardly show where a contour is going.
    let beside = (contours.good_rows + 1).min(4) as f64 / 4.0;
    Some(Correction {
        gap: columns_of(mended.iter().flat_map(|mended| &mended.added), mask.width()),
        confidence: least * beside * if at_edge { 0.8 } else { 1.0 },
        by_row: Vec::new(),
        touching: mended.windows(2).any(|rows| lack_others(&rows[0], &rows[1])),
        rows: mended.into_iter().map(|mended| mended.row).collect(),
    })
}

/// Returns the columns from the first to the last added crossing.
fn columns_of<'a>(
    added: impl Iterator<Item = &'a ExpectedCrossing>,
    width: u32,
) -> Option<Range<u32>> {
    let column = |at: f64| at.round().clamp(0.0, f64::from(width - 1)) as u32;
    added
        .map(|crossing| column(crossing.column)..column(crossing.column) + 1)
        .reduce(|a, b| a.start.min(b.start)..a.end.max(b.end))
}

/// Returns whether two rows each lack contours, but none in common.
fn lack_others(a: &Mended, b: &Mended) -> bool {
    let [a, b] = [a, b].map(|mended| -> BTreeSet<LineId> {
        mended.added.iter().map(|added| added.side).collect()
    });
    !a.is_empty() && !b.is_empty() && a.is_disjoint(&b)
}

/// Returns the confidence in a row, from 0 to 1.
///
/// It falls if an added crossing may lie further off than the next one (the worst counts), if
/// more was changed than one gap explains, and if the row still differs from what was expected.
fn confidence(mended: &Mended, had: &[u32], width: u32, is_ended: bool) -> f64 {
    /// Pixels of room next to an added crossing that are always granted.
    const MIN_ROOM: f64 = 8.0;
    let placed = mended.added.iter().map(|added| {
        let left = mended.row.partition_point(|&c| f64::from(c) < added.column - 1.0);
        let right = mended.row.partition_point(|&c| f64::from(c) <= added.column + 1.0);
        let others = [left.checked_sub(1), Some(right)].into_iter().flatten();
        let distance = |&column: &u32| (f64::from(column) - added.column).abs();
        let room = others.filter_map(|which| mended.row.get(which).map(distance));
        let room = room.fold(f64::from(width), f64::min).max(MIN_ROOM);
        room / (room + added.slack)
    });
    let (added, dropped) = (mended.added.len(), mended.dropped);
    let (more, dropped) = match is_ended {
        // On a build, each copy of the part has one crossing added and one dropped.
        true => (added.abs_diff(dropped), 0),
        false => ((added + dropped).saturating_sub(2 - had.len() % 2), dropped),
    };
    let explained = f64::from(mended.gain) / f64::from(mended.gain + mended.off).max(1.0);
    let explained = if mended.off == 0 { 1.0 } else { explained };
    let edits = 0.9f64.powi(more as i32) * 0.3f64.powi(dropped as i32);
    placed.fold(1.0, f64::min) * edits * 0.8f64.powi(mended.absent as i32) * explained
}

/// Moves each expected crossing between the crossings of the layers below and above, if both have
/// one near it.
fn adjust(outlook: &mut Outlook, rows: &[Cow<'_, [u32]>; 2]) {
    // A row that ends white is stray itself and shows nothing.
    if rows.iter().any(|row| !row.len().is_multiple_of(2)) {
        return;
    }
    for crossing in &mut outlook.crossings {
        let reach = 4.0 + 2.0 * crossing.slack;
        let near = |row: &[u32]| {
            let at = row.partition_point(|&column| f64::from(column) < crossing.column);
            row[at.saturating_sub(1)..row.len().min(at + 1)]
                .iter()
                .map(|&column| f64::from(column))
                .filter(|column| (column - crossing.column).abs() <= reach)
                .min_by(|a, b| (a - crossing.column).abs().total_cmp(&(b - crossing.column).abs()))
        };
        if let (Some(below), Some(above)) = (near(&rows[0]), near(&rows[1])) {
            let (low, high) = (below.min(above), below.max(above));
            crossing.column = crossing.column.clamp(low, high);
            crossing.slack = crossing.slack.min(0.5 + 0.5 * (high - low));
        }
    }
    outlook.crossings.sort_by(|a, b| a.column.total_cmp(&b.column));
}
