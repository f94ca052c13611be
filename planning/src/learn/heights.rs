//! The heights of down-facing faces.
//!
//! Light that passes a face cures below it, down to the depth where its dose is the critical one. A
//! dose larger by a factor reaches deeper by the factor's logarithm times the penetration depth.

use lamp_stack::Length;
use thiserror::Error;

use crate::light::{Light, SampleHeight};
use crate::speed::TimedPart;

/// Why a height gives no information.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum FaceError {
    /// The part has no down-facing face at the place.
    #[error("the part has no face there that looks down")]
    NoFace,
}

/// Returns the layer, counted from the light, whose bottom is a down-facing face of the part.
///
/// # Errors
/// Returns an error if no such face is within half a layer.
pub fn face_at(part: &TimedPart, pixel: [u32; 2], z: Length) -> Result<usize, FaceError> {
    let is_face = |layer: &usize| {
        let below = layer + 1;
        let ends = below == part.layers().len() || !part.is_wanted(below, pixel);
        part.is_wanted(*layer, pixel) && ends
    };
    let away = |layer: usize| {
        let layer = &part.layers()[layer];
        (layer.z.um() - z.um()).abs() / layer.thickness.um()
    };
    let faces = (0..part.layers().len()).filter(is_face);
    let nearest = faces.min_by(|&a, &b| away(a).total_cmp(&away(b)));
    nearest.filter(|&layer| away(layer) <= 0.5).ok_or(FaceError::NoFace)
}

/// Returns the height down to which the resin is cured at a down-facing face, given the doses at its
/// place and the layer above it. Layers are counted from the light. Without cured
/// resin above the face there is no height.
pub fn height_of(part: &TimedPart, doses: &[f64], light: &Light, face: usize) -> Option<Length> {
    height_with(part, doses, 1.0, light, face)
}

/// Returns the same where all doses are larger by a factor.
pub(super) fn height_with(
    part: &TimedPart,
    doses: &[f64],
    factor: f64,
    light: &Light,
    face: usize,
) -> Option<Length> {
    let is_cured = |&dose: &f64| factor * dose >= 1.0;
    let down = doses[face..].iter().take_while(|dose| is_cured(dose)).count();
    let last = match down {
        0 => doses[..face].iter().rposition(is_cured)?,
        cured => face + cured - 1,
    };
    let of_last = &part.layers()[last];
    let above = match light.at {
        SampleHeight::Top => 1.0,
        SampleHeight::Middle => 0.5,
        SampleHeight::Bottom => 0.0,
    };
    let sampled_um = of_last.z.um() + above * of_last.thickness.um();
    let height_um = sampled_um - light.penetration_depth.um() * (factor * doses[last]).ln();
    Some(Length::from_um(height_um))
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::cavity_staircase;

    use super::*;
    use crate::speed::Simulation;
    use crate::speed::testing::{part, pegda};

    #[test]
    fn a_face_is_cured_down_to_the_critical_dose() {
        let (part, light) = (part(&cavity_staircase(1)), pegda(0.0));
        let simulation = Simulation::new(&part, &light, 1 << 30).unwrap();
        // One flash of the topmost layer: it reaches D_p ln(E / E_c) below the top.
        let mut times = vec![0.0; 60];
        times[0] = 100.0 * 7.266 / 7.394;
        let top = 60.0 * 100.0;
        let face = face_at(&part, [40, 7], Length::from_um(4500.0)).unwrap();
        assert_eq!(face, 14);
        let found =
            |times: &[f64]| height_of(&part, &simulation.doses_at([40, 7], times), &light, face);
        let height = found(&times).unwrap();
        let expected = top - light.penetration_depth.um() * 100.0_f64.ln();
        assert!((height.um() - expected).abs() < 0.01, "{height} {expected}");
        times[0] = 0.1;
        assert_eq!(found(&times), None);
        for (pixel, z_um) in [([40, 7], 4400.0), ([2, 7], 4500.0), ([99, 7], 4500.0)] {
            let face = face_at(&part, pixel, Length::from_um(z_um));
            assert_eq!(face, Err(FaceError::NoFace), "{pixel:?}");
        }
    }
}
