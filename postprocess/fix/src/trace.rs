//! Correction of a band of any width by following contours from row to row through it.
//!
//! Between two rows where contours break off, all rows miss the same contours. All others can be
//! followed through these rows as through good ones, with whatever begins and ends there. What
//! breaks off at the start of the gap and what goes on at its end are the ends of the missing
//! piece.

use std::ops::Range;

use lamp_stack::{Image, Layer, Mask, white_in_row};

use super::align::{align, align_broken};
use super::combine::difference;
use super::contours::DEPTH;
use super::polynomial::{hermite, slope};
use super::rebuild::Correction;

/// The cost, in pixels, of a contour that breaks off, where one may.
const BREAKING: f64 = 3.0;
/// The cost of joining ends whose missing piece would cross another contour.
const CROSSING: f64 = 1000.0;
/// The cost of a contour whose other side was missed from its beginning to its end.
const ONE_SIDED: f64 = 30.0;
/// The most ends that are joined in a band.
const MAX_ENDS: usize = 8;
/// The steepest slope, in columns a row, by which contours are continued.
const MAX_SLOPE: f64 = 20.0;
/// A contour in consecutive rows.
#[derive(Clone, Debug)]
struct ContourTrace {
    first: u32,
    columns: Vec<f64>,
}

impl ContourTrace {
    fn end(&self) -> u32 {
        self.first + self.columns.len() as u32
    }

    fn at(&self, row: u32) -> Option<f64> {
        self.columns.get(row.checked_sub(self.first)? as usize).copied()
    }

    /// Returns the points from a row on, up or down: (row, column).
    fn points(&self, row: u32, down: bool) -> Vec<(f64, f64)> {
        let rows: Vec<u32> = if down {
            (row..self.end().min(row + DEPTH)).collect()
        } else {
            (self.first.max((row + 1).saturating_sub(DEPTH))..=row).rev().collect()
        };
        rows.into_iter().filter_map(|row| Some((row.into(), self.at(row)?))).collect()
    }
}

/// Where a contour breaks off.
#[derive(Clone, Copy, Debug)]
struct LooseEnd {
    line: usize,
    /// The first row behind the break.
    row: u32,
    /// Whether the line goes on below the break.
    is_below: bool,
    /// The last known point, and the slope there.
    point: (f64, f64),
    slope: f64,
    /// Whether white begins there, if the row is whole.
    direction: Option<bool>,
    /// How well the lines around fit across the break, and how far the next one is.
    misfit: f64,
    room: f64,
    /// The number of rows in which the line is known.
    known: usize,
}

impl LooseEnd {
    fn predict(&self, row: f64) -> f64 {
        self.point.1 + self.slope * (row - self.point.0)
    }
}

/// A piece of a contour that rows miss.
struct Missing {
    rows: Range<u32>,
    /// The columns, and the error they may have. Unknown if no end leads into the rows.
    columns: Option<Vec<(f64, f64)>>,
    confidence: f64,
}

/// The lines around and in a band.
struct Lines<'a> {
    mask: &'a Mask,
    rows: Range<u32>,
    lines: Vec<ContourTrace>,
    /// The line that each crossing of each row lies on.
    on: Vec<Vec<usize>>,
    /// The line that each line continues, or itself.
    continues: Vec<usize>,
    loose: Vec<LooseEnd>,
}

