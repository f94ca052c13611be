//! Counts the voxels that are cured where all doses are larger by each of many factors.
//!
//! More light multiplies the dose of every voxel, so one pass over all columns shows the wrong voxels
//! at any amount of light.

use rayon::prelude::*;

use super::columns::{ColumnBlock, LANES, PixelColumns};
use super::hinge::expose;
use crate::light::LayerLight;
use crate::wide::wide;

/// Factors of all doses: their logarithms are evenly spaced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DoseGrid {
    /// The logarithm in the middle.
    pub(crate) middle: f64,
    /// The distance of logarithms.
    pub(crate) step: f64,
    /// The number of factors on each side of the middle.
    pub(crate) half: usize,
}

impl DoseGrid {
    /// Returns the number of factors.
    pub(crate) fn count(&self) -> usize {
        2 * self.half + 1
    }

    /// Returns the logarithm of a factor.
    pub(crate) fn log(&self, number: usize) -> f64 {
        self.middle + (number as f64 - self.half as f64) * self.step
    }

    /// Returns the first factor with which a dose is the critical one or more, or their count if
    /// no factor is large enough.
    fn first_cured(&self, dose: f64) -> usize {
        let first = self.half as f64 - (dose.ln() + self.middle) / self.step;
        first.ceil().clamp(0.0, self.count() as f64) as usize
    }
}

/// The first factor that cures a voxel, by the leading bits of its dose: a logarithm of each dose would
/// take longer than all the rest.
struct FirstCured {
    least_bits: u32,
    shift: u32,
    first: Vec<u16>,
}

impl FirstCured {
    fn new(grid: &DoseGrid) -> Self {
        let ends = [grid.count() - 1, 0].map(|number| ((-grid.log(number)).exp() as f32).to_bits());
        // A fourth of a step is exact enough: bits of a float's fraction are steps of its octave.
        let bits = (4.0 / grid.step).log2().ceil().clamp(4.0, 20.0) as u32;
        let shift = 23 - bits;
        let least_bits = (ends[0] >> shift) << shift;
        let dose = |number: u32| {
            f64::from(f32::from_bits(least_bits + (number << shift) + (1 << shift) / 2))
        };
        let count = ((ends[1] - least_bits) >> shift) + 1;
        let mut first: Vec<_> =
            (0..count).map(|number| grid.first_cured(dose(number)) as u16).collect();
        first.push(0);
        Self { least_bits, shift, first }
    }

    #[inline(always)]
    fn of(&self, dose: f32, never: u16) -> u16 {
        // Doses are not negative, and their bits rise with them.
        match dose.to_bits().checked_sub(self.least_bits) {
            None => never,
            Some(above) => self.first[((above >> self.shift) as usize).min(self.first.len() - 1)],
        }
    }
}

/// The wrong voxels of rows at all factors of a [`DoseGrid`]: cured outside the part, and of the part
/// but not cured.
pub(crate) struct DoseCurves {
    count: usize,
    wrong: [Vec<u64>; 2],
}

impl DoseCurves {
    /// Counts the voxels of all columns, by layer or all together in one row.
    pub(crate) fn of(
        columns: &PixelColumns,
        layers: &[LayerLight],
        times: &[f64],
        grid: &DoseGrid,
        by_layer: bool,
    ) -> Self {
        let (first, count) = (FirstCured::new(grid), grid.count());
        let rows = if by_layer { layers.len() } else { 1 };
        let blocks = columns.blocks();
        let share = blocks.len().div_ceil(rayon::current_num_threads()).max(1);
        let of_share = |blocks: &[ColumnBlock]| {
            // The last factor of a row stands for voxels that none cures.
            let mut counts = [(); 2].map(|()| vec![0_u64; rows * (count + 1)]);
            let mut doses = Vec::new();
            for block in blocks {
                wide(
                    #[inline(always)]
                    || expose(block, layers, times, &mut doses),
                );
                for layer in 0..layers.len() {
                    let row = if by_layer { layer * (count + 1) } else { 0 };
                    for lane in 0..LANES {
                        let place = layer * LANES + lane;
                        let at = row + usize::from(first.of(doses[place], count as u16));
                        let is_wanted = block.light[place].is_sign_negative();
                        counts[usize::from(is_wanted)][at] += block.weights[lane] as u64;
                    }
                }
            }
            counts
        };
        let shares: Vec<_> = blocks.par_chunks(share).map(of_share).collect();
        let mut wrong = [(); 2].map(|()| vec![0_u64; rows * count]);
        for row in 0..rows {
            let from = row * (count + 1);
            for (role, wrong) in wrong.iter_mut().enumerate() {
                let total =
                    |at: usize| shares.iter().map(|share| share[role][from + at]).sum::<u64>();
                let mut cured = 0;
                let wrong = &mut wrong[row * count..(row + 1) * count];
                for (at, wrong) in wrong.iter_mut().enumerate() {
                    cured += total(at);
                    *wrong = cured;
                }
                if role == 1 {
                    let all = cured + total(count);
                    wrong.iter_mut().for_each(|wrong| *wrong = all - *wrong);
                }
            }
        }
        Self { count, wrong }
    }

    /// Returns the voxels of a row that are cured outside the part, and voxels of the part that are not
    /// cured, at each factor.
    pub(crate) fn row(&self, row: usize) -> [&[u64]; 2] {
        [0, 1].map(|role| &self.wrong[role][row * self.count..(row + 1) * self.count])
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::cavity_staircase;

    use super::*;
    use crate::speed::Simulation;
    use crate::speed::testing::{part, pegda};

    #[test]
    fn a_curve_has_the_counts_of_times_that_are_longer_by_each_factor() {
        let part = part(&cavity_staircase(1));
        let simulation = Simulation::new(&part, &pegda(50.0), 1 << 30).unwrap();
        let times = simulation.times_for(1.5);
        for grid in [
            DoseGrid { middle: 0.0, step: 0.01, half: 150 },
            DoseGrid { middle: -0.3, step: 0.001, half: 60 },
        ] {
            let curves = simulation.dose_curves(&times, &grid, true);
            let all = simulation.dose_curves(&times, &grid, false);
            for number in [0, 7, grid.half, grid.count() - 1] {
                // Doses are known to a fourth of a step.
                let scaled = |steps: f64| {
                    let factor = (grid.log(number) + steps * grid.step).exp();
                    let times: Vec<_> = times.iter().map(|time| factor * time).collect();
                    let [tally] = simulation.tally([&times]);
                    tally.layers
                };
                let (less, more) = (scaled(-0.3), scaled(0.3));
                let mut sums = [0; 2];
                for (layer, (less, more)) in less.iter().zip(&more).enumerate() {
                    let [over, under] = curves.row(layer).map(|row| row[number]);
                    assert!((less.over..=more.over).contains(&over), "{layer} {number}");
                    assert!((more.under..=less.under).contains(&under), "{layer} {number}");
                    sums = [sums[0] + over, sums[1] + under];
                }
                assert_eq!(sums, all.row(0).map(|row| row[number]));
            }
        }
    }
}
