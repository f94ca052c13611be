//! Options of the stages from layers to layers.

use std::num::{NonZeroU8, NonZeroU32};
use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args};
use lamp_fix::FixMethod;
use lamp_grayscale::DitherMethod;
use lamp_grayscale::resin::{Dose, QuantityError};
use lamp_pipeline::check::CheckSettings;
use lamp_pipeline::compensate::{CompensateSettings, EdgeDistance, FiringShrinkage};
use lamp_pipeline::dither::DitherSettings;
use lamp_pipeline::edit::EditSettings;
use lamp_pipeline::fix::FixSettings;
use lamp_pipeline::support::{Curvature, Degrees, FlowAngle, SupportSettings};
use lamp_stack::{FlowSection, Length, Op, StrutSection};
use lamp_supports::{
    AvoidedSurface, CheckOptions, FindingGroup, PillarSizes, SupportFoot, SupportOptions,
    avoided_surfaces,
};

use crate::args::lamp_option::LampOption;
use crate::args::options::{one_of_described, parse_distance, parse_thickness};
use crate::catalogue::read_text;

/// How rows are corrected.
#[derive(Args, Clone)]
pub(crate) struct FixStageArgs {
    /// Source of the missing crossings
    #[arg(long, default_value_t, value_parser = one_of_described::<FixMethod>(&[
        "The pixels that the good rows above and below share; edges of wide bands become steps",
        "Smooth curves along the part's contours",
    ]))]
    method: FixMethod,

    /// Do not correct bands of more rows than this, however certain the correction [default: no
    /// limit]
    #[arg(long, value_name = "ROWS")]
    max_width: Option<u32>,

    /// Do not correct bands whose correction is less certain than this, from 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = FixSettings::default().min_confidence)]
    #[arg(value_parser = parse_share)]
    min_confidence: f64,

    /// Use the layers below and above to find where contours cross bands of three or more rows
    #[arg(long = "use-neighbors", alias = "use-neighbours")]
    use_neighbours: bool,
}

/// By what edges move and images grow.
#[derive(Args, Clone)]
pub(crate) struct CompensateStageArgs {
    /// Move all edges inwards by this distance, or outwards if it is negative; 25x40um moves edges by
    /// an ellipse, 25 um along x and 40 um along y
    #[arg(long, value_name = "LENGTH|XxY")]
    uniform: Option<EdgeDistance>,

    /// Move edges inwards by the cure width of a material: a built-in one or a file (see lamp material)
    #[arg(long, value_name = "MATERIAL", conflicts_with = "uniform")]
    material: Option<PathBuf>,

    /// Dose of full white, for example 300mJ/cm2 [default: the page's exposure times the material's
    /// intensity]
    #[arg(long, value_name = "DOSE", value_parser = parse_dose, requires = "material")]
    dose: Option<Dose>,

    #[command(flatten)]
    lamp: LampOption,

    /// Keep walls at least this wide, and thinner walls unchanged; 0um lets walls vanish [default:
    /// two pixels]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance)]
    min_feature: Option<Length>,

    /// Round edges to whole pixels, without gray
    #[arg(long)]
    one_bit: bool,

    /// Shrinkage s in firing, for example 2.1% or x:2.1%,y:1.8%: images are enlarged by 1 / (1 - s)
    #[arg(long, value_name = "SHARE")]
    shrinkage: Option<FiringShrinkage>,
}

/// How dots are made.
#[derive(Args, Clone)]
pub(crate) struct DitherStageArgs {
    /// Dithering method
    #[arg(long, default_value_t, value_parser = one_of_described::<DitherMethod>(&[
        "Dots far from each other, without a pattern: a mask of 128 x 128 thresholds",
        "Bayer's pattern of 16 x 16 thresholds",
        "Error diffusion, with the thresholds of blue noise",
        "Error diffusion in alternating row directions: the most even gray within a layer",
        "No dots: levels from 128 to 255 are white",
    ]))]
    method: DitherMethod,

    /// Screen the inside of parts with square cells of this side, wider than the resin averages, for
    /// example 85um: uncured resin in black cells relieves stress
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance, requires = "cell_clearance")]
    pub(crate) cell: Option<Length>,

    /// Least distance between cells and the part's surfaces, also those above and below
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance, requires = "cell")]
    cell_clearance: Option<Length>,

    /// Share of cells that are white
    #[arg(long, value_name = "SHARE", default_value = "50%", value_parser = parse_percent)]
    #[arg(requires = "cell")]
    cell_level: f64,
}

