//! `lamp plan simulate`: computes what bitmaps cure on a fixed glass.

mod column;
mod exposures;
mod kinetics;

use std::ffi::OsString;
use std::path::PathBuf;

use clap::Args;
use lamp_grayscale::material::Material;
use lamp_pipeline::documents::document;
use lamp_pipeline::glass::{
    GivenTarget, GlassPlan, MeasuresReport, RingBitmap, RingOutcome, RingSetting,
};
use lamp_planning::PlanFolder;
use lamp_planning::column::Tracing;
use lamp_planning::projector::Projector;
use lamp_planning::target::HeightMap;
use lamp_stack::named;
use serde::Serialize;

use crate::args::options::{Common, one_of_described};
use crate::args::target_arg::TargetReading;
use crate::exit::Exit;
use crate::output::json_report::schemas;
use crate::output::plan_folder::{plan_folder, write_plan};
use crate::terminal::progress::Progress;
use exposures::Exposures;

/// Compute the part that bitmaps cure on fixed glass, from a plan or elsewhere
///
/// Bitmaps are a stack whose pages state their exposure times, or discs and rings that you type.
/// With --target, the cured part is compared with the target. -o writes bitmaps, report and
/// pictures.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp plan simulate plan/bitmaps.tif --model column --projector zhao --material pegda-mw700 \\
      --target lens-array
  lamp plan simulate 12:7.9s,11:0.8s,5-10:1.2s --model kinetics --projector jariwala \\
      --material tmpta --target hemisphere -o cured/")]
pub(super) struct SimulateArgs {
    /// Bitmaps in their order: a plan's bitmaps.tif, or discs and rings with their radius in
    /// mirrors and their time, such as 12:7.9s,5-11:0.8s
    #[arg(value_name = "BITMAPS")]
    bitmaps: OsString,

    /// How light cures
    #[arg(long, value_parser = one_of_described::<SimulationModel>(&[
        "Doses add up; each column is as high as its dose cures (000)",
        "Light, radicals and oxygen react; bitmaps must be discs and rings (003)",
    ]))]
    model: SimulationModel,

    /// Projector: a built-in projector's name (see lamp projector list) or a file
    #[arg(long, value_name = "PROJECTOR")]
    projector: PathBuf,

    /// Resin: a built-in material's name (see lamp material list) or a file
    #[arg(long, value_name = "MATERIAL")]
    material: PathBuf,

    /// Count rays from N x N points of a mirror in M x M directions, instead of integrating light
    /// exactly; 000 uses 9x15
    #[arg(long, value_name = "NxM")]
    rays: Option<Tracing>,

    /// Target to compare with, in any form that lamp plan column-cure accepts
    #[arg(long, value_name = "TARGET")]
    target: Option<PathBuf>,

    #[command(flatten)]
    reading: TargetReading,

    /// Write bitmaps, report and pictures to a new folder
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,

    /// Replace a folder that an earlier run wrote, once the new one is complete
    #[arg(long, alias = "overwrite", requires = "output")]
    force: bool,
}

/// How light cures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SimulationModel {
    Column,
    Kinetics,
}

named!(SimulationModel { Column = "column", Kinetics = "kinetics" });

/// Exposures of bitmaps, and the setup in which they are shown.
struct ShownExposures {
    exposures: Exposures,
    projector: Projector,
    material: Material,
    target: Option<GivenTarget>,
}

/// The outcome of showing bitmaps.
struct SimulationOutcome {
    cured: HeightMap,
    /// The wanted heights, on the same columns.
    wanted: Option<HeightMap>,
    /// Lines to print.
    lines: Vec<String>,
    /// The bitmaps of the report.
    bitmaps: SimulatedBitmaps,
    /// The sum of the exposure times, in seconds.
    seconds: f64,
    /// The rest of the report.
    report: SimulatedCure,
}

