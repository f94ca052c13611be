//! The estimated work for a part, by its facets, before it is sliced.

use std::ops::Range;
use std::time::Instant;

use lamp_slicing::Slices;
use serde::{Deserialize, Serialize};

use crate::chain::{Stage, StageChain};

/// Layers that are estimated together. Ranges begin at multiples of it, where packed stacks have
/// key layers.
const BLOCK: u32 = lamp_stack::KEY_LAYERS;

/// The estimated cost of a part. It is small, to be kept by the digest of the part and the options.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Survey {
    /// The number of layers.
    pub layers: u32,
    /// The width and height of the sliced images, in pixels.
    pub size: [u32; 2],
    /// Places where rows of all sliced layers change color.
    pub crossings: f64,
    /// Seconds that every range takes before its first layer, as the survey did.
    pub opening_s: f64,
    /// Seconds of one processor of each block of layers.
    block_s: Vec<f64>,
    /// Bytes of memory that a range takes at most.
    pub memory: u64,
    /// Bytes of the packed stack of all layers.
    bytes: u64,
}

/// The cost of a stage: nanoseconds of one processor for a row and for a crossing.
#[derive(Clone, Copy)]
struct StageCost {
    row_ns: f64,
    crossing_ns: f64,
}

/// Slicing, with packing. Fitted, as all weights here, to runs of the samples blade (0.1 and 0.75
/// million facets), torus, tower, stairs and sphere at 600 and 1500 dpi and 100 um, on one thread
/// of a machine with two: within a third of slicing, `fix` and `edit` that took more than 50 ms.
const SLICE: StageCost = StageCost { row_ns: 31.0, crossing_ns: 26.0 };
const FIX: StageCost = StageCost { row_ns: 4.5, crossing_ns: 0.0 };
const COMPENSATE: StageCost = StageCost { row_ns: 0.0, crossing_ns: 118.0 };
/// Masks pass, and dots of gray layers save as much packing as they take.
const DITHER: StageCost = StageCost { row_ns: 0.0, crossing_ns: 0.0 };
const EDIT: StageCost = StageCost { row_ns: 11.0, crossing_ns: 1.0 };
/// Gray pixels along edges are runs, too: 2.3 times the work at 300 dpi, 4.6 times at 1500.
const GRAY: f64 = 4.5;
/// Plans of exposures, for a change of color, under the default gap. Between the samples sphere at
/// 500 dpi and 100 um and blade at 300 dpi and 200 um with pegda-sudan, within a factor of five of
/// each. Near surfaces that lean, a plan of gray levels takes long; upright walls take little.
const PLAN_S: f64 = 1e-4;
/// Bytes of the packed stack of a plan of gray levels: 3.9 on that blade, 10 on that sphere.
const PLANNED_BYTES: f64 = 8.0;
/// Bytes of the search for times beside its columns of pixels.
const SPEED_BYTES: f64 = 128e6;
/// Bytes of a change of color in an image that is kept.
const CHANGE_BYTES: f64 = 8.0;
/// Bytes of memory of a process with its table of crossings, and of a crossing or a row of layers
/// in progress: above the use of one and two threads.
const PROCESS_BYTES: f64 = 64e6;
const CROSSING_BYTES: f64 = 1000.0;
/// Bytes of the packed stack for a crossing: blades at 300 to 2400 dpi have 0.085 to 0.123.
const PACKED_BYTES: f64 = 0.12;

impl StageCost {
    fn of(stage: &Stage) -> Self {
        match stage {
            Stage::Fix(_) => FIX,
            Stage::Compensate(_) => COMPENSATE,
            Stage::Dither(_) => DITHER,
            Stage::Edit(_) => EDIT,
        }
    }

    fn joined(self, other: Self) -> Self {
        Self {
            row_ns: self.row_ns + other.row_ns,
            crossing_ns: self.crossing_ns + other.crossing_ns,
        }
    }
}

impl Survey {
    /// Estimates the work of a chain on slices that are ready to begin. `begun` is the time when
    /// opening the part began.
    pub(crate) fn of(slices: &Slices, chain: &StageChain, begun: Instant) -> Self {
        let crossings = slices.crossings_per_layer();
        let rows = f64::from(slices.grid().height);
        let weight = chain.stages.iter().map(StageCost::of).fold(SLICE, StageCost::joined);
        let gray = if slices.is_gray() { GRAY } else { 1.0 };
        let seconds =
            |crossings: &f64| (weight.row_ns * rows + weight.crossing_ns * gray * crossings) * 1e-9;
        let blocks = crossings.chunks(BLOCK as usize);
        let largest = crossings.iter().copied().fold(0.0, f64::max) + rows;
        let all: f64 = crossings.iter().sum();
        Self {
            layers: crossings.len() as u32,
            size: [slices.grid().width, slices.grid().height],
            crossings: all,
            opening_s: begun.elapsed().as_secs_f64(),
            block_s: blocks.map(|block| block.iter().map(seconds).sum()).collect(),
            memory: (PROCESS_BYTES + CROSSING_BYTES * gray * largest) as u64
                + slices.least_memory(),
            bytes: (PACKED_BYTES * gray * all) as u64,
        }
    }

