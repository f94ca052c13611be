//! The gray level that cures each depth.

use crate::Length;

/// The gray level that cures each depth, for one exposure time. Resins make it,
/// slicing gray layers reads it.
///
/// ```
/// use lamp_stack::{DepthLevels, Length};
///
/// // A resin whose cure depth is in proportion to the level.
/// let um = Length::from_um;
/// let levels = DepthLevels::new(um(100.0), |gray| um(100.0 * gray));
/// assert_eq!([0.0, 50.0, 100.0, 120.0].map(|depth| levels.level(um(depth))), [0, 128, 255, 255]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DepthLevels {
    reach_um: f64,
    /// From the depth at `i` on, the level is above `i`.
    steps_um: Box<[f64; 255]>,
}

impl DepthLevels {
    /// Creates the levels of a resin. `depth_of` gives the depth that a gray level
    /// from 0 to 1 cures, never less for a whiter one. Depths from `reach` on are
    /// white.
    pub fn new(reach: Length, depth_of: impl Fn(f64) -> Length) -> Self {
        // The nearest level changes half way between two levels.
        let step = |i: usize| depth_of((i as f64 + 0.5) / 255.0).um();
        Self { reach_um: reach.um(), steps_um: Box::new(std::array::from_fn(step)) }
    }

    /// Returns the level from 0 to 255 that cures a depth most nearly. A depth of
    /// zero is black.
    #[inline]
    pub fn level(&self, depth: Length) -> u8 {
        let um = depth.um();
        if um <= 0.0 {
            0
        } else if um >= self.reach_um {
            255
        } else {
            self.steps_um.partition_point(|&step| step <= um) as u8
        }
    }

    /// Returns the depth from which on all is white.
    pub fn reach(&self) -> Length {
        Length::from_um(self.reach_um)
    }
}
