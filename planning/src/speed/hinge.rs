//! The error of some times, its slopes, and the bound that they give for all other times.
//!
//! The error is Σ_in (1 + m - e)₊ + Σ_out (e - 1 + m)₊ over the voxels of the part and the voxels
//! around it, with their doses e and a margin m. A smoothed (x)₊ has slopes from 0 to 1. With any
//! such slopes y, Σ y x is at most the error, whatever the times: they are multipliers.

use rayon::prelude::*;

use super::columns::{ColumnBlock, LANES, PixelColumns};
use crate::light::LayerLight;
use crate::wide::wide;

/// The error of times, and its slopes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Priced {
    /// The smoothed error.
    pub(crate) error: f64,
    /// The slope by each layer's time.
    pub(crate) slopes: Vec<f64>,
    /// Σ y x: the errors at the smoothed one's slopes.
    pub(crate) priced: f64,
}

impl Priced {
    /// Returns a bound that no times have an error below, given the least value of a sum of times,
    /// each multiplied by its slope.
    pub(crate) fn bound(&self, times: &[f64], least: f64) -> f64 {
        // Errors are linear in times where multipliers are fixed: Σ y x at other times is its value
        // here plus slopes times the difference. The least of that over all possible times is a
        // bound, and no error is negative.
        let here: f64 = self.slopes.iter().zip(times).map(|(slope, time)| slope * time).sum();
        (self.priced - here + least).max(0.0)
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.error += other.error;
        self.priced += other.priced;
        for (sum, slope) in self.slopes.iter_mut().zip(&other.slopes) {
            *sum += slope;
        }
    }

    pub(crate) fn none(layers: usize) -> Self {
        Self { error: 0.0, slopes: vec![0.0; layers], priced: 0.0 }
    }
}

/// The error of a part's voxels as a function of times.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hinge<'a> {
    pub(crate) layers: &'a [LayerLight],
    /// The distance that doses must keep from 1.
    pub(crate) margin: f64,
    /// The error is exact at this distance from the kink and farther; zero leaves the kink.
    pub(crate) smoothing: f64,
}

impl Hinge<'_> {
    /// Returns the error of all columns and its slopes.
    pub(crate) fn of(&self, columns: &PixelColumns, times: &[f64]) -> Priced {
        let price = |room: &mut Vec<f32>, block: &ColumnBlock| self.of_block(block, times, room);
        let blocks: Vec<_> = columns.blocks().par_iter().map_init(Vec::new, price).collect();
        // Blocks are added in order, so the sum is the same on any number of threads.
        let mut all = Priced::none(columns.layers());
        for block in &blocks {
            all.add(block);
        }
        all
    }

    fn of_block(&self, block: &ColumnBlock, times: &[f64], room: &mut Vec<f32>) -> Priced {
        wide(
            #[inline(always)]
            || {
                expose(block, self.layers, times, room);
                self.price(block, room)
            },
        )
    }

    /// Runs from the last layer to the first with the cost of an additional dose.
    #[inline(always)]
    fn price(&self, block: &ColumnBlock, doses: &[f32]) -> Priced {
        let mut priced = Priced::none(self.layers.len());
        let mut cost = [0.0_f32; LANES];
        for (layer, light_of) in self.layers.iter().enumerate().rev() {
            let of_layer = layer * LANES..(layer + 1) * LANES;
            let (light, doses) = (&block.light[of_layer.clone()], &doses[of_layer]);
            let below = self.layers.get(layer + 1).map_or(0.0, |below| below.passed as f32);
            let [mut error, mut linear, mut slope] = [[0.0_f32; 16]; 3];
            for lane in 0..LANES {
                // Sixteen sums side by side are two wide registers. A single sum would wait for
                // itself, and differ with the width of the registers.
                let sum = lane % 16;
                let weight = block.weights[lane];
                let sign = 1.0_f32.copysign(light[lane]);
                // Wanted voxels err by 1 + m - e, others by e - 1 + m: one formula with the sign of
                // their role (004 eq. 3.1 to 3.3 count the same voxels without a margin).
                let x = self.margin as f32 + sign * (doses[lane] - 1.0);
                let y = self.slope(x) * weight;
                error[sum] += self.smoothed(x) * weight;
                linear[sum] += x * y;
                // The transpose of the recursion in `expose`: a second of this layer's light also
                // reaches all layers below it, reduced by the absorption between (004 eq. 2.5).
                cost[lane] = cost[lane] * below + sign * y;
                slope[sum] += cost[lane] * light[lane].abs();
            }
            let total = |sums: [f32; 16]| sums.into_iter().map(f64::from).sum::<f64>();
            priced.error += total(error);
            priced.priced += total(linear);
            priced.slopes[layer] = total(slope) * light_of.own;
        }
        priced
    }

    #[inline(always)]
    fn slope(&self, x: f32) -> f32 {
        if self.smoothing == 0.0 {
            return f32::from(u8::from(x > 0.0));
        }
        // The slope rises from 0 to 1 over twice the smoothing.
        let smoothing = self.smoothing as f32;
        ((x + smoothing) / (2.0 * smoothing)).clamp(0.0, 1.0)
    }

    #[inline(always)]
    fn smoothed(&self, x: f32) -> f32 {
        // Nesterov's smoothing (2005): the largest of y x + s y (1 - y) over 0 ≤ y ≤ 1, which the
        // clamped slope attains. It exceeds (x)₊ by s/4 at most, at the kink, and stays convex.
        let slope = self.slope(x);
        slope * x + self.smoothing as f32 * slope * (1.0 - slope)
    }
}