/// Corrects a band. `None` if its broken contours cannot be joined.
pub(super) fn trace(
    mask: &Mask,
    band: &Range<u32>,
    is_good: impl Fn(u32) -> bool,
    is_ended: impl Fn(u32) -> bool,
    open_rows: Option<&[u32]>,
    neighbours: &[Vec<&Layer>; 2],
) -> Option<Correction> {
    // `tile` adds a crossing where it ends a row, so lines do not show what is missing.
    if band.start == 0 || band.end == mask.height() || band.clone().any(is_ended) {
        return None;
    }
    let above = (0..band.start).rev().take(DEPTH as usize).take_while(|&row| is_good(row));
    let below = (band.end..mask.height()).take(DEPTH as usize).take_while(|&row| is_good(row));
    let (above, below) = (above.count() as u32, below.count() as u32);
    let rows = band.start - above..band.end + below;
    let parity = |row: u32| mask.row(row).len() % 2;
    // A contour lost alone changes the parity. Two lost at once keep it: only the page's open rows
    // show them, or else the band's ends stand for these.
    let is_break = |row: u32| {
        band.start <= row
            && row <= band.end
            && (parity(row - 1) != parity(row)
                || open_rows.map_or(row == band.start || row == band.end, |open| {
                    open.binary_search(&row).is_ok()
                }))
    };
    let lines = Lines::follow(mask, rows, is_break);
    let missing = lines.join()?;
    if missing.is_empty() {
        return None;
    }
    let mut added: Vec<Vec<(f64, f64)>> = vec![Vec::new(); band.len()];
    for piece in &missing {
        for (row, &guess) in piece.rows.clone().zip(piece.columns.as_ref()?) {
            added.get_mut(row.checked_sub(band.start)? as usize)?.push(guess);
        }
    }
    let mut confidence = missing.iter().map(|piece| piece.confidence).fold(1.0, f64::min);
    confidence *= 0.95f64.powi(missing.len() as i32 - 1);
    let (mut new_rows, mut gap): (_, Option<Range<u32>>) = (Vec::new(), None);
    let width = f64::from(mask.width());
    for (row, guesses) in band.clone().zip(&added) {
        let mut new = mask.row(row).to_vec();
        for &(column, slack) in guesses {
            let column = column.round().clamp(0.0, width - 1.0) as u32;
            let gap = gap.get_or_insert(column..column + 1);
            *gap = gap.start.min(column)..gap.end.max(column + 1);
            let at = new.partition_point(|&other| other < column);
            let room = |other: Option<&u32>| other.map_or(width, |o| f64::from(o.abs_diff(column)));
            let room = room(at.checked_sub(1).and_then(|at| new.get(at))).min(room(new.get(at)));
            // A guess is as doubtful as its possible error is large against the way to the next
            // crossing.
            confidence = confidence.min(room.max(8.0) / (room.max(8.0) + slack));
            if new.get(at) == Some(&column) {
                new.remove(at);
            } else {
                new.insert(at, column);
            }
        }
        if !new.len().is_multiple_of(2) {
            return None;
        }
        new_rows.push(new);
    }
    for layer in neighbours.iter().filter_map(|side| side.first()) {
        confidence *= agreement(mask, band, &new_rows, &layer.image, above.min(below));
    }
    Some(Correction { rows: new_rows, gap, confidence, ..Correction::default() })
}

/// Returns how well corrected rows agree with the rows of a neighboring layer, from 0 to 1: how
/// much nearer they came to it, compared with the difference of good rows next to the band.
fn agreement(mask: &Mask, band: &Range<u32>, new: &[Vec<u32>], image: &Image, beside: u32) -> f64 {
    let off = |row: &[u32], other: &[u32]| white_in_row(&difference(row, other), mask.width());
    let is_whole = |row: &[u32]| row.len().is_multiple_of(2);
    let usual = (band.start - beside..band.start)
        .chain(band.end..band.end + beside)
        .map(|row| (row, image.exposed_row(row)))
        .filter(|(_, other)| is_whole(other))
        .map(|(row, other)| off(mask.row(row), &other))
        .max()
        .unwrap_or(0);
    let (mut gained, mut lost) = (0, 0);
    for (row, new) in band.clone().zip(new) {
        let other = image.exposed_row(row);
        if is_whole(&other) {
            let (was, is) = (off(mask.row(row), &other), off(new, &other));
            gained += was.saturating_sub(is);
            lost += is.saturating_sub(2 * usual + 8);
        }
    }
    if lost == 0 { 1.0 } else { gained as f64 / (gained + lost) as f64 }
}

impl<'a> Lines<'a> {
    /// Follows all contours through the rows. They break off at some rows only.
    fn follow(mask: &'a Mask, rows: Range<u32>, is_break: impl Fn(u32) -> bool) -> Self {
        let (lines, on, continues, loose) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut all = Self { mask, rows: rows.clone(), lines, on, continues, loose };
        for row in rows.clone() {
            let columns = all.columns(row);
            let mut on = vec![None; columns.len()];
            if row > rows.start && !is_break(row) {
                let last = &all.on[all.on.len() - 1];
                let partners = align(&all.columns(row - 1), &columns);
                for (&line, partner) in last.iter().zip(partners) {
                    if let Some(partner) = partner {
                        all.lines[line].columns.push(columns[partner]);
                        on[partner] = Some(line);
                    }
                }
            }
            let begun = |(line, column): (Option<usize>, f64)| {
                line.unwrap_or_else(|| {
                    all.lines.push(ContourTrace { first: row, columns: vec![column] });
                    all.lines.len() - 1
                })
            };
            let on = on.into_iter().zip(columns).map(begun).collect();
            all.on.push(on);
        }
        all.continues = (0..all.lines.len()).collect();
        for row in rows.start + 1..rows.end {
            if is_break(row) {
                all.cross(row);
            }
        }
        all
    }

