//! Machine files.

use std::fmt::Display;
use std::path::PathBuf;
use std::str::FromStr;

use lamp_stack::{Builtin, Catalogued, Length, Pitch, Size, nonempty_text};
use serde::{Deserialize, Deserializer, de};
use thiserror::Error;

use super::{Machine, MachineLimit, ScanError};

/// Why a machine's numbers contradict each other.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MachineError {
    /// Limits that hold nothing, or no possible resolution.
    #[error("{0}: least and most must be above zero, and least not above most")]
    Range(&'static str),
    /// A height that holds nothing.
    #[error("height: it must be above zero")]
    Height,
    /// A default that is no thickness.
    #[error("defaults: thickness: it must be above zero")]
    NoThickness,
    /// A default beyond the machine's own limits.
    #[error("defaults: {0}")]
    Default(MachineLimit),
    /// A blade that stands still, or spreads nothing.
    #[error("recoating: travel, seconds, gap and viscosities must be above zero, the least first")]
    Recoating,
    /// Times that no machine has.
    #[error("times: each must be between 0.001 and 1000000")]
    Times,
    /// A time between swaths that are not known.
    #[error("times: swath_step_s needs swath_speed_mm_per_s")]
    StepWithoutSpeed,
    /// A speed along swaths that are not known.
    #[error("times: swath_speed_mm_per_s needs [strips], which say how wide a swath is")]
    SpeedWithoutStrips,
    /// One speed of all swaths beside a scan, whose speed follows from each exposure.
    #[error(
        "times: swath_speed_mm_per_s is for [strips]: leave it out, as [scan] has its own speeds"
    )]
    SpeedBesideScan,
    /// Swaths without a pixel of their own.
    #[error("strips: a swath must share less than half its mirrors with the next")]
    Strips,
    /// Swaths that are described twice.
    #[error("scan: the file has [strips], too: keep [strips] or [scan]")]
    StripsAndScan,
    /// Fields without pixels, or with too many.
    #[error("fields: pixels: each must be between 1 and 65535")]
    FieldPixels,
    /// Fields without a pixel of their own.
    #[error("fields: overlap: it must be less than half of either side: write fewer pixels")]
    FieldOverlap,
    /// A step that is negative or never ends.
    #[error("fields: step_s: it must be between 0 and 1000000")]
    FieldStep,
    /// A projector that steps and scans.
    #[error("fields: the file has [strips] or [scan], too: keep them, or [fields] alone")]
    FieldsAndSwaths,
    /// Impossible numbers of a panel.
    #[error("panel: {0}")]
    Panel(&'static str),
    /// An impossible curve of gray levels.
    #[error("gamma: {0}")]
    Gamma(&'static str),
    /// Impossible numbers of a scan.
    #[error("scan: {0}")]
    Scan(ScanError),
}

// Its text is in the message already, so it is no source.
impl From<ScanError> for MachineError {
    fn from(error: ScanError) -> Self {
        Self::Scan(error)
    }
}

impl From<MachineLimit> for MachineError {
    fn from(limit: MachineLimit) -> Self {
        Self::Default(limit)
    }
}

macro_rules! builtin {
    ($name:literal) => {
        Builtin { name: $name, toml: include_str!(concat!("../machines/", $name, ".toml")) }
    };
}

impl Catalogued for Machine {
    const KIND: &'static str = "machine";
    const BUILTINS: &'static [Builtin] = &[
        builtin!("alpha"),
        builtin!("beta"),
        builtin!("athena8k"),
        builtin!("mars3"),
        builtin!("mars4dlp"),
        builtin!("photond2"),
        builtin!("photonm5s"),
        builtin!("saturn2"),
        builtin!("saturn3ultra"),
        builtin!("saturn4ultra16k"),
        builtin!("sl1s"),
        builtin!("sonicmega8k"),
    ];
    type CheckError = MachineError;

    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self) -> Result<(), MachineError> {
        if let Some(dpi) = &self.dpi
            && !(Pitch::of_dpi(dpi.least).is_some()
                && Pitch::of_dpi(dpi.most).is_some()
                && dpi.least <= dpi.most)
        {
            return Err(MachineError::Range("dpi"));
        }
        if let Some(thickness) = &self.thickness
            && !(thickness.least.um() > 0.0 && thickness.least <= thickness.most)
        {
            return Err(MachineError::Range("thickness"));
        }
        if self.height.as_ref().is_some_and(|height| height.value.um() <= 0.0) {
            return Err(MachineError::Height);
        }
        if let Some(recoating) = &self.recoating {
            let [least, most] = recoating.viscosity_cp;
            let above_zero = [recoating.travel.um(), recoating.gap.um(), recoating.seconds, least];
            // TOML has `nan` and `inf`: NaN fails the first comparison, infinity the second check.
            let possible = |number: f64| number > 0.0 && number.is_finite();
            // The least viscosity is among the numbers above; the greatest needs only its order and
            // an end.
            if !(above_zero.into_iter().all(possible) && least <= most && most.is_finite()) {
                return Err(MachineError::Recoating);
            }
        }
        self.check_defaults()?;
        if let Some(times) = &self.times {
            times.check(self.strips.is_some() || self.scan.is_some())?;
        }
        if let Some(scan) = &self.scan {
            if self.strips.is_some() {
                return Err(MachineError::StripsAndScan);
            }
            scan.check()?;
            if self.times.as_ref().is_some_and(|times| times.swath_speed_mm_per_s.is_some()) {
                return Err(MachineError::SpeedBesideScan);
            }
        }
        if let Some(fields) = &self.fields {
            if self.strips.is_some() || self.scan.is_some() {
                return Err(MachineError::FieldsAndSwaths);
            }
            fields.check()?;
        }
        if let Some(panel) = &self.panel {
            if self.strips.is_some() || self.scan.is_some() || self.fields.is_some() {
                let why =
                    "the file has [strips], [scan] or [fields], too: keep them, or [panel] alone";
                return Err(MachineError::Panel(why));
            }
            if self.defaults.margin.is_some() {
                let why =
                    "[defaults] has a margin, too, which has no effect on a panel: leave it out";
                return Err(MachineError::Panel(why));
            }
            panel.check()?;
        }
        if let Some(gamma) = &self.gamma {
            gamma.check()?;
        }
        match &self.strips {
            // A swath needs a column of its own between its two seams: a seam joins two swaths,
            // never three.
            Some(strips) if strips.overlap >= strips.mirrors.div_ceil(2) => {
                Err(MachineError::Strips)
            }
            _ => Ok(()),
        }
    }
}

