//! Predicts a suspension's working curve from its composition.
//!
//! These models show trends: 002 (section 3.4.2.4) gives no numbers for them and compares
//! only their shape with its measurements.

use lamp_stack::Length;

use super::model::ModelError;
use super::units::Dose;
use super::working_curve::WorkingCurve;

/// Avogadro's number times Planck's constant times the speed of light, in J m/mol.
const MOLAR_PHOTON: f64 = 6.022_140_76e23 * 6.626_070_15e-34 * 299_792_458.0;

/// Micrometers in a centimeter.
const UM_PER_CM: f64 = 1e4;

/// A substance that absorbs light in the liquid: the photoinitiator or the dye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Absorber {
    /// `c`, in mol a liter of liquid.
    pub concentration: f64,
    /// `ε`, in l/(mol cm), to base e: `I = I_0 exp(-c ε z)`. Most tables give it
    /// to base 10, which is smaller by `ln 10`.
    pub extinction: f64,
}

impl Absorber {
    /// No absorber.
    pub const NONE: Self = Self { concentration: 0.0, extinction: 0.0 };

    /// `c ε`, for each centimeter of liquid.
    fn attenuation(self) -> f64 {
        self.concentration * self.extinction
    }
}

/// The parts of a suspension that attenuate light of one wavelength. The ceramic is
/// assumed to scatter without absorbing (002 eq. 57).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Suspension {
    /// The scattering length `l_sc`; none in a liquid without particles.
    pub scattering_length: Option<Length>,
    /// The ceramic's share of the volume `Φ`, 0 to 1.
    pub ceramic: f64,
    /// The photoinitiator, `c_P` and `ε_P`.
    pub photoinitiator: Absorber,
    /// The UV absorber, `c_D` and `ε_D`.
    pub dye: Absorber,
}

/// The inhibitor, which keeps a resin from curing until it is used up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inhibition {
    /// `c_INH`: oxygen and what stabilizes the monomer, in mol a liter of liquid.
    pub inhibitor: f64,
    /// `γ_INH`: radicals that each molecule of it removes.
    pub radicals_per_inhibitor: f64,
    /// `γ_D`: radicals that each molecule of dye keeps from being made.
    pub radicals_per_dye: f64,
    /// `Ω`: radicals for each photon absorbed.
    pub radicals_per_photon: f64,
    /// The light's wavelength.
    pub wavelength: Length,
}

/// Returns the contrast of the refractive indices of particles and liquid, `Δn/n = (n_cer -
/// n_o)/n_o` (002 eq. 55). The smaller it is, the less light is scattered to the side.
pub fn refractive_contrast(ceramic: f64, liquid: f64) -> f64 {
    (ceramic - liquid) / liquid
}

impl Suspension {
    /// Returns the attenuation `1/D_p = 1/l_sc + (1 - Φ)(c_P ε_P + c_D ε_D)`, for
    /// each centimeter (002 eq. 56 and 57).
    fn attenuation(&self) -> f64 {
        // Ceramic scatters and does not absorb: of 002 eq. 56, the term of the ceramic is zero.
        let scattered = self.scattering_length.map_or(0.0, |length| UM_PER_CM / length.um());
        let absorbed = self.photoinitiator.attenuation() + self.dye.attenuation();
        scattered + (1.0 - self.ceramic) * absorbed
    }

    /// Returns the penetration depth `D_p` (002 eq. 56 and 57).
    pub fn penetration_depth(&self) -> Length {
        Length::from_um(UM_PER_CM / self.attenuation())
    }

    /// Returns the dose at which the inhibitor is used up, `E_c = (γ_INH c_INH +
    /// γ_D c_D) hν/Ω (1/D_p)/(c_P ε_P)²` (002 eq. 58, which prints `l_sc` as
    /// `I_sc`).
    pub fn critical_dose(&self, inhibition: &Inhibition) -> Dose {
        let initiator = self.photoinitiator.attenuation();
        // The bracket of 002 eq. 58, whose numerator is the attenuation of eq. 57.
        let path = self.attenuation() / (initiator * initiator);
        self.dose_over(inhibition, path)
    }

    /// Returns the critical dose if only the photoinitiator attenuates:
    /// `E_c = (1 - Φ) hν/Ω (γ_INH c_INH + γ_D c_D)/(c_P ε_P)` (002 eq. 59).
    pub fn critical_dose_of_initiator(&self, inhibition: &Inhibition) -> Dose {
        let path = (1.0 - self.ceramic) / self.photoinitiator.attenuation();
        self.dose_over(inhibition, path)
    }

