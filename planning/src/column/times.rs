//! Times of mirrors, and a bound on their distance from the best (000 section 4.2).

use rayon::prelude::*;

use super::curvature::Normal;
use super::light::GlassLight;
use crate::numeric::{Bounded, SearchPlace};

/// When a search for times ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// The largest gap to the least error, as a share of the error.
    pub gap: f64,
    /// The most steps, whatever the gap is then.
    pub steps: usize,
}

/// The seconds for which mirrors are on.
#[derive(Clone, Debug, PartialEq)]
pub struct MirrorTimes {
    /// The time of each mirror, rows from the first.
    pub seconds: Vec<f64>,
    /// The error that was minimized: half the sum of the squared differences between doses and
    /// wanted doses, in (mJ/cm2)2.
    pub error: f64,
    /// The most by which the least error can be smaller: the Frank-Wolfe gap.
    pub gap: f64,
    /// The number of steps of the search.
    pub steps: usize,
}

impl MirrorTimes {
    /// Returns the gap as a share of the error, or 0 if there is no error.
    pub fn relative_gap(&self) -> f64 {
        if self.gap > 0.0 { self.gap / self.error } else { 0.0 }
    }

    /// Returns the number of mirrors that are on for the longest time.
    pub fn at_most(&self, max_s: f64) -> usize {
        self.seconds.iter().filter(|seconds| **seconds >= max_s).count()
    }
}

/// Returns the Frank-Wolfe gap: no times between zero and `high` have an error smaller by more.
///
/// The error is convex, so it lies above `error + slopes (t - x)` for all times t.
pub(super) fn frank_wolfe_gap(place: &SearchPlace, high: f64) -> f64 {
    let numbers = place.x.par_chunks(1 << 13).zip(place.slopes.par_chunks(1 << 13));
    let of_chunk = |(x, slopes): (&[f64], &[f64])| -> f64 {
        // The largest value of slopes (x - t) over all t between zero and the bound: each t is at
        // the end that its slope prefers.
        x.iter().zip(slopes).map(|(x, slope)| slope * x + high * (-slope).max(0.0)).sum()
    };
    numbers.map(of_chunk).collect::<Vec<_>>().into_iter().sum()
}

/// An error below this share of the error without light counts as zero.
const NOTHING: f64 = 1e-12;

/// Finds the times, at most `max_s` seconds, whose doses are nearest to `wanted` in mJ/cm2: the
/// least half sum of squares (000 eq. 4.4), or its mean over lights shifted by `shifts_um` along
/// each axis. The search also ends once `is_stopped` returns true.
pub fn nearest_times(
    light: &GlassLight,
    wanted: &[f64],
    max_s: f64,
    shifts_um: &[f64],
    stop: Stop,
    is_stopped: &dyn Fn() -> bool,
) -> MirrorTimes {
    let curvature = Normal::mean(light, shifts_um);
    let pull = mean_pull(light, wanted, shifts_um);
    let problem = Bounded { curvature: &curvature, pull: &pull, high: max_s };
    // |H t - E|² / 2 = t HᵀH t / 2 - t HᵀE + E E / 2 (000 eq. 4.4, squared): the search needs only
    // the first two terms.
    let dark = 0.5 * wanted.iter().map(|dose| dose * dose).sum::<f64>();
    let error = |place: &SearchPlace| dark + fall(place, &pull);
    let (mut steps, mut gap) = (0, f64::INFINITY);
    let place = problem.search(vec![0.0; pull.len()], 8, |place, step| {
        (steps, gap) = (step, frank_wolfe_gap(place, max_s));
        let is_near = gap <= stop.gap * error(place).max(NOTHING * dark);
        is_near || step >= stop.steps || is_stopped()
    });
    // Slopes summed over steps carry rounding errors: the proof uses newly computed ones.
    let place = problem.place(place.x);
    let gap = frank_wolfe_gap(&place, max_s);
    MirrorTimes { error: error(&place).max(0.0), gap, steps, seconds: place.x }
}

/// Returns the mean over shifts of H's transpose times the doses.
fn mean_pull(light: &GlassLight, wanted: &[f64], shifts_um: &[f64]) -> Vec<f64> {
    let mut pull = vec![0.0; light.setup().mirrors.iter().product()];
    for &x in shifts_um {
        for &y in shifts_um {
            let back = light.shifted([x, y]).back(wanted);
            pull.iter_mut().zip(back).for_each(|(pull, back)| *pull += back);
        }
    }
    let share = 1.0 / (shifts_um.len() * shifts_um.len()) as f64;
    pull.iter_mut().for_each(|pull| *pull *= share);
    pull
}

/// Returns x A x / 2 - b x.
fn fall(place: &SearchPlace, pull: &[f64]) -> f64 {
    let numbers = place.x.iter().zip(&place.slopes).zip(pull);
    // With slopes A x - b: x A x / 2 - b x = x (slopes - b) / 2, without another product with A.
    numbers.map(|((x, slope), pull)| 0.5 * x * (slope - pull)).sum()
}
