//! Options that decide the images of a part, and the command that stacks record.

use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use clap::Args;
use lamp_grayscale::exposure::Exposure;
use lamp_grayscale::resin::ExposureTime;
use lamp_postprocess::TurnedSlicing;
use lamp_postprocess::machine::{Defaults, Machine, MachineLimit};
use lamp_slicer::{
    Axis, Bodies, GridRule, LayerHeights, LayerLevels, PLANE_TOLERANCE, Part, PlaneRule,
    SliceOptions, Slices,
};
use lamp_stack::{Dpi, Layer, Length, Size, quoted, words};
use serde::{Deserialize, Serialize};

use crate::exit::Exit;
use crate::exposure::{EXPOSURE, ExposureOptions, RecordedExposure, numbers};
use crate::height_options::{self, HeightOptions};
use crate::memory::{available, in_words};
use crate::options::{one_of, parse_thickness};
use crate::part_options::PartOptions;
use crate::placement::Numbers;
use crate::progress::Progress;
use crate::recorded::{differing, from_words, optional, text, to_words};
use crate::step_options::HEADING;

/// Options that decide the images.
#[derive(Args, Clone, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub(crate) struct SlicingOptions {
    /// Resolution in dots per inch
    #[arg(long, value_name = "DPI", default_value_t = Self::default().dpi)]
    #[serde(with = "text")]
    pub(crate) dpi: Dpi,

    /// Layer thickness, for example 100um, 0.1mm, 4mil or 0.004in
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness)]
    #[arg(default_value_t = Self::default().thickness)]
    #[arg(allow_hyphen_values = true, conflicts_with = "adaptive")]
    #[serde(with = "text")]
    thickness: Length,

    /// Height in each layer at which the part is cut
    #[arg(long, value_parser = one_of::<PlaneRule>(), default_value_t)]
    #[serde(with = "text")]
    plane: PlaneRule,

    /// How far a vertex may be from a layer's plane and still count as lying on it
    ///
    /// Files round heights: 0.7 mm is 0.699999988 in 32 bits. Such noise would move a flat face by
    /// a layer. 0um compares heights as they are
    #[arg(long, value_name = "LENGTH", default_value_t = Self::default().plane_tolerance)]
    #[serde(with = "text")]
    plane_tolerance: Length,

    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) solid: PartOptions,

    /// Leave crossings on the facets of STEP parts, instead of moving them onto the exact
    /// surfaces
    #[arg(long, help_heading = HEADING)]
    no_polish: bool,

    /// Black pixels around the part's bounding box
    #[arg(long, value_name = "PIXELS", default_value_t = Self::default().margin)]
    #[serde(with = "text")]
    margin: u32,

    /// Top left corner of the image in part coordinates, in millimetres, instead of around the
    /// part's bounding box; the image must contain the part and keep its last column black
    #[arg(long, value_name = "X,Y", value_parser = parse_origin, requires = "size", conflicts_with = "margin")]
    #[arg(allow_hyphen_values = true)]
    #[serde(with = "optional")]
    origin: Option<Numbers<2>>,

    /// Size of the image, for example 80x80mm or 4x4.5in; needs --origin
    #[arg(long, value_name = "WxH", requires = "origin")]
    #[serde(with = "optional")]
    size: Option<Size>,

    /// Make each layer as thick as the part's slopes allow
    ///
    /// The options below set the limits and the largest error
    #[arg(long, help_heading = height_options::HEADING)]
    adaptive: bool,

    #[command(flatten)]
    #[serde(flatten)]
    heights: HeightOptions,

    #[command(flatten)]
    #[serde(flatten)]
    exposure: ExposureOptions,

    /// Write gray layers, which cure just down to where the part ends
    ///
    /// Each pixel is just bright enough to cure down to where the part ends below it, or white if
    /// that is deeper than white cures
    #[arg(long, requires = "material", conflicts_with = "exposure_table")]
    #[arg(help_heading = EXPOSURE)]
    gray: bool,

    /// Choose gray levels for doses that add up, so that light of the layers above does not cure
    /// through undersides
    ///
    /// With --gray. Down each column of pixels, the least light is taken away that leaves the
    /// underside where it is, from the lowest layers first
    #[arg(long, requires = "gray", help_heading = EXPOSURE)]
    pub(crate) print_through: bool,
}

