//! The times that a platform can keep: bounds on its speed and on the change from layer to layer.

use lamp_stack::Length;
use thiserror::Error;

use super::part::TimedLayer;

/// A speed of the platform, in micrometers per second.
pub type Speed = f64;

/// The limits of the platform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Platform {
    /// The slowest speed: a layer's thickness divided by its time.
    pub slowest: Speed,
    /// The fastest.
    pub fastest: Speed,
    /// The largest change of speed between neighboring layers: 0.2 allows a fifth more than the
    /// slower speed of the two.
    pub max_change: Option<f64>,
}

/// Why no times are possible.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PlatformError {
    /// The bounds have nothing between them, or are not above zero.
    #[error("the speeds must be above zero and rise: {0} to {1} um/s")]
    Speeds(Speed, Speed),
    /// The allowed change of speed is not above zero, or not a number.
    #[error("the change of speed must be above zero: {0}")]
    Change(f64),
    /// A layer's time asks for a speed beyond the platform's.
    #[error(
        "layer {layer} passes at {speed:.3} um/s: the platform's speeds are {slowest} to {fastest} um/s"
    )]
    Time {
        /// The layer's index in its stack.
        layer: u32,
        /// The speed that its time asks for.
        speed: Speed,
        /// The slowest speed of the platform.
        slowest: Speed,
        /// The fastest.
        fastest: Speed,
    },
    /// The times of two layers ask for a larger change of speed than the platform's.
    #[error("from layer {} to layer {}, the speed changes by {:.1} %: {:.1} % are allowed", layers[0], layers[1], 100.0 * change, 100.0 * most)]
    Ratio {
        /// The layers' indices in their stack, the lower one first.
        layers: [u32; 2],
        /// The change, as a share of the slower speed.
        change: f64,
        /// The largest change of the platform.
        most: f64,
    },
}

/// Recorded times are rounded: a time is beyond a limit if it is by this share.
const ROUNDED: f64 = 1e-3;

impl Platform {
    /// Returns the shortest and the longest time of each layer, in seconds.
    ///
    /// # Errors
    /// Returns an error if the platform's numbers are impossible.
    pub fn bounds(&self, layers: &[TimedLayer]) -> Result<[Vec<f64>; 2], PlatformError> {
        let feasible = Feasible::new(self, layers)?;
        Ok([feasible.low, feasible.high])
    }

    /// Checks that the platform can keep some times, in seconds, the layer nearest to the light first.
    ///
    /// # Errors
    /// Returns an error if it cannot, or if its numbers are impossible.
    pub fn check(&self, layers: &[TimedLayer], times: &[f64]) -> Result<(), PlatformError> {
        Feasible::new(self, layers)?;
        let speeds: Vec<_> =
            layers.iter().zip(times).map(|(layer, time)| layer.thickness.um() / time).collect();
        // A print begins with the lowest layer, so that is named first.
        for (layer, &speed) in layers.iter().zip(&speeds).rev() {
            let (slowest, fastest) = (self.slowest, self.fastest);
            if speed < slowest * (1.0 - ROUNDED) || speed > fastest * (1.0 + ROUNDED) {
                return Err(PlatformError::Time { layer: layer.index, speed, slowest, fastest });
            }
        }
        let Some(most) = self.max_change else { return Ok(()) };
        for (two, layers) in speeds.windows(2).zip(layers.windows(2)).rev() {
            let change = (two[0] / two[1]).max(two[1] / two[0]) - 1.0;
            if change > most + ROUNDED {
                let layers = [layers[1].index, layers[0].index];
                return Err(PlatformError::Ratio { layers, change, most });
            }
        }
        Ok(())
    }

    /// Returns times that the platform can keep, near those given, in seconds.
    ///
    /// # Errors
    /// Returns an error if the platform's numbers are impossible.
    pub fn nearest(&self, layers: &[TimedLayer], times: &[f64]) -> Result<Vec<f64>, PlatformError> {
        Ok(Feasible::new(self, layers)?.nearest(times))
    }
}

/// The times that layers may have, in seconds.
#[derive(Clone, Debug)]
pub(crate) struct Feasible {
    pub(crate) low: Vec<f64>,
    pub(crate) high: Vec<f64>,
    um: Vec<f64>,
    /// The largest ratio between the time per micrometer of a layer and of its neighbor.
    ratio: Option<f64>,
}

