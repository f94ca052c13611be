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
mod tally;
mod turns;

use std::sync::OnceLock;

use lamp_brep::{Placed, Turns};

pub(crate) use batch::Batch;
pub use tally::Polished;
use tally::Tally;
pub(crate) use turns::settle;

use crate::model::Surfaces;

/// A B-rep model's surfaces in their place.
#[derive(Debug)]
pub(crate) struct Exact {
    pub(crate) placed: Placed,
    turns: OnceLock<Turns>,
    tally: Tally,
}

impl Exact {
    pub(crate) fn new(surfaces: &Surfaces, rows: [[f64; 4]; 3]) -> Self {
        let placed = Placed::new(surfaces.kernel.clone(), surfaces.mesh.clone(), rows);
        Self { placed, turns: OnceLock::new(), tally: Tally::default() }
    }

    /// Where contours turn on them; a look at every facet the first time.
    fn turns(&self) -> &Turns {
        self.turns.get_or_init(|| Turns::find(&self.placed))
    }

    /// What polishing has done so far.
    pub(crate) fn polished(&self) -> Polished {
        self.tally.total()
    }
}
