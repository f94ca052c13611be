//! Prints the parameters of a calibration with their intervals, as a table.

use lamp_grayscale::calibrate::{Estimate, Measured};
use lamp_grayscale::resin::Quantity;
use lamp_stack::format_significant;

/// The numbers of a calibration, a line each.
pub(super) struct EstimateTable {
    text: String,
}

impl EstimateTable {
    /// Starts with the number of rows that were used, out of all rows. `none` names the rows that
    /// hold no point.
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
/// value have, unless that makes them too long or nothing.
pub(super) fn numbers<T: Quantity>(estimate: &Estimate<T>) -> [String; 3] {
    let [value, low, high] = [estimate.value, estimate.low, estimate.high].map(T::number);
    let shown = short(value);
    let decimals = shown.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    [value, low, high].map(|number| {
        let own = short(number);
        let alike = format!("{number:.decimals$}");
        // With the value's decimals, a much smaller end would be shown as zero.
        let vanishes = number != 0.0 && alike.parse() == Ok(0.0);
        if vanishes || [&own, &shown].iter().any(|text| text.contains('e')) || own == "-" {
            own
        } else {
            alike
        }
    })
}

/// A value and its interval, for the legend of a plot.
pub(super) fn in_legend<T: Quantity>(name: &str, unit: &str, estimate: &Estimate<T>) -> String {
    let [value, low, high] = numbers(estimate);
    format!("{name} {value} {unit} ({low} to {high})")
}

/// A number to five digits, `-` where it has no end.
pub(super) fn short(number: f64) -> String {
    format_significant(number, 5)
}

#[cfg(test)]
mod tests {
    use lamp_grayscale::resin::Dose;

    use super::*;

    #[test]
    fn intervals_have_the_values_decimals_where_that_says_something() {
        let said = |value, low, high| {
            let [value, low, high] = [value, low, high].map(Dose::from_mj_per_cm2);
            numbers(&Estimate { value, low, high })
        };
        assert_eq!(said(131.43, 7.126, 1370.57), ["131.43", "7.13", "1370.57"]);
        assert_eq!(said(131.43, 1e-20, 1e90), ["131.43", "1.0000e-20", "1.0000e90"]);
        assert_eq!(said(1e-9, 0.0, f64::INFINITY), ["1.0000e-9", "0", "-"]);
    }
}