    /// Cuts the layers into ranges of about equal cost, at most `count`.
    ///
    /// # Panics
    /// Panics if `count` is zero.
    pub fn ranges(&self, count: usize) -> Vec<Range<u32>> {
        assert!(count > 0, "a part has a range at least");
        let all: f64 = self.block_s.iter().sum();
        let (mut ranges, mut start, mut cost) = (Vec::new(), 0, 0.0);
        for (end, block_s) in (1..).zip(&self.block_s) {
            let wanted = all * (ranges.len() + 1) as f64 / count as f64;
            // The last range takes all that is left, whatever the sums rounded to.
            let last = end as usize == self.block_s.len();
            // Half of the next block would be too much.
            let next = self.block_s.get(end as usize).map_or(0.0, |next| next / 2.0);
            cost += block_s;
            if last || (cost + next > wanted && ranges.len() + 1 < count) {
                ranges.push(start * BLOCK..(end * BLOCK).min(self.layers));
                start = end;
            }
        }
        ranges
    }

    /// Returns the seconds of one processor that a range takes.
    pub fn cost_s(&self, range: &Range<u32>) -> f64 {
        self.opening_s + self.seconds(range)
    }

    /// Returns the seconds of one processor that a plan of gray levels takes, and its bytes of memory
    /// if it works in `memory`.
    pub fn voxel_plan(&self, memory: u64) -> (f64, u64) {
        let used = lamp_planning::voxels::most_memory(self.size, self.layers).min(memory);
        (self.opening_s + PLAN_S * self.crossings, PROCESS_BYTES as u64 + used)
    }

    /// Returns the bytes of the packed stack of a plan of gray levels.
    pub fn planned_bytes(&self) -> u64 {
        (PLANNED_BYTES * self.crossings) as u64
    }

    /// Returns the seconds of one processor that a plan of times takes, and its bytes of memory if it
    /// works in `memory`. All images are in memory.
    pub fn speed_plan(&self, memory: u64) -> (f64, u64) {
        let pixels: f64 = self.size.map(f64::from).iter().product();
        let columns = pixels * f64::from(self.layers) * size_of::<f32>() as f64;
        let search = columns.min(memory as f64) + columns.min(SPEED_BYTES);
        let bytes = PROCESS_BYTES + CHANGE_BYTES * self.crossings + search;
        (self.opening_s + PLAN_S * self.crossings, bytes as u64)
    }

    /// Returns the bytes of the packed result of a range.
    pub fn bytes(&self, range: &Range<u32>) -> u64 {
        // A part without layers takes no seconds: its share must be a number, too.
        let share = self.seconds(range) / self.seconds(&(0..self.layers)).max(f64::MIN_POSITIVE);
        (self.bytes as f64 * share) as u64
    }

    /// Returns the seconds of one processor that the layers of a range take.
    fn seconds(&self, range: &Range<u32>) -> f64 {
        let of_block = |(block, seconds): (u32, &f64)| {
            let layers = block * BLOCK..((block + 1) * BLOCK).min(self.layers);
            let (start, end) = (layers.start.max(range.start), layers.end.min(range.end));
            seconds * f64::from(end.saturating_sub(start)) / layers.len() as f64
        };
        (0..).zip(&self.block_s).map(of_block).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn survey(block_s: &[f64], layers: u32) -> Survey {
        let (block_s, size) = (block_s.to_vec(), [0; 2]);
        Survey { layers, size, crossings: 0.0, opening_s: 0.5, block_s, memory: 0, bytes: 1000 }
    }

    #[test]
    fn ranges_cost_about_the_same_and_leave_no_layer_out() {
        let even = survey(&[1.0; 8], 500);
        assert_eq!(even.ranges(4), [0..128, 128..256, 256..384, 384..500]);
        assert_eq!(even.ranges(1), vec![Range { start: 0, end: 500 }]);
        assert_eq!(even.ranges(100).len(), 8);
        let steep = survey(&[6.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0], 64 * 7);
        assert_eq!(steep.ranges(2), [0..64, 64..448]);
        assert_eq!(survey(&[2.0], 1).ranges(8), vec![Range { start: 0, end: 1 }]);
    }

    #[test]
    fn costs_of_ranges_add_up() {
        let survey = survey(&[2.0, 4.0, 1.0], 160);
        let cost = |range: Range<u32>| survey.cost_s(&range) - survey.opening_s;
        assert_eq!((cost(0..160), cost(0..64), cost(32..128)), (7.0, 2.0, 5.0));
        assert_eq!((cost(128..160), survey.bytes(&(0..160))), (1.0, 1000));
    }
}
