//! Counts the results of doses.

use crate::solver::{Role, Terms};
use crate::tiled::PixelRectangle;
use crate::voxels::outcome::{DoseHistogram, VoxelCounts, VoxelTally};

/// The share by which light may vary.
const LIGHT_OFF: f32 = 0.05;

/// A voxel, or many equal ones.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Voxel {
    pub(crate) wanted: bool,
    pub(crate) target: bool,
    pub(crate) role: Role,
}

impl VoxelTally {
    /// Adds voxels of a dose.
    pub(crate) fn add(&mut self, voxel: Voxel, dose: f32, count: u64, terms: &Terms<f32>) {
        let cases = [
            (&mut self.counts, 1.0),
            (&mut self.dimmer, 1.0 - LIGHT_OFF),
            (&mut self.brighter, 1.0 + LIGHT_OFF),
        ];
        // Every dose is linear in the light: a lamp that is a share brighter or dimmer needs no
        // doses of its own.
        for (counts, light) in cases {
            counts.add(voxel, dose * light >= 1.0, count);
        }
        self.cost += terms.cost(voxel.role, dose) * count as f64;
        let step = (dose * DoseHistogram::PER_CRITICAL_DOSE as f32) as usize;
        let step = step.min(DoseHistogram::STEPS - 1);
        if voxel.wanted {
            self.doses.wanted[step] += count;
        // The resin that no light reaches has no end.
        } else if dose > 0.0 {
            self.doses.other[step] += count;
        }
    }
}

impl VoxelCounts {
    fn add(&mut self, voxel: Voxel, cured: bool, count: u64) {
        match (voxel.wanted, cured) {
            (false, true) => self.overcured += count,
            (true, false) => {
                self.undercured += count;
                self.lost += if voxel.target { count } else { 0 };
            }
            _ => {}
        }
    }
}

/// The values of a tile's voxels, row by row in lines of a stride.
pub(crate) struct TileValues<'a> {
    pub(crate) rect: &'a PixelRectangle,
    pub(crate) stride: usize,
    pub(crate) wanted: &'a [u8],
    pub(crate) targets: &'a [u8],
    pub(crate) roles: &'a [Role],
}

impl TileValues<'_> {
    /// Returns the results of doses.
    pub(crate) fn tally(&self, doses: &[f32], terms: &Terms<f32>) -> VoxelTally {
        let mut tally = VoxelTally::default();
        for row in 0..self.rect.height() {
            let places = row * self.stride..row * self.stride + self.rect.width();
            for (place, &dose) in places.clone().zip(&doses[places]) {
                let voxel = Voxel {
                    wanted: self.wanted[place] != 0,
                    target: self.targets[place] != 0,
                    role: self.roles[place],
                };
                tally.add(voxel, dose, 1, terms);
            }
        }
        tally
    }
}
