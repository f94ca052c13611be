//! Accelerated projected gradients.
//!
//! Sources: A. Beck and M. Teboulle, *A fast iterative shrinkage-thresholding algorithm for linear
//! inverse problems*, SIAM J. Imaging Sci. 2 (2009), section 4; Yu. Nesterov, *Introductory lectures
//! on convex optimization* (2004), scheme 2.2.11: the momentum where curvatures have a least value;
//! B. O'Donoghue and E. Candès, *Adaptive restart for accelerated gradient schemes*, Found. Comput.
//! Math. 15 (2015), section 3.2.

use rayon::prelude::*;

use super::{Bounded, CHUNK, CurvatureMatrix, SearchPlace};

impl<C: CurvatureMatrix> Bounded<'_, C> {
    /// Searches with momentum, as [`Self::search`] does. A step takes one product.
    pub(crate) fn accelerate(
        &self,
        x: Vec<f64>,
        look: usize,
        mut is_done: impl FnMut(&SearchPlace, usize) -> bool,
    ) -> SearchPlace {
        let greatest = self.greatest();
        let share = (self.curvature.least() / greatest).sqrt();
        let mut place = self.place(x);
        let mut last = place.clone();
        let mut momentum = 0.0;
        let mut since_restart = 0.0;
        for step in 0_usize.. {
            if step % look == 0 && is_done(&place, step) {
                break;
            }
            let Advance { turns, moves } = self.advance(&place, &mut last, momentum, greatest);
            std::mem::swap(&mut place, &mut last);
            if moves == 0.0 && momentum == 0.0 {
                // A step of steepest descent that changes nothing: this is the least value.
                break;
            }
            place.slopes = self.slopes_at(&place.x);
            // Momentum that leads uphill is dropped.
            let leads_down = turns <= 0.0;
            since_restart = if leads_down { since_restart + 1.0 } else { 0.0 };
            momentum = if share == 0.0 {
                since_restart / (since_restart + 3.0)
            } else if leads_down {
                (1.0 - share) / (1.0 + share)
            } else {
                0.0
            };
        }
        place
    }

    /// Replaces `last` by the next numbers: a step of steepest descent from where `momentum` leads.
    fn advance(
        &self,
        place: &SearchPlace,
        last: &mut SearchPlace,
        momentum: f64,
        greatest: f64,
    ) -> Advance {
        let here = place.x.par_chunks(CHUNK).zip(place.slopes.par_chunks(CHUNK));
        let last = last.x.par_chunks_mut(CHUNK).zip(last.slopes.par_chunks(CHUNK));
        let chunks = here.zip(last).map(|((x, slopes), (last, last_slopes))| {
            let mut advance = Advance::default();
            let slopes = slopes.iter().zip(last_slopes);
            for ((&x, last), (&slope, &last_slope)) in x.iter().zip(last).zip(slopes) {
                // The function is quadratic, so slopes there follow from known ones.
                let from = x + momentum * (x - *last);
                let slope = slope + momentum * (slope - last_slope);
                let to = (from - slope / greatest).clamp(0.0, self.high);
                let way = to - x;
                advance.turns += (from - to) * way;
                advance.moves += way * way;
                *last = to;
            }
            advance
        });
        // Chunks are added in order: the sum is the same on any number of threads.
        chunks.collect::<Vec<_>>().into_iter().fold(Advance::default(), |all, some| Advance {
            turns: all.turns + some.turns,
            moves: all.moves + some.moves,
        })
    }
}

/// Sums over the numbers of a step.
#[derive(Clone, Copy, Default)]
struct Advance {
    /// The descent's step back times the way from the last numbers: above zero, the two are opposed.
    turns: f64,
    /// The square of the way from the last numbers.
    moves: f64,
}
