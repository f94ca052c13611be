//! Makes up measurements for tests.

use lamp_stack::Length;

use super::{DepthPoint, FitError};
use crate::resin::{CureModel, Dose, GrayLevel};

/// Returns a model's depths of white, each with an error in um.
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

/// Returns the share of fits for which each of `checks` holds.
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
