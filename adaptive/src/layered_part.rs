//! A part seen along rows, and its differences from layers.

use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use lamp_slicing::scan::RowFacet;
use lamp_slicing::{FacetIndex, Fill, FillRule, PlacedFacet, Side, facet_heights};
use lamp_stack::Length;
use rayon::prelude::*;

use crate::closed::EdgeSum;
use crate::error::HeightsError;
use crate::facets::FacetSums;
use crate::overlaps::{OverlapRows, Overlaps};
use crate::profile::{ChangeProfile, ProfileChange};
use crate::row_cuts::{CutRows, RowCuts};
use crate::sweep::{RowsAdd, Sweep};
use crate::swept_layer::{SweptLayer, SweptLayers, SweptSection};

/// The number of stripes of rows that are worked on at once. It does not follow
/// the threads, so that sums do not depend on them.
const STRIPES: u32 = 16;

/// Facets of less height count as level: far more than rounding, far less than a
/// step.
const LEVEL_UM: f64 = 0.05;

/// More rows than any image has.
const MAX_ROWS: f64 = 16_777_216.0;

/// Rows of pixels.
#[derive(Clone, Copy, Debug)]
struct Rows {
    top_mm: f64,
    pitch_mm: f64,
    count: u32,
}

impl Rows {
    /// Returns a facet as rows meet it, if any does.
    fn of_facet(&self, facet: &PlacedFacet) -> Option<RowFacet> {
        let row = |y: f64| (self.top_mm - y) / self.pitch_mm - 0.5;
        RowFacet::new(facet.map(|[x, y, z_um]| [x, row(y), z_um]), self.count)
    }
}

/// A part seen along rows, for comparing it with layers.
///
/// Volumes are exact for the facets wherever a vertical line meets at most one facet of a layer.
/// Where it meets several, the difference is exact along x and z, and along y a sum over rows, as
/// in images. If the mesh has a gap, rows measure the whole part.
#[derive(Debug)]
pub struct LayeredPart {
    facets: FacetIndex,
    rows: Rows,
    rule: FillRule,
    side: Side,
    mesh: OnceLock<MeshFacts>,
    /// Found for the thickest layers asked about so far.
    overlaps: Mutex<Option<Arc<OverlapRows>>>,
}

/// The data of all facets together.
#[derive(Clone, Copy, Debug)]
struct MeshFacts {
    is_closed: bool,
    mean_height_um: f64,
}

impl LayeredPart {
    /// Looks at a part along rows that are `pitch` apart, the first half a pitch below
    /// the part's greatest y. Details between two rows are not seen.
    ///
    /// # Errors
    /// Returns an error if there would be more rows than any image has.
    pub fn new(facets: FacetIndex, pitch: Length, fill: Fill) -> Result<Self, HeightsError> {
        let height_mm = facets.max()[1] - facets.min()[1];
        let count = (height_mm / pitch.mm()).ceil().max(1.0);
        // Negated, so that a pitch of NaN fails, too.
        if !(pitch.um() > 0.0 && count <= MAX_ROWS) {
            return Err(HeightsError::TooManyRows { pitch });
        }
        let rows = Rows { top_mm: facets.max()[1], pitch_mm: pitch.mm(), count: count as u32 };
        let rule = facets.fill_rule(fill);
        let (mesh, overlaps) = (OnceLock::new(), Mutex::new(None));
        Ok(Self { facets, rows, rule, side: Side::Both, mesh, overlaps })
    }

    /// Builds layers on a side of the part: of all sections between their bottom and their top,
    /// instead of the section at the top.
    #[must_use]
    pub fn on_side(self, side: Side) -> Self {
        Self { side, ..self }
    }

    pub(crate) fn side(&self) -> Side {
        self.side
    }

    /// Returns the heights of the lowest and the highest point, in micrometers.
    pub fn heights_um(&self) -> [f64; 2] {
        [self.facets.min()[2], self.facets.max()[2]]
    }

    pub(crate) fn facets(&self) -> &FacetIndex {
        &self.facets
    }

    pub(crate) fn rule(&self) -> &FillRule {
        &self.rule
    }

    pub(crate) fn row_facet(&self, facet: &PlacedFacet) -> Option<RowFacet> {
        self.rows.of_facet(facet)
    }