/// The findings to look for, and their limits.
#[derive(Args, Clone)]
pub(crate) struct CheckStageArgs {
    /// Kinds of findings to report
    #[arg(long, value_name = "KINDS", value_delimiter = ',')]
    #[arg(value_parser = one_of_described::<FindingGroup>(&[
        "White areas that rest on nothing",
        "White areas that rest on little",
        "Black spaces without a way out",
        "White areas far from the white below",
        "Features and layers that break a design rule",
        "Centers of gravity outside the part's base",
        "Stray rows, white at the border, empty layers",
    ]))]
    only: Vec<FindingGroup>,

    /// Side of the square that must fit in an island
    #[arg(long, value_name = "LENGTH", default_value_t = CheckOptions::default().speck)]
    #[arg(value_parser = parse_distance)]
    speck: Length,

    /// Number of layers for which a thinner island must float
    #[arg(long, value_name = "N", default_value = "10")]
    speck_layers: NonZeroU32,

    /// Share of white that must rest on white
    #[arg(long, value_name = "SHARE", default_value = "25%", value_parser = parse_percent)]
    least_support: f64,

    /// How far white may reach beyond the white below [default: the layer's thickness, which is 45
    /// degrees]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance)]
    max_overhang: Option<Length>,

    /// Narrowest opening that drains a pocket. To find pockets with narrower openings, a ball of
    /// this diameter is tried at every place, which takes several times longer [default: a pixel
    /// and a layer]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance)]
    drain: Option<Length>,

    /// Lowest gray level that counts as white
    #[arg(long, value_name = "LEVEL", default_value = "1")]
    threshold: NonZeroU8,

    /// Machine whose blade drags on floating features: alpha, beta or a file (see lamp machine)
    ///
    /// The machine's defaults apply to resolution, thickness and margin unless you give others
    #[arg(long, value_name = "MACHINE", default_value = "alpha")]
    machine: PathBuf,

    /// Design rules: widths of walls, pins, slots and holes, bonds between layers, and lengths of
    /// pins and holes. lamp-mould, none or a file (docs/check.md)
    #[arg(long, value_name = "RULES", default_value = "lamp-mould")]
    rules: PathBuf,
}

/// The surfaces of a file.
#[derive(Clone)]
struct Avoided(Vec<AvoidedSurface>);

/// A list has a few lines for each surface.
const MAX_AVOID_BYTES: u64 = 1 << 20;

/// Reads a list of surfaces.
fn parse_avoided(path: &str) -> Result<Avoided, String> {
    let text = read_text(Path::new(path), MAX_AVOID_BYTES, "a list of surfaces");
    let text = text.map_err(|error| error.to_string())?;
    avoided_surfaces(&text).map(Avoided).map_err(|error| error.to_string())
}

/// Parses an angle above zero.
fn parse_overhang(text: &str) -> Result<Degrees, String> {
    match text.parse() {
        Ok(Degrees(angle)) if angle > 0.0 => Ok(Degrees(angle)),
        _ => Err(format!("`{text}` is no angle above 0deg up to 80deg, such as 45deg")),
    }
}

/// The heading of options that choose supports.
const CHOICE: &str = "Choice of supports";

/// The heading of options of supports that stand on the platform.
const PILLARS: &str = "Supports to the platform";

