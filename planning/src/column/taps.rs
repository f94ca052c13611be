//! How mirrors light column voxels along one axis, as matrices with a few numbers in each row.

/// A matrix whose rows hold a few numbers side by side.
///
/// # Guarantees
/// Every row has its numbers within the columns.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Taps {
    columns: usize,
    /// The numbers in each row.
    width: usize,
    /// The column where the numbers of each row begin.
    first: Vec<usize>,
    weights: Vec<f64>,
}

impl Taps {
    /// Creates the matrix from the entries of its rows: column and number, in any order.
    pub(super) fn new(columns: usize, rows: &[Vec<(usize, f64)>]) -> Self {
        let ends = |row: &Vec<(usize, f64)>| {
            let columns =
                row.iter().filter(|(_, weight)| *weight != 0.0).map(|(column, _)| *column);
            columns.clone().min().zip(columns.max())
        };
        let ends: Vec<_> = rows.iter().map(ends).collect();
        let width = ends.iter().flatten().map(|(first, last)| last - first + 1).max();
        let width = width.unwrap_or(1).min(columns);
        let begin = |ends: &Option<(usize, usize)>| ends.map_or(0, |(first, _)| first);
        let first: Vec<_> = ends.iter().map(|ends| begin(ends).min(columns - width)).collect();
        let mut weights = vec![0.0; width * rows.len()];
        for ((row, &first), weights) in rows.iter().zip(&first).zip(weights.chunks_mut(width)) {
            for &(column, weight) in row.iter().filter(|(_, weight)| *weight != 0.0) {
                // Entries of one column add up, for example when several rays hit one voxel.
                weights[column - first] += weight;
            }
        }
        Self { columns, width, first, weights }
    }

    pub(super) fn rows(&self) -> usize {
        self.first.len()
    }

    pub(super) fn columns(&self) -> usize {
        self.columns
    }

    /// Returns a row's numbers, and the column of the first.
    pub(super) fn row(&self, row: usize) -> (usize, &[f64]) {
        (self.first[row], &self.weights[row * self.width..][..self.width])
    }

    /// Returns the columns of a row whose numbers are not zero.
    fn entries(&self, row: usize) -> impl Iterator<Item = (usize, f64)> {
        let (first, weights) = self.row(row);
        (first..).zip(weights.iter().copied()).filter(|(_, weight)| *weight != 0.0)
    }

    pub(super) fn transposed(&self) -> Self {
        let mut rows = vec![Vec::new(); self.columns];
        for row in 0..self.rows() {
            self.entries(row).for_each(|(column, weight)| rows[column].push((row, weight)));
        }
        Self::new(self.rows(), &rows)
    }

    /// Returns the product of the matrix's transpose with itself.
    pub(super) fn normal(&self) -> Self {
        let mut rows = vec![Vec::new(); self.columns];
        for row in 0..self.rows() {
            for (column, weight) in self.entries(row) {
                rows[column].extend(self.entries(row).map(|(other, too)| (other, weight * too)));
            }
        }
        Self::new(self.columns, &rows)
    }

    /// Returns the mean of matrices of one size.
    pub(super) fn mean(matrices: &[Self]) -> Self {
        let share = 1.0 / matrices.len() as f64;
        let row = |row| {
            let entries = matrices.iter().flat_map(move |matrix| matrix.entries(row));
            entries.map(|(column, weight)| (column, share * weight)).collect()
        };
        let rows: Vec<Vec<_>> = (0..matrices[0].rows()).map(row).collect();
        Self::new(matrices[0].columns, &rows)
    }

    /// Returns the sum of each row.
    pub(super) fn row_sums(&self) -> Vec<f64> {
        self.weights.chunks(self.width).map(|row| row.iter().sum()).collect()
    }