    fn columns(&self, row: u32) -> Vec<f64> {
        self.mask.row(row).iter().map(|&column| column.into()).collect()
    }

    /// Returns the line that a crossing of a row lies on.
    fn line(&self, row: u32, which: usize) -> usize {
        self.continues[self.on[(row - self.rows.start) as usize][which]]
    }

    /// Joins the lines above a break with the lines below, and notes the ends that are loose.
    fn cross(&mut self, row: u32) {
        let end = |line: &ContourTrace, row: u32, down: bool| {
            let points = line.points(row, down);
            (slope(&points).clamp(-MAX_SLOPE, MAX_SLOPE), points.len())
        };
        let ends = |row: u32, down: bool| -> Vec<_> {
            let lines = (0..self.mask.row(row).len()).map(|which| self.line(row, which));
            lines.map(|line| end(&self.lines[line], row, down)).collect()
        };
        let (above, below) = (ends(row - 1, false), ends(row, true));
        // The side with more rows shows better where contours are going.
        let depth = |side: &[(f64, usize)]| side.iter().map(|s| s.1).max().unwrap_or(0).max(1);
        let share = depth(&above) as f64 / (depth(&above) + depth(&below)) as f64;
        // Contours do not cross, so predicted columns keep their order.
        let moved = |columns: Vec<f64>, slopes: &[(f64, usize)], rows: f64| -> Vec<f64> {
            let moved = columns.iter().zip(slopes).map(|(column, slope)| column + rows * slope.0);
            let mut last = 0.0_f64;
            moved
                .map(|column| {
                    last = last.max(column);
                    last
                })
                .collect()
        };
        let a = moved(self.columns(row - 1), &above, share);
        let b = moved(self.columns(row), &below, share - 1.0);
        let aligned = align_broken(&a, &b, BREAKING);
        let joined = aligned.partners.iter().enumerate().filter_map(|(i, j)| Some((i, (*j)?)));
        let joined: Vec<(usize, usize)> = joined.collect();
        let mut misfits: Vec<f64> = joined.iter().map(|&(i, j)| (a[i] - b[j]).abs()).collect();
        misfits.sort_by(f64::total_cmp);
        // The median: one contour with a corner at the break says nothing about the others.
        let misfit = misfits.get(misfits.len().saturating_sub(1) / 2).copied().unwrap_or(0.0);
        for (below_break, broken) in [false, true].into_iter().zip(&aligned.broken) {
            let (places, at, slopes) =
                if below_break { (&b, row, &below) } else { (&a, row - 1, &above) };
            let columns = self.columns(at);
            for &which in broken {
                let room = [which.wrapping_sub(1), which + 1]
                    .iter()
                    .filter_map(|&k| Some((places.get(k)? - places[which]).abs()))
                    .fold(f64::INFINITY, f64::min);
                self.loose.push(LooseEnd {
                    line: self.line(at, which),
                    row,
                    is_below: below_break,
                    point: (at.into(), columns[which]),
                    slope: slopes[which].0,
                    direction: columns.len().is_multiple_of(2).then_some(which % 2 == 0),
                    misfit,
                    room,
                    known: slopes[which].1,
                });
            }
        }
        for (i, j) in joined {
            let (upper, lower) = (self.line(row - 1, i), self.line(row, j));
            let columns = std::mem::take(&mut self.lines[lower].columns);
            self.lines[upper].columns.extend(columns);
            self.continues[lower] = upper;
        }
    }

    /// Joins the loose ends in pairs at the least cost.
    fn join(&self) -> Option<Vec<Missing>> {
        let count = self.loose.len();
        // An odd end has no partner. Eight ends pair in 7 x 5 x 3 = 105 ways, ten would in 945.
        if count == 0 || count % 2 == 1 || count > MAX_ENDS {
            return None;
        }
        let cost: Vec<Vec<f64>> = (0..count)
            .map(|i| (0..count).map(|j| self.cost(&self.loose[i], &self.loose[j])).collect())
            .collect();
        let (mut best, mut second) = ((f64::INFINITY, Vec::new()), f64::INFINITY);
        pairings(count, &mut |pairs| {
            let sum: f64 = pairs.iter().map(|&(i, j)| cost[i][j]).sum();
            if sum < best.0 {
                second = best.0;
                best = (sum, pairs.to_vec());
            } else {
                second = second.min(sum);
            }
        });
        // Another way to join them that costs hardly more is a doubt.
        let sure = if second.is_finite() { (second + 4.0 - best.0) / (second + 4.0) } else { 1.0 };
        if !best.0.is_finite() {
            return None;
        }
        let pairs = best.1.into_iter();
        let missing = pairs.filter_map(|(i, j)| {
            let mut piece = self.piece(&self.loose[i], &self.loose[j])?;
            piece.confidence *= 0.5 + 0.5 * sure.max(0.0);
            Some(piece)
        });
        Some(missing.collect())
    }

