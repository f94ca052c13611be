//! Finds the crossings that a row misses in the layers below and above.
//!
//! A gap in a mesh spoils the same rows of many layers, but each of these rows is whole in some
//! layer below and in some layer above. Between these two the contours run on nearly straight, so
//! they show which crossings the row should have, and where, whatever its neighbors look like.

use std::ops::Range;

use lamp_stack::{Layer, Mask};

use super::contours::DEPTH;
use super::rebuild::Correction;

/// The most crossings that a row misses.
const MAX_MISSING: usize = 8;
/// How far, in pixels, a crossing may lie from where the layers show it: columns are rounded.
const NEAR: f64 = 1.5;
/// How far, in pixels, contours may move from layer to layer.
const DRIFT: f64 = 8.0;
/// The ratio by which a missing crossing may be further off than the present ones.
const BEND: f64 = 2.5;
/// Pixels of room next to a missing crossing that are always granted.
const MIN_ROOM: f64 = 8.0;
/// The confidence in a row that lies between two alike ones.
const BETWEEN: f64 = 0.95;
/// The confidence in a row that only one layer shows, or that two show differently.
const BY_ONE: f64 = 0.7;

/// A layer between others.
#[derive(Clone, Copy)]
pub(super) struct Beside<'a> {
    pub(super) mask: &'a Mask,
    /// The layers below and above, the nearest first.
    pub(super) sides: &'a [Vec<&'a Layer>; 2],
}

/// The crossings that a row misses.
#[derive(Clone, Debug)]
pub(super) struct MissedCrossings {
    /// The least and the greatest column that what layers show allows, and the likeliest.
    pub(super) missing: Vec<[f64; 3]>,
    pub(super) confidence: f64,
}

/// A whole row of another layer: its distance in layers, its crossings, and which of them the row
/// has, too.
struct Whole {
    away: usize,
    columns: Vec<f64>,
    partners: Vec<usize>,
}

impl Beside<'_> {
    /// Returns which crossings a row of a band misses. `None` if the other layers do not show it.
    pub(super) fn show(&self, row: u32, band: &Range<u32>) -> Option<MissedCrossings> {
        let mine: Vec<f64> = self.mask.row(row).iter().map(|&column| column.into()).collect();
        // A layer that has more crossings may have features that this one has not, so they count
        // only if layers on both sides have them and none has fewer.
        let sides = |most| self.sides.each_ref().map(|side| whole(side, row, &mine, band, most));
        let few = sides(2 - mine.len() % 2);
        let alike = |sides: &[Option<Whole>; 2]| match sides {
            [Some(below), Some(above)] => between(&mine, below, above),
            _ => None,
        };
        alike(&few).or_else(|| nearer(&mine, &few)).or_else(|| alike(&sides(MAX_MISSING)))
    }

    /// Checks a band's correction against the layers. Rows that they contradict become the rows
    /// that they show.
    ///
    /// A row that a later stage ended has a crossing there, as at the edge of a copy's image in a
    /// build: layers that lack it show nothing of the row.
    pub(super) fn judge(
        &self,
        band: &Range<u32>,
        guess: Option<Correction>,
        is_ended: impl Fn(u32) -> bool,
    ) -> Option<Correction> {
        let show = |row: u32| if is_ended(row) { None } else { self.show(row, band) };
        let mut shown: Vec<_> = band.clone().map(show).collect();
        self.fill(band, &mut shown);
        if shown.iter().all(Option::is_none) {
            return guess;
        }
        let doubt = guess.as_ref().map_or(0.0, |guess| guess.confidence);
        let fits = |which: usize, shown: &MissedCrossings| {
            let had = self.mask.row(band.start + which as u32);
            guess.as_ref().is_some_and(|guess| shown.fits(had, &guess.rows[which]))
        };
        // Curves that two layers confirm in other rows count for more than what one layer shows.
        let of_two = || (0..).zip(&shown).filter_map(|(k, shown)| Some((k, shown.as_ref()?)));
        let mut of_two = of_two().filter(|(_, shown)| shown.is_sure()).peekable();
        let is_confirmed = of_two.peek().is_some() && of_two.all(|(k, shown)| fits(k, shown));
        let judged = band.clone().zip(&shown).enumerate().map(|(which, (row, shown))| {
            let had = self.mask.row(row);
            let guessed = guess.as_ref().map(|guess| &guess.rows[which]);
            match (shown, guessed) {
                (Some(shown), Some(guessed)) if fits(which, shown) => {
                    (guessed.clone(), shown.confidence.max(doubt))
                }
                (Some(shown), Some(guessed))
                    if is_confirmed && !shown.is_sure() && doubt >= shown.confidence =>
                {
                    (guessed.clone(), doubt)
                }
                (Some(shown), _) => (shown.add_to(had, self.mask.width()), shown.confidence),
                (None, guessed) => (guessed.map_or_else(|| had.to_vec(), Clone::clone), doubt),
            }
        });
        let (rows, by_row): (Vec<Vec<u32>>, Vec<f64>) = judged.unzip();
        let confidence = by_row.iter().copied().fold(1.0, f64::min);
        let gap = added_columns(self.mask, band, &rows);
        let touching = guess.as_ref().is_some_and(|guess| guess.touching);
        Some(Correction { rows, gap, confidence, touching, by_row })
    }
}

