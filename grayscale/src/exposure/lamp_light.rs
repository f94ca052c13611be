//! How bright a lamp is now, and a material under it.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use crate::material::{LawVariable, Material, MaterialError};
use crate::resin::{Intensity, OpticalDensity, QuantityError, plausible};

/// The light of full white now: a light, or a part of the material's own.
///
/// ```
/// use lamp_grayscale::exposure::LampLight;
/// use lamp_grayscale::material::Material;
/// use lamp_stack::Catalogued;
///
/// let lamp: LampLight = "75%".parse()?;
/// let (material, doubt) = lamp.material(&Material::builtin("lamp-suspension").unwrap())?;
/// assert_eq!(material.light()?.unwrap().mw_per_cm2(), 1200.0);
/// assert_eq!(doubt, None);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LampLight {
    /// A light.
    Light(Intensity),
    /// So many percent of the material's light.
    Percent(f64),
    /// The material's light through a filter.
    Filter(OpticalDensity),
}

/// Why a text is not the light of a lamp.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LampLightError {
    /// It is neither a light, nor a share of one, nor a filter.
    #[error(
        "`{0}` is not a light: write 1.2W/cm2, 75% of the material's (up to 1000%), or od0.3 (up \
         to od6) for a filter"
    )]
    NotALight(String),
    /// The lamp is dark.
    #[error("the intensity must be above zero")]
    Dark,
    /// No lamp gives such light.
    #[error("the intensity must be between 1e-6 and 1e9 mW/cm2")]
    Implausible,
    /// It is not an intensity.
    #[error(transparent)]
    Intensity(#[from] QuantityError),
}

/// Why a material is not known under a lamp.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LampError {
    /// The lamp's light is a part of the material's, which the material does not say.
    #[error("{0} does not state how bright full white is")]
    NoOwnLight(String),
    /// The numbers of the material's own light are impossible.
    #[error(transparent)]
    OwnLight(MaterialError),
    /// The material makes no model under the lamp.
    // No source: this message contains the problem's text.
    #[error("{material}: {problem}")]
    Under {
        /// The material's name.
        material: String,
        /// The impossible number.
        problem: MaterialError,
    },
}

/// Parses the light of full white, which is some.
///
/// # Errors
/// Returns an error if it is not an intensity, zero, or one that no lamp gives.
pub fn parse_lamp_light(text: &str) -> Result<Intensity, LampLightError> {
    match text.parse::<Intensity>()? {
        light if light.mw_per_cm2() == 0.0 => Err(LampLightError::Dark),
        light if plausible::INTENSITY.contains(&light) => Ok(light),
        _ => Err(LampLightError::Implausible),
    }
}

impl LampLight {
    /// Returns a material under this lamp, and a sentence on doubts about that, if there are some.
    ///
    /// # Errors
    /// Returns an error if the material does not say the light that this is a part of, or makes no
    /// model under this one ([`Material::under_lamp`]).
    pub fn material(self, material: &Material) -> Result<(Material, Option<String>), LampError> {
        let lamp = self.of(material)?;
        let under = material
            .under_lamp(lamp)
            .map_err(|problem| LampError::Under { material: material.name.clone(), problem })?;
        Ok((under, doubt(material, lamp)))
    }

    /// Returns a sentence on cure widths that are not known under this lamp, if there is one (002
    /// section 3.4.5).
    ///
    /// # Errors
    /// Returns an error if the material does not say the light that this is a part of.
    pub fn width_doubt(self, material: &Material) -> Result<Option<String>, LampError> {
        let lamp = self.of(material)?;
        let name = &material.name;
        if material.light().map_err(LampError::OwnLight)? == Some(lamp) {
            return Ok(None);
        }
        let Some(law) = material.law(LawVariable::Lamp) else {
            return Ok(Some(format!(
                "{name} does not state how its cure width follows the lamp ([[law]] over lamp): cure \
                 widths stay, though real ones move"
            )));
        };
        Ok((!law.holds(lamp.mw_per_cm2())).then(|| {
            format!(
                "cure widths of {name} were measured under {} to {} mW/cm2, and the lamp gives {}: \
                 they are extrapolated",
                law.least.at,
                law.most.at,
                shown(lamp)
            )
        }))
    }

    /// Returns the light of a wide field under this lamp.
    fn of(self, material: &Material) -> Result<Intensity, LampError> {
        let own = || {
            let light = material.light().map_err(LampError::OwnLight)?;
            light.ok_or_else(|| LampError::NoOwnLight(material.name.clone()))
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

/// Returns a sentence on a lamp under which the material was not measured.
fn doubt(material: &Material, lamp: Intensity) -> Option<String> {
    let name = &material.name;
    if !material.follows_lamp() {
        return Some(format!(
            "{name} does not state how its critical dose follows the lamp ([dimmed-lamp]): doses \
             stay, and times change"
        ));
    }
    let lights = material.dimmed_lamp.as_ref()?.lights?;
    (!material.knows_lamp(lamp)).then(|| {
        format!(
            "the lamp gives {}, but {name} was measured under {} to {}: its numbers are \
             extrapolated",
            shown(lamp),
            lights.from.mw_per_cm2(),
            lights.to
        )
    })
}

/// A light to five digits: shares of a light are seldom round.
fn shown(lamp: Intensity) -> Intensity {
    format!("{:.4e}", lamp.mw_per_cm2()).parse().map_or(lamp, Intensity::from_mw_per_cm2)
}

impl FromStr for LampLight {
    type Err = LampLightError;

    /// Parses a light, a percentage up to 1000, or an optical density up to 6.
    ///
    /// # Errors
    /// Returns an error if the text is something else.
    fn from_str(text: &str) -> Result<Self, LampLightError> {
        let wrong = || LampLightError::NotALight(text.to_owned());
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
        parse_lamp_light(text).map(Self::Light)
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

    fn parsed(text: &str) -> Result<LampLight, LampLightError> {
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
            let found = light.of(&lamp).unwrap().mw_per_cm2();
            assert!((found - mw).abs() < 1e-5, "{text}: {found}");
        }
        for text in ["", "0W/cm2", "1.2", "0%", "-5%", "2000%", "od", "od-1", "od7", "nan%"] {
            assert!(parsed(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_lamp_that_the_material_does_not_know_is_told() {
        let told = |name: &str, text: &str| {
            let material = Material::builtin(name).unwrap();
            parsed(text).unwrap().material(&material).unwrap().1
        };
        assert_eq!(told("lamp-suspension", "75%"), None);
        let weak = told("lamp-suspension", "25%").unwrap();
        let words = "the lamp gives 400 mW/cm2, but lamp-suspension was measured under 512 to 1600";
        assert!(weak.starts_with(words), "{weak}");
        assert!(told("pegda-mw700", "50%").unwrap().contains("[dimmed-lamp]"));
        let material = Material::builtin("sl-5510").unwrap();
        let unknown = parsed("50%").unwrap().material(&material);
        assert_eq!(unknown, Err(LampError::NoOwnLight("sl-5510".to_owned())));
    }
}
