//! `lamp compose`: makes layers of a build by its recipe.

use std::ops::Range;
use std::path::PathBuf;

use clap::Args;
use lamp_build::{Composer, RecipeError};

use crate::args::options::{Common, Output, parse_layers};
use crate::exit::Exit;
use crate::streams::{check_not_input, input_name, is_stream, progress, write_layers};

/// Make layers of a build from its recipe
///
/// tile --recipe writes a few kilobytes: the places of copies, the mesh around them, and the names
/// and digests of the parts' stacks. From the recipe and the stacks, this command makes any layers
/// of the build, with the same bytes as tile. A machine can thus fetch each layer when it needs it.
/// A range of layers is a complete stack, as from lamp split. Stacks changed since then are
/// refused.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp compose build.json --layers 700..720 -o layers.tif
  lamp compose build.json --layers 812 -o pages/
  lamp compose build.json | lamp verify -
  lamp compose build.json --layers 812 | lamp show - --layer 812 -o layer.png")]
pub(crate) struct ComposeArgs {
    /// Recipe that tile --recipe wrote. Stack names in it are relative to its folder
    #[arg(value_name = "RECIPE")]
    recipe: PathBuf,

    /// Make only these layers of the build: A..B is A to B - 1; A.. and ..B are open-ended
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    layers: Option<Range<u32>>,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(args: &ComposeArgs, common: &Common) -> Result<(), Exit> {
    if is_stream(&args.recipe) {
        return Err(Exit::usage(
            "a recipe names its stacks from its folder: give the recipe's file name",
        ));
    }
    check_not_input(&args.output.output, [&args.recipe])?;
    let progress = progress("compose", common, &args.output);
    let name = input_name(&args.recipe);
    let failed = |error: RecipeError| Exit::from(error).at(name.clone());
    let mut composer = Composer::open(&args.recipe).map_err(failed)?;
    let layers = args.layers.clone().unwrap_or(0..u32::MAX);
    // The bar needs the number of layers that are made, not of the build.
    let indices = composer.indices().iter().filter(|index| layers.contains(index));
    progress.expect(indices.count() as u64);
    let composed = composer.range(layers).map_err(failed)?;
    write_layers(composed.map(|layer| layer.map_err(failed)), &args.output, &progress)
}
