//! Finds a material's numbers from measured cure depths (002 section 3.3.5) and cure
//! widths (002 section 3.4.3) over doses, each with its 95% confidence interval.
//!
//! ```
//! use lamp_grayscale::calibrate::{CsvTable, depth_points, fit_curve};
//!
//! let table = CsvTable::parse("dose_mj_per_cm2,depth_um\n320,188\n640,333\n1280,481\n1920,566")?;
//! let measured = depth_points(&table, None)?;
//! let fit = fit_curve(&measured.points)?;
//! assert_eq!(fit.penetration_depth.value.um().round(), 211.0);
//! assert!(fit.critical_dose.holds(lamp_grayscale::resin::Dose::from_mj_per_cm2(131.5)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Measurement errors are assumed to be independent and normal with one spread, and doses
//! to be exact.

mod columns;
mod csv_table;
mod curve_lines;
mod exposure_times;
mod extent;
mod fit_curve;
mod fit_gamma;
mod fit_gray;
mod fit_lamp;
mod fit_law;
mod fit_profiles;
mod fit_scan;
mod fit_two_depth;
mod fit_widths;
mod hinge;
mod hinge_piece;
mod least_squares;
#[cfg(test)]
mod made_up;
mod matrix;
mod measurements;
mod regression;
mod student_t;
mod two_depth_curve;

use std::fmt;

use lamp_stack::{Length, format_significant, round_significant};
use thiserror::Error;

use crate::material::{Given, GivenNumber, LawVariable};
use crate::resin::Quantity;

pub use columns::NumberRow;
pub use csv_table::{CsvTable, TableError};
pub use exposure_times::ExposureTimes;
pub use fit_curve::{CurveFit, fit_curve};
pub use fit_gamma::{GammaFit, fit_gamma};
pub use fit_gray::{GrayFit, LevelFit, LineEstimate, fit_gray};
pub use fit_lamp::{LampFit, fit_lamp};
pub use fit_law::{LawCurve, LawFit, LawLine, fit_law, law_numbers};
pub use fit_profiles::{ProfileFit, fit_profiles};
pub use fit_scan::{LineKind, LinesOf, ScanDirection, ScanFit, fit_scan};
pub use fit_two_depth::{TwoDepthFit, fit_two_depth};
pub use fit_widths::{ManyLayersFit, WidthFit, fit_many_layers, fit_widths};
pub use least_squares::least_squares;
pub use matrix::inverse;
pub use measurements::{
    DataError, DepthPoint, LampPoint, LawPoint, LawTable, LinePoint, Measured, ProfilePoint,
    WidthPoint, depth_points, lamp_points, law_points, line_points, profile_points, width_points,
};
pub use student_t::t_95;

/// The cure models that can be fitted to depths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthModel {
    /// The working curve, by [`fit_curve`].
    Jacobs,
    /// The model of two penetration depths, by [`fit_two_depth`].
    TwoDepth,
    /// The working curve over the gray level, by [`fit_gray`].
    Gray,
}

lamp_stack::named!(DepthModel { Jacobs = "jacobs", TwoDepth = "two-depth", Gray = "gray" });

/// A number found from measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<T> {
    /// The most likely value.
    pub value: T,
    /// The lower end of its 95% confidence interval.
    pub low: T,
    /// The upper end.
    pub high: T,
}

impl<T: Quantity> Estimate<T> {
    fn new(value: f64, low: f64, high: f64) -> Self {
        Self { value: T::of(value), low: T::of(low), high: T::of(high) }
    }

    /// Creates an estimate with a symmetric interval.
    fn even(value: f64, half: f64) -> Self {
        Self::new(value, value - half, value + half)
    }

    /// Returns whether the interval holds a value.
    pub fn holds(&self, value: T) -> bool {
        self.low <= value && value <= self.high
    }

    /// Returns the distance from the value to the farther end of its interval.
    pub fn plus_minus(&self) -> T {
        let value = self.value.number();
        T::of((value - self.low.number()).max(self.high.number() - value))
    }

