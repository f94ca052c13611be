//! Exposures of layers: times, doses and gray levels by a material or a table of times.

mod lamp_light;
mod measured_doses;

use lamp_stack::{DepthLevels, FadingLevels, Length};
use thiserror::Error;

pub use lamp_light::{LampError, LampLight, LampLightError, parse_lamp_light};
pub use measured_doses::MeasuredDoses;

use crate::calibrate::ExposureTimes;
use crate::material::{Material, ResinError};
use crate::resin::{CureError, CureModel, Dose, ExposureTime, Intensity, depth_levels};

/// The exposure of layers by their thickness.
///
/// ```
/// use lamp_grayscale::exposure::Exposure;
/// use lamp_grayscale::material::Material;
/// use lamp_stack::{Catalogued, Length};
///
/// let material = Material::builtin("lamp-suspension").unwrap();
/// // White cures half as deep again as the layer, under the lamp of the material.
/// let exposure = Exposure::by_material(material, None, 1.5)?;
/// assert_eq!(exposure.time(Length::from_um(100.0))?.ms().round(), 172.0);
/// # Ok::<(), lamp_grayscale::exposure::ExposureError>(())
/// ```
#[derive(Debug)]
pub struct Exposure {
    /// The name of the material or table, for messages.
    name: String,
    rule: Rule,
}

#[derive(Debug)]
enum Rule {
    Resin(Box<Curing>),
    Table(ExposureTimes),
}

/// How white cures layers.
#[derive(Debug)]
struct Curing {
    material: Material,
    /// Unknown where only doses are known.
    light: Option<Intensity>,
    model: Box<dyn CureModel>,
    overcure: f64,
    doses: MeasuredDoses,
    lamp_doubt: Option<String>,
}

