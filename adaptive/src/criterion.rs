//! Measures of a layer's error.

use std::fmt::{self, Debug, Display};
use std::str::FromStr;

use lamp_stack::Length;

use crate::swept_layer::{SweptLayer, SweptLayers, share};

/// A measure of a layer's error. It depends on the layer alone.
///
/// ```
/// use lamp_adaptive::{Criterion, CuspHeight, SweptLayer};
///
/// // Walls at 30 degrees to the vertical: half of each normal points up.
/// let layer = SweptLayer { thickness_um: 100.0, steepest: 0.5, ..SweptLayer::default() };
/// assert_eq!(CuspHeight.measure(&layer), 50.0);
/// ```
pub trait Criterion: Debug + Send + Sync {
    /// Returns the error, to be compared with a bound.
    fn measure(&self, layer: &SweptLayer) -> f64;

    /// Returns true if no layer thicker than the last of `layers`, up to `max_um`, can
    /// be within the bound. If false, all of them are looked at.
    fn rules_out_thicker(&self, layers: &SweptLayers, max_um: f64, bound: f64) -> bool {
        let _ = (layers, max_um, bound);
        false
    }
}

/// The volume lost and gained, as a share of the part's volume in the layer (002
/// equation 24).
#[derive(Clone, Copy, Debug, Default)]
pub struct VolumeDeviation;

impl Criterion for VolumeDeviation {
    fn measure(&self, layer: &SweptLayer) -> f64 {
        layer.deviation()
    }

    // Let the last of the layers be `w` thick and hold the volume `V1`, of which at least `L` is
    // wrong in any thicker layer. A layer of thickness `(1 + r) w` whose section has the area `a`
    // holds `V1 + V2`, of which `S1` and `S2` are wrong. The part above `w` that its section lacks
    // is wrong, so `V2 <= S2 + r w a`; the excess of its section over the part below is wrong, so
    // `w a <= S1 + V1`. If it is within the bound `d`, then `S1 + S2 <= d (V1 + V2)`, and with
    // `m = max(1, r)` follows `V1 + V2 <= V1 (1 + r) / (1 - m d)`. But `L <= S1`: where `L` is more
    // than `d` times that, no such layer is within the bound.
    fn rules_out_thicker(&self, layers: &SweptLayers, max_um: f64, bound: f64) -> bool {
        let Some(last) = layers.each.last() else { return false };
        let r = max_um / last.thickness_um - 1.0;
        let left = 1.0 - r.max(1.0) * bound;
        // By more than rounding.
        left > 0.0
            && layers.unavoidable_mm3 * left > 1.000_001 * bound * (1.0 + r) * last.volume_mm3
    }
}

/// The cusp height in micrometers: the distance of the layer's edge from the part's
/// surface, along its normal, `c = t |N_z|`.
///
/// Source: Dolenc and Makela, by 002 equations 7 to 10.
#[derive(Clone, Copy, Debug, Default)]
pub struct CuspHeight;

impl Criterion for CuspHeight {
    fn measure(&self, layer: &SweptLayer) -> f64 {
        // 002 eq. 10, solved for the cusp: a layer of thickness t whose edge has the normal N.
        layer.thickness_um * layer.steepest
    }

    // Thicker layers hold all facets of thinner ones.
    fn rules_out_thicker(&self, layers: &SweptLayers, _max_um: f64, bound: f64) -> bool {
        layers.each.last().is_some_and(|last| self.measure(last) > bound)
    }
}

/// The roughness Ra of the layer's steepest stairs in micrometers, `Ra = k t |N_z| + c`: the mean
/// distance of the profile from its mean line.
///
/// The default is the roughness of stairs with upright edges. Their profile is a sawtooth as high as
/// the cusp, `t |N_z|`. Heights along a sawtooth are spread evenly, whatever its teeth, so their
/// mean distance from the middle is a quarter of its height: `k = 1/4`, `c = 0`. Edges of cured
/// layers are rounder; `k` and `c` of a machine are the line through measured values of Ra over
/// `t |N_z|`.
///
/// Source: Pandey's form, by 002 equations 14 and 15, with `|N_z|` in place of the inverse cosine of
/// strands; 002 section 6.2 (b) asks for such a relation.
///
/// ```
/// use lamp_adaptive::{Criterion, Roughness, SweptLayer};
///
/// // Walls at 30 degrees to the vertical: half of each normal points up.
/// let layer = SweptLayer { thickness_um: 100.0, steepest: 0.5, ..SweptLayer::default() };
/// assert_eq!(Roughness::default().measure(&layer), 12.5);
/// let measured: Roughness = "0.2,1.5um".parse()?;
/// assert_eq!(measured.measure(&layer), 11.5);
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    /// The roughness for each unit of cusp height, `k`.
    pub by_cusp: f64,
    /// The roughness of upright walls, `c`.
    pub upright: Length,
}

impl Default for Roughness {
    fn default() -> Self {
        Self { by_cusp: 0.25, upright: Length::default() }
    }
}

impl Criterion for Roughness {
    fn measure(&self, layer: &SweptLayer) -> f64 {
        self.by_cusp * CuspHeight.measure(layer) + self.upright.um()
    }

    // As for cusps: the factor is not below zero.
    fn rules_out_thicker(&self, layers: &SweptLayers, _max_um: f64, bound: f64) -> bool {
        layers.each.last().is_some_and(|last| self.measure(last) > bound)
    }
}

impl Display for Roughness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.by_cusp, self.upright)
    }
}

impl FromStr for Roughness {
    type Err = String;

    /// Parses `0.25,0um`: the factor, and the roughness of upright walls.
    fn from_str(text: &str) -> Result<Self, String> {
        let read = || {
            let (factor, upright) = text.split_once(',')?;
            let by_cusp: f64 = factor.trim().parse().ok()?;
            let upright: Length = upright.parse().ok()?;
            let is_good = by_cusp > 0.0 && by_cusp.is_finite() && upright.um() >= 0.0;
            is_good.then_some(Self { by_cusp, upright })
        };
        read().ok_or_else(|| {
            format!("`{text}` is no line of roughness: write its slope and its start, 0.25,0um")
        })
    }
}

/// The change of the section's area from the layer's bottom to its top, as a share of the area at
/// the bottom. It does not see walls that lean without a change of area (002 figure 45).
///
/// Source: Jamieson and Hacker, by 002 equation 23.
#[derive(Clone, Copy, Debug, Default)]
pub struct AreaDeviation;

impl Criterion for AreaDeviation {
    fn measure(&self, layer: &SweptLayer) -> f64 {
        // 002 eq. 23: |A_(i+1) - A_i| / A_i.
        share((layer.top_area_mm2 - layer.bottom_area_mm2).abs(), layer.bottom_area_mm2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_roughness_are_read_as_written() {
        for text in ["0.25,0um", "0.0708,1.5um", "3,2mm"] {
            assert_eq!(text.parse::<Roughness>().unwrap().to_string(), text);
        }
        assert_eq!(Roughness::default().to_string(), "0.25,0um");
        for wrong in ["", "0.25", "0,1um", "-1,0um", "0.25,-1um", "nan,0um", "inf,0um", "0.2,1"] {
            assert!(wrong.parse::<Roughness>().is_err(), "{wrong}");
        }
    }
}
