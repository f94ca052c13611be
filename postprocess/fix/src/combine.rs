//! Rows combined pixel by pixel, on their transitions.

use lamp_stack::{Op, combine_rows, white_in_row};

/// Returns the row whose pixels have the color of at least two of three rows.
pub(super) fn majority(rows: [&[u32]; 3]) -> Vec<u32> {
    let mut out = Vec::new();
    combine_rows(rows, |[a, b, c]| a & b | b & c | a & c, &mut out);
    out
}

/// Returns the row that is white where two rows differ.
pub(super) fn difference(a: &[u32], b: &[u32]) -> Vec<u32> {
    let mut out = Vec::new();
    Op::Xor.rows(a, b, &mut out);
    out
}

/// Counts the pixels that are white in both of two rows.
pub(super) fn white_in_both(a: &[u32], b: &[u32], width: u32) -> u64 {
    let mut out = Vec::new();
    Op::Intersect.rows(a, b, &mut out);
    white_in_row(&out, width)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn row() -> impl Strategy<Value = Vec<u32>> {
        prop::collection::btree_set(0u32..40, 0..12).prop_map(|row| row.into_iter().collect())
    }

    fn is_white(row: &[u32], column: u32) -> bool {
        row.iter().filter(|&&t| t <= column).count() % 2 == 1
    }

    proptest! {
        #[test]
        fn every_pixel_is_what_its_rows_make_it(a in row(), b in row(), c in row()) {
            let (most, differ) = (majority([&a, &b, &c]), difference(&a, &b));
            prop_assert!(most.is_sorted_by(|a, b| a < b) && differ.is_sorted_by(|a, b| a < b));
            let mut both = 0;
            for column in 0..40 {
                let [a, b, c] = [&a, &b, &c].map(|row| is_white(row, column));
                prop_assert_eq!(is_white(&most, column), [a, b, c].iter().filter(|&&w| w).count() > 1);
                prop_assert_eq!(is_white(&differ, column), a != b);
                both += u64::from(a && b);
            }
            prop_assert_eq!(white_in_both(&a, &b, 40), both);
        }
    }
}
