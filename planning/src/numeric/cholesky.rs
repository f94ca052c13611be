//! Equations of a small positive definite matrix.
//!
//! Source: N. J. Higham, *Accuracy and Stability of Numerical Algorithms*, 2nd ed. (2002), chapter
//! 10: without pivots, since no factor of such a matrix grows.

/// Solves the equations of a symmetric positive definite matrix, given row by row, and leaves its
/// Cholesky factor there.
pub(crate) fn solve_positive(matrix: &mut [f64], mut right: Vec<f64>) -> Vec<f64> {
    let size = right.len();
    for column in 0..size {
        for row in column..size {
            // L Lᵀ = A, column by column.
            let earlier: f64 =
                (0..column).map(|k| matrix[row * size + k] * matrix[column * size + k]).sum();
            let left = matrix[row * size + column] - earlier;
            matrix[row * size + column] =
                if row == column { left.sqrt() } else { left / matrix[column * size + column] };
        }
    }
    for row in 0..size {
        // L y = right, then Lᵀ x = y.
        let known: f64 = (0..row).map(|k| matrix[row * size + k] * right[k]).sum();
        right[row] = (right[row] - known) / matrix[row * size + row];
    }
    for row in (0..size).rev() {
        let known: f64 = (row + 1..size).map(|k| matrix[k * size + row] * right[k]).sum();
        right[row] = (right[row] - known) / matrix[row * size + row];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_of_a_hilbert_matrix_are_solved() {
        let size = 5;
        let hilbert = |k: usize| 1.0 / (k / size + k % size + 1) as f64;
        let matrix: Vec<f64> = (0..size * size).map(hilbert).collect();
        let known = [1.0, -2.0, 3.0, -4.0, 5.0];
        let right = matrix.chunks(size).map(|row| crate::numeric::dot(row, &known)).collect();
        let found = solve_positive(&mut matrix.clone(), right);
        let off = found.iter().zip(known).map(|(found, known)| (found - known).abs());
        assert!(off.fold(0.0, f64::max) < 1e-8, "{found:?}");
    }
}
