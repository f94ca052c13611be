//! Prints the parameters of a calibration with their intervals, as a table.

use lamp_grayscale::calibrate::{Estimate, Measured};
use lamp_grayscale::resin::Quantity;
use lamp_stack::format_significant;
use serde::Serialize;

use crate::exit::Exit;
use crate::output::json_report::{ReportTo, schemas, write_answer};
use crate::streams::print;

/// The numbers of a calibration: a table with a line each, and an answer.
pub(super) struct EstimateTable {
    text: String,
    answer: CalibrateAnswer,
    /// The characters of the column of names.
    names: usize,
}

/// The numbers that a calibration fitted, by `lamp calibrate ... --report FILE`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct CalibrateAnswer {
    /// Name of the measurements, as given.
    input: String,
    /// The fitted model: `jacobs`, `two-depth`, `gray`, `width`, `lamp`, `scan`, `spread`, `gamma`, `kinetics`,
    /// `composition` or `projector`.
    model: &'static str,
    /// Rows, or pixels of a picture, that were used.
    points: usize,
    /// Rows with nothing left to measure: films that did not cure, squares that were washed away, gaps
    /// that closed.
    without_measure: usize,
    /// Rows without a measurement.
    blank: usize,
    /// Share of the scatter that the model explains, of all points; null with models of single sizes,
    /// profiles and kinetics, and with laws, whose parameters have it for depths and widths.
    r2: Option<f64>,
    /// The parameters of the model.
    parameters: Vec<Parameter>,
    /// Points of one gray level, light, size or composition, with numbers of their own.
    groups: Vec<Group>,
}

/// A fitted number with its 95% confidence interval.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Parameter {
    /// Its name, as the table has it, such as `Ec`.
    name: String,
    /// Its unit, such as `mJ/cm2`. A rise is from black to white, for each W/cm2 of a lamp, or, in a
    /// law, for each unit of its quantity.
    unit: &'static str,
    /// The most likely value.
    value: f64,
    /// Lower end of the interval; null if it has none.
    low: Option<f64>,
    /// Upper end of the interval; null if it has none.
    high: Option<f64>,
}

/// Points that have one thing in common.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Group {
    /// The common quantity, with its unit: `gray`, `lamp_mw_per_cm2`, `feature_um`,
    /// `uv_absorber_g_per_100g` or `photoinitiator_g_per_100g`.
    of: &'static str,
    /// Its value.
    at: f64,
    /// Direction of the widths, `across` or `along` the scan; null without one.
    direction: Option<&'static str>,
    /// The number of points.
    points: usize,
    /// Share of their scatter that their own curve explains; null without such a curve.
    r2: Option<f64>,
    /// Parameters of their own curve.
    parameters: Vec<Parameter>,
}

schemas! { "lamp-calibrate-1": CalibrateAnswer; }

impl CalibrateAnswer {
    fn new(input: String, model: &'static str, counts: [usize; 3]) -> Self {
        let [points, without_measure, blank] = counts;
        let (parameters, groups) = (Vec::new(), Vec::new());
        Self { input, model, points, without_measure, blank, r2: None, parameters, groups }
    }
}

impl EstimateTable {
    /// Starts with the number of rows that were used, out of all rows of `input`. `none` names the
    /// rows that hold no point.
    pub(super) fn new<T>(
        input: String,
        model: &'static str,
        measured: &Measured<T>,
        none: &str,
    ) -> Self {
        let Measured { points, none: without, blank } = measured;
        let points = points.len();
        let rows = points + without + blank;
        let text =
            format!("{points} points of {rows} rows ({without} {none}, {blank} blank left out)\n");
        let counts = [points, *without, *blank];
        Self { text, answer: CalibrateAnswer::new(input, model, counts), names: 26 }
    }

    /// Starts with the number of pixels of a picture that were used.
    pub(super) fn of_pixels(input: String, model: &'static str, pixels: usize) -> Self {
        let answer = CalibrateAnswer::new(input, model, [pixels, 0, 0]);
        Self { text: format!("{pixels} pixels\n"), answer, names: 34 }
    }

    /// Makes room for longer names.
    pub(super) fn widen(&mut self, names: usize) {
        self.names = names;
    }

