//! The settings of slicing, and their record in a stack.

use std::path::{Path, PathBuf};

use lamp_build::TurnedSlicing;
use lamp_machine::{Defaults, Machine, MachineLimit};
use lamp_slicing::{Axis, GridRule, PLANE_TOLERANCE, Part, PlaneRule, Side, SliceOptions};
use lamp_stack::{Length, Pitch, Size, StackInfo, quoted};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::exposure::{ExposureSettings, RecordedExposure};
use crate::heights::HeightSettings;
use crate::part_file::PartFile;
use crate::placement::{FiniteNumbers, Rotation};
use crate::solid::{SolidSettings, is_default};
use crate::words::{differing, optional, parts, text, words_of};

/// The settings that decide the images of a part.
///
/// Keys of the JSON are the options of `lamp slice`; the words of a command follow the order of the
/// fields.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct SliceSettings {
    /// Resolution of the images.
    #[serde(rename = "dpi", alias = "pitch", with = "text")]
    pub pitch: Pitch,
    /// Thickness of the layers.
    #[serde(flatten)]
    pub thickness: Thickness,
    /// Height in each layer at which the part is cut.
    #[serde(with = "text")]
    pub plane: PlaneRule,
    /// The largest distance of a vertex from a layer's plane at which it still counts as on it.
    #[serde(with = "text", skip_serializing_if = "is_usual_tolerance")]
    pub plane_tolerance: Length,
    /// The side of the part on which layers lie.
    #[serde(with = "text", skip_serializing_if = "is_default")]
    pub side: Side,
    /// The solid.
    #[serde(flatten)]
    pub solid: SolidSettings,
    /// Leaves crossings on the facets of STEP parts.
    #[serde(skip_serializing_if = "is_default")]
    pub no_polish: bool,
    /// Whether layers are gray.
    #[serde(flatten)]
    pub gray: GrayRule,
    /// Whether pixels at edges have the level of their area within the part.
    #[serde(skip_serializing_if = "is_default")]
    pub antialias: bool,
    /// The exposure of the layers.
    #[serde(flatten)]
    pub exposure: ExposureSettings,
    /// The pixels of the images.
    #[serde(flatten)]
    pub frame: SliceFrame,
}

/// The thickness of layers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Thickness {
    /// As thick as the part's slopes allow.
    Adaptive {
        /// Stands for the option; it is true.
        adaptive: bool,
        /// The limits, and the largest error.
        #[serde(flatten)]
        heights: Box<HeightSettings>,
    },
    /// All the same.
    Uniform {
        /// The thickness.
        #[serde(with = "text")]
        thickness: Length,
    },
    /// As the part's file states them, as contours and layouts do, or else 100 um.
    OfPart {},
}

/// The thickness of layers if neither a setting nor the part's file states one.
pub(crate) const USUAL_THICKNESS: Length = Length::from_um(100.0);

/// Whether layers are gray, and how their doses count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "GrayFlags", into = "GrayFlags")]
pub enum GrayRule {
    /// Black and white.
    #[default]
    None,
    /// Each pixel has the level that cures down to where the part ends below it, by its layer
    /// alone.
    ByDepth,
    /// The same, where doses of layers add up: light of the layers above does not cure through
    /// undersides.
    PrintThrough,
}

/// [`GrayRule`] as options.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
struct GrayFlags {
    #[serde(skip_serializing_if = "is_default")]
    gray: bool,
    #[serde(skip_serializing_if = "is_default")]
    print_through: bool,
}

/// The part of the plane that images show.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum SliceFrame {
    /// A given place, which holds the part.
    At {
        /// The top left corner (x, y) in part coordinates, in millimeters.
        #[serde(with = "text")]
        origin: FiniteNumbers<2>,
        /// Its size.
        #[serde(with = "text")]
        size: Size,
    },
    /// The part's box.
    Around {
        /// Black pixels on every side of it.
        #[serde(with = "text")]
        margin: u32,
    },
}

