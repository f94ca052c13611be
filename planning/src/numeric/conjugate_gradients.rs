//! Equations of a large matrix that is given by its products.
//!
//! Source: M. R. Hestenes and E. Stiefel, *Methods of conjugate gradients for solving linear
//! systems*, J. Res. Natl. Bur. Stand. 49 (1952), section 3.

use super::{add_times, dot};

/// The search ends when squared residuals fall to this share of the first: rounding errors of
/// 64-bit numbers leave little less.
const LEFT: f64 = 1e-22;
/// Steps for each number. Without rounding, one would be enough (Hestenes and Stiefel, theorem
/// 4:1).
const STEPS: usize = 4;

/// Solves `A x = right` for a symmetric positive matrix, where `apply` returns its product with
/// numbers.
pub(crate) fn solve_by_conjugate_gradients(
    apply: impl Fn(&[f64]) -> Vec<f64>,
    right: Vec<f64>,
) -> Vec<f64> {
    let mut left = right;
    let mut x = vec![0.0; left.len()];
    let mut along = left.clone();
    let mut square = dot(&left, &left);
    let enough = square * LEFT;
    for _ in 0..STEPS * x.len() {
        if square <= enough {
            break;
        }
        let turned = apply(&along);
        let length = square / dot(&along, &turned);
        add_times(&mut x, length, &along);
        add_times(&mut left, -length, &turned);
        let next = dot(&left, &left);
        along.iter_mut().zip(&left).for_each(|(a, left)| *a = left + next / square * *a);
        square = next;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_of_a_chain_are_solved() {
        // Each number against its neighbors, as in diffusion.
        let apply = |x: &[f64]| -> Vec<f64> {
            let at = |k: Option<usize>| k.and_then(|k| x.get(k)).unwrap_or(&0.0);
            (0..x.len()).map(|k| 2.1 * x[k] - at(k.checked_sub(1)) - at(Some(k + 1))).collect()
        };
        let known: Vec<f64> = (0..60).map(|k| f64::from(k * 37 % 11) - 5.0).collect();
        let found = solve_by_conjugate_gradients(apply, apply(&known));
        let off = found.iter().zip(&known).map(|(found, known)| (found - known).abs());
        assert!(off.fold(0.0, f64::max) < 1e-9, "{found:?}");
    }
}
