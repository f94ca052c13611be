//! A part, and the layers that it may be built of.

use std::ops::Range;

use lamp_slicer::scan::RowFacet;
use lamp_slicer::{FacetIndex, Fill, PlacedFacet};
use lamp_stack::{Grouped, Length};
use rayon::prelude::*;

use crate::error::HeightsError;
use crate::profile::{Change, Profile};
use crate::row_cuts::Cuts;
use crate::slab::{Slab, Slabs};
use crate::sweep::{Slope, Sweep, Toggle};

/// Rows are worked on in so many stripes, whatever the threads, so that sums do
/// not depend on them.
const STRIPES: u32 = 16;

/// Facets of less height are level: far more than rounding, far less than a step.
const LEVEL_UM: f64 = 0.05;

/// More rows than any image has.
const MOST_ROWS: f64 = 16_777_216.0;

/// Rows of the image: x in millimetres, and y in rows, downwards.
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

/// A part as layers see it.
///
/// Volumes are exact along x and z, as far as the facets tell; along y they are
/// sums over rows, as images are.
#[derive(Debug)]
pub struct LayeredPart {
    body: FacetIndex,
    rows: Rows,
    fill: Fill,
}

impl LayeredPart {
    /// A part seen along rows that are `pitch` apart, the first of which is half a
    /// pitch below the part's greatest y. What lies between two rows is not seen.
    ///
    /// # Errors
    /// Where there would be more rows than any image has.
    pub fn new(body: FacetIndex, pitch: Length, fill: Fill) -> Result<Self, HeightsError> {
        let height_mm = body.max()[1] - body.min()[1];
        let count = (height_mm / pitch.mm()).ceil().max(1.0);
        // Written so that a pitch of NaN or zero fails, too.
        if !(pitch.um() > 0.0 && count <= MOST_ROWS) {
            return Err(HeightsError::TooManyRows { pitch_um: pitch.um() });
        }
        let rows = Rows { top_mm: body.max()[1], pitch_mm: pitch.mm(), count: count as u32 };
        Ok(Self { body, rows, fill })
    }

    /// The height of its lowest and its highest point, in micrometres.
    pub fn heights_um(&self) -> [f64; 2] {
        [self.body.min()[2], self.body.max()[2]]
    }

