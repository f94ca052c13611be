//! The exposure of layers, by a material or a table of times.

use std::fs;
use std::path::{Path, PathBuf};

use lamp_grayscale::calibrate::{CsvTable, ExposureTimes};
use lamp_grayscale::exposure::{Exposure, LampLight};
use lamp_grayscale::material::Material;
use serde::{Deserialize, Serialize};

use crate::documents::{
    check_word, document_and_word, find_own, input_name, is_file, own_file, read_text,
    recorded_name, without_digest, word_of_text,
};
use crate::error::{Error, ErrorKind};
use crate::words::{optional, path};

/// A table has a row for each thickness.
const MAX_TABLE_BYTES: u64 = 1 << 20;

/// Settings that decide exposure times and gray levels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, rename_all_fields = "kebab-case")]
pub enum ExposureSettings {
    /// A material.
    Material {
        /// A built-in one's name, or a file.
        #[serde(with = "path")]
        material: PathBuf,
        /// Depth that full white cures, in layers; `None` is the material's, or 1.
        #[serde(with = "optional", default, skip_serializing_if = "Option::is_none")]
        overcure: Option<f64>,
        /// The lamp as it is now; `None` is the material's.
        #[serde(with = "optional", default, skip_serializing_if = "Option::is_none")]
        lamp_intensity: Option<LampLight>,
    },
    /// A table of exposure times by layer thickness.
    Table {
        /// The file.
        #[serde(with = "path")]
        exposure_table: PathBuf,
    },
    /// Pages state no exposure.
    None {},
}

impl Default for ExposureSettings {
    fn default() -> Self {
        Self::None {}
    }
}

/// An exposure, and the word that stacks record for its material or table.
#[derive(Debug)]
pub struct RecordedExposure {
    /// The exposure.
    pub exposure: Exposure,
    /// The word.
    pub word: String,
}

impl ExposureSettings {
    /// Puts the word of the material or table in the place of its path, as stacks record it, and the
    /// depth that white cures in the place of none.
    pub(crate) fn name(&mut self, exposure: Option<&RecordedExposure>) {
        let cured = exposure.and_then(|recorded| recorded.exposure.overcure());
        if let Self::Material { overcure, .. } = self {
            *overcure = overcure.or(cured);
        }
        if let (Some(path), Some(RecordedExposure { word, .. })) = (self.path_mut(), exposure) {
            *path = PathBuf::from(word);
        }
    }

    /// Finds the material or table of a record again, in the first of these folders that has it.
    ///
    /// # Errors
    /// Returns an error if none has it with the digest of the record.
    pub(crate) fn find(&mut self, folders: &[&Path]) -> Result<(), Error> {
        if let Self::Material { material, .. } = self
            && !is_file::<Material>(material)
        {
            // A built-in material has no file: only its digest is checked, against this program's.
            return self.exposure().map(drop);
        }
        let Some(path) = self.path_mut() else { return Ok(()) };
        // A file of the same name may have changed: the digest decides, and the search goes on.
        let is_it = |word: &PathBuf| {
            let text = fs::read_to_string(without_digest(word).0);
            text.is_ok_and(|text| check_word(word, &word_of_text(word, &text)).is_ok())
        };
        let own = own_file::<Material>(path).filter(|own| {
            let text = fs::read_to_string(own);
            text.is_ok_and(|text| check_word(path, &word_of_text(own, &text)).is_ok())
        });
        let mut words = folders.iter().map(|folder| folder.join(&*path));
        *path = words.find(is_it).or(own).ok_or_else(|| {
            let name = path.display();
            Error::work(format!("no unchanged {name} is here or next to the stack"))
        })?;
        Ok(())
    }

    /// Puts the file in the place of a name, if the name means a material of one's own folder.
    pub fn find_own(&mut self) {
        if let Self::Material { material, .. } = self {
            find_own::<Material>(material);
        }
    }

    fn path_mut(&mut self) -> Option<&mut PathBuf> {
        match self {
            Self::Material { material: path, .. } | Self::Table { exposure_table: path } => {
                Some(path)
            }
            Self::None {} => None,
        }
    }

    /// Replaces paths by words of the same meaning, whatever the folders.
    pub(crate) fn make_canonical(&mut self) {
        if let Some(path) = self.path_mut() {
            *path = recorded_name::<Material>(path).into();
        }
    }

    /// Returns the files that the settings name, to be changed.
    pub fn files_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        // A built-in material is no file, though its name stands in the place of a path.
        let builtin =
            matches!(self, Self::Material { material, .. } if !is_file::<Material>(material));
        self.path_mut().filter(|_| !builtin).into_iter()
    }

    /// Returns the files that the settings name.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        let path = match self {
            Self::Material { material: path, .. } | Self::Table { exposure_table: path } => {
                Some(path)
            }
            Self::None {} => None,
        };
        path.into_iter()
    }

    /// Returns the exposure, if a material or a table is given.
    ///
    /// # Errors
    /// Returns an error if the material or the table cannot be read, or gives no exposures.
    pub fn exposure(&self) -> Result<Option<RecordedExposure>, Error> {
        fn failed(error: impl std::error::Error + Send + Sync + 'static) -> Error {
            Error::new(ErrorKind::Work, error)
        }
        match self {
            Self::None {} => Ok(None),
            Self::Table { exposure_table } => {
                let (file, _) = without_digest(exposure_table);
                let named = |error: Error| error.at(input_name(&file));
                let text = read_text(&file, MAX_TABLE_BYTES, "a table of exposure times");
                let text = text.map_err(named)?;
                let table = CsvTable::parse(&text).map_err(failed);
                let times = table.and_then(|table| ExposureTimes::new(&table).map_err(failed));
                let times = times.map_err(named)?;
                let word = word_of_text(&file, &text);
                check_word(exposure_table, &word)?;
                Ok(Some(RecordedExposure {
                    exposure: Exposure::by_table(input_name(&file), times),
                    word,
                }))
            }
            Self::Material { material, overcure, lamp_intensity } => {
                let (material, word) = document_and_word::<Material>(material)?;
                let exposure = Exposure::by_material(material, *lamp_intensity, *overcure);
                Ok(Some(RecordedExposure { exposure: exposure.map_err(failed)?, word }))
            }
        }
    }
}
