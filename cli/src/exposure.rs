//! Exposure options: a layer's time and gray levels by material or table.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Args;
use lamp_grayscale::calibrate::{CsvTable, ExposureTimes};
use lamp_grayscale::material::{Material, ResinError};
use lamp_grayscale::resin::{CureModel, Dose, ExposureTime, Intensity, depth_levels};
use lamp_stack::{DepthLevels, FadingLevels, Length};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::catalogue::{
    check_word, entry_and_word, is_file, read_text, recorded_name, without_digest, word_of_text,
};
use crate::exit::Exit;
use crate::lamp_option::LampOption;
use crate::measured_doses::MeasuredDoses;
use crate::recorded::text;
use crate::streams::input_name;

pub(crate) const EXPOSURE: &str = "Exposure";

/// A table has a row for each thickness.
const MAX_TABLE_BYTES: u64 = 1 << 20;

/// Options of the exposure.
#[derive(Args, Clone, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub(crate) struct ExposureOptions {
    /// Resin: a built-in material's name (see lamp material list) or a file
    ///
    /// Pages then state their exposure time
    #[arg(long, value_name = "NAME|FILE", help_heading = EXPOSURE)]
    material: Option<PathBuf>,

    /// Depth that full white cures, in layers: 1 cures just the layer, more bonds it to the one
    /// below
    #[arg(long, value_name = "LAYERS", default_value = "1", value_parser = parse_overcure)]
    #[arg(requires = "material", help_heading = EXPOSURE)]
    #[serde(with = "text")]
    overcure: f64,

    #[command(flatten, next_help_heading = EXPOSURE)]
    #[serde(flatten)]
    lamp: LampOption,

    /// Exposure times by layer thickness, instead of a material: a table with the columns
    /// thickness_um and exposure_ms. Times between two rows are interpolated linearly
    #[arg(long, value_name = "FILE.csv", conflicts_with = "material", help_heading = EXPOSURE)]
    exposure_table: Option<PathBuf>,
}

/// Exposure times by layer thickness.
pub(crate) struct Exposure {
    name: String,
    /// The word that stacks record for the material or table.
    word: String,
    source: Source,
}

enum Source {
    Resin(Box<Curing>),
    Table(ExposureTimes),
}

/// How white cures layers.
struct Curing {
    material: Material,
    /// Unknown where only doses are.
    light: Option<Intensity>,
    model: Box<dyn CureModel>,
    overcure: f64,
    doses: MeasuredDoses,
    /// What is doubtful about the lamp.
    lamp_doubt: Option<String>,
}

impl Default for ExposureOptions {
    fn default() -> Self {
        let lamp = LampOption::default();
        Self { material: None, overcure: 1.0, lamp, exposure_table: None }
    }
}

impl ExposureOptions {
    /// Puts the word of the material or table in the place of its path, as stacks record it.
    pub(crate) fn name(&mut self, exposure: Option<&Exposure>) {
        let Some(Exposure { word, .. }) = exposure else { return };
        self.paths_mut().for_each(|path| *path = PathBuf::from(word));
    }

    /// Finds the material or table of a record again, in the first of these folders that has it.
    ///
    /// # Errors
    /// Returns an error if none has it with the digest of the record.
    pub(crate) fn find(&mut self, folders: &[&Path]) -> Result<(), Exit> {
        let builtin = self.material.as_deref().is_some_and(|path| !is_file::<Material>(path));
        if builtin {
            return self.exposure().map(drop);
        }
        for path in self.paths_mut() {
            let is_it = |word: &PathBuf| {
                let text = fs::read_to_string(without_digest(word).0);
                text.is_ok_and(|text| check_word(word, &word_of_text(word, &text)).is_ok())
            };
            let mut words = folders.iter().map(|folder| folder.join(&*path));
            *path = words.find(is_it).ok_or_else(|| {
                let name = path.display();
                Exit::Failed(anyhow!("{name} is neither here nor beside the stack, as it was"))
            })?;
        }
        Ok(())
    }

    fn paths_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        self.material.iter_mut().chain(&mut self.exposure_table)
    }

    /// Puts words of the same meaning, whatever the folders, in the place of paths.
    pub(crate) fn make_canonical(&mut self) {
        for path in self.paths_mut() {
            *path = recorded_name::<Material>(path).into();
        }
    }

    /// Returns the files that the options name, to be changed.
    pub(crate) fn files_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let material = self.material.iter_mut().filter(|path| is_file::<Material>(path));
        material.chain(&mut self.exposure_table)
    }

    /// Whether a material decides the exposure.
    pub(crate) fn has_material(&self) -> bool {
        self.material.is_some()
    }

    /// Returns the files that the options name.
    pub(crate) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.material.iter().chain(&self.exposure_table)
    }

    /// Returns the exposure, if a material or a table is given.
    pub(crate) fn exposure(&self) -> Result<Option<Exposure>, Exit> {
        if let Some(path) = &self.exposure_table {
            let (file, _) = without_digest(path);
            let read = || read_times(&file);
            let (times, text) = read().with_context(|| input_name(&file))?;
            let (name, word) = (input_name(&file), word_of_text(&file, &text));
            check_word(path, &word)?;
            return Ok(Some(Exposure { name, word, source: Source::Table(times) }));
        }
        let Some(path) = &self.material else { return Ok(None) };
        let (material, word) = entry_and_word(path)?;
        let (material, lamp_doubt) = self.lamp.material(material)?;
        let model = material.cure_model().map_err(|error| Exit::Failed(error.into()))?;
        let light = material.light().map_err(anyhow::Error::new)?;
        let doses = MeasuredDoses::of_depths(&material);
        let (name, overcure) = (material.name.clone(), self.overcure);
        let curing = Curing { material, light, model, overcure, doses, lamp_doubt };
        Ok(Some(Exposure { name, word, source: Source::Resin(Box::new(curing)) }))
    }
}