impl Default for SlicingOptions {
    fn default() -> Self {
        Self {
            dpi: Dpi::new(1500.0).expect("it is a resolution"),
            thickness: Length::from_um(100.0),
            plane: PlaneRule::default(),
            plane_tolerance: PLANE_TOLERANCE,
            solid: PartOptions::default(),
            no_polish: false,
            margin: 1,
            origin: None,
            size: None,
            adaptive: false,
            heights: HeightOptions::default(),
            exposure: ExposureOptions::default(),
            gray: false,
            print_through: false,
        }
    }
}

impl SlicingOptions {
    pub(crate) fn for_slicing(&self) -> SliceOptions {
        SliceOptions {
            dpi: self.dpi,
            thickness: self.thickness,
            plane: self.plane,
            plane_tolerance: self.plane_tolerance,
            units: self.solid.units,
            placement: self.solid.placement(),
            fill: self.solid.fill,
            grid: self.grid(),
            polish: !self.no_polish,
            ..SliceOptions::default()
        }
    }

    fn grid(&self) -> GridRule {
        match (self.origin, self.size) {
            (Some(Numbers(origin_mm)), Some(size)) => {
                let side = |length: Length| (length.pixels(self.dpi) - 1e-6).ceil() as u32;
                GridRule::At { origin_mm, pixels: [side(size.width), side(size.height)] }
            }
            _ => GridRule::Around { margin: self.margin },
        }
    }

    /// Reads a part's files, with their placements, the options and the fallback from a command that
    /// a stack records; none if it is no slice command.
    pub(crate) fn of_command(command: &str) -> Option<(Vec<String>, Self, Option<String>)> {
        let mut words = words(command).ok()?;
        if words.first()? != "slice" {
            return None;
        }
        let first = words.iter().position(|word| word.starts_with("--")).unwrap_or(words.len());
        let mut options = words.split_off(first);
        let mut take = |option: &str| {
            let at = options.iter().position(|word| word == option)?;
            options.drain(at..options.len().min(at + 2)).next_back()
        };
        // Of the machine, all that decided images stands in other options.
        let [fallback, _] = ["--fallback", "--machine"].map(&mut take);
        words.remove(0);
        Some((words, from_words(&options)?, fallback))
    }

    /// Returns the first option that is not as it is by default, where `machine` may give
    /// defaults.
    pub(crate) fn stated(&self, machine: Option<&Machine>) -> Option<String> {
        let Defaults { dpi, thickness, margin } =
            machine.map(|machine| machine.defaults.clone()).unwrap_or_default();
        let usual = Self::default();
        let usual = Self {
            dpi: dpi.and_then(Dpi::new).unwrap_or(usual.dpi),
            thickness: thickness.unwrap_or(usual.thickness),
            margin: margin.unwrap_or(usual.margin),
            ..usual
        };
        differing(self, &usual).map(|key| format!("--{key}"))
    }

    /// Finds the material or table of a record again, in the first of these folders that has it.
    ///
    /// # Errors
    /// Returns an error if none has it with the digest of the record.
    pub(crate) fn find_exposure(&mut self, folders: &[&Path]) -> Result<(), Exit> {
        self.exposure.find(folders)
    }

    /// Returns the options that slice a part for a plan.
    pub(crate) fn turned(mut self, slicing: &TurnedSlicing) -> Self {
        let TurnedSlicing { degrees, origin_mm, size } = *slicing;
        self.solid.turn(Axis::Z, degrees);
        (self.origin, self.size) = (Some(Numbers(origin_mm)), Some(size));
        self
    }

    /// The command as the stack records it. `parts` are the part's files, with their placements;
    /// `exposure` is the word for the material or table.
    pub(crate) fn command(&self, parts: &[String], exposure: Option<&str>) -> String {
        let parts: String = parts.iter().map(|part| format!(" {}", quoted(part))).collect();
        let mut options = self.clone();
        options.exposure.name(exposure);
        let usual_kernel = self.solid.brep.reader.is_usual();
        let words =
            to_words(&options, |key| options.says(key) && (key != "kernel" || !usual_kernel));
        format!("slice{parts}{words}")
    }

    /// Returns whether an option says something beside the others.
    fn says(&self, key: &str) -> bool {
        match key {
            "thickness" => !self.adaptive,
            "bodies" => self.solid.bodies != Bodies::default(),
            "plane-tolerance" => self.plane_tolerance != PLANE_TOLERANCE,
            "overcure" => self.exposure.has_material(),
            "margin" => self.origin.is_none(),
            _ => true,
        }
    }

    /// Returns the options as words, the same for all that mean the same. Of files, which have
    /// digests, only names stand there that a stack records.
    pub(crate) fn canonical(&self) -> String {
        let mut options = self.clone();
        options.exposure.make_canonical();
        to_words(&options, |key| options.says(key))
    }

