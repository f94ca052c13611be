//! `lamp calibrate gamma`: fits how much light a gray level passes to cure depths.

use clap::Args;
use lamp_grayscale::calibrate::{DepthPoint, GammaFit, depth_points, fit_gamma};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::{Dose, GrayLevel};
use lamp_plots::{Plot, Series, highest, linear};
use lamp_stack::format_significant;

use super::CalibrationFiles;
use super::estimate_table::EstimateTable;
use crate::args::options::Common;
use crate::exit::Exit;

/// Fit how much light a gray level passes to cure depths
///
/// Cure films of three gray levels or more, each for two doses or more. The CSV file has a header
/// with the columns gray (0 black to 1 white), depth_um, and dose_mj_per_cm2 (or exposure_ms, with
/// --intensity), the dose of full white. A gray level G passes G^gamma of the light. The material
/// gets gamma and the working curve. Rows with a depth of 0 or less are uncured and left out.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp calibrate gamma films.csv
  lamp calibrate gamma films.csv --material mine.toml -o mine.toml --plot gamma.svg")]
pub(super) struct GammaArgs {
    #[command(flatten)]
    files: CalibrationFiles,
}

pub(super) fn run(args: &GammaArgs, common: &Common) -> Result<(), Exit> {
    let files = &args.files;
    files.check()?;
    let base = files.base()?;
    let table = files.table()?;
    let at_place = |error: Exit| error.at(files.place());
    let measured = depth_points(&table, files.light(base.as_ref())?);
    let measured = measured.map_err(|error| at_place(error.into()))?;
    let fit = fit_gamma(&measured.points).map_err(|error| at_place(error.into()))?;
    let mut fitted = EstimateTable::new(files.place(), "gamma", &measured, "uncured");
    fitted.r2("R^2", fit.r2);
    fitted.heads();
    fitted.numbers("gamma", "1", fit.gamma);
    fitted.estimate("Ec", &fit.critical_dose);
    fitted.estimate("Dp", &fit.penetration_depth);
    let gamma = format_significant(fit.gamma[0], 3);
    let title = format!("{}: gamma {gamma}", files.source_name());
    let plot = plot(title, &fit, &measured.points);
    let source = files.source(fit.points);
    let add = |material: &mut Material| {
        material.gamma = Some(fit.gamma_number(&source));
        material.working_curve = Some(fit.curve(&source));
    };
    files.finish(base, add, &[plot], &fitted, common)
}

/// Depths over the dose of white, a curve for each gray level.
fn plot(title: String, fit: &GammaFit, points: &[DepthPoint]) -> Plot {
    let most = 1.05 * points.iter().map(|point| point.dose.mj_per_cm2()).fold(0.0, f64::max);
    let mut levels: Vec<GrayLevel> = points.iter().map(|point| point.gray).collect();
    levels.sort_by(|a, b| b.get().total_cmp(&a.get()));
    levels.dedup();
    let series = levels.into_iter().map(|gray| {
        // Where the level begins to cure.
        let begins = fit.critical_dose.value.mj_per_cm2() / gray.get().powf(fit.gamma[0]);
        let dose = |step: i32| begins + (most - begins) * f64::from(step) / 60.0;
        let depth = |dose: f64| (dose, fit.depth(gray, Dose::from_mj_per_cm2(dose)).um());
        let steps = if begins < most { 0..=60 } else { 0..=0 };
        let of_level = points.iter().filter(|point| point.gray == gray);
        Series {
            name: format!("gray {}", gray.get()),
            points: of_level.map(|p| (p.dose.mj_per_cm2(), p.depth.um())).collect(),
            curve: steps.map(|step| depth(dose(step))).collect(),
            band: Vec::new(),
        }
    });
    let series: Vec<Series> = series.collect();
    let y = linear("cure depth (µm)", 0.0..1.08 * highest(&series));
    Plot { title, x: linear("dose (mJ/cm²)", 0.0..most), y, series }
}
