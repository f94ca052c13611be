//! The numbers of a material from measurements: cure depths (002 section 3.3.5)
//! and cure widths (002 section 3.4.3) over doses, each number with its 95%
//! confidence interval.
//!
//! ```
//! use lamp_grayscale::calibrate::{Table, depth_points, fit_curve};
//!
//! let table = Table::parse("dose_mj_per_cm2,depth_um\n320,188\n640,333\n1280,481\n1920,566")?;
//! let measured = depth_points(&table, None)?;
//! let fit = fit_curve(&measured.points)?;
//! assert_eq!(fit.penetration_depth.value.um().round(), 211.0);
//! assert!(fit.critical_dose.holds(lamp_grayscale::resin::Dose::from_mj_per_cm2(131.5)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The errors of the measurements are taken to be independent, of one spread and
//! normal, and the doses to be exact.

mod bent;
mod columns;
mod curve;
mod data;
mod gray;
mod line;
mod solve;
mod student;
mod table;
#[cfg(test)]
mod testing;
mod two_depth;
mod width;

use lamp_stack::Length;
use thiserror::Error;

use crate::material::Given;
use crate::resin::{Dose, WidthSensitivity};

pub use curve::{CurveFit, fit_curve};
pub use data::{DataError, DepthPoint, Measured, WidthPoint, depth_points, width_points};
pub use gray::{GrayFit, LevelFit, LineEstimate, fit_gray};
pub use table::{Table, TableError};
pub use two_depth::{TwoDepthFit, fit_two_depth};
pub use width::{WidthFit, fit_widths};

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

/// What has a number to estimate, in the unit that its name says.
pub trait Quantity: Copy + PartialOrd {
    /// From a number in its unit.
    fn of(number: f64) -> Self;
    /// In its unit.
    fn number(self) -> f64;
}

macro_rules! quantity {
    ($name:ty, $of:path, $number:path) => {
        impl Quantity for $name {
            fn of(number: f64) -> Self {
                $of(number)
            }

            fn number(self) -> f64 {
                $number(self)
            }
        }
    };
}

quantity!(Dose, Dose::from_mj_per_cm2, Dose::mj_per_cm2);
quantity!(Length, Length::from_um, Length::um);
quantity!(
    WidthSensitivity,
    WidthSensitivity::from_um_per_mj_per_cm2,
    WidthSensitivity::um_per_mj_per_cm2
);

impl<T: Quantity> Estimate<T> {
    fn new(value: f64, low: f64, high: f64) -> Self {
        Self { value: T::of(value), low: T::of(low), high: T::of(high) }
    }

    /// An interval that reaches as far up as down.
    fn even(value: f64, half: f64) -> Self {
        Self::new(value, value - half, value + half)
    }

    /// Whether its interval holds a value.
    pub fn holds(&self, value: T) -> bool {
        self.low <= value && value <= self.high
    }

    /// The distance from the value to the farther end of its interval.
    pub fn plus_minus(&self) -> T {
        let value = self.value.number();
        T::of((value - self.low.number()).max(self.high.number() - value))
    }

    /// As a material file has it, to six digits; `plus-minus` is the longer side of
    /// the interval, none where that has no end.
    pub fn given(&self, source: &str) -> Given<T> {
        let plus_minus = self.plus_minus().number();
        Given {
            value: T::of(to_digits(self.value.number(), 6)),
            plus_minus: plus_minus.is_finite().then(|| T::of(to_digits(plus_minus, 3))),
            source: source.to_owned(),
        }
    }
}

/// Rounds to so many digits.
fn to_digits(number: f64, digits: usize) -> f64 {
    let text = format!("{number:.*e}", digits - 1);
    text.parse().expect("what is written as a number reads as one")
}

/// Why measurements give no numbers.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum FitError {
    /// Not enough points for an interval.
    #[error("{points} points are too few: {needed} cured ones are the least")]
    TooFew {
        /// How many there are.
        points: usize,
        /// How many it takes.
        needed: usize,
    },
    /// Not enough doses to tell the model's numbers apart.
    #[error("{doses} different doses are too few: {needed} are the least")]
    TooFewDoses {
        /// How many there are.
        doses: usize,
        /// How many it takes.
        needed: usize,
    },
    /// What is measured falls with the dose.
    #[error("more dose cures less here ({slope:.4} {unit}): are the columns exchanged?")]
    Falls {
        /// The slope.
        slope: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The slope might be zero.
    #[error(
        "the points scatter too much to tell how the dose acts: \
         the slope is {slope:.4} +- {half:.4} {unit}; measure more points or a wider range of doses"
    )]
    Scatters {
        /// The slope.
        slope: f64,
        /// Half of its 95% confidence interval.
        half: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The line meets zero at no dose above zero.
    #[error(
        "the line begins at a dose of {0:.2} mJ/cm2, and a critical dose is above zero: \
         measure lower doses"
    )]
    NoCriticalDose(f64),
    /// Not enough gray levels.
    #[error("{0} gray levels are too few: 3 are the least")]
    TooFewLevels(usize),
    /// A line of the gray model falls for sure.
    #[error(
        "{what} falls by {fall:.2} +- {half:.2} {unit} from black to white, but the gray model \
         takes no falling line, as a whiter level might cure less: fit the working curve of one level"
    )]
    GrayFalls {
        /// Which number.
        what: &'static str,
        /// By how much.
        fall: f64,
        /// Half of its 95% confidence interval.
        half: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// A line of the gray model begins at no more than zero.
    #[error("{what} would be {at_zero:.2} {unit} in the dark, and must be above zero")]
    GrayBegins {
        /// Which number.
        what: &'static str,
        /// The line's value at gray level 0.
        at_zero: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The model does not fit.
    #[error("the two-depth model does not fit these points: try the working curve")]
    NoFit,
    /// The points of one group.
    #[error("{group}: {error}")]
    Within {
        /// Which points, as `gray level 0.4`.
        group: String,
        /// What is wrong with them.
        error: Box<FitError>,
    },
}

impl FitError {
    fn within(self, group: String) -> Self {
        Self::Within { group, error: Box::new(self) }
    }
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;
    use crate::resin::GrayLevel;

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
