//! The contours around a band of stray rows, and where they should cross its rows.
//!
//! Source: 002 section 2.4.1 and figure 29c: C1 cubic Hermite curves through
//! the crossings of the good rows on both sides.

use std::ops::Range;

use lamp_stack::Mask;

use super::align::align;
use super::polynomial::{hermite, parabola, slope};

/// The number of good rows on each side that show where a contour is going.
pub(super) const DEPTH: u32 = 12;

/// The expected width in pixels from which on a contour that ends in the band is likely to be
/// there still.
const MIN_LIKELY_WIDTH: f64 = 8.0;

/// A crossing that a row of the band should have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ExpectedCrossing {
    /// The column, counted as transitions are, not rounded.
    pub(super) column: f64,
    /// The error that the column may have, in pixels.
    pub(super) slack: f64,
    /// The line that it lies on.
    pub(super) side: LineId,
    /// Whether it must be there, as the contour crosses the whole band.
    pub(super) through: bool,
    /// Whether it is more likely there than not.
    pub(super) likely: bool,
    /// Whether a row that lacks it can have missed it.
    pub(super) may_be_missed: bool,
}

/// A line: a contour that crosses the band, or one side of a contour that ends in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct LineId {
    contour: usize,
    right: bool,
}

/// The crossings that a row of the band should have.
#[derive(Debug, Default)]
pub(super) struct Outlook {
    /// The crossings, from the left.
    pub(super) crossings: Vec<ExpectedCrossing>,
    /// Columns whose color in this row is unknown, as a contour ends or begins there in the
    /// band: from the left, without overlap.
    pub(super) unknown: Vec<Range<f64>>,
}

/// The contours that cross a band or end in it.
#[derive(Debug)]
pub(super) struct BandContours {
    /// The band and the good rows around it.
    rows: Range<u32>,
    band: Range<u32>,
    /// The number of good rows next to it, on the side that has fewer.
    pub(super) good_rows: usize,
    contours: Vec<BandContour>,
}

/// The columns at which a line is known to cross the rows.
type KnownColumns = Vec<Option<f64>>;

/// The column at which a line should cross a row, and the error that it may have.
type Guess = (f64, f64);

#[derive(Debug)]
struct BandContour {
    course: ContourPath,
    /// The crossings of its one or two lines with each row of the band.
    guesses: Vec<Vec<Guess>>,
}

#[derive(Debug)]
enum ContourPath {
    /// Crosses the band from the good row above to the one below, or from one of them to the
    /// image's edge.
    Through(KnownColumns),
    /// Comes from above or below and ends in the band: both sides of the contour.
    Closing { sides: [KnownColumns; 2], from_above: bool },
}

impl BandContours {
    /// Follows the contours around a band, through rows that are good. Returns `None` if no good
    /// row is next to the band.
    pub(super) fn around(
        mask: &Mask,
        band: Range<u32>,
        is_good: impl Fn(u32) -> bool,
    ) -> Option<Self> {
        let rows =
            band.start.saturating_sub(DEPTH)..band.end.saturating_add(DEPTH).min(mask.height());
        let above: Vec<_> =
            (rows.start..band.start).rev().take_while(|&row| is_good(row)).collect();
        let below: Vec<_> = (band.end..rows.end).take_while(|&row| is_good(row)).collect();
        // Beyond the image's edge all rows are black and good.
        let to_edge = [above.last() == Some(&0), below.last() == Some(&(mask.height() - 1))];
        let good_rows = [&above, &below]
            .into_iter()
            .zip(to_edge)
            .filter(|(side, _)| !side.is_empty())
            .map(|(side, to_edge)| if to_edge { DEPTH as usize } else { side.len() })
            .min()?;
        let mut contours = Self { rows, band, good_rows, contours: Vec::new() };
        if above.is_empty() || below.is_empty() {
            for line in follow(mask, &[above, below].concat()) {
                contours.push(ContourPath::Through(contours.knots(&[&line])));
            }
        } else {
            contours.join(&follow(mask, &above), &follow(mask, &below));
        }
        contours.guess();
        Some(contours)
    }

    /// Joins the lines above and below the band. Lines without a partner come in pairs, the two
    /// sides of a contour that ends in the band.
    fn join(&mut self, above: &[LinePoints], below: &[LinePoints]) {
        let ahead = f64::from(self.band.end - self.band.start + 1);
        let extended = |lines: &[LinePoints], rows: f64| -> Vec<f64> {
            let mut columns: Vec<f64> = lines
                .iter()
                .map(|line| line[0].1 + rows * slope(line).clamp(-20.0, 20.0))
                .collect();
            // Contours do not cross, so their order must stay.
            for i in 1..columns.len() {
                columns[i] = columns[i].max(columns[i - 1]);
            }
            columns
        };
        // Both sides are extended to the band's middle, where their errors are alike.
        let partners = align(&extended(above, ahead / 2.0), &extended(below, -ahead / 2.0));
        let mut joined = vec![false; below.len()];
        let mut pairs = Vec::new();
        for (line, partner) in above.iter().zip(&partners) {
            if let Some(partner) = *partner {
                joined[partner] = true;
                let knots = self.knots(&[line, &below[partner]]);
                self.push(ContourPath::Through(knots));
            } else {
                pairs.push(line);
            }
        }
        let begun = below.iter().zip(joined).filter(|(_, joined)| !joined).map(|(line, _)| line);
        for (lines, from_above) in [(pairs, true), (begun.collect(), false)] {
            for pair in lines.chunks_exact(2) {
                let sides = [self.knots(&pair[..1]), self.knots(&pair[1..])];
                self.push(ContourPath::Closing { sides, from_above });
            }
        }
    }