/// How islands are held.
#[derive(Args, Clone)]
pub(crate) struct SupportStageArgs {
    /// Where supports end
    #[arg(long, value_name = "WHERE", default_value_t = SupportFoot::Part)]
    #[arg(value_parser = one_of_described::<SupportFoot>(&[
        "On the part, as molds need it",
        "On the platform: pillars with thin tips, to be cut off after the build",
        "On either: the shortest support is built",
    ]))]
    to: SupportFoot,

    /// Also hold undersides that are flatter than this angle to the level
    #[arg(long, value_name = "ANGLE", value_parser = parse_overhang)]
    overhangs: Option<Degrees>,

    /// Distance between supports of undersides
    #[arg(long, value_name = "LENGTH", default_value_t = SupportOptions::default().spacing)]
    #[arg(value_parser = parse_thickness, help_heading = CHOICE)]
    spacing: Length,

    /// Surfaces that no support may touch, by box, color, face or paint, a TOML file
    #[arg(long, value_name = "FILE.toml", value_parser = parse_avoided, help_heading = CHOICE)]
    avoid: Option<Avoided>,

    /// Smallest diameter of the tips of pillars; wide islands get wider ones, up to --pillar
    #[arg(long, value_name = "LENGTH", default_value_t = PillarSizes::default().tip)]
    #[arg(value_parser = parse_thickness, help_heading = PILLARS)]
    tip: Length,

    /// Diameter of pillars
    #[arg(long, value_name = "LENGTH", default_value_t = PillarSizes::default().diameter)]
    #[arg(value_parser = parse_thickness, help_heading = PILLARS)]
    pillar: Length,

    /// Diameter of the bases of pillars, where the part leaves room
    #[arg(long, value_name = "LENGTH", default_value_t = PillarSizes::default().base)]
    #[arg(value_parser = parse_thickness, help_heading = PILLARS)]
    base: Length,

    /// Smallest distance between pillars and the part
    #[arg(long, value_name = "LENGTH", default_value_t = PillarSizes::default().clearance)]
    #[arg(value_parser = parse_distance, help_heading = PILLARS)]
    clearance: Length,

    /// Radius of supports; half the chord of streamlined ones
    #[arg(long, value_name = "LENGTH", default_value_t = SupportOptions::default().radius)]
    #[arg(value_parser = parse_thickness, help_heading = CHOICE)]
    radius: Length,

    /// Section of supports to the part
    #[arg(long, value_name = "SECTION", default_value_t = StrutSection::Round, help_heading = CHOICE)]
    #[arg(value_parser = one_of_described::<StrutSection>(&[
        "A circle",
        "An ellipse, its long axis along --flow",
        "A symmetric aerofoil, its leading edge upstream",
    ]))]
    strut_section: StrutSection,

    /// Direction of the flow past the supports: its angle from x, counterclockwise from above [default:
    /// 0deg, along x]
    #[arg(long, value_name = "ANGLE", help_heading = CHOICE, hide_short_help = true)]
    flow: Option<FlowAngle>,

    /// Thickness of a streamlined section as a share of its chord [default: 40%]
    #[arg(long, value_name = "SHARE", help_heading = CHOICE, hide_short_help = true)]
    #[arg(value_parser = parse_thickness_ratio)]
    thickness_ratio: Option<f64>,

    /// Largest angle between a support and the vertical
    #[arg(long, value_name = "ANGLE", default_value_t = Degrees(SupportOptions::default().max_tilt))]
    #[arg(help_heading = CHOICE)]
    max_tilt: Degrees,

    /// Greatest length of a support
    #[arg(long, value_name = "LENGTH", default_value_t = SupportOptions::default().max_length)]
    #[arg(value_parser = parse_thickness, help_heading = CHOICE)]
    max_length: Length,

    /// Smallest distance from a contact to edges where the surface turns by more than 30 degrees
    #[arg(long, value_name = "LENGTH", default_value_t = SupportOptions::default().edge_clearance)]
    #[arg(value_parser = parse_distance, help_heading = CHOICE)]
    edge_clearance: Length,

    /// Largest curvature of the surface around a contact: 1/mm is a radius of 1 mm
    #[arg(long, value_name = "CURVATURE", help_heading = CHOICE)]
    #[arg(default_value_t = Curvature(SupportOptions::default().max_curvature))]
    max_curvature: Curvature,

    /// Widest piece of an island that one support holds; wider islands are divided
    #[arg(long, value_name = "LENGTH", default_value_t = SupportOptions::default().hold)]
    #[arg(value_parser = parse_thickness, help_heading = CHOICE)]
    hold: Length,

    /// Number of directions to try
    #[arg(long, value_name = "N", default_value_t = 400, help_heading = CHOICE)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=100_000))]
    candidates: u32,

    /// Number of supports to list for each place: the one that is drawn, and alternatives
    #[arg(long, value_name = "N", default_value_t = 3, help_heading = CHOICE)]
    #[arg(value_parser = clap::value_parser!(u16).range(1..))]
    listed: u16,

    /// Share of an island's first layer that its supports must hold
    #[arg(long, value_name = "SHARE", default_value = "25%", value_parser = parse_percent)]
    least_support: f64,

    /// Side of the square that must fit in an island
    #[arg(long, value_name = "LENGTH", default_value_t = CheckOptions::default().speck)]
    #[arg(value_parser = parse_distance)]
    speck: Length,

    /// Number of layers for which a thinner island must float
    #[arg(long, value_name = "N", default_value = "10")]
    speck_layers: NonZeroU32,

    /// Lowest gray level that counts as white
    #[arg(long, value_name = "LEVEL", default_value = "1")]
    threshold: NonZeroU8,
}

/// The changes.
#[derive(Args, Clone)]
#[command(group = ArgGroup::new("what").required(true).args(["edits", "union", "intersect", "difference", "xor"]))]
pub(crate) struct EditStageArgs {
    /// The edits, a TOML file
    #[arg(value_name = "EDITS.toml")]
    edits: Option<PathBuf>,

