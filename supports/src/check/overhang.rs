//! White that lies far from the white below.

use std::ops::Range;

use lamp_stack::sets::{root, unite};
use lamp_stack::{Mask, white_runs};

use super::components::holds_rectangle;
use super::metric::Metric;
use super::span::span;

/// White pixels of a row that may lie too far from the white below.
#[derive(Clone, Debug)]
pub(super) struct Unheld {
    pub(super) row: u32,
    pub(super) columns: Range<u32>,
    pub(super) component: u32,
}

/// Pixels that touch at their sides and are too far from the white below.
#[derive(Clone, Debug)]
pub(super) struct OverhangPatch {
    pub(super) columns: Range<u32>,
    pub(super) rows: Range<u32>,
    pub(super) area: u64,
    /// The largest distance to white below, squared, in widths of a pixel.
    pub(super) reach_squared: f64,
    /// The pixel that is so far: column and row.
    pub(super) farthest: [u32; 2],
    /// The span there in widths of a pixel, if it is held at both sides.
    pub(super) span: Option<f64>,
}

/// How far white may reach beyond the white below.
#[derive(Clone, Copy, Debug)]
pub(super) struct OverhangLimit {
    /// The distance in widths of a pixel.
    pub(super) widths: f64,
    pub(super) metric: Metric,
}

impl OverhangLimit {
    /// Whether a distance, squared and in widths, is within the limit. The margin takes up the
    /// rounding of a limit of whole pixels.
    fn has(self, squared: f64) -> bool {
        squared <= self.widths * self.widths * (1.0 + 1e-9)
    }
}

/// Returns the patches of a layer that are farther than `limit` from the white of `below`, by rows.
/// Patches without a square of `speck` pixels are left out. The runs are sorted by row and column,
/// and exclude pixels that white of their own row reaches.
pub(super) fn patches(
    [layer, below]: [&Mask; 2],
    runs: &[Unheld],
    limit: OverhangLimit,
    speck: u32,
) -> Vec<OverhangPatch> {
    let mut far: Vec<(u32, Range<u32>)> = Vec::new();
    let (mut left, mut next) = (Vec::new(), Vec::new());
    for Unheld { row, columns, .. } in runs {
        left.clear();
        left.push(columns.clone());
        for (distance, reach) in reaches(limit) {
            for near in [row.checked_sub(distance), row.checked_add(distance)] {
                let near = near.filter(|near| *near < below.height() && !left.is_empty());
                let Some(near) = near else { continue };
                next.clear();
                left.iter()
                    .for_each(|run| without(run, below.row(near), below.width(), reach, &mut next));
                std::mem::swap(&mut left, &mut next);
            }
        }
        far.extend(left.drain(..).map(|columns| (*row, columns)));
    }
    let mut groups = touching(&far);
    groups.retain(|runs| holds_rectangle(runs.iter().cloned(), [speck; 2]));
    groups.iter().map(|runs| patch([layer, below], runs, limit.metric)).collect()
}

/// Returns how far white of a row reaches sideways, for each distance in rows.
fn reaches(limit: OverhangLimit) -> impl Iterator<Item = (u32, u32)> {
    let OverhangLimit { widths, metric } = limit;
    (0u32..).map_while(move |rows| {
        let squared = metric.squared(0, rows);
        limit.has(squared).then(|| {
            let mut reach = (widths * widths - squared).max(0.0).sqrt() as u32;
            // The root may be rounded down; the exact test decides.
            while reach < u32::MAX && limit.has(metric.squared(reach + 1, rows)) {
                reach += 1;
            }
            (rows, reach)
        })
    })
}

/// Adds what is left of a run without the white of a row, grown by `reach` on both sides.
pub(crate) fn without(
    run: &Range<u32>,
    row: &[u32],
    width: u32,
    reach: u32,
    out: &mut Vec<Range<u32>>,
) {
    let mut start = run.start;
    // The first white run that ends, grown, after the start.
    let first = row.partition_point(|&t| t.saturating_add(reach) <= start) & !1;
    for (from, to) in white_runs(&row[first..], width) {
        let (from, to) = (from.saturating_sub(reach), to.saturating_add(reach));
        if from >= run.end {
            break;
        }
        if from > start {
            out.push(start..from);
        }
        start = start.max(to);
        if start >= run.end {
            return;
        }
    }
    out.push(start..run.end);
}

/// Gathers runs, sorted by row and column, that touch at their sides.
fn touching(runs: &[(u32, Range<u32>)]) -> Vec<Vec<(u32, Range<u32>)>> {
    let mut parents: Vec<u32> = (0..runs.len() as u32).collect();
    let (mut above, mut row) = (0..0, 0..0);
    for (k, (number, columns)) in runs.iter().enumerate() {
        if k == 0 || runs[k - 1].0 != *number {
            let follows = k > 0 && runs[k - 1].0 + 1 == *number;
            above = if follows { row } else { 0..0 };
            row = k..k;
        }
        row.end = k + 1;
        while above.start < above.end && runs[above.start].1.end <= columns.start {
            above.start += 1;
        }
        for upper in above.clone().take_while(|&upper| runs[upper].1.start < columns.end) {
            unite(&mut parents, upper as u32, k as u32);
        }
    }
    let mut groups: Vec<Vec<(u32, Range<u32>)>> = Vec::new();
    let mut group_of = vec![0; runs.len()];
    for (k, run) in runs.iter().enumerate() {
        let root = root(&mut parents, k as u32) as usize;
        if root == k {
            group_of[k] = groups.len();
            groups.push(Vec::new());
        }
        groups[group_of[root]].push(run.clone());
    }
    groups
}