impl Feasible {
    pub(crate) fn new(platform: &Platform, layers: &[TimedLayer]) -> Result<Self, PlatformError> {
        let Platform { slowest, fastest, max_change } = *platform;
        if !(slowest > 0.0 && slowest <= fastest && fastest.is_finite()) {
            return Err(PlatformError::Speeds(slowest, fastest));
        }
        if let Some(change) = max_change.filter(|change| !(*change > 0.0 && change.is_finite())) {
            return Err(PlatformError::Change(change));
        }
        let um: Vec<_> = layers.iter().map(|layer| Length::um(layer.thickness)).collect();
        let at = |speed: Speed| um.iter().map(|um| um / speed).collect();
        let (low, high) = (at(fastest), at(slowest));
        Ok(Self { low, high, um, ratio: max_change.map(|change| 1.0 + change) })
    }

    /// Returns whether only the bounds limit the times.
    pub(crate) fn is_box(&self) -> bool {
        self.ratio.is_none()
    }

    /// Returns the mean time per micrometer, in seconds.
    pub(crate) fn pace(&self, times: &[f64]) -> f64 {
        times.iter().sum::<f64>() / self.um.iter().sum::<f64>()
    }

    /// Returns possible times near the given ones, and equal to them if these are possible.
    pub(crate) fn nearest(&self, times: &[f64]) -> Vec<f64> {
        let clamped = times.iter().zip(self.low.iter().zip(&self.high));
        let mut times: Vec<_> =
            clamped.map(|(time, (&low, &high))| time.clamp(low, high)).collect();
        let Some(ratio) = self.ratio else { return times };
        // The least slowness that no layer's neighbors forbid is below the clamped one; the largest
        // is above. Any power mean of both keeps the ratios.
        let spread = |up: bool| {
            let mut pace: Vec<_> = times.iter().zip(&self.um).map(|(time, um)| time / um).collect();
            let mut limit = |from: usize, to: usize| {
                pace[to] = if up {
                    pace[to].max(pace[from] / ratio)
                } else {
                    pace[to].min(pace[from] * ratio)
                };
            };
            let count = self.um.len();
            // Two passes are enough: a layer that limits another is above or below it, and limits
            // all layers between on the way.
            (1..count).for_each(|k| limit(k - 1, k));
            (1..count).rev().for_each(|k| limit(k, k - 1));
            pace
        };
        // Their geometric mean breaks no ratio, since both keep it. It equals the times where these
        // are possible: then nothing is lowered and nothing raised.
        let (low, high) = (spread(false), spread(true));
        for (k, time) in times.iter_mut().enumerate() {
            *time = ((low[k] * high[k]).sqrt() * self.um[k]).clamp(self.low[k], self.high[k]);
        }
        times
    }

    /// Returns the amount by which each pair of neighbors breaks the ratio, in seconds per
    /// micrometer: first where the upper layer is too slow.
    pub(crate) fn excess(&self, times: &[f64]) -> Vec<[f64; 2]> {
        let Some(ratio) = self.ratio else { return Vec::new() };
        let pace = |k: usize| times[k] / self.um[k];
        (1..times.len())
            // Both are linear in the times, as an augmented Lagrangian wants; a difference of
            // logarithms would not be.
            .map(|k| [pace(k - 1) - ratio * pace(k), pace(k) - ratio * pace(k - 1)])
            .collect()
    }

    /// Adds the slopes of a sum of excesses, each multiplied by its price.
    pub(crate) fn add_slopes(&self, prices: &[[f64; 2]], slopes: &mut [f64]) {
        let Some(ratio) = self.ratio else { return };
        for (pair, [above, below]) in prices.iter().enumerate() {
            slopes[pair] += (above - ratio * below) / self.um[pair];
            slopes[pair + 1] += (below - ratio * above) / self.um[pair + 1];
        }
    }

    /// Returns the least sum of possible times, each multiplied by its slope.
    ///
    /// The sum is exact: layer by layer, the least sum of the layers so far is a convex function of
    /// the last layer's pace, linear between corners.
    pub(crate) fn least(&self, slopes: &[f64]) -> f64 {
        let Some(ratio) = self.ratio else {
            let each = slopes.iter().zip(self.low.iter().zip(&self.high));
            return each.map(|(slope, (low, high))| (slope * low).min(slope * high)).sum();
        };
        let (low, high) = (self.low[0] / self.um[0], self.high[0] / self.um[0]);
        let mut corners = vec![(low, 0.0), (high, 0.0)];
        for (layer, (slope, um)) in slopes.iter().zip(&self.um).enumerate() {
            if layer > 0 {
                corners = widened(&corners, ratio, [low, high]);
            }
            for (pace, least) in &mut corners {
                // Adding a straight line to a convex function keeps it convex and its corners in
                // place.
                *least += slope * um * *pace;
            }
        }
        corners.iter().map(|corner| corner.1).fold(f64::INFINITY, f64::min)
    }
}

