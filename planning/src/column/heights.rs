//! Times whose cured heights are nearest to the target's (000 section 4.5.2).

use super::curvature::{Even, Weighted};
use super::curve::HeightCurve;
use super::light::GlassLight;
use super::times::{Allowed, LOOK, MirrorTimes, Stop};
use crate::numeric::{Bounded, SearchPlace};

/// The difference between cured and wanted heights, in um, on lights that count equally.
///
/// A column with a height counts by its difference, also below the critical dose, where the curve
/// continues as a straight line. An empty column counts by the height cured in it, so that light
/// below the critical dose costs nothing.
pub(super) struct HeightMisfit<'a> {
    pub(super) lights: &'a [GlassLight],
    pub(super) heights_um: &'a [f64],
    pub(super) curve: HeightCurve,
}

/// A square for each column voxel with the same value and slope as its error.
pub(super) struct Squares {
    /// The dose in mJ/cm2 at which each square is zero.
    pub(super) wanted: Vec<f64>,
    pub(super) weights: Vec<f64>,
    error: f64,
}

impl HeightMisfit<'_> {
    fn share(&self) -> f64 {
        1.0 / self.lights.len() as f64
    }

    /// Returns the error, and squares that approximate it, for the doses of one light.
    pub(super) fn squares(&self, doses: &[f64]) -> Squares {
        let share = self.share();
        let mut squares = Squares { wanted: Vec::new(), weights: Vec::new(), error: 0.0 };
        for (&dose, &wanted) in doses.iter().zip(self.heights_um) {
            let (height, slope) = self.curve.straight_below(dose);
            // 000 eq. 3.9: nothing is cured below the critical dose, so an empty column may have
            // any such dose.
            let counts = wanted > 0.0 || height > 0.0;
            let left = if counts { height - wanted } else { 0.0 };
            squares.error += share * 0.5 * left * left;
            // The second derivative of the curve is left out, so that no weight is negative and
            // each step's problem stays convex.
            squares.weights.push(if counts { share * slope * slope } else { 0.0 });
            // The Gauss-Newton square: with the slope at this dose, it is zero where the height is
            // right.
            squares.wanted.push(dose - left / slope);
        }
        squares
    }

    /// Returns the error of times.
    pub(super) fn at(&self, seconds: &[f64]) -> f64 {
        self.all_squares(seconds).iter().map(|squares| squares.error).sum()
    }

    fn all_squares(&self, seconds: &[f64]) -> Vec<Squares> {
        self.lights.iter().map(|light| self.squares(&light.doses(seconds))).collect()
    }
}

/// Finds the allowed times whose heights are nearest to the target's: Newton's method, which minimizes
/// its squares as squares of doses are. The search also ends once `is_stopped` returns true.
pub(super) fn nearest_heights(
    error: &HeightMisfit<'_>,
    allowed: Allowed,
    stop: Stop,
    is_stopped: &dyn Fn() -> bool,
) -> MirrorTimes {
    let mirrors = error.lights[0].setup().mirrors.iter().product();
    let Allowed { max_s, evenness } = allowed;
    let term = |x: &[f64]| 0.5 * evenness * x.iter().map(|time| time * time).sum::<f64>();
    let mut x = vec![0.0; mirrors];
    let mut squares = error.all_squares(&x);
    let mut steps = 0;
    loop {
        let error_here: f64 = squares.iter().map(|squares| squares.error).sum();
        let value = error_here + term(&x);
        let weights: Vec<_> = squares.iter().map(|squares| squares.weights.as_slice()).collect();
        let curvature = Weighted { lights: error.lights, weights: &weights };
        let curvature = Even { of: &curvature, evenness };
        let mut pull = vec![0.0; mirrors];
        for (light, squares) in error.lights.iter().zip(&squares) {
            let weighed = squares.wanted.iter().zip(&squares.weights).map(|(want, by)| want * by);
            let back = light.back(&weighed.collect::<Vec<_>>());
            pull.iter_mut().zip(back).for_each(|(pull, back)| *pull += back);
        }
        let problem = Bounded { curvature: &curvature, pull: &pull, high: max_s };
        let here = problem.place(x);
        let gap = here.gap(max_s, evenness);
        if gap <= stop.gap * value || steps >= stop.steps || is_stopped() {
            return MirrorTimes::of(here, error_here, allowed, steps);
        }
        // A step that leaves less than a tenth of the gap gains nothing: the squares change with
        // it.
        let enough = (0.1 * gap).max(0.3 * stop.gap * value);
        let before = steps;
        let next = problem.search(here.x.clone(), LOOK, |place, step| {
            steps = before + step;
            place.gap(max_s, evenness) <= enough || steps >= stop.steps || is_stopped()
        });
        (x, squares) = nearer(error, &term, &here, &next.x, value);
        steps += 1;
    }
}

/// Goes to `next`, or a share of the way there for which the error falls.
fn nearer(
    error: &HeightMisfit<'_>,
    term: &impl Fn(&[f64]) -> f64,
    here: &SearchPlace,
    next: &[f64],
    value: f64,
) -> (Vec<f64>, Vec<Squares>) {
    let mut share = 1.0;
    loop {
        let between = here.x.iter().zip(next).map(|(from, to)| from + share * (to - from));
        let x: Vec<_> = between.collect();
        let squares = error.all_squares(&x);
        let there = squares.iter().map(|squares| squares.error).sum::<f64>() + term(&x);
        // Steps as small as rounding may not lower the error any more.
        if there <= value || share < 1e-3 {
            return (x, squares);
        }
        share *= 0.5;
    }
}
