//! Prints a plan of bitmaps on a glass on a simulated machine, and measures its heights.

use std::path::Path;

use lamp_grayscale::material::Material;
use lamp_grayscale::resin::Quantity;
use lamp_pipeline::glass::{ColumnCureSettings, EcplSettings, GlassJob, GlassKind, GlassSettings};
use lamp_pipeline::heights::significant;
use lamp_planning::learn::GlassModel;
use lamp_planning::print_sim::{GlassPrint, PrintSimError, Truth};
use lamp_planning::projector::SpreadOf;
use lamp_stack::Length;
use serde::Serialize;

use super::{Noise, PrintSimArgs};
use crate::exit::Exit;
use crate::output::json_report::{print_answer, schemas};
use crate::output::numbers::number_of;
use crate::streams::{input_name, is_stream, print, write_file};
use crate::terminal::progress::Progress;

/// The noise of heights that are measured without --noise: as of a good profilometer.
const NOISE: Length = Length::from_um(1.0);

/// A simulated print of a plan of column cure, by `lamp print-sim ... --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PrintSimColumnsAnswer<'a> {
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
    #[serde(flatten)]
    printed: PrintedHeights,
}

/// A simulated print of a plan by kinetics, by `lamp print-sim ... --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PrintSimRingsAnswer<'a> {
    /// Name of the material that the truth changes.
    material: &'a str,
    /// Name of the projector.
    projector: &'a str,
    /// True depth over which light fades, as a factor of the material's.
    penetration_depth_factor: f64,
    /// True dissolved oxygen, in mol/m3.
    oxygen_mol_per_m3: f64,
    /// True critical conversion.
    critical_conversion: f64,
    /// True light of full white in this print, in mW/cm2.
    intensity_mw_per_cm2: f64,
    /// True standard deviation of the light's blur, in micrometers.
    spread_um: f64,
    #[serde(flatten)]
    printed: PrintedHeights,
}

/// The measured heights of a simulated print.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PrintedHeights {
    /// Number of the print, from 0.
    print: usize,
    /// Seed of noise and places.
    seed: u64,
    /// Root mean square by which all heights are off, exactly, in micrometers, as the plan's report
    /// has it.
    rms_um: f64,
    /// Root mean square by which the measured heights are off, with noise, in micrometers.
    measured_rms_um: f64,
    /// Measured places.
    places: usize,
}

schemas! {
    "lamp-print-sim-columns-1": PrintSimColumnsAnswer<'_>;
    "lamp-print-sim-rings-1": PrintSimRingsAnswer<'_>;
}

/// Prints a job of a plan on a glass.
pub(super) fn run(
    kind: GlassKind,
    args: &PrintSimArgs,
    truth: &Truth,
    truth_name: String,
    material: Option<Material>,
    field: Option<&Path>,
    progress: &Progress,
) -> Result<(), Exit> {
    if args.body.is_some() {
        return Err(Exit::usage("--body is for jobs of stacks: leave it out"));
    }
    if args.places.is_some() {
        return Err(Exit::usage("--places is for jobs of stacks: leave it out"));
    }
    let at_truth = |error: PrintSimError| Exit::Failed(error.into()).at(truth_name);
    match kind {
        GlassKind::ColumnCure => {
            let run = GlassRun::<ColumnCureSettings>::new(args, material, progress)?;
            let change = truth.on_columns(&run.of, run.number).map_err(at_truth)?;
            let plant = run.of.changed(&change);
            let light = &run.job.prints[run.number].light;
            let light = match field {
                Some(field) => &run.job.settings().in_field(&plant, light, field)?,
                None => light,
            };
            let printed = run.print(&plant, light)?;
            let (SpreadOf::Cone(spread) | SpreadOf::Gaussian(spread)) = plant.projector.spread();
            let answer = PrintSimColumnsAnswer {
                material: &run.material.name,
                projector: &run.job.projector.name,
                penetration_depth_factor: change.depth,
                critical_dose_factor: change.critical_dose,
                intensity_mw_per_cm2: plant.projector.irradiance().mw_per_cm2(),
                spread_um: spread.um(),
                printed,
            };
            run.answer("lamp-print-sim-columns-1", &answer)
        }
        GlassKind::Ecpl => {
            let run = GlassRun::<EcplSettings>::new(args, material, progress)?;
            let change = truth.on_rings(&run.of, run.number).map_err(at_truth)?;
            let plant = run.of.changed(&change);
            let printed = run.print(&plant, &run.job.prints[run.number].light)?;
            let answer = PrintSimRingsAnswer {
                material: &run.material.name,
                projector: &run.job.projector.name,
                penetration_depth_factor: change.depth,
                oxygen_mol_per_m3: plant.setting.kinetics.oxygen.number(),
                critical_conversion: plant.setting.kinetics.critical_conversion,
                intensity_mw_per_cm2: plant.setting.light.mw_per_cm2(),
                spread_um: plant.setting.sigma_um,
                printed,
            };
            run.answer("lamp-print-sim-rings-1", &answer)
        }
    }
}

/// A print that is measured.
struct GlassRun<'a, S: GlassSettings> {
    args: &'a PrintSimArgs,
    progress: &'a Progress,
    job: GlassJob<S>,
    number: usize,
    /// The material that the truth changes.
    material: Material,
    /// The model with this material.
    of: S::Model,
    sd: Length,
}

impl<'a, S: GlassSettings> GlassRun<'a, S> {
    fn new(
        args: &'a PrintSimArgs,
        material: Option<Material>,
        progress: &'a Progress,
    ) -> Result<Self, Exit> {
        let sd = match args.noise {
            Some(Noise::Length(length)) => length,
            Some(Noise::Share(_)) => {
                return Err(Exit::usage("the --noise of heights is a length, such as 2um"));
            }
            None => NOISE,
        };
        let job = GlassJob::<S>::open(&args.job)?;
        let number = job.print_of(args.print)?;
        let material = material.unwrap_or_else(|| job.material.clone());
        let of = job.model_of(&material)?;
        Ok(Self { args, progress, job, number, material, of, sd })
    }

    /// Prints with the numbers of a machine, and writes the measured heights.
    fn print(
        &self,
        plant: &S::Model,
        light: &<S::Model as GlassModel>::Light,
    ) -> Result<PrintedHeights, Exit> {
        let Self { args, number, .. } = *self;
        let at_job = |error: PrintSimError| Exit::Failed(error.into()).at(input_name(&args.job));
        let printed = GlassPrint::new(plant, light, number, args.heights, self.sd, args.seed)
            .map_err(at_job)?;
        let table = printed.measured.to_text();
        match is_stream(&args.output) {
            true => print(&table)?,
            false => write_file(&args.output, |out| out.write_all(table.as_bytes()))?,
        }
        let measured_rms_um = printed.measured.error().number();
        let off = significant(measured_rms_um);
        let places = number_of(printed.places as u64, "column");
        self.progress.wrote(
            &args.output,
            &[format!("print {number}"), format!("heights of {places} are {off} um off (RMS)")],
        );
        let rms_um = plant.rms_um(light).map_err(|error| at_job(error.into()))?;
        let places = printed.places;
        Ok(PrintedHeights { print: number, seed: args.seed, rms_um, measured_rms_um, places })
    }

    fn answer(&self, schema: &'static str, answer: &impl Serialize) -> Result<(), Exit> {
        if self.args.json { print_answer(schema, answer) } else { Ok(()) }
    }
}
