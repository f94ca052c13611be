//! The result of a plan, counted by layer.

use std::ops::AddAssign;

/// Voxels of a layer, or of all, that are cured wrongly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VoxelCounts {
    /// Voxels that are cured but not wanted.
    pub overcured: u64,
    /// Voxels that are wanted but not cured.
    pub undercured: u64,
    /// Targets that are not cured. A target is a wanted voxel that white light cures.
    pub lost: u64,
}

impl AddAssign for VoxelCounts {
    fn add_assign(&mut self, other: Self) {
        self.overcured += other.overcured;
        self.undercured += other.undercured;
        self.lost += other.lost;
    }
}

/// The doses of voxels, counted in steps of a twentieth of the critical dose.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DoseHistogram {
    /// Wanted voxels, by dose.
    pub wanted: [u64; DoseHistogram::STEPS],
    /// Other voxels that light reaches, by dose.
    pub other: [u64; DoseHistogram::STEPS],
}

impl DoseHistogram {
    /// The number of steps. The last one also has all higher doses.
    pub const STEPS: usize = 80;
    /// The number of steps in a critical dose.
    pub const PER_CRITICAL_DOSE: usize = 20;
}

impl Default for DoseHistogram {
    fn default() -> Self {
        Self { wanted: [0; Self::STEPS], other: [0; Self::STEPS] }
    }
}

impl AddAssign<&Self> for DoseHistogram {
    fn add_assign(&mut self, other: &Self) {
        let add = |sums: &mut [u64], more: &[u64]| {
            sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        };
        add(&mut self.wanted, &other.wanted);
        add(&mut self.other, &other.other);
    }
}

/// The result of the doses of a layer, or of all layers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VoxelTally {
    /// Voxels cured wrongly.
    pub counts: VoxelCounts,
    /// The same with 5 % less light.
    pub dimmer: VoxelCounts,
    /// The same with 5 % more light.
    pub brighter: VoxelCounts,
    /// The quantity that the plan minimizes.
    pub cost: f64,
    /// The doses.
    pub doses: DoseHistogram,
}

impl AddAssign<&Self> for VoxelTally {
    fn add_assign(&mut self, other: &Self) {
        self.counts += other.counts;
        self.dimmer += other.dimmer;
        self.brighter += other.brighter;
        self.cost += other.cost;
        self.doses += &other.doses;
    }
}

/// The result of a plan in a layer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LayerOutcome {
    /// The layer's index, 0 at the bottom.
    pub index: u32,
    /// Wanted voxels.
    pub wanted: u64,
    /// Wanted voxels that white light cures.
    pub targets: u64,
    /// Voxels cured wrongly by white light.
    pub before: VoxelCounts,
    /// Voxels cured wrongly by the plan.
    pub after: VoxelCounts,
}

/// The gap between cost and bound of all blocks of voxels, after some iterations of the search.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GapAt {
    /// Iterations of each block.
    pub iteration: usize,
    /// The sum of the differences between cost and bound of all blocks, as a share of the cost of
    /// white light in them.
    pub gap: f64,
}

/// The result of a plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Every layer, bottom first.
    pub layers: Vec<LayerOutcome>,
    /// The result of white light: its cost is `P_0`.
    pub before: VoxelTally,
    /// The result of the plan, in gray levels as they are written: its cost is `P`.
    pub after: VoxelTally,
    /// The bound `D`: no light of the same sources costs less.
    pub bound: f64,
    /// How the search went.
    pub search: Vec<GapAt>,
    /// The time that all exposures take, in milliseconds.
    pub exposure_ms: f64,
}

impl Outcome {
    /// Returns the largest distance of the plan from the best, as a share of the unplanned error:
    /// `(P - D) / P_0`, or 0 where there is no error.
    pub fn gap(&self) -> f64 {
        if self.before.cost > 0.0 { (self.after.cost - self.bound) / self.before.cost } else { 0.0 }
    }

    /// Returns whether the plan cures no wanted voxel, though some are wanted.
    pub fn cures_nothing(&self) -> bool {
        let wanted: u64 = self.layers.iter().map(|layer| layer.wanted).sum();
        wanted > 0 && self.after.counts.undercured == wanted
    }

    /// Returns the wanted voxels that white light does not cure.
    pub fn uncurable(&self) -> u64 {
        self.layers.iter().map(|layer| layer.wanted - layer.targets).sum()
    }
}
