//! Holds the depths at which a layer's rows meet facets below its section.

use std::ops::Range;

use super::stretch::Looks;
use crate::planes::Planes;

/// The columns of a row, from `start` to `end`, over a facet below a section. Depths along them are
/// on a straight line.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub(crate) struct DepthSpan {
    pub(crate) row: u32,
    pub(crate) start: u32,
    pub(crate) end: u32,
    /// Below the layer's top, at the first column.
    // 32 bits are exact to a tenth of a nanometer in a millimeter, and halve the memory.
    pub(super) depth_um: f32,
    pub(super) um_per_column: f32,
    /// The distance by which rounding may put it on the other side of the plane. Negative if the
    /// way down enters the part.
    pub(super) signed_tie_um: f32,
    pub(super) body: u32,
}

impl DepthSpan {
    /// Returns a span of one pixel, with the winding that the way down loses there.
    pub(crate) fn of_pixel(row: u32, column: u32, winding: i32, tie_um: f64, body: u32) -> Self {
        Self {
            row,
            start: column,
            end: column + 1,
            depth_um: 0.0,
            um_per_column: 0.0,
            signed_tie_um: (f64::from(winding) * tie_um) as f32,
            body,
        }
    }

    /// Returns the depth below the layer's top at a column.
    #[inline]
    pub(crate) fn depth_um(&self, column: u32) -> f64 {
        f64::from(self.depth_um) + f64::from(self.um_per_column) * f64::from(column - self.start)
    }

    /// Returns the loss of the winding number, +1 or -1, on the way down through it.
    #[inline]
    pub(crate) fn winding(&self) -> i32 {
        if self.signed_tie_um < 0.0 { -1 } else { 1 }
    }

    /// Returns the body that it bounds.
    #[inline]
    pub(crate) fn body(&self) -> u32 {
        self.body
    }

    /// Returns the distance from other facets within which it touches them.
    #[inline]
    pub(crate) fn tie_um(&self) -> f64 {
        f64::from(self.signed_tie_um.abs())
    }

    /// Returns the span at another depth.
    pub(crate) fn at_depth(self, depth_um: f64) -> Self {
        Self { depth_um: depth_um as f32, ..self }
    }

    /// Returns the depths at which a layer examines it: from just above the section to the end of
    /// the exposure.
    pub(crate) fn depths(&self, planes: &Planes, layer: usize, reach_um: f64) -> Range<f64> {
        Looks { planes, reach_um, tie_um: self.tie_um() }.depths(layer)
    }

    /// Returns true if its depth is the same at all columns.
    #[inline]
    pub(crate) fn is_level(&self) -> bool {
        self.um_per_column == 0.0
    }
}
