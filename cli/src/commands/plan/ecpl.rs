//! `lamp plan ecpl`: bitmaps that cure a round part through a glass, by the resin's kinetics.

use std::path::PathBuf;

use clap::Args;
use lamp_pipeline::glass::EcplSettings;
use lamp_planning::ecpl::Method;

use crate::args::options::{Common, one_of_described};
use crate::args::target_arg::TargetArg;
use crate::exit::Exit;
use crate::output::plan_folder::{plan_folder, write_plan};
use crate::terminal::progress::Progress;

/// Choose bitmaps and times that cure an axisymmetric part, by the kinetics of resin and oxygen
///
/// Oxygen stops the reaction until light has used it up, and returns from dark places, so doses do
/// not just add up. This command computes the reaction in the chamber, and finds the times of the
/// rings of mirrors that cure a part nearest to the target. Rings begin together, so that each
/// bitmap is inside the previous bitmap. The folder gets bitmaps.tif, report.json and pictures.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp plan ecpl hemisphere --projector jariwala --material tmpta -o plan/
  lamp plan ecpl lens.toml --projector mine.toml --material resin.toml --method seed -o plan/
  lamp plan simulate plan/bitmaps.tif --model kinetics --projector jariwala --material tmpta \\
      --target hemisphere")]
pub(super) struct EcplArgs {
    #[command(flatten)]
    target: TargetArg,

    /// Projector: a built-in projector's name (see lamp projector list) or a file. It must state
    /// the chamber's height, and spread light as a Gaussian
    #[arg(long, value_name = "PROJECTOR")]
    projector: PathBuf,

    /// Resin: a built-in material's name (see lamp material list) or a file. It must have
    /// [kinetics]
    #[arg(long, value_name = "MATERIAL")]
    material: PathBuf,

    /// How to find bitmaps and times
    #[arg(long, default_value_t)]
    #[arg(value_parser = one_of_described::<Method>(&[
        "The times of all rings of mirrors at once",
        "A disc from a table of discs, then successively smaller discs, as 003 does",
    ]))]
    method: Method,

    /// Folder to write
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,

    /// Replace a folder that an earlier run wrote, once the new one is complete
    #[arg(long, alias = "overwrite")]
    force: bool,
}

pub(super) fn run(args: &EcplArgs, common: &Common) -> Result<(), Exit> {
    let folder = plan_folder(&args.output, args.force)?;
    let progress = Progress::new("plan", common, true);
    let settings = EcplSettings {
        target: args.target.settings(),
        projector: args.projector.clone(),
        material: args.material.clone(),
        method: args.method,
    };
    let cure = settings.plan(&progress)?;
    write_plan(folder, &cure.glass_plan()?)?;
    progress.wrote(&args.output, &[]);
    cure.cured().lines().iter().for_each(|line| progress.say(line));
    Ok(())
}
