//! Measurements made up for tests.

use lamp_stack::Length;

use super::{DepthPoint, FitError};
use crate::resin::{CureModel, Dose, GrayLevel};

/// Random numbers, the same for the same seed.
pub(super) struct Noise(u64);

impl Noise {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Above 0, up to 1 (splitmix64).
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11).wrapping_add(1) as f64 / (1_u64 << 53) as f64
    }

    /// Of mean 0 and standard deviation 1 (Box and Muller).
    pub(super) fn normal(&mut self) -> f64 {
        let (radius, angle) = ((-2.0 * self.uniform().ln()).sqrt(), self.uniform());
        radius * (std::f64::consts::TAU * angle).cos()
    }
}

/// The depths of white that a model says, each with an error in um.
pub(super) fn depth_points(
    model: &impl CureModel,
    doses: &[f64],
    mut error: impl FnMut(f64) -> f64,
) -> Vec<DepthPoint> {
    let point = |&mj: &f64| {
        let dose = Dose::from_mj_per_cm2(mj);
        let depth = Length::from_um(model.depth(dose).um() + error(mj));
        DepthPoint { gray: GrayLevel::WHITE, dose, depth }
    };
    doses.iter().map(point).collect()
}

/// The share of fits for which each of `checks` holds.
pub(super) fn share_held<F, const N: usize>(
    fits: impl Iterator<Item = Result<F, FitError>>,
    checks: impl Fn(&F) -> [bool; N],
) -> [f64; N] {
    let (mut held, mut all) = ([0.0; N], 0.0);
    for fit in fits {
        all += 1.0;
        for (count, holds) in held.iter_mut().zip(checks(&fit.expect("a fit"))) {
            *count += f64::from(u8::from(holds));
        }
    }
    held.map(|count| count / all)
}
