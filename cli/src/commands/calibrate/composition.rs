//! `lamp calibrate composition`: fits how a resin follows one of its ingredients.

use clap::Args;
use lamp_grayscale::calibrate::{
    CsvTable, LawCurve, LawFit, LawLine, LawPoint, LawTable, fit_law, law_numbers, law_points,
};
use lamp_grayscale::material::{LawVariable, Material};
use lamp_grayscale::resin::{Dose, WidthSensitivity};
use lamp_stack::{Dpi, Length};

use super::CalibrationFiles;
use super::estimate_table::EstimateTable;
use crate::args::options::Common;
use crate::exit::Exit;
use lamp_plots::{Plot, PlotAxis, Series, highest};

/// Fit how cure depth and cure width follow the UV absorber or the photoinitiator
///
/// The CSV file has a header with the columns uv_absorber_g_per_100g or photoinitiator_g_per_100g
/// (grams for each 100 g of monomer), dose_mj_per_cm2 (or exposure_ms, with --intensity) and, for
/// films, depth_um; for squares of one size, feature_px (or feature_um) and cured_um (or width_um).
/// Each row is a film or a square. One ingredient changes from row to row, in three amounts or more.
/// lamp material make then makes a material of an amount between.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp calibrate composition absorber.csv
  lamp calibrate composition absorber.csv --material mine.toml -o mine.toml --plot absorber.svg")]
pub(super) struct CompositionArgs {
    #[command(flatten)]
    files: CalibrationFiles,

    /// Resolution of feature_px, in dots per inch
    #[arg(long, default_value = "1500")]
    dpi: Dpi,
}

pub(super) fn run(args: &CompositionArgs, common: &Common) -> Result<(), Exit> {
    args.files.check()?;
    let (base, table) = (args.files.base()?, args.files.table()?);
    fit(&args.files, base, &table, args.dpi, "composition", common)
}

/// Fits the law over an ingredient, or over the `lamp`, and writes it.
pub(super) fn fit(
    files: &CalibrationFiles,
    base: Option<Material>,
    table: &CsvTable,
    dpi: Dpi,
    model: &'static str,
    common: &Common,
) -> Result<(), Exit> {
    let at_place = |error: Exit| error.at(files.place());
    let light = files.light(base.as_ref())?;
    let read = law_points(table, light, dpi, model == "lamp");
    let (table, measured) = read.map_err(|error| at_place(error.into()))?;
    let over = table.over;
    let films = (!table.films.is_empty()).then(|| fit_law::<Length>(over, &table.films));
    let films = films.transpose().map_err(|error| at_place(error.into()))?;
    let squares = !table.squares.is_empty();
    let squares = squares.then(|| fit_law::<WidthSensitivity>(over, &table.squares)).transpose();
    let squares = squares.map_err(|error| at_place(error.into()))?;
    let mut fitted = EstimateTable::new(files.place(), model, &measured, "uncured or washed away");
    films.iter().for_each(|fit| write_lines(&mut fitted, "", "depths", fit));
    squares.iter().for_each(|fit| write_lines(&mut fitted, "^w", "widths", fit));
    write_values(&mut fitted, &table, films.as_ref(), squares.as_ref());
    let source = files.source(measured.points.len());
    let law = law_numbers(&table, films.as_ref(), squares.as_ref(), &source);
    let law = law.map_err(|error| at_place(error.into()))?;
    let add = |material: &mut Material| {
        material.laws.retain(|other| other.over != over);
        material.laws.push(law);
    };
    let name = files.source_name();
    let of_films = films
        .as_ref()
        .map(|fit| plot(format!("Cure depth: {name}"), "cure depth (µm)", fit, &table.films));
    let of_squares = squares
        .as_ref()
        .map(|fit| plot(format!("Cure width: {name}"), "cure width (µm)", fit, &table.squares));
    let plots: Vec<_> = of_films.into_iter().chain(of_squares).collect();
    files.finish(base, add, &plots, &fitted, common)
}

