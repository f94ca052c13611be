//! The majority of three rows.

/// Makes `out` the row whose every pixel has the colour that at least two of
/// three rows have there.
pub(crate) fn majority(mut rows: [&[u32]; 3], out: &mut Vec<u32>) {
    out.clear();
    let mut colours = [false; 3];
    let mut white = false;
    while let Some(column) = rows.iter().filter_map(|row| row.first().copied()).min() {
        for (row, colour) in rows.iter_mut().zip(&mut colours) {
            if row.first() == Some(&column) {
                *row = &row[1..];
                *colour = !*colour;
            }
        }
        let [a, b, c] = colours;
        if white != (a & b | b & c | a & c) {
            white = !white;
            out.push(column);
        }
    }
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
        fn two_of_three_decide_each_pixel(a in row(), b in row(), c in row()) {
            let mut out = Vec::new();
            majority([&a, &b, &c], &mut out);
            prop_assert!(out.is_sorted_by(|a, b| a < b));
            for column in 0..40 {
                let votes = [&a, &b, &c].iter().filter(|row| is_white(row, column)).count();
                prop_assert_eq!(is_white(&out, column), votes >= 2);
            }
        }
    }
}