/// Returns the least value of a function within a ratio of each place, from its corners.
fn widened(corners: &[(f64, f64)], ratio: f64, [low, high]: [f64; 2]) -> Vec<(f64, f64)> {
    let best = (0..corners.len()).min_by(|&a, &b| corners[a].1.total_cmp(&corners[b].1));
    let best = best.expect("there are two corners or more");
    // The least within a ratio: left of the bottom, it comes from the farthest place to the right,
    // and right of it, from the farthest to the left. So the two flanks move apart by the ratio,
    // and between them the bottom is level.
    let falling = corners[..=best].iter().map(|&(pace, least)| (pace / ratio, least));
    let rising = corners[best..].iter().map(|&(pace, least)| (pace * ratio, least));
    cut(&falling.chain(rising).collect::<Vec<_>>(), [low, high])
}

/// Returns a function's corners between two places.
fn cut(corners: &[(f64, f64)], [low, high]: [f64; 2]) -> Vec<(f64, f64)> {
    let at = |place: f64| {
        let after = corners.partition_point(|corner| corner.0 < place).clamp(1, corners.len() - 1);
        let ((x0, y0), (x1, y1)) = (corners[after - 1], corners[after]);
        if x1 == x0 { y0.min(y1) } else { y0 + (y1 - y0) * (place - x0) / (x1 - x0) }
    };
    let within = corners.iter().copied().filter(|corner| corner.0 > low && corner.0 < high);
    let ends = |place: f64| std::iter::once((place, at(place)));
    ends(low).chain(within).chain(ends(high)).collect()
}

#[cfg(test)]
mod tests {
    use lamp_stack::Length;

    use super::*;

    fn feasible(count: u32, max_change: Option<f64>) -> Feasible {
        let layer = |index: u32| TimedLayer {
            index,
            z: Length::default(),
            thickness: Length::from_um(50.0 + f64::from(index % 3) * 20.0),
            time: None,
        };
        let platform = Platform { slowest: 20.0, fastest: 400.0, max_change };
        Feasible::new(&platform, &(0..count).map(layer).collect::<Vec<_>>()).unwrap()
    }

    fn noise(seed: u32, n: u32) -> f64 {
        let mix = (seed * 7919 + n * 104_729).wrapping_mul(2_654_435_761);
        f64::from(mix >> 12) / f64::from(1_u32 << 20)
    }

    #[test]
    fn nearest_times_keep_bounds_and_ratios() {
        for seed in 0..50 {
            let feasible = feasible(9, Some(0.2));
            let times: Vec<_> = (0..9).map(|n| 6.0 * noise(seed, n)).collect();
            let near = feasible.nearest(&times);
            assert!(feasible.excess(&near).as_flattened().iter().all(|&excess| excess < 1e-12));
            for (k, time) in near.iter().enumerate() {
                assert!((feasible.low[k]..=feasible.high[k]).contains(time));
            }
            let again = feasible.nearest(&near);
            assert!(near.iter().zip(&again).all(|(a, b)| (a / b - 1.0).abs() < 1e-12));
        }
    }

    /// Compares with all times on a grid of steps of the ratio.
    #[test]
    fn the_least_sum_is_that_of_an_exhaustive_search() {
        for seed in 0..40 {
            let mut feasible = feasible(4, Some(0.5));
            // This grid of paces contains the least of straight pieces.
            for k in 0..4 {
                feasible.low[k] = feasible.um[k];
                feasible.high[k] = feasible.um[k] * 1.5_f64.powi(6);
            }
            let slopes: Vec<_> = (0..4).map(|n| noise(seed, n) - 0.5).collect();
            let mut least = f64::INFINITY;
            for code in 0..7_u32.pow(4) {
                let steps: [i32; 4] =
                    std::array::from_fn(|k| (code / 7_u32.pow(k as u32) % 7) as i32);
                if steps.windows(2).all(|pair| (pair[0] - pair[1]).abs() <= 1) {
                    let time = |k: usize| feasible.um[k] * 1.5_f64.powi(steps[k]);
                    least = least.min((0..4).map(|k| slopes[k] * time(k)).sum());
                }
            }
            let found = feasible.least(&slopes);
            assert!((found - least).abs() < 1e-9 * least.abs(), "{seed} {found} {least}");
        }
        let free = feasible(3, None);
        assert_eq!(free.least(&[1.0, -1.0, 0.0]), free.low[0] - free.high[1]);
    }
}
