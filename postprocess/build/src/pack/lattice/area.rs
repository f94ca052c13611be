//! Counts the copies of a lattice that an area holds.

use super::{CopyLattice, Shift};

/// The last column and row at which a copy may begin.
#[derive(Clone, Copy, Debug)]
pub(super) struct LastStart(pub(super) Shift);

/// How many copies an area holds, if a lattice begins at a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub(super) copies: usize,
    pub(super) start: Shift,
}

/// The places at which a lattice is tried, along each side: fewer where there are many lines.
const STARTS: i32 = 24;
const STARTS_OF_LINES: i32 = 4096;

impl LastStart {
    /// Returns the place of a lattice at which the area holds most of its copies, of those tried.
    pub(super) fn best(self, lattice: &CopyLattice) -> Fit {
        let [ux, uy] = lattice.along;
        let [vx, vy] = lattice.across;
        // Along a row, lines in the first vector's direction are det / uy apart.
        let wide = ((i64::from(uy) * i64::from(vx) - i64::from(ux) * i64::from(vy)) / i64::from(uy))
            as i32;
        let lines = self.0[0] / wide.max(1) + self.0[1] / uy + 1;
        let tried = (STARTS_OF_LINES / lines).clamp(1, STARTS);
        // Even steps, and steps that bring a copy to an edge.
        let starts = |axis: usize, period: i32| -> Vec<i32> {
            let last = self.0[axis];
            let aside = lattice.partner.map_or(0, |partner| partner[axis]);
            let edges = [0, -aside, last, last - aside];
            let even = (0..tried).map(|k| k * period / tried);
            even.chain(edges.map(|at| at.rem_euclid(period.max(1)))).collect()
        };
        let (columns, rows) = (starts(0, wide), starts(1, uy));
        let all = columns.iter().flat_map(|&x| rows.iter().map(move |&y| [x, y]));
        let fits = all.map(|start| Fit { copies: self.count(lattice, start), start });
        fits.reduce(|best, fit| if fit.copies > best.copies { fit } else { best })
            .expect("starts are tried")
    }

    fn count(self, lattice: &CopyLattice, start: Shift) -> usize {
        self.ranges(lattice, start).map(|(_, _, [first, last])| (last - first + 1) as usize).sum()
    }

    /// Returns the cells at which copies begin, and whether they are turned by half.
    pub(super) fn shifts(
        self,
        lattice: &CopyLattice,
        start: Shift,
    ) -> impl Iterator<Item = (Shift, bool)> {
        let ([ux, uy], [vx, vy]) = (lattice.along, lattice.across);
        self.ranges(lattice, start).flat_map(move |([x, y, partner], l, [first, last])| {
            let at = move |k| [x + k * ux + l * vx, y + k * uy + l * vy];
            (first..=last).map(move |k| (at(k), partner == 1))
        })
    }

    /// Returns, for a copy and its partner, each multiple of the second vector and the range of
    /// multiples of the first that lie on the area.
    fn ranges(
        self,
        lattice: &CopyLattice,
        [x, y]: Shift,
    ) -> impl Iterator<Item = ([i32; 3], i32, [i32; 2])> {
        let ([ux, uy], [vx, vy]) = (lattice.along, lattice.across);
        let origins = [Some([x, y, 0]), lattice.partner.map(|[dx, dy]| [x + dx, y + dy, 1])];
        let [right, bottom] = self.0;
        origins.into_iter().flatten().flat_map(move |origin| {
            let [x, y, _] = origin;
            // In i64: a product of two sides in cells exceeds an i32. On line l the cross product
            // with the first vector is l det; over a rectangle it is greatest and least at corners.
            let both = i64::from(uy) * i64::from(vx) - i64::from(ux) * i64::from(vy);
            let place = |[left, top]: Shift| {
                i64::from(uy) * i64::from(left - x) - i64::from(ux) * i64::from(top - y)
            };
            let corners = [[0, 0], [right, 0], [0, bottom], [right, bottom]].map(place);
            let [least, most] = [corners.into_iter().min(), corners.into_iter().max()]
                .map(|end| end.unwrap_or(0).div_euclid(both) as i32);
            (least..=most + 1).filter_map(move |l| {
                let mut range = multiples([-y - l * vy, bottom - y - l * vy], uy);
                let [from, to] = [-x - l * vx, right - x - l * vx];
                let across = match ux.signum() {
                    1 => multiples([from, to], ux),
                    -1 => multiples([-to, -from], -ux),
                    _ if from <= 0 && to >= 0 => range,
                    _ => return None,
                };
                range = [range[0].max(across[0]), range[1].min(across[1])];
                (range[0] <= range[1]).then_some((origin, l, range))
            })
        })
    }
}

/// Returns the first and the last multiple of a step within a range.
fn multiples([from, to]: [i32; 2], step: i32) -> [i32; 2] {
    // The floor of the negative is a ceiling.
    [-(-from).div_euclid(step), to.div_euclid(step)]
}
