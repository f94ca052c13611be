//! Finds the time of each layer that leaves the least error.

use lamp_grayscale::resin::ExposureTime;
use thiserror::Error;

use super::feasible::{Feasible, Platform, PlatformError};
use super::hinge::{Hinge, Priced};
use super::part::{PartError, TimedLayer, TimedPart};
use super::simulation::Simulation;
use super::tally::Tally;
use crate::light::Light;
use crate::numeric::{DescentEnd, descend};

/// Changes when the same options and layers give other times.
pub const SPEED_CODE: u32 = 3;

/// The light, platform and limits to plan for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedOptions {
    /// The model of light and resin.
    pub light: Light,
    /// The limits of the platform.
    pub platform: Platform,
    /// The distance that doses should keep from the critical one, as a share of it.
    pub margin: f64,
    /// The largest allowed distance between error and bound, as a share of the best single time's
    /// error.
    pub gap: f64,
    /// The memory to use, in bytes.
    pub memory: u64,
}

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SpeedPlanError {
    /// The pages or the model's numbers are impossible.
    #[error(transparent)]
    Part(#[from] PartError),
    /// The platform's numbers are impossible.
    #[error(transparent)]
    Platform(#[from] PlatformError),
    /// No voxel belongs to the part.
    #[error("no pixel belongs to the part: all are below the wanted level")]
    NothingWanted,
}

/// A stage of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchStage {
    /// The least error so far.
    pub error: f64,
    /// The bound: no times of the platform have a smaller error.
    pub bound: f64,
}

/// The time of each layer.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedPlan {
    /// The times, of the layer nearest to the light first.
    pub times: Vec<ExposureTime>,
    /// The best time that is the same for all layers, ignoring `max_change`.
    pub single: ExposureTime,
    /// The result of the best single time.
    pub before: Tally,
    /// The result of the plan.
    pub after: Tally,
    /// The error of the best single time in the columns that the search sees, `P0`.
    pub single_error: f64,
    /// The search's stages; the last has the plan's error and bound.
    pub stages: Vec<SearchStage>,
    /// The number of pixels that each column in the search stands for. With 1, the search sees all
    /// pixels, and the bound holds for the whole part.
    pub sampled: u32,
}

impl SpeedPlan {
    /// Returns the largest distance of the plan's error from the least, as a share of the best
    /// single time's error.
    pub fn gap(&self) -> f64 {
        self.stages.last().map_or(0.0, |last| gap(*last, self.single_error))
    }
}

fn gap(stage: SearchStage, single_error: f64) -> f64 {
    if stage.error == 0.0 { 0.0 } else { (stage.error - stage.bound) / single_error }
}

/// The doses around the kink over which the error is smoothed, stage by stage.
const SMOOTHINGS: [f64; 6] = [0.3, 0.1, 0.03, 0.01, 0.003, 0.001];
// Six stages of this many steps, each a pass over all columns, bound the time of a plan.
/// When a stage ends.
const END: DescentEnd = DescentEnd { steps: 300, fall: 1e-9 };
/// When a stage ends for a light that is not known well: it may be planned for many times.
const SOON: DescentEnd = DescentEnd { steps: 60, fall: 1e-6 };

/// Finds the times of a part's layers.
///
/// # Errors
/// Returns an error if the model's or the platform's numbers are impossible, or if no voxel
/// belongs to the part.
pub fn plan(part: &TimedPart, options: &SpeedOptions) -> Result<SpeedPlan, SpeedPlanError> {
    let feasible = Feasible::new(&options.platform, part.layers())?;
    let simulation = Simulation::new(part, &options.light, options.memory)?;
    let problem = TimesProblem { simulation: &simulation, feasible, options, end: END };
    let (single, single_error) = problem.best_single();
    let (times, stages) = problem.search(&single, single_error);
    let [before, after] = simulation.tally([&single, &times]);
    if after.wanted.iter().all(|&count| count == 0) {
        return Err(SpeedPlanError::NothingWanted);
    }
    let time = |seconds: &f64| ExposureTime::from_ms(seconds * 1000.0);
    Ok(SpeedPlan {
        times: times.iter().map(time).collect(),
        single: time(&single[0]),
        before,
        after,
        single_error,
        stages,
        sampled: simulation.sampled(),
    })
}

