use clap::{Args, ValueEnum};
use lamp_grayscale::Method;

use crate::options::{Common, Input, Output};
use crate::stop::Stop;
use crate::streams::{read_layers, report, write_layers};

/// Turn gray layers into dots; 1-bit layers pass unchanged
///
/// Solid black and white are left alone: no dot appears outside the part.
#[derive(Args)]
#[command(after_help = "\
Examples:
  slice blade.stl | fix | dither | tile > build.tif
  dither gray.tif --method floyd-steinberg -o dots.tif")]
pub(crate) struct DitherArgs {
    #[command(flatten)]
    input: Input,

    /// How gray becomes dots: by a fixed 16 x 16 pattern, or by error diffusion
    #[arg(long, value_enum, default_value_t)]
    method: MethodArg,

    #[command(flatten)]
    output: Output,
}

#[derive(Clone, Copy, Default, ValueEnum)]
enum MethodArg {
    #[default]
    Ordered,
    FloydSteinberg,
}

pub(crate) fn run(args: &DitherArgs, common: &Common) -> Result<(), Stop> {
    let method = match args.method {
        MethodArg::Ordered => Method::Ordered,
        MethodArg::FloydSteinberg => Method::FloydSteinberg,
    };
    let report = report("dither", common, &args.output);
    let layers = read_layers(&args.input, &report)?;
    write_layers(lamp_grayscale::dither(layers, method), &args.output, &report)
}
