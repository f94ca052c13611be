//! Options of the stages from layers to layers.

use std::path::PathBuf;

use clap::{ArgGroup, Args};
use lamp_fix::FixMethod;
use lamp_grayscale::DitherMethod;
use lamp_grayscale::resin::{Dose, QuantityError};
use lamp_pipeline::compensate::{CompensateSettings, FiringShrinkage};
use lamp_pipeline::dither::DitherSettings;
use lamp_pipeline::edit::EditSettings;
use lamp_pipeline::fix::FixSettings;
use lamp_stack::{Length, LengthError, Op};

use crate::args::lamp_option::LampOption;
use crate::args::options::{one_of_described, parse_distance};

/// How rows are corrected.
#[derive(Args, Clone)]
pub(crate) struct FixStageArgs {
    /// Source of the missing crossings
    #[arg(long, default_value_t, value_parser = one_of_described::<FixMethod>(&[
        "What the good rows above and below share; edges of wide bands become steps",
        "Smooth curves along the part's contours",
    ]))]
    method: FixMethod,

    /// Leave bands of more rows as they are, however certain their correction is [default: no limit]
    #[arg(long, value_name = "ROWS")]
    max_width: Option<u32>,

    /// Leave bands whose correction is less certain than this as they are, from 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = FixSettings::default().min_confidence)]
    #[arg(value_parser = parse_share)]
    min_confidence: f64,

    /// Use the layers below and above to find where contours cross bands of three rows and more
    #[arg(long)]
    use_neighbours: bool,
}

/// By what edges move and images grow.
#[derive(Args, Clone)]
pub(crate) struct CompensateStageArgs {
    /// Move all edges inwards by this distance, or outwards if it is negative
    #[arg(long, value_name = "LENGTH", value_parser = parse_offset, allow_hyphen_values = true)]
    uniform: Option<Length>,

    /// Move edges inwards by the cure width of a material: a built-in one or a file (see lamp material)
    #[arg(long, value_name = "M", conflicts_with = "uniform")]
    material: Option<PathBuf>,

    /// Dose of full white, for example 300mJ/cm2 [default: the page's exposure times the material's
    /// intensity]
    #[arg(long, value_name = "DOSE", value_parser = parse_dose, requires = "material")]
    dose: Option<Dose>,

    #[command(flatten)]
    lamp: LampOption,

    /// Keep walls at least this wide, or as they are if thinner; 0um lets them vanish [default: two
    /// pixels]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance, allow_hyphen_values = true)]
    min_feature: Option<Length>,

    /// Round edges to whole pixels, without gray
    #[arg(long)]
    one_bit: bool,

    /// Shrinkage s in firing, for example 2.1% or x:2.1%,y:1.8%: images are enlarged by 1 / (1 - s)
    #[arg(long, value_name = "SHARE", allow_hyphen_values = true)]
    shrinkage: Option<FiringShrinkage>,
}

/// How dots are made.
#[derive(Args, Clone)]
pub(crate) struct DitherStageArgs {
    /// Dithering method
    #[arg(long, default_value_t, value_parser = one_of_described::<DitherMethod>(&[
        "Dots far from each other, in no pattern: a mask of 128 x 128 thresholds",
        "Bayer's pattern of 16 x 16 thresholds",
        "Error diffusion, with the thresholds of blue noise",
        "Error diffusion in rows that turn: the most even gray within a layer",
        "No dots: levels of 128 and more, of 255, are white",
    ]))]
    method: DitherMethod,
}

/// The changes.
#[derive(Args, Clone)]
#[command(group = ArgGroup::new("what").required(true).args(["edits", "union", "intersect", "difference", "xor"]))]
pub(crate) struct EditStageArgs {
    /// The edits, a TOML file
    #[arg(value_name = "EDITS.toml")]
    edits: Option<PathBuf>,

    /// Keep what is white in either stack
    #[arg(long, value_name = "STACK")]
    union: Option<PathBuf>,

    /// Keep what is white in both stacks
    #[arg(long, value_name = "STACK")]
    intersect: Option<PathBuf>,

    /// Remove what is white in this stack
    #[arg(long, value_name = "STACK")]
    difference: Option<PathBuf>,

    /// Keep what is white in exactly one of the stacks
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
        Self { method: args.method }
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

fn parse_offset(text: &str) -> Result<Length, String> {
    text.parse().map_err(|error: LengthError| error.to_string())
}

fn parse_dose(text: &str) -> Result<Dose, String> {
    text.parse().map_err(|error: QuantityError| error.to_string())
}
