//! Lines of facets along rows, clipped to a layer's heights.

use lamp_slicing::Turn;
use lamp_slicing::scan::RowFacet;
use lamp_stack::Grouped;

use crate::sweep::{SlopeLine, Toggle};

/// The lines of facets between two heights, as rows see them.
#[derive(Debug, Default)]
pub(crate) struct RowCuts {
    pub(crate) toggles: Vec<Toggle>,
    pub(crate) slopes: Vec<SlopeLine>,
}

impl RowCuts {
    /// Adds a body's facet between two heights (micrometers), as some rows see it.
    pub(crate) fn add_facet(&mut self, facet: &RowFacet, body: u32, rows: [u32; 2], z: [f64; 2]) {
        let seen = facet.rows_between(z);
        let seen = seen.start.max(rows[0])..seen.end.min(rows[1]);
        facet.for_each_row(seen, |row, [long, short]| {
            self.add(row, [long, short], facet.is_flipped(), body, z);
        });
    }

    /// Adds a facet's line in a row, between points of its long and one of its short edges.
    #[inline]
    pub(crate) fn add(
        &mut self,
        row: u32,
        ends: [[f64; 2]; 2],
        is_flipped: bool,
        body: u32,
        z: [f64; 2],
    ) {
        let [long, short] = ends;
        let [bottom, top] = z;
        let (mut low, mut high) = if long[1] <= short[1] { (long, short) } else { (short, long) };
        // A corner on the layer's bottom counts as below it.
        if high[1] <= bottom || low[1] > top {
            return;
        }
        // With z up and x to the right, the part is on the left of the line from
        // start to end if the facet faces outwards.
        let (start, end) = if is_flipped { (short, long) } else { (long, short) };
        let [from, to] = [low, high];
        let per_um = (to[0] - from[0]) / (to[1] - from[1]);
        let at = |z: f64| [from[0] + per_um * (z - from[1]), z];
        if from[1] <= bottom {
            low = at(bottom);
            let turn = Turn::new(body, if start[1] > end[1] { 1 } else { -1 });
            self.toggles.push(Toggle { row, x: low[0], turn });
        }
        if to[1] > top {
            high = at(top);
        }
        // An upright line has no columns above it: its toggle records its effect.
        if low[0] != high[0] {
            let (left, right) = if low[0] < high[0] { (low, high) } else { (high, low) };
            let turn = Turn::new(body, if start[0] < end[0] { 1 } else { -1 });
            let heights = [left[1] - bottom, right[1] - bottom];
            self.slopes.push(SlopeLine { row, x: [left[0], right[0]], heights, turn });
        }
    }
}

/// The lines that rows see, row by row.
pub(crate) struct CutRows {
    toggles: Grouped<Toggle>,
    slopes: Grouped<SlopeLine>,
}

impl CutRows {
    /// Groups the cuts of some rows, from the first on.
    pub(crate) fn new(cuts: &RowCuts, first: u32, rows: usize) -> Self {
        let toggle = |toggle: &Toggle| ((toggle.row - first) as usize, *toggle);
        let slope = |slope: &SlopeLine| ((slope.row - first) as usize, *slope);
        Self {
            toggles: Grouped::new(rows, || cuts.toggles.iter().map(toggle)),
            slopes: Grouped::new(rows, || cuts.slopes.iter().map(slope)),
        }
    }

    /// Returns the lines that a row sees, sorted from the left; `row` counts from the first.
    pub(crate) fn sorted_row(&mut self, row: usize) -> (&[Toggle], &[SlopeLine]) {
        let (toggles, slopes) = (self.toggles.group_mut(row), self.slopes.group_mut(row));
        toggles.sort_unstable_by(|a, b| a.x.total_cmp(&b.x));
        slopes.sort_unstable_by(|a, b| a.x[0].total_cmp(&b.x[0]));
        (toggles, slopes)
    }
}
