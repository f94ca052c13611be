//! The gray level of a depth.

use lamp_stack::Length;

/// Which gray level cures how deep, for one time of exposure.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthLevels {
    reach_um: f64,
    /// From the depth at `i` on, the level is above `i`.
    steps_um: Box<[f64; 255]>,
}

impl DepthLevels {
    /// The levels of a resin: `depth_of` says how deep a gray level from 0 to 1
    /// cures, and never less for a whiter one. Depths from `reach` on are white.
    pub fn new(reach: Length, depth_of: impl Fn(f64) -> Length) -> Self {
        // Half way between two levels, the nearer one changes.
        let step = |i: usize| depth_of((i as f64 + 0.5) / 255.0).um();
        Self { reach_um: reach.um(), steps_um: Box::new(std::array::from_fn(step)) }
    }

    /// Returns the level from 0 to 255 whose gray cures a depth, to the nearest
    /// level. No depth is black.
    pub fn level(&self, depth: Length) -> u8 {
        self.of_um(depth.um())
    }

    #[inline]
    pub(crate) fn of_um(&self, depth_um: f64) -> u8 {
        if depth_um <= 0.0 {
            0
        } else if depth_um >= self.reach_um {
            255
        } else {
            self.steps_um.partition_point(|&step| step <= depth_um) as u8
        }
    }

    /// From this depth on, all is white.
    pub(crate) fn reach_um(&self) -> f64 {
        self.reach_um
    }
}