    /// Writes the product with several lines at once. Number `lane` of each array belongs to one line,
    /// so that a processor multiplies for many lines at a time. Every line's sum is added in the order
    /// of its columns.
    #[inline]
    pub(super) fn apply<const LANES: usize>(
        &self,
        lines: &[[f64; LANES]],
        out: &mut [[f64; LANES]],
    ) {
        let rows = self.first.iter().zip(self.weights.chunks_exact(self.width));
        for (out, (&first, weights)) in out.iter_mut().zip(rows) {
            let mut sums = [0.0; LANES];
            for (line, &weight) in lines[first..first + self.width].iter().zip(weights) {
                sums.iter_mut().zip(line).for_each(|(sum, at)| *sum += weight * at);
            }
            *out = sums;
        }
    }

    /// Writes row `row` of the product with an image whose lines have `out.len()` numbers.
    #[inline]
    pub(super) fn apply_across(&self, row: usize, image: &[f64], out: &mut [f64]) {
        let length = out.len();
        out.fill(0.0);
        let (first, weights) = self.row(row);
        let image = &image[first * length..(first + self.width) * length];
        // Four lines at a time: sums are read and written a quarter as often, and added in order.
        let (fours, rest) = weights.as_chunks::<4>();
        let (lines, last_lines) = image.split_at(4 * fours.len() * length);
        for (lines, weights) in lines.chunks_exact(4 * length).zip(fours) {
            // Weights of zero would cost a pass over the lines for nothing.
            if *weights == [0.0; 4] {
                continue;
            }
            let [a, b, c, d] = *weights;
            let (low, high) = lines.split_at(2 * length);
            let lines = low[..length].iter().zip(&low[length..]);
            let lines = lines.zip(high[..length].iter().zip(&high[length..]));
            for (out, ((at_a, at_b), (at_c, at_d))) in out.iter_mut().zip(lines) {
                *out = *out + a * at_a + b * at_b + c * at_c + d * at_d;
            }
        }
        for (line, &weight) in last_lines.chunks_exact(length).zip(rest) {
            if weight != 0.0 {
                out.iter_mut().zip(line).for_each(|(out, at)| *out += weight * at);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn dense(taps: &Taps) -> Vec<Vec<f64>> {
        let row = |row| {
            let mut dense = vec![0.0; taps.columns()];
            taps.entries(row).for_each(|(column, weight)| dense[column] = weight);
            dense
        };
        (0..taps.rows()).map(row).collect()
    }

    /// A matrix of up to 9 x 9 whole numbers.
    fn any_taps() -> impl Strategy<Value = Taps> {
        (1_usize..10).prop_flat_map(|columns| {
            let entries = prop::collection::vec((0..columns, 0_i32..9), 0..6);
            let row = entries.prop_map(|row| row.into_iter().map(|(at, w)| (at, f64::from(w))));
            let rows = prop::collection::vec(row.prop_map(Iterator::collect), 1..10);
            rows.prop_map(move |rows: Vec<Vec<_>>| Taps::new(columns, &rows))
        })
    }

    proptest! {
        #[test]
        fn products_are_those_of_matrices(taps in any_taps()) {
            let full = dense(&taps);
            let line: Vec<_> = (0..taps.columns()).map(|k| (k * k) as f64 - 7.0).collect();
            let lines: Vec<_> = line.iter().map(|at| [*at, at + 1.0, 3.0 * at]).collect();
            let mut out = vec![[f64::NAN; 3]; taps.rows()];
            taps.apply(&lines, &mut out);
            let image = lines.as_flattened();
            for (row, full) in full.iter().enumerate() {
                let mut across = [f64::NAN; 3];
                taps.apply_across(row, image, &mut across);
                for lane in 0..3 {
                    let sum: f64 = full.iter().zip(&lines).map(|(a, b)| a * b[lane]).sum();
                    prop_assert_eq!(sum, out[row][lane]);
                    prop_assert_eq!(sum, across[lane]);
                }
            }
            let transposed = dense(&taps.transposed());
            let normal = dense(&taps.normal());
            for i in 0..taps.columns() {
                for j in 0..taps.columns() {
                    let sum: f64 = full.iter().map(|row| row[i] * row[j]).sum();
                    prop_assert_eq!(normal[i][j], sum);
                }
                for (row, full) in full.iter().enumerate() {
                    prop_assert_eq!(transposed[i][row], full[i]);
                }
            }
        }
    }
}
