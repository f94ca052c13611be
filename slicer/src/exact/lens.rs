//! Finds the grid points between a facet's chord and the curved edge that it approximates.
//!
//! At an edge, a contour changes from one face to the other. Facets change where they meet the
//! chord, surfaces where they meet the curve. Rows between have a crossing with the wrong face; if
//! the contour turns back at the edge, they have a pair too many or too few. Either way, one face
//! gains a crossing and the other gains its reverse; a reverse removes an existing crossing.

use std::ops::Range;

use lamp_brep::vector::{dot, sub};

use super::curved_edge::{CurvedEdge, EdgePoint};
use super::facet_point::FacetPoint;
use super::placed::PlacedSurfaces;
use super::solve::{WantedPoint, solve};
use crate::grid::PixelGrid;
use crate::planes::Planes;
use crate::scan::{FacetEdge, Y, Z, ceil_clamped};

/// A grid point between a chord and its curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct LensPoint {
    /// The row, or the column for lines along z.
    pub(super) cell: u32,
    /// The changes of the faces on both sides.
    pub(super) sides: [LensSide; 2],
}

/// A face's change at a grid point: it gains a crossing, or loses the reverse.
#[derive(Clone, Copy, Debug)]
pub(super) struct LensSide {
    /// The winding that the face gains, +1 or -1.
    pub(super) winding: i32,
    /// The crossing of the surface on the face, if there is one.
    pub(super) gained: Option<FacetPoint>,
    /// The crossing of the surface beyond the curve, if there is one.
    pub(super) lost: Option<FacetPoint>,
}

/// The plane of a section, or the plane of a row.
#[derive(Clone, Copy)]
pub(super) struct LensPlane<'a, const ALONG: usize> {
    grid: &'a PixelGrid,
    /// The level, in micrometers or in rows.
    level: f64,
    level_mm: f64,
    /// The level that divides points before the line from points past it.
    side: f64,
}

/// A surface whose normal is smaller than this along a line does not cross it anywhere.
const LEVEL: f64 = 1e-6;
/// The greatest error of a cubic through the ends of a curve, as a part of the curve's distance
/// from its chord.
const ROUGH: f64 = 0.1;
/// The greatest distance of a crossing from its tangent at the edge, in tolerances.
const NEAR: f64 = 4.0;

/// The starts of the search for a crossing: on the curve and, as parts of the distance to the
/// facet's middle, on both sides, for contours that turn at the curve.
const SEEDS: [f64; 5] = [0.0, 0.5, -0.5, 0.1, -0.1];

impl<'a> LensPlane<'a, Z> {
    /// Returns the plane of a layer's section.
    pub(super) fn of_layer(grid: &'a PixelGrid, planes: &Planes, layer: usize) -> Self {
        let level = planes.z_um(layer);
        Self { grid, level, level_mm: level / 1000.0, side: planes.side_um(layer) }
    }
}

impl<'a> LensPlane<'a, Y> {
    /// Returns the plane across y through a row's centers.
    pub(super) fn at_row(grid: &'a PixelGrid, row: u32) -> Self {
        let row = f64::from(row);
        Self { grid, level: row, level_mm: grid.to_mm(0.0, row)[1], side: row }
    }
}

