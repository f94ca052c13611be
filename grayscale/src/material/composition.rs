//! Materials from what is mixed: compositions as TOML files.

use std::collections::BTreeMap;

use lamp_stack::{Builtin, Catalogued, Length};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::peaks::{Peak, check_light, mean};
use super::{Constant, CurveNumbers, Given, GivenNumber, Material};
use crate::resin::shrinkage::{self, Monomer};
use crate::resin::{
    Absorber, Absorptivity, Concentration, Inhibition, Intensity, ModelError, Quantity, Suspension,
    WorkingCurve, plausible, refractive_contrast,
};

/// The ingredients of a suspension, from which the models of 002 sections 3.4.2.2 to 3.4.2.4
/// estimate how it cures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Composition {
    /// The name: small letters, digits and `-`.
    pub name: String,
    /// A description of one line.
    pub description: String,
    /// The light of full white.
    pub intensity: Option<Given<Intensity>>,
    /// The light's wavelength, unless the lamp has several peaks.
    pub wavelength: Option<Given<Length>>,
    /// The peaks of a lamp that has several, instead of a wavelength and absorptivities there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub peaks: Vec<Peak>,
    /// The ceramic; absent in a liquid without particles.
    pub ceramic: Option<Ceramic>,
    /// The photoinitiator, `c_P` and `ε_P`.
    pub photoinitiator: Dissolved,
    /// The UV absorber, `c_D` and `ε_D`.
    pub uv_absorber: Option<Dissolved>,
    /// The inhibitor that keeps the resin from curing.
    pub inhibition: InhibitionNumbers,
    /// The monomers that shrink, if shrinkage is wanted.
    pub shrinkage: Option<ShrinkageNumbers>,
}

/// Ceramic particles, which scatter and do not absorb.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Ceramic {
    /// The share of the volume `Φ`, 0 to 1.
    pub share: GivenNumber,
    /// The distance `l_sc` after which a photon's direction is random.
    pub scattering_length: Given<Length>,
    /// The refractive indices of particles and liquid.
    pub refraction: Option<Refraction>,
}

/// Refractive indices, whose contrast is reported (002 eq. 55).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Refraction {
    /// `n_cer`.
    pub ceramic: GivenNumber,
    /// `n_o`.
    pub liquid: GivenNumber,
}

/// A substance in the liquid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Dissolved {
    /// In the liquid, without the ceramic.
    pub concentration: Given<Concentration>,
    /// In powers of ten, as tables have it; left out where the lamp's peaks have it.
    pub absorptivity: Option<Given<Absorptivity>>,
}

/// The substances that attenuate the light whose photons use up the inhibitor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AttenuatedBy {
    /// Ceramic, photoinitiator and UV absorber (002 eq. 58).
    #[default]
    All,
    /// The photoinitiator, as if it were alone (002 eq. 59).
    Photoinitiator,
}

/// The inhibitor, which keeps a resin from curing until it is used up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct InhibitionNumbers {
    /// `c_INH`, in the liquid.
    pub inhibitor: Given<Concentration>,
    /// `γ_INH`.
    pub radicals_per_inhibitor: GivenNumber,
    /// `γ_D`; zero if left out.
    pub radicals_per_dye: Option<GivenNumber>,
    /// `Ω`.
    pub radicals_per_photon: GivenNumber,
    /// The substances that attenuate the light meanwhile.
    #[serde(default)]
    pub attenuated_by: AttenuatedBy,
}

/// The monomers and how much of them reacts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct ShrinkageNumbers {
    /// The density of the monomers together, in g/cm³.
    pub density_g_per_cm3: GivenNumber,
    /// The share `α` of their groups that react, 0 to 1.
    pub conversion: Option<GivenNumber>,
    /// Spectra from which the conversion follows, if it is not given.
    pub spectra: Option<Spectra>,
    /// The monomers.
    pub monomers: Vec<MonomerNumbers>,
}