    /// Returns what it costs to join two loose ends.
    fn cost(&self, a: &LooseEnd, b: &LooseEnd) -> f64 {
        let (a, b) = if a.row <= b.row { (a, b) } else { (b, a) };
        let middle = 0.5 * (a.point.0 + b.point.0);
        let fit = match (a.is_below, b.is_below) {
            (false, true) => {
                let straight = (a.point.1 - b.point.1).abs();
                straight.min((a.predict(middle) - b.predict(middle)).abs())
            }
            // Two ends on one side of their breaks: the missing side leads from the first to where
            // the contour ends, at the second.
            (false, false) => (a.predict(b.point.0) - b.point.1).abs() + 2.0 * BREAKING,
            (true, true) => (b.predict(a.point.0) - a.point.1).abs() + 2.0 * BREAKING,
            (true, false) if a.row == b.row => {
                return (a.point.1 - b.point.1).abs();
            }
            (true, false) => ONE_SIDED,
        };
        // A contour that goes on through the gap has its white on the same side at both ends.
        let turned = (a.is_below != b.is_below)
            == (a.direction.is_some() && b.direction.is_some() && a.direction != b.direction);
        let turned = if turned && a.is_below != b.is_below { 50.0 } else { 0.0 };
        let sides = |line: &ContourTrace| -> Option<bool> {
            let rows = [a.point.0 as u32, b.point.0 as u32];
            let [upper, lower] = [line.at(rows[0])? - a.point.1, line.at(rows[1])? - b.point.1];
            // A line on opposite sides of the two ends would cross the missing piece.
            Some(upper * lower < 0.0)
        };
        let crosses =
            self.lines.iter().enumerate().any(|(which, line)| {
                which != a.line && which != b.line && sides(line) == Some(true)
            });
        fit + turned + if crosses { CROSSING } else { 0.0 }
    }

    /// Returns the missing piece between two loose ends; `None` if no row misses it.
    fn piece(&self, a: &LooseEnd, b: &LooseEnd) -> Option<Missing> {
        let (a, b) = if a.row <= b.row { (*a, *b) } else { (*b, *a) };
        let rows = a.row..b.row;
        if rows.is_empty() {
            return None;
        }
        // One or two rows hardly show where a contour is going.
        let certain = |end: &LooseEnd| {
            let room = end.room.max(4.0);
            room / (room + end.misfit) * (end.known + 1).min(4) as f64 / 4.0
        };
        let (columns, confidence) = match (a.is_below, b.is_below) {
            (false, true) => {
                let chord = (b.point.1 - a.point.1) / (b.point.0 - a.point.0);
                // Rounded columns show a slope to about a pixel in the rows of its line.
                let lead = |end: &LooseEnd| {
                    let is_same = (end.slope - chord).abs() * (end.known as f64) < 1.2;
                    if is_same { chord } else { end.slope }
                };
                let guess = |row: u32| {
                    let row = f64::from(row);
                    let column = hermite(a.point, lead(&a), b.point, lead(&b), row);
                    let straight = a.point.1 + chord * (row - a.point.0);
                    (column, 0.5 + 0.5 * (column - straight).abs() + 0.15 * chord.abs())
                };
                (Some(rows.clone().map(guess).collect()), certain(&a).min(certain(&b)))
            }
            (false, false) | (true, true) => {
                let from = if a.is_below { b } else { a };
                let guess = |row: u32| {
                    let away = (f64::from(row) - from.point.0).abs();
                    (from.predict(row.into()), 0.5 + away * (0.05 + 0.05 * from.slope.abs()))
                };
                (Some(rows.clone().map(guess).collect()), 0.8 * certain(&from))
            }
            (true, false) => (None, 0.5),
        };
        Some(Missing { rows, columns, confidence })
    }
}

/// Calls `see` with each way to join an even number of things in pairs.
fn pairings(count: usize, see: &mut impl FnMut(&[(usize, usize)])) {
    fn step(
        left: &[usize],
        pairs: &mut Vec<(usize, usize)>,
        see: &mut impl FnMut(&[(usize, usize)]),
    ) {
        let Some((&first, rest)) = left.split_first() else { return see(pairs) };
        for which in 0..rest.len() {
            let mut others = rest.to_vec();
            pairs.push((first, others.remove(which)));
            step(&others, pairs, see);
            pairs.pop();
        }
    }
    step(&(0..count).collect::<Vec<_>>(), &mut Vec::new(), see);
}