impl From<GrayFlags> for GrayRule {
    fn from(flags: GrayFlags) -> Self {
        match flags {
            // Print-through is a kind of gray, so its flag decides, whatever `gray` says.
            GrayFlags { print_through: true, .. } => Self::PrintThrough,
            GrayFlags { gray: true, .. } => Self::ByDepth,
            GrayFlags { .. } => Self::None,
        }
    }
}

impl From<GrayRule> for GrayFlags {
    fn from(rule: GrayRule) -> Self {
        Self { gray: rule != GrayRule::None, print_through: rule == GrayRule::PrintThrough }
    }
}

fn is_usual_tolerance(tolerance: &Length) -> bool {
    *tolerance == PLANE_TOLERANCE
}

impl Default for SliceSettings {
    fn default() -> Self {
        Self {
            pitch: Pitch::of_dpi(1500.0).expect("it is a resolution"),
            thickness: Thickness::OfPart {},
            plane: PlaneRule::default(),
            plane_tolerance: PLANE_TOLERANCE,
            side: Side::Both,
            solid: SolidSettings::default(),
            no_polish: false,
            gray: GrayRule::default(),
            antialias: false,
            exposure: ExposureSettings::default(),
            frame: SliceFrame::Around { margin: 1 },
        }
    }
}

impl SliceSettings {
    /// Returns the options of the library that neither a material nor a search decides.
    pub fn for_slicing(&self) -> SliceOptions {
        let usual = SliceOptions::default();
        SliceOptions {
            pitch: self.pitch,
            antialias: self.antialias,
            thickness: self.uniform_thickness().unwrap_or(usual.thickness),
            plane: self.plane,
            plane_tolerance: self.plane_tolerance,
            shading: self.side.into(),
            units: self.solid.units,
            placement: self.solid.placement(),
            fill: self.solid.fill,
            grid: self.grid(),
            polish: !self.no_polish,
            ..usual
        }
    }

    fn grid(&self) -> GridRule {
        match self.frame {
            SliceFrame::At { origin: FiniteNumbers(origin_mm), size } => {
                // A size of whole pixels may be a hair above: that must not add a pixel.
                let pixels = [size.width.pixels(self.pitch.x), size.height.pixels(self.pitch.y)];
                GridRule::At { origin_mm, pixels: pixels.map(|side| (side - 1e-6).ceil() as u32) }
            }
            SliceFrame::Around { margin } => GridRule::Around { margin },
        }
    }

    /// Returns the key of the first setting that differs from its default; `machine` may give
    /// defaults.
    pub fn stated(&self, machine: Option<&Machine>) -> Option<String> {
        let Defaults { pitch, thickness, margin } =
            machine.map(Machine::slicing_defaults).unwrap_or_default();
        let usual = Self::default();
        let usual = Self {
            pitch: pitch.unwrap_or(usual.pitch),
            thickness: thickness
                .map_or(usual.thickness, |thickness| Thickness::Uniform { thickness }),
            frame: margin.map_or(usual.frame, |margin| SliceFrame::Around { margin }),
            ..usual
        };
        differing(self, &usual)
    }

    /// Returns the settings that slice a part for a plan.
    #[must_use]
    pub fn turned(mut self, slicing: &TurnedSlicing) -> Self {
        let TurnedSlicing { degrees, origin_mm, size } = *slicing;
        self.solid.placement.rotate.push(Rotation { axis: Axis::Z, degrees });
        self.frame = SliceFrame::At { origin: FiniteNumbers(origin_mm), size };
        self
    }

    /// Returns the command as people type it, for files that stay where they are.
    pub fn command(&self, files: &[PartFile]) -> String {
        let word = |file: &PartFile| format!(" {}", quoted(&file.to_string()));
        let files: String = files.iter().map(word).collect();
        format!("slice{files}{}", words_of(self))
    }

    /// Returns the settings as one text, equal for all settings of the same meaning. Files, which
    /// have digests, appear only by the names that a stack records.
    pub fn canonical(&self) -> String {
        let mut settings = self.clone();
        settings.exposure.make_canonical();
        settings.solid.name();
        words_of(&settings)
    }

