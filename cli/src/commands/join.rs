use std::path::PathBuf;

use clap::Args;
use lamp_stack::join;

use crate::options::{Common, Output};
use crate::stop::Stop;
use crate::streams::{is_stream, report, write_layers};

/// Join stacks of ranges of layers to the one stack that they are parts of
///
/// Ranges that were made apart, by `slice --layers` and the stages behind it or by `lamp split`,
/// give the bytes of the stack made at once. They are joined only if they are of one part, size
/// and resolution, made by the same commands from the same input, and if each starts with the
/// layer behind the last of the one before it: a build that lacks layers is scrap. Whether layers
/// are missing below the first or above the last, only you can tell: `lamp info` says how many
/// there are.
#[derive(Args)]
#[command(after_help = "\
Examples:
  slice blade.stl --layers ..600 | fix > low.tif
  slice blade.stl --layers 600.. | fix > high.tif
  lamp join low.tif high.tif -o blade.tif
  lamp join ranges/*.tif | tile > build.tif")]
pub(crate) struct JoinArgs {
    /// The stacks, files or folders of pages, in the order of their layers
    #[arg(value_name = "STACK", required = true)]
    stacks: Vec<PathBuf>,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(args: &JoinArgs, common: &Common) -> Result<(), Stop> {
    if args.stacks.iter().any(|stack| is_stream(stack)) {
        return Err(Stop::usage(
            "stacks to join are looked at before they are read, which standard input does not allow: name files or folders",
        ));
    }
    let report = report("join", common, &args.output);
    let layers = join(args.stacks.clone())?.map(|layer| {
        let layer = layer?;
        if let Some(layers) = layer.info.stack.as_ref().and_then(|stack| stack.layers) {
            report.expect(layers.into());
        }
        Ok(layer)
    });
    write_layers(layers, &args.output, &report)
}
