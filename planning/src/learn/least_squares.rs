//! Solves for the model's step: least |(e - G dt) / noise|² + ρ |dt / t|².

use super::law::ModelLaw;
use super::response::Response;
use crate::numeric::{DescentEnd, descend, dot, solve_by_conjugate_gradients};

/// The weights of a step, layer by layer.
pub(crate) struct Weights {
    /// 1 / noise².
    errors: Vec<f64>,
    /// ρ / t².
    changes: Vec<f64>,
}

impl ModelLaw {
    /// Returns the standard deviation of the errors of each layer, in voxels.
    pub(crate) fn noise_of(&self, response: &Response) -> Vec<f64> {
        response.per_log_dose().iter().map(|voxels| (self.noise * voxels).max(1.0)).collect()
    }

    pub(crate) fn weights(&self, times: &[f64], response: &Response) -> Weights {
        Weights {
            errors: self.noise_of(response).iter().map(|noise| noise.powi(-2)).collect(),
            changes: times.iter().map(|time| self.stiffness / (time * time)).collect(),
        }
    }
}

impl Weights {
    /// Returns the matrix of the step's equations times a step: `Gᵀ W G dt + ρ dt / t²`.
    fn apply(&self, response: &Response, changes: &[f64]) -> Vec<f64> {
        // `G` is never written out: it and its transpose are two passes over the layers, but a
        // matrix would have the square of the number of layers.
        let mut cured = response.apply(changes);
        cured.iter_mut().zip(&self.errors).for_each(|(cured, weight)| *cured *= weight);
        let mut sums = response.transposed(&cured);
        let stiff = self.changes.iter().zip(changes);
        sums.iter_mut().zip(stiff).for_each(|(sum, (weight, change))| *sum += weight * change);
        sums
    }

    /// Returns the right side of the step's equations: `Gᵀ W e`.
    fn pull(&self, response: &Response, errors: &[f64]) -> Vec<f64> {
        let weighed: Vec<_> =
            errors.iter().zip(&self.errors).map(|(e, weight)| e * weight).collect();
        response.transposed(&weighed)
    }

    /// Returns the step without bounds, by conjugate gradients.
    pub(crate) fn solve(&self, response: &Response, errors: &[f64]) -> Vec<f64> {
        // In shares of the times, the equations are well scaled.
        let scale: Vec<_> = self.changes.iter().map(|weight| weight.sqrt().recip()).collect();
        let scaled =
            |a: &[f64]| a.iter().zip(&scale).map(|(a, scale)| a * scale).collect::<Vec<_>>();
        let apply = |step: &[f64]| scaled(&self.apply(response, &scaled(step)));
        let pull = scaled(&self.pull(response, errors));
        scaled(&solve_by_conjugate_gradients(apply, pull))
    }
}

/// Returns the step within bounds.
pub(crate) fn bounded_step(
    response: &Response,
    errors: &[f64],
    weights: &Weights,
    bounds: [&[f64]; 2],
) -> Vec<f64> {
    let scale: Vec<_> = weights.changes.iter().map(|weight| weight.sqrt().recip()).collect();
    let times = |a: &[f64]| a.iter().zip(&scale).map(|(a, scale)| a * scale).collect::<Vec<_>>();
    let shares = |a: &[f64]| a.iter().zip(&scale).map(|(a, scale)| a / scale).collect::<Vec<_>>();
    let pull = weights.pull(response, errors);
    let [low, high] = bounds.map(shares);
    // The step without bounds is a good start: most layers stay away from their bounds.
    let mut step = shares(&weights.solve(response, errors));
    let stop = DescentEnd { steps: 500, fall: 1e-12 };
    descend(&mut step, [&low, &high], stop, |step| {
        let changes = times(step);
        let bent = weights.apply(response, &changes);
        // The quadratic whose slopes are the step's equations, without constants.
        let value = 0.5 * dot(&bent, &changes) - dot(&pull, &changes);
        let slopes: Vec<_> = bent.iter().zip(&pull).map(|(bent, pull)| bent - pull).collect();
        (value, times(&slopes))
    });
    times(&step)
}
