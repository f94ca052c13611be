//! `lamp calibrate spread`: fits the spread and depth of light to profiles of squares.

use clap::Args;
use lamp_grayscale::calibrate::{ProfileFit, ProfilePoint, fit_profiles, profile_points};
use lamp_grayscale::material::Material;
use lamp_plots::{Plot, PlotAxis, Series};
use lamp_stack::Length;

use super::CalibrationFiles;
use super::estimate_table::{EstimateTable, in_legend};
use crate::args::options::Common;
use crate::exit::Exit;

/// Fit how light spreads and fades, and how gray levels pass it, to profiles of squares
///
/// Expose squares of several gray levels, and measure from the side where they end: their cured
/// edge, or in a picture of their light in the vat the edge of one brightness. The CSV file has a
/// header with the columns gray (0 black to 1 white), side_um (the square's side), x_um (the place,
/// from the square's middle) and depth_um (how deep the edge is there), and for cured squares
/// dose_mj_per_cm2 (or exposure_ms, with --intensity), the dose of white. The material gets spread
/// and gamma, and with doses the working curve. lamp target grays writes the squares.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp calibrate spread profiles.csv
  lamp calibrate spread profiles.csv --material mine.toml -o mine.toml --plot profiles.svg")]
pub(super) struct SpreadArgs {
    #[command(flatten)]
    files: CalibrationFiles,
}

pub(super) fn run(args: &SpreadArgs, common: &Common) -> Result<(), Exit> {
    let files = &args.files;
    files.check()?;
    let base = files.base()?;
    let table = files.table()?;
    let at_place = |error: Exit| error.at(files.place());
    let measured = profile_points(&table, files.light(base.as_ref())?);
    let measured = measured.map_err(|error| at_place(error.into()))?;
    let fit = fit_profiles(&measured.points).map_err(|error| at_place(error.into()))?;
    let mut fitted = EstimateTable::new(files.place(), "spread", &measured, "without depth");
    fitted.number("distance of points", "um", fit.misfit.um());
    fitted.heads();
    fitted.estimate("sigma", &fit.sigma);
    fitted.estimate("Dp", &fit.penetration_depth);
    if let Some(gamma) = fit.gamma {
        fitted.numbers("gamma", "1", gamma);
    }
    if let Some(critical) = &fit.critical_dose {
        fitted.estimate("Ec", critical);
    }
    let spread = in_legend("spread", "µm", &fit.sigma);
    let plot = plot(format!("{}: {spread}", files.source_name()), &fit, &measured.points);
    let source = files.source(fit.points);
    let set_spread = files.spread_setter(base.as_ref(), fit.spread(&source))?;
    let add = |material: &mut Material| {
        set_spread(material);
        if let Some(gamma) = fit.gamma_number(&source) {
            material.gamma = Some(gamma);
        }
        if let Some(curve) = fit.curve(&source) {
            material.working_curve = Some(curve);
        }
    };
    files.finish(base, add, &[plot], &fitted, common)
}

/// Profiles: how deep the edge is over the place in the square.
fn plot(title: String, fit: &ProfileFit, points: &[ProfilePoint]) -> Plot {
    let places = || points.iter().map(|point| point.place.um());
    let [least, most] = [places().fold(0.0, f64::min), places().fold(0.0, f64::max)];
    let room = 0.05 * (most - least).max(1.0);
    let range = least - room..most + room;
    let mut kinds: Vec<ProfilePoint> = Vec::new();
    let is_alike =
        |a: &ProfilePoint, b: &ProfilePoint| (a.gray, a.side, a.dose) == (b.gray, b.side, b.dose);
    for point in points {
        if !kinds.iter().any(|kind| is_alike(kind, point)) {
            kinds.push(*point);
        }
    }
    let series = kinds.iter().map(|kind| {
        let place = |step: i32| range.start + (range.end - range.start) * f64::from(step) / 200.0;
        let curve = (0..=200).filter_map(|step| {
            let depth = fit.depth(kind, Length::from_um(place(step)))?;
            Some((place(step), depth.um()))
        });
        let of_kind = points.iter().filter(|point| is_alike(kind, point));
        Series {
            name: format!("gray {}, side {}", kind.gray.get(), kind.side),
            points: of_kind.map(|point| (point.place.um(), point.depth.um())).collect(),
            curve: curve.collect(),
            band: Vec::new(),
        }
    });
    let series: Vec<Series> = series.collect();
    // Room for the legend above.
    let deepest = lamp_plots::highest(&series);
    let x = PlotAxis { label: "place in the square (µm)".to_owned(), range, logarithmic: false };
    let y =
        PlotAxis { label: "depth (µm)".to_owned(), range: 0.0..1.3 * deepest, logarithmic: false };
    Plot { title, x, y, series }
}