    /// Returns the dose whose photons, absorbed over `path` centimeters, make the
    /// radicals that inhibitor and dye take.
    fn dose_over(&self, inhibition: &Inhibition, path: f64) -> Dose {
        let taken = inhibition.radicals_per_inhibitor * inhibition.inhibitor
            + inhibition.radicals_per_dye * self.dye.concentration;
        // hν of 002 eq. 58, for a mole of photons.
        let joules_per_mole = MOLAR_PHOTON / (inhibition.wavelength.um() * 1e-6);
        // mol/l times J/mol times cm are mJ/cm².
        Dose::from_mj_per_cm2(taken * joules_per_mole / inhibition.radicals_per_photon * path)
    }

    /// Returns the working curve of 002 eq. 57 and 58.
    ///
    /// # Errors
    /// Returns an error if the composition is clear, inhibits nothing or holds no
    /// photoinitiator.
    pub fn working_curve(&self, inhibition: &Inhibition) -> Result<WorkingCurve, ModelError> {
        WorkingCurve::new(self.critical_dose(inhibition), self.penetration_depth())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Made-up numbers of the right size.
    fn suspension() -> Suspension {
        Suspension {
            scattering_length: Some(Length::from_um(1500.0)),
            ceramic: 0.55,
            photoinitiator: Absorber { concentration: 0.2, extinction: 150.0 },
            dye: Absorber { concentration: 0.002, extinction: 20_000.0 },
        }
    }

    fn inhibition() -> Inhibition {
        Inhibition {
            inhibitor: 0.001,
            radicals_per_inhibitor: 1.0,
            radicals_per_dye: 2.0,
            radicals_per_photon: 0.6,
            wavelength: Length::from_um(0.365),
        }
    }

    fn is_near(found: f64, wanted: f64) {
        assert!((found - wanted).abs() < 1e-6 * wanted, "{found} for {wanted}");
    }

    #[test]
    fn equations_57_to_59() {
        let curve = suspension().working_curve(&inhibition()).unwrap();
        // Worked out in Python.
        is_near(curve.penetration_depth().um(), 262.008734);
        is_near(curve.critical_dose().mj_per_cm2(), 115.823117);
        let short = suspension().critical_dose_of_initiator(&inhibition());
        is_near(short.mj_per_cm2(), 40.968002);
    }

    #[test]
    fn equation_59_is_58_where_the_initiator_alone_attenuates() {
        let clear = Suspension { scattering_length: None, dye: Absorber::NONE, ..suspension() };
        let full = clear.critical_dose(&inhibition()).mj_per_cm2();
        is_near(clear.critical_dose_of_initiator(&inhibition()).mj_per_cm2(), full);
    }

    #[test]
    fn the_trends_of_sections_3_4_6_and_3_4_7() {
        // 1/D_p is linear in the dye, and so is E_c by eq. 59.
        let with_dye = |concentration| {
            let dye = Absorber { concentration, ..suspension().dye };
            let suspension = Suspension { dye, ..suspension() };
            let dose = suspension.critical_dose_of_initiator(&inhibition());
            [1.0 / suspension.penetration_depth().um(), dose.mj_per_cm2()]
        };
        let [none, some, twice] = [0.0, 0.002, 0.004].map(with_dye);
        for i in 0..2 {
            is_near(twice[i] - none[i], 2.0 * (some[i] - none[i]));
            assert!(some[i] > none[i]);
        }
        // 1/D_p is linear in the photoinitiator, E_c in its inverse.
        let with_initiator = |concentration| {
            let photoinitiator = Absorber { concentration, ..suspension().photoinitiator };
            let suspension = Suspension { photoinitiator, ..suspension() };
            let dose = suspension.critical_dose_of_initiator(&inhibition());
            [1.0 / suspension.penetration_depth().um(), 1.0 / dose.mj_per_cm2()]
        };
        let [one, two, three] = [0.1, 0.2, 0.3].map(with_initiator);
        for i in 0..2 {
            is_near(three[i] - one[i], 2.0 * (two[i] - one[i]));
        }
        is_near(two[1], 2.0 * one[1]);
    }

    #[test]
    fn a_composition_that_never_cures_has_no_curve() {
        let dark = Suspension { photoinitiator: Absorber::NONE, ..suspension() };
        let dark = dark.working_curve(&inhibition());
        assert_eq!(dark, Err(ModelError::NotPositive("critical-dose")));
        let free = Inhibition { inhibitor: 0.0, radicals_per_dye: 0.0, ..inhibition() };
        let free = suspension().working_curve(&free);
        assert_eq!(free, Err(ModelError::NotPositive("critical-dose")));
    }
}