    /// Checks that a machine builds in this resolution, these thicknesses and this size, where
    /// given.
    ///
    /// # Errors
    /// Returns the exceeded limit.
    pub fn check_machine(&self, machine: &Machine) -> Result<(), MachineLimit> {
        machine.check_pitch(self.pitch, "the stack")?;
        machine.check_panel_pitch(self.pitch)?;
        if let SliceFrame::At { size, .. } = self.frame {
            machine.check_footprint(size, "the image")?;
        }
        match &self.thickness {
            Thickness::Adaptive { heights, .. } => {
                // The search chooses between both limits, so the machine must build both.
                machine.check_thickness(heights.min(), "the thinnest layer")?;
                machine.check_thickness(heights.max(), "the thickest layer")
            }
            Thickness::Uniform { thickness } => machine.check_thickness(*thickness, "a layer"),
            // Known once the part is open.
            Thickness::OfPart {} => Ok(()),
        }
    }

    /// Checks that no setting would be in vain on a machine with a panel, whose images are as large as
    /// it, with the part in their middle.
    ///
    /// # Errors
    /// Returns an error if one would.
    pub fn check_centered(&self, machine: &Machine) -> Result<(), Error> {
        let Some(panel) = &machine.panel else { return Ok(()) };
        let SliceFrame::Around { margin } = self.frame else { return Ok(()) };
        let (name, [width, height]) = (&machine.name, panel.size_mm());
        if (SliceFrame::Around { margin }) != Self::default().frame {
            return Err(Error::settings(format!(
                "--margin has no effect on {name}, whose images are as large as its panel: leave it out"
            )));
        }
        let moved = self.solid.placement.translate.map_or([0.0; 3], |FiniteNumbers(mm)| mm);
        if moved[..2] != [0.0; 2] {
            return Err(Error::settings(format!(
                "--translate has no effect across the panel of {name}, where the part lies in the \
                 middle: leave it out, or give --origin X,Y and --size {width}x{height}mm"
            )));
        }
        Ok(())
    }

    /// Returns the height in each layer at which the part is cut: 0 at the bottom, 1 at the top.
    pub fn cut(&self) -> f64 {
        match self.plane {
            PlaneRule::Bottom => 0.0,
            PlaneRule::Middle => 0.5,
            PlaneRule::Top => 1.0,
        }
    }

    /// Returns the thickness of all layers, if they have the same.
    pub fn uniform_thickness(&self) -> Option<Length> {
        match self.thickness {
            Thickness::Uniform { thickness } => Some(thickness),
            Thickness::Adaptive { .. } | Thickness::OfPart {} => None,
        }
    }

    /// Returns the settings for an open part: with the usual thickness, if neither they nor the
    /// part's files state one.
    ///
    /// # Errors
    /// Returns an error if the files state too many layers.
    #[must_use = "the settings themselves stay"]
    pub fn of_part(&self, part: &Part) -> Result<Self, Error> {
        let mut settings = self.clone();
        if self.thickness == (Thickness::OfPart {})
            && part.stated_layers(&self.solid.placement())?.is_none()
        {
            settings.thickness = Thickness::Uniform { thickness: USUAL_THICKNESS };
        }
        Ok(settings)
    }

    /// Returns the files that the settings name.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.exposure.files().chain(self.solid.cutters())
    }

    /// Returns the files that the settings name, to be changed.
    pub fn files_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        self.exposure.files_mut().chain(self.solid.cutters_mut())
    }

    /// Returns the exposure of the layers, if one is given.
    ///
    /// # Errors
    /// Returns an error if settings contradict each other, or the material cannot be read.
    pub fn exposure(&self) -> Result<Option<RecordedExposure>, Error> {
        let is_gray = self.gray != GrayRule::None;
        let heights = match &self.thickness {
            Thickness::Adaptive { heights, .. } => Some(heights),
            Thickness::Uniform { .. } | Thickness::OfPart {} => None,
        };
        let side = self.side;
        let has_side = side != Side::Both;
        // Gray levels change what a layer cures, and gray edges are no side.
        if let Some((_, option)) =
            [(is_gray, "--gray"), (self.antialias, "--antialias")].iter().find(|(given, _)| *given)
            && has_side
        {
            let why = format!("--side {side} decides all pixels of a layer: leave out {option}");
            return Err(Error::settings(why));
        }
        let needs_top =
            [(is_gray, "--gray"), (heights.is_some(), "--adaptive"), (has_side, "--side")];
        if let Some((_, option)) = needs_top.iter().find(|(given, _)| *given)
            && self.plane != PlaneRule::Top
        {
            let why = format!("{option} cuts layers at their tops: leave out --plane");
            return Err(Error::settings(why));
        }
        let exposure = self.exposure.exposure()?;
        // Gray levels need only doses.
        let known = exposure.as_ref().map(|recorded| &recorded.exposure);
        known.iter().filter(|_| !is_gray).try_for_each(|known| known.check_light())?;
        heights.map_or(Ok(()), |heights| heights.check(known))?;
        Ok(exposure)
    }
}

