//! The settings of a check.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::fmt;
use std::num::{NonZeroU8, NonZeroU32};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use lamp_machine::{Machine, Recoating};
use lamp_stack::{Layer, Length, Mask, MemorySize};
use lamp_supports::{
    AcceptedFindings, CheckError, CheckOptions, CopyRecord, DesignRules, Disagreements, Feature,
    FindingGroup, FindingRecord, Findings, LayerFacts, LayerLight, LeastWidth, Listed, Region,
    Scale, Severity,
};
use serde::{Deserialize, Serialize};

use crate::build_copies::{BuildCopies, Inseparable, OnBuild};
use crate::documents::{canonical_word, document, is_file};
use crate::error::Error;
use crate::stack_light::{NoLight, StackLight};
use crate::words::{list, optional, path, text, words_of};

/// Changes when other findings come of the same settings and stack.
pub const CODE: u32 = 5;

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
    /// The design rules: built-in ones or a file.
    #[serde(with = "path")]
    pub rules: PathBuf,
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
            rules: PathBuf::from("lamp-mould"),
        }
    }
}

impl CheckSettings {
    /// Returns the settings that matter to findings as one text, defaults filled in. Files go without
    /// their names.
    pub fn canonical(&self) -> String {
        let machine = canonical_word::<Machine>(&self.machine).into();
        let rules = canonical_word::<DesignRules>(&self.rules).into();
        format!("check{}", words_of(&Self { machine, rules, ..self.clone() }))
    }

