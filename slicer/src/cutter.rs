//! Holds the rows, planes and fill rule by which a part is cut.

use crate::bodies::FillRule;
use crate::grid::PixelGrid;
use crate::planes::Planes;

/// Cuts facets into segments, and these into crossings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cutter<'a> {
    pub(crate) grid: &'a PixelGrid,
    pub(crate) planes: &'a Planes,
    pub(crate) rule: &'a FillRule,
}

impl<'a> Cutter<'a> {
    /// Returns the cutter of a body.
    pub(crate) fn of_body(self, body: u32) -> Self {
        Self { planes: self.planes.of_body(body), ..self }
    }
}
