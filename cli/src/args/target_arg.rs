//! Targets of planners on a fixed glass: a built-in target or a file.

use std::path::{Path, PathBuf};

use clap::Args;
use lamp_pipeline::glass::TargetSettings;
use lamp_slicing::Units;
use lamp_stack::Length;

use crate::args::options::{one_of, parse_thickness};

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
    target: PathBuf,

    #[command(flatten)]
    reading: TargetReading,
}

impl TargetArg {
    /// Returns the target's settings.
    pub(crate) fn settings(&self) -> TargetSettings {
        self.reading.settings(&self.target)
    }
}

impl TargetReading {
    /// Returns the settings of a target.
    pub(crate) fn settings(&self, target: &Path) -> TargetSettings {
        let Self { pixel, full, units } = *self;
        TargetSettings { target: target.to_owned(), pixel, full, units }
    }
}