/// Areas of infrared peaks before and after curing (002 eq. 54).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Spectra {
    /// C=C at 1620 /cm, C=C at 1410 /cm and C=O at 1750 /cm, before.
    pub before: [f64; 3],
    /// The same after curing.
    pub after: [f64; 3],
    /// The measurement.
    pub source: String,
}

/// A monomer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct MonomerNumbers {
    /// Its name.
    pub name: String,
    /// Acrylate groups of a molecule, `f`.
    pub functionality: f64,
    /// `M_m`.
    pub molar_mass_g_per_mol: f64,
    /// Its share of the molecules; shares that do not sum to one count by their ratios.
    pub moles: f64,
}

/// Why a composition makes no material.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CompositionError {
    /// A number is impossible.
    #[error("{0} must be {1}")]
    Number(&'static str, &'static str),
    /// The light is not given, or given twice.
    #[error("{0}")]
    Light(&'static str),
    /// Shrinkage needs one of two.
    #[error("shrinkage needs either conversion or spectra")]
    NoConversion,
    /// A number is outside of all that are known.
    #[error(transparent)]
    Implausible(#[from] ModelError),
    /// The numbers give no working curve.
    // No source: this message contains the problem's text.
    #[error("the composition makes no working curve: its {0}")]
    NoCurve(ModelError),
}

const POSITIVE: &str = "above zero";

impl Catalogued for Composition {
    const KIND: &'static str = "composition";
    const BUILTINS: &'static [Builtin] = &[];
    type CheckError = CompositionError;

    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self) -> Result<(), CompositionError> {
        let number = |fine, what, wanted| {
            if fine { Ok(()) } else { Err(CompositionError::Number(what, wanted)) }
        };
        let positive = |number: f64| number > 0.0 && number.is_finite();
        check_light(self)?;
        if let Some(Ceramic { share, scattering_length, refraction }) = &self.ceramic {
            number((0.0..1.0).contains(&share.value), "ceramic.share", "from 0 to below 1")?;
            plausible::DEPTH.check("ceramic.scattering-length", scattering_length.value)?;
            let indices = refraction.iter().flat_map(|it| [it.ceramic.value, it.liquid.value]);
            number(indices.into_iter().all(positive), "ceramic.refraction", POSITIVE)?;
        }
        let dye = self.uv_absorber.as_ref();
        for (name, substance) in
            [("photoinitiator", Some(&self.photoinitiator)), ("uv-absorber", dye)]
        {
            let Some(Dissolved { concentration, absorptivity }) = substance else { continue };
            plausible::CONCENTRATION.check_or_zero(name, concentration.value)?;
            let absorptivity = absorptivity.as_ref().map_or(Absorptivity::default(), |it| it.value);
            plausible::ABSORPTIVITY.check_or_zero(name, absorptivity)?;
        }
        let of = &self.inhibition;
        plausible::CONCENTRATION.check_or_zero("inhibition.inhibitor", of.inhibitor.value)?;
        let photon = of.radicals_per_photon.value;
        number(positive(photon), "inhibition.radicals-per-photon", POSITIVE)?;
        let dye = of.radicals_per_dye.as_ref().map_or(0.0, |it| it.value);
        let not_below = |number: f64| number >= 0.0 && number.is_finite();
        let taken = not_below(of.radicals_per_inhibitor.value) && not_below(dye);
        number(taken, "inhibition.radicals-per-inhibitor and -per-dye", "zero or more")?;
        self.shrinkage.as_ref().map_or(Ok(()), ShrinkageNumbers::check)?;
        self.working_curve()?;
        Ok(())
    }
}

