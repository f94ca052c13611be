//! Finds the extrema of a section's contours, where they turn back along the rows, on
//! the exact surfaces.
//!
//! Facets cut corners. Near an extremum, some rows pass between the corner of the facets and the
//! corner of the surface, so facets cross them twice too often or not at all. Either way, the row
//! stays balanced.

use std::ops::Range;

use lamp_brep::Jet;
use lamp_brep::vector::{Vec3, distance, scale, sub};
use rayon::prelude::*;

use super::critical::{CandidateFacet, CriticalPoints, SAME_MM, Saddle};
use super::extent::DIFFERENCE;
use super::facet_point::{FacetPoint, RowContact};
use super::placed::PlacedSurfaces;

/// A point where a contour has a tangent along the rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremum {
    /// The point, in millimeters.
    pub at_mm: [f64; 3],
    /// The greatest distance of facets from the contour along y here, in millimeters.
    pub reach_mm: f64,
    facet: u32,
    uv: [f64; 2],
    /// Whether the part is below, along y.
    is_above: bool,
    /// The contour is y = y* + bend/2 (x - x*)^2 here.
    bend_per_mm: f64,
    /// The derivatives of the parameters by x along the contour.
    along: [f64; 2],
}

/// Normals that differ by less than this along an axis differ only by rounding.
const LEVEL: f64 = 1e-9;
/// If the normal's y component is less than this, the surface is nearly level, and a
/// contour that turns there is smaller than a pixel.
const STEEP: f64 = 1e-4;
/// The number of facets evaluated at once.
const BATCH: usize = 4096;
const MAX_STEPS: usize = 20;

impl CriticalPoints {
    /// Examines every facet once.
    pub(super) fn find(surfaces: &PlacedSurfaces) -> Self {
        let count = surfaces.mesh().facets.len();
        let batches: Vec<usize> = (0..count).step_by(BATCH).collect();
        let found = batches.into_par_iter().flat_map_iter(|start| {
            candidates(surfaces, start as u32..count.min(start + BATCH) as u32)
        });
        let candidates: Vec<CandidateFacet> = found.collect();
        let level = candidates.par_iter().filter(|candidate| candidate.may_be_level);
        let found: Vec<Saddle> =
            level.filter_map(|candidate| Saddle::on(surfaces, candidate.facet)).collect();
        let mut saddles: Vec<Saddle> = Vec::new();
        for saddle in found {
            // All facets around a saddle find it.
            if !saddles.iter().any(|other| saddle.is_same(other, surfaces)) {
                saddles.push(saddle);
            }
        }
        Self { candidates, saddles }
    }
}

impl PlacedSurfaces {
    /// Examines all facets. Otherwise the first layer would do this: its thread would wait for
    /// other threads, and might meanwhile start a layer that waits for the same result.
    pub(crate) fn examine(&self) {
        self.critical_points();
        self.curved_edges();
    }

    /// Returns the places where contours may turn or meet. The first call examines every
    /// facet.
    pub(super) fn critical_points(&self) -> &CriticalPoints {
        self.critical_points.get_or_init(|| CriticalPoints::find(self))
    }

    /// Returns the extrema of a section's contours, by y. The first call examines every
    /// facet.
    pub fn extrema(&self, z_mm: f64) -> Vec<Extremum> {
        let is_met = |facet: &&CandidateFacet| (facet.low_mm..=facet.high_mm).contains(&z_mm);
        let mut extrema: Vec<Extremum> = Vec::new();
        for candidate in self.critical_points().candidates.iter().filter(is_met) {
            for seed in seeds(self, candidate, z_mm) {
                let found = Extremum::find(self, candidate.facet, seed, z_mm);
                // Facets as thin as facets at a pole seldom lie below their own extremum.
                extrema.extend(
                    found.filter(|it| self.facet_below(candidate.facet, it.at_mm).is_some()),
                );
            }
        }
        let key = |it: &Extremum| (it.at_mm[1], it.at_mm[0]);
        extrema.sort_by(|a, b| key(a).partial_cmp(&key(b)).expect("extrema are finite"));
        let mut kept: Vec<Extremum> = Vec::with_capacity(extrema.len());
        for extremum in extrema {
            let is_near = |other: &&Extremum| extremum.at_mm[1] - other.at_mm[1] < SAME_MM;
            // Sorted by y, so only the last ones can be the same.
            let mut near = kept.iter().rev().take_while(is_near);
            if !near.any(|other| extremum.is_same(other, self)) {
                kept.push(extremum);
            }
        }
        kept
    }
}