    /// Returns the number for a material file, to six digits. Its `plus-minus` is the longer
    /// side of the interval, absent if that is infinite.
    pub fn given(&self, source: &str) -> Given<T> {
        let plus_minus = self.plus_minus().number();
        Given {
            value: T::of(round_significant(self.value.number(), 6)),
            plus_minus: plus_minus.is_finite().then(|| T::of(round_significant(plus_minus, 3))),
            source: source.to_owned(),
        }
    }
}

/// Returns a number without a unit and the ends of its interval, for a material file, as
/// [`Estimate::given`] does.
fn given_number([value, low, high]: [f64; 3], source: &str) -> GivenNumber {
    GivenNumber {
        value: round_significant(value, 6),
        plus_minus: Some(round_significant((high - value).max(value - low), 3)),
        source: source.to_owned(),
    }
}

/// Why a model cannot be fitted to measurements.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum FitError {
    /// There are too few points for an interval.
    #[error("{}", too_few_points(*points, *needed))]
    TooFew {
        /// The number there is.
        points: usize,
        /// The least number.
        needed: usize,
    },
    /// There are too few doses for the model's parameters.
    #[error("{} too few: {needed} different ones are the least", are(*doses, "dose"))]
    TooFewDoses {
        /// The number there is.
        doses: usize,
        /// The least number.
        needed: usize,
    },
    /// The measurements fall with the dose.
    #[error("more dose cures less here ({} {unit}): are the columns exchanged?", short(*slope))]
    Falls {
        /// The slope.
        slope: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The slope might be zero.
    #[error(
        "the points scatter too much to show how the dose acts: \
         the slope is {} +- {} {unit}; measure more points or a wider range of doses",
        short(*slope),
        short(*half)
    )]
    Scatters {
        /// The slope.
        slope: f64,
        /// Half of its 95% confidence interval.
        half: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// All measurements are the same.
    #[error(
        "all points measure {} um, whatever the dose: is it the right column? \
         Measure lower doses too",
        short(*.0)
    )]
    Level(f64),
    /// The interval of a number that must be above zero reaches zero.
    #[error(
        "the points do not determine {what}: {} +- {} {unit} reaches zero; \
         measure more doses, and several films of each",
        short(*value),
        short(*half)
    )]
    Vague {
        /// The number's name.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Half of its 95% confidence interval.
        half: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The line meets zero at a dose that is not plausible.
    #[error(
        "the line begins at a dose of {} mJ/cm2, and a critical dose is above zero, \
         from 1e-6 to 1e9 mJ/cm2: measure lower doses",
        short(*.0)
    )]
    NoCriticalDose(f64),
    /// Only the highest dose makes squares grow, which determines no line.
    #[error(
        "squares grow at the highest dose only, which does not show from which dose on: measure \
         higher doses"
    )]
    LastDoseAlone,
    /// All squares have several layers.
    #[error(
        "all squares have several layers, and a line of cure widths is of one layer: print squares of \
         one layer too, and write 1 as their layers"
    )]
    NoSingleLayer,
    /// More than the whole dose of the layers above would count.
    #[error(
        "the share of the doses of layers above is {} +- {}, and cannot be more than 1: check the \
         column layers, --thickness and the material of the depths",
        short(*value),
        short(*half)
    )]
    LargeShare {
        /// The share.
        value: f64,
        /// Half of its 95% confidence interval.
        half: f64,
    },
    /// Squares of many layers are of several kinds.
    #[error(
        "squares of several layers must have one size and no direction: fit others in a table of \
         their own"
    )]
    LayersOfSeveral,
    /// The points leave a line open.
    #[error(
        "the points do not show how the working curve changes: measure several doses at each level"
    )]
    NoLines,
    /// There are too few gray levels.
    #[error("{} too few: 3 are the least", are(*.0, "gray level"))]
    TooFewLevels(usize),
    /// There is only one light.
    #[error("{} too few: 2 are the least", are(*.0, "light"))]
    TooFewLights(usize),
    /// There are too few values of an ingredient or the lamp for a law.
    #[error("{} too few: {needed} are the least", values_of(*values, *over))]
    TooFewValues {
        /// The quantity.
        over: LawVariable,
        /// The number of values.
        values: usize,
        /// The least number.
        needed: usize,
    },
    /// A line over the gray level or the light falls by more than its interval.
    #[error(
        "{what} falls by {} +- {} {unit} towards more light, but the model takes no falling \
         line, because more light might cure less: fit the working curve of one light",
        short(*fall),
        short(*half)
    )]
    GrayFalls {
        /// The number's name.
        what: &'static str,
        /// The fall from black to white, or for each W/cm².
        fall: f64,
        /// Half of its 95% confidence interval.
        half: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// A line of the gray model begins at zero or less.
    #[error("{what} would be {} {unit} in the dark, and must be above zero", short(*at_zero))]
    GrayBegins {
        /// The number's name.
        what: &'static str,
        /// The line's value at gray level 0.
        at_zero: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The model does not fit.
    #[error("the two-depth model does not fit these points: try the working curve")]
    NoFit,
    /// There are too few lines of a direction.
    #[error("{count} {lines} are too few: {needed} are the least, of several widths")]
    TooFewLines {
        /// The lines.
        lines: LinesOf,
        /// The number there is.
        count: usize,
        /// The least number.
        needed: usize,
    },
    /// All lines of a direction are of one kind, width and dose.
    #[error("all {0} are alike: measure several widths")]
    EqualLines(LinesOf),
    /// No spread of light fits the lines.
    #[error(
        "no light that spreads as a Gaussian cures such lines: check the columns, \
         the resolution (--dpi), and that `across` means widths along x"
    )]
    NoScanFit,
    /// The interval of a number is too wide.
    #[error(
        "the lines do not determine {what}: it may be {} to {} {unit}; measure lines and gaps \
         about as wide as light spreads, or several doses",
        short(*low),
        short(*high)
    )]
    VagueLines {
        /// The number's name.
        what: &'static str,
        /// The lower end of its 95% confidence interval.
        low: f64,
        /// The upper end.
        high: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// There are too few points of profiles.
    #[error(
        "{} too few: {needed} are the least, from the middle of squares to beyond their edges",
        are(*points, "point")
    )]
    TooFewProfilePoints {
        /// The number there is.
        points: usize,
        /// The least number.
        needed: usize,
    },
    /// No square is white, so the light of gray levels has no measure.
    #[error("no square is white: measure one of gray level 1 too")]
    NoWhiteProfile,
    /// Some points of profiles have doses, and others none.
    #[error("{with} of {all} points have a dose: give all of them one, or none")]
    SomeDoses {
        /// The number of points with a dose.
        with: usize,
        /// The number of points.
        all: usize,
    },
    /// The places are not measured from the middle of squares.
    #[error(
        "the places of white squares lie around x_um = {}, and their middle is 0: measure x_um from the \
         middle of the square",
        short(*.0)
    )]
    OffMiddle(f64),
    /// No spread of light fits the profiles.
    #[error(
        "no light that spreads as a Gaussian and fades with depth has such profiles: check the columns"
    )]
    NoProfileFit,
    /// The interval of a number is too wide.
    #[error(
        "the profiles do not determine {what}: it may be {} to {}{}{unit}; measure points from the middle \
         of each square to beyond its edges",
        short(*low),
        short(*high),
        if unit.is_empty() { "" } else { " " }
    )]
    VagueProfiles {
        /// The number's name.
        what: &'static str,
        /// The lower end of its 95% confidence interval.
        low: f64,
        /// The upper end.
        high: f64,
        /// Its unit, or nothing.
        unit: &'static str,
    },
    /// The points of one group cannot be fitted.
    #[error("{group}: {error}")]
    Within {
        /// The group.
        group: PointGroup,
        /// Their error.
        error: Box<FitError>,
    },
}

