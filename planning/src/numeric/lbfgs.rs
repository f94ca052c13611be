//! Finds the least value of a smooth convex function between bounds: L-BFGS, projected.
//!
//! Source: D. P. Bertsekas, *Projected Newton methods for optimization problems with simple
//! constraints*, SIAM J. Control Optim. 20 (1982), with the limited-memory matrix of J. Nocedal,
//! *Updating quasi-Newton matrices with limited storage*, Math. Comp. 35 (1980).

use std::collections::VecDeque;

use super::{add_times, dot};

/// The number of pairs of steps and slope changes that are kept.
const MEMORY: usize = 12;
/// The share of the fall predicted by the slopes that a step must bring.
const ENOUGH: f64 = 1e-4;

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DescentEnd {
    pub(crate) steps: usize,
    /// The relative fall of the value in a step.
    pub(crate) fall: f64,
}

struct CorrectionPair {
    step: Vec<f64>,
    change: Vec<f64>,
    scale: f64,
}

/// Moves `x` toward the least value between the bounds. `function` returns a value and its
/// slopes.
pub(crate) fn descend(
    x: &mut Vec<f64>,
    [low, high]: [&[f64]; 2],
    stop: DescentEnd,
    mut function: impl FnMut(&[f64]) -> (f64, Vec<f64>),
) {
    let clamp = |x: &mut [f64]| {
        for (x, (&low, &high)) in x.iter_mut().zip(low.iter().zip(high)) {
            *x = x.clamp(low, high);
        }
    };
    clamp(x);
    let (mut value, mut slopes) = function(x);
    let mut pairs: VecDeque<CorrectionPair> = VecDeque::new();
    for _ in 0..stop.steps {
        // A bound that the slopes push against stays.
        let is_free = |k: usize| if slopes[k] > 0.0 { x[k] > low[k] } else { x[k] < high[k] };
        let free: Vec<bool> = (0..x.len()).map(is_free).collect();
        let direction = direction(&slopes, &free, &pairs, x);
        let mut length = 1.0;
        let (next, next_value, next_slopes) = loop {
            let mut next: Vec<_> = x.iter().zip(&direction).map(|(x, d)| x + length * d).collect();
            clamp(&mut next);
            let (next_value, next_slopes) = function(&next);
            let promised: f64 = next
                .iter()
                .zip(&*x)
                .zip(&slopes)
                .map(|((next, x), slope)| (next - x) * slope)
                .sum();
            // Armijo's rule along the projected path: the predicted fall is for the way left
            // between the bounds.
            if next_value <= value + ENOUGH * promised.min(0.0) {
                break (next, next_value, next_slopes);
            }
            length *= 0.3;
            if length < 1e-6 {
                if pairs.is_empty() {
                    return;
                }
                // No step: forget the pairs and try along the slopes.
                break (x.clone(), value, slopes.clone());
            }
        };
        let fall = value - next_value;
        let step: Vec<_> = next.iter().zip(&*x).map(|(next, x)| next - x).collect();
        let change: Vec<_> =
            next_slopes.iter().zip(&slopes).map(|(next, now)| next - now).collect();
        let curve = dot(&step, &change);
        if step.iter().all(|&step| step == 0.0) {
            // The kept pairs mislead: begin anew along the slopes.
            pairs.clear();
            continue;
        }
        // Only pairs of positive curvature keep the matrix positive definite; rounding leaves
        // others where the function is straight.
        if curve > 1e-12 * dot(&change, &change).sqrt() * dot(&step, &step).sqrt() {
            if pairs.len() == MEMORY {
                pairs.pop_front();
            }
            pairs.push_back(CorrectionPair { step, change, scale: 1.0 / curve });
        }
        (*x, value, slopes) = (next, next_value, next_slopes);
        if fall <= stop.fall * value.abs() {
            return;
        }
    }
}

/// Returns the direction of the two loops of L-BFGS, among only the free numbers.
fn direction(
    slopes: &[f64],
    free: &[bool],
    pairs: &VecDeque<CorrectionPair>,
    x: &[f64],
) -> Vec<f64> {
    let only_free = |mut numbers: Vec<f64>| {
        numbers.iter_mut().zip(free).filter(|(_, free)| !**free).for_each(|(n, _)| *n = 0.0);
        numbers
    };
    let mut direction = only_free(slopes.iter().map(|slope| -slope).collect());
    let along = |a: &[f64], b: &[f64]| dot(&only_free(a.to_vec()), b);
    let mut shares = Vec::with_capacity(pairs.len());
    for pair in pairs.iter().rev() {
        // The two loops of Nocedal (1980), with products among only the free numbers: Bertsekas's
        // condition that active bounds take no part in the curvature.
        let share = pair.scale * along(&pair.step, &direction);
        add_times(&mut direction, -share, &pair.change);
        shares.push(share);
    }
    direction = only_free(direction);
    // The scale of the last pair, sᵀy / yᵀy (Nocedal and Wright, *Numerical Optimization*, eq.
    // 7.20).
    let first = match pairs.back() {
        Some(pair) => 1.0 / (pair.scale * dot(&pair.change, &pair.change)),
        // A tenth of the largest number is not too large a step from any start.
        None => {
            let most = |numbers: &[f64]| numbers.iter().fold(0.0, |most: f64, n| most.max(n.abs()));
            0.1 * most(x) / most(&direction).max(f64::MIN_POSITIVE)
        }
    };
    direction.iter_mut().for_each(|d| *d *= first);
    for (pair, share) in pairs.iter().zip(shares.iter().rev()) {
        let back = pair.scale * along(&pair.change, &direction);
        add_times(&mut direction, share - back, &pair.step);
    }
    let direction = only_free(direction);
    // Pairs from other sets of free numbers may point uphill. The slopes themselves never do.
    if dot(&direction, slopes) < 0.0 {
        direction
    } else {
        only_free(slopes.iter().map(|slope| -slope * first.max(f64::MIN_POSITIVE)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quadratic of condition 1e4, whose least value is at 1, 2, 3, ...
    fn valley(x: &[f64]) -> (f64, Vec<f64>) {
        let mut value = 0.0;
        let mut slopes = vec![0.0; x.len()];
        for k in 0..x.len() {
            let (away, bend) = (x[k] - (k + 1) as f64, 10_f64.powf(4.0 * k as f64 / 19.0));
            value += 0.5 * bend * away * away;
            slopes[k] = bend * away;
        }
        (value, slopes)
    }

    #[test]
    fn the_bottom_of_a_valley_is_found_within_bounds() {
        let stop = DescentEnd { steps: 400, fall: 0.0 };
        let (low, high) = (vec![0.0; 20], vec![12.5; 20]);
        let mut x = vec![6.0; 20];
        descend(&mut x, [&low, &high], stop, valley);
        for (k, x) in x.iter().enumerate() {
            assert!((x - ((k + 1) as f64).min(12.5)).abs() < 1e-5, "{k} {x}");
        }
    }
}
