//! The unit that a lattice repeats: a copy, or a copy and its half turn.

use std::rc::Rc;

use lamp_stack::Orientation;

use super::super::super::Layout;
use super::super::no_fit::{NoFitRegion, NoFitRegions};
use super::{CopyLattice, Shift};

/// The no-fit regions of a copy and its half turn.
pub(super) struct Motif {
    /// Of a copy with another.
    own: Rc<NoFitRegion>,
    /// Of half turns, if they are allowed.
    turned: Option<TurnedRegions>,
    /// The white cells of a copy.
    pub(super) white: i64,
}

struct TurnedRegions {
    /// Of a half turn with another.
    own: Rc<NoFitRegion>,
    /// Of a half turn that moves past a copy.
    moving: Rc<NoFitRegion>,
    /// Of a copy that moves past a half turn.
    placed: Rc<NoFitRegion>,
}

impl Motif {
    /// Creates the motif of a stack, as it lies or with rows for columns.
    pub(super) fn new(
        layout: &Layout,
        regions: &mut NoFitRegions,
        stack: usize,
        transposed: bool,
        half: bool,
    ) -> Self {
        // Mirrored and turned by a quarter, columns are rows.
        let quarters = u32::from(transposed);
        let [copy, turned] = [quarters, quarters + 2]
            .map(|quarters| (stack, Orientation::new(quarters, transposed)));
        let mut no_fit = |moving, placed| regions.no_fit(layout, moving, placed);
        Self {
            own: no_fit(copy, copy),
            turned: half.then(|| TurnedRegions {
                own: no_fit(turned, turned),
                moving: no_fit(turned, copy),
                placed: no_fit(copy, turned),
            }),
            white: regions.white(layout, copy),
        }
    }

    /// Returns where half turns do not fit next to a copy, if they are allowed.
    pub(super) fn turned(&self) -> Option<&NoFitRegion> {
        self.turned.as_ref().map(|turned| &*turned.moving)
    }

    /// Returns the displacements at which a copy and its partner do not fit next to another two.
    pub(super) fn region(&self, partner: Option<Shift>) -> NoFitRegion {
        let mut all = vec![(&*self.own, [0, 0])];
        if let (Some(turned), Some([x, y])) = (&self.turned, partner) {
            // The half turn of a pair at v is at v + p. It meets a copy at 0 where `moving` holds
            // that place.
            all.push((&turned.own, [0, 0]));
            all.push((&turned.moving, [-x, -y]));
            all.push((&turned.placed, [x, y]));
        }
        NoFitRegion::united(&all)
    }

    /// Whether no two copies of a lattice are too near.
    pub(super) fn allows(&self, lattice: &CopyLattice) -> bool {
        let Some(([x, y], turned)) = lattice.partner.zip(self.turned.as_ref()) else {
            return lattice.is_clear([self.own.reach], |at| self.own.holds(at));
        };
        let clear = !turned.moving.holds([x, y]);
        let reach = |region: &NoFitRegion| {
            let [across, down] = region.reach;
            [across + x.abs(), down + y.abs()]
        };
        clear
            && lattice.is_clear([reach(&self.own), reach(&turned.moving)], |at| {
                self.own.holds(at)
                    || turned.own.holds(at)
                    || turned.moving.holds([at[0] + x, at[1] + y])
                    || turned.placed.holds([at[0] - x, at[1] - y])
            })
    }
}

impl CopyLattice {
    /// Whether a region that reaches so far holds none of its points on one side of the first.
    pub(super) fn is_clear<const N: usize>(
        &self,
        reaches: [Shift; N],
        holds: impl Fn(Shift) -> bool,
    ) -> bool {
        let [[ux, uy], [vx, vy]] = [self.along, self.across];
        let wide =
            |[x, y]: Shift| i64::from(x) * i64::from(uy) + i64::from(y) * i64::from(ux.abs());
        let both = i64::from(uy) * i64::from(vx) - i64::from(ux) * i64::from(vy);
        // As `Room::ranges` counts: the first vector leads down, and the second to the right of it.
        if uy <= 0 || both <= 0 {
            return false;
        }
        // On line l the cross product with the first vector is l det, and over the region at most
        // `wide`.
        let most = reaches.map(wide).into_iter().max().unwrap_or(0) / both;
        let down = reaches.map(|reach| reach[1]).into_iter().max().unwrap_or(0);
        (0..=most as i32).all(|l| {
            // A point and its opposite are one pair of copies, so half of the line through 0 is
            // enough.
            let first = if l == 0 { 1 } else { (-down - l * vy).div_euclid(uy) };
            let last = (down - l * vy).div_euclid(uy);
            (first..=last).all(|k| !holds([k * ux + l * vx, k * uy + l * vy]))
        })
    }
}