/// The points that one line is fitted to.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum PointGroup {
    /// The cure widths of squares of a side.
    Squares(Length),
}

impl fmt::Display for PointGroup {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Squares(side) => write!(f, "squares of {side}"),
        }
    }
}

/// Writes a number for a message.
fn short(number: f64) -> String {
    format_significant(number, 4)
}

/// Writes a count of something with its verb.
fn are(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what} is") } else { format!("{count} {what}s are") }
}

fn values_of(count: usize, over: LawVariable) -> String {
    if count == 1 {
        format!("1 value of {over} is")
    } else {
        format!("{count} values of {over} are")
    }
}

fn too_few_points(points: usize, needed: usize) -> String {
    match points {
        0 => format!("no row cured or grew: {needed} that did are the least"),
        _ => format!("{} too few: {needed} that cured or grew are the least", are(points, "point")),
    }
}

impl FitError {
    fn within(self, group: PointGroup) -> Self {
        Self::Within { group, error: Box::new(self) }
    }
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;
    use crate::resin::{Dose, GrayLevel};

    /// A number of any size, often a small round one.
    fn any_size() -> impl Strategy<Value = f64> {
        prop_oneof![(1..20i32).prop_map(f64::from), (-300.0..300.0f64).prop_map(|e| 10f64.powf(e))]
    }

