//! `lamp calibrate scan`: fits the spread of light to lines along and across the scan.

use clap::Args;
use lamp_grayscale::calibrate::{
    LineKind, LinePoint, ScanDirection, ScanFit, fit_scan, line_points,
};
use lamp_stack::{Dpi, Length};

use super::CalibrationFiles;
use super::estimate_table::{EstimateTable, in_legend};
use crate::args::options::Common;
use crate::exit::Exit;
use lamp_plots::{Plot, PlotAxis, Series};

/// Fit how light spreads along and across the scan to measured lines and gaps
///
/// The CSV file has a header with the columns direction (across: measured across the scan, along x;
/// or along), kind (line: white; or gap: black in white), feature_px (the width in the image; or
/// feature_um), dose_mj_per_cm2 (or exposure_ms, with --intensity) and cured_um (the width after
/// curing). Lines that did not cure and gaps that closed have a width of 0 and are left out. lamp
/// target scan writes a file to fill in.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp calibrate scan lines.csv
  lamp calibrate scan lines.csv --material mine.toml -o mine.toml --plot lines.svg")]
pub(super) struct ScanArgs {
    #[command(flatten)]
    files: CalibrationFiles,

    /// Resolution of feature_px, in dots per inch
    #[arg(long, default_value = "1500")]
    dpi: Dpi,
}

pub(super) fn run(args: &ScanArgs, common: &Common) -> Result<(), Exit> {
    let files = &args.files;
    files.check()?;
    let base = files.base()?;
    let table = files.table()?;
    let at_place = |error: Exit| error.at(files.place());
    let measured = line_points(&table, files.light(base.as_ref())?, args.dpi);
    let measured = measured.map_err(|error| at_place(error.into()))?;
    let fit = fit_scan(&measured.points).map_err(|error| at_place(error.into()))?;
    let mut fitted = EstimateTable::new(files.place(), "scan", &measured, "gone");
    fitted.r2("R^2", fit.r2);
    fitted.heads();
    fitted.estimate("sigma across", &fit.across);
    fitted.estimate("sigma along", &fit.along);
    fitted.estimate("Ec of lines", &fit.critical_dose);
    let plot = plot(format!("Lines: {}", files.source_name()), &fit, &measured.points);
    let spread = fit.numbers(&files.source(fit.points));
    let set_spread = files.spread_setter(base.as_ref(), spread)?;
    files.finish(base, set_spread, &[plot], &fitted, common)
}

/// Growth of lines and gaps over their width.
fn plot(title: String, fit: &ScanFit, points: &[LinePoint]) -> Plot {
    let drawn = || points.iter().map(|line| line.drawn.um());
    let range = drawn().fold(f64::INFINITY, f64::min) / 1.1..drawn().fold(0.0, f64::max) * 1.1;
    let mut all: Vec<Series> = Vec::new();
    let mut doses: Vec<_> = points.iter().map(|line| line.dose).collect();
    doses.sort_by(|a, b| a.mj_per_cm2().total_cmp(&b.mj_per_cm2()));
    doses.dedup();
    for direction in ScanDirection::ALL {
        for kind in LineKind::ALL {
            for dose in &doses {
                let of_series = |line: &&LinePoint| {
                    line.direction == direction && line.kind == kind && line.dose == *dose
                };
                let lines: Vec<_> = points.iter().filter(of_series).copied().collect();
                if let Some(first) = lines.first() {
                    all.push(series(fit, first, &lines, &range));
                }
            }
        }
    }
    let growths = all.iter().flat_map(|of| of.points.iter().chain(&of.curve)).map(|point| point.1);
    let (low, high) = growths.fold((0.0_f64, 0.0_f64), |(low, high), y| (low.min(y), high.max(y)));
    // Room for both, so that no point lies on the frame.
    let room = 0.08 * (high - low).max(1.0);
    let x = PlotAxis { label: "width in the image (µm)".to_owned(), range, logarithmic: true };
    let y = PlotAxis {
        label: "width after curing, less the image's (µm)".to_owned(),
        range: low - room..high + room,
        logarithmic: false,
    };
    Plot { title, x, y, series: all }
}

/// Lines of one direction, kind and dose.
fn series(
    fit: &ScanFit,
    first: &LinePoint,
    lines: &[LinePoint],
    range: &std::ops::Range<f64>,
) -> Series {
    let (direction, estimate) = match first.direction {
        ScanDirection::Across => ("across", &fit.across),
        ScanDirection::Along => ("along", &fit.along),
    };
    // Even steps on the logarithmic axis.
    let step = |i| range.start * (range.end / range.start).powf(f64::from(i) / 60.0);
    let curve = (0..=60).filter_map(|i| {
        let drawn = Length::from_um(step(i));
        let cured = fit.width(&LinePoint { drawn, ..*first }).um();
        (cured > 0.0).then(|| (drawn.um(), cured - drawn.um()))
    });
    let (kind, dose) = (first.kind, first.dose.mj_per_cm2());
    Series {
        name: format!(
            "{kind}s {direction}, {dose} mJ/cm²: {}",
            in_legend("spread", "µm", estimate)
        ),
        points: lines.iter().map(|it| (it.drawn.um(), it.cured.um() - it.drawn.um())).collect(),
        curve: curve.collect(),
        band: Vec::new(),
    }
}
