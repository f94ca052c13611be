//! The option that says how bright the lamp is now.

use std::fmt;
use std::str::FromStr;

use anyhow::anyhow;
use clap::Args;
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::{Intensity, OpticalDensity};
use serde::{Deserialize, Serialize};

use crate::exit::Exit;
use crate::options::parse_light;
use crate::recorded::optional;

/// The present light of a lamp.
#[derive(Args, Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub(crate) struct LampOption {
    /// Light of full white now, if the lamp has aged or shines through a filter: 1.2W/cm2, 75% of
    /// the material's, or od0.3 for a filter of that optical density. The critical dose follows by
    /// the material's [dimmed-lamp] [default: the material's]
    #[arg(long, value_name = "LIGHT", requires = "material")]
    #[serde(with = "optional")]
    lamp_intensity: Option<LampLight>,
}

impl LampOption {
    /// Returns a material under the lamp as it is now, and what is doubtful about that.
    pub(crate) fn material(&self, material: Material) -> Result<(Material, Option<String>), Exit> {
        let Some(light) = self.lamp_intensity else { return Ok((material, None)) };
        let lamp = light.of(&material)?;
        let under = material.under_lamp(lamp);
        let under = under.map_err(|error| Exit::Failed(error.into()).at(material.name.clone()))?;
        Ok((under, doubt(&material, lamp)))
    }

    /// Returns the option in a form that all its spellings share.
    pub(crate) fn canonical(&self) -> Option<String> {
        self.lamp_intensity.map(|light| light.to_string())
    }
}

fn doubt(material: &Material, lamp: Intensity) -> Option<String> {
    let name = &material.name;
    if !material.follows_lamp() {
        return Some(format!(
            "{name} does not say how its critical dose follows the lamp ([dimmed-lamp]): doses stay, \
             and times change"
        ));
    }
    let lights = material.dimmed_lamp.as_ref()?.lights?;
    (!material.knows_lamp(lamp)).then(|| {
        let digits = format!("{:.4e}", lamp.mw_per_cm2());
        let shown = digits.parse().map_or(lamp, Intensity::from_mw_per_cm2);
        format!(
            "the lamp gives {shown}, but {name} was measured under {} to {}: its numbers are \
             extrapolated",
            lights.from.mw_per_cm2(),
            lights.to
        )
    })
}

/// A light, or a part of the material's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum LampLight {
    Light(Intensity),
    Percent(f64),
    Filter(OpticalDensity),
}

impl LampLight {
    /// Returns the light of a wide field under this lamp.
    fn of(self, material: &Material) -> Result<Intensity, Exit> {
        let own = || {
            let light = material.light().map_err(anyhow::Error::new)?;
            light.ok_or_else(|| {
                let name = &material.name;
                Exit::Failed(anyhow!(
                    "{name} does not say how bright full white is: give --lamp-intensity as 1.2W/cm2"
                ))
            })
        };
        Ok(match self {
            Self::Light(light) => light,
            Self::Percent(percent) => {
                Intensity::from_mw_per_cm2(own()?.mw_per_cm2() * percent / 100.0)
            }
            Self::Filter(density) => density.pass(own()?),
        })
    }
}

impl FromStr for LampLight {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "`{text}` is not a light: write 1.2W/cm2, 75% of the material's (up to 1000%), or \
                 od0.3 (up to od6) for a filter"
            )
        };
        let lower = text.to_lowercase();
        if let Some(density) = lower.strip_prefix("od") {
            let density = density.trim().parse().ok().and_then(OpticalDensity::new);
            return density.filter(|od| od.get() <= 6.0).map(Self::Filter).ok_or_else(wrong);
        }
        if let Some(percent) = text.strip_suffix('%') {
            let percent: f64 = percent.trim().parse().map_err(|_| wrong())?;
            let fine = percent > 1e-4 && percent <= 1000.0;
            return if fine { Ok(Self::Percent(percent)) } else { Err(wrong()) };
        }
        parse_light(text).map(Self::Light)
    }
}

/// Without blanks, as commands of stacks are words.
impl fmt::Display for LampLight {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Light(light) => write!(f, "{}mW/cm2", light.mw_per_cm2()),
            Self::Percent(percent) => write!(f, "{percent}%"),
            Self::Filter(density) => write!(f, "od{}", density.get()),
        }
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Catalogued;

    use super::*;

    fn parsed(text: &str) -> Result<LampLight, String> {
        text.parse()
    }

    #[test]
    fn lights_as_people_write_them() {
        let lamp = Material::builtin("lamp-suspension").unwrap();
        for (text, written, mw) in [
            ("1.2W/cm2", "1200mW/cm2", 1200.0),
            ("800 mW/cm2", "800mW/cm2", 800.0),
            ("75%", "75%", 1200.0),
            // 002 section 3.3.8 has 50.1%.
            ("OD 0.3", "od0.3", 801.899_574),
        ] {
            let light = parsed(text).unwrap();
            assert_eq!(light.to_string(), written);
            assert_eq!(parsed(written), Ok(light));
            let found = light.of(&lamp).map_err(|_| ()).unwrap().mw_per_cm2();
            assert!((found - mw).abs() < 1e-5, "{text}: {found}");
        }
        for text in ["", "0W/cm2", "1.2", "0%", "-5%", "2000%", "od", "od-1", "od7", "nan%"] {
            assert!(parsed(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_lamp_that_the_material_does_not_know_is_told() {
        let option = |text: &str| LampOption { lamp_intensity: Some(parsed(text).unwrap()) };
        let told = |name: &str, text: &str| {
            let material = Material::builtin(name).unwrap();
            option(text).material(material).map_err(|_| ()).unwrap().1
        };
        assert_eq!(told("lamp-suspension", "75%"), None);
        let weak = told("lamp-suspension", "25%").unwrap();
        let words = "the lamp gives 400 mW/cm2, but lamp-suspension was measured under 512 to 1600";
        assert!(weak.starts_with(words), "{weak}");
        assert!(told("pegda-mw700", "50%").unwrap().contains("[dimmed-lamp]"));
        let none = LampOption::default().material(Material::builtin("sl-5510").unwrap());
        assert!(none.map_err(|_| ()).unwrap().1.is_none());
    }
}
