//! `lamp dither`: turns gray layers into dots.

use clap::Args;
use lamp_build::{FieldForm, Seam};
use lamp_pipeline::dither::DitherSettings;

use crate::args::options::{Common, InputArgs, Output};
use crate::args::stages::DitherStageArgs;
use crate::exit::Exit;
use crate::field_folder::{read_stack_or_fields, write_stack_or_fields};
use crate::streams::progress;

/// Turn gray layers into dots; 1-bit layers pass unchanged
///
/// A gray level becomes the share of white pixels. Solid black and white do not change: no dot
/// appears outside the part. The pattern moves from layer to layer, so that holes do not line up;
/// the same layer always becomes the same dots. Resin averages dots of 17 um, but not of 85 um, so
/// pixels wider than 17 um cause a warning.
///
/// The strips or fields of a folder are joined into their build, which is dithered and cut again
/// with comb seams: no pixel of a seam is white twice.
#[derive(Args)]
#[command(after_help = "\
Examples:
  slice blade.stl | fix | dither | tile > build.tif
  dither gray.tif --layers 100..200 -o dots.tif
  dither gray.tif --method floyd-steinberg -o dots.tif
  dither blade.tif --cell 85um --cell-clearance 1mm -o relaxed.tif
  dither scans/ --method threshold -o masks/
  dither strips/ -o dots/")]
pub(crate) struct DitherArgs {
    #[command(flatten)]
    input: InputArgs,

    #[command(flatten)]
    settings: DitherStageArgs,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(args: &DitherArgs, common: &Common) -> Result<(), Exit> {
    if args.settings.cell.is_some() && args.input.layers.is_some() {
        return Err(Exit::usage(
            "--cell looks at the layers above and below: leave out --layers, and take layers from the \
             result with lamp split",
        ));
    }
    let progress = progress("dither", common, &args.output);
    let layers = read_stack_or_fields(&args.input, &progress)?;
    let settings = DitherSettings::from(&args.settings);
    let dots = settings.layers(layers, &progress)?;
    // Dots on ramps would be dots of each side alone.
    let by_comb = |form| FieldForm { seam: Seam::Comb, ..form };
    write_stack_or_fields(dots, &args.input, by_comb, &args.output, &progress)
}
