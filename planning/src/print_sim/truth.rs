//! How a machine and its resin differ from a material's numbers, as TOML files.

use std::str::FromStr;

use lamp_grayscale::resin::{Concentration, Dose, Intensity, Quantity};
use lamp_stack::{Length, TomlError, read_toml};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

use super::error::{PrintSimError, TruthError};
use super::field::FieldKind;
use crate::light::{IntensityOf, Light, LightError};

/// How a machine and its resin differ from the numbers of a material.
///
/// ```
/// use lamp_planning::print_sim::Truth;
///
/// let truth = Truth::parse(
///     "penetration-depth = '+25%'\ncritical-dose = '-15%'\nlight = '+10%'\nspread = '0.1 mm'",
/// )?;
/// assert_eq!(truth.material, None);
/// # Ok::<(), lamp_planning::print_sim::TruthError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct Truth {
    /// The name or the file of the material that the other numbers change. Without it, the job's
    /// material is changed.
    pub material: Option<String>,
    /// The depth over which light fades by e.
    pub penetration_depth: TrueNumber<Length>,
    /// The dose that cures.
    pub critical_dose: TrueNumber<Dose>,
    /// The light of full white.
    pub light: TrueNumber<Intensity>,
    /// The standard deviation of the spread of light, along rows and along columns. A change of the
    /// spread leaves the light of a wide field as it is.
    pub spread: TrueNumber<Length>,
    /// The oxygen that is dissolved before exposure, for kinetics.
    pub oxygen: TrueNumber<Concentration>,
    /// The conversion where resin is solid, for kinetics.
    pub critical_conversion: Change,
    /// The change of the light from each print to the next.
    pub drift: Change,
    /// The file of a picture of the light of a wide white field.
    pub flat_field: Option<String>,
    /// The file of a camera's picture of the light of a layer, which all layers have.
    pub layer_picture: Option<String>,
}

/// A change of a number, as the factor that it is multiplied by: `+25%` is 1.25.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change(f64);

/// A number of a truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TrueNumber<T> {
    /// The material's number, changed.
    Changed(Change),
    /// Another number.
    Value(T),
}

impl Change {
    /// Returns the factor.
    pub fn factor(self) -> f64 {
        self.0
    }
}

impl Default for Change {
    fn default() -> Self {
        Self(1.0)
    }
}

impl FromStr for Change {
    type Err = String;

    /// Parses a share with its sign: `+25%` or `-15%`.
    ///
    /// # Errors
    /// Returns an error if the sign, the percent sign or a number above -100 is missing.
    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        // Without a sign, 110% could be of the material's number.
        let signed = text.strip_suffix('%').filter(|number| number.starts_with(['+', '-']));
        let percent = signed.and_then(|number| number.trim().parse::<f64>().ok());
        match percent {
            Some(percent) if percent > -100.0 && percent <= 1000.0 => {
                Ok(Self(1.0 + percent / 100.0))
            }
            _ => Err(format!(
                "`{text}` is not a change above -100% and up to +1000%: write +25% or -15%"
            )),
        }
    }
}

impl<T> Default for TrueNumber<T> {
    fn default() -> Self {
        Self::Changed(Change::default())
    }
}

impl<T: Quantity> TrueNumber<T> {
    /// Returns the number that is true, given the material's.
    pub(super) fn of(self, material: T) -> T {
        match self {
            Self::Changed(change) => T::of(material.number() * change.factor()),
            Self::Value(value) => value,
        }
    }
}

impl<'de> Deserialize<'de> for Change {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        String::deserialize(from)?.parse().map_err(D::Error::custom)
    }
}

impl<'de, T: Quantity> Deserialize<'de> for TrueNumber<T> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let text = String::deserialize(from)?;
        if text.trim_end().ends_with('%') {
            return text.parse().map(Self::Changed).map_err(D::Error::custom);
        }
        let value = text.parse().map(Self::Value).map_err(|_| {
            format!("`{text}` is neither a change nor a value: write +25%, -15% or {}", T::EXAMPLE)
        });
        value.map_err(D::Error::custom)
    }
}

impl Truth {
    /// Reads a truth from TOML.
    ///
    /// # Errors
    /// Returns an error if the text is not TOML, a key is unknown or a value is wrong.
    pub fn parse(text: &str) -> Result<Self, TruthError> {
        read_toml(text).map_err(|TomlError { line, path, problem }| match path {
            None => TruthError::Syntax { line, problem },
            Some(_) => TruthError::Key { line, problem },
        })
    }

    /// Returns the file of the picture that is the light, and the kind of the picture.
    ///
    /// # Errors
    /// Returns an error if there are two, or if the truth states the spread that a picture shows.
    pub fn field_file(&self) -> Result<Option<(FieldKind, &str)>, PrintSimError> {
        match (&self.flat_field, &self.layer_picture) {
            (Some(_), Some(_)) => Err(PrintSimError::TwoFields),
            (None, Some(_)) if self.spread != TrueNumber::default() => {
                Err(PrintSimError::SpreadTwice)
            }
            (Some(word), None) => Ok(Some((FieldKind::FlatField, word))),
            (None, Some(word)) => Ok(Some((FieldKind::Layer, word))),
            (None, None) => Ok(None),
        }
    }