    /// Returns the files that are read: of what is not built in.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        let machine = Some(&self.machine).filter(|path| is_file::<Machine>(path));
        machine.into_iter().chain(Some(&self.rules).filter(|path| is_file::<DesignRules>(path)))
    }

    /// Reads the machine.
    ///
    /// # Errors
    /// Returns an error if its file cannot be read, or holds no machine.
    pub fn machine(&self) -> Result<Machine, Error> {
        document(&self.machine)
    }

    /// Returns the options of the search for findings, given the light of layers.
    ///
    /// # Errors
    /// Returns an error if the file of the design rules cannot be read, or holds none.
    pub fn options(&self, light: Option<StackLight>) -> Result<CheckOptions, Error> {
        let rules: Option<DesignRules> =
            self.reports(FindingGroup::Rules).then(|| document(&self.rules)).transpose()?;
        let widths = rules.iter().flat_map(DesignRules::widths).collect();
        let (bonds, aspects) = rules.map(|rules| (rules.bond, rules.aspect)).unwrap_or_default();
        Ok(CheckOptions {
            widths,
            bonds,
            aspects,
            light: light.map(|light| Arc::new(light) as Arc<dyn LayerLight>),
            threshold: self.threshold,
            speck: self.speck,
            speck_layers: self.speck_layers,
            least_support: self.least_support,
            max_overhang: self.max_overhang,
            drain: self.drain,
            ..CheckOptions::default()
        })
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

    /// Finds what there is in a stack, given the light of its layers, these and how to decode one. Of a
    /// build, whose copies are given, each part is judged once. Drag is computed for `machine`, or else for the settings'
    /// machine.
    ///
    /// # Errors
    /// Returns the first error of the layers, or an error if they cannot be checked.
    pub fn find<T: MemorySize + Send, E: From<CheckError> + From<Error> + Send>(
        &self,
        build: Result<BuildCopies, Inseparable>,
        light: Result<StackLight, NoLight>,
        layers: impl Iterator<Item = Result<T, E>>,
        decode: impl Fn(T) -> Result<Layer, E> + Sync,
        machine: Option<&Machine>,
    ) -> Result<Found, E> {
        let (light, resin) = known(light);
        let options = self.options(light)?;
        let (findings, differing) = match &build {
            Ok(build) => self.find_in_build(build, layers, decode, &options)?,
            Err(_) => (lamp_supports::check(layers, decode, &options)?, Vec::new()),
        };
        let of_settings;
        let machine = match machine {
            Some(machine) => machine,
            None => {
                of_settings = self.machine()?;
                &of_settings
            }
        };
        Ok(self.found(findings, &Disagreements::default(), differing, build, resin, machine))
    }

    /// Returns what was found, as people and programs read it.
    pub fn found(
        &self,
        findings: Findings,
        disagreements: &Disagreements,
        differing: Vec<CopyRecord>,
        build: Result<BuildCopies, Inseparable>,
        resin: Result<String, NoLight>,
        machine: &Machine,
    ) -> Found {
        let mut records = self.records(&findings, disagreements, machine);
        if self.reports(FindingGroup::Layers) {
            let mut differing = differing;
            differing.sort_by_key(|copy| Reverse(copy.differing_px));
            let differing = differing.into_iter().map(FindingRecord::CopyDiffers);
            // Before white at the border and empty layers, which harm least.
            let at = records.iter().position(|record| {
                matches!(record, FindingRecord::Border(_) | FindingRecord::Empty(_))
            });
            let at = at.unwrap_or(records.len());
            records.splice(at..at, differing);
        }
        let mut found =
            Found { findings, records, features: Vec::new(), accepted: 0, build, resin };
        found.group();
        found
    }

    /// Finds what there is in a build: in each part alone, once for all copies, and islands of its mesh.
    fn find_in_build<T: MemorySize + Send, E: From<CheckError> + From<Error> + Send>(
        &self,
        build: &BuildCopies,
        layers: impl Iterator<Item = Result<T, E>>,
        decode: impl Fn(T) -> Result<Layer, E> + Sync,
        options: &CheckOptions,
    ) -> Result<(Findings, Vec<CopyRecord>), E> {
        let differing: Mutex<DifferingCopies> = Mutex::default();
        // Pages of mesh alone show where it is. They come before all parts.
        let base: OnceLock<Mask> = OnceLock::new();
        let decode = |item: T| {
            let layer = decode(item)?;
            if build.is_base(layer.info.index) {
                base.get_or_init(|| layer.image.clone().into_image().into_mask(self.threshold));
            }
            Ok(layer)
        };
        let parts = |layer: &Layer| {
            let Layer { info, pitch, image } = layer;
            let mask = image.clone().into_image().into_mask(self.threshold);
            let found = build.divide(&mask, info.index, base.get());
            let mut all = differing.lock().unwrap_or_else(PoisonError::into_inner);
            for (copy, pixels) in found.differing {
                let (layers, sum) = all.entry(copy).or_insert(([info.index; 2], 0));
                // Two layers are in work at once, and either may be the first.
                *layers = [layers[0].min(info.index), layers[1].max(info.index)];
                *sum += pixels;
            }
            let parts = found.parts?;
            Some(Layer { info: info.clone(), pitch: *pitch, image: parts.into() })
        };
        let (whole, parts) = lamp_supports::check_build(layers, decode, parts, options)?;
        let mut findings = whole;
        if let Some(parts) = parts {
            findings = findings.with_parts(parts, |Region { columns, rows }| {
                let bounds = [columns.start, columns.end, rows.start, rows.end];
                build.owner(bounds) == OnBuild::Mesh
            });
        }
        if build.has_mesh() {
            // The mesh holds the parts (002 section 4.2.3).
            findings.off_balance = Listed::default();
        }
        let scale = Scale::new(&findings);
        let position = |index: u32| {
            let found = findings.layers.iter().position(|layer| layer.index == index);
            found.map_or(0, |position| position as u32)
        };
        let differing = differing.into_inner().unwrap_or_else(PoisonError::into_inner);
        let differing = differing.into_iter().map(|(copy, (layers, pixels))| {
            let (part, copies, frame) = build.copy(copy);
            let within = |start: i64, size: u32, most: u32| {
                let end = start.saturating_add(size.into()).clamp(0, most.into()) as u32;
                start.clamp(0, most.into()) as u32..end
            };
            let [width, height] = findings.size;
            let region = Region {
                columns: within(frame.left, frame.width, width),
                rows: within(frame.top, frame.height, height),
            };
            CopyRecord {
                layers: scale.span(layers.map(position)),
                bounds: scale.bounds(&region),
                part: part.to_owned(),
                copy: copy[1] + 1,
                copies,
                differing_px: pixels,
            }
        });
        let differing = differing.collect();
        Ok((findings, differing))
    }
}

