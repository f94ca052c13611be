//! Finds the least value of a quadratic function between bounds.
//!
//! Where all curvatures are known to be above zero, accelerated projected gradients take fewer steps:
//! their number grows with the root of the greatest curvature over the least. Where nothing is known,
//! conjugate gradients do better if few numbers are at their bounds.

mod accelerated;
mod proportioned;

use rayon::prelude::*;

/// The numbers that a thread takes at a time. Sums are added chunk by chunk in order, so that the
/// number of threads changes no bit.
const CHUNK: usize = 1 << 13;

/// A matrix that is symmetric and has no negative eigenvalue, as a product.
pub(crate) trait CurvatureMatrix: Sync {
    /// Returns the product with numbers.
    fn apply(&self, numbers: &[f64]) -> Vec<f64>;

    /// Returns a number that no eigenvalue is below.
    fn least(&self) -> f64 {
        0.0
    }
}

/// The least value of `x A x / 2 - b x` for `x` between zero and a bound.
pub(crate) struct Bounded<'a, C> {
    pub(crate) curvature: &'a C,
    /// b: the slopes at zero, negated.
    pub(crate) pull: &'a [f64],
    pub(crate) high: f64,
}

/// Where a search stands: the numbers, and the slopes there.
#[derive(Clone)]
pub(crate) struct SearchPlace {
    pub(crate) x: Vec<f64>,
    pub(crate) slopes: Vec<f64>,
}

impl SearchPlace {
    /// Returns how much smaller the value can be anywhere between zero and `high`, at most, for a
    /// function whose curvatures are all `least` or more.
    ///
    /// Such a function lies above `value + slopes (y - x) + least |y - x|² / 2` for all y. Where `least`
    /// is zero, this is the gap of M. Frank and P. Wolfe, Nav. Res. Logist. Q. 3 (1956).
    pub(crate) fn gap(&self, high: f64, least: f64) -> f64 {
        let of_chunk = |(x, slopes): (&[f64], &[f64])| -> f64 {
            let falls = x.iter().zip(slopes).map(|(&x, &slope)| {
                // The parabola is least where its slope is zero, or at the end nearest to there.
                let to = if slope == 0.0 { x } else { (x - slope / least).clamp(0.0, high) };
                let way = to - x;
                -way * (slope + 0.5 * least * way)
            });
            falls.sum()
        };
        let chunks = self.x.par_chunks(CHUNK).zip(self.slopes.par_chunks(CHUNK));
        chunks.map(of_chunk).collect::<Vec<_>>().into_iter().sum()
    }
}

