//! The state of light and resin of a plan on a glass, as factors of the numbers of projector and
//! material.

use serde::{Deserialize, Serialize};

use super::state::{DEPTH, DOSE, Factor, MOST, SPREAD, UNSTATED, Unseparated, unseparated};

/// A number of light or resin that prints show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GlassNumber {
    /// The depth over which light fades by e.
    PenetrationDepth,
    /// The dose of a second in units of the critical dose.
    Dose,
    /// The light of full white.
    Light,
    /// The oxygen that is dissolved before exposure.
    Oxygen,
    /// The conversion where resin is solid.
    CriticalConversion,
    /// The spread of light.
    Spread,
}

lamp_stack::named!(GlassNumber {
    PenetrationDepth = "penetration depth",
    Dose = "dose",
    Light = "light",
    Oxygen = "oxygen",
    CriticalConversion = "critical conversion",
    Spread = "spread",
});

impl GlassNumber {
    /// Returns the standard deviation of the number's logarithm where its file states no interval.
    pub(super) fn unstated_sd(self) -> f64 {
        match self {
            Self::PenetrationDepth => UNSTATED[DEPTH],
            Self::Dose => UNSTATED[DOSE],
            // The dose has both.
            Self::Light | Self::CriticalConversion => UNSTATED[DOSE] / 2.0_f64.sqrt(),
            // A share of what air dissolves in the resin, which degassing and storage change.
            Self::Oxygen => 0.3,
            Self::Spread => UNSTATED[SPREAD],
        }
    }

    /// Returns the most by which the number's logarithm is searched.
    pub(super) fn most(self) -> f64 {
        match self {
            Self::PenetrationDepth => MOST[DEPTH],
            Self::Dose | Self::Light | Self::Oxygen | Self::CriticalConversion => MOST[DOSE],
            Self::Spread => MOST[SPREAD],
        }
    }
}

/// Numbers of light and resin, as factors of the numbers of a projector and a material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GlassState {
    numbers: Vec<GlassNumber>,
    /// The covariance of their logarithms.
    covariance: Vec<Vec<f64>>,
    factors: Vec<Factor>,
}

impl GlassState {
    /// Returns the state before any print: the numbers of the files, each with the standard deviation
    /// of its logarithm.
    pub(super) fn of_sds(sds: &[(GlassNumber, f64)]) -> Self {
        let diagonal = |row: usize| {
            let mut variances = vec![0.0; sds.len()];
            variances[row] = sds[row].1.powi(2);
            variances
        };
        Self::new(
            sds.iter().map(|(number, _)| *number).collect(),
            &vec![0.0; sds.len()],
            (0..sds.len()).map(diagonal).collect(),
        )
    }

    pub(super) fn new(numbers: Vec<GlassNumber>, logs: &[f64], covariance: Vec<Vec<f64>>) -> Self {
        let factor =
            |(k, log): (usize, &f64)| Factor { value: log.exp(), sd: covariance[k][k].sqrt() };
        Self { factors: logs.iter().enumerate().map(factor).collect(), numbers, covariance }
    }

    /// Returns its numbers, each as a factor of the number in its file.
    pub fn factors(&self) -> impl Iterator<Item = (GlassNumber, Factor)> {
        self.numbers.iter().copied().zip(self.factors.iter().copied())
    }

    /// Returns the numbers that measurements cannot separate.
    pub fn unseparated(&self) -> Vec<Unseparated> {
        let names: Vec<_> = self.numbers.iter().map(|number| number.name()).collect();
        unseparated(&names, &self.covariance)
    }

    pub(super) fn numbers(&self) -> &[GlassNumber] {
        &self.numbers
    }

    pub(super) fn logs(&self) -> Vec<f64> {
        self.factors.iter().map(|factor| factor.value.ln()).collect()
    }

    pub(super) fn covariance(&self) -> &[Vec<f64>] {
        &self.covariance
    }
}
