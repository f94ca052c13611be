//! Crossings on the exact surfaces of B-rep parts.
//!
//! Facets say which rows are crossed, and so keep every row in balance; the
//! surfaces say where. A worker gathers what it finds on facets, (facet, u, v) with
//! each crossing, and [`lamp_brep::polish`]es it in batches ([`batch`](self::batch)) before it
//! goes into the table. Where contours turn, facets miss rows or cross some too
//! many, in pairs: [`turns`](self::turns) puts that right layer by layer.
//!
//! Source: 002 section 2.2, which slices the CAD model itself for the accuracy that
//! facets lose.

mod batch;
mod depths;
mod tally;
mod turns;

use std::ops::Range;
use std::sync::OnceLock;

use lamp_brep::{Placed, Turns};

use batch::Batch;
use depths::Depths;
pub use tally::Polished;
pub(crate) use tally::Tally;
pub(crate) use turns::settle;

use crate::cut::{Cutter, Share};
use crate::model::Surfaces;
use crate::placement::PlacedFacet;

/// A worker's way from consecutive facets of a B-rep model to its share of the table.
pub(crate) struct ExactCut<'a> {
    /// The next facet's number.
    next: u32,
    crossings: Batch<'a>,
    depths: Option<Depths<'a>>,
}

impl<'a> ExactCut<'a> {
    /// For facets from `first` on, and what lies below sections as far as `reach_um`.
    pub(crate) fn new(
        exact: &'a Exact,
        first: u32,
        tally: &'a Tally,
        cutter: Cutter<'a>,
        layers: Range<usize>,
        reach_um: Option<f64>,
    ) -> Self {
        let depths = reach_um.map(|reach_um| Depths::new(exact, cutter, layers.clone(), reach_um));
        Self { next: first, crossings: Batch::new(exact, tally, cutter, layers), depths }
    }

    /// Adds the next facet, and says how many crossings would take as much memory.
    pub(crate) fn cut(&mut self, facet: &PlacedFacet, shares: &mut [Share]) -> usize {
        let number = self.next;
        self.next += 1;
        let below = self.depths.as_mut();
        let below = below.map_or(0, |depths| depths.look_down(number, facet, shares));
        below + self.crossings.cut(number, facet, shares)
    }

    /// Puts into the table what is left.
    pub(crate) fn finish(&mut self, shares: &mut [Share]) {
        self.crossings.finish(shares);
        if let Some(depths) = &mut self.depths {
            depths.finish(shares);
        }
    }
}

/// A B-rep model's surfaces in their place.
#[derive(Debug)]
pub(crate) struct Exact {
    pub(crate) placed: Placed,
    turns: OnceLock<Turns>,
}

impl Exact {
    pub(crate) fn new(surfaces: &Surfaces, rows: [[f64; 4]; 3]) -> Self {
        let placed = Placed::new(surfaces.kernel.clone(), surfaces.mesh.clone(), rows);
        Self { placed, turns: OnceLock::new() }
    }

    /// Where contours turn on them; a look at every facet the first time.
    fn turns(&self) -> &Turns {
        self.turns.get_or_init(|| Turns::find(&self.placed))
    }
}
