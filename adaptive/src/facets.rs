//! Measures layers by facets alone: exact where no other facet is above or below them.
//!
//! A facet is a plane. The area that it covers between two heights, seen from above, is a tent over
//! height: zero at the lowest and the highest corner, largest at the one between. So the volume
//! that it makes a layer lose or gain is a cubic polynomial of the layer's top. The segments in
//! which facets cut the layer's bottom enclose the section there.

use lamp_slicing::{PlacedFacet, Side};
use rayon::prelude::*;

use crate::profile::{ChangeProfile, ProfileChange, SurfacePiece};

/// The number of chunks of facets that are worked on at once. It does not follow the
/// threads, so that sums do not depend on them.
const CHUNKS: usize = 16;

/// Contours whose segments miss each other by no more than this share of their length are
/// closed: far more than rounding.
const CLOSED: f64 = 1e-9;

/// Sums over facets between a layer's bottom and its tops.
#[derive(Debug)]
pub(crate) struct FacetSums {
    /// The changes from the bottom to each top.
    pub(crate) changes: Vec<ProfileChange>,
    bottom: Contours,
}

impl FacetSums {
    /// Sums facets up, with tops above the bottom in micrometers, rising. Returns nothing if
    /// there are no facets.
    pub(crate) fn sum(
        facets: &[(PlacedFacet, u32)],
        bottom_um: f64,
        tops: &[f64],
        side: Side,
    ) -> Option<Self> {
        let [x, y, _] = facets.first()?.0[0];
        let of_chunk = |chunk: &[(PlacedFacet, u32)]| {
            let (mut profile, mut bottom) = (ChangeProfile::new(tops), Contours::default());
            for (facet, _) in chunk {
                // From a corner nearby, so that areas do not drown in rounding.
                let facet =
                    facet.map(|corner| [corner[0] - x, corner[1] - y, corner[2] - bottom_um]);
                add_facet(&facet, side, &mut profile);
                bottom.add_facet(&facet);
            }
            Self { changes: profile.changes(), bottom }
        };
        let chunks: Vec<Self> =
            facets.par_chunks(facets.len().div_ceil(CHUNKS)).map(of_chunk).collect();
        chunks.into_iter().reduce(|mut sum, chunk| {
            sum.bottom.add(&chunk.bottom);
            sum.changes.iter_mut().zip(chunk.changes).for_each(|(sum, change)| sum.add(change));
            sum
        })
    }

    /// Returns true if the contours at the bottom are closed.
    pub(crate) fn bottom_is_closed(&self) -> bool {
        let [x, y] = self.bottom.end;
        x.abs() + y.abs() <= CLOSED * self.bottom.length
    }

    /// Returns the area within the contours at the bottom, in square millimeters, counted as often
    /// as they wind around it.
    pub(crate) fn bottom_area(&self) -> f64 {
        self.bottom.area
    }
}

/// Adds the part of a facet that is above the bottom, at height 0.
fn add_facet(facet: &PlacedFacet, side: Side, profile: &mut ChangeProfile<'_>) {
    let mut heights = facet.map(|corner| corner[2]);
    heights.sort_unstable_by(f64::total_cmp);
    let [low, middle, high] = heights;
    let area = area_from_above(facet);
    // An upright facet covers nothing.
    if high <= 0.0 || area == 0.0 {
        return;
    }
    let mut add = |heights: [f64; 2], extent: f64, density| {
        let [lost, gained] = if area > 0.0 { [heights, [0.0; 2]] } else { [[0.0; 2], heights] };
        let (section, outline) = (-area.signum(), outline(side, area < 0.0));
        profile.add(SurfacePiece { heights, extent, density, section, outline, lost, gained });
    };
    let whole = area.abs();
    if low == high {
        return add([low, high], whole, [1.0; 2]);
    }
    // The share of the area below the middle corner is its share of the height.
    let below = whole * ((middle - low) / (high - low));
    for (ends, extent, density) in
        [([low, middle], below, [0.0, 2.0]), ([middle, high], whole - below, [2.0, 0.0])]
    {
        let share = (ends[1] - ends[0].max(0.0)) / (ends[1] - ends[0]);
        if ends[1] <= 0.0 || extent <= 0.0 {
            continue;
        }
        if ends[0] >= 0.0 {
            add(ends, extent, density);
            continue;
        }
        // The rest above the bottom: its density changes linearly.
        let at_bottom = density[1] + (density[0] - density[1]) * share;
        let mean = 0.5 * (at_bottom + density[1]);
        if mean > 0.0 {
            let cut = [at_bottom / mean, density[1] / mean];
            add([0.0, ends[1]], extent * share * mean, cut);
        }
    }
}

/// Returns how much of the first surface on the way up a column all sections together gain, or lose
/// if the number is negative. `enters` is true if the way up enters the part there.
pub(crate) fn outline(side: Side, enters: bool) -> f64 {
    match (side, enters) {
        (Side::Outside, true) => 1.0,
        (Side::Inside, false) => -1.0,
        _ => 0.0,
    }
}

/// Returns the area that a facet covers, seen from above: less than 0 if it faces down.
pub(crate) fn area_from_above(facet: &PlacedFacet) -> f64 {
    let [a, b, c] = facet;
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]))
}

/// Contours of a section, as a sum over their segments.
#[derive(Clone, Copy, Debug, Default)]
struct Contours {
    area: f64,
    length: f64,
    /// Where all segments lead, one after the other: back to the start if they are closed.
    end: [f64; 2],
}

impl Contours {
    /// Adds the segment of a facet at height 0. A corner there counts as below it.
    fn add_facet(&mut self, facet: &PlacedFacet) {
        let (mut from, mut to) = (None, None);
        for k in 0..3 {
            let [a, b] = [facet[k], facet[(k + 1) % 3]];
            match (a[2] > 0.0, b[2] > 0.0) {
                (true, false) => from = Some(at_bottom(b, a)),
                (false, true) => to = Some(at_bottom(a, b)),
                _ => {}
            }
        }
        // With the part on the left.
        let (Some([x, y]), Some([u, v])) = (from, to) else { return };
        self.area += 0.5 * (x * v - u * y);
        self.length += (u - x).abs() + (v - y).abs();
        self.end = [self.end[0] + (u - x), self.end[1] + (v - y)];
    }

    fn add(&mut self, other: &Self) {
        self.area += other.area;
        self.length += other.length;
        self.end = [self.end[0] + other.end[0], self.end[1] + other.end[1]];
    }
}

/// Returns where an edge meets height 0, going from its lower to its upper end, so that both facets
/// on it agree.
fn at_bottom(below: [f64; 3], above: [f64; 3]) -> [f64; 2] {
    let share = below[2] / (below[2] - above[2]);
    [0, 1].map(|axis| below[axis] + share * (above[axis] - below[axis]))
}
