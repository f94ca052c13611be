//! Conjugate gradients between bounds.
//!
//! Source: Z. Dostál and J. Schöberl, *Minimizing quadratic functions subject to bound
//! constraints with the rate of convergence and finite termination*, Comput. Optim. Appl. 30
//! (2005): modified proportioning with reduced gradient projections, here with an upper bound.

use rayon::prelude::*;

use super::{Bounded, CHUNK, CurvatureMatrix, SearchPlace};

/// The length of steps along the slopes, in units of 1 / |A|: below 2, it cannot raise the value.
const STEP: f64 = 1.9;

/// How a number may move.
#[derive(Clone, Copy)]
struct Slope {
    /// The slope of a number between its bounds.
    free: f64,
    /// The slope of a number at a bound, if it leads away from that bound.
    chopped: f64,
}

fn slope_at(x: f64, slope: f64, high: f64) -> Slope {
    if x <= 0.0 {
        Slope { free: 0.0, chopped: slope.min(0.0) }
    } else if x >= high {
        Slope { free: 0.0, chopped: slope.max(0.0) }
    } else {
        Slope { free: slope, chopped: 0.0 }
    }
}

/// The sums that select the next step.
#[derive(Clone, Copy, Default)]
struct Sums {
    chopped: f64,
    reduced: f64,
    /// The sum of free slopes times the product of the last direction.
    conjugate: f64,
}

