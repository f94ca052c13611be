//! Why no layer heights can be found.

use lamp_stack::Length;
use thiserror::Error;

/// Why no layer heights can be found.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum HeightsError {
    /// No whole number of steps lies between the limits.
    #[error("no layer is a whole number of steps of {step} and between {min} and {max} thick")]
    NoThickness {
        /// The least thickness.
        min: Length,
        /// The greatest.
        max: Length,
        /// The step between thicknesses.
        step: Length,
    },
    /// The limits hold more thicknesses than a search tries.
    #[error("steps of {step} make {count} thicknesses, more than a search tries")]
    TooManySteps {
        /// How many thicknesses there are.
        count: usize,
        /// The step between thicknesses.
        step: Length,
        /// The least step that is possible.
        min_step: Length,
    },
    /// The part would have more layers than any machine builds.
    #[error("the part is {height} high, more than a million of the thinnest layers")]
    TooHigh {
        /// The part's height.
        height: Length,
    },
    /// Bounds differ by height, and the part has heights without one.
    #[error(
        "no bound holds from {from} to {to}, where the part is: let the ranges cover it, such as by \
         an open end"
    )]
    NoBound {
        /// The lower end of these heights.
        from: Length,
        /// The upper end.
        to: Length,
    },
    /// More rows than any image has.
    #[error("rows {pitch} apart are more than 2^24")]
    TooManyRows {
        /// The distance from row to row.
        pitch: Length,
    },
    /// The budget is below the cost of any layers within the limits.
    #[error("the cheapest layers cost {least}, more than the budget of {budget}")]
    Budget {
        /// The cost of the cheapest layers.
        least: f64,
        /// The cost that was allowed.
        budget: f64,
    },
}
