//! The option that says how bright the lamp is now.

use clap::Args;
use lamp_grayscale::exposure::{LampError, LampLight};
use lamp_grayscale::material::Material;
use serde::{Deserialize, Serialize};

use lamp_pipeline::words::optional;

/// The actual light of a lamp.
#[derive(Args, Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub(crate) struct LampOption {
    /// Actual intensity of full white, if the lamp has aged or has a filter: 1.2W/cm2, 75% of the
    /// material's, or od0.3 for a filter of that optical density. The material's [dimmed-lamp]
    /// gives the critical dose [default: the material's]
    #[arg(long, value_name = "LIGHT", requires = "material")]
    #[serde(with = "optional")]
    lamp_intensity: Option<LampLight>,
}

impl LampOption {
    /// Returns the light, if it is not the material's.
    pub(crate) fn light(&self) -> Option<LampLight> {
        self.lamp_intensity
    }

    /// Returns a material under the lamp as it is now, and a sentence on doubts about that.
    pub(crate) fn material(
        &self,
        material: Material,
    ) -> Result<(Material, Option<String>), LampError> {
        match self.lamp_intensity {
            Some(light) => light.material(&material),
            None => Ok((material, None)),
        }
    }

    /// Returns the option in a form that all its spellings share.
    pub(crate) fn canonical(&self) -> Option<String> {
        self.lamp_intensity.map(|light| light.to_string())
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Catalogued;

    use super::*;

    #[test]
    fn without_the_option_the_material_stays() {
        let material = Material::builtin("sl-5510").unwrap();
        let under = LampOption::default().material(material.clone());
        assert_eq!(under, Ok((material, None)));
    }
}