    proptest! {
        #[test]
        fn any_numbers_give_positive_ones_or_an_error(
            rows in vec((any_size(), any_size(), 1..4u8), 0..12),
        ) {
            let depth = |&(mj, um, gray): &(f64, f64, u8)| DepthPoint {
                gray: GrayLevel::from_u8(85 * gray),
                dose: Dose::from_mj_per_cm2(mj),
                depth: Length::from_um(um),
            };
            let depths: Vec<_> = rows.iter().map(depth).collect();
            let width = |&(mj, um, size): &(f64, f64, u8)| WidthPoint {
                feature_size: Length::from_um(size.into()),
                dose: Dose::from_mj_per_cm2(mj),
                width: Length::from_um(um),
                direction: None,
                layers: 1,
            };
            let widths: Vec<_> = rows.iter().map(width).collect();
            let mut found = Vec::new();
            if let Ok(fit) = fit_curve(&depths) {
                found.extend([fit.critical_dose.value.number(), fit.penetration_depth.value.number()]);
            }
            if let Ok(fit) = fit_two_depth(&depths) {
                found.push(fit.critical_dose.value.number());
                found.extend([fit.liquid_depth, fit.solid_depth].map(|depth| depth.value.number()));
            }
            if let Ok(fit) = fit_gray(&depths) {
                found.push(fit.critical_dose.at_zero.value.number());
                found.push(fit.penetration_depth.at_zero.value.number());
            }
            for fit in fit_widths(&widths).unwrap_or_default() {
                found.extend([fit.critical_dose.value.number(), fit.sensitivity.value.number()]);
            }
            prop_assert!(found.iter().all(|&n| n > 0.0 && n.is_finite()), "{:?}", found);
        }
    }

    #[test]
    fn errors_count_and_shorten() {
        let few = |points| FitError::TooFew { points, needed: 3 }.to_string();
        assert_eq!(few(0), "no row cured or grew: 3 that did are the least");
        assert_eq!(few(1), "1 point is too few: 3 that cured or grew are the least");
        assert!(few(2).starts_with("2 points are too few"));
        assert!(FitError::TooFewLevels(1).to_string().starts_with("1 gray level is too few"));
        let tiny = FitError::Scatters { slope: 1e-9, half: 2.5e-9, unit: "um" }.to_string();
        assert!(tiny.contains("1.000e-9 +- 2.500e-9 um"), "{tiny}");
    }

    #[test]
    fn a_material_gets_the_longer_side_of_an_interval() {
        let estimate = Estimate::<Dose>::new(131.512_345_6, 126.0, 136.432_1);
        let given = estimate.given("a test");
        assert_eq!(given.value.mj_per_cm2(), 131.512);
        assert_eq!(given.plus_minus.unwrap().mj_per_cm2(), 5.51);
        let open = Estimate::<Length>::new(150.0, 90.0, f64::INFINITY);
        assert_eq!(open.given("a test").plus_minus, None);
        assert!(open.holds(Length::from_um(1e9)) && !open.holds(Length::from_um(89.0)));
    }
}