impl<const ALONG: usize> LensPlane<'_, ALONG> {
    /// The axis along which cells follow each other.
    const ACROSS: usize = if ALONG == Z { Y } else { 0 };
    /// The axis along which surfaces are crossed.
    const SOLVED: usize = if ALONG == Z { 0 } else { Z };

    /// Returns the grid points between an edge's chord and its curve.
    pub(super) fn lens(&self, surfaces: &PlacedSurfaces, edge: &CurvedEdge) -> Vec<LensPoint> {
        let chord = edge.chord.map(|at| self.placed_in_pixels(at));
        let start = self.is_before(chord[0]);
        let on_chord = (start != self.is_before(chord[1])).then(|| self.on_chord(chord));
        let turn = edge.turns[ALONG].as_ref();
        let is_turning = turn.is_some_and(|turn| self.is_before(self.in_pixels(turn)) != start);
        if on_chord.is_none() && !is_turning {
            return Vec::new();
        }
        // For most edges an estimate replaces the search on both surfaces.
        if turn.is_none() && on_chord.is_some_and(|at| self.is_far(edge, at)) {
            return Vec::new();
        }
        self.between(surfaces, edge, start, on_chord).unwrap_or_default()
    }

    /// Returns the grid points between the places where chord and curve pass, if these places are
    /// found.
    fn between(
        &self,
        surfaces: &PlacedSurfaces,
        edge: &CurvedEdge,
        start: bool,
        on_chord: Option<f64>,
    ) -> Option<Vec<LensPoint>> {
        let [first, last] = edge.ends;
        let end = start != on_chord.is_some();
        let mut knots = vec![(first, start)];
        if let Some(turn) = edge.turns[ALONG] {
            knots.push((turn, self.is_before(self.in_pixels(&turn))));
        }
        knots.push((last, end));
        let mut passes: Vec<(u32, i32)> = Vec::with_capacity(4);
        passes.extend(on_chord.map(|at| (self.cell(at), if start { -1 } else { 1 })));
        let mut seed = None;
        for pair in knots.windows(2) {
            let [(from, before), (to, after)] = [pair[0], pair[1]];
            if before == after {
                continue;
            }
            let between = [from, to];
            let at = edge.passing(surfaces, ALONG, self.level_mm, &between)?;
            passes.push((self.cell(self.across(&at)), if before { 1 } else { -1 }));
            seed = Some(at);
        }
        passes.sort_unstable();
        let seed = seed?;
        let mut points = Vec::new();
        let mut sum = 0;
        for pair in passes.windows(2) {
            sum += pair[0].1;
            if sum.abs() == 1 {
                self.points(surfaces, edge, &seed, pair[0].0..pair[1].0, sum, &mut points);
            }
        }
        Some(points)
    }

    /// Adds grid points where the chord and the curve wind around with `sum`.
    fn points(
        &self,
        surfaces: &PlacedSurfaces,
        edge: &CurvedEdge,
        seed: &EdgePoint,
        cells: Range<u32>,
        sum: i32,
        points: &mut Vec<LensPoint>,
    ) {
        for cell in cells {
            // A contour on the first side ends where its chord rises.
            let sides = [(0, -sum), (1, sum)];
            let sides =
                sides.map(|(side, winding)| self.change(surfaces, edge, seed, side, cell, winding));
            points.push(LensPoint { cell, sides });
        }
    }

    /// Finds the place where a line of the grid crosses the surface on one side of an edge.
    fn change(
        &self,
        surfaces: &PlacedSurfaces,
        edge: &CurvedEdge,
        seed: &EdgePoint,
        side: usize,
        cell: u32,
        winding: i32,
    ) -> LensSide {
        let facet = edge.facets[side];
        let uv = surfaces.facet(facet).uv;
        let middle = [0, 1].map(|k| uv.iter().map(|uv| uv[k]).sum::<f64>() / 3.0);
        let mut change = LensSide { winding, gained: None, lost: None };
        for by in SEEDS {
            let uv = [0, 1].map(|k| seed.uv[side][k] + by * (middle[k] - seed.uv[side][k]));
            let Some(found) = self.crossing(surfaces, facet, uv, seed, cell) else { continue };
            // A face gains crossings on its own side of the curve, and loses crossings beyond it.
            let is_gained = found.enters == (winding > 0);
            let way = sub(found.at_mm, seed.at_mm);
            if is_gained == edge.is_inwards(surfaces, side, seed, way) {
                let place = if is_gained { &mut change.gained } else { &mut change.lost };
                place.get_or_insert(found);
                if by == 0.0 {
                    break;
                }
            }
        }
        change
    }

    /// Finds a crossing of a line of the grid with a facet's surface near a point of an edge.
    fn crossing(
        &self,
        surfaces: &PlacedSurfaces,
        facet: u32,
        uv: [f64; 2],
        near: &EdgePoint,
        cell: u32,
    ) -> Option<FacetPoint> {
        let cell = f64::from(cell);
        let (axes, across_mm) = match ALONG {
            Z => ([Y, Z], self.grid.to_mm(0.0, cell)[Y]),
            _ => ([0, Y], self.grid.to_mm(cell, 0.0)[0]),
        };
        let wanted = WantedPoint { uv, known_mm: [across_mm, self.level_mm] };
        let (uv, jet) = solve(surfaces, surfaces.facet(facet).face, axes, &[wanted])[0]?;
        let normal = surfaces.normal(facet, &jet)?;
        let off_mm = dot(normal, sub(jet.point, near.at_mm)).abs();
        let [is_near, is_across] =
            [off_mm < NEAR * surfaces.tolerance_mm(), normal[Self::SOLVED].abs() > LEVEL];
        let enters = normal[Self::SOLVED] < 0.0;
        let point = FacetPoint { facet, uv, at_mm: jet.point, enters, is_exact: true };
        (is_near && is_across).then_some(point)
    }

    /// Returns whether there can be no grid point between the chord and the curve.
    fn is_far(&self, edge: &CurvedEdge, on_chord: f64) -> bool {
        let share = edge.share_at(ALONG, self.level_mm, &edge.ends);
        let about = [0, 1, 2].map(|axis| edge.about(axis, share));
        let on_curve = self.placed_in_pixels([about[0], about[1], 0.0])[Self::ACROSS];
        // The cubic is an estimate, so the cells must agree within its error too.
        let more = ROUGH * (on_curve - on_chord).abs();
        let (low, high) = (on_curve.min(on_chord) - more, on_curve.max(on_chord) + more);
        self.cell(low) == self.cell(high)
    }

    /// Returns the place where the chord passes, computed as for facets.
    fn on_chord(&self, [a, b]: [[f64; 3]; 2]) -> f64 {
        let (low, high) = if b[ALONG] < a[ALONG] { (b, a) } else { (a, b) };
        let at = FacetEdge::<ALONG>::new(low, high).at(self.level);
        at[if ALONG == Z { 1 } else { 0 }]
    }

    /// Returns whether a point in pixels and micrometers is before the line, computed as for
    /// facets.
    fn is_before(&self, at: [f64; 3]) -> bool {
        // As in `cut.rs`: a vertex at a plane's side is above it, and a point on a row's center is
        // above the row.
        if ALONG == Z { at[Z] < self.side } else { at[Y] <= self.side }
    }

    /// Returns the first cell whose center is at or past a place in pixels.
    fn cell(&self, at: f64) -> u32 {
        let count = if ALONG == Z { self.grid.height } else { self.grid.width };
        ceil_clamped(at, count)
    }

    fn across(&self, point: &EdgePoint) -> f64 {
        self.in_pixels(point)[Self::ACROSS]
    }

    fn in_pixels(&self, point: &EdgePoint) -> [f64; 3] {
        let [x, y, z] = point.at_mm;
        self.placed_in_pixels([x, y, 1000.0 * z])
    }

    fn placed_in_pixels(&self, [x, y, z_um]: [f64; 3]) -> [f64; 3] {
        let [column, row] = self.grid.to_pixels(x, y);
        [column, row, z_um]
    }
}
