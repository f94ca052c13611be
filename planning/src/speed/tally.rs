//! Counts the voxels that times cure, and the voxels that they should cure.

use rayon::prelude::*;

use super::columns::{ColumnBlock, LANES, PixelColumns};
use super::hinge::{LightReach, expose};
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
    pub(crate) fn of(columns: &PixelColumns, layers: &[LightReach], times: &[f64]) -> Self {
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
    fn of_block(block: &ColumnBlock, layers: &[LightReach], doses: &[f32]) -> Self {
        let mut tally = Self::none(layers.len());
        for (layer, reach) in layers.iter().enumerate() {
            let scale = reach.scale as f32;
            let mut wrong = [Wrong::default(); 3];
            for lane in 0..LANES {
                let (place, count) = (layer * LANES + lane, block.weights[lane] as u64);
                // The sign of a column's light is the voxel's role, even for zero light.
                let (dose, wanted) = (doses[place] * scale, block.light[place].is_sign_negative());
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
