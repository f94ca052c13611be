//! Counts the voxels that times cure, and the voxels that they should cure.

use rayon::prelude::*;

use super::columns::{ColumnBlock, LANES, PixelColumns};
use super::hinge::expose;
use crate::light::LayerLight;
use crate::wide::wide;

/// The light of each count, as a share of the model's light: counts are made at all of these.
pub const LIGHT_SHARES: [f64; 3] = [1.0, 0.95, 1.05];
/// The number of bins of a dose histogram.
pub const DOSE_BINS: usize = 40;
/// The dose where a histogram's last bin begins, in units of the critical dose. Each other bin is
/// 1/39 of it wide.
const LAST_DOSE: f32 = 3.9;

/// The wrong voxels of a layer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wrong {
    /// Cured voxels outside the part.
    pub over: u64,
    /// Voxels of the part that are not cured.
    pub under: u64,
}

/// The effect of times on a part's voxels.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally {
    /// The wrong voxels of each layer, the one nearest to the light first.
    pub layers: Vec<Wrong>,
    /// The voxels of the part in each layer.
    pub wanted: Vec<u64>,
    /// All wrong voxels at each of [`LIGHT_SHARES`].
    pub at_light: [Wrong; 3],
    /// Voxels by their dose: the voxels of the part, and the other voxels that light reaches. Bins
    /// are 0.1 critical doses wide; the last one has all higher doses.
    pub doses: [[u64; DOSE_BINS]; 2],
}

impl Wrong {
    /// Returns both together.
    pub fn sum(self) -> u64 {
        self.over + self.under
    }

    fn add(&mut self, other: Self) {
        self.over += other.over;
        self.under += other.under;
    }
}

impl Tally {
    /// Returns whether no voxel of the part is cured.
    pub fn cures_nothing(&self) -> bool {
        self.wrong().under == self.wanted.iter().sum::<u64>()
    }

    pub(crate) fn none(layers: usize) -> Self {
        Self {
            layers: vec![Wrong::default(); layers],
            wanted: vec![0; layers],
            at_light: [Wrong::default(); 3],
            doses: [[0; DOSE_BINS]; 2],
        }
    }

    /// Returns all wrong voxels.
    pub fn wrong(&self) -> Wrong {
        self.at_light[0]
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.layers.iter_mut().zip(&other.layers).for_each(|(sum, layer)| sum.add(*layer));
        self.wanted.iter_mut().zip(&other.wanted).for_each(|(sum, count)| *sum += count);
        self.at_light.iter_mut().zip(other.at_light).for_each(|(sum, share)| sum.add(share));
        let doses = self.doses.as_flattened_mut().iter_mut();
        doses.zip(other.doses.as_flattened()).for_each(|(sum, count)| *sum += count);
    }

    /// Counts the voxels of all columns.
    pub(crate) fn of(columns: &PixelColumns, layers: &[LayerLight], times: &[f64]) -> Self {
        let count = |room: &mut Vec<f32>, block: &ColumnBlock| {
            wide(
                #[inline(always)]
                || {
                    expose(block, layers, times, room);
                    Self::of_block(block, layers, room)
                },
            )
        };
        let blocks: Vec<_> = columns.blocks().par_iter().map_init(Vec::new, count).collect();
        let mut all = Self::none(columns.layers());
        // Counts are whole numbers: any order gives the same result.
        blocks.iter().for_each(|block| all.add(block));
        all
    }

    #[inline(always)]
    fn of_block(block: &ColumnBlock, layers: &[LayerLight], doses: &[f32]) -> Self {
        let mut tally = Self::none(layers.len());
        for layer in 0..layers.len() {
            let mut wrong = [Wrong::default(); 3];
            for lane in 0..LANES {
                let (place, count) = (layer * LANES + lane, block.weights[lane] as u64);
                // The sign of a column's light is the voxel's role, even for zero light.
                let (dose, wanted) = (doses[place], block.light[place].is_sign_negative());
                for (wrong, share) in wrong.iter_mut().zip(LIGHT_SHARES) {
                    // 004 eq. 2.15: at the critical dose resin begins to cure.
                    let cured = dose * share as f32 >= 1.0;
                    wrong.over += count * u64::from(cured && !wanted);
                    wrong.under += count * u64::from(wanted && !cured);
                }
                tally.wanted[layer] += count * u64::from(wanted);
                // Around the part, there is no end of voxels that no light reaches: they are not
                // counted.
                if dose > 0.0 {
                    let bin = (dose.min(LAST_DOSE) * 10.0) as usize;
                    tally.doses[usize::from(!wanted)][bin] += count;
                }
            }
            tally.layers[layer] = wrong[0];
            tally.at_light.iter_mut().zip(wrong).for_each(|(sum, wrong)| sum.add(wrong));
        }
        tally
    }
}

/// The wrong voxels of a layer as a smooth function of its dose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct GradualWrong {
    /// Cured voxels outside the part, and voxels of the part that are not cured.
    pub(crate) counts: [f64; 2],
    /// Their slopes by the logarithm of the layer's dose.
    pub(crate) slopes: [f64; 2],
}

/// Counts the voxels of all columns, where a voxel's cured share rises straight from 0 to 1 over
/// this range around the critical dose.
pub(crate) fn gradual_wrong(
    columns: &PixelColumns,
    layers: &[LayerLight],
    times: &[f64],
    half_range: f64,
) -> Vec<GradualWrong> {
    let count = |room: &mut Vec<f32>, block: &ColumnBlock| {
        wide(
            #[inline(always)]
            || {
                expose(block, layers, times, room);
                gradual_of_block(block, layers, room, half_range as f32)
            },
        )
    };
    let blocks: Vec<_> = columns.blocks().par_iter().map_init(Vec::new, count).collect();
    let mut all = vec![GradualWrong::default(); columns.layers()];
    // Blocks are added in order, so the sum is the same on any number of threads.
    for block in &blocks {
        for (sum, of_layer) in all.iter_mut().zip(block) {
            for which in 0..2 {
                sum.counts[which] += of_layer.counts[which];
                sum.slopes[which] += of_layer.slopes[which];
            }
        }
    }
    all
}

#[inline(always)]
fn gradual_of_block(
    block: &ColumnBlock,
    layers: &[LayerLight],
    doses: &[f32],
    half_range: f32,
) -> Vec<GradualWrong> {
    let steepness = (2.0 * half_range).recip();
    let mut all = Vec::with_capacity(layers.len());
    for layer in 0..layers.len() {
        let mut sums = [[0.0_f32; 16]; 4];
        for lane in 0..LANES {
            let (sum, place) = (lane % 16, layer * LANES + lane);
            let dose = doses[place];
            let cured = (0.5 + (dose - 1.0) * steepness).clamp(0.0, 1.0);
            let is_between = f32::from(u8::from(cured > 0.0 && cured < 1.0));
            let slope = is_between * steepness * dose * block.weights[lane];
            let is_wanted = f32::from(u8::from(block.light[place].is_sign_negative()));
            sums[0][sum] += block.weights[lane] * (1.0 - is_wanted) * cured;
            sums[1][sum] += block.weights[lane] * is_wanted * (1.0 - cured);
            sums[2][sum] += (1.0 - is_wanted) * slope;
            sums[3][sum] -= is_wanted * slope;
        }
        let total = |sums: [f32; 16]| sums.into_iter().map(f64::from).sum::<f64>();
        let [over, under, over_slope, under_slope] = sums.map(total);
        all.push(GradualWrong { counts: [over, under], slopes: [over_slope, under_slope] });
    }
    all
}