    /// Returns the crossings of some lines by row.
    fn knots(&self, lines: &[&LinePoints]) -> KnownColumns {
        let mut knots = vec![None; (self.rows.end - self.rows.start) as usize];
        for &(row, column) in lines.iter().copied().flatten() {
            knots[(row - f64::from(self.rows.start)) as usize] = Some(column);
        }
        knots
    }

    fn push(&mut self, course: ContourPath) {
        self.contours.push(BandContour { course, guesses: Vec::new() });
    }

    /// Records that a row of the band crosses a line, for the next [`guess`](Self::guess).
    pub(super) fn found(&mut self, side: LineId, row: u32, column: u32) {
        let at = (row - self.rows.start) as usize;
        let knots = match &mut self.contours[side.contour].course {
            ContourPath::Through(knots) => knots,
            ContourPath::Closing { sides, .. } => &mut sides[usize::from(side.right)],
        };
        knots[at] = Some(f64::from(column));
    }

    /// Computes where the lines should cross the band's rows from all crossings known by now.
    pub(super) fn guess(&mut self) {
        let [start, end] =
            [self.band.start, self.band.end].map(|row| (row - self.rows.start) as usize);
        for BandContour { course, guesses } in &mut self.contours {
            *guesses = match course {
                ContourPath::Through(knots) => vec![through(knots, start..end)],
                ContourPath::Closing { sides, from_above } => {
                    let [left, right]: [Vec<_>; 2] = closing(sides, start..end, *from_above);
                    vec![left, right]
                }
            };
        }
    }

    /// Returns the crossings that a row of the band should have.
    pub(super) fn outlook(&self, row: u32) -> Outlook {
        let at = (row - self.band.start) as usize;
        let mut outlook = Outlook::default();
        for (contour, BandContour { course, guesses }) in self.contours.iter().enumerate() {
            let through = matches!(course, ContourPath::Through(_));
            let min_width = match &guesses[..] {
                [left, right] => right[at].0 - left[at].0 - left[at].1 - right[at].1,
                _ => f64::INFINITY,
            };
            for (line, guesses) in guesses.iter().enumerate() {
                let (column, slack) = guesses[at];
                let side = LineId { contour, right: line == 1 };
                let likely = min_width > MIN_LIKELY_WIDTH;
                outlook.crossings.push(ExpectedCrossing {
                    column,
                    slack,
                    side,
                    through,
                    likely,
                    may_be_missed: true,
                });
            }
            if let ContourPath::Closing { sides, .. } = course {
                outlook.unknown.push(span(sides, [guesses[0][at], guesses[1][at]]));
            }
        }
        outlook.crossings.sort_by(|a, b| a.column.total_cmp(&b.column));
        outlook.unknown = merged(outlook.unknown);
        outlook
    }
}

/// Sorts ranges and merges overlapping ones.
fn merged(mut ranges: Vec<Range<f64>>) -> Vec<Range<f64>> {
    ranges.sort_by(|a, b| a.start.total_cmp(&b.start));
    ranges.dedup_by(|next, last| {
        let overlap = next.start <= last.end;
        if overlap {
            last.end = last.end.max(next.end);
        }
        overlap
    });
    ranges
}

/// Returns the columns between which a contour that ends in the band may lie.
fn span(sides: &[KnownColumns; 2], now: [Guess; 2]) -> Range<f64> {
    let columns = || sides.iter().flatten().copied().flatten();
    let slack = now[0].1.max(now[1].1) + 2.0;
    let low = columns().fold(now[0].0, f64::min) - slack;
    let high = columns().fold(now[1].0, f64::max) + slack;
    low..high
}

/// A line's crossings, from the row next to the band outwards: (row, column).
type LinePoints = Vec<(f64, f64)>;

/// Follows every crossing of the first row through the others, and returns the lines.
fn follow(mask: &Mask, rows: &[u32]) -> Vec<LinePoints> {
    let columns = |row: u32| -> Vec<f64> { mask.row(row).iter().map(|&c| c.into()).collect() };
    let mut last = columns(rows[0]);
    let mut lines: Vec<LinePoints> = last.iter().map(|&c| vec![(rows[0].into(), c)]).collect();
    // The line that each crossing of the last row lies on.
    let mut on: Vec<Option<usize>> = (0..lines.len()).map(Some).collect();
    for &row in &rows[1..] {
        if on.iter().all(Option::is_none) {
            break;
        }
        let next = columns(row);
        let mut next_on = vec![None; next.len()];
        for (line, partner) in on.iter().zip(align(&last, &next)) {
            if let (&Some(line), Some(partner)) = (line, partner) {
                lines[line].push((row.into(), next[partner]));
                next_on[partner] = Some(line);
            }
        }
        (last, on) = (next, next_on);
    }
    lines
}

