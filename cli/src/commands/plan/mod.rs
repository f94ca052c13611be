//! `lamp plan`: chooses exposures.

mod column_cure;
mod ecpl;
mod layer_map;
mod simulate;
pub(crate) mod speed;
mod speed_plot;
mod speed_report;
pub(crate) mod voxels;
mod voxels_plot;
mod voxels_report;

use clap::{Args, Subcommand};

use crate::args::options::Common;
use crate::exit::Exit;

/// Plan exposures, so that the doses of all layers together cure the part and nothing else
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp plan voxels part.tif --material mine.toml -o planned.tif
  lamp plan speed part.tif --material mine.toml -o timed.tif --profile speed.csv
  lamp plan column-cure lens-array --projector zhao --material pegda-mw700 -o plan/
  lamp plan ecpl hemisphere --projector jariwala --material tmpta -o plan/
  lamp cure planned.tif --material mine.toml --section y=12mm --dose-at top -o section.png")]
pub(crate) struct PlanArgs {
    #[command(subcommand)]
    what: PlanCommand,
}

#[derive(Subcommand)]
enum PlanCommand {
    Voxels(voxels::VoxelsArgs),
    ColumnCure(column_cure::ColumnCureArgs),
    Speed(speed::SpeedArgs),
    Ecpl(ecpl::EcplArgs),
    Simulate(simulate::SimulateArgs),
}

pub(crate) fn run(args: &PlanArgs, common: &Common) -> Result<(), Exit> {
    match &args.what {
        PlanCommand::Voxels(args) => voxels::run(args, common),
        PlanCommand::ColumnCure(args) => column_cure::run(args, common),
        PlanCommand::Speed(args) => speed::run(args, common),
        PlanCommand::Ecpl(args) => ecpl::run(args, common),
        PlanCommand::Simulate(args) => simulate::run(args, common),
    }
}