impl<C: CurvatureMatrix> Bounded<'_, C> {
    /// Searches face by face, as [`Self::search`] does. A step takes one or two products.
    pub(super) fn proportion(
        &self,
        x: Vec<f64>,
        look: usize,
        mut is_done: impl FnMut(&SearchPlace, usize) -> bool,
    ) -> SearchPlace {
        let mut place = self.place(x);
        // Steps below 2 / |A| lower the value along projected slopes.
        let length = STEP / self.greatest();
        let mut direction = self.free(&place);
        let mut sums = self.sums(&place, None, length);
        for step in 0_usize.. {
            let is_still = sums.chopped == 0.0 && sums.reduced == 0.0;
            if (step % look == 0 && is_done(&place, step)) || is_still {
                break;
            }
            // The proportioning test with Γ = 1: stay in the face as long as numbers at their
            // bounds gain less than free ones.
            if sums.chopped <= sums.reduced {
                let product = self.curvature.apply(&direction);
                let (along, curvature, room) = self.along(&place, &direction, &product);
                let best = along / curvature;
                // With one free number, only zero is conjugate to the last direction.
                let leads_down = along > 0.0 && curvature > 0.0;
                if !leads_down {
                    self.project(&mut place, length);
                    sums = self.sums(&place, None, length);
                    direction = self.free(&place);
                } else if best <= room {
                    self.walk(&mut place, &direction, &product, best);
                    sums = self.sums(&place, Some(&product), length);
                    // The new direction is conjugate to the last one: its product with A times the
                    // last one is zero.
                    let turn = sums.conjugate / curvature;
                    self.turn(&place, &mut direction, turn);
                } else {
                    // Expansion: go to the first bound, then along the projected slopes, which may
                    // reach many bounds at once. Conjugacy is lost there.
                    self.walk(&mut place, &direction, &product, room);
                    self.project(&mut place, length);
                    sums = self.sums(&place, None, length);
                    direction = self.free(&place);
                }
            } else {
                // Proportioning: release numbers from their bounds by a step of steepest descent.
                let chopped = self.chopped(&place);
                let product = self.curvature.apply(&chopped);
                let (along, curvature, room) = self.along(&place, &chopped, &product);
                self.walk(&mut place, &chopped, &product, (along / curvature).min(room));
                sums = self.sums(&place, None, length);
                direction = self.free(&place);
            }
        }
        // Slopes summed over steps carry rounding errors: proofs use newly computed ones.
        self.place(place.x)
    }

    fn free(&self, place: &SearchPlace) -> Vec<f64> {
        self.slopes(place, |slope| slope.free)
    }

    fn chopped(&self, place: &SearchPlace) -> Vec<f64> {
        self.slopes(place, |slope| slope.chopped)
    }

    fn slopes(&self, place: &SearchPlace, part: impl Fn(Slope) -> f64 + Sync) -> Vec<f64> {
        let numbers = place.x.par_iter().zip(&place.slopes).with_min_len(CHUNK);
        numbers.map(|(&x, &slope)| part(slope_at(x, slope, self.high))).collect()
    }

    fn sums(&self, place: &SearchPlace, product: Option<&[f64]>, length: f64) -> Sums {
        let of_chunk = |chunk: usize, (x, slopes): (&[f64], &[f64])| {
            let mut sums = Sums::default();
            for (&x, &slope) in x.iter().zip(slopes) {
                let Slope { free, chopped } = slope_at(x, slope, self.high);
                // The slope, limited to the way to the next bound.
                let reduced = free.clamp((x - self.high) / length, x / length);
                sums.chopped += chopped * chopped;
                sums.reduced += free * reduced;
            }
            if let Some(product) = product {
                let product = &product[chunk * CHUNK..][..x.len()];
                for ((&x, &slope), product) in x.iter().zip(slopes).zip(product) {
                    sums.conjugate += slope_at(x, slope, self.high).free * product;
                }
            }
            sums
        };
        let chunks = place.x.par_chunks(CHUNK).zip(place.slopes.par_chunks(CHUNK)).enumerate();
        let sums: Vec<_> = chunks.map(|(chunk, numbers)| of_chunk(chunk, numbers)).collect();
        // Chunks are added in order: the sum is the same on any number of threads.
        sums.into_iter().fold(Sums::default(), |all, some| Sums {
            chopped: all.chopped + some.chopped,
            reduced: all.reduced + some.reduced,
            conjugate: all.conjugate + some.conjugate,
        })
    }

    /// Returns the slope along a direction downhill, its curvature, and the distance to a bound.
    fn along(&self, place: &SearchPlace, direction: &[f64], product: &[f64]) -> (f64, f64, f64) {
        let of_chunk = |chunk: usize| {
            let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(direction.len());
            let (mut along, mut curvature, mut room) = (0.0, 0.0, f64::INFINITY);
            for k in range {
                along += place.slopes[k] * direction[k];
                curvature += direction[k] * product[k];
                if direction[k] > 0.0 {
                    room = room.min(place.x[k] / direction[k]);
                } else if direction[k] < 0.0 {
                    room = room.min((place.x[k] - self.high) / direction[k]);
                }
            }
            (along, curvature, room)
        };
        let chunks: Vec<_> =
            (0..direction.len().div_ceil(CHUNK)).into_par_iter().map(of_chunk).collect();
        let add = |(a, c, r): (f64, f64, f64), (along, curvature, room): (f64, f64, f64)| {
            (a + along, c + curvature, r.min(room))
        };
        chunks.into_iter().fold((0.0, 0.0, f64::INFINITY), add)
    }

    /// Moves down a direction whose product is known.
    fn walk(&self, place: &mut SearchPlace, direction: &[f64], product: &[f64], length: f64) {
        let numbers = place.x.par_iter_mut().zip(&mut place.slopes);
        let steps = direction.par_iter().zip(product);
        numbers.zip(steps).with_min_len(CHUNK).for_each(|((x, slope), (direction, product))| {
            *x = (*x - length * direction).clamp(0.0, self.high);
            *slope -= length * product;
        });
    }

    /// Moves down the free slopes and stays between the bounds.
    fn project(&self, place: &mut SearchPlace, length: f64) {
        let numbers = place.x.par_iter_mut().zip(&place.slopes).with_min_len(CHUNK);
        numbers.for_each(|(x, &slope)| {
            let free = slope_at(*x, slope, self.high).free;
            *x = (*x - length * free).clamp(0.0, self.high);
        });
        // After a projection, the slopes do not follow from a known product, so they are computed
        // anew. That also clears accumulated rounding errors.
        *place = self.place(std::mem::take(&mut place.x));
    }

    /// Sets the direction to the free slopes, minus the component that is not conjugate to it.
    fn turn(&self, place: &SearchPlace, direction: &mut [f64], turn: f64) {
        let numbers = place.x.par_iter().zip(&place.slopes).zip(direction);
        numbers.with_min_len(CHUNK).for_each(|((&x, &slope), direction)| {
            *direction = slope_at(x, slope, self.high).free - turn * *direction;
        });
    }
}