impl ShrinkageNumbers {
    fn check(&self) -> Result<(), CompositionError> {
        let positive = |number: f64| number > 0.0 && number.is_finite();
        let number = |fine, what, wanted| {
            if fine { Ok(()) } else { Err(CompositionError::Number(what, wanted)) }
        };
        number(positive(self.density_g_per_cm3.value), "shrinkage.density-g-per-cm3", POSITIVE)?;
        let numbers = |it: &MonomerNumbers| {
            [it.functionality, it.molar_mass_g_per_mol, it.moles].into_iter().all(positive)
        };
        let monomers = !self.monomers.is_empty() && self.monomers.iter().all(numbers);
        number(monomers, "shrinkage.monomers", "there, with numbers above zero")?;
        let areas = self.spectra.iter().flat_map(|it| [it.before, it.after]);
        number(areas.flatten().all(positive), "areas of shrinkage.spectra", POSITIVE)?;
        // 002 eq. 54 gives the conversion from spectra: given twice, which one counts would be
        // open.
        let conversion = self.conversion().ok_or(CompositionError::NoConversion)?;
        number((0.0..=1.0).contains(&conversion), "shrinkage.conversion", "from 0 to 1")
    }

    /// Returns the conversion that is given or measured; `None` if both are, or neither is.
    fn conversion(&self) -> Option<f64> {
        let areas = |[stretching, twisting, carbonyl]: [f64; 3]| shrinkage::PeakAreas {
            stretching,
            twisting,
            carbonyl,
        };
        match (&self.conversion, &self.spectra) {
            (Some(given), None) => Some(given.value),
            (None, Some(it)) => Some(shrinkage::conversion(areas(it.before), areas(it.after))),
            _ => None,
        }
    }
}

impl Composition {
    /// Returns the parts that attenuate light.
    pub fn suspension(&self) -> Suspension {
        let ceramic = self.ceramic.as_ref();
        let dye = self.uv_absorber.as_ref();
        Suspension {
            scattering_length: ceramic.map(|it| it.scattering_length.value),
            ceramic: ceramic.map_or(0.0, |it| it.share.value),
            photoinitiator: self.absorber(&self.photoinitiator, |peak| Some(&peak.photoinitiator)),
            dye: dye
                .map_or(Absorber::NONE, |dye| self.absorber(dye, |peak| peak.uv_absorber.as_ref())),
        }
    }

    /// Returns a substance as the models have it: mol a liter, and l/(mol cm) to base e; of a lamp
    /// with peaks, the mean over its light.
    fn absorber(
        &self,
        of: &Dissolved,
        at: impl Fn(&Peak) -> Option<&Given<Absorptivity>>,
    ) -> Absorber {
        let number = |given: &Given<Absorptivity>| given.value.m2_per_mol();
        let at_peak = |peak: &Peak| at(peak).map_or(0.0, number);
        let absorptivity =
            of.absorptivity.as_ref().map_or_else(|| mean(&self.peaks, |_| 1.0, at_peak), number);
        Absorber {
            // 1 mol/m³ is a thousandth of a mol a liter.
            concentration: of.concentration.value.mol_per_m3() / 1000.0,
            // 1 m²/mol is 10 l/(mol cm), and tables are to base 10.
            extinction: absorptivity * 10.0 * std::f64::consts::LN_10,
        }
    }

    /// Returns the wavelength. For a lamp with peaks, it is the mean wavelength of the photons that
    /// the photoinitiator absorbs at the surface.
    fn wavelength(&self) -> Length {
        let of_peaks = || {
            // At the surface each peak has all of its light, of which the photoinitiator absorbs a
            // part in proportion to its absorptivity.
            let absorbed = |peak: &Peak| peak.photoinitiator.value.m2_per_mol();
            Length::from_um(mean(&self.peaks, absorbed, |peak| peak.wavelength.value.um()))
        };
        self.wavelength.as_ref().map_or_else(of_peaks, |it| it.value)
    }

    fn working_curve(&self) -> Result<WorkingCurve, CompositionError> {
        let (suspension, inhibition) = (self.suspension(), self.inhibition());
        let critical = match self.inhibition.attenuated_by {
            AttenuatedBy::All => suspension.critical_dose(&inhibition),
            AttenuatedBy::Photoinitiator => suspension.critical_dose_of_initiator(&inhibition),
        };
        WorkingCurve::new(critical, suspension.penetration_depth())
            .map_err(CompositionError::NoCurve)
    }

