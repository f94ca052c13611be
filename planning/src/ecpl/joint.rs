//! All times at once: bounded Gauss-Newton over the times of rings of pixels.

use rayon::prelude::*;

use super::exposure::nested;
use super::profile::Wanted;
use super::reactor::Chamber;
use super::simulation::{Shown, Simulation};
use super::{Exposure, PlanError};
use crate::speed::{Stop, descend};

/// Light that does not reach the wanted height in this time, in seconds, never will in practice.
const LONGEST_S: f64 = 300.0;

/// No ring shines longer than so many times what a wide field needs for the greatest height:
/// against blur, endless light on an edge would gain little.
const LONGER: f64 = 2.0;

/// Rounds of the search at most.
const ROUNDS: usize = 25;

/// The search ends when a round lowers the mean square by less than this share.
const ENOUGH: f64 = 1e-2;

/// The search ends below this root mean square, in micrometres: whole steps of the display leave
/// more.
const FINE_UM: f64 = 0.02;

/// How strongly a first step is held back, as a share of the largest square of a slope.
const HELD: f64 = 1e-2;

/// Rounds of the search among whole steps of the display.
const WHOLE_ROUNDS: usize = 4;

/// The search for the times of rings of pixels that begin together, so that bitmaps nest.
struct Search<'a> {
    simulation: &'a Simulation,
    wanted: &'a Wanted,
    /// The square root of each column's share of the wanted area.
    weights: Vec<f64>,
    step_s: f64,
    longest_s: f64,
}

/// What some times cure, and how that follows the times.
struct Slopes {
    residuals: Vec<f64>,
    /// The change of all residuals for a second more of each ring.
    by_ring: Vec<Vec<f64>>,
}

/// Plans the times of all rings at once.
pub(super) fn plan(simulation: &Simulation, wanted: &Wanted) -> Result<Vec<Exposure>, PlanError> {
    let wide = simulation.wide_field(wanted.highest_um(), LONGEST_S)?;
    let search = Search::new(simulation, wanted, LONGER * wide[wide.len() - 1].0);
    let mut times = search.first_times(&wide);
    search.smooth(&mut times);
    let steps = search.whole(&times);
    Ok(nested(&steps, simulation.setting().step))
}

impl<'a> Search<'a> {
    fn new(simulation: &'a Simulation, wanted: &'a Wanted, longest_s: f64) -> Self {
        let cells = simulation.reaction().cells();
        let is_part = |x: &usize| wanted.heights_um[*x] > 0.0;
        let area: f64 = (0..cells.across).filter(is_part).map(|x| cells.weight(x)).sum();
        let weights = (0..cells.across).map(|x| (cells.weight(x) / area).sqrt()).collect();
        let step_s = simulation.setting().step.ms() / 1000.0;
        Self { simulation, wanted, weights, step_s, longest_s }
    }

    /// Returns for each ring the time in which a wide field cures what is wanted there.
    fn first_times(&self, wide: &[(f64, f64)]) -> Vec<f64> {
        let pixel_um = self.simulation.setting().pixel_um;
        let time = |ring: usize| {
            let height = self.wanted.height_um((ring as f64 + 0.5) * pixel_um);
            let enough = wide.iter().find(|&&(_, cured)| cured >= height);
            enough.filter(|_| height > 0.0).map_or(0.0, |&(seconds, _)| seconds)
        };
        (0..self.simulation.rings()).map(time).collect()
    }

    fn shown(&self, times: &[f64]) -> Vec<Shown> {
        let mut ends: Vec<f64> = times.iter().copied().filter(|&time| time > 0.0).collect();
        ends.sort_unstable_by(f64::total_cmp);
        ends.dedup();
        let shown = |until_s| Shown {
            until_s,
            light: self.simulation.light(|ring| times[ring] >= until_s),
        };
        ends.into_iter().map(shown).collect()
    }

    fn residuals(&self, chamber: &Chamber) -> Vec<f64> {
        let heights = chamber.heights_um(self.simulation.reaction());
        let off = heights.iter().zip(&self.wanted.heights_um).zip(&self.weights);
        off.map(|((height, wanted), weight)| weight * (height - wanted)).collect()
    }

    fn cured(&self, times: &[f64]) -> Vec<f64> {
        let mut chamber = Chamber::new(self.simulation.reaction());
        self.simulation.expose(&mut chamber, &self.shown(times), 0, |_, _| ());
        self.residuals(&chamber)
    }

    /// Finds the slopes by one step of the display more for each ring. What is cured before a
    /// ring goes dark does not change, so each begins there.
    fn slopes(&self, times: &[f64]) -> Slopes {
        let seconds = self.simulation.reaction().seconds();
        let dark: Vec<usize> = times.iter().map(|time| (time / seconds) as usize).collect();
        let mut kept: Vec<Option<Chamber>> = vec![None; times.len()];
        let mut chamber = Chamber::new(self.simulation.reaction());
        self.simulation.expose(&mut chamber, &self.shown(times), 0, |step, now| {
            for (kept, _) in kept.iter_mut().zip(&dark).filter(|&(_, &dark)| dark == step) {
                *kept = Some(now.clone());
            }
        });
        let residuals = self.residuals(&chamber);
        let slope = |(ring, kept): (usize, Option<Chamber>)| {
            let mut chamber = kept.expect("every ring goes dark by the end");
            let mut longer = times.to_vec();
            longer[ring] += self.step_s;
            self.simulation.expose(&mut chamber, &self.shown(&longer), dark[ring], |_, _| ());
            let after = self.residuals(&chamber);
            after.iter().zip(&residuals).map(|(after, now)| (after - now) / self.step_s).collect()
        };
        let by_ring = kept.into_par_iter().enumerate().map(slope).collect();
        Slopes { residuals, by_ring }
    }