    /// Returns the files that the options name, to be changed.
    pub(crate) fn files_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        self.exposure.files_mut().chain(self.solid.cutters_mut())
    }

    /// The layers of a part, the first naming this command; `parts` are its files, with their
    /// placements.
    pub(crate) fn slices(
        &self,
        model: Part,
        parts: &[String],
        layers: Option<Range<u32>>,
        memory: Option<u64>,
        exposure: Option<RecordedExposure>,
        progress: &Progress,
    ) -> Result<(Slices, impl Fn(&mut Layer) + use<>), Exit> {
        let (word, exposure) = exposure.map(|it| (it.word, it.exposure)).unzip();
        let heights =
            self.adaptive.then(|| self.layer_heights(&model, exposure.as_ref(), progress));
        let heights = heights.transpose()?;
        let alone = exposure.as_ref().filter(|_| self.gray && !self.print_through);
        let gray = alone.map(|exposure| match &heights {
            Some(heights) => LayerLevels::by_thickness(heights, |um| exposure.levels(um)),
            None => exposure.levels(self.thickness).map(LayerLevels::from),
        });
        let gray = gray.transpose()?;
        let summed = exposure.as_ref().filter(|_| self.gray && self.print_through);
        let print_through = summed.map(|exposure| match &heights {
            Some(heights) => LayerLevels::by_thickness(heights, |um| exposure.fading_levels(um)),
            None => exposure.fading_levels(self.thickness).map(LayerLevels::from),
        });
        let print_through = print_through.transpose()?;
        let memory = table_memory(memory);
        let options =
            SliceOptions { layers, heights, gray, print_through, memory, ..self.for_slicing() };
        if let Some(exposure) = exposure.as_ref().filter(|_| !self.adaptive) {
            exposure.check(self.thickness)?;
            exposure
                .doubts(std::iter::once(self.thickness))
                .iter()
                .for_each(|doubt| progress.say(doubt));
        }
        let slices = Slices::new(model, &options)?;
        check_memory(&slices)?;
        let command = self.command(parts, word.as_deref());
        let numbers = exposure.as_ref().and_then(numbers);
        let name_command = move |layer: &mut Layer| {
            // All thicknesses were tried above.
            let time = |exposure: &Exposure| {
                exposure.time(Length::from_um(layer.info.thickness_um?)).ok().map(ExposureTime::ms)
            };
            layer.info.exposure_ms = exposure.as_ref().and_then(time);
            if let Some(stack) = &mut layer.info.stack {
                stack.commands.push(command.clone());
                let numbers = numbers.clone().map(|numbers| ("material".to_owned(), numbers));
                stack.other.extend(numbers);
            }
        };
        Ok((slices, name_command))
    }

    /// Finds the layer heights, with notes on them.
    fn layer_heights(
        &self,
        model: &Part,
        exposure: Option<&Exposure>,
        progress: &Progress,
    ) -> Result<LayerHeights, Exit> {
        let body = self.solid.body(model.clone())?;
        let part = self.heights.part(body, self.dpi, self.solid.fill)?;
        let found = self.heights.find(&part, exposure, progress)?;
        found.warn(&|line| progress.say(line));
        found.doubts(exposure).iter().for_each(|doubt| progress.say(doubt));
        if self.heights.has_budget() {
            let layers = found.heights.layers.len();
            let bound = found.bound();
            progress.say(&format!("{layers} layers keep the budget, with errors up to {bound}"));
        }
        Ok(found.heights.layer_heights()?)
    }

    /// Checks that a machine builds in this resolution, these thicknesses and this size, as far as
    /// it is given.
    pub(crate) fn check_machine(&self, machine: &Machine) -> Result<(), MachineLimit> {
        machine.check_dpi(self.dpi, "the stack")?;
        self.size.map_or(Ok(()), |size| machine.check_footprint(size, "the image"))?;
        if self.adaptive {
            machine.check_thickness(self.heights.min(), "the thinnest layer")?;
            machine.check_thickness(self.heights.max(), "the thickest layer")
        } else {
            machine.check_thickness(self.thickness, "a layer")
        }
    }

    /// Returns how far up in each layer the part is cut: 0 at the bottom, 1 at the top.
    pub(crate) fn cut(&self) -> f64 {
        match self.plane {
            PlaneRule::Bottom => 0.0,
            PlaneRule::Middle => 0.5,
            PlaneRule::Top => 1.0,
        }
    }

    /// Returns the thickness of all layers, if they have the same.
    pub(crate) fn uniform_thickness(&self) -> Option<Length> {
        (!self.adaptive).then_some(self.thickness)
    }

    /// Returns the files that the options name.
    pub(crate) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.exposure.files().chain(self.solid.cutters())
    }

    /// Returns the exposure of the layers, if one is given.
    ///
    /// # Errors
    /// Where options contradict each other, or the material cannot be read.
    pub(crate) fn exposure(&self) -> Result<Option<RecordedExposure>, Exit> {
        let needs_top = [(self.gray, "--gray"), (self.adaptive, "--adaptive")];
        if let Some((_, option)) = needs_top.iter().find(|(given, _)| *given)
            && self.plane != PlaneRule::Top
        {
            let why = format!("{option} cuts layers at their tops: leave out --plane");
            return Err(Exit::usage(why));
        }
        if !self.adaptive
            && let Some(option) = to_words(&self.heights, |_| true).split_whitespace().next()
        {
            return Err(Exit::usage(format!("{option} needs --adaptive")));
        }
        let recorded = self.exposure.exposure()?;
        let exposure = recorded.as_ref().map(|it| &it.exposure);
        // Gray levels need only doses.
        exposure.filter(|_| !self.gray).map_or(Ok(()), Exposure::check_light)?;
        if self.adaptive {
            self.heights.check(exposure)?;
        }
        Ok(recorded)
    }
}

