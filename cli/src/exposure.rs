//! Exposure options: a layer's time and gray levels by material or table.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Args;
use lamp_grayscale::calibrate::{CsvTable, ExposureTimes};
use lamp_grayscale::exposure::Exposure;
use lamp_grayscale::material::Material;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::catalogue::{
    check_word, entry_and_word, is_file, read_text, recorded_name, without_digest, word_of_text,
};
use crate::exit::Exit;
use crate::lamp_option::LampOption;
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

/// An exposure, and the word that stacks record for its material or table.
pub(crate) struct RecordedExposure {
    pub(crate) word: String,
    pub(crate) exposure: Exposure,
}

impl Default for ExposureOptions {
    fn default() -> Self {
        let lamp = LampOption::default();
        Self { material: None, overcure: 1.0, lamp, exposure_table: None }
    }
}

impl ExposureOptions {
    /// Puts the word of the material or table in the place of its path, as stacks record it.
    pub(crate) fn name(&mut self, word: Option<&str>) {
        let Some(word) = word else { return };
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
    pub(crate) fn exposure(&self) -> Result<Option<RecordedExposure>, Exit> {
        if let Some(path) = &self.exposure_table {
            let (file, _) = without_digest(path);
            let read = || read_times(&file);
            let (times, text) = read().with_context(|| input_name(&file))?;
            let (name, word) = (input_name(&file), word_of_text(&file, &text));
            check_word(path, &word)?;
            let exposure = Exposure::by_table(name, times);
            return Ok(Some(RecordedExposure { word, exposure }));
        }
        let Some(path) = &self.material else { return Ok(None) };
        let (material, word) = entry_and_word(path)?;
        let exposure = Exposure::by_material(material, self.lamp.light(), self.overcure)?;
        Ok(Some(RecordedExposure { word, exposure }))
    }
}

/// Reads a table, and its text.
fn read_times(path: &Path) -> anyhow::Result<(ExposureTimes, String)> {
    let text = read_text(path, MAX_TABLE_BYTES, "a table of exposure times")?;
    Ok((ExposureTimes::new(&CsvTable::parse(&text)?)?, text))
}

/// Returns the numbers of the material that decide exposures, as stacks record them: the curve,
/// doses and light under the lamp as it is now.
pub(crate) fn numbers(exposure: &Exposure) -> Option<Value> {
    let material = exposure.material()?;
    Some(serde_json::to_value(material).expect("a material is texts and numbers"))
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
