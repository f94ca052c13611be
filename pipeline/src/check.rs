//! The settings of a check.

use std::num::{NonZeroU8, NonZeroU32};
use std::path::{Path, PathBuf};

use lamp_machine::{Machine, Recoating};
use lamp_stack::{Layer, Length, MemorySize};
use lamp_supports::{
    CheckError, CheckOptions, Disagreements, FindingGroup, FindingRecord, Findings,
};
use serde::{Deserialize, Serialize};

use crate::documents::{canonical_word, document, is_file};
use crate::error::Error;
use crate::words::{list, optional, path, text, words_of};

/// Changes when other findings come of the same settings and stack.
pub const CODE: u32 = 2;

/// The findings to look for, and their limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct CheckSettings {
    /// Groups of findings; none means all.
    #[serde(with = "list", skip_serializing_if = "Vec::is_empty")]
    pub only: Vec<FindingGroup>,
    /// Side of the square that an island must hold.
    #[serde(with = "text")]
    pub speck: Length,
    /// Layers for which a thinner island must float.
    #[serde(with = "text")]
    pub speck_layers: NonZeroU32,
    /// Share of white that must rest on white.
    #[serde(with = "text")]
    pub least_support: f64,
    /// How far white may reach beyond the white below; `None` is as far as a layer is thick.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub max_overhang: Option<Length>,
    /// How wide a way out must be to drain a pocket; `None` is a pixel and a layer.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub drain: Option<Length>,
    /// Level from which a gray pixel is white.
    #[serde(with = "text")]
    pub threshold: NonZeroU8,
    /// The machine whose blade drags on what floats: a built-in one or a file.
    #[serde(with = "path")]
    pub machine: PathBuf,
}

impl Default for CheckSettings {
    fn default() -> Self {
        let options = CheckOptions::default();
        Self {
            only: Vec::new(),
            speck: options.speck,
            speck_layers: options.speck_layers,
            least_support: options.least_support,
            max_overhang: options.max_overhang,
            drain: options.drain,
            threshold: options.threshold,
            machine: PathBuf::from("alpha"),
        }
    }
}

impl CheckSettings {
    /// Returns the settings that matter to findings as one text, defaults filled in. A machine's
    /// file goes without its name.
    pub fn canonical(&self) -> String {
        let machine = canonical_word::<Machine>(&self.machine).into();
        format!("check{}", words_of(&Self { machine, ..self.clone() }))
    }

    /// Returns the file that the machine is from, unless it is built in.
    pub fn machine_file(&self) -> Option<&PathBuf> {
        Some(&self.machine).filter(|path| is_file::<Machine>(path))
    }

    /// Reads the machine.
    ///
    /// # Errors
    /// Returns an error if its file cannot be read, or holds no machine.
    pub fn machine(&self) -> Result<Machine, Error> {
        document(&self.machine)
    }

    /// Returns the options of the search for findings.
    pub fn options(&self) -> CheckOptions {
        CheckOptions {
            threshold: self.threshold,
            speck: self.speck,
            speck_layers: self.speck_layers,
            least_support: self.least_support,
            max_overhang: self.max_overhang,
            drain: self.drain,
            ..CheckOptions::default()
        }
    }

    /// Returns whether findings of a group are reported.
    pub fn reports(&self, group: FindingGroup) -> bool {
        self.only.is_empty() || self.only.contains(&group)
    }

    /// Returns the records of findings that are asked for, the worst first.
    pub fn records(
        &self,
        findings: &Findings,
        disagreements: &Disagreements,
        machine: &Machine,
    ) -> Vec<FindingRecord> {
        let shear_pa = machine.recoating.as_ref().map(Recoating::greatest_shear_pa);
        let mut records = lamp_supports::records(findings, disagreements, shear_pa);
        records.retain(|record| self.reports(record.group()));
        records
    }

    /// Finds what there is in layers, and returns the records that are asked for with it. Drag is
    /// computed for `machine`, or else for the settings' machine.
    ///
    /// # Errors
    /// Returns the first error of the layers, or an error if they cannot be checked.
    pub fn find<T: MemorySize + Send, E: From<CheckError> + From<Error> + Send>(
        &self,
        layers: impl Iterator<Item = Result<T, E>>,
        decode: impl Fn(T) -> Result<Layer, E> + Sync,
        machine: Option<&Machine>,
    ) -> Result<(Findings, Vec<FindingRecord>), E> {
        let findings = lamp_supports::check(layers, decode, &self.options())?;
        let records = match machine {
            Some(machine) => self.records(&findings, &Disagreements::default(), machine),
            None => self.records(&findings, &Disagreements::default(), &self.machine()?),
        };
        Ok((findings, records))
    }

    /// Puts the machine's file into a folder, unless its path is absolute.
    pub fn set_folder(&mut self, folder: &Path) {
        if let Some(file) = self.machine_file() {
            self.machine = folder.join(file);
        }
    }
}

#[cfg(test)]
mod tests {
    use serde::de::DeserializeOwned;

    use super::*;
    use crate::support::SupportSettings;
    use crate::tile::TileSettings;

    fn read_back<T: Serialize + DeserializeOwned>(settings: &T) -> T {
        serde_json::from_str(&serde_json::to_string(settings).unwrap()).unwrap()
    }

    #[test]
    fn settings_are_read_back_as_they_are_written() {
        let check = CheckSettings {
            only: vec![FindingGroup::Islands, FindingGroup::Pockets],
            drain: Some(Length::from_um(500.0)),
            ..CheckSettings::default()
        };
        assert_eq!(read_back(&check), check);
        assert_eq!(read_back(&CheckSettings::default()), CheckSettings::default());
        let support = SupportSettings { keep: 7, ..SupportSettings::default() };
        assert_eq!(read_back(&support), support);
        let mut tile = TileSettings {
            turns: Some("15deg".parse().unwrap()),
            copies: Some(3),
            machine: Some("beta".into()),
            ..TileSettings::default()
        };
        tile.mesh.base_layers = Some(0);
        assert_eq!(read_back(&tile), tile);
        assert_eq!(read_back(&TileSettings::default()), TileSettings::default());
    }
}
