//! Nonlinear least squares.

use super::matrix::{dot, inverse, product};

/// As [`least_squares`], until nothing but rounding is left to gain.
pub(super) fn fitted<T: Copy, const N: usize>(
    numbers: T,
    squares: impl Fn(&T) -> f64,
    normal: impl Fn(&T) -> ([[f64; N]; N], [f64; N]),
    moved: impl Fn(&T, [f64; N]) -> T,
) -> Option<T> {
    least_squares(numbers, 1e-15, squares, normal, moved)
}

/// Improves the numbers of a curve by Levenberg and Marquardt's method until no step helps by more than
/// a share `gain` of the squares. `squares` returns the sum of squared residuals, infinite where there is
/// no curve; `normal` the products of the derivatives with each other and with the residuals; `moved` the
/// numbers after a step.
///
/// Returns nothing if a step has no solution, or there is no curve to begin with.
pub fn least_squares<T: Copy, const N: usize>(
    mut numbers: T,
    gain: f64,
    squares: impl Fn(&T) -> f64,
    normal: impl Fn(&T) -> ([[f64; N]; N], [f64; N]),
    moved: impl Fn(&T, [f64; N]) -> T,
) -> Option<T> {
    let mut left = squares(&numbers);
    let mut damping = 1e-3;
    let mut equations = normal(&numbers);
    for _ in 0..500 {
        let (mut matrix, vector) = equations;
        for (i, row) in matrix.iter_mut().enumerate() {
            // Marquardt (1963): in shares of the diagonal, damping has no unit.
            row[i] *= 1.0 + damping;
        }
        let Some(inverse) = inverse(matrix) else {
            // A number that does nothing here: shorter steps may lead to where it does.
            if damping > 1e9 {
                break;
            }
            damping *= 10.0;
            continue;
        };
        let step = product(&inverse, &vector);
        // By the equations, the squares fall by at most twice this product.
        if 2.0 * dot(&step, &vector) <= gain * left {
            break;
        }
        let next = moved(&numbers, step);
        let then = squares(&next);
        if then < left {
            let ended = left - then <= gain * left;
            (numbers, left) = (next, then);
            if ended {
                break;
            }
            equations = normal(&numbers);
            // Nearer to Gauss and Newton, which converge fast where the curve is nearly linear.
            damping = (damping / 10.0).max(1e-12);
        } else if damping > 1e9 {
            break;
        } else {
            damping *= 10.0;
        }
    }
    left.is_finite().then_some(numbers)
}
