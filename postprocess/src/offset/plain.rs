//! Where a shape is so plain that no wall can be thin there.
//!
//! In a row a run of the shape is plain if it holds one run that is deep inside,
//! with little on either side of that, and touches one run each in the rows above
//! and below that is like it, their deep runs touching, too. There the shape goes
//! where its deep inside goes, and nothing needs to be looked after.

use super::edge_map::{EdgeMap, EdgeRun};

/// A run of the shape in a row.
#[derive(Clone, Debug)]
struct ShapeRun {
    start: i32,
    end: i32,
    /// The pixels deep inside, if they are one run.
    deep: Option<(i32, i32)>,
    /// How many runs of the rows above and below it touches.
    touches: [u32; 2],
    /// How many rows away something is not plain.
    away: u32,
    /// The end of its edge_runs.
    edge_runs_end: usize,
}

/// For each run of an edge, whether it lies in a run that is plain, as are
/// those within `margin` rows. On each side there may be `beside` pixels that
/// are not deep inside.
pub(super) fn plain_runs(edge: &EdgeMap, beside: i32, margin: u32) -> Vec<bool> {
    let (mut runs, pairs) = stretches(edge, beside);
    for &(upper, lower) in &pairs {
        runs[upper].touches[1] += 1;
        runs[lower].touches[0] += 1;
    }
    for run in &mut runs {
        run.away = if run.deep.is_some() && run.touches == [1, 1] { u32::MAX } else { 0 };
    }
    for &(upper, lower) in &pairs {
        let touch = runs[upper].deep.zip(runs[lower].deep);
        if !touch.is_some_and(|(a, b)| a.0 <= b.1 && b.0 <= a.1) {
            (runs[upper].away, runs[lower].away) = (0, 0);
        }
    }
    for &(upper, lower) in &pairs {
        runs[lower].away = runs[lower].away.min(runs[upper].away.saturating_add(1));
    }
    for &(upper, lower) in pairs.iter().rev() {
        runs[upper].away = runs[upper].away.min(runs[lower].away.saturating_add(1));
    }
    let mut plain = Vec::new();
    for run in &runs {
        plain.resize(run.edge_runs_end, run.away > margin);
    }
    plain
}

/// The runs of all rows, and which of them touch, upper and lower, row by row.
fn stretches(edge: &EdgeMap, beside: i32) -> (Vec<ShapeRun>, Vec<(usize, usize)>) {
    let mut runs: Vec<ShapeRun> = Vec::new();
    let mut pairs = Vec::new();
    let (mut above, mut edge_runs_end) = (0, 0);
    for row in 0..edge.height() {
        let first = runs.len();
        for edge_runs in edge.row(row.into()).chunk_by(|a, b| a.columns.1 == b.columns.0) {
            edge_runs_end += edge_runs.len();
            runs.push(stretch(edge_runs, beside, edge_runs_end));
        }
        let (mut upper, mut lower) = (above, first);
        while upper < first && lower < runs.len() {
            let [a, b] = [&runs[upper], &runs[lower]];
            if a.start <= b.end && b.start <= a.end {
                pairs.push((upper, lower));
            }
            if a.end < b.end {
                upper += 1;
            } else {
                lower += 1;
            }
        }
        above = first;
    }
    (runs, pairs)
}

fn stretch(edge_runs: &[EdgeRun], beside: i32, edge_runs_end: usize) -> ShapeRun {
    let [start, end] = [edge_runs[0].columns.0, edge_runs[edge_runs.len() - 1].columns.1];
    let is_deep = |run: &EdgeRun| run.first.is_none();
    let first = edge_runs.iter().position(is_deep);
    let last = edge_runs.iter().rposition(is_deep);
    let deep = first.zip(last).and_then(|(first, last)| {
        let (from, to) = (edge_runs[first].columns.0, edge_runs[last].columns.1);
        let is_one = edge_runs[first..=last].iter().all(is_deep);
        (is_one && from - start <= beside && end - to <= beside).then_some((from, to))
    });
    ShapeRun { start, end, deep, touches: [0; 2], away: 0, edge_runs_end }
}