impl<C: CurvatureMatrix> Bounded<'_, C> {
    /// Searches from `x` until `is_done` returns true. It is called at every `look`th step with the
    /// number of steps so far. A step takes one or two products.
    pub(crate) fn search(
        &self,
        x: Vec<f64>,
        look: usize,
        is_done: impl FnMut(&SearchPlace, usize) -> bool,
    ) -> SearchPlace {
        if self.curvature.least() > 0.0 {
            self.accelerate(x, look, is_done)
        } else {
            self.proportion(x, look, is_done)
        }
    }

    /// Returns the slopes at `x`.
    pub(crate) fn place(&self, x: Vec<f64>) -> SearchPlace {
        let slopes = self.slopes_at(&x);
        SearchPlace { x, slopes }
    }

    fn slopes_at(&self, x: &[f64]) -> Vec<f64> {
        let mut slopes = self.curvature.apply(x);
        slopes.iter_mut().zip(self.pull).for_each(|(slope, pull)| *slope -= pull);
        slopes
    }

    /// Returns a bound on the greatest eigenvalue: no number of the matrix is negative.
    fn greatest(&self) -> f64 {
        // The greatest sum of a row bounds the greatest eigenvalue (Gershgorin).
        let sums = self.curvature.apply(&vec![1.0; self.pull.len()]);
        sums.into_iter().fold(f64::MIN_POSITIVE, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::numeric::{dot, solve_positive};

    /// A matrix of a few numbers, row by row.
    struct Small {
        rows: Vec<Vec<f64>>,
        least: f64,
    }

    impl CurvatureMatrix for Small {
        fn apply(&self, numbers: &[f64]) -> Vec<f64> {
            self.rows.iter().map(|row| dot(row, numbers)).collect()
        }

        fn least(&self) -> f64 {
            self.least
        }
    }

    fn one(curvature: f64, least: f64) -> Small {
        Small { rows: vec![vec![curvature]], least }
    }

    #[test]
    fn a_search_may_go_on_where_nothing_is_left() {
        for k in 1..200 {
            let pull = [f64::from(k % 17) + 0.1];
            let least = (pull[0] * f64::from(k)).min(1e3);
            for known in [0.0, 0.5, 1.0] {
                let curvature = one(1.0 / f64::from(k), known / f64::from(k));
                let problem = Bounded { curvature: &curvature, pull: &pull, high: 1e3 };
                let place = problem.search(vec![0.0], 50, |_, step| step >= 50);
                assert!((place.x[0] / least - 1.0).abs() < 1e-12, "{k}: {:?} {least}", place.x);
            }
        }
    }

    /// The least value of any choice of numbers at zero, at the bound, and between.
    fn by_choices(matrix: &Small, pull: &[f64], high: f64) -> f64 {
        let count = pull.len();
        let value = |x: &[f64]| 0.5 * dot(x, &matrix.apply(x)) - dot(x, pull);
        let mut best = f64::INFINITY;
        for choice in 0..3_usize.pow(count as u32) {
            let of = |k: usize| choice / 3_usize.pow(k as u32) % 3;
            let mut x: Vec<_> = (0..count).map(|k| if of(k) == 1 { high } else { 0.0 }).collect();
            let free: Vec<_> = (0..count).filter(|&k| of(k) == 2).collect();
            let slopes = matrix.apply(&x);
            let right = free.iter().map(|&k| pull[k] - slopes[k]).collect();
            let mut part: Vec<_> = free
                .iter()
                .flat_map(|&i| free.iter().map(move |&j| (i, j)))
                .collect::<Vec<_>>()
                .into_iter()
                .map(|(i, j)| matrix.rows[i][j])
                .collect();
            let found = solve_positive(&mut part, right);
            free.iter().zip(found).for_each(|(&k, found)| x[k] = found);
            if x.iter().all(|x| (0.0..=high).contains(x)) {
                best = best.min(value(&x));
            }
        }
        best
    }

    proptest! {
        #[test]
        fn the_least_of_all_choices_is_found(
            numbers in prop::collection::vec(0.0..1.0, 36),
            pull in prop::collection::vec(-1.0..2.0, 6),
            even in prop::sample::select(vec![1e-2, 0.3]),
            high in 0.05..3.0,
        ) {
            let rows: Vec<_> = numbers.chunks(6).collect();
            let entry = |i: usize, j: usize| {
                dot(rows[i], rows[j]) + if i == j { even } else { 0.0 }
            };
            let rows = (0..6).map(|i| (0..6).map(|j| entry(i, j)).collect()).collect();
            let least = by_choices(&Small { rows, least: 0.0 }, &pull, high);
            let rows = (0..6).map(|i| (0..6).map(|j| entry(i, j)).collect()).collect();
            for (known, accelerated) in [(0.0, false), (0.0, true), (even, true)] {
                let matrix = Small { rows: Vec::clone(&rows), least: known };
                let problem = Bounded { curvature: &matrix, pull: &pull, high };
                let value = |place: &SearchPlace| {
                    place.x.iter().zip(&place.slopes).zip(&pull)
                        .map(|((x, slope), pull)| 0.5 * x * (slope - pull)).sum::<f64>()
                };
                let mut looks = 0;
                let is_done = |place: &SearchPlace, step: usize| {
                    looks += 1;
                    // The bound holds wherever the search stands.
                    let off = value(place) - least;
                    let gap = place.gap(high, known);
                    assert!(off <= gap + 1e-12, "{off:e} is above the gap {gap:e}");
                    assert!(gap <= place.gap(high, 0.0) + 1e-12);
                    gap < 1e-10 || step > 20_000
                };
                let found = match accelerated {
                    true => problem.accelerate(vec![0.0; 6], 1, is_done),
                    false => problem.proportion(vec![0.0; 6], 1, is_done),
                };
                let off = value(&found) - least;
                prop_assert!(off.abs() < 1e-9, "{off:e} after {looks} looks");
            }
        }
    }
}
