//! `lamp calibrate lamp`: fits how the critical dose follows the lamp.

use clap::Args;
use lamp_grayscale::calibrate::{LampFit, LampPoint, fit_lamp, lamp_points};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::{Dose, Intensity};
use lamp_stack::Dpi;

use super::depth::{levelled, write_line};
use super::estimate_table::{EstimateTable, in_legend, short};
use super::{CalibrationFiles, composition};
use crate::args::options::Common;
use crate::exit::Exit;
use crate::terminal::progress::Progress;
use lamp_plots::{Plot, PlotAxis, Series, highest};

/// Fit how the critical dose changes as a lamp ages, from cure depths under several lights
///
/// The CSV file has a header with the columns lamp_mw_per_cm2 (the light of full white under which
/// the film was cured), dose_mj_per_cm2 (or exposure_ms, the time under that light) and depth_um.
/// Filters in front of the lamp give several lights. Squares of one size, with feature_px (or
/// feature_um) and cured_um (or width_um) in place of depth_um, give how the cure width follows the
/// lamp. Other commands use the results with --lamp-intensity.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp calibrate lamp filters.csv
  lamp calibrate lamp filters.csv --material mine.toml -o mine.toml --plot lamp.svg")]
pub(super) struct LampArgs {
    #[command(flatten)]
    files: CalibrationFiles,

    /// Resolution of feature_px, in dots per inch
    #[arg(long, default_value = "1500")]
    dpi: Dpi,
}

pub(super) fn run(args: &LampArgs, common: &Common) -> Result<(), Exit> {
    let files = &args.files;
    files.check()?;
    let base = files.base()?;
    let table = files.table()?;
    let has = |name: &str| table.columns().iter().any(|column| column == name);
    if !has("depth_um") && (has("cured_um") || has("width_um")) {
        return composition::fit(files, base, &table, args.dpi, "lamp", common);
    }
    let at_place = |error: Exit| error.at(files.place());
    let measured = lamp_points(&table).map_err(|error| at_place(error.into()))?;
    let points = &measured.points[..];
    let fit = fit_lamp(points).map_err(|error| at_place(error.into()))?;
    let progress = Progress::new("calibrate", common, true);
    levelled(&fit.critical_dose, "the critical dose", "mJ/cm2", &progress);
    let mut fitted = EstimateTable::new(files.place(), "lamp", &measured, "uncured");
    fitted.heads();
    for &(lamp, films) in &fit.lights {
        let critical = fit.critical_dose_at(lamp);
        fitted.group("lamp_mw_per_cm2", lamp.mw_per_cm2(), films, None);
        fitted.number_of_group("Ec", critical);
        let critical = short(critical.mj_per_cm2());
        fitted.line(&format!("Ec at {lamp}"), &[&critical, &format!("{films} points")]);
    }
    write_line(&mut fitted, "Ec(I)", &fit.critical_dose);
    fitted.estimate("Dp", &fit.penetration_depth);
    fitted.r2("R^2", fit.r2);
    let source = files.source(points.len());
    let add = |material: &mut Material| {
        material.dimmed_lamp = Some(fit.lines(&source));
        // Commands need a model of white, too.
        if material.working_curve.is_none() {
            material.working_curve = Some(fit.brightest(&source));
        }
    };
    let title = format!("Cure depth by lamp: {}", files.source_name());
    files.finish(base, add, &[plot(title, &fit, points)], &fitted, common)
}

fn plot(title: String, fit: &LampFit, points: &[LampPoint]) -> Plot {
    let doses = || points.iter().map(|point| point.film.dose.mj_per_cm2());
    let critical = fit.critical_dose.at_zero.value.mj_per_cm2();
    // Curves begin at the critical dose, which may lie below all points.
    let range = doses().fold(critical, f64::min) / 1.1..doses().fold(0.0, f64::max) * 1.1;
    let step = |i: u32| range.start * (range.end / range.start).powf(f64::from(i) / 30.0);
    let steps: Vec<f64> = (0..=30).map(step).collect();
    let series: Vec<_> =
        fit.lights.iter().map(|&(lamp, _)| series(fit, lamp, points, &steps)).collect();
    let y = PlotAxis {
        label: "cure depth (µm)".to_owned(),
        range: 0.0..1.08 * highest(&series),
        logarithmic: false,
    };
    let x = PlotAxis { label: "dose (mJ/cm²)".to_owned(), range, logarithmic: true };
    Plot { title, x, y, series }
}

/// The films under a light, and their curve.
fn series(fit: &LampFit, lamp: Intensity, points: &[LampPoint], doses: &[f64]) -> Series {
    let depth = |mj: f64| fit.depth(lamp, Dose::from_mj_per_cm2(mj));
    let critical = fit.critical_dose_at(lamp).mj_per_cm2();
    let curve = doses.iter().filter(|mj| **mj > critical).map(|&mj| (mj, depth(mj).value.um()));
    let band = doses.iter().map(|&mj| {
        let depth = depth(mj);
        [mj, depth.low.um().max(0.0), depth.high.um().max(0.0)]
    });
    let of_lamp = points.iter().filter(|point| point.lamp == lamp);
    Series {
        name: format!("{lamp}: {}", in_legend("Dp", "µm", &fit.penetration_depth)),
        points: of_lamp.map(|p| (p.film.dose.mj_per_cm2(), p.film.depth.um())).collect(),
        curve: std::iter::once((critical, 0.0)).chain(curve).collect(),
        band: band.collect(),
    }
}
