//! Finds where vertical lines meet surfaces but no facets, or facets but no surfaces: at the
//! outline of a part seen from above.
//!
//! Gray levels come from the depths at which lines through pixels meet facets. Smooth outlines are
//! where the contour of a row's plane turns back along x: extrema of sections, with the axes
//! turned. Sharp outlines are curved edges, whose chords miss pixels or have surplus pixels.

use std::collections::HashMap;

use rayon::prelude::*;

use super::curved_edge::CurvedEdge;
use super::extrema::Extremum;
use super::facet_point::{FacetPoint, RowContact};
use super::lens::{LensPlane, LensPoint, LensSide};
use super::placed::PlacedSurfaces;
use super::polish::polish;
use super::rims::{RimCrossing, Rims, SAME_UM};
use crate::cutter::Cutter;
use crate::gray::{DepthSpan, Sheet};

/// The distance below which two crossings with surfaces are the same, in millimeters.
const SAME_MM: f64 = 1e-6;

impl PlacedSurfaces {
    /// Examines all rows of gray images, for the same reason as `examine`.
    pub(crate) fn examine_rims(&self, cutter: Cutter<'_>) {
        self.rims(cutter);
    }

    /// Returns the differences between how vertical lines through an image's pixels meet surfaces
    /// and facets. The first call examines every row; all calls must be for the same image.
    pub(crate) fn rims(&self, cutter: Cutter<'_>) -> &Rims {
        self.rims.get_or_init(|| Rims::find(self, cutter))
    }
}

impl Rims {
    /// Examines all rows of an image.
    pub(super) fn find(surfaces: &PlacedSurfaces, cutter: Cutter<'_>) -> Self {
        let turned = surfaces.turned_up();
        turned.examine();
        let rims = RimSearch { surfaces, turned: &turned, cutter };
        let rows: Vec<Self> =
            (0..cutter.grid.height).into_par_iter().map(|row| rims.of_row(row)).collect();
        let mut all = Self { crossings: Vec::new(), settled_mm: HashMap::new() };
        for row in rows {
            all.crossings.extend(row.crossings);
            all.settled_mm.extend(row.settled_mm);
        }
        // By height, so that a layer finds its crossings by binary search.
        all.crossings.sort_by(|a, b| a.z_um.total_cmp(&b.z_um));
        all
    }
}

/// Placed surfaces, and the same surfaces with their z axis along rows and their x axis across.
struct RimSearch<'a> {
    surfaces: &'a PlacedSurfaces,
    turned: &'a PlacedSurfaces,
    cutter: Cutter<'a>,
}

