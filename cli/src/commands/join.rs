//! `lamp join`: joins ranges of layers, or the strips or fields of a build.

use std::path::{Path, PathBuf};

use clap::Args;
use lamp_build::{is_fields, join_fields};
use lamp_stack::{Layer, PackLevel, Pages, StackFormat, join, join_packed};

use crate::args::options::{Common, Output};
use crate::exit::Exit;
use crate::streams::{
    format, input_name, is_stream, packed_destination, progress, stack_format, write_layers,
    written_to,
};
use crate::terminal::progress::Progress;
use crate::terminal::stack_notes::print_note;

/// Join stacks of consecutive layers into one stack
///
/// Ranges made separately, with `slice --layers` and later stages or with `lamp split`, give the
/// same bytes as a stack made in a single run. They must have the same part, size, resolution,
/// commands and input, and each must start right after the last layer of the previous range: a
/// build that lacks layers is scrap. Layers missing below the first or above the last are not
/// noticed: `lamp info` shows how many layers there are.
///
/// A folder of strips or fields from `tile` gives the build that they were cut from.
#[derive(Args)]
#[command(after_help = "\
Examples:
  slice blade.stl --layers ..600 | fix > low.tif
  slice blade.stl --layers 600.. | fix > high.tif
  lamp join low.tif high.tif -o blade.tif
  lamp join ranges/*.tif | tile > build.tif
  lamp join strips/ -o build.tif
  lamp join fields/ -o build.tif")]
pub(crate) struct JoinArgs {
    /// Stacks to join, files or folders of pages, in the order of their layers
    #[arg(value_name = "STACK", required = true)]
    stacks: Vec<PathBuf>,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(args: &JoinArgs, common: &Common) -> Result<(), Exit> {
    if args.stacks.iter().any(|stack| is_stream(stack)) {
        return Err(Exit::usage(
            "stacks to join are checked before they are read, which standard input does not \
             allow: name files or folders",
        ));
    }
    let progress = progress("join", common, &args.output);
    match &args.stacks[..] {
        // Strips and fields are joined side by side, ranges of layers one above the other.
        [folder] if is_fields(folder) => return join_one(folder, &args.output, &progress),
        stacks => {
            if let Some(folder) = stacks.iter().find(|stack| is_fields(stack)) {
                let folder = folder.display();
                return Err(Exit::usage(format!(
                    "{folder} holds the strips or fields of one build: join it by itself first"
                )));
            }
        }
    }
    let is_packed_output = stack_format(&args.output)? == StackFormat::Packed;
    if is_packed_output && args.stacks.iter().all(|stack| is_packed(stack)) {
        return join_frames(&args.stacks, &args.output, &progress);
    }
    let layers =
        join(args.stacks.clone(), |path, note| print_note(path, &note))?.map(|layer| Ok(layer?));
    write_layers(counted(layers, &progress), &args.output, &progress)
}

/// Returns whether a stack is packed. A stack that cannot be opened is reported later.
fn is_packed(stack: &Path) -> bool {
    Pages::open(stack).is_ok_and(|pages| pages.packed_format().is_some())
}

/// Joins packed stacks without coding their images again.
fn join_frames(stacks: &[PathBuf], output: &Output, progress: &Progress) -> Result<(), Exit> {
    let to = packed_destination(output)?;
    let joined = join_packed(stacks, to, format(output.classic), PackLevel::default());
    written_to(&output.output, joined.map_err(Exit::from), progress)
}

/// Puts the strips or fields of a folder back together.
fn join_one(folder: &Path, output: &Output, progress: &Progress) -> Result<(), Exit> {
    let name = input_name(folder);
    let failed = |error| Exit::from(error).at(name.clone());
    let layers = join_fields(folder).map_err(failed)?;
    write_layers(counted(layers.map(|layer| layer.map_err(failed)), progress), output, progress)
}

/// Passes the number of layers to the progress report, where the first layer states it.
fn counted(
    layers: impl Iterator<Item = Result<Layer, Exit>>,
    progress: &Progress,
) -> impl Iterator<Item = Result<Layer, Exit>> {
    layers.inspect(|layer| {
        let stack = layer.as_ref().ok().and_then(|layer| layer.info.stack.as_ref());
        if let Some(layers) = stack.and_then(|stack| stack.layers) {
            progress.expect(layers.into());
        }
    })
}