    /// Returns where facets lie above each other in layers up to some thickness, if the mesh is
    /// closed.
    pub(crate) fn overlaps(&self, reach_um: f64) -> Option<Overlaps<'_>> {
        let mesh = self.mesh.get_or_init(|| self.mesh_facts());
        if !mesh.is_closed {
            return None;
        }
        let known = || self.overlaps.lock().unwrap_or_else(PoisonError::into_inner);
        let rows = known().clone().filter(|rows| rows.reach_um() >= reach_um);
        // Not locked meanwhile, as threads that wait may be given other work on the part.
        let find = || Arc::new(OverlapRows::new(self, reach_um, mesh.mean_height_um));
        let rows = rows.unwrap_or_else(find);
        *known() = Some(rows.clone());
        Some(Overlaps::new(self, rows))
    }

    fn mesh_facts(&self) -> MeshFacts {
        let (mut edges, mut count, mut height_um) = (EdgeSum::default(), 0u32, 0.0);
        self.facets.for_each(|facet, body| {
            edges.add(facet, self.rule.name_of(body));
            let (low, high) = facet_heights(facet);
            (count, height_um) = (count + 1, height_um + (high - low));
        });
        let mean_height_um = height_um / f64::from(count.max(1));
        MeshFacts { is_closed: edges.is_closed(), mean_height_um }
    }

    /// Returns the heights of flat faces in micrometers, rising: of level facets whose
    /// areas add up to at least a row's pitch squared. The lowest corner counts, since
    /// faces that were turned into their place are level only up to rounding.
    pub fn flat_faces_um(&self) -> Vec<f64> {
        let mut faces = Vec::new();
        self.facets.for_each(|facet, _| {
            let (low, high) = facet_heights(facet);
            if high - low <= LEVEL_UM {
                faces.push((low, normal(facet)[2].abs() / 2.0));
            }
        });
        faces.sort_by(|a, b| a.0.total_cmp(&b.0));
        let least_mm2 = self.rows.pitch_mm * self.rows.pitch_mm;
        let at_one_height = faces.chunk_by(|a, b| b.0 - a.0 <= LEVEL_UM);
        let large =
            at_one_height.filter(|faces| faces.iter().map(|f| f.1).sum::<f64>() >= least_mm2);
        large.map(|faces| faces[0].0).collect()
    }

    /// Returns the layers from one height to each of several rising tops, all in
    /// micrometers. A layer that holds the part's top has its section there, as in the
    /// slicer.
    ///
    /// # Panics
    /// Panics if there is no top, or one is not above the bottom.
    pub fn layers(&self, bottom_um: f64, tops_um: &[f64]) -> SweptLayers {
        assert!(tops_um.first().is_some_and(|&top| top > bottom_um), "a layer has some thickness");
        let part_top_um = self.facets.max()[2];
        let plane = |top: f64| if bottom_um <= part_top_um { top.min(part_top_um) } else { top };
        let planes: Vec<f64> = tops_um.iter().map(|&top| plane(top) - bottom_um).collect();
        let last_um = plane(tops_um[tops_um.len() - 1]);
        let facets = self.facets.between(bottom_um, last_um);
        let Rise { changes, bottom_area, unavoidable, rows_left_out } =
            self.all(&facets, [bottom_um, last_um], &planes);
        let steepest = steepest(&facets, bottom_um, tops_um);
        let layer = |k: usize| {
            let section = SweptSection { plane_um: planes[k], bottom_area, change: changes[k] };
            let layer = section.swept(bottom_um, tops_um[k] - bottom_um, self.side);
            SweptLayer { steepest: steepest[k], rows_left_out, ..layer }
        };
        SweptLayers {
            each: (0..tops_um.len()).map(layer).collect(),
            unavoidable_mm3: unavoidable / 1000.0,
        }
    }

    /// Returns the changes from the bottom to each plane above it: the changes by facets alone, and
    /// how rows differ from them. Where the mesh has a gap, rows alone count.
    fn all(&self, facets: &[(PlacedFacet, u32)], z_um: [f64; 2], planes: &[f64]) -> Rise {
        let stripes = self.stripes(facets);
        let closed = FacetSums::sum(facets, z_um[0], planes, self.side)
            .filter(super::facets::FacetSums::bottom_is_closed);
        if let Some(sum) = closed {
            let mut rise = self.rows(&stripes, z_um, planes, RowsAdd::Differences);
            if rise.rows_left_out == 0 {
                rise.bottom_area += sum.bottom_area();
                rise.changes.iter_mut().zip(sum.changes).for_each(|(rise, sum)| rise.add(sum));
                return rise;
            }
        }
        self.rows(&stripes, z_um, planes, RowsAdd::All)
    }

    /// Returns the facets by the stripes of rows that meet them.
    fn stripes(&self, facets: &[(PlacedFacet, u32)]) -> Vec<Vec<(RowFacet, u32)>> {
        let stripe_rows = self.rows.count.div_ceil(STRIPES);
        let mut stripes: Vec<Vec<(RowFacet, u32)>> = (0..STRIPES).map(|_| Vec::new()).collect();
        for (facet, body) in facets {
            let Some(facet) = self.rows.of_facet(facet) else { continue };
            let Range { start: first, end } = facet.rows();
            for stripe in first / stripe_rows..=(end - 1) / stripe_rows {
                stripes[stripe as usize].push((facet, self.rule.name_of(*body)));
            }
        }
        stripes
    }

    /// Returns what all rows add.
    fn rows(
        &self,
        stripes: &[Vec<(RowFacet, u32)>],
        z_um: [f64; 2],
        planes: &[f64],
        adds: RowsAdd,
    ) -> Rise {
        let stripe_rows = self.rows.count.div_ceil(STRIPES);
        let of_stripe = |(stripe, facets): (usize, &Vec<(RowFacet, u32)>)| {
            let first = stripe as u32 * stripe_rows;
            let mut cuts = RowCuts::default();
            for (facet, body) in facets {
                cuts.add_facet(facet, *body, [first, first + stripe_rows], z_um);
            }
            self.rise(&cuts, first, stripe_rows as usize, planes, adds)
        };
        let stripes: Vec<Rise> = stripes.par_iter().enumerate().map(of_stripe).collect();
        stripes.into_iter().reduce(Rise::and).expect("there are stripes")
    }

    pub(crate) fn sweep(&self, adds: RowsAdd) -> Sweep<'_> {
        Sweep::new(&self.rule, self.side, self.rows.pitch_mm, adds)
    }

    /// Returns what some rows add, from the first on.
    pub(crate) fn rise(
        &self,
        cuts: &RowCuts,
        first: u32,
        rows: usize,
        planes: &[f64],
        adds: RowsAdd,
    ) -> Rise {
        let (mut profile, mut sweep) = (ChangeProfile::new(planes), self.sweep(adds));
        let mut of_rows = CutRows::new(cuts, first, rows);
        let mut rows_left_out = 0;
        for row in 0..rows {
            let (toggles, slopes) = of_rows.sorted_row(row);
            rows_left_out += u32::from(!sweep.add(toggles, slopes, &mut profile));
        }
        Rise {
            changes: profile.changes(),
            bottom_area: profile.bottom_area,
            unavoidable: profile.unavoidable,
            rows_left_out,
        }
    }
}