/// For each copy that differs: the indices of its first and last layer, and its pixels.
type DifferingCopies = BTreeMap<[usize; 2], ([u32; 2], u64)>;

/// The result of a check.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Findings by kind.
    pub findings: Findings,
    /// The records of the findings that are asked for, the worst first.
    pub records: Vec<FindingRecord>,
    /// The records as features.
    pub features: Vec<Feature>,
    /// The number of findings that are left out, as a person accepts them.
    pub accepted: usize,
    /// The copies of a build, or why the stack was checked as it stands.
    pub build: Result<BuildCopies, Inseparable>,
    /// The resin that the light of layers cures, or why none is known.
    pub resin: Result<String, NoLight>,
}

/// Returns the light, if it is known, and its resin, or why none is known.
pub fn known(light: Result<StackLight, NoLight>) -> (Option<StackLight>, Result<String, NoLight>) {
    match light {
        Ok(light) => {
            let resin = light.resin().to_owned();
            (Some(light), Ok(resin))
        }
        Err(why) => (None, Err(why)),
    }
}

/// Design rules that were not checked, in all layers or in some.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct UncheckedRules {
    /// The names of the rules.
    pub rules: Vec<String>,
    /// Why they were not checked.
    pub why: String,
}

impl fmt::Display for UncheckedRules {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "design rules were not checked: {}; {}", self.rules.join(", "), self.why)
    }
}

/// A finding, and the part of a build that it belongs to.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlacedFinding<F> {
    /// The finding.
    #[serde(flatten)]
    pub finding: F,
    /// Of a build: the name of the part that has the finding.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// Of a build: the number of the part's copies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub copies: Option<usize>,
}

impl Found {
    /// Leaves out findings that a person accepts.
    pub fn accept(&mut self, accepted: &AcceptedFindings) {
        let before = self.records.len();
        self.records.retain(|record| !accepted.has(record));
        self.accepted += before - self.records.len();
        self.group();
    }

    fn group(&mut self) {
        let owner = |record: &FindingRecord| self.owner(record);
        self.features = lamp_supports::features(&self.records, self.findings.pitch, owner);
    }

    /// Returns the number of features that need a person.
    pub fn count(&self) -> usize {
        self.features.iter().filter(|feature| feature.severity != Severity::Note).count()
    }

    /// Returns what a finding belongs to, if the stack is a build and the finding has a place.
    pub fn owner(&self, record: &FindingRecord) -> Option<OnBuild> {
        Some(self.build.as_ref().ok()?.owner(record.box_px()?))
    }

    /// Returns the findings with the parts of a build that they belong to.
    pub fn placed(&self) -> impl Iterator<Item = PlacedFinding<&FindingRecord>> {
        self.records.iter().map(|finding| {
            let (part, copies) = match self.owner(finding) {
                Some(OnBuild::Part { name, copies }) => (Some(name), Some(copies)),
                Some(OnBuild::Mesh) | None => (None, None),
            };
            PlacedFinding { finding, part, copies }
        })
    }

    /// Returns why copies and build mesh were checked as they stand, if the stack is a build.
    pub fn whole_build(&self) -> Option<String> {
        let why = self.build.as_ref().err().filter(|why| **why != Inseparable::NoBuild)?;
        Some(format!("each copy and the build mesh were checked as they stand: {why}"))
    }