impl Extremum {
    /// Solves z(u, v) = plane, normal x (u, v) = 0 by Newton's method from a facet's
    /// surroundings, with differences for the normal's derivatives.
    fn find(surfaces: &PlacedSurfaces, facet: u32, seed: [f64; 2], z_mm: f64) -> Option<Self> {
        let size = surfaces.uv_size(facet);
        let by = size.map(|size| DIFFERENCE * size);
        let mut at = seed;
        for _ in 0..MAX_STEPS {
            let jets = surfaces.jets(facet, at, by);
            let normals = [0, 1, 2].map(|k| surfaces.normal(facet, &jets[k]));
            let [Some(n), Some(nu), Some(nv)] = normals else { return None };
            let turned = [scale(sub(nu, n), 1.0 / by[0]), scale(sub(nv, n), 1.0 / by[1])];
            let jet = jets[0];
            let (e, f) = (z_mm - jet.point[2], -n[0]);
            if e.abs() < 1e-10 && f.abs() < 1e-10 {
                return Self::at(surfaces, facet, at, &jet, n, turned);
            }
            let ([zu, zv], [xu, xv]) = ([jet.du[2], jet.dv[2]], [turned[0][0], turned[1][0]]);
            // Newton's step by Cramer's rule, over the derivatives of z and of the normal's x.
            let det = zu * xv - zv * xu;
            let step = [(e * xv - f * zv) / det, (f * zu - e * xu) / det];
            // A step longer than two facets would leave the seed's surroundings.
            let most = step[0].abs() / size[0] / 2.0;
            let most = most.max(step[1].abs() / size[1] / 2.0).max(1.0);
            at = [0, 1].map(|k| at[k] + step[k] / most);
            if !at.iter().all(|t| t.is_finite()) {
                return None;
            }
        }
        None
    }

    /// Returns the extremum at a point where the contour runs along x, if it turns there.
    /// `turned` are the normal's derivatives by u and v.
    fn at(
        surfaces: &PlacedSurfaces,
        facet: u32,
        uv: [f64; 2],
        jet: &Jet,
        normal: Vec3,
        turned: [Vec3; 2],
    ) -> Option<Self> {
        // z is constant along the contour: (u, v) moves along (zv, -zu).
        let (zu, zv) = (jet.du[2], jet.dv[2]);
        let x_speed = jet.du[0] * zv - jet.dv[0] * zu;
        let along = [zv / x_speed, -zu / x_speed];
        // dy/dx is -n_x / n_y.
        let bend_per_mm = -(turned[0][0] * along[0] + turned[1][0] * along[1]) / normal[1];
        let steep = normal[1].abs();
        let turns = steep > STEEP && bend_per_mm.is_finite() && bend_per_mm != 0.0;
        turns.then_some(Self {
            at_mm: jet.point,
            // A distance across the surface is longer along y, by the normal's y.
            reach_mm: 2.0 * surfaces.tolerance_mm() / steep,
            facet,
            uv,
            is_above: normal[1] > 0.0,
            bend_per_mm,
            along,
        })
    }

    /// Returns the greatest distance of facets from the contour along x, in millimeters.
    pub(super) fn width_mm(&self) -> f64 {
        // Here the parabola is the reach away from its tangent.
        (2.0 * self.reach_mm / self.bend_per_mm.abs()).sqrt()
    }

    /// Returns a row's crossings near the extremum.
    pub fn contact(&self, surfaces: &PlacedSurfaces, y_mm: f64) -> RowContact {
        let [x, y, z_mm] = self.at_mm;
        // y = y* + bend/2 (x - x*)², solved for (x - x*)².
        let square = 2.0 * (y_mm - y) / self.bend_per_mm;
        if square < 0.0 {
            return RowContact::Nothing;
        }
        let half = square.sqrt();
        surfaces.locate_pair([-half, half].map(|by| {
            let uv = [0, 1].map(|k| self.uv[k] + by * self.along[k]);
            FacetPoint::new(self.facet, uv, [x + by, y_mm, z_mm], false)
        }))
    }

