//! `lamp calibrate kinetics`: fits the rates of a reaction to heights of films and lines.

use std::path::PathBuf;

use clap::Args;
use lamp_grayscale::material::Material;
use lamp_pipeline::documents::document;
use lamp_pipeline::glass::kinetic_setting;
use lamp_planning::ecpl::{
    CuredStrip, FittedRate, KineticFit, KineticPoint, KineticRate, KineticSize, fit_kinetics,
    kinetic_points,
};
use lamp_planning::projector::Projector;
use lamp_plots::{Plot, Series, highest, linear};
use lamp_stack::format_significant;

use super::CalibrationFiles;
use super::estimate_table::EstimateTable;
use crate::args::options::{Common, one_of_described};
use crate::exit::Exit;

/// Fit the rates of a reaction that oxygen inhibits to heights of films and lines
///
/// Expose films and lines of mirrors through the glass of a chamber for several times, and measure
/// the cured parts. The CSV file has a header with the columns exposure_ms, line_px (the mirrors
/// across the line; empty for a film under a wide field), height_um with x_um (the place, from the
/// middle of the line), width_um (on the glass), and light_mw_per_cm2 where light differs from the
/// projector's. Rates that the points do not show keep the material's values, and are named. lamp
/// target lines writes the lines.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp calibrate kinetics films.csv --material tmpta --projector jariwala
  lamp calibrate kinetics lines.csv --material tmpta --projector mine.toml --rates oxygen,propagation \\
      -o mine-resin.toml --plot lines.svg")]
pub(super) struct KineticsArgs {
    #[command(flatten)]
    files: CalibrationFiles,

    /// Projector: a built-in projector's name (see lamp projector list) or a file. It must state
    /// the chamber's height, and spread light as a Gaussian
    #[arg(long, value_name = "PROJECTOR")]
    projector: PathBuf,

    /// Rates to fit; the others stay the material's
    #[arg(long, value_name = "RATE,...", value_delimiter = ',')]
    #[arg(default_value = "propagation,oxygen")]
    #[arg(value_parser = one_of_described::<KineticRate>(&[
        "How fast radicals take up double bonds, over the critical conversion",
        "How fast radicals end each other",
        "How fast oxygen ends radicals",
        "How fast oxygen spreads",
        "Oxygen before exposure",
        "How much light the initiator absorbs",
    ]))]
    rates: Vec<KineticRate>,
}

pub(super) fn run(args: &KineticsArgs, common: &Common) -> Result<(), Exit> {
    let files = &args.files;
    files.check()?;
    let wrong = |text: String| Err(Exit::usage(text));
    if let Some(twice) =
        (1..args.rates.len()).find(|&at| args.rates[..at].contains(&args.rates[at]))
    {
        return wrong(format!("--rates: {} is given twice", args.rates[twice]));
    }
    let Some(base) = files.base()? else {
        return wrong("rates are fitted from a resin's: name it with --material".to_owned());
    };
    let projector: Projector = document(&args.projector)?;
    let mut setting = kinetic_setting(&projector, &base)?;
    if let Some(light) = files.intensity {
        setting.light = light;
    }
    let table = files.table()?;
    let at_place = |error: anyhow::Error| Exit::Failed(error).at(files.place());
    let measured = kinetic_points(&table, &setting).map_err(|error| at_place(error.into()))?;
    let source = files.source(measured.points.len());
    let fit = fit_kinetics(&setting, &measured.points, &args.rates, &source)
        .map_err(|error| at_place(error.into()))?;
    let mut fitted = EstimateTable::new(files.place(), "kinetics", &measured, "uncured");
    fitted.widen(36);
    fitted.number("distance of points", "um", fit.misfit.um());
    fitted.heads();
    for FittedRate { rate, unit, number } in &fit.rates {
        fitted.numbers(&rate.to_string(), unit, *number);
    }
    if !fit.kept.is_empty() {
        fitted.line("not shown by the points, and kept:", &[]);
        for (rate, value, unit) in &fit.kept {
            fitted.number(&rate.to_string(), unit, *value);
        }
    }
    let plots = plots(&files.source_name(), &fit, &measured.points);
    let rates = base.kinetics.as_ref().map(|numbers| fit.numbers(numbers));
    let add = |material: &mut Material| material.kinetics = rates;
    files.finish(Some(base), add, &plots, &fitted, common)
}

/// Films over their times, and sections of lines.
fn plots(name: &str, fit: &KineticFit, points: &[KineticPoint]) -> Vec<Plot> {
    let series = |of: &CuredStrip| {
        let is_of =
            |it: &&KineticPoint| (it.pixels, it.light, it.time) == (of.pixels, of.light, of.time);
        let place = |point: &KineticPoint| match point.size {
            KineticSize::Height { height, place } => (place.um(), height.um()),
            KineticSize::Width(width) => (width.um() / 2.0, 0.0),
        };
        let section = of.profile.heights_um.iter().zip(0..);
        let section = section.map(|(&height, x)| (of.profile.cells.middle_um(x), height));
        let mut curve: Vec<_> = section.take_while(|(_, height)| *height > 0.0).collect();
        curve.push((of.profile.base_um, 0.0));
        Series {
            name: format!("{} mirrors, {}, {}", of.pixels.unwrap_or(0), of.light, of.time),
            points: points.iter().filter(is_of).map(place).collect(),
            curve,
            band: Vec::new(),
        }
    };
    let lines: Vec<_> = fit.cured.iter().filter(|it| it.pixels.is_some()).map(series).collect();
    let mut films: Vec<Series> = Vec::new();
    for CuredStrip { pixels, light, time, profile } in &fit.cured {
        if pixels.is_some() {
            continue;
        }
        let name = format!("film, {light}");
        let seconds = time.ms() / 1000.0;
        let of_film =
            points.iter().filter(|it| (it.pixels, it.light, it.time) == (None, *light, *time));
        let heights = of_film.filter_map(|point| match point.size {
            KineticSize::Height { height, .. } => Some((seconds, height.um())),
            KineticSize::Width(_) => None,
        });
        if films.last().is_none_or(|film| film.name != name) {
            films.push(Series { name, points: Vec::new(), curve: Vec::new(), band: Vec::new() });
        }
        if let Some(film) = films.last_mut() {
            film.points.extend(heights);
            film.curve.push((seconds, profile.sag_um()));
        }
    }
    let misfit = format_significant(fit.misfit.um(), 3);
    let plot = |x, series: Vec<Series>| {
        let farthest = series.iter().flat_map(|it| it.points.iter().chain(&it.curve));
        let farthest = 1.05 * farthest.map(|point| point.0).fold(0.0, f64::max);
        // Room for the legend above.
        let y = linear("height (µm)", 0.0..1.3 * highest(&series));
        Plot { title: format!("{name}: {misfit} µm off"), x: linear(x, 0.0..farthest), y, series }
    };
    [("exposure (s)", films), ("place from the middle (µm)", lines)]
        .into_iter()
        .filter(|(_, series)| !series.is_empty())
        .map(|(x, series)| plot(x, series))
        .collect()
}
