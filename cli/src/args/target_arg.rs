//! Targets of planners on a fixed glass: a built-in target or a file.

use std::ops::Deref;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Args;
use lamp_pipeline::solid::part_notes;
use lamp_planning::projector::Projector;
use lamp_planning::target::{
    Grid, HeightMap, MapScale, Round, Shapes, Target, TargetError, TargetOptions,
};
use lamp_slicing::Units;
use lamp_stack::{Catalogued, Length};

use crate::args::options::{one_of, parse_thickness};
use crate::exit::Exit;
use crate::terminal::progress::Progress;

/// How a target's file is read.
#[derive(Args, Clone, Debug)]
pub(crate) struct TargetReading {
    /// Side of a height map's pixels on the glass
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness)]
    #[arg(requires_all = ["full", "target"])]
    pixel: Option<Length>,

    /// Height of a height map's full white
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness)]
    #[arg(requires_all = ["pixel", "target"])]
    full: Option<Length>,

    /// Unit of coordinates in STL and OBJ targets; STEP and 3MF files state their own
    #[arg(long, value_parser = one_of::<Units>(), default_value_t)]
    units: Units,
}

/// The target that a plan is for.
#[derive(Args, Clone, Debug)]
pub(crate) struct TargetArg {
    /// Target to cure: a built-in target (lens-array, sphere, hemisphere, ...; any other name lists
    /// them), a TOML file of shapes, a PNG height map (--pixel, --full) or a part with a flat
    /// bottom
    #[arg(value_name = "TARGET")]
    pub(crate) target: PathBuf,

    #[command(flatten)]
    reading: TargetReading,
}

impl TargetArg {
    /// Returns the target, which the projector's light must cover.
    pub(crate) fn open(
        &self,
        projector: &Projector,
        progress: &Progress,
    ) -> Result<GivenTarget, Exit> {
        self.reading.open(&self.target, projector, progress)
    }
}

/// A target, and how it was given, for messages.
pub(crate) struct GivenTarget {
    target: Target,
    given: String,
}

impl Deref for GivenTarget {
    type Target = Target;

    fn deref(&self) -> &Target {
        &self.target
    }
}

impl GivenTarget {
    /// Returns the heights of a grid's columns, none above the projector's chamber.
    pub(crate) fn heights(&self, grid: &Grid, projector: &Projector) -> Result<HeightMap, Exit> {
        let heights = || {
            let heights = self.target.heights(grid)?;
            if let Some(chamber) = &projector.chamber {
                heights.check_chamber(chamber.value)?;
            }
            Ok::<_, TargetError>(heights)
        };
        Ok(heights().with_context(|| self.given.clone())?)
    }

    /// Returns the heights over the distance from the axis, about which it must be round.
    pub(crate) fn profile(&self) -> Result<Round, Exit> {
        let [width, height] = self.target.size().map(Length::um);
        let step_um = (width.max(height) / 1000.0).max(2.0);
        let round = self.target.round(Length::from_um(step_um));
        Ok(round.with_context(|| self.given.clone())?)
    }
}

impl TargetReading {
    /// Returns the built-in target of a name, or the target in a file. The projector's light must
    /// cover it.
    pub(crate) fn open(
        &self,
        path: &Path,
        projector: &Projector,
        progress: &Progress,
    ) -> Result<GivenTarget, Exit> {
        let target = self.read(path)?;
        target.part().map(part_notes).iter().flatten().for_each(|note| progress.say(note));
        if self.pixel.is_some() && !target.is_picture() {
            return Err(Exit::usage("--pixel and --full are for height maps: leave them out"));
        }
        let given = path.display().to_string();
        target.check_width(projector).with_context(|| given.clone())?;
        Ok(GivenTarget { target, given })
    }

    fn read(&self, path: &Path) -> Result<Target, Exit> {
        if let Some(builtin) = path.to_str().and_then(Target::builtin) {
            return Ok(builtin);
        }
        if !path.exists() {
            let names: Vec<_> = Shapes::BUILTINS.iter().map(|builtin| builtin.name).collect();
            let (path, names) = (path.display(), names.join(", "));
            let text = format!("{path}: there is no such file, nor a built-in target: {names}");
            return Err(Exit::Failed(anyhow!(text)));
        }
        let scale = self.pixel.zip(self.full).map(|(pixel, full)| MapScale { pixel, full });
        let options = TargetOptions { scale, units: self.units };
        Ok(Target::open(path, &options).with_context(|| path.display().to_string())?)
    }
}