/// Reads a table, and its text.
fn read_times(path: &Path) -> anyhow::Result<(ExposureTimes, String)> {
    let text = read_text(path, MAX_TABLE_BYTES, "a table of exposure times")?;
    Ok((ExposureTimes::new(&CsvTable::parse(&text)?)?, text))
}

impl Exposure {
    /// Returns the numbers of the material that decide exposures, as stacks record them: the curve,
    /// doses and light under the lamp as it is now.
    pub(crate) fn numbers(&self) -> Option<Value> {
        let Source::Resin(curing) = &self.source else { return None };
        Some(serde_json::to_value(&curing.material).expect("a material is texts and numbers"))
    }

    /// Checks that a layer has an exposure. Without a light, its dose is enough.
    pub(crate) fn check(&self, thickness: Length) -> Result<(), Exit> {
        match &self.source {
            Source::Resin(curing) if curing.light.is_none() => {
                self.dose(curing, thickness).map(|_| ())
            }
            _ => self.time(thickness).map(|_| ()),
        }
    }

    /// Checks that exposures have times, and not only doses.
    pub(crate) fn check_light(&self) -> Result<(), Exit> {
        match &self.source {
            Source::Resin(curing) if curing.light.is_none() => Err(self.no_light()),
            _ => Ok(()),
        }
    }

    /// Returns the exposure time of a layer, rounded to the microsecond.
    ///
    /// # Errors
    /// Where the resin or the table does not tell it.
    pub(crate) fn time(&self, thickness: Length) -> Result<ExposureTime, Exit> {
        let time = match &self.source {
            Source::Resin(curing) => {
                let light = curing.light.ok_or_else(|| self.no_light())?;
                self.dose(curing, thickness)? / light
            }
            Source::Table(times) => times.of(thickness.to_whole_nm()).ok_or_else(|| {
                let ([least, most], thickness) = (times.limits(), thickness.to_whole_nm());
                self.failed(anyhow!("the table covers {least} to {most}, not {thickness}"))
            })?,
        };
        Ok(ExposureTime::from_ms((time.ms() * 1000.0).round() / 1000.0))
    }

    /// Returns the gray level of each depth in layers of one thickness.
    ///
    /// # Errors
    /// Where the resin does not say them; a table of times never does.
    pub(crate) fn levels(&self, thickness: Length) -> Result<DepthLevels, Exit> {
        let Source::Resin(curing) = &self.source else {
            return Err(self.failed(anyhow!("gray levels need a material, not exposure times")));
        };
        let levels = depth_levels(&*curing.model, self.white(curing, thickness)?);
        levels.map_err(|error| self.failed(error.into()))
    }

    /// Returns sentences on a lamp, and on doses that layers of these thicknesses take, that the
    /// material was not measured at.
    pub(crate) fn doubts(&self, thicknesses: impl Iterator<Item = Length>) -> Vec<String> {
        let Source::Resin(curing) = &self.source else { return Vec::new() };
        thicknesses.flat_map(|um| self.white(curing, um)).for_each(|dose| curing.doses.see(dose));
        curing.lamp_doubt.clone().into_iter().chain(curing.doses.doubt("layers")).collect()
    }

    /// Returns the dose that cures a layer.
    fn dose(&self, curing: &Curing, thickness: Length) -> Result<Dose, Exit> {
        let depth = Length::from_um(thickness.to_whole_nm().um() * curing.overcure);
        curing.model.dose(depth).map_err(|error| self.failed(error.into()))
    }

    /// Returns the dose that a layer gets, by its rounded time where there is a light.
    fn white(&self, curing: &Curing, thickness: Length) -> Result<Dose, Exit> {
        match curing.light {
            Some(light) => Ok(light * self.time(thickness)?),
            None => self.dose(curing, thickness),
        }
    }

    fn no_light(&self) -> Exit {
        let error = ResinError::NoLight(self.name.clone());
        Exit::Failed(error.into())
    }

    /// Returns what each gray level leaves in layers of one thickness, where doses add up.
    ///
    /// # Errors
    /// Where the resin does not say how light fades; a table of times never does.
    pub(crate) fn fading_levels(&self, thickness: Length) -> Result<FadingLevels, Exit> {
        let Source::Resin(curing) = &self.source else {
            return Err(self.failed(anyhow!("gray levels need a material, not exposure times")));
        };
        let fading = curing.material.fading().map_err(|error| self.failed(error.into()))?;
        Ok(fading.levels(self.time(thickness)?))
    }

    fn failed(&self, error: anyhow::Error) -> Exit {
        Exit::Failed(error).at(self.name.clone())
    }
}

/// Parses the depth that white cures, in layers.
fn parse_overcure(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(layers) if (0.1..=100.0).contains(&layers) => Ok(layers),
        _ => Err(format!(
            "`{text}` is not a depth in layers: write a number from 0.1 to 100, as 1.5"
        )),
    }
}
