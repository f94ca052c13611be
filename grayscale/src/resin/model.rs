//! The trait of cure models, and their errors.

use std::fmt;

use lamp_stack::Length;
use thiserror::Error;

use super::units::{Dose, GrayLevel};

/// A model of how deep light cures a resin: depths for doses and gray levels, and back.
///
/// # Guarantees
/// More dose, and a whiter level, never cure less deep. `dose` undoes `depth`
/// to rounding wherever the depth is above zero and within `depths`, and
/// `gray_for` undoes `gray_depth`; both rise with the depth.
pub trait CureModel: fmt::Debug + Send + Sync {
    /// Returns the depth that a dose of full white cures; zero up to the
    /// critical dose.
    fn depth(&self, dose: Dose) -> Length;

    /// Returns the dose of full white that cures a depth. A depth of zero gives a dose
    /// of zero (000 eq. 3.10), though any dose up to the critical one would do.
    ///
    /// # Errors
    /// Returns an error if the depth is below zero, not finite or outside
    /// [`Self::depths`], or if its dose overflows.
    fn dose(&self, depth: Length) -> Result<Dose, CureError>;

    /// Returns the depths that the model holds for. [`depth`](Self::depth) applies its
    /// equation outside them, too.
    fn depths(&self) -> DepthRange {
        DepthRange::ALL
    }

    /// Returns the depth that a gray level cures in an exposure whose white
    /// brings the dose `white`.
    ///
    /// By default gray is the same as less light (002 eq. 34).
    fn gray_depth(&self, gray: GrayLevel, white: Dose) -> Length {
        self.depth(white * gray)
    }

    /// Returns the gray level that cures a depth in an exposure whose white
    /// brings the dose `white`. A depth of zero is black.
    ///
    /// # Errors
    /// Returns an error if [`Self::dose`] does, or if even white does not cure as deep.
    fn gray_for(&self, depth: Length, white: Dose) -> Result<GrayLevel, CureError> {
        let dose = self.dose(depth)?;
        check_reach(depth, self.depth(white))?;
        if depth.um() == 0.0 {
            return Ok(GrayLevel::BLACK);
        }
        // 002 eq. 34: the gray level is the share of white's dose.
        Ok(GrayLevel::clamped(dose.mj_per_cm2() / white.mj_per_cm2()))
    }
}

/// Checks that white cures a depth.
pub(super) fn check_reach(depth: Length, deepest: Length) -> Result<(), CureError> {
    if depth <= deepest { Ok(()) } else { Err(CureError::TooDeep { depth, deepest }) }
}

/// The depths that a model holds for, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthRange {
    /// The shallowest.
    pub from: Length,
    /// The deepest, if there is a limit.
    pub to: Option<Length>,
}

impl DepthRange {
    /// Every depth.
    pub const ALL: Self = Self { from: Length::from_um(0.0), to: None };

    /// Checks that a depth is among them, or is zero.
    pub(super) fn check(&self, depth: Length) -> Result<(), CureError> {
        if !(depth.um() >= 0.0 && depth.um().is_finite()) {
            return Err(CureError::NotADepth(depth));
        }
        // Zero needs no light in any model.
        let within = depth >= self.from && self.to.is_none_or(|to| depth <= to);
        if within || depth.um() == 0.0 {
            Ok(())
        } else {
            Err(CureError::Outside { depth, depths: *self })
        }
    }
}

impl fmt::Display for DepthRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.to {
            Some(to) => write!(f, "{} to {to}", self.from),
            None => write!(f, "{} or more", self.from),
        }
    }
}

/// Why a depth has no dose or no gray level.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CureError {
    /// The depth is below zero or not finite.
    #[error("a cure depth is zero or more, not {0}")]
    NotADepth(Length),
    /// The model does not hold for the depth.
    #[error("the cure model holds for depths of {depths}, not for {depth}")]
    Outside {
        /// The depth asked for.
        depth: Length,
        /// The depths that the model holds for.
        depths: DepthRange,
    },
    /// The model does not hold for all that a gray layer needs.
    #[error(
        "gray layers need a cure model for all depths up to {:.2} um, and this one holds for {depths}",
        reach.um()
    )]
    NotAllTo {
        /// The depth that white cures.
        reach: Length,
        /// The depths that the model holds for.
        depths: DepthRange,
    },
    /// Even white does not cure as deep.
    #[error(
        "no gray level cures {:.2} um, because full white cures {:.2} um: expose for longer",
        depth.um(), deepest.um()
    )]
    TooDeep {
        /// The depth asked for.
        depth: Length,
        /// The depth that white cures.
        deepest: Length,
    },
    /// The dose overflows.
    #[error("the dose that would cure {0} is too large a number")]
    NoDose(Length),
}

/// Why numbers make no cure model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ModelError {
    /// A number is not above zero, or not finite.
    #[error("{0} must be above zero")]
    NotPositive(&'static str),
    /// A number is below zero, or not finite.
    #[error("{0} must be zero or more")]
    Negative(&'static str),
    /// A number is outside of all that are known.
    #[error("{0} must be {1}: a unit or a power of ten may be wrong")]
    Implausible(&'static str, &'static str),
    /// A share is too large.
    #[error("{0} must be at most {1}")]
    TooLarge(&'static str, &'static str),
    /// A slope is below zero, or not finite.
    #[error("{0} must be zero or more: a model whose value falls towards white has no inverse")]
    Falls(&'static str),
    /// The deepest depth is not above the shallowest.
    #[error("depths must begin at zero or more and end above where they begin")]
    NoDepths,
    /// A range of measurements has no numbers above zero.
    #[error("{0} must begin above zero and not end before it begins")]
    NoRange(&'static str),
    /// There is no feature size, or one stands twice.
    #[error("feature-size must be given, and differ in each entry")]
    NoSizes,
}

/// Checks that a number is above zero and finite.
pub(super) fn positive(number: f64, what: &'static str) -> Result<(), ModelError> {
    let fine = number > 0.0 && number.is_finite();
    if fine { Ok(()) } else { Err(ModelError::NotPositive(what)) }
}

/// Checks that a number is zero or more and finite.
pub(super) fn zero_or_more(number: f64, what: &'static str) -> Result<(), ModelError> {
    let fine = number >= 0.0 && number.is_finite();
    if fine { Ok(()) } else { Err(ModelError::Negative(what)) }
}