/// Why layers have no exposure.
// No sources below `Lamp`: these messages contain the problem's text.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ExposureError {
    /// The material has no model, or no light.
    #[error(transparent)]
    Resin(#[from] ResinError),
    /// The material is not known under the lamp.
    #[error(transparent)]
    Lamp(#[from] LampError),
    /// The model says no dose for a layer, or no gray levels in it.
    #[error("{material}: {problem}")]
    Cure {
        /// The material's name.
        material: String,
        /// The model's error.
        problem: CureError,
    },
    /// The material does not say how light fades.
    #[error("{material}: {problem}")]
    Fading {
        /// The material's name.
        material: String,
        /// The data that it lacks.
        problem: ResinError,
    },
    /// The table has no time for a thickness.
    #[error("{table}: the table covers {least} to {most}, not {thickness}")]
    OutsideTable {
        /// The table's name.
        table: String,
        /// Its least thickness.
        least: Length,
        /// Its greatest thickness.
        most: Length,
        /// The thickness asked for.
        thickness: Length,
    },
    /// A table of times says no gray levels.
    #[error("{0}: gray levels need a material, not exposure times")]
    NoLevels(String),
}

impl Exposure {
    /// Creates the exposure in which full white cures `overcure` times a layer's thickness (002
    /// algorithm 15, line 13), under the material's own lamp or another.
    ///
    /// # Errors
    /// Returns an error if the material has no cure model, or its numbers are impossible under the
    /// lamp. Without a light there are doses and gray levels, but no times.
    pub fn by_material(
        material: Material,
        lamp: Option<LampLight>,
        overcure: f64,
    ) -> Result<Self, ExposureError> {
        let (material, lamp_doubt) = match lamp {
            Some(lamp) => lamp.material(&material)?,
            None => (material, None),
        };
        let model = material.cure_model()?;
        let light = material.light().map_err(ResinError::from)?;
        let doses = MeasuredDoses::of_depths(&material);
        let name = material.name.clone();
        let curing = Curing { material, light, model, overcure, doses, lamp_doubt };
        Ok(Self { name, rule: Rule::Resin(Box::new(curing)) })
    }

    /// Creates the exposure of a table of times, with the name that messages give it.
    pub fn by_table(name: impl Into<String>, times: ExposureTimes) -> Self {
        Self { name: name.into(), rule: Rule::Table(times) }
    }

    /// Returns the material, under its lamp as it is now, unless a table of times decides.
    pub fn material(&self) -> Option<&Material> {
        match &self.rule {
            Rule::Resin(curing) => Some(&curing.material),
            Rule::Table(_) => None,
        }
    }

    /// Checks that a layer has an exposure. Without a light, its dose is enough.
    ///
    /// # Errors
    /// Returns an error if the material or the table does not say it.
    pub fn check(&self, thickness: Length) -> Result<(), ExposureError> {
        match &self.rule {
            Rule::Resin(curing) if curing.light.is_none() => curing.dose(thickness).map(drop),
            _ => self.time(thickness).map(drop),
        }
    }

    /// Checks that exposures have times, and not only doses.
    ///
    /// # Errors
    /// Returns an error if the material does not say how bright white is.
    pub fn check_light(&self) -> Result<(), ExposureError> {
        match &self.rule {
            Rule::Resin(curing) => Ok(curing.light().map(drop)?),
            Rule::Table(_) => Ok(()),
        }
    }

    /// Returns the exposure time of a layer, rounded to the microsecond.
    ///
    /// # Errors
    /// Returns an error if the material or the table does not say it.
    pub fn time(&self, thickness: Length) -> Result<ExposureTime, ExposureError> {
        match &self.rule {
            Rule::Resin(curing) => curing.time(thickness),
            Rule::Table(times) => {
                let thickness = thickness.to_whole_nm();
                times.of(thickness).map(to_whole_us).ok_or_else(|| {
                    let ([least, most], table) = (times.limits(), self.name.clone());
                    ExposureError::OutsideTable { table, least, most, thickness }
                })
            }
        }
    }

    /// Returns the gray level of each depth in layers of one thickness.
    ///
    /// # Errors
    /// Returns an error if the material does not say them; a table of times never does.
    pub fn levels(&self, thickness: Length) -> Result<DepthLevels, ExposureError> {
        let curing = self.curing()?;
        let levels = depth_levels(&*curing.model, curing.white(thickness)?);
        levels.map_err(|problem| curing.failed(problem))
    }

    /// Returns the light that each gray level leaves in layers of one thickness, where doses add
    /// up.
    ///
    /// # Errors
    /// Returns an error if the material does not say how light fades; a table of times never does.
    pub fn fading_levels(&self, thickness: Length) -> Result<FadingLevels, ExposureError> {
        let curing = self.curing()?;
        let fading = curing
            .material
            .fading()
            .map_err(|problem| ExposureError::Fading { material: self.name.clone(), problem })?;
        Ok(fading.levels(curing.time(thickness)?))
    }

    /// Returns sentences on a lamp, and on doses that layers of these thicknesses take, that the
    /// material was not measured at.
    pub fn doubts(&self, thicknesses: impl Iterator<Item = Length>) -> Vec<String> {
        let Rule::Resin(curing) = &self.rule else { return Vec::new() };
        // Thicknesses without a dose are errors elsewhere.
        thicknesses.flat_map(|um| curing.white(um)).for_each(|dose| curing.doses.see(dose));
        curing.lamp_doubt.clone().into_iter().chain(curing.doses.doubt("layers")).collect()
    }

    /// Returns what cures gray levels.
    fn curing(&self) -> Result<&Curing, ExposureError> {
        match &self.rule {
            Rule::Resin(curing) => Ok(curing),
            Rule::Table(_) => Err(ExposureError::NoLevels(self.name.clone())),
        }
    }
}

impl Curing {
    fn light(&self) -> Result<Intensity, ResinError> {
        self.light.ok_or_else(|| ResinError::NoLight(self.material.name.clone()))
    }

    /// Returns the dose that cures a layer.
    fn dose(&self, thickness: Length) -> Result<Dose, ExposureError> {
        // Thicknesses are sums and differences of heights: their rounding must not reach the times.
        let depth = Length::from_um(thickness.to_whole_nm().um() * self.overcure);
        self.model.dose(depth).map_err(|problem| self.failed(problem))
    }

    fn time(&self, thickness: Length) -> Result<ExposureTime, ExposureError> {
        let light = self.light()?;
        Ok(to_whole_us(self.dose(thickness)? / light))
    }

    /// Returns the dose that a layer gets, by its rounded time where there is a light.
    fn white(&self, thickness: Length) -> Result<Dose, ExposureError> {
        match self.light {
            Some(light) => Ok(light * self.time(thickness)?),
            None => self.dose(thickness),
        }
    }

    fn failed(&self, problem: CureError) -> ExposureError {
        ExposureError::Cure { material: self.material.name.clone(), problem }
    }
}

/// Rounds as stacks record times: gray levels are for the time that the printer reads.
fn to_whole_us(time: ExposureTime) -> ExposureTime {
    ExposureTime::from_ms((time.ms() * 1000.0).round() / 1000.0)
}

#[cfg(test)]
mod tests {
    use lamp_stack::Catalogued;

    use super::*;
    use crate::calibrate::CsvTable;

    fn times() -> Exposure {
        let table = CsvTable::parse("thickness_um,exposure_ms\n25,120\n100,300\n").unwrap();
        Exposure::by_table("times.csv", ExposureTimes::new(&table).unwrap())
    }

    #[test]
    fn a_table_says_times_and_no_levels() {
        let exposure = times();
        assert_eq!(exposure.time(Length::from_um(100.0)).unwrap().ms(), 300.0);
        let outside = exposure.check(Length::from_um(101.0)).unwrap_err().to_string();
        assert!(outside.starts_with("times.csv: the table covers"), "{outside}");
        assert!(matches!(exposure.levels(Length::from_um(50.0)), Err(ExposureError::NoLevels(_))));
        assert!(exposure.check_light().is_ok() && exposure.material().is_none());
    }

    #[test]
    fn without_a_light_there_are_levels_and_no_times() {
        let material = Material { intensity: None, ..Material::builtin("sl-5510").unwrap() };
        let exposure = Exposure::by_material(material, None, 1.0).unwrap();
        let layer = Length::from_um(100.0);
        let no_light = ExposureError::Resin(ResinError::NoLight("sl-5510".to_owned()));
        assert_eq!(exposure.time(layer), Err(no_light.clone()));
        assert_eq!(exposure.check_light(), Err(no_light));
        assert!(exposure.check(layer).is_ok() && exposure.levels(layer).is_ok());
    }

    #[test]
    fn times_are_whole_microseconds() {
        let material = Material::builtin("lamp-suspension").unwrap();
        let exposure = Exposure::by_material(material, Some("75%".parse().unwrap()), 1.3).unwrap();
        let us = exposure.time(Length::from_um(37.0)).unwrap().ms() * 1000.0;
        assert!((us - us.round()).abs() < 1e-6, "{us}");
        assert_eq!(exposure.doubts(std::iter::empty()), Vec::<String>::new());
    }
}
