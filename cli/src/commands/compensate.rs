//! `lamp compensate`: moves edges by the cure width, and enlarges images for shrinkage.

use clap::Args;
use lamp_offset::CompensateError;
use lamp_pipeline::compensate::{CompensateSettings, Compensating, NoDose};

use crate::args::options::{Common, InputArgs, Output};
use crate::args::stages::CompensateStageArgs;
use crate::exit::Exit;
use crate::output::json_report::{JsonReport, ReportTo, schemas};
use crate::streams::{
    check_beside, check_not_input, input_name, progress, read_layers, write_layers,
};

/// Narrow images by the excess cure width, and compensate for firing shrinkage
///
/// Edges move by the exact distance at every angle; fractions of a pixel become gray, which
/// `dither` turns into dots. Layers of `slice --antialias` show where edges are within pixels, so
/// that straight edges are right to a third of a micrometer; without it, to 4 um at 1500 dpi.
/// Walls that would become thinner than --min-feature are narrowed less, so that no wall breaks or
/// is lost; each such wall is reported. With --min-feature 0um, walls may vanish, and each piece
/// that is lost or breaks apart is reported. In layers of slice --gray, outlines move. Images are
/// first enlarged for shrinkage; if you have the mesh, slice --scale is more exact.
#[derive(Args)]
#[command(after_help = "\
Examples:
  slice blade.stl --antialias | lamp compensate --uniform 25um | dither | tile > build.tif
  lamp compensate stack.tif --material mine.toml --dose 300mJ/cm2 --report walls.json -o out.tif
  lamp compensate stack.tif --uniform -10um --one-bit -o wider.tif
  lamp compensate stack.tif --shrinkage x:2.1%,y:1.8% -o larger.tif")]
pub(crate) struct CompensateArgs {
    #[command(flatten)]
    input: InputArgs,

    #[command(flatten)]
    settings: CompensateStageArgs,

    #[command(flatten)]
    report: ReportTo,

    #[command(flatten)]
    output: Output,
}

schemas! { "lamp-compensate-1": lamp_pipeline::WallHead, "walls": [lamp_pipeline::NarrowedWall]; }

pub(crate) fn run(args: &CompensateArgs, common: &Common) -> Result<(), Exit> {
    let CompensateArgs { input, settings, report, output } = args;
    let settings = CompensateSettings::from(settings);
    let compensating = Compensating::new(&settings)?;
    report.check_output(&output.output)?;
    if let Some(beside) = report.path() {
        check_beside(beside, &output.output, settings.inputs().chain([&input.stack]))?;
    }
    check_not_input(&output.output, settings.inputs())?;
    let progress = progress("compensate", common, output);
    let layers = compensating.layers(read_layers(input, &progress)?, 0..u32::MAX);
    let name = input_name(&input.stack);
    // Other errors have their place already: a page, or the output.
    let is_of_stage = |error: &Exit| {
        error.cause::<CompensateError>().is_some() || error.cause::<NoDose>().is_some()
    };
    write_layers(layers, output, &progress)
        .map_err(|error| if is_of_stage(&error) { error.at(name.clone()) } else { error })?;
    compensating.lines(&name).iter().for_each(|line| progress.say(line));
    let Some(path) = report.path() else { return Ok(()) };
    let (walls, layers) = compensating.report();
    JsonReport::of_schema("lamp-compensate-1", &walls.head(layers))
        .list("walls", walls.listed())
        .write(path)
}
