//! How far a layer is off the part, by several measures.

use std::fmt::Debug;

use crate::slab::{Slab, share};

/// A measure of how far a layer is off the part. It sees the slab alone, wherever
/// that was found.
pub trait Criterion: Debug + Send + Sync {
    /// How far the layer is off, to be compared with the greatest allowed.
    fn measure(&self, slab: &Slab) -> f64;
}

/// The volume lost and gained, as a share of the part's volume in the layer (002
/// equation 24).
#[derive(Clone, Copy, Debug, Default)]
pub struct VolumeDeviation;

impl Criterion for VolumeDeviation {
    fn measure(&self, slab: &Slab) -> f64 {
        slab.deviation()
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
