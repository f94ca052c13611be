//! Inverts small symmetric matrices.

/// Inverts a symmetric matrix; `None` if it is singular to rounding. Rows and
/// columns are scaled first, so that their units do not matter.
pub fn inverse<const N: usize>(matrix: [[f64; N]; N]) -> Option<[[f64; N]; N]> {
    let scale: [f64; N] = std::array::from_fn(|i| matrix[i][i].sqrt());
    if scale.iter().any(|&scale| !(scale > 0.0 && scale.is_finite())) {
        return None;
    }
    let mut left: [[f64; N]; N] =
        std::array::from_fn(|i| std::array::from_fn(|j| matrix[i][j] / (scale[i] * scale[j])));
    let mut right: [[f64; N]; N] =
        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    // Gauss-Jordan elimination: a positive matrix needs no exchange of rows.
    for i in 0..N {
        let pivot = left[i][i];
        // Scaled, the diagonal is one: a pivot that small is what rounding leaves of zero.
        if pivot.is_nan() || pivot < 1e-13 {
            return None;
        }
        for j in 0..N {
            left[i][j] /= pivot;
            right[i][j] /= pivot;
        }
        for row in (0..N).filter(|&row| row != i) {
            let times = left[row][i];
            for j in 0..N {
                left[row][j] -= times * left[i][j];
                right[row][j] -= times * right[i][j];
            }
        }
    }
    Some(std::array::from_fn(|i| std::array::from_fn(|j| right[i][j] / (scale[i] * scale[j]))))
}

/// Returns `matrix` times `vector`.
pub(super) fn product<const N: usize>(matrix: &[[f64; N]; N], vector: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| dot(&matrix[i], vector))
}

/// Returns the dot product of two vectors.
pub(super) fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_times_its_inverse_is_one() {
        let matrix = [[4e6, 2e3, 1.0], [2e3, 9.0, -1e-3], [1.0, -1e-3, 5e-6]];
        let inverse = inverse(matrix).unwrap();
        for i in 0..3 {
            let column = std::array::from_fn(|j| inverse[j][i]);
            let one = product(&matrix, &column);
            for (j, &part) in one.iter().enumerate() {
                let wanted = f64::from(u8::from(i == j));
                let size = (matrix[j][j] / matrix[i][i]).sqrt();
                assert!((part - wanted).abs() < 1e-12 * size.max(1.0), "{one:?}");
            }
        }
    }

    #[test]
    fn a_singular_matrix_has_none() {
        assert_eq!(inverse([[1.0, 2.0], [2.0, 4.0]]), None);
        assert_eq!(inverse([[0.0, 0.0], [0.0, 1.0]]), None);
        assert_eq!(inverse([[f64::NAN, 0.0], [0.0, 1.0]]), None);
    }
}
