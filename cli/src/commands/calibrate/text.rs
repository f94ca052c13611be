//! The table that calibrations print.

use lamp_grayscale::calibrate::{Estimate, Measured, Quantity};

/// The numbers of a calibration, a line each.
pub(super) struct Text {
    text: String,
}

impl Text {
    /// Starts with how many rows were used of those that are there. `none` says what
    /// the others are that hold no point.
    pub(super) fn new<T>(measured: &Measured<T>, none: &str) -> Self {
        let Measured { points, none: without, blank } = measured;
        let points = points.len();
        let rows = points + without + blank;
        let text =
            format!("{points} points of {rows} rows ({without} {none}, {blank} blank left out)\n");
        Self { text }
    }

    /// Adds a line of texts, the first to the left and the others to the right of
    /// their columns.
    pub(super) fn line(&mut self, first: &str, others: &[&str]) {
        let mut line = format!("{first:<26}");
        for other in others {
            line += &format!("{other:>12}");
        }
        self.text += line.trim_end();
        self.text.push('\n');
    }

    /// Adds the heads of the columns of estimates.
    pub(super) fn heads(&mut self) {
        self.line("", &["value", "95% from", "to"]);
    }

    /// Adds a number with its interval.
    pub(super) fn estimate<T: Quantity>(&mut self, name: &str, estimate: &Estimate<T>) {
        let [value, low, high] = numbers(estimate);
        self.line(name, &[&value, &low, &high]);
    }

    pub(super) fn finish(self) -> String {
        self.text
    }
}

/// A value and its interval, in words: with the decimals that five digits of the
/// value have.
pub(super) fn numbers<T: Quantity>(estimate: &Estimate<T>) -> [String; 3] {
    let [value, low, high] = [estimate.value, estimate.low, estimate.high].map(T::number);
    [value, low, high].map(|number| with_decimals(number, decimals(value)))
}

/// A value and its interval, for the legend of a plot.
pub(super) fn in_legend<T: Quantity>(name: &str, unit: &str, estimate: &Estimate<T>) -> String {
    let [value, low, high] = numbers(estimate);
    format!("{name} {value} {unit} ({low} to {high})")
}

/// A number to five digits, `-` where it has no end.
pub(super) fn short(number: f64) -> String {
    with_decimals(number, decimals(number))
}

fn with_decimals(number: f64, decimals: usize) -> String {
    if number.is_finite() { format!("{number:.decimals$}") } else { "-".to_owned() }
}

/// How many decimals a number of five digits has.
fn decimals(number: f64) -> usize {
    // Rounded first: 99.9999 has three digits before the point.
    let rounded: f64 = format!("{number:.4e}").parse().unwrap_or(0.0);
    if rounded == 0.0 || !rounded.is_finite() {
        return 0;
    }
    (4 - rounded.abs().log10().floor() as i32).clamp(0, 8) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_five_digits() {
        for (number, text) in [
            (131.512_345, "131.51"),
            (0.081_234_56, "0.081235"),
            (99.999_999, "100.00"),
            (5_000_000.4, "5000000"),
            (-2.0, "-2.0000"),
            (0.0, "0"),
            (f64::INFINITY, "-"),
        ] {
            assert_eq!(short(number), text);
        }
    }
}