/// Finds the times, in seconds, for a part that is simulated already. Its voxels are not counted.
pub(crate) fn times_of(
    simulation: &Simulation<'_>,
    layers: &[TimedLayer],
    options: &SpeedOptions,
) -> Result<Vec<f64>, PlatformError> {
    let feasible = Feasible::new(&options.platform, layers)?;
    let problem = TimesProblem { simulation, feasible, options, end: SOON };
    let (single, single_error) = problem.best_single();
    Ok(problem.search(&single, single_error).0)
}

struct TimesProblem<'a> {
    simulation: &'a Simulation<'a>,
    feasible: Feasible,
    options: &'a SpeedOptions,
    end: DescentEnd,
}

impl TimesProblem<'_> {
    fn price(&self, times: &[f64], smoothing: f64) -> Priced {
        let margin = self.options.margin;
        let layers = self.simulation.layers();
        Hinge { layers, margin, smoothing }.of(self.simulation.columns(), times)
    }

    /// Returns the best time that is the same for all layers, and its error. The error is convex,
    /// so its slope shows on which side the best time is.
    fn best_single(&self) -> (Vec<f64>, f64) {
        let (low, high) = (&self.feasible.low, &self.feasible.high);
        let layers = low.len();
        let mut low = low.iter().copied().fold(f64::INFINITY, f64::min);
        let mut high = high.iter().copied().fold(0.0, f64::max);
        let mut best = (low, f64::INFINITY);
        while high / low > 1.0 + 1e-5 {
            // Times span orders of magnitude: bisect their logarithm.
            let time = (low * high).sqrt();
            let priced = self.price(&vec![time; layers], 0.0);
            if priced.error < best.1 {
                best = (time, priced.error);
            }
            let slope: f64 = priced.slopes.iter().sum();
            *(if slope > 0.0 { &mut high } else { &mut low }) = time;
        }
        (vec![best.0; layers], best.1)
    }

    /// Moves from the best single time to the least error, with less and less smoothing.
    fn search(&self, single: &[f64], single_error: f64) -> (Vec<f64>, Vec<SearchStage>) {
        // A wide prism needs twice the critical dose at every layer: its walls then get half of it,
        // the critical dose.
        let starts = [single.to_vec(), self.simulation.times_for(2.0)];
        let starts = starts.map(|times| {
            let times = self.feasible.nearest(&times);
            (self.price(&times, 0.0).error, times)
        });
        let [single, prism] = starts;
        let mut best = if prism.0 < single.0 { prism } else { single };
        let mut times = best.1.clone();
        let (mut bound, mut stages) = (0.0_f64, Vec::new());
        let mut prices = Prices::new(&self.feasible, &times, single_error);
        // From smooth to sharp: a sharp error has slopes that do not see kinks far away, and the
        // times of the smoother stage start near the optimum of the next.
        for smoothing in SMOOTHINGS {
            // Each round raises the prices of broken ratios. After four rounds, moving to the
            // nearest possible times removes the rest.
            let rounds = if self.feasible.is_box() { 1 } else { 4 };
            for _ in 0..rounds {
                self.descend(&mut times, smoothing, &prices);
                prices.update(&self.feasible, &times);
            }
            let near = self.feasible.nearest(&times);
            let error = self.price(&near, 0.0).error;
            if error < best.0 {
                best = (error, near);
            }
            let priced = self.price(&times, smoothing);
            // A later stage may have a worse bound.
            bound = bound.max(priced.bound(&times, self.feasible.least(&priced.slopes)));
            let stage = SearchStage { error: best.0, bound: bound.min(best.0) };
            stages.push(stage);
            if gap(stage, single_error) <= self.options.gap {
                break;
            }
        }
        (best.1, stages)
    }

    fn descend(&self, times: &mut Vec<f64>, smoothing: f64, prices: &Prices) {
        // In units of the times there, all layers' slopes have similar sizes.
        let scale = times.clone();
        let bounds = [&self.feasible.low, &self.feasible.high]
            .map(|ends| ends.iter().zip(&scale).map(|(end, scale)| end / scale).collect());
        let [low, high]: [Vec<f64>; 2] = bounds;
        let mut x = vec![1.0; scale.len()];
        descend(&mut x, [&low, &high], self.end, |x| {
            let times: Vec<_> = x.iter().zip(&scale).map(|(x, scale)| x * scale).collect();
            let priced = self.price(&times, smoothing);
            let (mut error, mut slopes) = (priced.error, priced.slopes);
            error += prices.add(&self.feasible, &times, &mut slopes);
            slopes.iter_mut().zip(&scale).for_each(|(slope, scale)| *slope *= scale);
            (error, slopes)
        });
        *times = x.iter().zip(&scale).map(|(x, scale)| x * scale).collect();
    }
}

