//! The search for the least cost: the primal-dual hybrid gradient, reflected, anchored and
//! restarted, with steps for each pixel and voxel.
//!
//! Every iterate has a cost, and a bound from the prices of doses, so the search knows its distance
//! from the best.

use std::ops::Range;

use crate::blur::{ChunkRoom, Real};
use crate::solver::problem::Problem;
use crate::wide::wide;

/// When a search ends.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    /// The largest difference between the cost and the bound.
    pub gap: f64,
    /// The most iterations.
    pub iterations: usize,
}

/// The cost and the bound after some iterations: the best so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchProgress {
    /// The number of iterations.
    pub iteration: usize,
    /// The cost of the best light.
    pub cost: f64,
    /// The bound: no light costs less.
    pub bound: f64,
}

/// The light that was found.
#[derive(Clone, Debug)]
pub struct Solution<T> {
    /// The light of each pixel.
    pub light: Vec<T>,
    /// The price of each voxel's dose that gives the bound.
    pub prices: Vec<T>,
    /// The course of cost and bound.
    pub progress: Vec<SearchProgress>,
}

impl<T> Solution<T> {
    /// Returns the cost and the bound at the end.
    ///
    /// # Panics
    /// Never: a search records its start.
    pub fn end(&self) -> SearchProgress {
        *self.progress.last().expect("a search notes where it starts")
    }
}

/// The number of iterations between two checks of cost and bound.
const LOOK_AFTER: usize = 5;
/// Steps are no longer than the steps of a pixel or voxel that sees this share of the most light.
const LEAST_SHARE: f64 = 1e-3;
// cuPDLP.jl restarts by the same three shares (Lu and Yang 2023).
/// A restart follows when the gap has shrunk to this share,
const SHRUNK: f64 = 0.2;
/// or to this share without shrinking since the last check,
const SHRUNK_AND_STUCK: f64 = 0.8;
/// or when the iterations since the last restart are this share of all.
const LONG: f64 = 0.36;
/// Steps in light are at first longer than steps in prices by 1 over this.
const FIRST_WEIGHT: f64 = 0.3;

/// Light and prices, and the doses and light costs that follow from them. Light and its costs end with
/// the last layer that has any.
#[derive(Clone)]
struct Iterate<T> {
    light: Vec<T>,
    prices: Vec<T>,
    doses: Vec<T>,
    of_light: Vec<T>,
}

impl<T: Real> Iterate<T> {
    fn new(problem: &Problem<T>, mut light: Vec<T>, prices: Vec<T>) -> Self {
        light.truncate(problem.operator.lit_voxels());
        light.shrink_to_fit();
        let [doses, of_light] = [prices.len(), light.len()].map(|len| vec![T::default(); len]);
        let mut start = Self { light, prices, doses, of_light };
        problem.operator.doses(&start.light, &mut start.doses);
        problem.operator.prices_of_light(&start.prices, &mut start.of_light);
        start
    }

    fn cost(&self, problem: &Problem<T>) -> f64 {
        problem.cost(&self.doses)
    }

    fn bound(&self, problem: &Problem<T>) -> f64 {
        problem.bound(&self.prices, &self.of_light)
    }
}

/// The length of a step in the light of a pixel and the price of a voxel (Pock and Chambolle 2011):
/// one over the sum of the matrix entries that it sees, which makes all steps together just short
/// enough.
struct Steps<T> {
    light: Vec<T>,
    prices: Vec<T>,
}

impl<T: Real> Steps<T> {
    fn new(problem: &Problem<T>) -> Self {
        let one_if = |is: bool| T::of(f64::from(u8::from(is)));
        let moves = |role| {
            let (light, prices) =
                (problem.terms.light_bounds(role), problem.terms.price_bounds(role));
            (one_if(light.low < light.high), one_if(prices.low < prices.high))
        };
        let (light, prices) = problem.roles.iter().map(|&role| moves(role)).unzip();
        let seen = Iterate::new(problem, light, prices);
        // Pock and Chambolle's steps with α = 1, over the sums of the matrix's rows and columns. No
        // number of the matrix is negative, so its product with ones gives these sums. Pixels that
        // cannot move, and voxels whose dose costs nothing, are left out: they would shorten the
        // steps of the rest.
        let over = |sums: &[T]| {
            let most = sums.iter().fold(0.0_f64, |most, sum| most.max(sum.f64()));
            // Where all sums are zero, any finite step will do.
            let least = if most > 0.0 { LEAST_SHARE * most } else { 1.0 };
            sums.iter().map(|sum| T::of(1.0 / sum.f64().max(least))).collect()
        };
        Self { light: over(&seen.of_light), prices: over(&seen.doses) }
    }

