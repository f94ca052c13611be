//! `lamp split`: splits a stack into files of ranges of layers.

use std::num::NonZeroU32;
use std::path::PathBuf;

use clap::{ArgGroup, Args};
use lamp_stack::{SplitError, SplitPoints, write_split};

use crate::args::options::{Common, InputArgs};
use crate::exit::Exit;
use crate::streams::{counting, format, input_name, new_folder, read_layers, written_to};
use crate::terminal::progress::Progress;

/// Split a stack into files, each with a range of layers
///
/// Each file is a separate stack, named after its first and last layer: `layers_00500-00999.tif`.
/// `lamp join` puts them together again, byte for byte.
#[derive(Args)]
#[command(group = ArgGroup::new("cuts").required(true))]
#[command(after_help = "\
Examples:
  lamp split build.tif --every 500 -o ranges/
  lamp split build.tif --at 500,900 --classic -o ranges/
  slice blade.stl | fix | lamp split --every 100 -o ranges/
  lamp join ranges/*.tif -o build.tif")]
pub(crate) struct SplitArgs {
    #[command(flatten)]
    input: InputArgs,

    /// Put N layers into each file; the last file takes the rest
    #[arg(long, value_name = "N", group = "cuts", value_parser = parse_every)]
    every: Option<NonZeroU32>,

    /// Start a new file at each of these layers
    #[arg(long, value_name = "LAYER,...", group = "cuts", value_delimiter = ',')]
    at: Vec<u32>,

    /// Folder to write to; without --force it must be new or empty
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// Write classic TIFFs (at most 4 GiB each) instead of BigTIFFs
    #[arg(long)]
    classic: bool,

    /// Replace a folder that an earlier run wrote, once the new one is complete
    #[arg(long, alias = "overwrite")]
    force: bool,
}

pub(crate) fn run(args: &SplitArgs, common: &Common) -> Result<(), Exit> {
    let cuts = match args.every {
        Some(layers) => SplitPoints::Every(layers),
        // Not even equal ones: between them no layer would be left for a file.
        None if args.at.is_sorted_by(|a, b| a < b) => SplitPoints::At(args.at.clone()),
        None => {
            return Err(Exit::usage(
                "the layers of --at must be in ascending order, such as --at 500,900",
            ));
        }
    };
    let folder = new_folder(&args.output, args.force)?;
    let progress = Progress::new("split", common, true);
    let layers = read_layers(&args.input, &progress)?.inspect(counting(&progress));
    let written = write_split(layers, &cuts, folder, format(args.classic));
    written_to(&args.output, written, &progress).map_err(|error| match error {
        Exit::Failed(error) if error.is::<SplitError>() => {
            Exit::Failed(error).at(input_name(&args.input.stack))
        }
        error => error,
    })
}

fn parse_every(text: &str) -> Result<NonZeroU32, String> {
    text.parse().map_err(|_| format!("`{text}` is not a number of layers: write --every 500"))
}
