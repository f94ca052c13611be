//! Ranges of numbers, for people.

/// Formats numbers in order, consecutive numbers as ranges: `3, 7-9`.
pub fn ranges(rows: &[u32]) -> String {
    let text = |run: &[u32]| match run {
        [first, .., last] => format!("{first}-{last}"),
        _ => run[0].to_string(),
    };
    let runs = rows.chunk_by(|a, b| a.checked_add(1) == Some(*b));
    runs.map(text).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_touch_are_one_range() {
        assert_eq!(ranges(&[3, 7, 8, 9, 11, 12]), "3, 7-9, 11-12");
        assert_eq!(ranges(&[u32::MAX]), u32::MAX.to_string());
    }
}
