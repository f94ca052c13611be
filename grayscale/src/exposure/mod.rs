//! Exposures of layers: times, doses and gray levels by a material or a table of times.

mod lamp_light;
mod measured_doses;

use lamp_stack::{DepthLevels, FadingLevels, Length, round_significant};
use thiserror::Error;

pub use lamp_light::{LampError, LampLight, LampLightError, parse_lamp_light};
pub use measured_doses::MeasuredDoses;

use crate::calibrate::ExposureTimes;
use crate::material::{Material, ResinError};
use crate::resin::{
    CureError, CureModel, Dose, ExposureTime, Intensity, WidthLine, broadening_depth, depth_levels,
};

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
    /// algorithm 15, line 13), under the material's own lamp or another. `None` is the material's own
    /// [overcure](Material::overcure).
    ///
    /// # Errors
    /// Returns an error if the material has no cure model, or its numbers are impossible under the
    /// lamp. Without a light there are doses and gray levels, but no times.
    pub fn by_material(
        material: Material,
        lamp: Option<LampLight>,
        overcure: impl Into<Option<f64>>,
    ) -> Result<Self, ExposureError> {
        let overcure = match overcure.into() {
            Some(overcure) => overcure,
            None => material.overcure().map_err(ResinError::from)?,
        };
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

    /// Returns how deep full white cures a layer, in layers: the cure depth of its dose over its
    /// thickness. Above 1 it bonds to the layer below (002 section 3.4.1). A table of times does not
    /// say it.
    ///
    /// # Errors
    /// Returns an error if the material gives no dose of the layer.
    pub fn layers_cured(&self, thickness: Length) -> Result<Option<f64>, ExposureError> {
        let depth = self.dose(thickness)?.and_then(|dose| self.depth(dose));
        Ok(depth.map(|depth| depth.um() / thickness.um()))
    }

    /// Returns the dose of full white in a layer. A table of times does not say it.
    ///
    /// # Errors
    /// Returns an error if the material gives no dose of the layer.
    pub fn dose(&self, thickness: Length) -> Result<Option<Dose>, ExposureError> {
        let Rule::Resin(curing) = &self.rule else { return Ok(None) };
        curing.white(thickness).map(Some)
    }

    /// Returns how deep a dose of full white cures. A table of times does not say it.
    pub fn depth(&self, dose: Dose) -> Option<Length> {
        match &self.rule {
            Rule::Resin(curing) => Some(curing.model.depth(dose)),
            Rule::Table(_) => None,
        }
    }

    /// Returns the broadening depth, from which the edges of the largest features grow (002 eq. 61), if the
    /// material says it.
    pub fn broadening_depth(&self) -> Option<Length> {
        let Rule::Resin(curing) = &self.rule else { return None };
        Some(broadening_depth(&*curing.model, curing.width_line()?.critical_dose))
    }

    /// Returns the depth that full white is to cure, in layers, unless a table of times decides.
    pub fn overcure(&self) -> Option<f64> {
        match &self.rule {
            Rule::Resin(curing) => Some(curing.overcure),
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
    /// material was not measured at; and on layers that do not bond, or whose dose also moves edges.
    pub fn doubts(&self, thicknesses: impl Iterator<Item = Length>) -> Vec<String> {
        let Rule::Resin(curing) = &self.rule else { return Vec::new() };
        let thicknesses: Vec<_> = thicknesses.collect();
        // Thicknesses without a dose are errors elsewhere.
        thicknesses.iter().flat_map(|um| curing.white(*um)).for_each(|dose| curing.doses.see(dose));
        let of_doses = curing.lamp_doubt.clone().into_iter().chain(curing.doses.doubt("layers"));
        of_doses.chain(self.bonding(&thicknesses)).collect()
    }

    /// Returns sentences on the bonding of layers, and on edges that grow for it (002 section 3.4.1 and
    /// eq. 61).
    fn bonding(&self, thicknesses: &[Length]) -> Vec<String> {
        let Rule::Resin(curing) = &self.rule else { return Vec::new() };
        let cured = |um: &Length| Some((*um, self.layers_cured(*um).ok()??));
        let cured: Vec<_> = thicknesses.iter().filter_map(cured).collect();
        // To rounding, white that just cures a layer reaches its bottom.
        let loose = cured.iter().filter(|(_, layers)| *layers < 1.0 + 1e-3).count();
        let least = cured.iter().map(|(_, layers)| *layers).fold(f64::INFINITY, f64::min);
        let loose = (loose > 0).then(|| {
            let which = if loose == cured.len() { "no layer bonds" } else { "some layers do not bond" };
            format!(
                "white cures {} deep: {which} to the layer below; --overcure 2 cures two layers deep",
                layers(least)
            )
        });
        let grows = curing.width_line().and_then(|line| {
            let growth =
                cured.iter().filter_map(|(um, _)| Some(line.width(curing.white(*um).ok()?)));
            let most = growth.map(Length::um).fold(0.0, f64::max);
            let depth = broadening_depth(&*curing.model, line.critical_dose);
            (most > 0.0).then(|| {
                format!(
                    "edges grow by up to {most:.1} um at these doses, which cure deeper than the \
                     broadening depth of {:.1} um: lamp compensate moves them back",
                    depth.um()
                )
            })
        });
        loose.into_iter().chain(grows).collect()
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
    /// Returns how the largest features grow, from the least dose, if the material says it.
    fn width_line(&self) -> Option<WidthLine> {
        // 002 section 3.4.4: widths level off at large sizes.
        let widths = self.material.cure_widths().ok().flatten();
        let lines = widths.iter().flatten().filter_map(|width| width.lines().last().copied());
        lines.min_by(|a, b| a.critical_dose.mj_per_cm2().total_cmp(&b.critical_dose.mj_per_cm2()))
    }

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

/// Writes a number of layers.
fn layers(number: f64) -> String {
    let number = round_significant(number, 3);
    if number == 1.0 { "1 layer".to_owned() } else { format!("{number} layers") }
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
    use crate::material::{Given, GivenNumber, WidthNumbers};
    use crate::resin::WidthSensitivity;

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
    fn layers_bond_by_the_cure_depth_of_white() {
        let by = |overcure: Option<f64>, stated: Option<f64>| {
            let mut material = Material::builtin("lamp-suspension").unwrap();
            let given = |value| GivenNumber { value, plus_minus: None, source: "a".to_owned() };
            material.overcure = stated.map(given);
            Exposure::by_material(material, None, overcure).unwrap()
        };
        for (overcure, stated, wanted) in [
            (None, None, 1.0),
            (None, Some(2.5), 2.5),
            (Some(1.5), Some(2.5), 1.5),
            (Some(0.8), None, 0.8),
        ] {
            let exposure = by(overcure, stated);
            assert_eq!(exposure.overcure(), Some(wanted));
            for um in [50.0, 100.0, 200.0].map(Length::from_um) {
                // The dose of equation 40 for white, by its own numbers: 137.4 exp(d/215.2).
                let dose = Intensity::from_mw_per_cm2(1600.0) * exposure.time(um).unwrap();
                let depth = 215.2 * (dose.mj_per_cm2() / 137.4).ln();
                assert!((depth / um.um() - wanted).abs() < 1e-4, "{depth} for {wanted} of {um}");
                let layers = exposure.layers_cured(um).unwrap().unwrap();
                assert!((layers - wanted).abs() < 1e-4, "{layers} for {wanted}");
            }
            let said = exposure.doubts([Length::from_um(200.0)].into_iter());
            let loose = said.iter().any(|line| line.contains("no layer bonds"));
            assert_eq!(loose, wanted <= 1.0, "{said:?}");
        }
        assert_eq!(times().layers_cured(Length::from_um(50.0)), Ok(None));
    }

    #[test]
    fn a_bond_deeper_than_the_broadening_depth_moves_edges() {
        let mut material = Material::builtin("lamp-no-absorber").unwrap();
        let number = |mj| Given {
            value: Dose::from_mj_per_cm2(mj),
            plus_minus: None,
            source: "a".to_owned(),
        };
        let sensitivity = Given {
            value: WidthSensitivity::from_um_per_mj_per_cm2(0.2),
            plus_minus: None,
            source: "a".to_owned(),
        };
        material.cure_width = vec![WidthNumbers {
            feature_size: Length::from_um(8000.0),
            direction: None,
            critical_dose: number(60.0),
            sensitivity,
            measured: None,
        }];
        let said = |overcure| {
            let exposure = Exposure::by_material(material.clone(), None, Some(overcure)).unwrap();
            exposure.doubts([Length::from_um(100.0)].into_iter())
        };
        // 002 figure 78: B_d is 638.51 ln(60/39.4), 268.5 um. 300 um take 39.4 exp(300/638.51), 63.03
        // mJ/cm2, which move edges by 0.2 (63.03 - 60) um.
        let two = said(2.0);
        assert!(!two.iter().any(|line| line.contains("edges grow")), "{two:?}");
        let three = said(3.0);
        let words = "edges grow by up to 0.6 um at these doses, which cure deeper than the broadening \
                     depth of 268.5 um";
        assert!(three.iter().any(|line| line.starts_with(words)), "{three:?}");
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