/// Writes the straight lines of `1/D` and `E_c`.
fn write_lines<D: LawCurve>(table: &mut EstimateTable, of: &str, what: &str, fit: &LawFit<D>) {
    let symbol = symbol(fit.over);
    // 002 eq. 59: a critical dose is straight over the inverse of a photoinitiator.
    let of_dose = match fit.over {
        LawVariable::Photoinitiator => "1/c",
        LawVariable::UvAbsorber | LawVariable::Lamp => symbol,
    };
    table.line(&format!("\n{what} over {} ({})", fit.over, fit.over.unit()), &[]);
    table.heads();
    for (name, unit, line) in [
        (format!("1/Dp{of}({symbol})"), D::INVERSE, fit.inverse_line()),
        (format!("Ec{of}({of_dose})"), "mJ/cm2", fit.critical_dose_line()),
    ] {
        let LawLine { at_zero, rise } = line;
        table.numbers(&format!("{name} at zero"), unit, at_zero);
        table.numbers(&format!("{name} rise"), unit, rise);
    }
    table.share(&format!("R^2 of {what}"), fit.r2);
}

/// Writes what the law gives at each measured value.
fn write_values(
    table: &mut EstimateTable,
    of: &LawTable,
    films: Option<&LawFit<Length>>,
    squares: Option<&LawFit<WidthSensitivity>>,
) {
    let counts = |values: Option<&Vec<(f64, usize)>>| values.cloned().unwrap_or_default();
    let mut values = counts(films.map(|fit| &fit.values));
    for (at, points) in counts(squares.map(|fit| &fit.values)) {
        match values.iter_mut().find(|value| value.0 == at) {
            Some(value) => value.1 += points,
            None => values.push((at, points)),
        }
    }
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let column = match of.over {
        LawVariable::UvAbsorber => "uv_absorber_g_per_100g",
        LawVariable::Photoinitiator => "photoinitiator_g_per_100g",
        LawVariable::Lamp => "lamp_mw_per_cm2",
    };
    for (at, points) in values {
        table.group(column, at, points, None);
        table.line(&format!("\n{} {at}: {points} points", symbol(of.over)), &[]);
        table.heads();
        if let Some(fit) = films {
            table.estimate_of_group("Ec", "", &fit.critical_dose(at));
            table.estimate_of_group("Dp", "", &fit.sensitivity(at));
        }
        if let Some(fit) = squares {
            table.estimate_of_group("Ec^w", "", &fit.critical_dose(at));
            table.estimate_of_group("Dp^w", "", &fit.sensitivity(at));
        }
        if let Some((films, squares)) = films.zip(squares) {
            table.estimate_of_group("Bd", "", &films.broadening_depth(squares, at));
        }
    }
}

/// The letter of a quantity, as in 002.
fn symbol(over: LawVariable) -> &'static str {
    match over {
        LawVariable::UvAbsorber | LawVariable::Photoinitiator => "c",
        LawVariable::Lamp => "I",
    }
}

/// Points over the dose and the curve of each value (002 figures 80, 84).
fn plot<D: LawCurve>(title: String, y: &str, fit: &LawFit<D>, points: &[LawPoint]) -> Plot {
    let most = points.iter().map(|point| point.dose.mj_per_cm2()).fold(0.0, f64::max) * 1.05;
    let series = fit.values.iter().map(|&(at, _)| {
        let of_value = points.iter().filter(|point| point.at == at);
        let critical = fit.critical_dose(at).value.mj_per_cm2();
        let step = |i: u32| critical + (most - critical) * f64::from(i) / 60.0;
        let steps = (0..=60).map(step).filter(|&dose| dose >= critical);
        let measure = |dose| (dose, fit.measure(at, Dose::from_mj_per_cm2(dose)));
        let curve = steps.map(measure);
        Series {
            name: format!("{} {at} {}", fit.over, fit.over.unit()),
            points: of_value.map(|p| (p.dose.mj_per_cm2(), p.measured.um())).collect(),
            curve: curve.clone().map(|(dose, at)| (dose, at.value.um())).collect(),
            band: curve
                .map(|(dose, at)| [dose, at.low.um().max(0.0), at.high.um().max(0.0)])
                .collect(),
        }
    });
    let series: Vec<_> = series.collect();
    let axis = |label: &str, range| PlotAxis { label: label.to_owned(), range, logarithmic: false };
    let lowest = points.iter().map(|point| point.measured.um()).fold(0.0, f64::min);
    let y = axis(y, 1.08 * lowest..1.08 * highest(&series));
    let x = axis("dose (mJ/cm²)", 0.0..most);
    Plot { title, x, y, series }
}
