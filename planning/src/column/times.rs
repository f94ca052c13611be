//! Times of mirrors, and a bound on their distance from the best (000 section 4.2).

use super::curvature::{Even, Normal};
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

/// The times that a search allows, and how much it prefers short and even ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowed {
    /// The longest time of a mirror, in seconds.
    pub max_s: f64,
    /// The error that half of the sum of the squared times adds, for each s². Where light spreads over
    /// many mirrors, it hardly matters which of them are on, and without it the times with the nearest
    /// doses are scattered and long.
    pub evenness: f64,
}

/// The seconds for which mirrors are on.
#[derive(Clone, Debug, PartialEq)]
pub struct MirrorTimes {
    /// The time of each mirror, rows from the first.
    pub seconds: Vec<f64>,
    /// Half the sum of the squared differences between doses and wanted doses, in (mJ/cm2)2.
    pub error: f64,
    /// The value of the term of [`Allowed::evenness`]: a search minimizes its sum with the error.
    pub term: f64,
    /// The most by which the least sum can be smaller.
    pub gap: f64,
    /// The most by which the least error of any allowed times, however uneven, can be smaller. Errors of
    /// heights are not convex, so that there it is an estimate, as the gap is.
    pub price: f64,
    /// The number of steps of the search.
    pub steps: usize,
}

impl MirrorTimes {
    /// Returns the gap as a share of the sum that was minimized, or 0 if there is no gap.
    pub fn relative_gap(&self) -> f64 {
        if self.gap > 0.0 { self.gap / (self.error + self.term) } else { 0.0 }
    }

    /// Creates them from where a search of the sum ended.
    pub(super) fn of(place: SearchPlace, error: f64, allowed: Allowed, steps: usize) -> Self {
        let Allowed { max_s, evenness } = allowed;
        let gap = place.gap(max_s, evenness);
        let term = 0.5 * evenness * place.x.iter().map(|time| time * time).sum::<f64>();
        let SearchPlace { x, mut slopes } = place;
        slopes.iter_mut().zip(&x).for_each(|(slope, time)| *slope -= evenness * time);
        let plain = SearchPlace { x, slopes };
        let price = if evenness > 0.0 { plain.gap(max_s, 0.0) } else { gap };
        Self { error, term, gap, price, steps, seconds: plain.x }
    }

    /// Returns the number of mirrors that are on for the longest time.
    pub fn at_most(&self, max_s: f64) -> usize {
        self.seconds.iter().filter(|seconds| **seconds >= max_s).count()
    }
}

/// Steps after which a search looks whether it may end.
pub(super) const LOOK: usize = 4;

/// Steps towards the nearest times, uneven as they may be, and the share of the error that is near
/// enough.
const STEPS_TO_PRICE: usize = 24;
const NEAR: f64 = 1e-3;

/// An error below this share of the error without light counts as zero.
const NOTHING: f64 = 1e-12;

/// Finds the allowed times whose doses are nearest to `wanted` in mJ/cm2: the least half sum of squares
/// (000 eq. 4.4), or its mean over lights shifted by `shifts_um` along each axis, with the term of
/// [`Allowed::evenness`]. The search also ends once `is_stopped` returns true.
pub fn nearest_times(
    light: &GlassLight,
    wanted: &[f64],
    allowed: Allowed,
    shifts_um: &[f64],
    stop: Stop,
    is_stopped: &dyn Fn() -> bool,
) -> MirrorTimes {
    let Allowed { max_s, evenness } = allowed;
    let normal = Normal::mean(light, shifts_um);
    let curvature = Even { of: &normal, evenness };
    let pull = mean_pull(light, wanted, shifts_um);
    let problem = Bounded { curvature: &curvature, pull: &pull, high: max_s };
    // |H t - E|² / 2 = t HᵀH t / 2 - t HᵀE + E E / 2 (000 eq. 4.4, squared): the search needs only
    // the first two terms.
    let dark = 0.5 * wanted.iter().map(|dose| dose * dose).sum::<f64>();
    let sum = |place: &SearchPlace| dark + fall(place, &pull);
    let mut steps = 0;
    let place = problem.search(vec![0.0; pull.len()], LOOK, |place, step| {
        steps = step;
        let gap = place.gap(max_s, evenness);
        let is_near = gap <= stop.gap * sum(place).max(NOTHING * dark);
        is_near || step >= stop.steps || is_stopped()
    });
    let sum = sum(&place);
    let mut times = MirrorTimes::of(place, 0.0, allowed, steps);
    times.error = (sum - times.term).max(0.0);
    if evenness > 0.0 {
        // A few steps towards the nearest times alone: wherever they end, their bound holds, and mostly it
        // is nearer than the bound of the even times.
        let plain = Bounded { curvature: &normal, pull: &pull, high: max_s };
        let place = plain.accelerate(times.seconds.clone(), LOOK, |place, step| {
            let gap = place.gap(max_s, 0.0);
            gap <= NEAR * times.error || step >= STEPS_TO_PRICE || is_stopped()
        });
        let least = dark + fall(&place, &pull) - place.gap(max_s, 0.0);
        times.price = times.price.min(times.error - least).max(0.0);
    }
    times
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