    /// Returns the number of its body.
    pub(super) fn body(&self, surfaces: &PlacedSurfaces) -> u32 {
        surfaces.body_of(self.facet)
    }

    /// Returns whether another facet's extremum is the same point of the same body.
    fn is_same(&self, other: &Self, surfaces: &PlacedSurfaces) -> bool {
        distance(self.at_mm, other.at_mm) < SAME_MM
            && self.is_above == other.is_above
            && self.body(surfaces) == other.body(surfaces)
    }
}

/// Returns the facets whose surfaces may have extrema.
fn candidates(surfaces: &PlacedSurfaces, facets: Range<u32>) -> Vec<CandidateFacet> {
    let mut found = Vec::new();
    let mut jets = Vec::new();
    let facets: Vec<u32> = facets.collect();
    for of_face in facets.chunk_by(|&a, &b| surfaces.facet(a).face == surfaces.facet(b).face) {
        if surfaces.is_flat(of_face[0]) {
            continue;
        }
        let uv: Vec<[f64; 2]> =
            of_face.iter().flat_map(|&facet| surfaces.facet(facet).uv).collect();
        jets.resize(uv.len(), Jet::default());
        surfaces.evaluate(surfaces.facet(of_face[0]).face, &uv, &mut jets);
        found.extend(of_face.iter().zip(jets.chunks(3)).filter_map(|(&facet, jets)| {
            let flat = surfaces.facet_normal(facet)?;
            // At a pole the surface has no normal.
            let normals = [0, 1, 2].map(|k| surfaces.normal(facet, &jets[k]).unwrap_or(flat));
            let [normal_x, normal_y] = [0, 1].map(|axis| normals.map(|normal| normal[axis]));
            let [turns, may_be_level] = [normal_x, normal_y].map(passes_zero);
            let (low, high) = range(surfaces.corners(facet).map(|corner| corner[2]));
            let off = surfaces.tolerance_mm();
            let (low_mm, high_mm) = (low - off, high + off);
            turns.then_some(CandidateFacet { facet, normal_x, low_mm, high_mm, may_be_level })
        }));
    }
    found
}

/// Returns whether values at a facet's corners may pass zero within it. The surface may turn 1.5
/// times as much as between its corners.
fn passes_zero(values: [f64; 3]) -> bool {
    let (low, high) = range(values);
    let more = 0.5 * (high - low) + LEVEL;
    high - low > LEVEL && low - more < 0.0 && high + more > 0.0
}

fn range(values: [f64; 3]) -> (f64, f64) {
    let [a, b, c] = values;
    (a.min(b).min(c), a.max(b).max(c))
}

/// Returns the parameters to start the search from: the facet's own extremum, or its
/// corners if the facet does not reach the plane.
fn seeds(surfaces: &PlacedSurfaces, candidate: &CandidateFacet, z_mm: f64) -> Vec<[f64; 2]> {
    let uv = surfaces.facet(candidate.facet).uv;
    let corners = surfaces.corners(candidate.facet);
    let mut ends: Vec<([f64; 2], f64)> = Vec::with_capacity(2);
    for k in 0..3 {
        let (i, j) = (k, (k + 1) % 3);
        if (corners[i][2] < z_mm) != (corners[j][2] < z_mm) {
            let t = (z_mm - corners[i][2]) / (corners[j][2] - corners[i][2]);
            let x = candidate.normal_x;
            ends.push((mixed(uv[i], uv[j], t), x[i] + t * (x[j] - x[i])));
        }
    }
    match ends[..] {
        // The normal's x is nearly linear along the cut, so its zero is close to the extremum.
        [(p, a), (q, b)] if a != b => vec![mixed(p, q, (a / (a - b)).clamp(0.0, 1.0))],
        _ => uv.to_vec(),
    }
}

fn mixed(a: [f64; 2], b: [f64; 2], t: f64) -> [f64; 2] {
    [0, 1].map(|k| a[k] + t * (b[k] - a[k]))
}