impl Machine {
    fn check_defaults(&self) -> Result<(), MachineError> {
        if let Some(pitch) = self.defaults.pitch {
            // A default outside the machine's own range would fail every command that uses it.
            self.check_pitch(pitch, "a stack")?;
        }
        if let Some(thickness) = self.defaults.thickness {
            if thickness.um() <= 0.0 {
                return Err(MachineError::NoThickness);
            }
            self.check_thickness(thickness, "a layer")?;
        }
        Ok(())
    }
}

pub(super) fn size<'de, D: Deserializer<'de>>(from: D) -> Result<Size, D::Error> {
    parsed(from)
}

pub(super) fn length<'de, D: Deserializer<'de>>(from: D) -> Result<Length, D::Error> {
    parsed(from)
}

pub(super) fn some_length<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Length>, D::Error> {
    length(from).map(Some)
}

/// Reads a number of dots per inch, or the text of a pitch.
pub(super) fn some_pitch<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Pitch>, D::Error> {
    #[derive(Deserialize)]
    #[serde(
        untagged,
        expecting = "write dots per inch, such as 600, or a pitch, such as \"14x19um\""
    )]
    enum Stated {
        Dpi(f64),
        Text(String),
    }
    let text = match Stated::deserialize(from)? {
        Stated::Dpi(dpi) => dpi.to_string(),
        Stated::Text(text) => text,
    };
    Pitch::stated(&text).map(Some).map_err(de::Error::custom)
}

pub(super) fn nonempty_path<'de, D: Deserializer<'de>>(from: D) -> Result<PathBuf, D::Error> {
    nonempty_text(from).map(PathBuf::from)
}

/// Reads a list of exactly two values: of a longer list, serde would drop the rest in silence.
pub(super) fn pair<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    from: D,
) -> Result<[T; 2], D::Error> {
    let list = Vec::deserialize(from)?;
    let length = list.len();
    list.try_into().map_err(|_| de::Error::invalid_length(length, &"an array of length 2"))
}

pub(super) fn some_pair<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    from: D,
) -> Result<Option<[T; 2]>, D::Error> {
    pair(from).map(Some)
}

