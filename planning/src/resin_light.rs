//! The light of a material.

use lamp_grayscale::material::{Material, MaterialError};
use lamp_grayscale::resin::Spread;
use thiserror::Error;

use crate::light::{IntensityOf, Light, SampleHeight};

/// Why doses do not follow from a material.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum NoLight {
    /// It does not state the sideways spread of light.
    #[error("{0} does not state how far light spreads sideways: add [spread] to its file")]
    Spread(String),
    /// It does not state the intensity of full white.
    #[error("{0} does not state how bright full white is: add [intensity] to its file")]
    Intensity(String),
    /// It does not state which dose cures to which depth.
    #[error("{0} does not state how deep a dose cures: add [working-curve] to its file")]
    WorkingCurve(String),
    /// A number is impossible.
    #[error(transparent)]
    Numbers(#[from] MaterialError),
}

impl Light {
    /// Returns the light of a material, with doses computed `at` a height of each layer.
    ///
    /// # Errors
    /// Returns an error if the material does not state how light spreads, how bright white is or
    /// which dose cures, or if one of its numbers is impossible.
    pub fn of(material: &Material, at: SampleHeight) -> Result<Self, NoLight> {
        let spread = material.spread()?.ok_or_else(|| NoLight::Spread(material.name.clone()))?;
        Self::spreading(material, spread, at)
    }

    /// Returns the light of a material as [`Self::of`] does, or, if the material does not state its
    /// spread, light that goes straight down.
    ///
    /// # Errors
    /// As [`Self::of`], except for a missing spread.
    pub fn of_any(material: &Material, at: SampleHeight) -> Result<Self, NoLight> {
        Self::spreading(material, material.spread()?.unwrap_or(Spread::NONE), at)
    }

    fn spreading(material: &Material, spread: Spread, at: SampleHeight) -> Result<Self, NoLight> {
        let name = || material.name.clone();
        let intensity = material.intensity.as_ref().ok_or_else(|| NoLight::Intensity(name()))?;
        let curve = material.working_curve()?.ok_or_else(|| NoLight::WorkingCurve(name()))?;
        Ok(Self {
            intensity: intensity.value,
            intensity_of: spread.pixel().map_or(IntensityOf::Field, IntensityOf::Pixel),
            critical_dose: curve.critical_dose(),
            penetration_depth: curve.penetration_depth(),
            spread: [spread.across(), spread.along()],
            gamma: material.gamma()?,
            at,
        })
    }
}

#[cfg(test)]
mod tests {
    use lamp_grayscale::resin::ExposureTime;
    use lamp_stack::{Catalogued, Dpi, Length};

    use super::*;
    use crate::light::LayerTime;

    #[test]
    fn a_material_of_001_gives_the_light_of_its_worked_example() {
        let light = Light::of(&Material::builtin("zsg-amber").unwrap(), SampleHeight::Top).unwrap();
        let layer =
            LayerTime { thickness: Length::from_um(11.2), time: ExposureTime::from_ms(1000.0) };
        let dpi = Dpi::new(25_400.0 / 11.2).unwrap();
        assert!(light.spread_pixels(dpi).iter().all(|sigma| (sigma - 13.0).abs() < 1e-12));
        for layer in &light.layers(dpi, &[layer; 3])[1..] {
            // Appendix A: a pixel of light 3 under E_c = 170; 10^-0.008 passes a layer.
            assert!((layer.own - 3.0 / 170.0).abs() < 1e-15, "{layer:?}");
            assert!((layer.passed - 10f64.powf(-0.008)).abs() < 1e-15, "{layer:?}");
        }
    }

    #[test]
    fn what_a_material_lacks_is_named() {
        let light = |name: &str| Light::of(&Material::builtin(name).unwrap(), SampleHeight::Top);
        assert!(matches!(light("lamp-suspension"), Err(NoLight::Spread(_))));
        let mut material = Material::builtin("zsg-amber").unwrap();
        material.working_curve = None;
        assert!(matches!(Light::of(&material, SampleHeight::Top), Err(NoLight::WorkingCurve(_))));
        material.intensity = None;
        let said = Light::of(&material, SampleHeight::Top).unwrap_err().to_string();
        assert!(said.starts_with("zsg-amber does not state how bright"), "{said}");
        material.spread = None;
        assert!(matches!(Light::of(&material, SampleHeight::Top), Err(NoLight::Spread(_))));
        let straight = Material::builtin("lamp-suspension").unwrap();
        let straight = Light::of_any(&straight, SampleHeight::Bottom).unwrap();
        assert_eq!(straight.spread.map(Length::um), [0.0; 2]);
        assert_eq!(straight.at, SampleHeight::Bottom);
    }
}