    /// Returns the design rules that were not checked, in all layers or in some.
    pub fn unchecked_rules(&self) -> Vec<UncheckedRules> {
        let Findings { layers, pitch, widths, bonds, aspects, .. } = &self.findings;
        let mut all = Vec::new();
        let mut unchecked = |rules: Vec<&str>, why: String| {
            if !rules.is_empty() {
                let rules = rules.into_iter().map(str::to_owned).collect();
                all.push(UncheckedRules { rules, why });
            }
        };
        let textures = layers.iter().filter(|layer| layer.is_texture).count();
        if textures > 0 {
            let names = widths.iter().map(|rule| rule.name.as_str()).collect();
            let have = if textures == 1 { "layer has" } else { "layers have" };
            let why = format!("{textures} {have} thousands of narrow places, as dots are");
            unchecked(names, why);
        }
        let of_light = widths.iter().filter(|it| matches!(it.least, LeastWidth::CureWidths(_)));
        let of_light: Vec<&str> = of_light.map(|rule| rule.name.as_str()).collect();
        if pitch.is_none() {
            let lengths = widths.iter().filter(|it| matches!(it.least, LeastWidth::Length(_)));
            let lengths = lengths.map(|rule| rule.name.as_str()).chain(of_light.iter().copied());
            let names = lengths.chain(aspects.iter().map(|rule| rule.name.as_str())).collect();
            unchecked(names, "the stack states no resolution".to_owned());
        } else if !layers.iter().any(|layer| layer.thickness_um.is_some()) {
            let names = aspects.iter().map(|rule| rule.name.as_str()).collect();
            unchecked(names, "the stack states no heights".to_owned());
        }
        let of_bonds: Vec<&str> = bonds.iter().map(|rule| rule.name.as_str()).collect();
        let resin = match &self.resin {
            Ok(resin) => resin,
            Err(NoLight(why)) => {
                let of_light = of_light.iter().copied().filter(|_| pitch.is_some());
                unchecked(of_light.chain(of_bonds).collect(), why.clone());
                return all;
            }
        };
        let white = || layers.iter().filter(|layer| layer.has_white);
        let count = |has: &dyn Fn(&LayerFacts) -> bool| white().filter(|layer| has(layer)).count();
        let has_depth = |layer: &LayerFacts| layer.cure.depth_um.is_some();
        let lacking = |without: usize, what: &str| {
            let which = match without {
                0 => return None,
                _ if without == white().count() => "the layers".to_owned(),
                1 => "1 layer".to_owned(),
                _ => format!("{without} layers"),
            };
            Some(format!("neither {resin} nor {which} state {what}"))
        };
        let has_width = |layer: &LayerFacts| layer.cure.width_um.is_some();
        let why = if count(&has_width) == 0 && count(&has_depth) > 0 {
            Some(format!("{resin} states no cure width"))
        } else {
            lacking(count(&|layer| !has_width(layer)), "a dose and its cure width")
        };
        if let Some(why) = why.filter(|_| pitch.is_some()) {
            unchecked(of_light, why);
        }
        if layers.iter().any(|layer| layer.cure.needs_others) {
            let why = "layers are lit that cure only with the light of others: lamp cure shows \
                       what cures";
            unchecked(of_bonds, why.to_owned());
            return all;
        }
        let has_bond = |layer: &LayerFacts| has_depth(layer) && layer.thickness_um.is_some();
        let what = "a dose and its cure depth, and a thickness";
        if let Some(why) = lacking(count(&|layer| !has_bond(layer)), what) {
            unchecked(of_bonds, why);
        }
        all
    }

    /// Returns the line about a feature, without the name of its kind.
    pub fn text(&self, feature: &Feature) -> String {
        self.records[feature.finding].to_string() + &self.ending(feature)
    }

    /// Returns the line about a feature, without the name of its kind and its layers.
    pub fn about(&self, feature: &Feature) -> String {
        self.records[feature.finding].about() + &self.ending(feature)
    }

    /// Returns the end of the line about a feature: the findings that belong to it, and its part.
    fn ending(&self, feature: &Feature) -> String {
        let record = &self.records[feature.finding];
        let text = feature.more_text(|at| self.records.get(at).cloned());
        match self.owner(record) {
            _ if matches!(record, FindingRecord::CopyDiffers(_)) => text,
            None => text,
            Some(OnBuild::Mesh) => format!("{text}; in the build mesh"),
            Some(OnBuild::Part { name, copies: 1 }) => format!("{text}; in {name}"),
            Some(OnBuild::Part { name, copies }) => {
                let differs = |record: &FindingRecord| match record {
                    FindingRecord::CopyDiffers(copy) => copy.part == name,
                    _ => false,
                };
                match self.records.iter().any(differs) {
                    // A part has all white that any copy has.
                    true => format!("{text}; in {copies} copies of {name}, of which some differ"),
                    false => format!("{text}; in each of {copies} copies of {name}"),
                }
            }
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
