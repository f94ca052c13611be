//! Shapes that are wide everywhere, found without thinning them.
//!
//! Thinning takes simple pixels away, in any order. So it leaves only the pixels deep inside if no
//! pixel must stay as the end of a wall, and if the pixels deep inside are connected as the shape
//! is: exactly one component of them is in each component of the shape, and exactly one hole of the
//! shape is in each of their holes (Ronse 1986, "A topological characterization of thinning").
//! Pixels near an edge are connected with the black nearby, so each hole of the pixels deep inside
//! has a hole of the shape, and equal numbers of holes are enough.

use super::components::ComponentRuns;
use super::edge_map::{EdgeMap, EdgePixel, EdgeRun, near_pixels};
use super::row_runs::{RowRuns, first_past};

/// Returns whether thinning leaves only the pixels deep inside, if no pixel for which `must_stay`
/// holds is the deepest among its neighbors.
pub(super) fn is_wide(edge: &EdgeMap, must_stay: impl Fn(&EdgePixel) -> bool) -> bool {
    is_connected_alike(edge) && !has_end(edge, must_stay)
}

/// Returns whether what is deep inside is connected as the shape is.
fn is_connected_alike(edge: &EdgeMap) -> bool {
    let [mut shape, mut deep] = [RowRuns::new(), RowRuns::new()];
    // The run of the shape that each deep run is in.
    let mut around = Vec::new();
    let (mut row_shape, mut row_deep) = (Vec::new(), Vec::new());
    for row in 0..edge.height() {
        row_shape.clear();
        row_deep.clear();
        for run in edge.row(row.into()) {
            match row_shape.last_mut() {
                Some((_, end)) if *end == run.columns.0 => *end = run.columns.1,
                _ => row_shape.push(run.columns),
            }
            if run.first.is_none() {
                row_deep.push(run.columns);
                around.push(shape.all().len() + row_shape.len() - 1);
            }
        }
        shape.push(&row_shape);
        deep.push(&row_deep);
    }
    let [shape, deep] = [shape, deep].map(ComponentRuns::of);
    let mut deep_parts = vec![0; shape.run_count()];
    deep.firsts().for_each(|run| deep_parts[shape.first(around[run])] += 1);
    shape.firsts().all(|run| deep_parts[run] == 1) && shape.holes() == deep.holes()
}

/// Returns whether a pixel that must stay is the deepest among its neighbors.
fn has_end(edge: &EdgeMap, must_stay: impl Fn(&EdgePixel) -> bool) -> bool {
    (0..edge.height()).any(|row| {
        let runs = edge.row(row.into());
        let [mut above, mut below] = [-1, 1].map(|step| EdgeCursor {
            edge,
            runs: edge.row(i64::from(row) + step),
            place: 0,
        });
        let others = (0..runs.len()).filter(|&run| !deepens(edge, runs, run)).map(|run| &runs[run]);
        near_pixels(row, others).any(|pixel| {
            let own = edge.depth(pixel.index);
            let is_deepest = below.depth(pixel.column) <= own && above.depth(pixel.column) <= own;
            is_deepest && must_stay(&pixel)
        })
    })
}

/// Returns whether each pixel of a run has a deeper one next to it, up to the pixels deep inside.
fn deepens(edge: &EdgeMap, runs: &[EdgeRun], run: usize) -> bool {
    let EdgeRun { columns: (start, end), first: Some(first) } = runs[run] else { return true };
    let depths = (first..first + (end - start) as u32).map(|index| edge.depth(index));
    // Strictly, as pixels of equal depth are both the deepest.
    if runs.get(run + 1).is_some_and(|next| next.columns.0 == end) {
        depths.is_sorted_by(|a, b| a < b)
    } else if run > 0 && runs[run - 1].columns.1 == start {
        depths.is_sorted_by(|a, b| a > b)
    } else {
        false
    }
}

/// A place in a row of an edge map, which pixels pass from the left.
struct EdgeCursor<'a> {
    edge: &'a EdgeMap,
    runs: &'a [EdgeRun],
    place: usize,
}

impl EdgeCursor<'_> {
    /// Returns the depth of a pixel: zero if it is black, the greatest deep inside.
    fn depth(&mut self, column: i32) -> u32 {
        self.place = first_past(self.runs, |run| run.columns.1, column, self.place);
        match self.runs.get(self.place) {
            Some(run) if run.columns.0 <= column => {
                let index = |first| first + (column - run.columns.0) as u32;
                run.first.map_or(u32::MAX, |first| self.edge.depth(index(first)))
            }
            _ => 0,
        }
    }
}
