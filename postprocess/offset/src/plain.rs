//! Runs that are so plain that no wall can be thin there.
//!
//! A run of the shape is plain if exactly one run of it is deep inside, with few pixels on either
//! side of that, and if it touches exactly one run each in the rows above and below, whose deep
//! runs touch its own. There the shape goes where its deep inside goes, so the skeleton need not
//! be looked for. Most rows of a part are plain, which makes this worth its lines.

use super::edge_map::{EdgeMap, EdgeRun};
use super::row_runs::{RowRuns, Run};

/// A run of the shape in a row.
#[derive(Clone, Debug)]
struct ShapeRun {
    /// The pixels deep inside, if they are one run.
    deep: Option<Run>,
    /// The number of runs that it touches in the rows above and below.
    touches: [u32; 2],
    /// The distance in rows to a run that is not plain.
    rows_away: u32,
    /// The end of its edge runs, counted through the map.
    edge_runs_end: usize,
}

/// Returns for each run of an edge map whether it and all runs up to `margin` rows away are plain.
/// On each side up to `beside` pixels need not be deep inside.
pub(super) fn plain_runs(edge: &EdgeMap, beside: i32, margin: u32) -> Vec<bool> {
    let (shape, mut runs) = shape_runs(edge, beside);
    let mut pairs = Vec::new();
    shape.for_each_touching(|upper, lower| {
        pairs.push((upper, lower));
        runs[upper].touches[1] += 1;
        runs[lower].touches[0] += 1;
    });
    for run in &mut runs {
        run.rows_away = if run.deep.is_some() && run.touches == [1, 1] { u32::MAX } else { 0 };
    }
    for &(upper, lower) in &pairs {
        let touch = runs[upper].deep.zip(runs[lower].deep);
        if !touch.is_some_and(|(a, b)| a.0 <= b.1 && b.0 <= a.1) {
            (runs[upper].rows_away, runs[lower].rows_away) = (0, 0);
        }
    }
    // Distances go down the rows, then up.
    for &(upper, lower) in &pairs {
        let past_upper = runs[upper].rows_away.saturating_add(1);
        runs[lower].rows_away = runs[lower].rows_away.min(past_upper);
    }
    for &(upper, lower) in pairs.iter().rev() {
        let past_lower = runs[lower].rows_away.saturating_add(1);
        runs[upper].rows_away = runs[upper].rows_away.min(past_lower);
    }
    let mut plain = Vec::new();
    for run in &runs {
        plain.resize(run.edge_runs_end, run.rows_away > margin);
    }
    plain
}

/// Returns the runs of the shape, which the runs of its edge map form.
fn shape_runs(edge: &EdgeMap, beside: i32) -> (RowRuns, Vec<ShapeRun>) {
    let (mut shape, mut runs) = (RowRuns::new(), Vec::new());
    let (mut row_runs, mut edge_runs_end) = (Vec::new(), 0);
    for row in 0..edge.height() {
        row_runs.clear();
        for edge_runs in edge.row(row.into()).chunk_by(|a, b| a.columns.1 == b.columns.0) {
            let run = (edge_runs[0].columns.0, edge_runs[edge_runs.len() - 1].columns.1);
            let deep = deep_run(edge_runs)
                .filter(|deep| deep.0 - run.0 <= beside && run.1 - deep.1 <= beside);
            edge_runs_end += edge_runs.len();
            row_runs.push(run);
            runs.push(ShapeRun { deep, touches: [0; 2], rows_away: 0, edge_runs_end });
        }
        shape.push(&row_runs);
    }
    (shape, runs)
}

/// Returns the columns deep inside, if they are one run.
fn deep_run(edge_runs: &[EdgeRun]) -> Option<Run> {
    let is_deep = |run: &EdgeRun| run.first.is_none();
    let first = edge_runs.iter().position(is_deep)?;
    let last = edge_runs.iter().rposition(is_deep)?;
    let is_one = edge_runs[first..=last].iter().all(is_deep);
    is_one.then(|| (edge_runs[first].columns.0, edge_runs[last].columns.1))
}
