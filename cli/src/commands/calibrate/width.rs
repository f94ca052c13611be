//! `lamp calibrate width`: fits cure widths to measured squares.

use std::path::PathBuf;

use clap::Args;
use lamp_grayscale::calibrate::{
    Estimate, ManyLayersFit, ScanDirection, WidthFit, WidthPoint, fit_many_layers, fit_widths,
    width_points,
};
use lamp_grayscale::exposure::MeasuredDoses;
use lamp_grayscale::material::{GivenNumber, Material, MaterialError};
use lamp_grayscale::resin::{CureModel, Dose, broadening_depth, summed_doses};
use lamp_pipeline::documents::document;
use lamp_stack::{Dpi, Length, round_significant, to_nm};

use super::CalibrationFiles;
use super::estimate_table::{EstimateTable, in_legend, short};
use crate::args::options::{Common, parse_thickness};
use crate::exit::Exit;
use crate::terminal::progress::Progress;
use lamp_plots::{Plot, PlotAxis, Series, highest};

/// Fit the cure width of features of several sizes to measured squares
///
/// The CSV file has a header with the columns feature_px (the squares' side in the image; or
/// feature_um), dose_mj_per_cm2 (or exposure_ms, with --intensity), and cured_um (the side after
/// curing; or width_um, the distance of each edge outside its image). Include squares no larger
/// than their image: they show the dose at which squares start to grow. Leave out only squares that
/// were washed away, or enter 0 as their side. lamp target squares writes a file to fill in.
///
/// With a column direction (across or along the scan, the direction of the width), each direction has
/// widths of its own. With a column layers, squares of several layers show how much the doses of the
/// layers above count.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp calibrate width squares.csv --depth-material lamp-no-absorber
  lamp calibrate width squares.csv --material mine.toml -o mine.toml --plot widths.svg")]
pub(super) struct WidthArgs {
    #[command(flatten)]
    files: CalibrationFiles,

    /// Resolution of feature_px, in dots per inch
    #[arg(long, default_value = "1500")]
    dpi: Dpi,

    /// Compute the broadening depth from this material's cure depth [default: the cure depth of
    /// --material]
    #[arg(long, value_name = "MATERIAL")]
    depth_material: Option<PathBuf>,

    /// Thickness of the layers, if squares have several
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness)]
    thickness: Option<Length>,
}

pub(super) fn run(args: &WidthArgs, common: &Common) -> Result<(), Exit> {
    let files = &args.files;
    files.check()?;
    let base = files.base()?;
    let of_depths = args.depth_material.as_deref().map(document).transpose()?;
    // The squares may be of a resin whose depths were measured in another file.
    let of_depths = of_depths.as_ref().or(base.as_ref());
    let depths = match of_depths {
        Some(material) => cure_depths(material).map_err(anyhow::Error::new)?,
        None => None,
    };
    let doses = of_depths.map(MeasuredDoses::of_depths);
    let table = files.table()?;
    let at_place = |error: Exit| error.at(files.place());
    let measured = width_points(&table, files.light(base.as_ref())?, args.dpi);
    let measured = measured.map_err(|error| at_place(error.into()))?;
    let fits = fit_widths(&measured.points).map_err(|error| at_place(error.into()))?;
    let many = many_layers(args.thickness, of_depths, &measured.points);
    let many = many.map_err(at_place)?;
    let progress = Progress::new("calibrate", common, true);
    if depths.is_none() {
        progress.say(
            "there is no broadening depth, because no cure depth is known: name a material with \
             --depth-material",
        );
    }
    let mut fitted = EstimateTable::new(files.place(), "width", &measured, "washed away");
    for fit in &fits {
        write(&mut fitted, fit, args.dpi, depths.as_deref());
        // Broadening depths are cure depths at these doses.
        doses.iter().for_each(|doses| doses.see(fit.critical_dose.value));
    }
    if let Some(fit) = &many {
        fitted.line("", &[]);
        fitted.heads();
        fitted.numbers("share of doses above", "1", fit.share);
    }
    let doubt = doses.and_then(|doses| doses.doubt("broadening depths"));
    doubt.iter().for_each(|doubt| progress.say(doubt));
    let title = format!("Cure width: {}", files.source_name());
    let plot = plot(title, &fits, &measured.points, args.dpi);
    let add = |material: &mut Material| {
        for fit in &fits {
            add_to(material, fit, &files.source(fit.points));
        }
        if let Some(fit) = &many {
            let [value, low, high] = fit.share;
            material.many_layers = Some(GivenNumber {
                value: round_significant(value, 6),
                plus_minus: Some(round_significant((high - value).max(value - low), 3)),
                source: files.source(fit.points),
            });
        }
    };
    files.finish(base, add, &[plot], &fitted, common)
}

/// Fits how much the doses of the layers above count, if squares have several layers.
fn many_layers(
    thickness: Option<Length>,
    material: Option<&Material>,
    points: &[WidthPoint],
) -> Result<Option<ManyLayersFit>, Exit> {
    if points.iter().all(|point| point.layers == 1) {
        return Ok(None);
    }
    let depth = match material {
        Some(material) => material.white_depth().map_err(anyhow::Error::new)?,
        None => None,
    };
    let (Some(thickness), Some(depth)) = (thickness, depth) else {
        return Err(Exit::usage(
            "squares have several layers: give --thickness, and a material with a working curve as \
             --depth-material",
        ));
    };
    Ok(fit_many_layers(points, |layers| summed_doses(thickness, depth, Some(layers)))?)
}