/// Measures a patch.
fn patch([layer, below]: [&Mask; 2], runs: &[(u32, Range<u32>)], metric: Metric) -> OverhangPatch {
    let columns = runs.iter().map(|(_, columns)| columns);
    let start = columns.clone().map(|columns| columns.start).min().unwrap_or_default();
    let end = columns.clone().map(|columns| columns.end).max().unwrap_or_default();
    let mut farthest = Farthest { below, metric, squared: 0.0, at: [runs[0].1.start, runs[0].0] };
    farthest.search(runs);
    OverhangPatch {
        columns: start..end,
        rows: runs[0].0..runs[runs.len() - 1].0 + 1,
        area: columns.map(|columns| u64::from(columns.end - columns.start)).sum(),
        reach_squared: farthest.squared,
        farthest: farthest.at,
        span: span([layer, below], farthest.at, farthest.squared.sqrt(), metric),
    }
}

/// The pixel, of those searched, that is farthest from white.
struct Farthest<'a> {
    below: &'a Mask,
    metric: Metric,
    squared: f64,
    at: [u32; 2],
}

impl Farthest<'_> {
    /// Searches runs, sorted by row. The distances of two pixels differ by at most their own, so a
    /// pixel in their middle bounds the largest distance.
    fn search(&mut self, runs: &[(u32, Range<u32>)]) {
        let (row, columns) = match runs {
            [] => return,
            [(row, columns)] => return self.within(*row, columns.clone()),
            _ => &runs[runs.len() / 2],
        };
        let column = columns.start + (columns.end - columns.start) / 2;
        let aside = runs.iter().map(|(_, c)| column.abs_diff(c.start).max(column.abs_diff(c.end)));
        let aside = aside.max().unwrap_or_default();
        let along = (row - runs[0].0).max(runs[runs.len() - 1].0 - row);
        // Only a larger square matters; the margin takes up the rounding of roots.
        let least = self.squared.sqrt() - self.metric.squared(aside, along).sqrt() - 1e-6;
        let squared = self.measure(column, *row, least.max(0.0).powi(2));
        if squared.sqrt() >= least {
            let (upper, lower) = runs.split_at(runs.len() / 2);
            self.search(upper);
            self.search(lower);
        }
    }

    /// Searches columns of a row. One step to the next pixel changes the distance by at most a width,
    /// so the middle of the columns bounds the largest distance.
    fn within(&mut self, row: u32, columns: Range<u32>) {
        let middle = columns.start + (columns.end - columns.start) / 2;
        let half = middle - columns.start;
        let least = self.squared.sqrt() - f64::from(half) - 1e-6;
        let squared = self.measure(middle, row, least.max(0.0).powi(2));
        if half > 0 && squared.sqrt() >= least {
            self.within(row, columns.start..middle);
            if middle + 1 < columns.end {
                self.within(row, middle + 1..columns.end);
            }
        }
    }

    /// Returns the squared distance of a pixel to the nearest white, or an upper bound of it below
    /// `enough`. Remembers the first pixel of the largest distance.
    fn measure(&mut self, column: u32, row: u32, enough: f64) -> f64 {
        let squared = nearest(self.below, [column, row], self.metric, enough);
        if squared > self.squared {
            (self.squared, self.at) = (squared, [column, row]);
        }
        squared
    }
}

/// Returns the squared distance in widths from a pixel's center to the nearest white one's, or to
/// one that is nearer than `enough`, squared.
fn nearest(mask: &Mask, [column, row]: [u32; 2], metric: Metric, enough: f64) -> f64 {
    let mut nearest = f64::INFINITY;
    for distance in 0..mask.height() {
        // Rows at this distance hold nothing nearer.
        if metric.squared(0, distance) >= nearest || nearest < enough {
            break;
        }
        for near in [row.checked_sub(distance), row.checked_add(distance)] {
            let near = near.filter(|near| *near < mask.height());
            if let Some(aside) = near.and_then(|near| aside(mask, column, near)) {
                nearest = nearest.min(metric.squared(aside, distance));
            }
        }
    }
    nearest
}

/// Returns the distance in a row from a column to the nearest white one.
fn aside(mask: &Mask, column: u32, row: u32) -> Option<u32> {
    let transitions = mask.row(row);
    let passed = transitions.partition_point(|&t| t <= column);
    if passed % 2 == 1 {
        return Some(0);
    }
    let left = passed.checked_sub(1).map(|end| column - (transitions[end] - 1));
    let right = transitions.get(passed).map(|start| start - column);
    left.into_iter().chain(right).min()
}
