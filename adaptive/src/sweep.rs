//! Sweeps a row of a part between two heights from left to right.
//!
//! Facets are lines over x here. All columns between two neighboring ends of lines pass the same
//! lines in the same order. Going up such a column, the part begins and ends in turn, and the
//! layer's top decides which of these stretches the layer lacks or has too much. Nothing is sampled
//! along x or z.
//!
//! Most columns pass one facet at most. There, facets alone give the volume lost and gained,
//! without rows ([`FacetSums`](crate::facets::FacetSums)). So rows need only add how other columns
//! differ from that.

use lamp_slicing::{FillRule, Position, Side, Turn};

use crate::facets::outline;
use crate::profile::{ChangeProfile, EVEN, SurfacePiece};

/// A point where the part's surface crosses the layer's bottom in a row.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Toggle {
    pub(crate) row: u32,
    pub(crate) x: f64,
    /// Up if the part is on the right, down if it is on the left.
    pub(crate) turn: Turn,
}

/// A facet's line along a row: its two ends, the left one first, with their heights
/// in micrometers above the layer's bottom.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SlopeLine {
    pub(crate) row: u32,
    pub(crate) x: [f64; 2],
    pub(crate) heights: [f64; 2],
    /// Up if the part is above, down if it is below.
    pub(crate) turn: Turn,
}

impl SlopeLine {
    #[inline]
    fn height(&self, x: f64) -> f64 {
        let [a, b] = self.x;
        if x == b {
            return self.heights[1];
        }
        self.heights[0] + (self.heights[1] - self.heights[0]) * ((x - a) / (b - a))
    }
}

/// The content that rows add to a profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RowsAdd {
    /// Everything in the rows.
    All,
    /// The differences from facets alone, each taken as if no other were above or below.
    Differences,
}

/// Adds rows to a profile. Lists keep their memory from row to row.
#[derive(Debug)]
pub(crate) struct Sweep<'a> {
    rule: &'a FillRule,
    side: Side,
    pitch_mm: f64,
    adds: RowsAdd,
    ends: Vec<f64>,
    open: Vec<SlopeLine>,
}

/// How often columns are split where surfaces pass through each other, at most.
const MAX_SPLITS: u32 = 12;

impl<'a> Sweep<'a> {
    pub(crate) fn new(rule: &'a FillRule, side: Side, pitch_mm: f64, adds: RowsAdd) -> Self {
        Self { rule, side, pitch_mm, adds, ends: Vec::new(), open: Vec::new() }
    }

    /// Adds a row, whose toggles and slopes are sorted from the left. Returns false
    /// and adds nothing if the row does not balance, because the mesh has a gap.
    pub(crate) fn add(
        &mut self,
        toggles: &[Toggle],
        slopes: &[SlopeLine],
        profile: &mut ChangeProfile<'_>,
    ) -> bool {
        if toggles.is_empty() && slopes.is_empty() {
            return true;
        }
        let mut position = Position::outside(self.rule);
        position.start_row(toggles.iter().map(|toggle| toggle.turn));
        toggles.iter().for_each(|toggle| position.cross(toggle.turn));
        if !position.is_balanced() {
            return false;
        }
        self.columns(toggles, slopes, |sweep, columns, position, winding| {
            let known = if sweep.adds == RowsAdd::All { 0 } else { winding };
            let differs = i32::from(position.is_inside()) - known;
            profile.bottom_area += f64::from(differs) * (columns[1] - columns[0]) * sweep.pitch_mm;
            match sweep.open.len() {
                0 => {}
                1 if differs == 0 && sweep.is_told(sweep.open[0], position) => {
                    let extent = (columns[1] - columns[0]) * sweep.pitch_mm;
                    let heights = columns.map(|x| sweep.open[0].height(x));
                    profile.add_unavoidable(extent, heights, false);
                }
                1 => sweep.pass(columns, position, profile),
                _ => sweep.split(columns, position, MAX_SPLITS, profile),
            }
        });
        true
    }