/// Changes of a part's section from a bottom up, in square millimeters and micrometers of
/// height.
pub(crate) struct Rise {
    /// For each plane.
    pub(crate) changes: Vec<ProfileChange>,
    pub(crate) bottom_area: f64,
    unavoidable: f64,
    rows_left_out: u32,
}

impl Rise {
    /// Returns what two groups of rows add together.
    pub(crate) fn and(mut self, other: Self) -> Self {
        self.bottom_area += other.bottom_area;
        self.unavoidable += other.unavoidable;
        self.rows_left_out += other.rows_left_out;
        self.changes.iter_mut().zip(other.changes).for_each(|(sum, change)| sum.add(change));
        self
    }
}

/// Returns |N_z| of a facet's unit normal: 0 for upright facets and those without an area.
pub(crate) fn cosine_to_vertical(facet: &PlacedFacet) -> f64 {
    let normal = normal(facet);
    let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
    if length > 0.0 { normal[2].abs() / length } else { 0.0 }
}

/// Returns a facet's normal, as long as twice its area in square millimeters.
fn normal(facet: &PlacedFacet) -> [f64; 3] {
    let [a, b, c] = facet.map(|[x, y, z_um]| [x, y, z_um / 1000.0]);
    let [u, v] = [b, c].map(|to| [0, 1, 2].map(|axis| to[axis] - a[axis]));
    let cross = |i: usize, j: usize| u[i] * v[j] - u[j] * v[i];
    [cross(1, 2), cross(2, 0), cross(0, 1)]
}

/// Returns the greatest |N_z| of the facets above a bottom and below each of several
/// tops.
fn steepest(facets: &[(PlacedFacet, u32)], bottom_um: f64, tops_um: &[f64]) -> Vec<f64> {
    let mut steepest = vec![0.0; tops_um.len()];
    for (facet, _) in facets {
        let (low, high) = facet_heights(facet);
        let first = tops_um.partition_point(|&top| top <= low);
        if high > bottom_um && first < tops_um.len() {
            steepest[first] = f64::max(steepest[first], cosine_to_vertical(facet));
        }
    }
    for k in 1..steepest.len() {
        steepest[k] = f64::max(steepest[k], steepest[k - 1]);
    }
    steepest
}
