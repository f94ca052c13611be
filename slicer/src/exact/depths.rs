//! Depths below sections on exact surfaces, gathered by a worker.

use std::ops::Range;

use lamp_brep::{Probe, polish_heights};

use super::Exact;
use crate::cut::{Crossing, Cutter, Share};
use crate::gray::{Sheet, Span};
use crate::placement::PlacedFacet;

/// Enough that evaluating surfaces pays for each call; 0.3 MB.
const BATCH: usize = 4096;

/// Pixels over facets, whose exact heights go into the table as spans of one column.
pub(crate) struct Depths<'a> {
    exact: &'a Exact,
    cutter: Cutter<'a>,
    layers: Range<usize>,
    reach_um: f64,
    probes: Vec<Probe>,
    /// Column and row, and the span to be, without its depth.
    pixels: Vec<Span>,
}

impl<'a> Depths<'a> {
    pub(crate) fn new(
        exact: &'a Exact,
        cutter: Cutter<'a>,
        layers: Range<usize>,
        reach_um: f64,
    ) -> Self {
        Self { exact, cutter, layers, reach_um, probes: Vec::new(), pixels: Vec::new() }
    }

    /// Adds what rows meet of a facet below the sections, as deep as they are exposed,
    /// and says how many crossings would take as much memory.
    pub(crate) fn look_down(
        &mut self,
        number: u32,
        facet: &PlacedFacet,
        shares: &mut [Share],
    ) -> usize {
        let (cutter, placed) = (self.cutter, &self.exact.placed);
        if placed.is_flat(number) {
            return cutter.look_down(facet, self.reach_um, &self.layers, shares);
        }
        let Some(sheet) = Sheet::new(&cutter, facet) else { return 0 };
        let (low_um, high_um) = self.heights();
        // Where a facet is steep its surface may be much higher or lower.
        let slack_um = sheet.slack_um(1000.0 * placed.tolerance_mm());
        let chart = placed.chart(number);
        let before = self.probes.len();
        let heights = low_um - slack_um..high_um + slack_um;
        sheet.for_each_pixel(&cutter, heights, |pixel, z_um| {
            let [x, y] = cutter.grid.to_mm(f64::from(pixel.start), f64::from(pixel.row));
            let at_mm = [x, y, z_um / 1000.0];
            let is_above = pixel.winding() < 0;
            self.probes.push(Probe { facet: number, uv: chart.uv_at(at_mm), at_mm, is_above });
            self.pixels.push(pixel);
        });
        let count = self.probes.len() - before;
        if self.probes.len() >= BATCH {
            self.finish(shares);
        }
        count * size_of::<Span>() / size_of::<Crossing>()
    }

    /// Between which heights the layers look at facets.
    fn heights(&self) -> (f64, f64) {
        let planes = self.cutter.planes;
        (planes.z_um(self.layers.start) - self.reach_um, planes.z_um(self.layers.end - 1))
    }

    /// Finds the exact heights of what was gathered, and puts them into the table.
    pub(crate) fn finish(&mut self, shares: &mut [Share]) {
        polish_heights(&self.exact.placed, &mut self.probes);
        let planes = self.cutter.planes;
        for (probe, pixel) in self.probes.iter().zip(&self.pixels) {
            let z_um = 1000.0 * probe.at_mm[2];
            let met = planes.between(z_um - pixel.tie_um(), z_um + self.reach_um);
            for layer in met.start.max(self.layers.start)..met.end.min(self.layers.end) {
                let depth_um = planes.top_um(layer) - z_um;
                if pixel.depths(planes, layer, self.reach_um).contains(&depth_um) {
                    let span = pixel.at_depth(depth_um);
                    shares[layer - self.layers.start].spans.push(span);
                }
            }
        }
        self.probes.clear();
        self.pixels.clear();
    }
}