    /// Calls `each` with all columns between two neighboring ends of lines, while the lines
    /// over them are open, with the position at the layer's bottom and the winding number there.
    fn columns(
        &mut self,
        toggles: &[Toggle],
        slopes: &[SlopeLine],
        mut each: impl FnMut(&mut Self, [f64; 2], &Position<'a>, i32),
    ) {
        self.ends.clear();
        self.ends.extend(toggles.iter().map(|toggle| toggle.x));
        self.ends.extend(slopes.iter().flat_map(|slope| slope.x));
        self.ends.sort_unstable_by(f64::total_cmp);
        self.open.clear();
        let (mut toggles, mut slopes) = (toggles.iter(), slopes.iter());
        let (mut position, mut winding) = (Position::outside(self.rule), 0);
        position.start_row(toggles.clone().map(|toggle| toggle.turn));
        for k in 1..self.ends.len() {
            let columns = [self.ends[k - 1], self.ends[k]];
            if columns[0] == columns[1] {
                continue;
            }
            while let Some(toggle) = next_until(&mut toggles, |toggle| toggle.x <= columns[0]) {
                position.cross(toggle.turn);
                winding += toggle.turn.winding();
            }
            self.open.retain(|slope| slope.x[1] > columns[0]);
            while let Some(slope) = next_until(&mut slopes, |slope| slope.x[0] <= columns[0]) {
                if slope.x[1] > columns[0] {
                    self.open.push(*slope);
                }
            }
            each(self, columns, &position, winding);
        }
    }

    /// Calls `untold` with ranges of height in which facets do not give a row completely: where
    /// lines are no more than `reach_um` above each other, or where a line separates neither
    /// outside below from inside above nor the reverse.
    pub(crate) fn untold(
        &mut self,
        toggles: &[Toggle],
        slopes: &[SlopeLine],
        reach_um: f64,
        mut untold: impl FnMut([f64; 2]),
    ) {
        self.columns(toggles, slopes, |sweep, columns, position, winding| {
            let middle = 0.5 * (columns[0] + columns[1]);
            sweep.open.sort_unstable_by(|p, q| p.height(middle).total_cmp(&q.height(middle)));
            let mut above = position.clone();
            let is_known = i32::from(position.is_inside()) == winding;
            if !is_known || !sweep.open.iter().all(|slope| tells(slope.turn, &mut above)) {
                return untold([f64::NEG_INFINITY, f64::INFINITY]);
            }
            for pair in sweep.open.windows(2) {
                let [low, high] = [0, 1].map(|line: usize| columns.map(|x| pair[line].height(x)));
                if (0..2).any(|end| high[end] - low[end] <= reach_um) {
                    let ends = [low[0], low[1], high[0], high[1]];
                    untold([
                        ends.into_iter().fold(f64::INFINITY, f64::min),
                        ends.into_iter().fold(f64::NEG_INFINITY, f64::max),
                    ]);
                }
            }
        });
    }

    /// Returns true if facets give a line completely that has no other line above or below it.
    fn is_told(&self, slope: SlopeLine, position: &Position<'_>) -> bool {
        self.adds == RowsAdd::Differences && tells(slope.turn, &mut position.clone())
    }

    /// Adds columns over several lines; those on either side of a place where two
    /// lines cross separately.
    fn split(
        &mut self,
        columns: [f64; 2],
        position: &Position<'_>,
        splits: u32,
        profile: &mut ChangeProfile<'_>,
    ) {
        let [a, b] = columns;
        let middle = 0.5 * (a + b);
        self.open.sort_unstable_by(|p, q| p.height(middle).total_cmp(&q.height(middle)));
        let crossing = self.open.windows(2).find_map(|pair| {
            let gap = |x: f64| pair[1].height(x) - pair[0].height(x);
            let end = [a, b].into_iter().find(|&end| gap(end) < -1e-9)?;
            let x = middle + (end - middle) * (gap(middle) / (gap(middle) - gap(end)));
            (a < x && x < b).then_some(x)
        });
        match crossing {
            Some(x) if splits > 0 => {
                self.split([a, x], position, splits - 1, profile);
                self.split([x, b], position, splits - 1, profile);
            }
            _ => self.pass(columns, position, profile),
        }
    }

    /// Adds columns over lines that are sorted from below.
    fn pass(&self, columns: [f64; 2], position: &Position<'_>, profile: &mut ChangeProfile<'_>) {
        let extent = (columns[1] - columns[0]) * self.pitch_mm;
        let mut position = position.clone();
        let mut inside = position.is_inside();
        // The height inside each of the two columns, as if they ended outside.
        let mut within = [0.0; 2];
        // The height, up to the line before, that is not as it is just above it.
        let mut unlike = [0.0; 2];
        let mut is_first = true;
        for slope in &self.open {
            position.cross(slope.turn);
            let heights = columns.map(|x| slope.height(x));
            let mut seen = SectionChange::default();
            if position.is_inside() != inside {
                let before = unlike.map(|unlike| -unlike);
                unlike = [heights[0] - unlike[0], heights[1] - unlike[1]];
                let sign = if inside { 1.0 } else { -1.0 };
                within = [within[0] + sign * heights[0], within[1] + sign * heights[1]];
                let [lost, gained] = if inside { [unlike, before] } else { [before, unlike] };
                let outline = if is_first { outline(self.side, !inside) } else { 0.0 };
                seen = SectionChange { section: -sign, outline, lost, gained };
                (inside, is_first) = (!inside, false);
            }
            if self.adds == RowsAdd::Differences {
                seen = seen.without(SectionChange::of_one(self.side, slope.turn, heights));
            }
            if seen != SectionChange::default() {
                let SectionChange { section, outline, lost, gained } = seen;
                let density = EVEN;
                profile.add(SurfacePiece {
                    heights,
                    extent,
                    density,
                    section,
                    outline,
                    lost,
                    gained,
                });
            }
        }
        profile.add_unavoidable(extent, within, inside);
    }
}

/// Moves past a line from below. Returns true if that leads from outside to inside where the part
/// is above the line, and from inside to outside where it is below.
fn tells(turn: Turn, position: &mut Position<'_>) -> bool {
    let below = position.is_inside();
    position.cross(turn);
    i32::from(position.is_inside()) - i32::from(below) == turn.winding()
}

/// The change by a line once the top is past it: of the section, of all sections together and, at
/// its two ends, of the heights lost and gained.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SectionChange {
    section: f64,
    outline: f64,
    lost: [f64; 2],
    gained: [f64; 2],
}