/// The cost of breaking a ratio, and the factor by which it grows from round to round.
const WEIGHT: f64 = 100.0;
const HEAVIER: f64 = 1.5;

/// The cost of breaking the ratios of neighbors: an augmented Lagrangian.
struct Prices {
    of_pairs: Vec<[f64; 2]>,
    weight: f64,
}

impl Prices {
    fn new(feasible: &Feasible, single: &[f64], single_error: f64) -> Self {
        let pairs = feasible.excess(single).len();
        // An excess equal to the pace of the single time costs the error of many layers.
        let pace = feasible.pace(single);
        let weight = WEIGHT * (single_error + 1.0) / (pairs.max(1) as f64 * pace * pace);
        Self { of_pairs: vec![[0.0; 2]; pairs], weight }
    }

    /// Adds the slopes of the cost, and returns it.
    fn add(&self, feasible: &Feasible, times: &[f64], slopes: &mut [f64]) -> f64 {
        let now = self.raised(feasible, times);
        feasible.add_slopes(&now, slopes);
        let squares = |pairs: &[[f64; 2]]| -> f64 {
            pairs.as_flattened().iter().map(|price| price * price).sum()
        };
        // The augmented Lagrangian of inequalities g ≤ 0 (Rockafellar 1973) is ((p + w g)₊² - p²) /
        // 2w. Its slopes are (p + w g)₊ times the slopes of g.
        (squares(&now) - squares(&self.of_pairs)) / (2.0 * self.weight)
    }

    fn raised(&self, feasible: &Feasible, times: &[f64]) -> Vec<[f64; 2]> {
        let excess = feasible.excess(times).into_iter().zip(&self.of_pairs);
        let raise = |(excess, prices): ([f64; 2], &[f64; 2])| {
            std::array::from_fn(|k| (prices[k] + self.weight * excess[k]).max(0.0))
        };
        excess.map(raise).collect()
    }

    fn update(&mut self, feasible: &Feasible, times: &[f64]) {
        self.of_pairs = self.raised(feasible, times);
        // A heavier weight restores ratios sooner, and makes the descent stiffer.
        self.weight *= HEAVIER;
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::cavity_staircase;

    use super::*;
    use crate::speed::testing::{options, part, pegda};

    fn worst_change(part: &TimedPart, times: &[ExposureTime]) -> f64 {
        let pace = times.iter().zip(part.layers()).map(|(t, layer)| t.ms() / layer.thickness.um());
        let pace: Vec<_> = pace.collect();
        pace.windows(2).map(|two| (two[0] / two[1]).max(two[1] / two[0]) - 1.0).fold(0.0, f64::max)
    }

    #[test]
    fn a_staircase_with_a_cavity_keeps_its_steps() {
        let part = part(&cavity_staircase(1));
        let options = options(pegda(50.0), None);
        let plan = plan(&part, &options).unwrap();
        let [before, after] = [&plan.before, &plan.after].map(|tally| tally.wrong().sum());
        assert!(10 * after <= 3 * before, "{after} of {before}");
        assert!(plan.gap() <= 0.01 && plan.sampled == 1, "{}", plan.gap());
        // By count, no other single time comes near either.
        let simulation = Simulation::new(&part, &options.light, 1 << 30).unwrap();
        for step in 0..20 {
            let [tally] = simulation.tally([&[0.1 * 1.1_f64.powi(step); 60]]);
            assert!(10 * after <= 3 * tally.wrong().sum(), "{step} {:?}", tally.wrong());
        }
    }

    #[test]
    fn speeds_change_no_more_than_they_may() {
        let part = part(&cavity_staircase(1));
        let limited = plan(&part, &options(pegda(50.0), Some(0.2))).unwrap();
        let free = plan(&part, &options(pegda(50.0), None)).unwrap();
        assert!(worst_change(&part, &limited.times) <= 0.2 + 1e-9);
        assert!(worst_change(&part, &free.times) > 1.0);
        let error = |plan: &SpeedPlan| plan.stages.last().unwrap().error;
        assert!(error(&limited) > error(&free) && error(&limited) < limited.single_error);
        assert!(limited.gap() <= 0.02, "{}", limited.gap());
    }

    #[test]
    fn any_number_of_threads_plans_the_same() {
        let part = part(&cavity_staircase(1));
        let plan_with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| plan(&part, &options(pegda(50.0), Some(0.5))).unwrap())
        };
        assert_eq!(plan_with(1), plan_with(3));
    }
}
