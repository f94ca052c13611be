//! The numbers of a reaction's rates, each with its source.

use lamp_stack::Length;
use serde::{Deserialize, Serialize};

use super::file::MaterialError;
use super::measured::MeasuredRange;
use super::number::{Given, GivenNumber};
use super::{Material, of};
use crate::resin::{Absorptivity, Concentration, Diffusivity, Kinetics, RateConstant};

/// The numbers of a photopolymerization that oxygen inhibits: see [`Kinetics`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct KineticNumbers {
    /// `λ`.
    pub wavelength: Given<Length>,
    /// `φ`.
    pub quantum_efficiency: GivenNumber,
    /// `ε`.
    pub absorptivity: Given<Absorptivity>,
    /// `k_p`.
    pub propagation: Given<RateConstant>,
    /// `k_t`.
    pub termination: Given<RateConstant>,
    /// `k_t,O2`.
    pub termination_by_oxygen: Given<RateConstant>,
    /// `D_O2`.
    pub oxygen_diffusion: Given<Diffusivity>,
    /// `[O2]_0`.
    pub oxygen: Given<Concentration>,
    /// `[In]_0`.
    pub photoinitiator: Given<Concentration>,
    /// The conversion where resin is solid.
    pub critical_conversion: GivenNumber,
    /// Where the rates were measured.
    pub measured: Option<MeasuredRange>,
}

impl Material {
    /// Returns the rates of its reaction, if they are known.
    ///
    /// # Errors
    /// Returns an error if a number is impossible.
    pub fn kinetics(&self) -> Result<Option<Kinetics>, MaterialError> {
        let rates = |numbers: &KineticNumbers| {
            let rates = Kinetics {
                wavelength: numbers.wavelength.value,
                quantum_efficiency: numbers.quantum_efficiency.value,
                absorptivity: numbers.absorptivity.value,
                propagation: numbers.propagation.value,
                termination: numbers.termination.value,
                termination_by_oxygen: numbers.termination_by_oxygen.value,
                oxygen_diffusion: numbers.oxygen_diffusion.value,
                oxygen: numbers.oxygen.value,
                photoinitiator: numbers.photoinitiator.value,
                critical_conversion: numbers.critical_conversion.value,
            };
            rates.checked()
        };
        self.kinetics.as_ref().map(rates).transpose().map_err(of("kinetics"))
    }
}
