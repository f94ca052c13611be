//! Rounds numbers to the digits that say something.

/// Writes a number to `digits` significant digits, with an exponent if it would be long
/// otherwise, or `-` if it is not finite.
pub fn format_significant(number: f64, digits: usize) -> String {
    if !number.is_finite() {
        return "-".to_owned();
    }
    let decimals = digits.saturating_sub(1);
    let text = format!("{number:.decimals$e}");
    // Taken from the rounded text: 99.9999 has three digits before the point.
    let exponent: i32 = text.split('e').nth(1).and_then(|e| e.parse().ok()).unwrap_or(0);
    match exponent {
        // Zero has no significant digits, and -0 is zero.
        _ if number == 0.0 => "0".to_owned(),
        -4..7 => format!("{number:.*}", (decimals as i32 - exponent).max(0) as usize),
        _ => text,
    }
}

/// Rounds a number to `digits` significant digits.
///
/// # Panics
/// Panics if there is no digit.
pub fn round_significant(number: f64, digits: usize) -> f64 {
    let text = format!("{number:.*e}", digits - 1);
    text.parse().expect("a written number reads back")
}

/// Rounds millimeters to the nanometer, for more digits say nothing. Adding zero turns -0 into 0.
pub fn to_nm(mm: f64) -> f64 {
    (mm * 1e6).round() / 1e6 + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_their_digits_and_no_tails() {
        for (number, text) in [
            (131.512_345, "131.51"),
            (0.081_234_56, "0.081235"),
            (99.999_999, "100.00"),
            (5_000_000.4, "5000000"),
            (-2.0, "-2.0000"),
            (0.0, "0"),
            (1e-300, "1.0000e-300"),
            (-1.234_56e92, "-1.2346e92"),
            (f64::INFINITY, "-"),
        ] {
            assert_eq!(format_significant(number, 5), text);
        }
        assert_eq!(round_significant(131.512_345, 6), 131.512);
    }
}