impl Beside<'_> {
    /// Leads what is shown above and below on through the rows in between that no layer shows, if
    /// all of them have as many crossings.
    fn fill(&self, band: &Range<u32>, shown: &mut [Option<MissedCrossings>]) {
        let mut end = 0;
        while let Some(start) = (end..shown.len()).find(|&at| shown[at].is_none()) {
            end = (start..shown.len()).find(|&at| shown[at].is_some()).unwrap_or(shown.len());
            let (Some(from), Some(Some(to))) = (start.checked_sub(1), shown.get(end)) else {
                continue;
            };
            let Some(above) = &shown[from] else { continue };
            let count = |at: usize| self.mask.row(band.start + at as u32).len();
            if above.missing.len() != to.missing.len()
                || (start..=end).any(|at| count(at) != count(from))
            {
                continue;
            }
            let (above, to) = (above.clone(), to.clone());
            for (at, shown) in shown.iter_mut().enumerate().take(end).skip(start) {
                let share = (at - from) as f64 / (end - from) as f64;
                let pairs = above.missing.iter().zip(&to.missing);
                let missing = pairs
                    .map(|(a, b)| [a[0].min(b[0]), a[1].max(b[1]), a[2] + share * (b[2] - a[2])]);
                let confidence = above.confidence.min(to.confidence).min(BY_ONE);
                *shown = Some(MissedCrossings { missing: missing.collect(), confidence });
            }
        }
    }
}

/// Returns the columns in which new rows have crossings that the rows had not.
pub(super) fn added_columns(
    mask: &Mask,
    band: &Range<u32>,
    rows: &[Vec<u32>],
) -> Option<Range<u32>> {
    let added = band.clone().zip(rows).flat_map(|(row, new)| {
        let had = mask.row(row);
        new.iter().filter(move |column| had.binary_search(column).is_err())
    });
    added.map(|&column| column..column + 1).reduce(|a, b| a.start.min(b.start)..a.end.max(b.end))
}

impl MissedCrossings {
    /// Returns whether layers on both sides show the same.
    pub(super) fn is_sure(&self) -> bool {
        self.confidence >= BETWEEN
    }

    /// Returns whether another row has a crossing near one that is missing.
    pub(super) fn goes_on_in(&self, row: &[u32]) -> bool {
        let is_near =
            |at: f64| row.iter().any(|&column| (f64::from(column) - at).abs() <= MIN_ROOM);
        self.missing.iter().any(|&[.., column]| is_near(column))
    }

    /// Returns how many pixels of a row that ends black are wrong, about. `None` if it misses no
    /// crossing.
    pub(super) fn missed_pixels(&self) -> Option<f64> {
        let pairs = self.missing.chunks_exact(2);
        (!self.missing.is_empty()).then(|| pairs.map(|pair| pair[1][2] - pair[0][2]).sum())
    }

