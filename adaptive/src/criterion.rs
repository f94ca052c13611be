//! How far a layer is off the part, by several measures.

use std::fmt::Debug;

use crate::slab::{Slab, Slabs, share};

/// A measure of how far a layer is off the part. It sees the slab alone, wherever
/// that was found.
pub trait Criterion: Debug + Send + Sync {
    /// How far the layer is off, to be compared with the greatest allowed.
    fn measure(&self, slab: &Slab) -> f64;

    /// Whether no layer that is thicker than the last of `slabs`, up to `most_um`, can
    /// be within a bound. Where that is not known, all of them are looked at.
    fn rules_out_thicker(&self, slabs: &Slabs, most_um: f64, bound: f64) -> bool {
        let _ = (slabs, most_um, bound);
        false
    }
}

/// The volume lost and gained, as a share of the part's volume in the layer (002
/// equation 24).
#[derive(Clone, Copy, Debug, Default)]
pub struct VolumeDeviation;

impl Criterion for VolumeDeviation {
    fn measure(&self, slab: &Slab) -> f64 {
        slab.deviation()
    }

    /// Let the last of the slabs be `w` thick and hold the volume `V1`, of which at
    /// least `L` is wrong in any thicker layer. A layer of thickness `(1 + r) w` whose
    /// section has the area `a` holds `V1 + V2`, of which `S1` and `S2` are wrong.
    /// What its section lacks of the part above `w` is wrong, so `V2 <= S2 + r w a`;
    /// what it has beyond the part below is wrong, so `w a <= S1 + V1`. If it is
    /// within the bound `d`, then `S1 + S2 <= d (V1 + V2)`, and with `m = max(1, r)`
    /// follows `V1 + V2 <= V1 (1 + r) / (1 - m d)`. But `L <= S1`: where `L` is more
    /// than `d` times that, no such layer is within the bound.
    fn rules_out_thicker(&self, slabs: &Slabs, most_um: f64, bound: f64) -> bool {
        let Some(last) = slabs.each.last() else { return false };
        let r = most_um / last.thickness_um - 1.0;
        let left = 1.0 - r.max(1.0) * bound;
        // More than rounding apart.
        left > 0.0 && slabs.unavoidable_mm3 * left > 1.000_001 * bound * (1.0 + r) * last.volume_mm3
    }
}

/// The cusp height in micrometres: how far the slab's edge is off the part's
/// surface, along its normal, `c = t |N_z|`.
///
/// Source: Dolenc and Makela, by 002 equations 7 to 10.
#[derive(Clone, Copy, Debug, Default)]
pub struct CuspHeight;

impl Criterion for CuspHeight {
    fn measure(&self, slab: &Slab) -> f64 {
        slab.thickness_um * slab.steepest
    }

    /// Thicker layers hold all facets of thinner ones.
    fn rules_out_thicker(&self, slabs: &Slabs, _most_um: f64, bound: f64) -> bool {
        slabs.each.last().is_some_and(|last| self.measure(last) > bound)
    }
}

/// The change of the section's area from the layer's bottom to its top, as a share
/// of that at the bottom. Blind to walls that lean without a change of area (002
/// figure 45).
///
/// Source: Jamieson and Hacker, by 002 equation 23.
#[derive(Clone, Copy, Debug, Default)]
pub struct AreaDeviation;

impl Criterion for AreaDeviation {
    fn measure(&self, slab: &Slab) -> f64 {
        share((slab.top_area_mm2 - slab.bottom_area_mm2).abs(), slab.bottom_area_mm2)
    }
}
