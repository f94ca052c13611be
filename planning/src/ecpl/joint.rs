//! All times at once: bounded Gauss-Newton over the times of rings of pixels.
//!
//! Parts of many rings have times at fewer knots; the times between knots are interpolated
//! linearly.

use rayon::prelude::*;

use super::exposure::nested;
use super::profile::WantedProfile;
use super::reactor::Chamber;
use super::simulation::{RingSimulation, ShownLight};
use super::{RingExposure, RingPlanError};
use crate::numeric::{DescentEnd, descend, dot};

/// Light that does not reach the wanted height in this time, in seconds, never will in practice.
const LONGEST_S: f64 = 300.0;

/// No ring shines longer than this many times the time in which a wide field cures the greatest
/// height: against blur, longer light on an edge would gain little.
const LONGER: f64 = 2.0;

/// The most rounds of the search.
const ROUNDS: usize = 25;

/// The search ends when a round lowers the mean square by less than this share.
const ENOUGH: f64 = 1e-2;

/// The search ends below this root mean square, in micrometers: whole steps of the display leave
/// more.
const FINE_UM: f64 = 0.02;

/// The initial damping of a step, as a share of the largest square of a slope.
const HELD: f64 = 1e-2;

/// The most knots: each costs a simulation in every round.
const MOST_KNOTS: usize = 48;

/// Rounds of the search among whole steps of the display.
const WHOLE_ROUNDS: usize = 4;

/// The search for the times of rings of pixels that begin together, so that bitmaps nest.
struct KnotSearch<'a> {
    simulation: &'a RingSimulation,
    wanted: &'a WantedProfile,
    /// The square root of each column's share of the wanted area.
    weights: Vec<f64>,
    step_s: f64,
    longest_s: f64,
    knots: usize,
}

/// The result of some times, and its derivatives by the times.
struct Slopes {
    residuals: Vec<f64>,
    /// The change of all residuals for one more second at each knot.
    by_knot: Vec<Vec<f64>>,
}

/// Plans the times of all rings at once. The search ends early once `is_stopped` returns true.
pub(super) fn plan(
    simulation: &RingSimulation,
    wanted: &WantedProfile,
    is_stopped: &dyn Fn() -> bool,
) -> Result<Vec<RingExposure>, RingPlanError> {
    let wide = simulation.wide_field(wanted.highest_um(), LONGEST_S)?;
    let search = KnotSearch::new(simulation, wanted, LONGER * wide[wide.len() - 1].0);
    let mut times = search.first_times(&wide);
    search.smooth(&mut times, is_stopped);
    let steps = search.whole(&times, is_stopped);
    Ok(nested(&steps, simulation.setting().step))
}

impl<'a> KnotSearch<'a> {
    fn new(simulation: &'a RingSimulation, wanted: &'a WantedProfile, longest_s: f64) -> Self {
        let cells = simulation.reaction().cells();
        let is_part = |x: &usize| wanted.heights_um[*x] > 0.0;
        let area: f64 = (0..cells.across).filter(is_part).map(|x| cells.weight(x)).sum();
        // A cell of a round chamber stands for a ring: squares are weighted by its area.
        let weights = (0..cells.across).map(|x| (cells.weight(x) / area).sqrt()).collect();
        let step_s = simulation.setting().step.ms() / 1000.0;
        let knots = simulation.rings().min(MOST_KNOTS);
        Self { simulation, wanted, weights, step_s, longest_s, knots }
    }

    /// Returns the distance between knots, in rings.
    fn apart(&self) -> f64 {
        let spans = |count: usize| count.saturating_sub(1).max(1) as f64;
        spans(self.simulation.rings()) / spans(self.knots)
    }

    /// Returns the times of rings from the times of knots.
    fn by_ring(&self, knots: &[f64]) -> Vec<f64> {
        let time = |ring: usize| {
            let at = ring as f64 / self.apart();
            let knot = (at as usize).min(knots.len() - 1);
            let next = knots[(knot + 1).min(knots.len() - 1)];
            knots[knot] + (at - knot as f64) * (next - knots[knot])
        };
        (0..self.simulation.rings()).map(time).collect()
    }

