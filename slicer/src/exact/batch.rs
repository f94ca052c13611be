//! Crossings gathered by a worker, and polished together.

use std::ops::Range;

use lamp_brep::{Fate, polish};

use super::{Exact, Tally};
use crate::cut::{Crossing, Cutter, Share};
use crate::placement::PlacedFacet;

/// Enough that evaluating surfaces pays for each call; 0.5 MB.
const BATCH: usize = 4096;

/// Crossings with where they go in the table.
pub(crate) struct Batch<'a> {
    exact: &'a Exact,
    tally: &'a Tally,
    cutter: Cutter<'a>,
    layers: Range<usize>,
    crossings: Vec<lamp_brep::Crossing>,
    /// Where facets have them, in millimetres along x.
    facets_mm: Vec<f64>,
    /// Layer, row, and the direction in which the contour crosses it.
    cells: Vec<(usize, u32, bool)>,
}

impl<'a> Batch<'a> {
    pub(crate) fn new(
        exact: &'a Exact,
        tally: &'a Tally,
        cutter: Cutter<'a>,
        layers: Range<usize>,
    ) -> Self {
        let (crossings, facets_mm, cells) = (Vec::new(), Vec::new(), Vec::new());
        Self { exact, tally, cutter, layers, crossings, facets_mm, cells }
    }

    /// Adds a facet's crossings, and says how many there are.
    pub(crate) fn cut(&mut self, number: u32, facet: &PlacedFacet, shares: &mut [Share]) -> usize {
        let cutter = self.cutter;
        let flat = self.exact.placed.is_flat(number).then(|| Flat::new(self.exact, number));
        let mut chart = None;
        let mut count = 0;
        cutter.for_each_segment(facet, &self.layers.clone(), |layer, segment| {
            let [a, b] = segment.ends.map(|end| end.at);
            let share = &mut shares[layer - self.layers.start];
            share.ends.add(a, b, segment.turned, cutter.fill);
            let z_mm = cutter.planes.z_um(layer) / 1000.0;
            cutter.for_each_crossing(a, b, segment.turned, |row, column, rising| {
                count += 1;
                if let Some(flat) = &flat {
                    let [x_mm, y_mm] = cutter.grid.to_mm(column, f64::from(row));
                    let x_mm = flat.x_mm(x_mm, y_mm, z_mm);
                    let [column, _] = cutter.grid.to_pixels(x_mm, y_mm);
                    share.crossings.push(Crossing::at(cutter.grid, row, column, rising));
                    return;
                }
                let chart = chart.get_or_insert_with(|| self.exact.placed.chart(number));
                let [x_mm, y_mm] = cutter.grid.to_mm(column, f64::from(row));
                self.crossings.push(lamp_brep::Crossing {
                    facet: number,
                    uv: chart.uv_at([x_mm, y_mm, z_mm]),
                    x_mm,
                    y_mm,
                    z_mm,
                    enters: rising,
                    fate: Fate::OnFacet,
                });
                self.facets_mm.push(x_mm);
                self.cells.push((layer, row, rising));
            });
        });
        if self.crossings.len() >= BATCH {
            self.finish(shares);
        }
        count
    }

    /// Polishes what was gathered, and puts it into the table.
    pub(crate) fn finish(&mut self, shares: &mut [Share]) {
        polish(&self.exact.placed, &mut self.crossings);
        self.tally.add(&self.crossings, &self.facets_mm);
        for (crossing, &(layer, row, rising)) in self.crossings.iter().zip(&self.cells) {
            let [column, _] = self.cutter.grid.to_pixels(crossing.x_mm, crossing.y_mm);
            let share = &mut shares[layer - self.layers.start];
            let list = match crossing.fate {
                Fate::Moved => &mut share.crossings,
                _ => &mut share.kept,
            };
            list.push(Crossing::at(self.cutter.grid, row, column, rising));
        }
        self.crossings.clear();
        self.facets_mm.clear();
        self.cells.clear();
    }
}

/// The plane of a facet that is exact, but for the rounding of its corners.
struct Flat {
    corner: [f64; 3],
    /// Across it.
    normal: [f64; 3],
}

impl Flat {
    fn new(exact: &Exact, facet: u32) -> Self {
        let [a, b, c] = exact.placed.corners(facet);
        let [e, f] = [b, c].map(|to| [0, 1, 2].map(|k| to[k] - a[k]));
        let across = |i: usize, j: usize| e[i] * f[j] - e[j] * f[i];
        Self { corner: a, normal: [across(1, 2), across(2, 0), across(0, 1)] }
    }

    /// Where a row crosses it, which on the rounded facet is at `x_mm`.
    fn x_mm(&self, x_mm: f64, y_mm: f64, z_mm: f64) -> f64 {
        let [nx, ny, nz] = self.normal;
        let [x, y, z] = self.corner;
        let exact = x - (ny * (y_mm - y) + nz * (z_mm - z)) / nx;
        // Where the row goes along the plane, its rounding is all there is.
        if (exact - x_mm).abs() < ROUNDING_MM { exact } else { x_mm }
    }
}

/// Corners are rounded by less than this where parts are smaller than 10 m.
const ROUNDING_MM: f64 = 1e-3;