    /// Returns the inhibition that keeps the resin from curing.
    pub fn inhibition(&self) -> Inhibition {
        let of = &self.inhibition;
        Inhibition {
            inhibitor: of.inhibitor.value.mol_per_m3() / 1000.0,
            radicals_per_inhibitor: of.radicals_per_inhibitor.value,
            radicals_per_dye: of.radicals_per_dye.as_ref().map_or(0.0, |it| it.value),
            radicals_per_photon: of.radicals_per_photon.value,
            wavelength: self.wavelength(),
        }
    }

    /// Returns the share of its volume by which the suspension shrinks as it cures, if the
    /// composition has monomers that shrink (002 eq. 51 to 54).
    pub fn volume_shrinkage(&self) -> Option<f64> {
        let of = self.shrinkage.as_ref()?;
        let monomer = |it: &MonomerNumbers| {
            let monomer =
                Monomer { functionality: it.functionality, molar_mass: it.molar_mass_g_per_mol };
            (monomer, it.moles)
        };
        let monomers: Vec<_> = of.monomers.iter().map(monomer).collect();
        let filler = self.ceramic.as_ref().map_or(0.0, |it| it.share.value);
        // 002 eq. 52, with the filler's share of the volume as FL.
        let groups = shrinkage::groups_of_mixture(&monomers, of.density_g_per_cm3.value, filler);
        Some(shrinkage::volume_shrinkage(of.conversion()?, groups))
    }

    /// Returns the contrast of the refractive indices, if they are given (002 eq. 55).
    pub fn contrast(&self) -> Option<f64> {
        let of = self.ceramic.as_ref()?.refraction.as_ref()?;
        Some(refractive_contrast(of.ceramic.value, of.liquid.value))
    }

    /// Returns the material that the models make of it: a working curve by 002 eq. 57 and 58 or 59,
    /// and as constants that no cure model reads, the shrinkage (eq. 51 to 54) and the contrast of
    /// the refractive indices (eq. 55).
    ///
    /// # Errors
    /// Returns an error if the numbers give no working curve.
    pub fn material(&self) -> Result<Material, CompositionError> {
        let curve = self.working_curve()?;
        let of_dose = match self.inhibition.attenuated_by {
            AttenuatedBy::All => "equation 58",
            AttenuatedBy::Photoinitiator => "equation 59",
        };
        let model = |equation: &str| format!("002 {equation}, for the composition {}", self.name);
        let constant = |(name, share, equation): (&str, Option<f64>, &str)| {
            let constant = |share: f64| Constant {
                value: rounded(100.0 * share),
                unit: "%".to_owned(),
                source: model(equation),
            };
            share.map(|share| (name.to_owned(), constant(share)))
        };
        let constants = [
            ("volume-shrinkage", self.volume_shrinkage(), "equation 52"),
            ("refractive-contrast", self.contrast(), "equation 55"),
        ];
        Ok(Material {
            name: self.name.clone(),
            description: self.description.clone(),
            intensity: self.intensity.clone(),
            working_curve: Some(CurveNumbers {
                critical_dose: given(curve.critical_dose(), model(of_dose)),
                penetration_depth: given(curve.penetration_depth(), model("equation 57")),
                measured: None,
            }),
            constants: constants.into_iter().filter_map(constant).collect::<BTreeMap<_, _>>(),
            ..Material::default()
        })
    }
}

fn given<T: Quantity>(value: T, source: String) -> Given<T> {
    Given { value: T::of(rounded(value.number())), plus_minus: None, source }
}

/// A number to six digits: models are less exact than that.
fn rounded(number: f64) -> f64 {
    // Written and read back, the file has the digits that are shown.
    format!("{number:.5e}").parse().expect("a written number reads back")
}

#[cfg(test)]
#[path = "composition_tests.rs"]
mod tests;
