//! Options of the solid: its files, units, placement, fill rule and STEP reader.

use std::time::Duration;

use clap::builder::{OsStringValueParser, TypedValueParser};
use clap::{Args, ValueEnum};
use lamp_pipeline::part_file::PartFile;
use lamp_pipeline::placement::{
    FiniteNumbers, PlacementSettings, Rotation, parse_scale, parse_translation,
};
use lamp_pipeline::solid::SolidSettings;
use lamp_pipeline::step::{Kernel, ReaderSettings, StepSettings};
use lamp_slicing::{Axis, Bodies, Fill, Units};
use lamp_stack::Length;

use crate::args::options::{one_of, parse_distance};

const PLACEMENT: &str = "Placement of the part, in this order";
pub(crate) const STEP: &str = "STEP parts";

/// Returns a parser of a part's file, with its placement.
pub(crate) fn part_file() -> impl TypedValueParser<Value = PartFile> {
    OsStringValueParser::new().try_map(PartFile::parse)
}

/// Options that decide the solid to slice.
#[derive(Args, Clone)]
pub(crate) struct SolidArgs {
    /// Unit of coordinates in STL and OBJ files; STEP and 3MF files state their own
    #[arg(long, value_parser = one_of::<Units>(), default_value_t)]
    units: Units,

    /// Rule for what is inside. solid: everything that shells wind around, so overlapping shells,
    /// bodies and files unite. even-odd: everything between odd and even crossings, so overlaps are
    /// cut out
    #[arg(long, value_parser = one_of::<Fill>(), default_value_t)]
    fill: Fill,

    /// How overlapping bodies of a STEP file, or items of a 3MF, join under --fill even-odd:
    /// united, or with the overlap cut out, as for files that overlap
    #[arg(long, value_parser = one_of::<Bodies>(), default_value_t)]
    bodies: Bodies,

    /// Cut this file out of the part, such as a core out of its mold; may be given several times
    #[arg(long, value_name = "FILE", value_parser = part_file())]
    subtract: Vec<PartFile>,

    /// Keep only where the part and this file overlap; may be given several times
    #[arg(long, value_name = "FILE", value_parser = part_file())]
    intersect: Vec<PartFile>,

    #[command(flatten)]
    placement: PlacementArgs,

    /// Accept the part's size, even if single vertices lie far outside the rest, or there are more
    /// rows than any machine exposes
    #[arg(long)]
    trust_extent: bool,

    #[command(flatten)]
    pub(crate) step: StepArgs,
}

/// Options of a part's placement.
#[derive(Args, Clone)]
pub(crate) struct PlacementArgs {
    /// Scale the part, by one factor or a factor for each axis: 1.02 makes up for about 2% of
    /// shrinkage
    #[arg(long, value_name = "F|X,Y,Z", value_parser = parse_scale, help_heading = PLACEMENT)]
    scale: Option<FiniteNumbers<3>>,

    /// Mirror the part: x swaps left and right
    #[arg(long, value_name = "AXIS", value_parser = one_of::<Axis>(), value_delimiter = ',')]
    #[arg(help_heading = PLACEMENT)]
    mirror: Vec<Axis>,

    /// Rotate the part by degrees, as in x:90,z:-12.5
    ///
    /// The axis goes through the origin; rotation is counterclockwise as seen from the axis's tip.
    /// Several rotations apply in order. Quarter turns are exact
    #[arg(long, value_name = "AXIS:DEGREES", value_delimiter = ',', help_heading = PLACEMENT)]
    rotate: Vec<Rotation>,

    /// Move the part, in millimeters. The image moves with the part: its origin and the layers'
    /// heights are in the moved part's coordinates
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_translation, help_heading = PLACEMENT)]
    translate: Option<FiniteNumbers<3>>,
}

/// Options for reading STEP parts.
#[derive(Args, Clone)]
pub(crate) struct StepArgs {
    /// How far the facets of a STEP part may lie from its surfaces [default: a quarter of a
    /// pixel]
    #[arg(long, value_name = "LENGTH", value_parser = parse_tolerance, help_heading = STEP)]
    tolerance: Option<Length>,

    #[command(flatten)]
    pub(crate) reader: ReaderArgs,
}

/// The program that reads STEP parts, and its time limit.
#[derive(Args, Clone)]
pub(crate) struct ReaderArgs {
    /// Kernel that reads STEP parts: LAMP's own, OpenCASCADE, or LAMP's own if OpenCASCADE agrees
    /// with it (the last two in builds with --features occt)
    #[arg(long, value_enum, default_value_t, help_heading = STEP)]
    kernel: KernelArg,

    /// Time limit for reading a STEP part, in seconds
    #[arg(long, value_name = "SECONDS", default_value = "300", value_parser = parse_seconds)]
    #[arg(help_heading = STEP)]
    timeout: Duration,
}

/// The kernel, as `--help` lists it.
#[derive(Clone, Copy, Default, ValueEnum)]
enum KernelArg {
    #[default]
    Lamp,
    Occt,
    Both,
}

impl From<&SolidArgs> for SolidSettings {
    fn from(args: &SolidArgs) -> Self {
        let SolidArgs { units, fill, bodies, subtract, intersect, .. } = args;
        Self {
            units: *units,
            fill: *fill,
            bodies: *bodies,
            subtract: subtract.clone(),
            intersect: intersect.clone(),
            placement: (&args.placement).into(),
            trust_extent: args.trust_extent,
            step: (&args.step).into(),
        }
    }
}

impl From<&PlacementArgs> for PlacementSettings {
    fn from(PlacementArgs { scale, mirror, rotate, translate }: &PlacementArgs) -> Self {
        let (mirror, rotate) = (mirror.clone(), rotate.clone());
        Self { scale: *scale, mirror, rotate, translate: *translate }
    }
}

impl From<&StepArgs> for StepSettings {
    fn from(StepArgs { tolerance, reader }: &StepArgs) -> Self {
        Self { tolerance: *tolerance, reader: reader.into() }
    }
}

impl From<&ReaderArgs> for ReaderSettings {
    fn from(&ReaderArgs { kernel, timeout }: &ReaderArgs) -> Self {
        let kernel = match kernel {
            KernelArg::Lamp => Kernel::Lamp,
            KernelArg::Occt => Kernel::Occt,
            KernelArg::Both => Kernel::Both,
        };
        Self { kernel, timeout }
    }
}

pub(crate) fn parse_tolerance(text: &str) -> Result<Length, String> {
    let length = parse_distance(text)?;
    let has_some = length.um() > 0.0;
    if has_some { Ok(length) } else { Err("the length must be above zero".to_owned()) }
}

fn parse_seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.trim_end_matches('s').parse().ok();
    let seconds = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    seconds
        .filter(|seconds| !seconds.is_zero())
        .ok_or_else(|| format!("`{text}` is not a time: write seconds, such as 60"))
}
