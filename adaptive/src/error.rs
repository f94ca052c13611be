//! What can be wrong with what is asked of layers.

use thiserror::Error;

/// Why no layer heights can be found.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum HeightsError {
    /// Limits of a machine that leave it no thickness.
    #[error(
        "no layer is a whole number of steps of {step_um} um and between {min_um} and {max_um} um thick: \
         give a smaller step or wider limits"
    )]
    NoThickness {
        /// The least thickness in micrometres.
        min_um: f64,
        /// The greatest.
        max_um: f64,
        /// The step between thicknesses.
        step_um: f64,
    },
    /// Far more thicknesses than a search looks at.
    #[error(
        "the machine would have {count} thicknesses to choose from: give a step above {min_step_um} um"
    )]
    TooManySteps {
        /// How many thicknesses there are.
        count: f64,
        /// The least step that is possible, in micrometres.
        min_step_um: f64,
    },
    /// A part that would have more layers than any machine builds.
    #[error(
        "the part is {height_mm} mm high, more than a million of the thinnest layers: check the units and limits"
    )]
    TooHigh {
        /// The part's height in millimetres.
        height_mm: f64,
    },
    /// Rows so near to each other that no image has as many.
    #[error("rows {pitch_um} um apart are more than 2^24")]
    TooManyRows {
        /// How far apart they would be, in micrometres.
        pitch_um: f64,
    },
    /// A budget below what any layers take.
    #[error("the layers that take least take {least}, more than the budget of {budget}")]
    Budget {
        /// What they take at least.
        least: f64,
        /// What was allowed.
        budget: f64,
    },
}
