//! Adds up the gaps between cost and bound of all blocks during the search.

use crate::solver::SearchProgress;
use crate::voxels::outcome::GapAt;

/// The gaps between cost and bound of blocks, added up.
#[derive(Default)]
pub(crate) struct SearchSums {
    /// The sum of gaps at each check of the blocks that were not done before.
    gaps: Vec<f64>,
    /// The gap that finished blocks have left, from the next check on.
    left: Vec<f64>,
    iterations: Vec<usize>,
    unplanned: f64,
}

impl SearchSums {
    pub(crate) fn add(&mut self, progress: &[SearchProgress], unplanned: f64) {
        self.unplanned += unplanned;
        for (look, now) in progress.iter().enumerate() {
            if look == self.gaps.len() {
                self.gaps.push(0.0);
                self.left.push(0.0);
                self.iterations.push(now.iteration);
            }
            self.gaps[look] += now.cost - now.bound;
        }
        if let Some(end) = progress.last() {
            self.left[progress.len() - 1] += end.cost - end.bound;
        }
    }

    pub(crate) fn shares(&self) -> Vec<GapAt> {
        let mut left = 0.0;
        let looks = self.gaps.iter().zip(&self.left).zip(&self.iterations);
        let share = |((gap, done), &iteration): ((&f64, &f64), &usize)| {
            // Blocks end after different numbers of checks. A finished block still counts with its
            // last gap.
            let all = gap + left;
            left += done;
            GapAt { iteration, gap: if self.unplanned > 0.0 { all / self.unplanned } else { 0.0 } }
        };
        looks.map(share).collect()
    }
}