impl SectionChange {
    /// Returns the change by a line that no other is above or below.
    fn of_one(side: Side, turn: Turn, heights: [f64; 2]) -> Self {
        let enters = turn.winding() != -1;
        let outline = outline(side, enters);
        match enters {
            false => Self { section: -1.0, outline, lost: heights, gained: [0.0; 2] },
            true => Self { section: 1.0, outline, lost: [0.0; 2], gained: heights },
        }
    }

    fn without(self, other: Self) -> Self {
        let less = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
        Self {
            section: self.section - other.section,
            outline: self.outline - other.outline,
            lost: less(self.lost, other.lost),
            gained: less(self.gained, other.gained),
        }
    }
}

fn next_until<'a, T>(
    items: &mut std::slice::Iter<'a, T>,
    is_due: impl Fn(&T) -> bool,
) -> Option<&'a T> {
    let due = items.as_slice().first().is_some_and(is_due);
    if due { items.next() } else { None }
}

#[cfg(test)]
mod tests {
    use lamp_slicing::Fill;

    use super::*;
    use crate::profile::ProfileChange;

    fn toggle(x: f64, winding: i32) -> Toggle {
        Toggle { row: 0, x, turn: Turn::new(0, winding) }
    }

    fn slope(x: [f64; 2], heights: [f64; 2], winding: i32) -> SlopeLine {
        SlopeLine { row: 0, x, heights, turn: Turn::new(0, winding) }
    }

