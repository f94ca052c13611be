//! Gathers a worker's crossings with curved facets, and polishes them together.

use std::ops::Range;

use lamp_brep::vector::{Vec3, cross, sub};

use super::facet_point::FacetPoint;
use super::placed::PlacedSurfaces;
use super::polish::polish;
use super::tally::SolverTally;
use crate::crossing::Crossing;
use crate::cutter::Cutter;
use crate::facet::PlacedFacet;
use crate::layer_share::LayerShare;

/// The number of crossings polished at once: enough to amortize each call; 0.5 MB.
const BATCH: usize = 4096;

/// Crossings with a body's curved facets, before they go into the table.
pub(super) struct Batch<'a> {
    surfaces: &'a PlacedSurfaces,
    body: u32,
    tally: &'a SolverTally,
    cutter: Cutter<'a>,
    layers: Range<usize>,
    points: Vec<FacetPoint>,
    /// Each point's layer and row, and its x on the facet in millimeters.
    cells: Vec<(usize, u32, f64)>,
}

impl<'a> Batch<'a> {
    pub(super) fn new(
        surfaces: &'a PlacedSurfaces,
        body: u32,
        tally: &'a SolverTally,
        cutter: Cutter<'a>,
        layers: Range<usize>,
    ) -> Self {
        Self { surfaces, body, tally, cutter, layers, points: Vec::new(), cells: Vec::new() }
    }

    /// Adds a facet's crossings and returns their number.
    pub(super) fn cut(
        &mut self,
        number: u32,
        facet: &PlacedFacet,
        shares: &mut [LayerShare],
    ) -> usize {
        let cutter = self.cutter;
        let surfaces = self.surfaces;
        let flat = surfaces.is_flat(number).then(|| FlatFace::new(surfaces, number));
        let mut chart = None;
        let mut count = 0;
        let salt = cutter.rule.salt(self.body);
        cutter.for_each_segment(facet, &self.layers.clone(), |layer, segment| {
            let [a, b] = segment.ends.map(|end| end.at);
            let share = &mut shares[layer - self.layers.start];
            // Contours close on facets: polishing moves crossings, not the ends of segments.
            share.ends.add([a, b], salt);
            let z_mm = cutter.planes.z_um(layer) / 1000.0;
            cutter.for_each_crossing(a, b, segment.is_reversed, |row, column, rising| {
                count += 1;
                let [x_mm, y_mm] = cutter.grid.to_mm(column, f64::from(row));
                if let Some(flat) = &flat {
                    let x_mm = flat.x_mm(x_mm, y_mm, z_mm);
                    let [column, _] = cutter.grid.to_pixels(x_mm, y_mm);
                    let crossing = Crossing::at(cutter.grid, row, column, rising);
                    share.of_body(self.body).push(crossing);
                    return;
                }
                // Many facets cross no row, and need no chart.
                let chart = chart.get_or_insert_with(|| surfaces.chart(number));
                let at_mm = [x_mm, y_mm, z_mm];
                self.points.push(FacetPoint::new(number, chart.uv_at(at_mm), at_mm, rising));
                self.cells.push((layer, row, x_mm));
            });
        });
        if self.points.len() >= BATCH {
            self.finish(shares);
        }
        count
    }

    /// Polishes the gathered crossings and puts them into the table.
    pub(super) fn finish(&mut self, shares: &mut [LayerShare]) {
        polish(self.surfaces, 0, &mut self.points);
        self.tally.add(self.points.iter().zip(&self.cells).map(|(point, &(_, _, facet_mm))| {
            point.is_exact.then(|| (point.at_mm[0] - facet_mm).abs())
        }));
        let Cutter { grid, .. } = self.cutter;
        for (point, (layer, row, _)) in self.points.drain(..).zip(self.cells.drain(..)) {
            let [column, _] = grid.to_pixels(point.at_mm[0], point.at_mm[1]);
            let share = &mut shares[layer - self.layers.start];
            let crossing = Crossing::at(grid, row, column, point.enters);
            match point.is_exact {
                true => share.of_body(self.body).push(crossing),
                false => share.kept.push((self.body, crossing)),
            }
        }
    }
}

/// The plane of a flat face, from its corners before rounding to 32 bits.
struct FlatFace {
    corner: Vec3,
    normal: Vec3,
}

impl FlatFace {
    fn new(surfaces: &PlacedSurfaces, facet: u32) -> Self {
        let [a, b, c] = surfaces.corners(facet);
        Self { corner: a, normal: cross(sub(b, a), sub(c, a)) }
    }

    /// Returns the x of the plane's crossing with a row. The rounded facet crosses it at
    /// `x_mm`.
    fn x_mm(&self, x_mm: f64, y_mm: f64, z_mm: f64) -> f64 {
        let [nx, ny, nz] = self.normal;
        let [x, y, z] = self.corner;
        // n · (p - corner) = 0, solved for x.
        let exact = x - (ny * (y_mm - y) + nz * (z_mm - z)) / nx;
        // A row along the plane crosses it anywhere, so the facet's x is kept.
        if (exact - x_mm).abs() < ROUNDING_MM { exact } else { x_mm }
    }
}

/// The limit of the corners' rounding for parts smaller than 10 m.
const ROUNDING_MM: f64 = 1e-3;