/// Computes the doses of a block's voxels, layer by layer.
#[inline(always)]
pub(crate) fn expose(
    block: &ColumnBlock,
    layers: &[LayerLight],
    times: &[f64],
    doses: &mut Vec<f32>,
) {
    doses.resize(block.light.len(), 0.0);
    let mut above = [0.0_f32; LANES];
    for (layer, (reach, time)) in layers.iter().zip(times).enumerate() {
        let (passed, own) = (reach.passed as f32, (reach.own * time) as f32);
        let light = &block.light[layer * LANES..(layer + 1) * LANES];
        let doses = &mut doses[layer * LANES..(layer + 1) * LANES];
        for lane in 0..LANES {
            // 004 eq. 2.5 from layer to layer: the light passed from the layers above, and the
            // layer's own.
            above[lane] = above[lane] * passed + own * light[lane].abs();
            doses[lane] = above[lane];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::speed::columns::ColumnSet;

    fn columns() -> PixelColumns {
        let mut set = ColumnSet::new(5);
        for n in 0..700_u32 {
            let noise = |k: u32| {
                let mix = (n * 5 + k).wrapping_mul(2_654_435_761) >> 8;
                (mix % 2000) as f32 / 1000.0 - 1.0
            };
            set.add(&std::array::from_fn::<f32, 5, _>(|k| noise(k as u32)), f64::from(n % 3 + 1));
        }
        set.finish()
    }

    fn layers() -> Vec<LayerLight> {
        (0..5).map(|k| LayerLight { passed: 0.8, own: 0.5 + 0.1 * f64::from(k) }).collect()
    }

    #[test]
    fn slopes_are_those_of_the_smoothed_error() {
        let (columns, layers) = (columns(), layers());
        let hinge = Hinge { layers: &layers, margin: 0.05, smoothing: 0.1 };
        let times = [1.0, 0.5, 0.7, 0.2, 1.3];
        let here = hinge.of(&columns, &times);
        for layer in 0..5 {
            let error = |step: f64| {
                let mut times = times;
                times[layer] += step;
                hinge.of(&columns, &times).error
            };
            let slope = (error(0.01) - error(-0.01)) / 0.02;
            assert!((here.slopes[layer] / slope - 1.0).abs() < 0.02, "{layer}");
        }
    }

    #[test]
    fn slopes_bound_the_error_of_all_times() {
        let (columns, layers) = (columns(), layers());
        let exact = Hinge { layers: &layers, margin: 0.05, smoothing: 0.0 };
        for (first, smoothing) in [(0.3, 0.0), (1.0, 0.2), (3.0, 1.0)] {
            let hinge = Hinge { smoothing, ..exact };
            let times = [first; 5];
            let priced = hinge.of(&columns, &times);
            for other in 0..200_u32 {
                let other: [f64; 5] =
                    std::array::from_fn(|k| f64::from((other * 7 + k as u32 * 13) % 31) / 8.0);
                let there = priced.slopes.iter().zip(&other).map(|(g, t)| g * t).sum();
                let bound = priced.bound(&times, there);
                assert!(bound <= exact.of(&columns, &other).error * (1.0 + 1e-5));
            }
        }
    }
}