    /// Returns whether a corrected row has what is shown, and nothing else.
    fn fits(&self, had: &[u32], new: &[u32]) -> bool {
        let added = new.iter().filter(|column| had.binary_search(column).is_err());
        let added: Vec<f64> = added.map(|&column| column.into()).collect();
        new.len() == had.len() + self.missing.len()
            && added.len() == self.missing.len()
            && added
                .iter()
                .zip(&self.missing)
                .all(|(added, &[least, greatest, _])| (least..=greatest).contains(added))
    }

    fn add_to(&self, had: &[u32], width: u32) -> Vec<u32> {
        let mut new = had.to_vec();
        for &[.., column] in &self.missing {
            let column = column.round().clamp(0.0, f64::from(width - 1)) as u32;
            match new.binary_search(&column) {
                // Two crossings at one column leave the color as it is.
                Ok(at) => drop(new.remove(at)),
                Err(at) => new.insert(at, column),
            }
        }
        new
    }
}

/// Returns the nearest layer's row that is whole and has the crossings of this one, and not more
/// than `most` others.
fn whole(side: &[&Layer], row: u32, mine: &[f64], band: &Range<u32>, most: usize) -> Option<Whole> {
    side.iter().zip(1_usize..).find_map(|(layer, away)| {
        if layer.info.stray_rows.binary_search(&row).is_ok() {
            return None;
        }
        let columns = layer.image.exposed_row(row);
        if columns.len() % 2 == 1 || columns.len() > mine.len() + most {
            return None;
        }
        // A layer whose contours break off near by may miss the same crossings, and a row that
        // looks whole in itself is judged by layers that are beyond doubt.
        if mine.len().is_multiple_of(2) && is_open_near(layer, band) {
            return None;
        }
        let columns: Vec<f64> = columns.iter().map(|&column| column.into()).collect();
        let partners = inject(mine, &columns, NEAR + DRIFT * away as f64)?;
        Some(Whole { away, columns, partners })
    })
}

/// Returns whether contours break off near some rows of a layer.
fn is_open_near(layer: &Layer, rows: &Range<u32>) -> bool {
    let near = rows.start.saturating_sub(DEPTH)..=rows.end.saturating_add(DEPTH);
    let open = &layer.info.open_rows;
    open.get(open.partition_point(|row| row < near.start())).is_some_and(|row| near.contains(row))
}

/// Returns the crossings missing from a row between two that are alike, if it has all others
/// where they lie in between.
fn between(mine: &[f64], below: &Whole, above: &Whole) -> Option<MissedCrossings> {
    let away = [below.away, above.away];
    let expected = interpolated(&below.columns, &above.columns, away);
    let partners = inject(mine, &expected, f64::INFINITY)?;
    let moved = |which: usize| (above.columns[which] - below.columns[which]).abs();
    let off = |(column, &which): (&f64, &usize)| (column - expected[which]).abs();
    let is_near = |pair: (&f64, &usize)| off(pair) <= NEAR + 0.25 * moved(*pair.1);
    let most = partners.iter().map(|&which| moved(which)).fold(0.0, f64::max);
    let missing = missing_from(&partners, expected.len());
    // A crossing that moves far more than all others is of two contours.
    if !mine.iter().zip(&partners).all(is_near)
        || missing.iter().any(|&which| moved(which) > 2.0 * most + 2.0 * NEAR)
    {
        return None;
    }
    // Contours that bend from layer to layer lie beside the line between two.
    let bend = mine.iter().zip(&partners).map(off).fold(0.0, f64::max);
    let missing = missing.into_iter().map(|which| {
        let (below, above) = (below.columns[which], above.columns[which]);
        let bend = BEND * bend + 0.25 * moved(which);
        let margin = if bend < 1.0 { 0.5 } else { NEAR + bend };
        [below.min(above) - margin, below.max(above) + margin, expected[which]]
    });
    Some(MissedCrossings { missing: missing.collect(), confidence: BETWEEN })
}