/// Returns the share of the allowed memory for the table of crossings: its lists double as they
/// grow, and the rest is for images in progress. More than 64 MiB would not make it faster.
fn table_memory(allowed: Option<u64>) -> u64 {
    let there_is = available();
    let allowed = allowed.unwrap_or(there_is / 4).min(there_is);
    (allowed / 4).min(64 << 20)
}

/// Checks that there is memory for the largest layer alone.
fn check_memory(slices: &Slices) -> Result<(), Exit> {
    let (least, there_is) = (slices.least_memory(), available());
    if least <= there_is {
        return Ok(());
    }
    let [least, there_is] = [least, there_is].map(in_words);
    Err(Exit::Failed(anyhow!(
        "a layer takes some {least} of memory, and there are {there_is}: check --units and --dpi"
    )))
}

/// Parses `X,Y` in millimetres.
fn parse_origin(text: &str) -> Result<Numbers<2>, String> {
    let wrong = || format!("`{text}` is not a point: write X,Y in millimetres, as -1,77.2");
    text.trim_end_matches("mm").parse().map_err(|_| wrong())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recorded_commands_are_read_as_they_were_written() {
        for words in [
            "--dpi 1500 --thickness 100um --plane top --units mm --fill even-odd --margin 1",
            "--dpi 72.25 --adaptive --min 0.5um --step 1um --criterion cusp --cusp 10um \
             --time-budget 28800s --row-pitch 1.5mm --snap --plane top --units inch \
             --fill solid --scale 1,2,0.5 --mirror x,y --rotate x:90,z:-12.5 \
             --translate -5,0,12.7 --tolerance 1um --no-polish --gray --print-through \
             --material lamp-suspension --overcure 1.5 --origin -1,77.2 --size 80x80.5mm",
            "--dpi 300 --thickness 1.5mm --plane middle --units mm --fill even-odd \
             --exposure-table 'my times --x.csv@blake3:0123456789abcdef' --margin 0",
            "--dpi 300 --thickness 1mm --plane top --units mm --fill even-odd --bodies xor --margin 1",
        ] {
            let command = format!("slice 'my --part@1,2.stl' a.stl@1,0,0,0 {words}");
            let (parts, options, fallback) = SlicingOptions::of_command(&command).unwrap();
            assert_eq!(parts, ["my --part@1,2.stl", "a.stl@1,0,0,0"]);
            assert_eq!(options.command(&parts, None), command);
            assert_eq!(fallback, None);
            let (_, same, fallback) =
                SlicingOptions::of_command(&format!("{command} --fallback 'b c.stl'")).unwrap();
            assert_eq!(same.command(&parts, None), command);
            assert_eq!(fallback.as_deref(), Some("b c.stl"));
        }
        let (_, of_older, _) = SlicingOptions::of_command("slice a.stl --dpi 1500").unwrap();
        assert_eq!(of_older.command(&[], None), SlicingOptions::default().command(&[], None));
        for wrong in [
            "fix",
            "slice 'a.stl",
            "slice a.stl --colour red",
            "slice a.stl --dpi",
            "slice a --fill all",
        ] {
            assert!(SlicingOptions::of_command(wrong).is_none(), "{wrong}");
        }
    }
}