    /// The heights of its flat faces, in micrometres, rising: those of level facets
    /// of together at least a row's pitch squared. Faces that were turned into their
    /// place are level but for rounding; the lowest corner counts.
    pub fn flat_faces_um(&self) -> Vec<f64> {
        let mut faces = Vec::new();
        self.body.for_each(|facet| {
            let [low, high] = height_of(facet);
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

    /// The layers from one height to each of several tops, which rise: all in
    /// micrometres. A layer that holds the part's top has its section there, as in
    /// the slicer.
    ///
    /// # Panics
    /// Where there is no top, or one is not above the bottom.
    pub fn slabs(&self, bottom_um: f64, tops_um: &[f64]) -> Slabs {
        assert!(tops_um.first().is_some_and(|&top| top > bottom_um), "a layer has some thickness");
        let part_top_um = self.body.max()[2];
        let plane = |top: f64| if bottom_um <= part_top_um { top.min(part_top_um) } else { top };
        let planes: Vec<f64> = tops_um.iter().map(|&top| plane(top) - bottom_um).collect();
        let last_um = plane(tops_um[tops_um.len() - 1]);
        let facets = self.body.between(bottom_um, last_um);
        let Rise { changes, bottom_width, unavoidable, rows_left_out } =
            self.rise(&facets, [bottom_um, last_um], &planes);
        let steepest = steepest(&facets, bottom_um, tops_um);
        let pitch_mm = self.rows.pitch_mm;
        let slab = |k: usize| {
            let Change { width, lost, gained } = changes[k];
            let top_width = (bottom_width + width).max(0.0);
            let (lost, gained) = (lost.max(0.0), gained.max(0.0));
            let thickness_um = tops_um[k] - bottom_um;
            // Above the part's top there is only what the slab has too much.
            let above = top_width * (thickness_um - planes[k]);
            Slab {
                bottom_um,
                thickness_um,
                volume_mm3: (top_width * planes[k] + lost - gained).max(0.0) * pitch_mm / 1000.0,
                lost_mm3: lost * pitch_mm / 1000.0,
                gained_mm3: (gained + above) * pitch_mm / 1000.0,
                bottom_area_mm2: bottom_width * pitch_mm,
                top_area_mm2: top_width * pitch_mm,
                steepest: steepest[k],
                rows_left_out,
            }
        };
        Slabs {
            each: (0..tops_um.len()).map(slab).collect(),
            unavoidable_mm3: unavoidable * pitch_mm / 1000.0,
        }
    }

    /// What changes from the bottom to each plane above it, over all rows.
    fn rise(&self, facets: &[PlacedFacet], z_um: [f64; 2], planes: &[f64]) -> Rise {
        let stripe_rows = self.rows.count.div_ceil(STRIPES);
        let mut stripes: Vec<Vec<RowFacet>> = (0..STRIPES).map(|_| Vec::new()).collect();
        for facet in facets.iter().filter_map(|facet| self.rows.of_facet(facet)) {
            let Range { start: first, end } = facet.rows();
            for stripe in first / stripe_rows..=(end - 1) / stripe_rows {
                stripes[stripe as usize].push(facet);
            }
        }
        let of_stripe = |(stripe, facets): (usize, Vec<RowFacet>)| {
            let first = stripe as u32 * stripe_rows;
            let mut cuts = Cuts::default();
            for facet in &facets {
                cuts.add_facet(facet, [first, first + stripe_rows], z_um);
            }
            self.sweep(&cuts, first, stripe_rows, planes)
        };
        let stripes: Vec<Rise> = stripes.into_par_iter().enumerate().map(of_stripe).collect();
        let mut sum = Rise { changes: vec![Change::default(); planes.len()], ..Rise::default() };
        for stripe in stripes {
            sum.bottom_width += stripe.bottom_width;
            sum.unavoidable += stripe.unavoidable;
            sum.rows_left_out += stripe.rows_left_out;
            sum.changes.iter_mut().zip(stripe.changes).for_each(|(sum, change)| sum.add(change));
        }
        sum
    }

    fn sweep(&self, cuts: &Cuts, first: u32, rows: u32, planes: &[f64]) -> Rise {
        let mut profile = Profile::new(planes);
        let mut sweep = Sweep::new(self.fill);
        let rows = rows as usize;
        let toggle = |toggle: &Toggle| ((toggle.row - first) as usize, *toggle);
        let slope = |slope: &Slope| ((slope.row - first) as usize, *slope);
        let mut toggles = Grouped::new(rows, || cuts.toggles.iter().map(toggle));
        let mut slopes = Grouped::new(rows, || cuts.slopes.iter().map(slope));
        let mut rows_left_out = 0;
        for row in 0..rows {
            let (toggles, slopes) = (toggles.group_mut(row), slopes.group_mut(row));
            toggles.sort_unstable_by(|a, b| a.x.total_cmp(&b.x));
            slopes.sort_unstable_by(|a, b| a.x[0].total_cmp(&b.x[0]));
            rows_left_out += u32::from(!sweep.add(toggles, slopes, &mut profile));
        }
        Rise {
            changes: profile.changes(),
            bottom_width: profile.bottom_width,
            unavoidable: profile.unavoidable,
            rows_left_out,
        }
    }
}

/// What rows see of a part from a bottom up, in millimetres and micrometres along
/// them.
#[derive(Default)]
struct Rise {
    /// For each plane.
    changes: Vec<Change>,
    bottom_width: f64,
    unavoidable: f64,
    rows_left_out: u32,
}

/// A facet's normal, in millimetres squared.
fn normal(facet: &PlacedFacet) -> [f64; 3] {
    let [a, b, c] = facet.map(|[x, y, z_um]| [x, y, z_um / 1000.0]);
    let [u, v] = [b, c].map(|to| [0, 1, 2].map(|axis| to[axis] - a[axis]));
    let cross = |i: usize, j: usize| u[i] * v[j] - u[j] * v[i];
    [cross(1, 2), cross(2, 0), cross(0, 1)]
}

/// The heights of a facet's lowest and highest corner.
fn height_of(facet: &PlacedFacet) -> [f64; 2] {
    let [a, b, c] = facet.map(|corner| corner[2]);
    [a.min(b).min(c), a.max(b).max(c)]
}

/// The greatest |N_z| of the facets above a bottom and below each of several tops.
fn steepest(facets: &[PlacedFacet], bottom_um: f64, tops_um: &[f64]) -> Vec<f64> {
    let mut steepest = vec![0.0; tops_um.len()];
    for facet in facets {
        let [low, high] = height_of(facet);
        let normal = normal(facet);
        let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
        let first = tops_um.partition_point(|&top| top <= low);
        if high > bottom_um && length > 0.0 && first < tops_um.len() {
            steepest[first] = f64::max(steepest[first], normal[2].abs() / length);
        }
    }
    for k in 1..steepest.len() {
        steepest[k] = f64::max(steepest[k], steepest[k - 1]);
    }
    steepest
}