    /// Returns the distances between two iterates in light and in prices, in steps.
    fn distances(&self, a: &Iterate<T>, b: &Iterate<T>) -> [f64; 2] {
        let distance = |a: &[T], b: &[T], steps: &[T]| {
            // The norm in which a step has length one: |difference|² / step, as the theory of PDHG
            // measures.
            let squares = a.iter().zip(b).zip(steps).map(|((&a, &b), step)| {
                let apart = (a - b).f64();
                apart * apart / step.f64()
            });
            squares.sum::<f64>().sqrt()
        };
        [distance(&a.light, &b.light, &self.light), distance(&a.prices, &b.prices, &self.prices)]
    }
}

/// Finds the light that costs least, from a light and prices to start with.
///
/// The iteration is the reflected Halpern form of restarted PDHG (Lu and Yang 2024), for a
/// problem whose light and prices all have bounds.
///
/// # Panics
/// Panics if `light` or `prices` are not of the problem's size.
pub fn solve<T: Real>(
    problem: &Problem<T>,
    light: Vec<T>,
    prices: Vec<T>,
    until: Search,
) -> Solution<T> {
    let voxels = problem.operator.voxels();
    assert!(light.len() == voxels && prices.len() == voxels, "each voxel has a start");
    let steps = Steps::new(problem);
    let mut now = Iterate::new(problem, light, prices);
    let mut anchor = now.clone();
    let mut next = now.clone();
    let (cost, bound) = (now.cost(problem), now.bound(problem));
    let mut best = Best {
        light: now.light.clone(),
        prices: now.prices.clone(),
        progress: vec![SearchProgress { iteration: 0, cost, bound }],
    };
    let mut room = problem.operator.room();
    let (mut weight, mut since) = (FIRST_WEIGHT, 0);
    let (mut gap_at_restart, mut gap_before) = (cost - bound, f64::INFINITY);
    for iteration in 1..=until.iterations {
        if best.gap() <= until.gap {
            break;
        }
        since += 1;
        // Halpern's weights (k + 1) / (k + 2), with k = 0 at each restart: the anchor counts less
        // and less.
        let share = f64::from(since) / f64::from(since + 1);
        let iterate = SearchIteration::new(problem, &steps, weight, share);
        iterate.take(&mut now, &mut next, &anchor, &mut room);
        if iteration % LOOK_AFTER != 0 {
            continue;
        }
        let (cost, bound) = (next.cost(problem), next.bound(problem));
        best.look_at(iteration, &next, cost, bound);
        let gap = cost - bound;
        let stuck = gap < SHRUNK_AND_STUCK * gap_at_restart && gap > gap_before;
        let long = f64::from(since) > LONG * iteration as f64;
        if gap < SHRUNK * gap_at_restart || stuck || long {
            let [light, prices] = steps.distances(&next, &anchor);
            // The mean, as logarithms, of the old weight and of the ratio of the distances that
            // prices and light have moved since the restart: the primal weight of PDLP (Applegate
            // et al. 2021), smoothed by a half.
            weight = match (light > 1e-9, prices > 1e-9) {
                (true, true) => (weight * prices / light).sqrt(),
                // Only prices move, and too slowly: light stays at its bounds.
                (false, true) => weight * 4.0,
                (true, false) => weight / 4.0,
                (false, false) => weight,
            };
            now.clone_from(&next);
            anchor.clone_from(&next);
            (since, gap_at_restart, gap_before) = (0, gap, f64::INFINITY);
        } else {
            gap_before = gap;
        }
    }
    best.light.resize(voxels, T::default());
    Solution { light: best.light, prices: best.prices, progress: best.progress }
}

/// The best light and the best prices so far.
struct Best<T> {
    light: Vec<T>,
    prices: Vec<T>,
    progress: Vec<SearchProgress>,
}

