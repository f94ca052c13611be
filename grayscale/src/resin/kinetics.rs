//! The rates of a photopolymerization that oxygen inhibits.

use lamp_stack::Length;

use super::model::{ModelError, positive};
use super::plausible;
use super::units::{Absorptivity, Concentration, Diffusivity, Intensity, Quantity, RateConstant};

/// Avogadro's number, in 1/mol, times Planck's constant, in J s, times the speed of light, in m/s.
const MOLE_OF_PHOTONS: f64 = 6.022_140_76e23 * 6.626_070_15e-34 * 2.997_924_58e8;

/// 003's factor from decadic to natural absorption (its equation 4).
const DECADES: f64 = 2.3;

/// The rates by which light makes radicals, radicals use up double bonds, and oxygen stops
/// radicals (003 section 4.1 and table 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kinetics {
    /// The light's wavelength, `λ`.
    pub wavelength: Length,
    /// Pairs of radicals for each photon that the initiator absorbs, `φ`.
    pub quantum_efficiency: f64,
    /// How much light a mole of initiator absorbs, `ε`.
    pub absorptivity: Absorptivity,
    /// How fast a radical takes up double bonds, `k_p`.
    pub propagation: RateConstant,
    /// How fast two radicals end each other, `k_t`.
    pub termination: RateConstant,
    /// How fast oxygen ends a radical, `k_t,O2`.
    pub termination_by_oxygen: RateConstant,
    /// How fast oxygen spreads, `D_O2`.
    pub oxygen_diffusion: Diffusivity,
    /// The oxygen that is dissolved before exposure, `[O2]_0`.
    pub oxygen: Concentration,
    /// The initiator before exposure, `[In]_0`.
    pub photoinitiator: Concentration,
    /// The share of double bonds that is used up where resin is solid.
    pub critical_conversion: f64,
}

impl Kinetics {
    /// Returns the rates if each is [plausible], where oxygen, its diffusion and its rate may be zero,
    /// and shares are at most 1.
    ///
    /// # Errors
    /// Returns an error that names the number otherwise.
    pub fn checked(self) -> Result<Self, ModelError> {
        positive(self.quantum_efficiency, "quantum-efficiency")?;
        positive(self.critical_conversion, "critical-conversion")?;
        plausible::WAVELENGTH.check("wavelength", self.wavelength)?;
        plausible::ABSORPTIVITY.check("absorptivity", self.absorptivity)?;
        plausible::RATE.check("propagation", self.propagation)?;
        plausible::RATE.check("termination", self.termination)?;
        plausible::RATE.check_or_zero("termination-by-oxygen", self.termination_by_oxygen)?;
        plausible::DIFFUSIVITY.check_or_zero("oxygen-diffusion", self.oxygen_diffusion)?;
        plausible::OXYGEN.check_or_zero("oxygen", self.oxygen)?;
        plausible::CONCENTRATION.check("photoinitiator", self.photoinitiator)?;
        if self.quantum_efficiency > 1.0 {
            return Err(ModelError::TooLarge("quantum-efficiency", "1"));
        }
        if self.critical_conversion > 0.99 {
            return Err(ModelError::TooLarge("critical-conversion", "0.99"));
        }
        Ok(self)
    }

    /// Returns the share of the initiator that light splits in a second, `K_d` (003 equation 4
    /// without its fading).
    pub fn splitting(&self, light: Intensity) -> f64 {
        // 003 table 1 has W/m².
        let watt_per_m2 = 10.0 * light.mw_per_cm2();
        let metres = 1e-6 * self.wavelength.um();
        // 003 eq. 4: the energy of a mole of photons, N_A h c / λ, turns power into photons.
        DECADES * self.quantum_efficiency * self.absorptivity.number() * metres / MOLE_OF_PHOTONS
            * watt_per_m2
    }

    /// Returns by which power of e light fades in a micrometer of a mol/m³ of initiator.
    pub fn fading(&self) -> f64 {
        // The exponent 2.3 ε [In] z of 003 eq. 4, for z of a micrometer.
        1e-6 * DECADES * self.absorptivity.number()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tmpta() -> Kinetics {
        Kinetics {
            wavelength: Length::from_um(0.365),
            quantum_efficiency: 0.6,
            absorptivity: Absorptivity::from_m2_per_mol(15.0),
            propagation: RateConstant::from_m3_per_mol_s(1.66),
            termination: RateConstant::from_m3_per_mol_s(1.31),
            termination_by_oxygen: RateConstant::from_m3_per_mol_s(125.0),
            oxygen_diffusion: Diffusivity::from_m2_per_s(1e-10),
            oxygen: Concentration::from_mol_per_m3(1.05),
            photoinitiator: Concentration::from_mol_per_m3(859.0),
            critical_conversion: 0.2,
        }
    }

    #[test]
    fn light_splits_and_fades_as_in_equation_4() {
        // 2.3 · 0.6 · 15 · 365e-9 / 0.1196265658 for each W/m².
        let split = tmpta().splitting(Intensity::from_mw_per_cm2(2.57));
        assert!((split - 1.623_188e-3).abs() < 1e-9, "{split}");
        // Light fades to 1/e in 33.7 um.
        assert!((1.0 / (tmpta().fading() * 859.0) - 33.743_3).abs() < 1e-3);
    }

    #[test]
    fn impossible_numbers_are_refused_by_name() {
        assert_eq!(tmpta().checked(), Ok(tmpta()));
        let none = Concentration::from_mol_per_m3(0.0);
        assert!(Kinetics { oxygen: none, ..tmpta() }.checked().is_ok());
        let refused = |kinetics: Kinetics| kinetics.checked().unwrap_err().to_string();
        let text = refused(Kinetics { photoinitiator: none, ..tmpta() });
        assert_eq!(text, "photoinitiator must be above zero");
        for share in [0.0, -1.0, f64::NAN, 1.0] {
            let text = refused(Kinetics { critical_conversion: share, ..tmpta() });
            assert!(text.starts_with("critical-conversion must be"), "{text}");
        }
        let huge = RateConstant::from_m3_per_mol_s(1e300);
        let text = refused(Kinetics { termination_by_oxygen: huge, ..tmpta() });
        let nm_as_um = Length::from_um(365.0);
        let slip = refused(Kinetics { wavelength: nm_as_um, ..tmpta() });
        assert!(slip.starts_with("wavelength must be 0.1 to 2 um"), "{slip}");
        assert_eq!(
            text,
            "termination-by-oxygen must be 1e-12 to 1e8 m3/(mol s): a unit or a power of ten may be wrong"
        );
    }
}
