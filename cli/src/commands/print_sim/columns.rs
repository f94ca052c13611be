//! Prints a plan of column cure on a simulated machine, and measures its columns.

use lamp_grayscale::material::Material;
use lamp_pipeline::glass::ColumnJob;
use lamp_pipeline::heights::significant;
use lamp_planning::learn::{Columns, PrintMeasurements};
use lamp_planning::print_sim::{PrintSimError, PrintedColumns, Truth};
use lamp_planning::projector::SpreadOf;
use lamp_stack::Length;
use serde::Serialize;

use super::{Noise, PrintSimArgs};
use crate::exit::Exit;
use crate::output::json_report::{print_answer, schemas};
use crate::output::numbers::number_of;
use crate::streams::{input_name, is_stream, print, write_file};
use crate::terminal::progress::Progress;

/// The noise of columns that are measured without --noise: as of a good profilometer.
const NOISE: Length = Length::from_um(1.0);

/// A simulated print of a plan of column cure, by `lamp print-sim ... --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PrintSimColumnsAnswer<'a> {
    /// Number of the print, from 0.
    print: usize,
    /// Name of the material that the truth changes.
    material: &'a str,
    /// Name of the projector.
    projector: &'a str,
    /// True penetration depth of the liquid, as a factor of the material's.
    penetration_depth_factor: f64,
    /// True critical dose, as a factor of the material's.
    critical_dose_factor: f64,
    /// True light of full white in this print, in mW/cm2.
    intensity_mw_per_cm2: f64,
    /// True spread of light: its standard deviation, or half the side of a cone's square, in
    /// micrometers.
    spread_um: f64,
    /// Seed of noise and places.
    seed: u64,
    /// Root mean square by which the heights of all columns are off, exactly, in micrometers.
    rms_um: f64,
    /// Root mean square by which the measured heights are off, with noise, in micrometers.
    measured_rms_um: f64,
    /// Measured places.
    places: usize,
}

schemas! { "lamp-print-sim-columns-1": PrintSimColumnsAnswer<'_>; }

/// Prints a job of column cure.
pub(super) fn run(
    args: &PrintSimArgs,
    truth: &Truth,
    truth_name: String,
    material: Option<Material>,
    progress: &Progress,
) -> Result<(), Exit> {
    if args.body.is_some() {
        return Err(Exit::usage("--body is for jobs of stacks: leave it out"));
    }
    let sd = match args.noise {
        Some(Noise::Length(length)) => length,
        Some(Noise::Share(_)) => {
            return Err(Exit::usage("heights have a length as their --noise, such as 2um"));
        }
        None => NOISE,
    };
    let job = ColumnJob::open(&args.job)?;
    let number = job.print_of(args.print)?;
    let of = match material {
        Some(material) => Columns { material, ..job.columns.clone() },
        None => job.columns.clone(),
    };
    let failed = |error: PrintSimError| Exit::Failed(error.into());
    let change = truth.on_glass(&of, number).map_err(|error| failed(error).at(truth_name))?;
    let plant = of.changed(&change);
    let light = &job.prints[number].light;
    let printed = PrintedColumns::new(&plant, light, number, args.heights, sd, args.seed)
        .map_err(|error| failed(error).at(input_name(&args.job)))?;
    let table = printed.measured.to_csv();
    match is_stream(&args.output) {
        true => print(&table)?,
        false => write_file(&args.output, |out| out.write_all(table.as_bytes()))?,
    }
    let places = match &printed.measured {
        PrintMeasurements::Heights(rows) => rows.len(),
        PrintMeasurements::Areas(_) => 0,
    };
    let measured_rms_um = printed.measured.error().number();
    let off = significant(measured_rms_um);
    progress.wrote(
        &args.output,
        &[
            format!("print {number}"),
            format!("heights of {} are {off} um off (RMS)", number_of(places as u64, "column")),
        ],
    );
    if !args.json {
        return Ok(());
    }
    let off = printed.cured.less(&plant.wanted);
    let squares: f64 = off.iter().map(|off| off * off).sum();
    let (SpreadOf::Cone(spread) | SpreadOf::Gaussian(spread)) = plant.projector.spread();
    let answer = PrintSimColumnsAnswer {
        print: number,
        material: &of.material.name,
        projector: &of.projector.name,
        penetration_depth_factor: change.depth,
        critical_dose_factor: change.critical_dose,
        intensity_mw_per_cm2: plant.projector.irradiance().mw_per_cm2(),
        spread_um: spread.um(),
        seed: args.seed,
        rms_um: (squares / off.len() as f64).sqrt(),
        measured_rms_um,
        places,
    };
    print_answer("lamp-print-sim-columns-1", &answer)
}
