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
    steps: LevelSteps,
}

impl DepthLevels {
    /// Creates the levels of a resin. `depth_of` gives the depth that a gray level
    /// from 0 to 1 cures, never less for a whiter one. Depths from `reach` on are
    /// white.
    pub fn new(reach: Length, depth_of: impl Fn(f64) -> Length) -> Self {
        // The nearest level changes half way between two levels.
        let step = |i: usize| depth_of((i as f64 + 0.5) / 255.0).um();
        Self { reach_um: reach.um(), steps: LevelSteps::new((0..255).map(step).collect()) }
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
            self.steps.level(um)
        }
    }

    /// Returns the depth from which on all is white.
    pub fn reach(&self) -> Length {
        Length::from_um(self.reach_um)
    }
}

/// The depths from which on levels are whiter: rising, found in a few steps.
///
/// ```
/// use lamp_stack::LevelSteps;
///
/// let steps = LevelSteps::new(vec![0.0, 10.0, 10.0, 55.0]);
/// assert_eq!([-1.0, 0.0, 9.9, 10.0, 54.9, 55.0, 1e9].map(|um| steps.level(um)), [0, 1, 1, 3, 3, 4, 4]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LevelSteps {
    /// Infinite from `count` on.
    steps_um: Box<[f64; 256]>,
    count: u8,
    /// The number of steps below each bin of depths.
    below: Vec<u8>,
    bins_per_um: f64,
}

impl LevelSteps {
    /// Bins of depths, eight for each step.
    const BINS: usize = 2048;

    /// Creates the steps: from the depth at `i` on, in micrometers, the level is above `i`.
    ///
    /// # Panics
    /// Panics if there are more than 255.
    pub fn new(steps_um: Vec<f64>) -> Self {
        assert!(steps_um.len() <= 255, "a level has eight bits");
        let last_um = steps_um.last().copied().unwrap_or(0.0);
        let finite = last_um.is_finite() && last_um > 0.0;
        // Without a depth above zero all depths share a bin, and the steps alone decide.
        let bins_per_um = if finite { Self::BINS as f64 / last_um } else { 0.0 };
        // With 256 entries, an index of eight bits needs no check.
        let mut padded = Box::new([f64::INFINITY; 256]);
        padded[..steps_um.len()].copy_from_slice(&steps_um);
        let (count, below) = (steps_um.len() as u8, vec![0; Self::BINS + 1]);
        let mut steps = Self { steps_um: padded, count, below, bins_per_um };
        for step_um in steps_um {
            // Depths of this bin may lie below the step.
            let bin = steps.bin(step_um);
            steps.below[bin + 1..].iter_mut().for_each(|below| *below += 1);
        }
        steps
    }

    /// Returns the level at a depth: the number of steps at or below it.
    #[inline]
    pub fn level(&self, depth_um: f64) -> u8 {
        let level = self.below[self.bin(depth_um)];
        // Most bins have one step or none, and which it is cannot be predicted: no branch for that.
        let is_past =
            |level: u8| (level < self.count) & (self.steps_um[usize::from(level)] <= depth_um);
        let mut level = level.wrapping_add(u8::from(is_past(level)));
        while is_past(level) {
            level += 1;
        }
        level
    }

    /// Returns a depth's bin: never a lower one for a greater depth.
    #[inline]
    fn bin(&self, depth_um: f64) -> usize {
        // All numbers from here to twice as many are whole, so that adding it rounds. Casts take
        // longer.
        const WHOLE: f64 = (1u64 << 52) as f64;
        const LAST: f64 = LevelSteps::BINS as f64;
        let bin = depth_um * self.bins_per_um;
        // Comparisons with NaN are false, so NaN falls into the first bin.
        let bin = if bin > 0.0 { bin } else { 0.0 };
        let bin = if bin < LAST { bin } else { LAST };
        (bin + WHOLE).to_bits() as u16 as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_change_no_level() {
        let mut random = 1u64;
        let mut next = move || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (random >> 33) as f64 / (1u64 << 31) as f64
        };
        for round in 0..40 {
            let power = [1.0, 3.0, 0.2][round % 3];
            let mut steps: Vec<f64> = (0..255).map(|_| 90.0 * next().powf(power) - 5.0).collect();
            steps.sort_by(f64::total_cmp);
            if round % 4 == 0 {
                steps[200..].fill(f64::INFINITY);
            }
            let table = LevelSteps::new(steps.clone());
            let random = (0..2000).map(|_| 120.0 * next() - 10.0);
            let near = steps.iter().flat_map(|&step| [step.next_down(), step, step.next_up()]);
            for depth in random.collect::<Vec<_>>().into_iter().chain(near) {
                let level = steps.partition_point(|&step| step <= depth);
                assert_eq!(usize::from(table.level(depth)), level, "{depth}");
            }
        }
    }
}