/// A stack's record of how its part was sliced.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct SlicingRecord {
    /// The part's files without their folders, and where they stand.
    #[serde(with = "parts")]
    pub parts: Vec<PartFile>,
    /// The part's name, if it was given one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The settings; files are words with digests.
    #[serde(flatten)]
    pub settings: SliceSettings,
    /// The word of a file that stood in for layers with gaps.
    #[serde(with = "optional", default, skip_serializing_if = "Option::is_none")]
    pub fallback: Option<String>,
    /// The word of the machine.
    #[serde(with = "optional", default, skip_serializing_if = "Option::is_none")]
    pub machine: Option<String>,
}

impl SlicingRecord {
    /// The key of the record in a stack's metadata.
    const KEY: &str = "slice";

    /// Reads the record of a stack. Returns `None` if the stack was not sliced by LAMP, or by a
    /// version with settings that this one does not know.
    pub fn of(stack: &StackInfo) -> Option<Self> {
        let value = stack.other.get(Self::KEY)?;
        let record: Self = serde_json::from_value(value.clone()).ok()?;
        // serde ignores keys that it does not know, and a setting that is ignored would slice
        // another part.
        (serde_json::to_value(&record).ok().as_ref() == Some(value)).then_some(record)
    }

    /// Writes the record into a stack's metadata, and the command that it stands for, for people.
    pub fn write(&self, stack: &mut StackInfo) {
        let record = serde_json::to_value(self).expect("a record is texts and flags");
        stack.other.insert(Self::KEY.to_owned(), record);
        let Self { parts, name, settings, fallback, machine } = self;
        #[derive(Serialize)]
        struct Rest<'a> {
            name: &'a Option<String>,
            fallback: &'a Option<String>,
            machine: &'a Option<String>,
        }
        let rest = words_of(&Rest { name, fallback, machine });
        stack.commands.push(settings.command(parts) + &rest);
    }

    /// Finds the material or table of the record again, in the first of these folders that has it.
    ///
    /// # Errors
    /// Returns an error if none has it with the digest of the record.
    pub fn find_exposure(&mut self, folders: &[&Path]) -> Result<(), Error> {
        self.settings.exposure.find(folders)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::step::Kernel;

    #[test]
    fn records_are_read_as_they_were_written() {
        for (settings, words) in [
            (
                json!({ "dpi": "1500", "thickness": "100um", "plane": "top", "units": "mm",
                        "fill": "even-odd", "margin": "1" }),
                "--dpi 1500 --thickness 100um --plane top --units mm --fill even-odd --margin 1",
            ),
            (
                json!({ "dpi": "72.25", "adaptive": true, "min": "0.5um", "step": "1um",
                        "criterion": "cusp", "cusp": "10um", "time-budget": "28800s",
                        "row-pitch": "1.5mm", "snap": true, "plane": "top", "units": "inch",
                        "fill": "solid", "scale": "1,2,0.5", "mirror": "x,y",
                        "rotate": "x:90,z:-12.5", "translate": "-5,0,12.7", "tolerance": "1um",
                        "no-polish": true, "gray": true, "antialias": true,
                        "material": "lamp-suspension", "overcure": "1.5", "origin": "-1,77.2",
                        "size": "80x80.5mm" }),
                "--dpi 72.25 --adaptive --min 0.5um --step 1um --criterion cusp --cusp 10um \
                 --time-budget 28800s --row-pitch 1.5mm --snap --plane top --units inch \
                 --fill solid --scale 1,2,0.5 --mirror x,y --rotate x:90,z:-12.5 \
                 --translate -5,0,12.7 --tolerance 1um --no-polish --gray --antialias \
                 --material lamp-suspension --overcure 1.5 --origin -1,77.2 --size 80x80.5mm",
            ),
            (
                json!({ "dpi": "300", "thickness": "1.5mm", "plane": "middle", "units": "mm",
                        "fill": "even-odd", "margin": "0",
                        "exposure-table": "my times --x.csv@blake3:0123456789abcdef" }),
                "--dpi 300 --thickness 1.5mm --plane middle --units mm --fill even-odd \
                 --exposure-table 'my times --x.csv@blake3:0123456789abcdef' --margin 0",
            ),
            (
                json!({ "dpi": "300", "thickness": "1mm", "plane": "top", "units": "mm",
                        "fill": "even-odd", "bodies": "xor", "subtract": ["./--core.stl", "b.stl"],
                        "margin": "1" }),
                "--dpi 300 --thickness 1mm --plane top --units mm --fill even-odd --bodies xor \
                 --subtract ./--core.stl --subtract b.stl --margin 1",
            ),
        ] {
            let settings: SliceSettings = serde_json::from_value(settings).unwrap();
            let parts =
                ["my --part.stl", "a.stl@1,0,0,0"].map(|text| text.parse().unwrap()).to_vec();
            let command = format!("slice 'my --part.stl' a.stl@1,0,0,0 {words}");
            assert_eq!(settings.command(&parts), command);
            for fallback in [None, Some("b c.stl".to_owned())] {
                let settings = settings.clone();
                let more = fallback.as_ref().map_or("", |_| " --fallback 'b c.stl'");
                let record = SlicingRecord {
                    parts: parts.clone(),
                    name: None,
                    settings,
                    fallback,
                    machine: None,
                };
                let mut stack = StackInfo::default();
                record.write(&mut stack);
                assert_eq!(stack.commands, [format!("{command}{more}")]);
                assert_eq!(SlicingRecord::of(&stack), Some(record));
            }
        }
    }

    #[test]
    fn a_record_with_a_setting_that_is_not_known_is_none() {
        let mut stack = StackInfo::default();
        let (settings, parts) = (SliceSettings::default(), vec!["a.stl".parse().unwrap()]);
        SlicingRecord { parts, name: None, settings, fallback: None, machine: None }
            .write(&mut stack);
        assert!(SlicingRecord::of(&stack).is_some());
        stack.other[SlicingRecord::KEY]["color"] = "red".into();
        assert_eq!(SlicingRecord::of(&stack), None);
    }

    #[cfg(unix)]
    #[test]
    fn files_may_have_names_that_are_no_text() {
        use std::os::unix::ffi::OsStringExt;
        let exposure_table = std::ffi::OsString::from_vec(b"times\xff.csv".to_vec()).into();
        let exposure = ExposureSettings::Table { exposure_table };
        let settings = SliceSettings { exposure, ..SliceSettings::default() };
        assert_eq!(settings.stated(None).as_deref(), Some("exposure-table"));
        assert!(settings.canonical().contains("--exposure-table"));
    }

    #[test]
    fn the_first_setting_that_is_stated_is_named() {
        let usual = SliceSettings::default();
        assert_eq!(usual.stated(None), None);
        let at =
            |dpi| SliceSettings { pitch: Pitch::of_dpi(dpi).unwrap(), ..SliceSettings::default() };
        assert_eq!(at(300.0).stated(None).as_deref(), Some("dpi"));
        let mut both = SliceSettings::default();
        both.solid.step.reader.kernel = Kernel::Both;
        assert_eq!(both.stated(None).as_deref(), Some("kernel"));
        // A result without a second opinion is another one.
        assert_ne!(both.canonical(), usual.canonical());
        let gray = SliceSettings { gray: GrayRule::PrintThrough, ..usual };
        assert_eq!(gray.stated(None).as_deref(), Some("gray"));
    }
}