/// How deep full white cures a material, where that is known.
fn cure_depths(material: &Material) -> Result<Option<Box<dyn CureModel>>, MaterialError> {
    if let Some(curve) = material.working_curve()? {
        return Ok(Some(Box::new(curve)));
    }
    if let Some(model) = material.two_depth()? {
        return Ok(Some(Box::new(model)));
    }
    Ok(material.gray_curve()?.map(|curve| Box::new(curve) as Box<dyn CureModel>))
}

fn write(table: &mut EstimateTable, fit: &WidthFit, dpi: Dpi, depths: Option<&dyn CureModel>) {
    let (size, below) = (size_name(fit, dpi), fit.below);
    let below = if below > 0 { format!(" ({below} up to Ec^w)") } else { String::new() };
    table.group("feature_um", to_nm(fit.feature_size.mm()) * 1000.0, fit.points, Some(fit.r2));
    table.direction_of_group(fit.direction.map(ScanDirection::name));
    table.line(&format!("\n{size}: {} points{below}", fit.points), &[]);
    table.heads();
    table.estimate_of_group("Ec^w", "", &fit.critical_dose);
    table.estimate_of_group("Dp^w", "", &fit.sensitivity);
    if let Some(depths) = depths {
        let critical = &fit.critical_dose;
        let of = |dose| broadening_depth(depths, dose);
        let (value, low, high) = (of(critical.value), of(critical.low), of(critical.high));
        table.estimate_of_group("Bd", "", &Estimate { value, low, high });
    }
    table.line("R^2", &[&short(fit.r2)]);
}

/// The squares' side in pixels and um.
fn size_name(fit: &WidthFit, dpi: Dpi) -> String {
    let two = |number: f64| (number * 100.0).round() / 100.0;
    let size = fit.feature_size;
    let direction = fit.direction.map(|direction| format!(", {direction} the scan"));
    let direction = direction.unwrap_or_default();
    format!("{} px ({} um){direction}", two(size.pixels(dpi)), two(size.um()))
}

/// Adds a size's numbers, and replaces the material's numbers of that size.
fn add_to(material: &mut Material, fit: &WidthFit, source: &str) {
    let um = fit.feature_size.um();
    // Widths of one direction replace widths of all directions, and the reverse.
    let other = |direction: Option<ScanDirection>| {
        direction.is_some() && fit.direction.is_some() && direction != fit.direction
    };
    // Sizes are given to the nanometer.
    material
        .cure_width
        .retain(|size| (size.feature_size.um() - um).abs() > 1e-3 || other(size.direction));
    material.cure_width.push(fit.numbers(source));
    material.cure_width.sort_by(|a, b| a.feature_size.um().total_cmp(&b.feature_size.um()));
}

fn plot(title: String, fits: &[WidthFit], points: &[WidthPoint], dpi: Dpi) -> Plot {
    let most = points.iter().map(|point| point.dose.mj_per_cm2()).fold(0.0, f64::max) * 1.05;
    let doses: Vec<_> =
        (0..=30).map(|i| Dose::from_mj_per_cm2(most * f64::from(i) / 30.0)).collect();
    let series: Vec<_> = fits.iter().map(|fit| series(fit, points, &doses, dpi)).collect();
    let axis = |label: &str, range| PlotAxis { label: label.to_owned(), range, logarithmic: false };
    // Squares smaller than their image are below zero.
    let lowest = points.iter().map(|point| point.width.um()).fold(0.0, f64::min);
    let y = axis("cure width (µm)", 1.08 * lowest..1.08 * highest(&series));
    let x = axis("dose (mJ/cm²)", 0.0..most);
    Plot { title, x, y, series }
}

fn series(fit: &WidthFit, points: &[WidthPoint], doses: &[Dose], dpi: Dpi) -> Series {
    let of_size = points.iter().filter(|point| {
        point.layers == 1
            && (point.feature_size, point.direction) == (fit.feature_size, fit.direction)
    });
    let start = fit.critical_dose.low.mj_per_cm2();
    let above = |from: f64| doses.iter().filter(move |dose| dose.mj_per_cm2() > from);
    let band = above(start).map(|&dose| {
        let width = fit.width(dose);
        [dose.mj_per_cm2(), width.low.um(), width.high.um()]
    });
    // A slope without an upper end has no band beyond the highest dose.
    let band = band.filter(|[_, _, high]| high.is_finite());
    let from = fit.critical_dose.value.mj_per_cm2();
    let curve = above(from).map(|&dose| (dose.mj_per_cm2(), fit.width(dose).value.um()));
    let name =
        format!("{}: {}", size_name(fit, dpi), in_legend("Ec", "mJ/cm²", &fit.critical_dose));
    Series {
        name: name.replace(" um", " µm"),
        points: of_size.map(|point| (point.dose.mj_per_cm2(), point.width.um())).collect(),
        curve: std::iter::once((from, 0.0)).chain(curve).collect(),
        band: std::iter::once([start, 0.0, 0.0]).chain(band).collect(),
    }
}