    /// Returns for each knot the time in which a wide field cures the height wanted there.
    fn first_times(&self, wide: &[(f64, f64)]) -> Vec<f64> {
        let pixel_um = self.simulation.setting().pixel_um;
        let time = |knot: usize| {
            let ring = knot as f64 * self.apart() + 0.5;
            let height = self.wanted.height_um(ring * pixel_um);
            let enough = wide.iter().find(|&&(_, cured)| cured >= height);
            enough.filter(|_| height > 0.0).map_or(0.0, |&(seconds, _)| seconds)
        };
        (0..self.knots).map(time).collect()
    }

    /// Returns the light that is shown when rings shine for these times.
    fn shown(&self, times: &[f64]) -> Vec<ShownLight> {
        let mut rings: Vec<usize> = (0..times.len()).filter(|&ring| times[ring] > 0.0).collect();
        // Longest first: light is added up from the last bitmap to the first, since rings only go
        // dark.
        // dark.
        rings.sort_by(|&a, &b| times[b].total_cmp(&times[a]));
        let mut light = vec![0.0; self.simulation.reaction().cells().across];
        let mut shown: Vec<ShownLight> = Vec::new();
        for ring in rings {
            light.iter_mut().zip(self.simulation.ring(ring)).for_each(|(sum, l)| *sum += l);
            let until_s = times[ring];
            match shown.last_mut() {
                Some(last) if last.until_s == until_s => last.light.clone_from(&light),
                _ => shown.push(ShownLight { until_s, light: light.clone() }),
            }
        }
        shown.reverse();
        shown
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

    /// Finds the slopes by lengthening each knot by one step of the display. The cure before its
    /// rings go dark does not change, so each simulation begins there.
    fn slopes(&self, knots: &[f64]) -> Slopes {
        let seconds = self.simulation.reaction().seconds();
        let times = self.by_ring(knots);
        let longer: Vec<Vec<f64>> = (0..knots.len()).map(|knot| self.longer(knots, knot)).collect();
        // Chambers are kept where times diverge: everything before is the same for every knot.
        let first_dark = |longer: &Vec<f64>| {
            let changed = longer.iter().zip(&times).filter(|(longer, time)| longer != time);
            let first = changed.map(|(_, time)| *time).fold(f64::INFINITY, f64::min);
            (first.min(self.longest_s) / seconds) as usize
        };
        let dark: Vec<usize> = longer.iter().map(first_dark).collect();
        let mut kept: Vec<Option<Chamber>> = vec![None; knots.len()];
        let mut chamber = Chamber::new(self.simulation.reaction());
        self.simulation.expose(&mut chamber, &self.shown(&times), 0, |step, now| {
            for (kept, _) in kept.iter_mut().zip(&dark).filter(|&(_, &dark)| dark == step) {
                *kept = Some(now.clone());
            }
        });
        let residuals = self.residuals(&chamber);
        let slope = |(knot, kept): (usize, Option<Chamber>)| {
            let mut chamber = kept.expect("every ring goes dark by the end");
            let shown = self.shown(&longer[knot]);
            self.simulation.expose(&mut chamber, &shown, dark[knot], |_, _| ());
            let after = self.residuals(&chamber);
            after.iter().zip(&residuals).map(|(after, now)| (after - now) / self.step_s).collect()
        };
        let by_knot = kept.into_par_iter().enumerate().map(slope).collect();
        Slopes { residuals, by_knot }
    }

    /// Returns the times of rings when one knot is a step of the display longer.
    fn longer(&self, knots: &[f64], knot: usize) -> Vec<f64> {
        let mut longer = knots.to_vec();
        longer[knot] += self.step_s;
        self.by_ring(&longer)
    }

    /// Moves the times of knots toward the least mean square, by Gauss-Newton steps damped as by K.
    /// Levenberg and D. Marquardt.
    fn smooth(&self, times: &mut Vec<f64>, is_stopped: &dyn Fn() -> bool) {
        let mut held = HELD;
        let mut slopes = self.slopes(times);
        let mut now = square(&slopes.residuals);
        for _ in 0..ROUNDS {
            if is_stopped() {
                return;
            }
            let next = slopes.step(times, held, self.longest_s);
            let then = square(&self.cured(&self.by_ring(&next)));
            if then >= now {
                // Levenberg and Marquardt: a step that fails raises the damping, and one that helps
                // lowers it.
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

    /// Returns the times of rings in whole steps of the display, near the times of knots: the best
    /// ones, if each ring has its own knot.
    fn whole(&self, knots: &[f64], is_stopped: &dyn Fn() -> bool) -> Vec<u32> {
        if self.knots < self.simulation.rings() {
            return self.rounded(&self.by_ring(knots));
        }
        let mut best: Vec<u32> =
            knots.iter().map(|time| (time / self.step_s).round() as u32).collect();
        let seconds = |steps: &[u32]| -> Vec<f64> {
            steps.iter().map(|&steps| f64::from(steps) * self.step_s).collect()
        };
        let mut least = square(&self.cured(&seconds(&best)));
        for _ in 0..WHOLE_ROUNDS {
            if is_stopped() {
                break;
            }
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

    /// Rounds times to whole steps of the display; the next ring gets the time that a ring loses.
    fn rounded(&self, times: &[f64]) -> Vec<u32> {
        let mut lost = 0.0;
        let step = |time: &f64| {
            let wanted = time / self.step_s + lost;
            let steps = if *time > 0.0 { wanted.round().max(0.0) } else { 0.0 };
            // Rounding errors go on to the neighbor, whose light overlaps this ring's.
            lost = if *time > 0.0 { wanted - steps } else { 0.0 };
            steps as u32
        };
        times.iter().map(step).collect()
    }
}

impl Slopes {
    /// Returns the times of knots, not below zero, that minimize the linear model's mean square
    /// plus the damping.
    fn step(&self, times: &[f64], held: f64, longest_s: f64) -> Vec<f64> {
        let steepest = self.by_knot.iter().map(|slope| square(slope)).fold(0.0, f64::max);
        // As a share of the steepest slope, the factor has no unit.
        let held = held * steepest;
        let bounds = [vec![0.0; times.len()], vec![longest_s; times.len()]];
        let mut next = times.to_vec();
        let stop = DescentEnd { steps: 400, fall: 1e-10 };
        descend(&mut next, [&bounds[0], &bounds[1]], stop, |next| {
            let step: Vec<f64> = next.iter().zip(times).map(|(next, time)| next - time).collect();
            let left = self.after(&step);
            let value = 0.5 * (square(&left) + held * square(&step));
            let slope = |(ring, step): (&Vec<f64>, &f64)| dot(ring, &left) + held * step;
            (value, self.by_knot.iter().zip(&step).map(slope).collect())
        });
        next
    }

    /// Returns the residuals of the linear model after a change of the times.
    fn after(&self, step: &[f64]) -> Vec<f64> {
        let mut left = self.residuals.clone();
        for (slope, step) in self.by_knot.iter().zip(step) {
            left.iter_mut().zip(slope).for_each(|(left, slope)| *left += slope * step);
        }
        left
    }

    /// Moves single rings and pairs of neighbors by whole steps, as long as the linear model gains.
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
                            f64::from(by) * step_s * self.by_knot[ring][x]
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
                let slope = &self.by_knot[ring];
                left.iter_mut().zip(slope).for_each(|(left, slope)| *left += by_s * slope);
            }
        }
    }
}

/// Lists moves of one ring, and of two neighbors against each other.
fn moves(rings: usize) -> impl Iterator<Item = Vec<(usize, i32)>> {
    let one = (0..rings).flat_map(|ring| [1, -1].map(|by| vec![(ring, by)]));
    let two = (1..rings).flat_map(|ring| [1, -1].map(|by| vec![(ring - 1, by), (ring, -by)]));
    one.chain(two)
}

fn square(a: &[f64]) -> f64 {
    dot(a, a)
}