    fn changes(fill: Fill, toggles: &[Toggle], slopes: &[SlopeLine]) -> Vec<ProfileChange> {
        changes_on(Side::Both, fill, toggles, slopes)
    }

    fn changes_on(
        side: Side,
        fill: Fill,
        toggles: &[Toggle],
        slopes: &[SlopeLine],
    ) -> Vec<ProfileChange> {
        let mut profile = ChangeProfile::new(&[10.0, 20.0, 40.0]);
        Sweep::new(&fill.into(), side, 1.0, RowsAdd::All).add(toggles, slopes, &mut profile);
        profile.changes()
    }

    fn change(area: f64, lost: f64, gained: f64) -> ProfileChange {
        ProfileChange { area, lost, gained, ..ProfileChange::default() }
    }

    /// A wall that leans in by 1 over 40, and one that leans out.
    #[test]
    fn walls_lose_and_gain() {
        let toggles = [toggle(0.0, 1), toggle(5.0, -1)];
        let slopes = [slope([0.0, 4.0], [0.0, 40.0], -1), slope([5.0, 9.0], [0.0, 40.0], 1)];
        for fill in [Fill::EvenOdd, Fill::Solid] {
            let found = changes(fill, &toggles, &slopes);
            assert_eq!(
                found,
                [change(0.0, 5.0, 5.0), change(0.0, 20.0, 20.0), change(0.0, 80.0, 80.0)]
            );
        }
    }

    /// A plate from 12 to 15: tops above it lose it, and tops in it gain from 0 to 12.
    #[test]
    fn columns_that_pass_several_lines_have_what_is_between() {
        let slopes = [slope([0.0, 2.0], [12.0; 2], 1), slope([0.0, 2.0], [25.0; 2], -1)];
        for fill in [Fill::EvenOdd, Fill::Solid] {
            let found = changes(fill, &[], &slopes);
            assert_eq!(
                found,
                [change(0.0, 0.0, 0.0), change(2.0, 0.0, 24.0), change(0.0, 26.0, 0.0)]
            );
        }
    }

    /// A plate over a block that ends at 5: the first surface decides what all sections have.
    #[test]
    fn all_sections_together_change_at_the_first_surface() {
        let toggles = [toggle(0.0, 1), toggle(2.0, -1)];
        let slopes = [
            slope([0.0, 2.0], [5.0; 2], -1),
            slope([0.0, 4.0], [12.0; 2], 1),
            slope([0.0, 4.0], [25.0; 2], -1),
        ];
        for (side, expected) in [
            (Side::Outside, [0.0, 2.0, 2.0]),
            (Side::Inside, [-2.0, -2.0, -2.0]),
            (Side::Both, [0.0; 3]),
        ] {
            let found = changes_on(side, Fill::Solid, &toggles, &slopes);
            let found: Vec<f64> = found.iter().map(|change| change.outline).collect();
            assert_eq!(found, expected, "{side}");
        }
    }

    /// Two bodies that cross like an X: by even-odd, nothing is inside both.
    #[test]
    fn columns_are_split_where_lines_cross() {
        let slopes = [slope([0.0, 4.0], [5.0, 9.0], 1), slope([0.0, 4.0], [9.0, 5.0], -1)];
        let found = changes(Fill::EvenOdd, &[], &slopes);
        // Two triangles, 4 high and 2 wide.
        assert!((found[0].lost - 8.0).abs() < 1e-9 && found[0].area.abs() < 1e-9);
    }

    #[test]
    fn a_row_with_a_gap_is_left_out() {
        let found = changes(Fill::EvenOdd, &[toggle(0.0, 1)], &[slope([0.0, 1.0], [5.0; 2], 1)]);
        assert!(found.iter().all(|found| *found == ProfileChange::default()));
    }
}
