//! The light that each gray level leaves in the resin below.

use crate::Length;

/// The light that an exposure of each gray level leaves in the resin below, for one exposure time:
/// critical doses at the layer's top, and the depth over which they fade by e. Resins make it;
/// slicing layers whose doses add up reads it.
///
/// # Guarantees
/// A whiter level never leaves less, at any depth.
///
/// ```
/// use lamp_stack::{FadingLevels, Length};
///
/// // White brings two critical doses, which fade by e over 100 um.
/// let levels = FadingLevels::new(|gray| (2.0 * gray, Length::from_um(100.0)));
/// assert_eq!(levels.left(255, 0.0), 2.0);
/// // Half a critical dose 20 um below.
/// assert_eq!(levels.level(20.0, 0.5), 78);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct FadingLevels {
    shares: Box<[f64; 256]>,
    depths_um: Box<[f64; 256]>,
    /// The logarithm of the share, and one by the depth, half-way between two levels.
    steps: Box<[[f64; 2]; 255]>,
}

impl FadingLevels {
    /// Creates the levels of a resin. `of` gives the critical doses that a gray level from 0 to 1
    /// brings to the top, and the depth over which they fade by e; neither less for a whiter one.
    pub fn new(of: impl Fn(f64) -> (f64, Length)) -> Self {
        let level = |level: usize| of(level as f64 / 255.0);
        let step = |i: usize| {
            let (share, depth) = of((i as f64 + 0.5) / 255.0);
            // The logarithm of fading light is linear in depth, so levels compare without `exp`.
            [share.ln(), 1.0 / depth.um()]
        };
        Self {
            shares: Box::new(std::array::from_fn(|i| level(i).0)),
            depths_um: Box::new(std::array::from_fn(|i| level(i).1.um())),
            steps: Box::new(std::array::from_fn(step)),
        }
    }

    /// Returns the critical doses that a level brings to the layer's top.
    #[inline]
    pub fn share(&self, level: u8) -> f64 {
        self.shares[usize::from(level)]
    }

    /// Returns the depth over which a level's light fades by e, in micrometers.
    #[inline]
    pub fn depth_um(&self, level: u8) -> f64 {
        self.depths_um[usize::from(level)]
    }

    /// Returns the critical doses that a level leaves at a depth below the layer's top.
    #[inline]
    pub fn left(&self, level: u8, depth_um: f64) -> f64 {
        self.share(level) * (-depth_um / self.depth_um(level)).exp()
    }

    /// Returns whether leaving this many critical doses at a depth takes more than the level
    /// half-way above `level`.
    #[inline]
    pub fn is_above(&self, level: usize, depth_um: f64, left: f64) -> bool {
        let [share, fading] = self.steps[level];
        left > 0.0 && share - depth_um * fading <= left.ln()
    }

    /// Returns the level that most nearly leaves this many critical doses at a depth.
    #[inline]
    pub fn level(&self, depth_um: f64, left: f64) -> u8 {
        // Zero has no logarithm, and black leaves nothing.
        if left <= 0.0 {
            return 0;
        }
        let wanted = left.ln();
        // A whiter level never leaves less at any depth, so the steps rise at every depth.
        self.steps.partition_point(|[share, fading]| share - depth_um * fading <= wanted) as u8
    }
}
