//! Finds crossings on the exact surfaces of B-rep parts.
//!
//! Facets decide which rows are crossed; this keeps every row balanced. Surfaces decide where. A
//! worker gathers crossings on facets and [`polish`]es them in batches before they go into the
//! table. Near extrema of contours, facets miss pairs of crossings or have surplus pairs: those
//! rows are settled layer by layer.
//!
//! Source: 002 section 2.2, which slices the CAD model itself for accuracy.

mod batch;
mod critical;
mod curved_edge;
mod depths;
mod edges;
mod extent;
mod extrema;
mod facet_point;
mod lens;
mod locate;
mod placed;
mod polish;
mod rim_search;
mod rims;
mod saddle;
mod settle;
mod solve;
mod switch;
mod tally;

use std::ops::Range;

use batch::Batch;
use depths::Depths;
pub use extrema::Extremum;
pub use facet_point::{FacetPoint, RowContact};
pub use placed::{Chart, PlacedSurfaces};
pub use polish::polish;
pub(crate) use settle::settle;
pub use tally::Polished;
pub(crate) use tally::SolverTally;

use crate::cutter::Cutter;
use crate::facet::PlacedFacet;
use crate::layer_share::LayerShare;

/// A worker that turns consecutive facets of a B-rep model into its share of the table.
pub(crate) struct ExactCut<'a> {
    /// The index of the next facet.
    next: u32,
    crossings: Batch<'a>,
    depths: Option<Depths<'a>>,
}

impl<'a> ExactCut<'a> {
    /// Starts at a facet of a body. Gray layers look `reach_um` below the sections.
    pub(crate) fn new(
        surfaces: &'a PlacedSurfaces,
        first: u32,
        body: u32,
        tally: &'a SolverTally,
        cutter: Cutter<'a>,
        layers: Range<usize>,
        reach_um: Option<f64>,
    ) -> Self {
        let depths =
            reach_um.map(|reach_um| Depths::new(surfaces, body, cutter, layers.clone(), reach_um));
        Self { next: first, crossings: Batch::new(surfaces, body, tally, cutter, layers), depths }
    }

    /// Adds the next facet. Returns the number of crossings that would need the same memory.
    pub(crate) fn cut(&mut self, facet: &PlacedFacet, shares: &mut [LayerShare]) -> usize {
        // Facets come in their order, so counting numbers them.
        let number = self.next;
        self.next += 1;
        let below = self.depths.as_mut();
        let below = below.map_or(0, |depths| depths.look_down(number, facet, shares));
        below + self.crossings.cut(number, facet, shares)
    }

    /// Puts the remaining crossings into the table.
    pub(crate) fn finish(&mut self, shares: &mut [LayerShare]) {
        self.crossings.finish(shares);
        if let Some(depths) = &mut self.depths {
            depths.finish(shares);
        }
    }
}