/// Returns the known points of rows up to the first unknown one.
fn line_from(knots: &KnownColumns, rows: impl Iterator<Item = usize>) -> LinePoints {
    let point = |row: usize| Some((row as f64, knots[row]?));
    rows.map_while(point).take(DEPTH as usize).collect()
}

/// Returns a line from a known row upwards.
fn above(knots: &KnownColumns, row: usize) -> LinePoints {
    line_from(knots, (0..=row).rev())
}

/// Returns a line from a known row downwards.
fn below(knots: &KnownColumns, row: usize) -> LinePoints {
    line_from(knots, row..knots.len())
}

/// Returns where a line through the band should cross its rows: where it is known to, and along
/// cubics in between.
fn through(knots: &KnownColumns, rows: Range<usize>) -> Vec<Guess> {
    let mut guesses = Vec::with_capacity(rows.len());
    let mut row = rows.start;
    while row < rows.end {
        if let Some(column) = knots[row] {
            guesses.push((column, 0.5));
            row += 1;
            continue;
        }
        let next = (row..knots.len()).find(|&row| knots[row].is_some());
        let end = next.unwrap_or(rows.end).min(rows.end);
        // The row before is known, if there is one: each stretch of unknown rows is taken at
        // once.
        let from = row.checked_sub(1).map(|row| above(knots, row)).filter(|line| !line.is_empty());
        let to = next.map(|row| below(knots, row));
        let ends = [from, to].map(|line| line.map(|line| (line[0], slope(&line))));
        guesses.extend((row..end).map(|row| between(ends, row as f64)));
        row = end;
    }
    guesses
}

/// A point of a line, and its slope there.
type LineEnd = ((f64, f64), f64);

/// Returns where a line should cross a row between the ends of its known parts: along a cubic, or
/// straight on from the only end.
fn between(ends: [Option<LineEnd>; 2], row: f64) -> Guess {
    match ends {
        [Some((from, from_slope)), Some((to, to_slope))] => {
            let column = hermite(from, from_slope, to, to_slope, row);
            let chord = (to.1 - from.1) / (to.0 - from.0);
            let straight = from.1 + chord * (row - from.0);
            (column, 0.5 + 0.5 * (column - straight).abs() + 0.15 * chord.abs())
        }
        [Some((from, slope)), None] | [None, Some((from, slope))] => {
            let away = row - from.0;
            (from.1 + slope * away, 0.5 + away.abs() * (0.2 + 0.2 * slope.abs()))
        }
        [None, None] => unreachable!("a line was found in a good row beside the band"),
    }
}

/// Returns where the two sides of a contour that ends in the band should cross its rows. After
/// its end both sides lie on its middle.
///
/// The middle goes straight on. The square of the width is a polynomial of second degree along
/// the rows, which is exact for circles, ellipses and wedges.
fn closing(sides: &[KnownColumns; 2], rows: Range<usize>, from_above: bool) -> [Vec<Guess>; 2] {
    // The last row where both sides are known, on the way into the band.
    let both = |row: &usize| sides[0][*row].is_some() && sides[1][*row].is_some();
    let last = if from_above {
        (rows.start - 1..rows.end).take_while(both).last()
    } else {
        (rows.start..=rows.end).rev().take_while(both).last()
    };
    let last = last.expect("both sides were found in the good row beside the band");
    let [left, right] = [0, 1]
        .map(|side| if from_above { above(&sides[side], last) } else { below(&sides[side], last) });
    let points = |value: &dyn Fn(f64, f64) -> f64| -> LinePoints {
        left.iter().zip(&right).map(|(l, r)| (l.0, value(l.1, r.1))).collect()
    };
    let squares = points(&|l, r| (0.5 * (r - l)).powi(2));
    let middles = points(&|l, r| 0.5 * (l + r));
    let drift = slope(&middles).clamp(-20.0, 20.0);
    let mut guesses = [Vec::with_capacity(rows.len()), Vec::with_capacity(rows.len())];
    for row in rows {
        let away = row as f64 - last as f64;
        let middle = middles[0].1 + drift * away;
        let half = parabola(&squares, row as f64).max(0.0).sqrt();
        let slack = 1.0 + 0.5 * (half - squares[0].1.sqrt()).abs() + 0.25 * away.abs();
        let [l, r] = match (sides[0][row], sides[1][row]) {
            (Some(l), Some(r)) => [(l, 0.5), (r, 0.5)],
            (Some(l), None) => [(l, 0.5), ((2.0 * middle - l).max(l), slack)],
            (None, Some(r)) => [((2.0 * middle - r).min(r), slack), (r, 0.5)],
            (None, None) => [(middle - half, slack), (middle + half, slack)],
        };
        guesses[0].push(l);
        guesses[1].push(r);
    }
    guesses
}