    /// Refuses the numbers that only kinetics have.
    pub(super) fn check_doses(&self) -> Result<(), PrintSimError> {
        if self.oxygen != TrueNumber::default() {
            return Err(PrintSimError::OtherModel("oxygen"));
        }
        if self.critical_conversion != Change::default() {
            return Err(PrintSimError::OtherModel("critical-conversion"));
        }
        Ok(())
    }

    /// Refuses the number that kinetics do not have.
    pub(super) fn check_kinetics(&self) -> Result<(), PrintSimError> {
        match self.critical_dose == TrueNumber::default() {
            true => Ok(()),
            false => Err(PrintSimError::OtherModel("critical-dose")),
        }
    }

    /// Returns the light of a print, from 0, given the light of the material.
    ///
    /// # Errors
    /// Returns an error if a number is impossible.
    pub fn light(&self, material: &Light, print: usize) -> Result<Light, LightError> {
        let spread = material.spread.map(|sigma| self.spread.of(sigma));
        let areas = [&material.spread, &spread].map(|[x, y]| x.um() * y.um());
        // Where the intensity is of one pixel alone, a wider spread would brighten the field.
        let narrowed = match material.intensity_of {
            IntensityOf::Pixel(_) if areas.iter().all(|area| *area > 0.0) => areas[0] / areas[1],
            _ => 1.0,
        };
        let drifted = self.drift.factor().powf(print as f64);
        let intensity = self.light.of(material.intensity).mw_per_cm2() * narrowed * drifted;
        let light = Light {
            intensity: Intensity::from_mw_per_cm2(intensity),
            critical_dose: self.critical_dose.of(material.critical_dose),
            penetration_depth: self.penetration_depth.of(material.penetration_depth),
            spread,
            ..*material
        };
        light.check()?;
        Ok(light)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::speed::testing::pegda;

    #[test]
    fn numbers_are_changes_or_values() {
        let text = "penetration-depth = '+25%'\ncritical-dose = '6 mJ/cm2'\nlight = '-10 %'\n\
                    spread = '0.1mm'\ndrift = '+2%'\n";
        let truth = Truth::parse(&text.replace(" %", "%")).unwrap();
        let (model, real) = (pegda(50.0), truth.light(&pegda(50.0), 2).unwrap());
        let depths = [real, model].map(|light| light.penetration_depth.um());
        assert!((depths[0] / depths[1] - 1.25).abs() < 1e-12);
        assert_eq!(real.critical_dose.mj_per_cm2(), 6.0);
        let light = 0.9 * 1.02 * 1.02 * model.intensity.mw_per_cm2();
        assert!((real.intensity.mw_per_cm2() - light).abs() < 1e-12);
        assert_eq!(real.spread.map(Length::um), [100.0; 2]);
        // Nothing stated, nothing changed.
        assert_eq!(Truth::parse("").unwrap().light(&model, 7).unwrap(), model);
    }

    #[test]
    fn a_wider_spread_leaves_a_wide_field_as_bright() {
        let of_pixel =
            Light { intensity_of: IntensityOf::Pixel(Length::from_um(10.0)), ..pegda(50.0) };
        let real = Truth::parse("spread = '+100%'").unwrap().light(&of_pixel, 0).unwrap();
        assert_eq!(real.intensity.mw_per_cm2(), of_pixel.intensity.mw_per_cm2() / 4.0);
        let of_field = Truth::parse("spread = '+100%'").unwrap().light(&pegda(50.0), 0).unwrap();
        assert_eq!(of_field.intensity, pegda(50.0).intensity);
    }

    #[test]
    fn wrong_keys_and_values_are_named_with_their_lines() {
        let refused = |text: &str| Truth::parse(text).unwrap_err().to_string();
        let share = refused("light = '+1%'\npenetration-depth = '25%'\n");
        assert_eq!(
            share,
            "line 2: `25%` is not a change above -100% and up to +1000%: write +25% or -15%"
        );
        let less = refused("light = '-100%'\n");
        assert!(less.starts_with("line 1: `-100%` is not a change"), "{less}");
        let unit = refused("critical-dose = '7'\n");
        assert!(unit.ends_with("write +25%, -15% or 131.5 mJ/cm2"), "{unit}");
        let key = refused("\nblur = '0.1mm'\n");
        assert!(key.starts_with("line 2: unknown key `blur`"), "{key}");
        assert!(refused("light =").starts_with("line 1: "));
        let zero = Truth::parse("critical-dose = '0 mJ/cm2'").unwrap();
        let impossible = zero.light(&pegda(50.0), 0).unwrap_err();
        assert_eq!(impossible, LightError::NotPositive("the critical dose"));
    }
}
