//! Checks whether a law's changes shrink the errors of the next prints.
//!
//! If the times change by `L e`, the errors `e` become `(I - G L) e`. The spectral radius of that
//! matrix gives their long-run decay; its 2-norm shows whether they may grow first. Errors are
//! counted in voxels.

use super::law::Law;
use super::response::Response;

/// How a law's errors shrink from print to print.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Convergence {
    /// The spectral radius of `I - G L`: the factor by which errors shrink with each print in the
    /// long run.
    pub radius: f64,
    /// Its 2-norm: the largest factor between the errors of a print and the errors of the print
    /// before.
    pub norm: f64,
}

impl Convergence {
    /// Returns whether errors may grow from a print to the next. Layers that no light changes have
    /// a norm of 1, up to rounding.
    pub fn may_grow(&self) -> bool {
        self.norm > 1.0 + 1e-6
    }
}

/// The number of times that the matrix is applied for its norm.
const NORM_ROUNDS: usize = 200;
/// The number of times that it is applied before, and during, the measurement of the radius.
const RADIUS_ROUNDS: [usize; 2] = [400, 400];

/// Returns the decay of a law's errors under a response. The law of several layers depends on the
/// signs of the present `errors`.
pub fn convergence(law: &Law, errors: &[f64], response: &Response) -> Convergence {
    let shrink = Shrink::new(law, errors, response);
    let radius = match law {
        // The matrix is triangular: its eigenvalues are on its diagonal.
        Law::Single { gain } => {
            // A layer's time changes its own layer and those below, never one above.
            let own = response.per_second().into_iter().map(|voxels| (1.0 - gain * voxels).abs());
            own.fold(0.0, f64::max)
        }
        Law::Multi(_) => shrink.radius(),
    };
    Convergence { radius, norm: shrink.norm(1.0) }
}

/// Returns the factor by which a law's gains may be multiplied before errors may grow, up to a
/// thousand. It is zero if any gain lets them grow.
pub fn largest_safe_gain(law: &Law, errors: &[f64], response: &Response) -> f64 {
    let shrink = Shrink::new(law, errors, response);
    let safe = |gain: f64| shrink.norm(gain) <= 1.0 + 1e-6;
    // The norm is a convex function of the gain, and 1 at zero.
    let (mut low, mut high) = (0.0, 1e3);
    if safe(high) {
        return high;
    }
    for _ in 0..60 {
        // Quarters first: safe gains may be orders of magnitude smaller.
        let middle = if low == 0.0 { high / 4.0 } else { 0.5 * (low + high) };
        *(if safe(middle) { &mut low } else { &mut high }) = middle;
        if high < 1e-9 {
            return 0.0;
        }
        if high - low < 1e-3 * high {
            break;
        }
    }
    low
}

/// The matrix `G L`, row by row.
struct Shrink {
    size: usize,
    rows: Vec<f64>,
}

impl Shrink {
    fn new(law: &Law, errors: &[f64], response: &Response) -> Self {
        let size = errors.len();
        let mut rows = vec![0.0; size * size];
        for column in 0..size {
            let mut unit = vec![0.0; size];
            unit[column] = 1.0;
            let cured = response.apply(&law.linear(&unit, errors));
            for (row, cured) in cured.into_iter().enumerate() {
                rows[row * size + column] = cured;
            }
        }
        Self { size, rows }
    }

    /// Returns `(I - gain G L) x`.
    fn apply(&self, gain: f64, x: &[f64]) -> Vec<f64> {
        let row = |(row, x_row): (&[f64], &f64)| {
            x_row - gain * row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>()
        };
        self.rows.chunks_exact(self.size).zip(x).map(row).collect()
    }

    /// Returns `(I - gain G L)ᵀ x`.
    fn transposed(&self, gain: f64, x: &[f64]) -> Vec<f64> {
        let mut sums = x.to_vec();
        for (row, x) in self.rows.chunks_exact(self.size).zip(x) {
            sums.iter_mut().zip(row).for_each(|(sum, a)| *sum -= gain * x * a);
        }
        sums
    }

    fn norm(&self, gain: f64) -> f64 {
        let mut x = start(self.size);
        let mut square = 0.0;
        for _ in 0..NORM_ROUNDS {
            // Power iteration on MᵀM, whose greatest eigenvalue is the squared norm.
            x = self.transposed(gain, &self.apply(gain, &x));
            let next = length(&x);
            if next == 0.0 {
                return 0.0;
            }
            x.iter_mut().for_each(|x| *x /= next);
            if (next - square).abs() < 1e-10 * next {
                break;
            }
            square = next;
        }
        square.sqrt()
    }

    /// Returns the mean growth of a vector, after many rounds.
    fn radius(&self) -> f64 {
        let mut x = start(self.size);
        let mut growth = 0.0;
        let [before, while_read] = RADIUS_ROUNDS;
        for round in 0..before + while_read {
            x = self.apply(1.0, &x);
            let next = length(&x);
            if next == 0.0 {
                return 0.0;
            }
            x.iter_mut().for_each(|x| *x /= next);
            if round >= before {
                // A pair of complex eigenvalues makes the length oscillate, but not the mean of its
                // logarithm.
                growth += next.ln();
            }
        }
        (growth / while_read as f64).exp()
    }
}

/// A vector that is unlikely to be orthogonal to any matrix's leading direction.
fn start(size: usize) -> Vec<f64> {
    let x: Vec<_> = (0..size).map(|k| 1.0 + (k as f64 * 0.754_877_666).fract()).collect();
    let length = length(&x);
    // Alternating signs make fast changes from layer to layer show as soon as slow ones.
    let signed = |(k, x): (usize, f64)| if k % 3 == 0 { -x / length } else { x / length };
    x.into_iter().enumerate().map(signed).collect()
}

fn length(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}