/// Returns the crossings of a row between two.
fn interpolated(below: &[f64], above: &[f64], [under, over]: [usize; 2]) -> Vec<f64> {
    let share = under as f64 / (under + over) as f64;
    below.iter().zip(above).map(|(below, above)| below + share * (above - below)).collect()
}

/// Returns what the nearer of two layers shows.
fn nearer(mine: &[f64], sides: &[Option<Whole>; 2]) -> Option<MissedCrossings> {
    match sides {
        [Some(below), Some(above)] if below.away == above.away => None,
        [Some(below), Some(above)] if below.away > above.away => by_one(mine, above),
        [Some(one), _] | [None, Some(one)] => by_one(mine, one),
        [None, None] => None,
    }
}

/// Returns what one layer shows, moved by as much as the crossings beside differ. `None` if they
/// differ so much that a crossing may be another one.
fn by_one(mine: &[f64], other: &Whole) -> Option<MissedCrossings> {
    let offset = |at: usize| mine[at] - other.columns[other.partners[at]];
    let slack = BEND * (0..mine.len()).map(|at| offset(at).abs()).fold(0.0, f64::max);
    let mut confidence = BY_ONE;
    let mut missing = Vec::new();
    for which in missing_from(&other.partners, other.columns.len()) {
        let next = other.partners.partition_point(|&partner| partner < which);
        let around = next.saturating_sub(1)..mine.len().min(next + 1);
        let count = around.len().max(1) as f64;
        let column = other.columns[which] + around.map(offset).sum::<f64>() / count;
        let others = [which.checked_sub(1), Some(which + 1)].into_iter().flatten();
        let distance = |other_column: &f64| (other_column - other.columns[which]).abs();
        let room = others.filter_map(|which| other.columns.get(which).map(distance));
        let room = room.fold(f64::INFINITY, f64::min).max(MIN_ROOM);
        if slack > room {
            return None;
        }
        confidence = confidence.min(BY_ONE / (1.0 + 0.5 * slack / room));
        missing.push([column - NEAR - slack, column + NEAR + slack, column]);
    }
    Some(MissedCrossings { missing, confidence })
}

/// Returns the indices below `count` that are not among increasing ones.
fn missing_from(partners: &[usize], count: usize) -> Vec<usize> {
    (0..count).filter(|which| partners.binary_search(which).is_err()).collect()
}

/// Matches all crossings of a row with crossings of a longer row, in order, so that they lie as
/// near to each other as possible. `None` if one lies further off than `most`.
fn inject(row: &[f64], longer: &[f64], most: f64) -> Option<Vec<usize>> {
    let more = longer.len().checked_sub(row.len()).filter(|&more| more <= MAX_MISSING)?;
    // cost[i][k]: the cheapest way to match the first i crossings if k of the longer row's were
    // passed over.
    let mut cost = vec![[f64::INFINITY; MAX_MISSING + 1]; row.len() + 1];
    cost[0][..=more].fill(0.0);
    for i in 0..row.len() {
        let mut least = f64::INFINITY;
        for k in 0..=more {
            least = least.min(cost[i][k] + (row[i] - longer[i + k]).abs());
            cost[i + 1][k] = least;
        }
    }
    let mut k = more;
    let mut partners = vec![0; row.len()];
    for i in (0..row.len()).rev() {
        while k > 0 && cost[i + 1][k - 1] <= cost[i + 1][k] {
            k -= 1;
        }
        partners[i] = i + k;
    }
    let is_near = |(column, &which): (&f64, &usize)| (column - longer[which]).abs() <= most;
    row.iter().zip(&partners).all(is_near).then_some(partners)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossings_keep_their_order() {
        assert_eq!(inject(&[10.0, 30.0], &[9.0, 20.0, 31.0], 2.0), Some(vec![0, 2]));
        assert_eq!(inject(&[10.0, 12.0], &[0.0, 11.0, 40.0], f64::INFINITY), Some(vec![0, 1]));
        assert_eq!(inject(&[10.0], &[20.0], 2.0), None);
        assert_eq!(inject(&[10.0, 20.0], &[10.0], 2.0), None);
        assert_eq!(inject(&[], &[1.0, 2.0], 2.0), Some(vec![]));
    }
}
