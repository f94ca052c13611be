//! `lamp dither`: turns gray layers into dots.

use clap::Args;

use crate::exit::Exit;
use crate::options::{Common, Input, Output};
use crate::stages::dither::DitherSettings;
use crate::streams::{progress, read_layers, write_layers};

/// Turn gray layers into dots; 1-bit layers pass unchanged
///
/// A gray level becomes the share of white pixels. Solid black and white stay as they are: no dot
/// appears outside the part. The pattern moves from layer to layer, so that holes do not line up;
/// the same layer always becomes the same dots. Resin averages dots of 17 um, but not of 85 um, so
/// wider pixels than 17 um cause a warning.
#[derive(Args)]
#[command(after_help = "\
Examples:
  slice blade.stl | fix | dither | tile > build.tif
  dither gray.tif --layers 100..200 -o dots.tif
  dither gray.tif --method floyd-steinberg -o dots.tif
  dither scans/ --method threshold -o masks/")]
pub(crate) struct DitherArgs {
    #[command(flatten)]
    input: Input,

    #[command(flatten)]
    pub(crate) settings: DitherSettings,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(args: &DitherArgs, common: &Common) -> Result<(), Exit> {
    let progress = progress("dither", common, &args.output);
    let layers = read_layers(&args.input, &progress)?;
    write_layers(args.settings.layers(layers, &progress), &args.output, &progress)
}
