//! The peaks of a lamp that has several, in compositions.

use lamp_stack::Length;
use serde::{Deserialize, Serialize};

use super::composition::{Composition, CompositionError};
use super::{Given, GivenNumber};
use crate::resin::{Absorptivity, plausible};

/// A peak of a lamp's spectrum, and what absorbs its light (002 section 3.4.2.4 and figure 60).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Peak {
    /// Where it is.
    pub wavelength: Given<Length>,
    /// The share of the light's power that it has; shares that do not sum to one count by their
    /// ratios.
    pub share: GivenNumber,
    /// The photoinitiator's absorptivity there, in powers of ten.
    pub photoinitiator: Given<Absorptivity>,
    /// The UV absorber's absorptivity there, if there is one.
    pub uv_absorber: Option<Given<Absorptivity>>,
}

/// Returns the mean of a number over the light of peaks, each with an additional weight.
pub(super) fn mean(
    peaks: &[Peak],
    weight: impl Fn(&Peak) -> f64,
    of: impl Fn(&Peak) -> f64,
) -> f64 {
    let weights = peaks.iter().map(|peak| peak.share.value * weight(peak));
    let sum: f64 = weights.clone().zip(peaks).map(|(weight, peak)| weight * of(peak)).sum();
    // Shares need not sum to one.
    sum / weights.sum::<f64>()
}

/// Checks that a composition states the light once: by a wavelength, with absorptivities there, or
/// by peaks, which have their own.
pub(super) fn check_light(of: &Composition) -> Result<(), CompositionError> {
    let light = |is_told, words| if is_told { Ok(()) } else { Err(CompositionError::Light(words)) };
    let substances = || [Some(&of.photoinitiator), of.uv_absorber.as_ref()].into_iter().flatten();
    if let Some(wavelength) = &of.wavelength {
        light(of.peaks.is_empty(), "give either a wavelength or peaks")?;
        light(
            substances().all(|it| it.absorptivity.is_some()),
            "photoinitiator and uv-absorber need their absorptivity at the wavelength",
        )?;
        return Ok(plausible::WAVELENGTH.check("wavelength", wavelength.value)?);
    }
    light(!of.peaks.is_empty(), "give the light's wavelength, or the lamp's peaks")?;
    light(
        substances().all(|it| it.absorptivity.is_none()),
        "give absorptivities with the peaks, not with photoinitiator and uv-absorber",
    )?;
    light(
        of.peaks.iter().all(|peak| peak.uv_absorber.is_some() == of.uv_absorber.is_some()),
        "each peak needs the uv-absorber's absorptivity, if there is one",
    )?;
    of.peaks.iter().try_for_each(|peak| {
        plausible::WAVELENGTH.check("peaks.wavelength", peak.wavelength.value)?;
        positive(peak.share.value, "peaks.share")?;
        plausible::ABSORPTIVITY.check("peaks.photoinitiator", peak.photoinitiator.value)?;
        let absorber = peak.uv_absorber.as_ref();
        absorber.map_or(Ok(()), |it| {
            Ok(plausible::ABSORPTIVITY.check_or_zero("peaks.uv-absorber", it.value)?)
        })
    })
}

fn positive(number: f64, what: &'static str) -> Result<(), CompositionError> {
    let is_fine = number > 0.0 && number.is_finite();
    if is_fine { Ok(()) } else { Err(CompositionError::Number(what, "above zero")) }
}
