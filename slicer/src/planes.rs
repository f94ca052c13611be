//! Where the part is cut.

use std::ops::Range;

use lamp_stack::Length;

use crate::error::SliceError;

/// More layers than any machine builds.
const MOST_LAYERS: f64 = 4e6;

/// Which plane of a layer its section is taken at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PlaneRule {
    /// The layer's top: the section is swept down (002 section 3.2.2).
    #[default]
    Top,
    /// Half way up.
    Middle,
    /// The layer's bottom, seen from inside the layer: a flat underside on it
    /// belongs to the section.
    Bottom,
}

/// The planes at which a part is cut, one a layer, bottom first, all the same
/// thickness apart.
///
/// A part's height is rounded to whole layers, at least one. A last plane that
/// then lies above the part is moved down to the part's top, where flat tops
/// still have their section.
#[derive(Clone, Debug)]
pub(crate) struct Planes {
    z_um: Vec<f64>,
    bottom_um: f64,
    thickness_um: f64,
}

impl Planes {
    /// The planes of a part between two heights (micrometres).
    ///
    /// # Errors
    /// Where there would be more layers than any machine builds.
    pub(crate) fn uniform(
        bottom_um: f64,
        top_um: f64,
        thickness: Length,
        rule: PlaneRule,
    ) -> Result<Self, SliceError> {
        let thickness_um = thickness.um();
        let count = ((top_um - bottom_um) / thickness_um).round().max(1.0);
        // Written so that a thickness of NaN or below zero fails, too.
        if !(thickness_um > 0.0 && count < MOST_LAYERS) {
            let height_mm = (top_um - bottom_um) / 1000.0;
            return Err(SliceError::TooManyLayers { height_mm, thickness_um, layers: count });
        }
        let plane = |k: u32| {
            let k = f64::from(k);
            match rule {
                PlaneRule::Top => (bottom_um + (k + 1.0) * thickness_um).min(top_um),
                PlaneRule::Middle => (bottom_um + (k + 0.5) * thickness_um).min(top_um),
                PlaneRule::Bottom => (bottom_um + k * thickness_um).next_up(),
            }
        };
        Ok(Self { z_um: (0..count as u32).map(plane).collect(), bottom_um, thickness_um })
    }

    /// A single plane.
    pub(crate) fn one(z: Length) -> Self {
        Self { z_um: vec![z.um()], bottom_um: z.um(), thickness_um: 1.0 }
    }

    /// How many layers there are.
    pub(crate) fn len(&self) -> usize {
        self.z_um.len()
    }

    /// The height of a plane, in micrometres.
    #[inline]
    pub(crate) fn z_um(&self, layer: usize) -> f64 {
        self.z_um[layer]
    }

    /// The height of a layer's bottom, in micrometres, to the nanometre.
    pub(crate) fn layer_bottom_um(&self, layer: usize) -> f64 {
        ((self.bottom_um + layer as f64 * self.thickness_um) * 1000.0).round() / 1000.0
    }

    /// The height of a layer's top, where its exposure begins, in micrometres.
    #[inline]
    pub(crate) fn top_um(&self, layer: usize) -> f64 {
        self.bottom_um + (layer as f64 + 1.0) * self.thickness_um
    }

    /// The height of the first layer's bottom, in micrometres.
    pub(crate) fn bottom_um(&self) -> f64 {
        self.bottom_um
    }

    /// The thickness of the layers, in micrometres.
    pub(crate) fn thickness_um(&self) -> f64 {
        self.thickness_um
    }

    /// The layers whose planes lie between two heights: above `low_um`, and
    /// at or below `high_um`. A vertex is above a plane when its z is at or
    /// above the plane's, so these are the planes that part the two.
    #[inline]
    pub(crate) fn between(&self, low_um: f64, high_um: f64) -> Range<usize> {
        self.at_or_below(low_um)..self.at_or_below(high_um)
    }

    /// How many planes lie at or below a height.
    #[inline]
    pub(crate) fn at_or_below(&self, z_um: f64) -> usize {
        // The planes are nearly even: guess, then walk to the exact answer.
        let guess = (z_um - self.z_um[0]) / self.thickness_um + 1.0;
        let mut count = (guess as usize).min(self.z_um.len());
        while count < self.z_um.len() && self.z_um[count] <= z_um {
            count += 1;
        }
        while count > 0 && self.z_um[count - 1] > z_um {
            count -= 1;
        }
        count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planes(height_um: f64, rule: PlaneRule) -> Vec<f64> {
        Planes::uniform(0.0, height_um, Length::from_um(100.0), rule).unwrap().z_um
    }

    #[test]
    fn a_height_of_whole_layers_has_its_planes() {
        assert_eq!(planes(300.0, PlaneRule::Top), [100.0, 200.0, 300.0]);
        assert_eq!(planes(300.0, PlaneRule::Middle), [50.0, 150.0, 250.0]);
        let bottom = planes(300.0, PlaneRule::Bottom);
        assert!(bottom[0] > 0.0 && bottom[0] < 1e-300 && bottom.len() == 3);
    }

    #[test]
    fn other_heights_round_to_whole_layers() {
        assert_eq!(planes(349.9, PlaneRule::Top), [100.0, 200.0, 300.0]);
        assert_eq!(planes(350.0, PlaneRule::Top), [100.0, 200.0, 300.0, 350.0]);
        // 32-bit coordinates miss decimal heights by a little.
        assert_eq!(planes(299.99999, PlaneRule::Top), [100.0, 200.0, 299.99999]);
        assert_eq!(planes(300.00001, PlaneRule::Top), [100.0, 200.0, 300.0]);
        assert_eq!(planes(1.0, PlaneRule::Top), [1.0]);
        assert_eq!(planes(1.0, PlaneRule::Middle), [1.0]);
        assert_eq!(planes(0.0, PlaneRule::Top), [0.0]);
    }

    #[test]
    fn a_vertex_on_a_plane_is_above_it() {
        let planes = Planes::uniform(0.0, 1e5, Length::from_um(100.0), PlaneRule::Top).unwrap();
        assert_eq!(planes.between(0.0, 100.0), 0..1);
        assert_eq!(planes.between(100.0, 200.0), 1..2);
        assert_eq!(planes.between(100.0, 199.0), 1..1);
        assert_eq!(planes.between(-1e9, 1e9), 0..1000);
        for (k, z) in planes.z_um.iter().enumerate() {
            assert_eq!(planes.at_or_below(*z), k + 1);
            assert_eq!(planes.at_or_below(z.next_down()), k);
        }
    }

    #[test]
    fn absurd_counts_are_refused() {
        for thickness in [1e-9, -100.0, 0.0, f64::NAN] {
            let planes = Planes::uniform(0.0, 1e5, Length::from_um(thickness), PlaneRule::Top);
            assert!(planes.is_err(), "{thickness}");
        }
    }
}