impl<T: Real> Best<T> {
    fn last(&self) -> SearchProgress {
        *self.progress.last().expect("a search notes where it starts")
    }

    fn gap(&self) -> f64 {
        self.last().cost - self.last().bound
    }

    fn look_at(&mut self, iteration: usize, next: &Iterate<T>, cost: f64, bound: f64) {
        let mut progress = SearchProgress { iteration, ..self.last() };
        if cost < progress.cost {
            progress.cost = cost;
            // Cost and bound are each the best so far, from whichever iterate: the optimum is still
            // between them.
            self.light.copy_from_slice(&next.light);
        }
        if bound > progress.bound {
            progress.bound = bound;
            self.prices.copy_from_slice(&next.prices);
        }
        self.progress.push(progress);
    }
}

/// One iteration.
struct SearchIteration<'a, T> {
    problem: &'a Problem<T>,
    steps: &'a Steps<T>,
    /// Factors of steps in light and in prices.
    in_light: T,
    in_prices: T,
    /// Weights of the iterate after next: of the next, the present, and the anchor.
    onwards: T,
    back: T,
    rest: T,
}

impl<'a, T: Real> SearchIteration<'a, T> {
    fn new(problem: &'a Problem<T>, steps: &'a Steps<T>, weight: f64, share: f64) -> Self {
        Self {
            problem,
            steps,
            in_light: T::of(1.0 / weight),
            in_prices: T::of(weight),
            // share (2 next - now) + (1 - share) anchor: the reflected step of Lu and Yang (2024).
            onwards: T::of(2.0 * share),
            back: T::of(share),
            rest: T::of(1.0 - share),
        }
    }

    /// Goes down through the layers for light and prices, and up for the prices of light. Reflects
    /// `now` at `next`, and draws the result toward the anchor.
    fn take(
        &self,
        now: &mut Iterate<T>,
        next: &mut Iterate<T>,
        anchor: &Iterate<T>,
        room: &mut ChunkRoom<T>,
    ) {
        let operator = &self.problem.operator;
        // One pass down and one up do all the work of an iteration while a layer is in the cache.
        let plane = operator.plane();
        for layer in 0..operator.layer_count() {
            let here = layer * plane..(layer + 1) * plane;
            let lit = here.start.min(next.light.len())..here.end.min(next.light.len());
            let above = layer.saturating_sub(1) * plane..layer * plane;
            self.step_light(lit.clone(), now, next);
            let (done, doses) = next.doses.split_at_mut(here.start);
            let light = &next.light[lit.clone()];
            operator.doses_of_layer(layer, light, &done[above], &mut doses[..plane], room);
            self.step_prices(here.clone(), now, next);
            let draw = |here: &Range<usize>, now: &mut [T], next: &[T], anchor: &[T]| {
                self.draw(&mut now[here.clone()], &next[here.clone()], &anchor[here.clone()]);
            };
            draw(&lit, &mut now.light, &next.light, &anchor.light);
            draw(&here, &mut now.doses, &next.doses, &anchor.doses);
            draw(&here, &mut now.prices, &next.prices, &anchor.prices);
        }
        let mut sums = vec![T::default(); plane];
        for layer in (0..operator.layer_count()).rev() {
            let here = layer * plane..(layer + 1) * plane;
            let lit = here.start.min(next.light.len())..here.end.min(next.light.len());
            let of_light = &mut next.of_light[lit.clone()];
            operator.prices_of_layer(layer, &next.prices[here], &mut sums, of_light, room);
            self.draw(&mut now.of_light[lit.clone()], of_light, &anchor.of_light[lit]);
        }
    }

    /// Moves a layer's light against its price.
    fn step_light(&self, here: Range<usize>, now: &Iterate<T>, next: &mut Iterate<T>) {
        let terms = self.problem.terms;
        let roles = &self.problem.roles[here.clone()];
        let steps = &self.steps.light[here.clone()];
        let prices = &now.of_light[here.clone()];
        let (light, next) = (&now.light[here.clone()], &mut next.light[here]);
        wide(
            #[inline(always)]
            || {
                let pixels = next.iter_mut().zip(light).zip(prices.iter().zip(steps)).zip(roles);
                for (((next, &light), (&price, &step)), &role) in pixels {
                    let bounds = terms.light_bounds(role);
                    // Light moves against its cost, and back between its bounds: the primal half of
                    // Chambolle and Pock's iteration (2011).
                    let by = step * self.in_light * price;
                    *next = (light - by).within(bounds.low, bounds.high);
                }
            },
        );
    }

