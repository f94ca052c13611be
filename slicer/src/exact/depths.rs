//! Gathers a worker's depths below sections, and polishes them together.

use std::ops::Range;

use super::facet_point::FacetPoint;
use super::placed::PlacedSurfaces;
use super::polish::polish;
use crate::crossing::Crossing;
use crate::cutter::Cutter;
use crate::facet::PlacedFacet;
use crate::gray::{DepthSpan, Sheet};
use crate::layer_share::LayerShare;

/// The number of pixels evaluated at once: enough to amortize each call; 0.3 MB.
const BATCH: usize = 4096;

/// Pixels over a body's curved facets. Their exact heights go into the table as spans of one
/// column.
pub(super) struct Depths<'a> {
    surfaces: &'a PlacedSurfaces,
    body: u32,
    cutter: Cutter<'a>,
    layers: Range<usize>,
    reach_um: f64,
    points: Vec<FacetPoint>,
    /// The span of each point, without its depth.
    pixels: Vec<DepthSpan>,
}

impl<'a> Depths<'a> {
    pub(super) fn new(
        surfaces: &'a PlacedSurfaces,
        body: u32,
        cutter: Cutter<'a>,
        layers: Range<usize>,
        reach_um: f64,
    ) -> Self {
        Self { surfaces, body, cutter, layers, reach_um, points: Vec::new(), pixels: Vec::new() }
    }

    /// Adds the pixels where rows pass a facet below the sections, down to the exposure depth.
    /// Returns the number of crossings that would need the same memory.
    pub(super) fn look_down(
        &mut self,
        number: u32,
        facet: &PlacedFacet,
        shares: &mut [LayerShare],
    ) -> usize {
        let (cutter, surfaces) = (self.cutter, self.surfaces);
        if surfaces.is_flat(number) {
            return cutter.look_down(facet, self.body, self.reach_um, &self.layers, shares);
        }
        let Some(sheet) = Sheet::new(&cutter, facet, self.body) else { return 0 };
        let planes = cutter.planes;
        let low_um = planes.z_um(self.layers.start) - self.reach_um;
        let high_um = planes.z_um(self.layers.end - 1);
        // The surface over a steep facet may be much higher or lower than the facet.
        let slack_um = sheet.slack_um(1000.0 * surfaces.tolerance_mm());
        let chart = surfaces.chart(number);
        let before = self.points.len();
        let heights = low_um - slack_um..high_um + slack_um;
        sheet.for_each_pixel(&cutter, heights, |pixel, z_um| {
            let [x, y] = cutter.grid.to_mm(f64::from(pixel.start), f64::from(pixel.row));
            let at_mm = [x, y, z_um / 1000.0];
            let enters = pixel.winding() > 0;
            self.points.push(FacetPoint::new(number, chart.uv_at(at_mm), at_mm, enters));
            self.pixels.push(pixel);
        });
        let count = self.points.len() - before;
        if self.points.len() >= BATCH {
            self.finish(shares);
        }
        count * size_of::<DepthSpan>() / size_of::<Crossing>()
    }

    /// Finds the exact heights of the gathered pixels and puts them into the table.
    pub(super) fn finish(&mut self, shares: &mut [LayerShare]) {
        polish(self.surfaces, 2, &mut self.points);
        let planes = self.cutter.planes;
        let rims = self.surfaces.rims(self.cutter);
        for (point, pixel) in self.points.drain(..).zip(self.pixels.drain(..)) {
            if !point.is_exact && rims.is_settled([pixel.row, pixel.start], point.at_mm[2]) {
                continue;
            }
            let z_um = 1000.0 * point.at_mm[2];
            let met = planes.near(z_um - pixel.tie_um(), z_um + self.reach_um);
            for layer in met.start.max(self.layers.start)..met.end.min(self.layers.end) {
                let depth_um = planes.top_um(layer) - z_um;
                if pixel.depths(planes, layer, self.reach_um).contains(&depth_um) {
                    let span = pixel.at_depth(depth_um);
                    shares[layer - self.layers.start].spans.push(span);
                }
            }
        }
    }
}
