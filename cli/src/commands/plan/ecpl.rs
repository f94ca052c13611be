//! `lamp plan ecpl`: bitmaps that cure a round part through a glass, by the resin's kinetics.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::Args;
use lamp_grayscale::material::Material;
use lamp_pipeline::documents::document;
use lamp_planning::ShownBitmap;
use lamp_planning::ecpl::{KineticSetting, Method, Profile, RingExposure, RingPlan, plan};
use lamp_planning::projector::Projector;
use lamp_planning::target::Grid;
use serde_json::json;

use super::kinetics_report::{Cured, fields, lines_of};
use crate::args::options::{Common, one_of_described};
use crate::args::target_arg::TargetArg;
use crate::exit::Exit;
use crate::output::plan_folder::{PlanFiles, plan_folder, write_plan};
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
    #[arg(long, value_name = "NAME|FILE")]
    projector: PathBuf,

    /// Resin: a built-in material's name (see lamp material list) or a file. It must have
    /// [kinetics]
    #[arg(long, value_name = "NAME|FILE")]
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
    let projector: Projector = document(&args.projector)?;
    let material: Material = document(&args.material)?;
    let setting = setting_of(&projector, &material)?;
    let progress = Progress::new("plan", common, true);
    let target = args.target.open(&projector, &progress)?;
    let round = target.profile()?;
    let height_um = |radius_um| round.height_um(radius_um);
    let planned = plan(setting, round.radius_um(), height_um, args.method, || false)
        .map_err(|error| failed(error).at(args.target.target.display().to_string()))?;
    let RingPlan { simulation, wanted, exposures, cured } = &planned;
    let reported = Cured { simulation, exposures, cured, wanted: Some(wanted) };
    let mut report = json!({
        "schema": "lamp-plan-ecpl-1",
        "target": target.name(),
        "projector": projector.name,
        "material": material.name,
        "method": args.method.to_string(),
    });
    let report_fields = report.as_object_mut().expect("it is an object");
    report_fields.extend(fields(&reported));
    let grid = grid_of(cured, round.radius_um());
    let files = PlanFiles {
        part: target.name(),
        command: format!(
            "lamp plan ecpl {} --projector {} --material {} --method {}",
            target.name(),
            projector.name,
            material.name,
            args.method
        ),
        pitch: projector.pitch.value,
        bitmaps: &bitmaps(&projector, exposures),
        report: &report,
        target: Some(&grid.round(|radius_um| round.height_um(radius_um))),
        cured: &cured.on(&grid),
    };
    write_plan(folder, &files)?;
    lines_of(&reported).iter().for_each(|line| progress.say(line));
    Ok(())
}

/// Returns what a projector exposes a resin to.
pub(super) fn setting_of(
    projector: &Projector,
    material: &Material,
) -> Result<KineticSetting, Exit> {
    let Some(kinetics) = material.kinetics().map_err(anyhow::Error::new)? else {
        let name = &material.name;
        let text = format!("{name} lacks the rates of its reaction: add [kinetics]");
        return Err(Exit::Failed(anyhow!(text)));
    };
    KineticSetting::of(projector, kinetics)
        .map_err(|error| failed(error).at(projector.name.clone()))
}

/// The least width of columns of maps, in micrometers; for large parts they are wider.
const FINEST_UM: f64 = 2.0;
const MOST_ROWS: f64 = 1000.0;

/// Returns columns that hold all of a part, with room around it.
pub(super) fn grid_of(cured: &Profile, radius_um: f64) -> Grid {
    // A cured part may be wider than its target.
    let radius_um = 1.1 * radius_um.max(cured.base_um) + 10.0;
    let pitch_um = (2.0 * radius_um / MOST_ROWS).max(FINEST_UM);
    // An odd number puts a column on the axis.
    let columns = 2 * (radius_um / pitch_um).ceil() as usize + 1;
    Grid { columns, rows: columns, pitch_um }
}

pub(super) fn failed(error: impl std::error::Error + Send + Sync + 'static) -> Exit {
    Exit::Failed(error.into())
}

fn bitmaps(projector: &Projector, exposures: &[RingExposure]) -> Vec<ShownBitmap> {
    let display = &projector.display;
    let bitmap = |exposure: &RingExposure| ShownBitmap {
        image: exposure.drawn(display.columns, display.rows).into(),
        time: exposure.time,
    };
    exposures.iter().map(bitmap).collect()
}