    /// Moves a layer's prices toward the slopes of the cost, at the doses that the light is going
    /// to make.
    fn step_prices(&self, here: Range<usize>, now: &Iterate<T>, next: &mut Iterate<T>) {
        let (two, terms) = (T::of(2.0), self.problem.terms);
        let roles = &self.problem.roles[here.clone()];
        let steps = &self.steps.prices[here.clone()];
        let incoming = &self.problem.incoming[here.clone()];
        let (from, to) = (&now.doses[here.clone()], &next.doses[here.clone()]);
        let (prices, next) = (&now.prices[here.clone()], &mut next.prices[here]);
        wide(
            #[inline(always)]
            || {
                let doses = from.iter().zip(to).zip(incoming);
                let voxels = next.iter_mut().zip(prices).zip(steps.iter().zip(roles)).zip(doses);
                for (((next, &price), (&step, &role)), ((&from, &to), &incoming)) in voxels {
                    let bounds = terms.price_bounds(role);
                    // Prices follow the doses extrapolated to 2 next - now: without that, light and
                    // prices oscillate around each other.
                    let beyond = two * to - from + incoming - terms.aim(role);
                    let by = step * self.in_prices * beyond;
                    *next = (price + by).within(bounds.low, bounds.high);
                }
            },
        );
    }

    /// Reflects values at the next ones, and draws the result toward the anchor.
    fn draw(&self, now: &mut [T], next: &[T], anchor: &[T]) {
        wide(
            #[inline(always)]
            || {
                for ((now, &next), &anchor) in now.iter_mut().zip(next).zip(anchor) {
                    *now = self.onwards * next - self.back * *now + self.rest * anchor;
                }
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blur::Blur;
    use crate::light::LayerLight;
    use crate::solver::{Operator, Role, Shape, Terms};

    /// The problem of 001 appendix A: a cylinder of 5 pixels and 5 layers, with the boundary of
    /// the layers from `first` on.
    fn appendix_a(first: usize) -> Problem<f64> {
        let shape = Shape::holding(5, 7, 7);
        let layer = LayerLight { passed: 10_f64.powf(-0.008), own: 3.0 / 170.0 };
        let operator = Operator::new(shape, Blur::new(13.0), vec![layer; 5]);
        let is_lit = |row: usize, column: usize| {
            let inside = |n: usize| (1..6).contains(&n);
            let corner = |n: usize| n == 1 || n == 5;
            inside(row) && inside(column) && !(corner(row) && corner(column))
        };
        let role = |voxel: usize| {
            let (layer, place) = (voxel / shape.plane(), voxel % shape.plane());
            let (row, column) = (place / shape.width, place % shape.width);
            match (column < 7, is_lit(row, column), layer) {
                (true, true, 0..2) => Role::LIT,
                (true, true, _) => Role::LIT.and(Role::CURED),
                (true, false, _) if layer >= first => Role::DARK,
                _ => Role::NONE,
            }
        };
        Problem {
            operator,
            roles: (0..shape.voxels()).map(role).collect(),
            incoming: vec![0.0; shape.voxels()],
            terms: Terms { least: 1.0, short_price: 300.0, most: 1.0, least_light: 0.0 },
        }
    }

    #[test]
    fn the_optimum_of_appendix_a_comes_out() {
        for (first, least) in [(0, 18415.657695), (2, 14008.109334)] {
            let problem = appendix_a(first);
            let light = problem.brightest();
            let prices = vec![0.0; light.len()];
            let until = Search { gap: 5e-9 * least / 170.0, iterations: 20_000 };
            let end = solve(&problem, light, prices, until).end();
            assert!(end.bound <= end.cost, "{end:?}");
            for found in [end.bound, end.cost] {
                assert!((170.0 * found / least - 1.0).abs() < 1e-8, "{end:?}");
            }
        }
    }
}
