use clap::Args;
use lamp_postprocess::TileOptions;
use lamp_stack::{Length, Size};

use crate::options::{Common, Input, Output, parse_distance};
use crate::stop::Stop;
use crate::streams::{input_name, read_layers, report, write_layers};

/// Lay copies of a part out on a black build area
///
/// The copies stand in rows from the top left, and the whole is centred. Where they stand is
/// written on the first page.
#[derive(Args)]
#[command(after_help = "\
Examples:
  slice blade.stl | fix | dither | tile > build.tif
  tile blade.tif --area 23x23in --gap 2mm -o build.tif
  tile blade.tif --area 200x200mm --copies 4 -o build.tif")]
pub(crate) struct TileArgs {
    #[command(flatten)]
    input: Input,

    /// The build area, as 4x4.5in or 100x80mm [default: 4x4.5in]
    #[arg(long, value_name = "WxH")]
    area: Option<Size>,

    /// How many copies [default: as many as fit]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    copies: Option<u32>,

    /// The least distance between copies [default: 1mm]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance, allow_hyphen_values = true)]
    gap: Option<Length>,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(args: &TileArgs, common: &Common) -> Result<(), Stop> {
    let plain = TileOptions::default();
    let options = TileOptions {
        area: args.area.unwrap_or(plain.area),
        copies: args.copies,
        gap: args.gap.unwrap_or(plain.gap),
    };
    let report = report("tile", common, &args.output);
    let name = input_name(&args.input.stack);
    let layers = read_layers(&args.input, &report)?;
    let build = lamp_postprocess::tile(layers, options);
    write_layers(build, &args.output, &report).map_err(|stop| match stop {
        Stop::Failed(error) if error.is::<lamp_postprocess::TileError>() => {
            Stop::Failed(error).at(name)
        }
        stop => stop,
    })
}