impl RimSearch<'_> {
    fn of_row(&self, row: u32) -> Rims {
        let mut rims = Rims { crossings: Vec::new(), settled_mm: HashMap::new() };
        self.add_edges(row, &mut rims);
        let [_, y_mm] = self.cutter.grid.to_mm(0.0, f64::from(row));
        for extremum in self.turned.extrema(y_mm) {
            self.add_outline(row, &extremum, &mut rims);
        }
        // Several extrema and edges may be near a pixel.
        rims.crossings.sort_by(|a, b| a.key().partial_cmp(&b.key()).expect("heights are finite"));
        rims.crossings.dedup_by(|a, b| a.is_same(b));
        rims
    }

    /// Adds the pixels of a row around an extremum of the surfaces along x.
    fn add_outline(&self, row: u32, extremum: &Extremum, rims: &mut Rims) {
        let grid = self.cutter.grid;
        let [z_mm, x_mm, _] = extremum.at_mm;
        let [column, _] = grid.to_pixels(x_mm, 0.0);
        let reach = extremum.reach_mm / grid.pitch.x.pitch().mm() + 1.0;
        let clamped = |column: f64| column.ceil().clamp(0.0, f64::from(grid.width)) as u32;
        let width_mm = 2.0 * extremum.width_mm();
        for column in clamped(column - reach)..clamped(column + reach) {
            let pixel = [row, column];
            let [x_mm, _] = grid.to_mm(f64::from(column), 0.0);
            let heights_mm = match extremum.contact(self.turned, x_mm) {
                RowContact::Pair(pair) => {
                    let Some(missing) = self.missing(pixel, &pair) else { continue };
                    rims.crossings.extend(missing);
                    pair.map(|point| point.at_mm[0])
                }
                RowContact::Nothing => [z_mm; 2],
                RowContact::OneSide(_) | RowContact::Unknown => continue,
            };
            let [low, high] = rims.settled_mm.entry(pixel).or_insert(heights_mm);
            *low = low.min(heights_mm[0] - width_mm).min(heights_mm[1] - width_mm);
            *high = high.max(heights_mm[0] + width_mm).max(heights_mm[1] + width_mm);
        }
    }

    /// Returns the crossings of a pair with surfaces that facets do not have, or `None` if facets
    /// have an odd number.
    fn missing(&self, pixel: [u32; 2], pair: &[FacetPoint; 2]) -> Option<Vec<RimCrossing>> {
        let met = self.met(pixel, &pair.map(|point| point.facet));
        let is_met = |z_mm: f64| {
            met.iter().any(|point| point.is_exact && (point.at_mm[2] - z_mm).abs() < SAME_MM)
        };
        let missing = pair.iter().filter(|point| !is_met(point.at_mm[0])).map(|point| {
            let winding = if point.enters { 1 } else { -1 };
            self.crossing(pixel, point.facet, 1000.0 * point.at_mm[0], winding)
        });
        met.len().is_multiple_of(2).then(|| missing.collect())
    }

    /// Adds the pixels of a row between the chords and the curves of edges.
    fn add_edges(&self, row: u32, rims: &mut Rims) {
        let line = LensPlane::at_row(self.cutter.grid, row);
        let mut points: Vec<(&CurvedEdge, LensPoint)> = Vec::new();
        for edge in &self.surfaces.curved_edges().all {
            points.extend(line.lens(self.surfaces, edge).into_iter().map(|point| (edge, point)));
        }
        points.sort_by_key(|(_, point)| point.cell);
        for of_pixel in points.chunk_by(|a, b| a.1.cell == b.1.cell) {
            rims.crossings.extend(self.changes([row, of_pixel[0].1.cell], of_pixel.to_vec()));
        }
    }

    /// Returns the changes at a pixel that are known on both sides of their edges.
    fn changes(
        &self,
        pixel: [u32; 2],
        mut points: Vec<(&CurvedEdge, LensPoint)>,
    ) -> Vec<RimCrossing> {
        loop {
            let mut unknown: HashMap<u32, i32> = HashMap::new();
            for (edge, point) in &points {
                for (side, face) in point.sides.iter().zip(edge.faces(self.surfaces)) {
                    if side.gained.is_none() && side.lost.is_none() {
                        *unknown.entry(face).or_default() += side.winding;
                    }
                }
            }
            // A vertical surface has no crossing: the gain at one edge cancels the loss at another.
            unknown.retain(|_, sum| *sum != 0);
            if unknown.is_empty() {
                break;
            }
            points.retain(|(edge, _)| {
                edge.faces(self.surfaces).iter().all(|face| !unknown.contains_key(face))
            });
        }
        let sides =
            points.iter().flat_map(|(edge, point)| edge.facets.into_iter().zip(point.sides));
        sides
            .filter_map(|(facet, side)| {
                let z_um = 1000.0 * self.found(pixel, facet, &side)?.at_mm[2];
                Some(self.crossing(pixel, facet, z_um, side.winding))
            })
            .collect()
    }

    /// Returns the crossing that a face gains or loses.
    fn found(&self, pixel: [u32; 2], facet: u32, side: &LensSide) -> Option<FacetPoint> {
        match (side.gained, side.lost) {
            // A face with a facet there has a crossing to lose.
            (Some(_), Some(lost)) if self.is_covered(pixel, facet) => Some(lost),
            (gained, lost) => gained.or(lost),
        }
    }

    /// Returns whether a facet of a face near a given facet is above or below a pixel.
    fn is_covered(&self, pixel: [u32; 2], facet: u32) -> bool {
        let face = self.surfaces.facet(facet).face;
        let met = self.met(pixel, &[facet]);
        met.iter().any(|point| self.surfaces.facet(point.facet).face == face)
    }

    /// Returns the places where the line through a pixel meets facets at most two facets away from
    /// given facets, moved onto the surfaces.
    fn met(&self, pixel: [u32; 2], facets: &[u32]) -> Vec<FacetPoint> {
        let (surfaces, grid) = (self.surfaces, self.cutter.grid);
        let by_point = surfaces.facets_by_point();
        let around = |facet: u32| {
            let corners = surfaces.facet(facet).corners.into_iter();
            corners.flat_map(|corner| by_point.group(corner as usize).iter().copied())
        };
        let mut near: Vec<u32> = facets.iter().copied().flat_map(around).flat_map(around).collect();
        near.sort_unstable();
        near.dedup();
        let [row, column] = pixel.map(f64::from);
        let [x, y] = grid.to_mm(column, row);
        let point = |facet: u32| {
            // Rounded as the slicer rounds it, so that the line meets the same facets.
            let sheet = Sheet::new(&self.cutter, &surfaces.placed_facet(facet), 0)?;
            let at_mm = [x, y, sheet.height_um(pixel, grid.width)? / 1000.0];
            let uv = surfaces.chart(facet).uv_at(at_mm);
            Some(FacetPoint::new(facet, uv, at_mm, sheet.winding() > 0))
        };
        let mut points: Vec<FacetPoint> = near.into_iter().filter_map(point).collect();
        polish(surfaces, 2, &mut points);
        points
    }

    fn crossing(
        &self,
        [row, column]: [u32; 2],
        facet: u32,
        z_um: f64,
        winding: i32,
    ) -> RimCrossing {
        let body = self.surfaces.body_of(facet);
        RimCrossing { z_um, span: DepthSpan::of_pixel(row, column, winding, SAME_UM, body) }
    }
}

impl RimCrossing {
    /// Returns the place and height, to sort by.
    fn key(&self) -> ([u32; 2], i32, f64) {
        ([self.span.row, self.span.start], self.span.winding(), self.z_um)
    }

    fn is_same(&self, other: &Self) -> bool {
        let is_there = (self.key().0, self.key().1) == (other.key().0, other.key().1);
        is_there && (self.z_um - other.z_um).abs() < 1000.0 * SAME_MM
    }
}