    /// Keep pixels that are white in either stack
    #[arg(long, value_name = "STACK")]
    union: Option<PathBuf>,

    /// Keep pixels that are white in both stacks
    #[arg(long, value_name = "STACK")]
    intersect: Option<PathBuf>,

    /// Remove pixels that are white in this stack
    #[arg(long, value_name = "STACK")]
    difference: Option<PathBuf>,

    /// Keep pixels that are white in exactly one of the stacks
    #[arg(long, value_name = "STACK")]
    xor: Option<PathBuf>,
}

impl From<&FixStageArgs> for FixSettings {
    fn from(args: &FixStageArgs) -> Self {
        let FixStageArgs { method, max_width, min_confidence, use_neighbours } = *args;
        Self { method, max_width, min_confidence, use_neighbours }
    }
}

impl From<&CompensateStageArgs> for CompensateSettings {
    fn from(args: &CompensateStageArgs) -> Self {
        Self {
            uniform: args.uniform,
            material: args.material.clone(),
            dose: args.dose,
            lamp_intensity: args.lamp.light(),
            min_feature: args.min_feature,
            shrinkage: args.shrinkage,
            one_bit: args.one_bit,
        }
    }
}

impl From<&DitherStageArgs> for DitherSettings {
    fn from(args: &DitherStageArgs) -> Self {
        let DitherStageArgs { method, cell, cell_clearance, cell_level } = *args;
        Self { method, cell, cell_level, cell_clearance }
    }
}

impl From<CheckStageArgs> for CheckSettings {
    fn from(args: CheckStageArgs) -> Self {
        Self {
            only: args.only,
            speck: args.speck,
            speck_layers: args.speck_layers,
            least_support: args.least_support,
            max_overhang: args.max_overhang,
            drain: args.drain,
            threshold: args.threshold,
            machine: args.machine,
            rules: args.rules,
        }
    }
}

impl From<SupportStageArgs> for SupportSettings {
    fn from(args: SupportStageArgs) -> Self {
        Self {
            to: args.to,
            overhangs: args.overhangs,
            spacing: args.spacing,
            avoid: args.avoid.map(|avoided| avoided.0).unwrap_or_default(),
            tip: args.tip,
            pillar: args.pillar,
            base: args.base,
            clearance: args.clearance,
            radius: args.radius,
            strut_section: args.strut_section,
            thickness_ratio: args.thickness_ratio,
            flow: args.flow,
            max_tilt: args.max_tilt,
            max_length: args.max_length,
            edge_clearance: args.edge_clearance,
            max_curvature: args.max_curvature,
            hold: args.hold,
            candidates: NonZeroU32::new(args.candidates).expect("its range is above zero"),
            keep: args.listed,
            least_support: args.least_support,
            speck: args.speck,
            speck_layers: args.speck_layers,
            threshold: args.threshold,
        }
    }
}

impl From<&EditStageArgs> for EditSettings {
    fn from(args: &EditStageArgs) -> Self {
        let EditStageArgs { edits, union, intersect, difference, xor } = args;
        let combinations = [
            (Op::Union, union),
            (Op::Intersect, intersect),
            (Op::Difference, difference),
            (Op::Xor, xor),
        ];
        let given =
            |(op, file): (Op, &Option<PathBuf>)| Some(Self::Combine { op, stack: file.clone()? });
        combinations.into_iter().find_map(given).unwrap_or_else(|| Self::List {
            edits: edits.clone().expect("one of the group is given"),
        })
    }
}

/// Parses a share from 0 to 1.
fn parse_share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err(format!("`{text}` is not a share: write a number from 0 to 1")),
    }
}

fn parse_dose(text: &str) -> Result<Dose, String> {
    text.parse().map_err(|error: QuantityError| error.to_string())
}

fn parse_thickness_ratio(text: &str) -> Result<f64, String> {
    let share = parse_percent(text)?;
    match share < FlowSection::LEAST_RATIO {
        true => Err(format!("`{text}` is too thin: write at least 5%")),
        false => Ok(share),
    }
}

/// Parses a share: `25%` or `0.25`.
fn parse_percent(text: &str) -> Result<f64, String> {
    let (number, unit) = match text.strip_suffix('%') {
        Some(percent) => (percent, 100.0),
        None => (text, 1.0),
    };
    match number.trim().parse::<f64>() {
        Ok(number) if (0.0..=unit).contains(&number) => Ok(number / unit),
        _ => Err(format!("`{text}` is not a share: write 25% or 0.25")),
    }
}