    /// Moves the times towards the least mean square, by Gauss-Newton held back as K. Levenberg
    /// and D. Marquardt do.
    fn smooth(&self, times: &mut Vec<f64>) {
        let mut held = HELD;
        let mut slopes = self.slopes(times);
        let mut now = square(&slopes.residuals);
        for _ in 0..ROUNDS {
            let next = slopes.step(times, held, self.longest_s);
            let then = square(&self.cured(&next));
            if then >= now {
                held *= 8.0;
                continue;
            }
            held /= 4.0;
            *times = next;
            if now - then < ENOUGH * now || then < FINE_UM.powi(2) {
                return;
            }
            slopes = self.slopes(times);
            now = square(&slopes.residuals);
        }
    }

    /// Returns the best times that are whole steps of the display, near these.
    fn whole(&self, times: &[f64]) -> Vec<u32> {
        let rounded = |times: &[f64]| -> Vec<u32> {
            times.iter().map(|time| (time / self.step_s).round() as u32).collect()
        };
        let seconds = |steps: &[u32]| -> Vec<f64> {
            steps.iter().map(|&steps| f64::from(steps) * self.step_s).collect()
        };
        let mut best = rounded(times);
        let mut least = square(&self.cured(&seconds(&best)));
        for _ in 0..WHOLE_ROUNDS {
            let slopes = self.slopes(&seconds(&best));
            let next = slopes.whole_steps(&best, self.step_s);
            let then = square(&self.cured(&seconds(&next)));
            if then >= least {
                break;
            }
            (best, least) = (next, then);
        }
        best
    }
}

impl Slopes {
    /// Returns the times that make the linear model's mean square least, not below zero, while
    /// steps are held back.
    fn step(&self, times: &[f64], held: f64, longest_s: f64) -> Vec<f64> {
        let steepest = self.by_ring.iter().map(|slope| square(slope)).fold(0.0, f64::max);
        let held = held * steepest;
        let bounds = [vec![0.0; times.len()], vec![longest_s; times.len()]];
        let mut next = times.to_vec();
        let stop = Stop { steps: 400, fall: 1e-10 };
        descend(&mut next, [&bounds[0], &bounds[1]], stop, |next| {
            let step: Vec<f64> = next.iter().zip(times).map(|(next, time)| next - time).collect();
            let left = self.after(&step);
            let value = 0.5 * (square(&left) + held * square(&step));
            let slope = |(ring, step): (&Vec<f64>, &f64)| dot(ring, &left) + held * step;
            (value, self.by_ring.iter().zip(&step).map(slope).collect())
        });
        next
    }

    /// Returns the residuals of the linear model after a change of the times.
    fn after(&self, step: &[f64]) -> Vec<f64> {
        let mut left = self.residuals.clone();
        for (slope, step) in self.by_ring.iter().zip(step) {
            left.iter_mut().zip(slope).for_each(|(left, slope)| *left += slope * step);
        }
        left
    }

    /// Moves single rings and pairs of neighbours by whole steps, as long as the linear model
    /// gains.
    fn whole_steps(&self, steps: &[u32], step_s: f64) -> Vec<u32> {
        let mut best = steps.to_vec();
        let mut left = self.residuals.clone();
        let mut least = square(&left);
        loop {
            let mut gained = None;
            for moves in moves(best.len()) {
                let fits =
                    moves.iter().all(|&(ring, by)| best[ring].checked_add_signed(by).is_some());
                if !fits {
                    continue;
                }
                let after: f64 = (0..left.len())
                    .map(|x| {
                        let change = |&(ring, by): &(usize, i32)| {
                            f64::from(by) * step_s * self.by_ring[ring][x]
                        };
                        (left[x] + moves.iter().map(change).sum::<f64>()).powi(2)
                    })
                    .sum();
                if after < least * (1.0 - 1e-9) {
                    (least, gained) = (after, Some(moves));
                }
            }
            let Some(moves) = gained else { return best };
            for (ring, by) in moves {
                best[ring] = best[ring].saturating_add_signed(by);
                let by_s = f64::from(by) * step_s;
                let slope = &self.by_ring[ring];
                left.iter_mut().zip(slope).for_each(|(left, slope)| *left += by_s * slope);
            }
        }
    }
}

/// Lists moves of one ring, and of two neighbours against each other.
fn moves(rings: usize) -> impl Iterator<Item = Vec<(usize, i32)>> {
    let one = (0..rings).flat_map(|ring| [1, -1].map(|by| vec![(ring, by)]));
    let two = (1..rings).flat_map(|ring| [1, -1].map(|by| vec![(ring - 1, by), (ring, -by)]));
    one.chain(two)
}

fn square(a: &[f64]) -> f64 {
    dot(a, a)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
