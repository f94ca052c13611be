//! Finds where vertical lines through pixels meet facets, and the depths there.

use std::ops::Range;

use super::depth_span::DepthSpan;
use super::stretch::{Looks, RowStretch};
use crate::cutter::Cutter;
use crate::facet::{PlacedFacet, facet_heights};
use crate::scan::RowFacet;

/// Facets closer than this to each other, or to a layer's plane, count as touching: far more than
/// rounding, far less than any cure depth.
const TOUCHING_UM: f64 = 1e-3;

/// The same distance sideways: a pixel's center may be this far off.
const ASIDE_PIXELS: f64 = 1e-6;

/// A facet seen from above: x and y in pixels, z in micrometers.
pub(crate) struct Sheet {
    facet: RowFacet,
    low_um: f64,
    high_um: f64,
    tie_um: f64,
    /// The ratio of a distance down to it to the distance across.
    steepness: f64,
    winding: i32,
    body: u32,
}

impl Sheet {
    /// Projects a body's facet from above. Returns `None` if no vertical line meets it.
    pub(crate) fn new(cutter: &Cutter<'_>, facet: &PlacedFacet, body: u32) -> Option<Self> {
        let corners = facet.map(|[x, y, z_um]| {
            let [column, row] = cutter.grid.to_pixels(x, y);
            [column, row, z_um]
        });
        let [a, b, c] = corners;
        let [u, v] = [b, c].map(|to| [0, 1, 2].map(|axis| to[axis] - a[axis]));
        let cross = |i: usize, j: usize| u[i] * v[j] - u[j] * v[i];
        let area = cross(0, 1);
        // Seen from above it is a line, and its neighbors take the pixels on both sides.
        if area == 0.0 {
            return None;
        }
        // |dz/dx| + |dz/dy|, by the components of the normal.
        let slopes = [cross(1, 2).abs(), cross(2, 0).abs()];
        let um_per_pixel = (slopes[0] + slopes[1]) / area.abs();
        let [x_um, y_um] = cutter.grid.pitch.um();
        let (low_um, high_um) = facet_heights(facet);
        Some(Self {
            facet: RowFacet::new(corners, cutter.grid.height)?,
            low_um,
            high_um,
            steepness: 1.0 + (slopes[0] / x_um + slopes[1] / y_um) / area.abs(),
            // At most a micrometer, or steep facets would touch all around them.
            tie_um: TOUCHING_UM + ASIDE_PIXELS * um_per_pixel.min(1e6),
            // Rows count downward: facets that face down turn clockwise in y.
            winding: if area > 0.0 { 1 } else { -1 },
            body,
        })
    }

    /// Calls `each` with the spans of `layers` whose planes are above its lowest corner: from just
    /// above the section to the end of the exposure.
    pub(crate) fn for_each_span(
        &self,
        cutter: &Cutter<'_>,
        layers: Range<usize>,
        reach_um: f64,
        mut each: impl FnMut(usize, DepthSpan),
    ) {
        let planes = cutter.planes;
        let looks = Looks { planes, reach_um, tie_um: self.tie_um };
        let low_um = planes.z_um(layers.start) - reach_um;
        let high_um = planes.z_um(layers.end - 1) + self.tie_um;
        self.facet.for_each_row(self.facet.rows_between([low_um, high_um]), |row, ends| {
            // Most rows of steep facets pass between two columns.
            let Some(stretch) = self.stretch(ends, cutter.grid.width) else { return };
            let [low_um, high_um] = stretch.heights();
            let met = planes.near(low_um - self.tie_um, high_um + reach_um);
            let met = met.start.max(layers.start)..met.end.min(layers.end);
            let um_per_column = -stretch.um_per_column() as f32;
            stretch.for_each_look(&looks, met, |layer, columns, depth_um| {
                each(layer, DepthSpan { um_per_column, ..self.span(row, columns, depth_um) });
            });
        });
    }

    /// Returns a span at one depth.
    fn span(&self, row: u32, columns: Range<u32>, depth_um: f64) -> DepthSpan {
        DepthSpan {
            row,
            start: columns.start,
            end: columns.end,
            depth_um: depth_um as f32,
            um_per_column: 0.0,
            signed_tie_um: (f64::from(self.winding) * self.tie_um) as f32,
            body: self.body,
        }
    }

    /// Calls `each` with every pixel that meets it between two heights, and the height there.
    pub(crate) fn for_each_pixel(
        &self,
        cutter: &Cutter<'_>,
        heights_um: Range<f64>,
        mut each: impl FnMut(DepthSpan, f64),
    ) {
        let rows = self.facet.rows_between([heights_um.start, heights_um.end]);
        self.facet.for_each_row(rows, |row, ends| {
            let Some(stretch) = self.stretch(ends, cutter.grid.width) else { return };
            for column in stretch.columns() {
                let z_um = stretch.height(column);
                if heights_um.contains(&z_um) {
                    each(self.span(row, column..column + 1, 0.0), z_um);
                }
            }
        });
    }

    /// Returns the height at which the vertical line through a pixel meets it.
    pub(crate) fn height_um(&self, [row, column]: [u32; 2], width: u32) -> Option<f64> {
        let mut height_um = None;
        if self.facet.rows().contains(&row) {
            self.facet.for_each_row(row..row + 1, |_, ends| {
                let stretch = self.stretch(ends, width);
                let stretch = stretch.filter(|stretch| stretch.columns().contains(&column));
                height_um = stretch.map(|stretch| stretch.height(column));
            });
        }
        height_um
    }

    /// Returns the winding that the way down through it loses.
    pub(crate) fn winding(&self) -> i32 {
        self.winding
    }

    /// Returns the columns of a row that meet it, if any.
    #[inline]
    fn stretch(&self, ends: [[f64; 2]; 2], width: u32) -> Option<RowStretch> {
        RowStretch::new(ends, [self.low_um, self.high_um], width)
    }

    /// Returns the height by which a surface at a distance from it may be higher or lower.
    pub(crate) fn slack_um(&self, near_um: f64) -> f64 {
        // At most twice the facet's own height: few lines meet steeper facets.
        let most = near_um + 2.0 * (self.high_um - self.low_um);
        (near_um * self.steepness).min(most)
    }
}