    /// Adds a line of texts, the first to the left and the others to the right of
    /// their columns.
    pub(super) fn line(&mut self, first: &str, others: &[&str]) {
        let mut line = format!("{first:<0$}", self.names);
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
        self.estimate_line(name, estimate);
        self.answer.parameters.push(Parameter::new(name, estimate));
    }

    /// Adds a number of a unit with the ends of its interval.
    pub(super) fn numbers(&mut self, name: &str, unit: &'static str, number: [f64; 3]) {
        let [value, low, high] = in_words(number);
        self.line(&format!("{name} ({unit})"), &[&value, &low, &high]);
        self.answer.parameters.push(Parameter::of(name, unit, number));
    }

    /// Adds a number of a unit without an interval.
    pub(super) fn number(&mut self, name: &str, unit: &'static str, value: f64) {
        self.line(&format!("{name} ({unit})"), &[&short(value)]);
        self.answer.parameters.push(Parameter::of(name, unit, [value, f64::NAN, f64::NAN]));
    }

    /// Adds how much of the scatter of some points the model explains.
    pub(super) fn share(&mut self, name: &str, r2: f64) {
        self.line(name, &[&short(r2)]);
        self.answer.parameters.push(Parameter::of(name, "1", [r2, f64::NAN, f64::NAN]));
    }

    /// Adds how much of the scatter of all points the model explains.
    pub(super) fn r2(&mut self, name: &str, r2: f64) {
        self.line(name, &[&short(r2)]);
        self.answer.r2 = Some(r2);
    }

    /// Begins a group of points, for the answer.
    pub(super) fn group(&mut self, of: &'static str, at: f64, points: usize, r2: Option<f64>) {
        self.answer.groups.push(Group {
            of,
            at,
            direction: None,
            points,
            r2,
            parameters: Vec::new(),
        });
    }

    /// Adds the direction of the widths of the last group, for the answer.
    pub(super) fn direction_of_group(&mut self, direction: Option<&'static str>) {
        let group = self.answer.groups.last_mut().expect("a group was begun");
        group.direction = direction;
    }

    /// Adds a number of the last group with its interval. The table calls it `name`, with `at` behind.
    pub(super) fn estimate_of_group<T: Quantity>(
        &mut self,
        name: &str,
        at: &str,
        estimate: &Estimate<T>,
    ) {
        self.estimate_line(&format!("{name}{at}"), estimate);
        let group = self.answer.groups.last_mut().expect("a group was begun");
        group.parameters.push(Parameter::new(name, estimate));
    }

    /// Adds a number of the last group without an interval, for the answer.
    pub(super) fn number_of_group<T: Quantity>(&mut self, name: &str, number: T) {
        let group = self.answer.groups.last_mut().expect("a group was begun");
        let (name, unit, value) = (name.to_owned(), T::UNIT, number.number());
        group.parameters.push(Parameter { name, unit, value, low: None, high: None });
    }

    fn estimate_line<T: Quantity>(&mut self, name: &str, estimate: &Estimate<T>) {
        let [value, low, high] = numbers(estimate);
        self.line(&format!("{name} ({})", T::UNIT), &[&value, &low, &high]);
    }

    /// Prints the table, and writes the answer where that is wanted.
    pub(super) fn write(&self, report: &ReportTo) -> Result<(), Exit> {
        if let Some(path) = report.path() {
            write_answer("lamp-calibrate-1", &self.answer, path)?;
        }
        if report.is_printed() { Ok(()) } else { print(&self.text) }
    }
}

impl Parameter {
    fn new<T: Quantity>(name: &str, estimate: &Estimate<T>) -> Self {
        Self::of(name, T::UNIT, [estimate.value, estimate.low, estimate.high].map(T::number))
    }

    fn of(name: &str, unit: &'static str, [value, low, high]: [f64; 3]) -> Self {
        let [low, high] = [low, high].map(|end| Some(end).filter(|end| end.is_finite()));
        Self { name: name.to_owned(), unit, value, low, high }
    }
}

/// A value and its interval, in words: with the decimals that five digits of the
/// value have, unless that makes them too long or nothing.
pub(super) fn numbers<T: Quantity>(estimate: &Estimate<T>) -> [String; 3] {
    in_words([estimate.value, estimate.low, estimate.high].map(T::number))
}

fn in_words([value, low, high]: [f64; 3]) -> [String; 3] {
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
