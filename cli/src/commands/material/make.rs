//! `lamp material make`: a material from what is mixed.

use std::path::PathBuf;

use clap::Args;
use lamp_grayscale::material::Composition;
use lamp_pipeline::documents::read_file;

use crate::args::options::Common;
use crate::exit::Exit;
use crate::output::endings::parse_toml;
use crate::streams::{check_beside, input_name, is_stream, print, write_file};
use crate::terminal::progress::Progress;

/// Make a material from the composition of a suspension
///
/// Models compute critical dose, penetration depth and shrinkage from the composition. They show
/// only trends: which way a recipe moves a resin. docs/materials.md describes the file. Calibrate
/// before you build.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp material make composition.toml
  lamp material make composition.toml -o mine.toml")]
pub(super) struct MakeArgs {
    /// Composition: a TOML file, or - for standard input
    composition: PathBuf,

    /// Material file to write [default: standard output]
    #[arg(short, long, value_name = "OUT", default_value = "-", hide_default_value = true)]
    #[arg(value_parser = parse_toml)]
    output: PathBuf,
}

pub(super) fn run(args: &MakeArgs, common: &Common) -> Result<(), Exit> {
    let MakeArgs { composition, output } = args;
    if !is_stream(output) {
        check_beside(output, std::path::Path::new("-"), [composition])?;
    }
    let (mixed, _) = read_file::<Composition>(composition)?;
    let failed = |error: anyhow::Error| Exit::Failed(error).at(input_name(composition));
    let material = mixed.material().map_err(|error| failed(error.into()))?;
    let text = material.to_toml().map_err(|error| failed(error.into()))?;
    let progress = Progress::new("material", common, true);
    if is_stream(output) {
        print(&text)?;
    } else {
        write_file(output, |out| out.write_all(text.as_bytes()))?;
    }
    progress.say("these numbers show trends: calibrate before you build");
    Ok(())
}