/// Simulation of bitmaps, by `lamp plan simulate`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct SimulationReport<'a> {
    schema: &'static str,
    /// How light cures: `column` or `kinetics`, by `--model`.
    model: String,
    /// Name of the projector.
    projector: &'a str,
    /// Name of the material.
    material: &'a str,
    /// Name of the target, or null.
    target: Option<&'a str>,
    /// With `--model column` the number of bitmaps, with `kinetics` the bitmaps.
    bitmaps: SimulatedBitmaps,
    /// Sum of the exposure times, in seconds.
    exposure_s: f64,
    #[serde(flatten)]
    cured: SimulatedCure,
}

/// The cured part, by the model.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged)]
enum SimulatedCure {
    /// With `--model column`.
    Columns {
        /// The cured part.
        cured: CuredColumns,
        /// Its measures, with `--target`.
        #[serde(skip_serializing_if = "Option::is_none")]
        measures: Option<MeasuresReport>,
    },
    /// With `--model kinetics`.
    Rings {
        #[serde(flatten)]
        setting: RingSetting,
        #[serde(flatten)]
        outcome: Box<RingOutcome>,
    },
}

/// Bitmaps, by the model.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged)]
enum SimulatedBitmaps {
    /// Their number.
    Count(usize),
    /// Bitmaps of rings.
    Rings(Vec<RingBitmap>),
}

/// A part of cured columns.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct CuredColumns {
    /// Greatest height, in micrometers.
    highest_um: f64,
    /// Volume, in cubic millimeters.
    volume_mm3: f64,
}

schemas! {
    "lamp-simulation-1": SimulationReport<'_>;
    "lamp-plan-column-cure-2": lamp_pipeline::glass::ColumnCureReport<'_>;
    "lamp-plan-ecpl-1": lamp_pipeline::glass::EcplReport<'_>;
}

pub(super) fn run(args: &SimulateArgs, common: &Common) -> Result<(), Exit> {
    // Before the simulation, which may take minutes: a folder that is in the way shows at once.
    let folder = match &args.output {
        Some(path) => Some(plan_folder(path, args.force)?),
        None => None,
    };
    let progress = Progress::new("plan", common, true);
    let projector: Projector = document(&args.projector)?;
    let target = match &args.target {
        Some(path) => Some(args.reading.settings(path).open(&projector, &progress)?),
        None => None,
    };
    let shown = ShownExposures {
        exposures: Exposures::read(&args.bitmaps, &projector)?,
        material: document(&args.material)?,
        projector,
        target,
    };
    let outcome = match args.model {
        SimulationModel::Column => column::cured(&shown, args.rays.unwrap_or_default())?,
        // Options can exclude each other, but not values of others, so this is checked here.
        SimulationModel::Kinetics if args.rays.is_some() => {
            return Err(Exit::usage("--rays is for --model column: leave it out"));
        }
        SimulationModel::Kinetics => kinetics::cured(&shown)?,
    };
    outcome.lines.iter().for_each(|line| progress.say(line));
    if let Some((folder, path)) = folder.zip(args.output.as_deref()) {
        write(folder, args.model, shown, outcome)?;
        progress.wrote(path, &[]);
    }
    Ok(())
}

fn write(
    folder: PlanFolder,
    model: SimulationModel,
    shown: ShownExposures,
    outcome: SimulationOutcome,
) -> Result<(), Exit> {
    let ShownExposures { exposures, projector, material, target } = shown;
    let name = target.as_ref().map(|target| target.name());
    let report = SimulationReport {
        schema: "lamp-simulation-1",
        model: model.to_string(),
        projector: &projector.name,
        material: &material.name,
        target: name,
        bitmaps: outcome.bitmaps,
        exposure_s: outcome.seconds,
        cured: outcome.report,
    };
    let report = serde_json::to_value(report).expect("reports have text keys");
    let compared = name.map_or_else(String::new, |name| format!(" --target {name}"));
    let plan = GlassPlan {
        part: name.unwrap_or(&exposures.name).to_owned(),
        command: format!(
            "lamp plan simulate {} --model {model} --projector {} --material {}{compared}",
            exposures.name, projector.name, material.name
        ),
        pitch: projector.pitch.value,
        bitmaps: exposures.bitmaps,
        report,
        wanted: outcome.wanted,
        cured: outcome.cured,
        inputs: Vec::new(),
    };
    write_plan(folder, &plan)
}