fn parsed<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(from: D) -> Result<T, D::Error> {
    // An owned string, because TOML text with escapes cannot be borrowed.
    String::deserialize(from)?.parse().map_err(de::Error::custom)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: &str = r#"name = "mine"
description = "A machine of mine"

[area]
value = "100x80mm"
source = "data sheet"

[height]
value = "80mm"
source = "data sheet"

[dpi]
least = 600
most = 600
source = "data sheet"

[thickness]
least = "20um"
most = "0.2mm"
source = "data sheet"

[recoating]
viscosity_cp = [300, 350.5]
travel = "30cm"
seconds = 7
gap = "0.1mm"
source = "data sheet"

[strips]
mirrors = 1024
overlap = 64
source = "data sheet"

[defaults]
dpi = 600
thickness = "50um"
"#;

    #[test]
    fn built_in_machines_are_whole_and_bear_their_names() {
        for builtin in Machine::BUILTINS {
            let machine = Machine::from_toml(builtin.toml).unwrap();
            assert_eq!(machine.name, builtin.name);
            // Their sources give none of these.
            assert_eq!((machine.strips, machine.times), (None, None));
            assert_eq!(machine.height.is_some(), machine.panel.is_some());
        }
        let [alpha, beta] =
            ["alpha", "beta"].map(|name| Machine::builtin(name).unwrap().area.value);
        assert_eq!((alpha.width.mm(), alpha.height.mm()), (101.6, 114.3));
        assert!((beta.width.mm() - 584.2).abs() < 1e-9 && beta.width == beta.height);
    }

    #[test]
    fn the_blade_shears_as_in_002_section_4_2_2() {
        for name in ["alpha", "beta"] {
            let shear_pa = Machine::builtin(name).unwrap().recoating.unwrap().shear_pa();
            assert_eq!(shear_pa.map(f64::round), [87.0, 98.0], "{name}");
        }
    }

    #[test]
    fn errors_name_the_key_and_what_to_do() {
        assert_eq!(Machine::from_toml(WHOLE).unwrap().strips.unwrap().mirrors, 1024);
        for (from, to, words) in [
            ("100x80mm", "100x80", &["line 5", "area.value", "not a size"][..]),
            ("\"data sheet\"", "\" \"", &["area.source", "is empty"]),
            ("[area]", "[region]", &["line 4", "region", "area"]),
            ("least = 600", "least = 700", &["dpi: least and most"]),
            ("least = 600", "least = 0", &["dpi: least and most"]),
            ("\"20um\"", "\"20\"", &["thickness.least", "unit"]),
            ("\"20um\"", "\"-20um\"", &["thickness: least and most"]),
            ("\"80mm\"", "\"80\"", &["line 9", "height.value", "unit"]),
            ("\"80mm\"", "\"0mm\"", &["height", "above zero"]),
            ("mirrors = 1024", "mirrors = 128", &["strips", "half its mirrors"]),
            ("mirrors = 1024", "mirrors = -1", &["line 30", "strips.mirrors"]),
            ("seconds = 7", "seconds = 0", &["recoating", "above zero"]),
            ("[300, 350.5]", "[400, 350.5]", &["recoating", "the least first"]),
            ("\"0.1mm\"", "\"0.1\"", &["line 26", "recoating.gap", "unit"]),
            ("\"mine\"", "\"My own\"", &["name", "`My own` is not a name"]),
            ("dpi = 600", "dpi = 900", &["defaults: a stack has 900 dpi", "600 to 600"]),
            ("dpi = 600", "dpi = 0", &["line 35", "defaults.dpi", "between 1 and"]),
            ("dpi = 600", "pitch = \"14x25um\"", &["defaults: a stack has 14 x 25 um", "600 to"]),
            ("dpi = 600", "pitch = \"25\"\ndpi = 25", &["defaults: duplicate key `dpi`"]),
            ("\"50um\"", "\"1mm\"", &["defaults: a layer is 1mm thick", "20um to 200um"]),
            ("\"50um\"", "\"0um\"", &["defaults: thickness", "above zero"]),
            ("\"50um\"", "\"50\"", &["line 36", "defaults.thickness", "unit"]),
            ("[area]", "[area", &["line 4", "a machine is a TOML file"]),
        ] {
            assert!(WHOLE.contains(from), "{from}");
            let error = Machine::from_toml(&WHOLE.replacen(from, to, 1)).unwrap_err().to_string();
            for word in words {
                assert!(error.contains(word), "no `{word}` in {error:?}");
            }
            assert!(!error.contains('\n'), "{error:?}");
        }
        let missing = Machine::from_toml("name = \"a\"\ndescription = \"\"\n").unwrap_err();
        assert!(missing.to_string().contains("area"), "{missing}");
    }
}
