//! `lamp calibrate depth`: fits cure models to measured depths.

use clap::Args;
use lamp_grayscale::calibrate::{
    CurveFit, DepthModel, DepthPoint, Estimate, GrayFit, LevelFit, LineEstimate, TwoDepthFit,
    depth_points, fit_curve, fit_gray, fit_two_depth,
};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::{CureModel, Dose, GrayCurve, GrayLevel, Quantity, StraightLine};
use lamp_stack::Length;

use super::CalibrationFiles;
use super::estimate_table::{EstimateTable, in_legend, short};
use crate::args::options::{Common, one_of_described};
use crate::exit::Exit;
use crate::terminal::progress::Progress;
use lamp_plots::{Plot, PlotAxis, Series, highest};

/// Fit a working curve to measured cure depths
///
/// The CSV file has a header with the columns dose_mj_per_cm2 (or exposure_ms, with --intensity)
/// and depth_um. The gray model also needs gray (0 black to 1 white). Doses are for full white.
/// Rows with a depth of 0 or less are uncured and left out.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp calibrate depth depths.csv
  lamp calibrate depth times.csv --intensity 1.6W/cm2 -o mine.toml --plot depths.svg
  lamp calibrate depth depths.csv --model two-depth --material mine.toml -o mine.toml")]
pub(super) struct DepthArgs {
    #[command(flatten)]
    files: CalibrationFiles,

    /// Model to fit [default: gray if the file has that column, else jacobs]
    #[arg(long, value_parser = one_of_described::<DepthModel>(&[
        "The working curve Dp ln(E / Ec)",
        "Separate penetration depths for liquid and solid",
        "A working curve whose Ec and Dp are linear in the gray level",
    ]))]
    model: Option<DepthModel>,
}

enum DepthFit {
    Jacobs(CurveFit),
    TwoDepth(TwoDepthFit),
    Gray(GrayFit),
}

pub(super) fn run(args: &DepthArgs, common: &Common) -> Result<(), Exit> {
    let files = &args.files;
    files.check()?;
    let base = files.base()?;
    let table = files.table()?;
    let at_place = |error: Exit| error.at(files.place());
    let measured = depth_points(&table, files.light(base.as_ref())?);
    let measured = measured.map_err(|error| at_place(error.into()))?;
    let has_gray = table.columns().iter().any(|column| column == "gray");
    let model = args.model.unwrap_or(if has_gray { DepthModel::Gray } else { DepthModel::Jacobs });
    let points = &measured.points[..];
    // The other models take every dose for one of full white.
    if model != DepthModel::Gray && points.iter().any(|point| point.gray != GrayLevel::WHITE) {
        return Err(at_place(Exit::usage("some rows are gray: fit them with --model gray")));
    }
    let fit = match model {
        DepthModel::Jacobs => fit_curve(points).map(DepthFit::Jacobs),
        DepthModel::TwoDepth => fit_two_depth(points).map(DepthFit::TwoDepth),
        DepthModel::Gray => fit_gray(points).map(DepthFit::Gray),
    };
    let fit = fit.map_err(|error| at_place(error.into()))?;
    say_what_was_changed(&fit, &Progress::new("calibrate", common, true));
    let mut fitted = EstimateTable::new(files.place(), model.name(), &measured, "uncured");
    fit.write(&mut fitted);
    let title = format!("Cure depth: {}", files.source_name());
    let source = files.source(points.len());
    let plot = plot(title, &fit, points);
    files.finish(base, |material| fit.add_to(material, &source), &[plot], &fitted, common)
}

/// Reports parameters that differ from what was measured.
fn say_what_was_changed(fit: &DepthFit, progress: &Progress) {
    match fit {
        DepthFit::Jacobs(_) => {}
        DepthFit::TwoDepth(fit) if fit.straight => progress.say(&format!(
            "the points lie on a straight line: the solid is practically clear, and its \
             penetration depth is taken as {} um, 10000 times the deepest point",
            short(fit.solid_depth.value.um())
        )),
        DepthFit::TwoDepth(_) => {}
        DepthFit::Gray(fit) => {
            levelled(&fit.critical_dose, "the critical dose", "mJ/cm2", progress);
            levelled(&fit.penetration_depth, "the penetration depth", "um", progress);
        }
    }
}

pub(super) fn levelled<T: Quantity>(
    line: &LineEstimate<T>,
    what: &str,
    unit: &str,
    progress: &Progress,
) {
    let Some(rise) = line.levelled else { return };
    let [fall, high, level] =
        [-rise.number(), line.rise.high.number(), line.at_zero.value.number()].map(short);
    progress.say(&format!(
        "{what} falls by {fall} {unit} towards more light, perhaps by chance (it might as well \
         rise by {high}): the model takes no falling line, so the line is kept level at {level} \
         {unit}"
    ));
}

impl DepthFit {
    fn write(&self, table: &mut EstimateTable) {
        match self {
            Self::Jacobs(fit) => {
                table.r2("R^2", fit.r2);
                table.heads();
                table.estimate("Ec", &fit.critical_dose);
                table.estimate("Dp", &fit.penetration_depth);
            }
            Self::TwoDepth(fit) => {
                table.r2("R^2", fit.r2);
                table.heads();
                table.estimate("Ec", &fit.critical_dose);
                table.estimate("DpL", &fit.liquid_depth);
                table.estimate("DpS", &fit.solid_depth);
            }
            Self::Gray(fit) => {
                table.heads();
                fit.levels.iter().for_each(|level| write_level(table, level));
                write_line(table, "Ec(G)", &fit.critical_dose);
                write_line(table, "Dp(G)", &fit.penetration_depth);
                table.r2("R^2 of all", fit.r2);
            }
        }
    }

    fn add_to(&self, material: &mut Material, source: &str) {
        match self {
            Self::Jacobs(fit) => material.working_curve = Some(fit.numbers(source)),
            Self::TwoDepth(fit) => material.two_depth = Some(fit.numbers(source)),
            Self::Gray(fit) => material.gray = Some(fit.lines(source)),
        }
    }

    /// Returns the dose below which there is nothing to plot.
    fn least_dose(&self) -> f64 {
        let least = |ec: &Estimate<Dose>| {
            let [value, low] = [ec.value, ec.low].map(Dose::mj_per_cm2);
            // A lower end near zero would stretch the logarithmic axis over decades.
            low.max(value / 2.0)
        };
        match self {
            Self::Jacobs(fit) => least(&fit.critical_dose),
            Self::TwoDepth(fit) => least(&fit.critical_dose),
            Self::Gray(fit) => {
                // The lighter a level, the less white light it needs.
                let lightest = fit.levels.last().map_or(1.0, |level| level.gray.get());
                let [at_zero, rise] = [fit.critical_dose.at_zero, fit.critical_dose.rise];
                let rise = rise.value.mj_per_cm2();
                (at_zero.value.mj_per_cm2() / lightest + rise) / 2.0
            }
        }
    }
}

/// Writes the estimates from a level's own points.
fn write_level(table: &mut EstimateTable, level: &LevelFit) {
    let (gray, points) = (level.gray.get(), level.points);
    table.group("gray", gray, points, level.curve.as_ref().map(|curve| curve.r2));
    let points = if points == 1 { "1 point".to_owned() } else { format!("{points} points") };
    match &level.curve {
        Some(curve) => {
            let at = format!(" at {gray}");
            table.estimate_of_group("Ec", &at, &curve.critical_dose);
            table.estimate_of_group("Dp", &at, &curve.penetration_depth);
            table.line(&format!("R^2 at {gray}, {points}"), &[&short(curve.r2)]);
        }
        None => table.line(&format!("{gray}: {points}, no curve of its own"), &[]),
    }
}

pub(super) fn write_line<T: Quantity>(
    table: &mut EstimateTable,
    name: &str,
    line: &LineEstimate<T>,
) {
    table.estimate(&format!("{name} at zero"), &line.at_zero);
    table.estimate(&format!("{name} rise"), &line.rise);
}

fn plot(title: String, fit: &DepthFit, points: &[DepthPoint]) -> Plot {
    let most = points.iter().map(|point| point.dose.mj_per_cm2()).fold(0.0, f64::max);
    let least = points.iter().map(|point| point.dose.mj_per_cm2()).fold(fit.least_dose(), f64::min);
    // Room on both sides, so that no point lies on the frame.
    let range = least / 1.1..most * 1.1;
    // Even steps on the logarithmic axis.
    let step = |i| range.start * (range.end / range.start).powf(f64::from(i) / 30.0);
    let doses: Vec<_> = (0..=30).map(|i| Dose::from_mj_per_cm2(step(i))).collect();
    let series = match fit {
        DepthFit::Jacobs(fit) => {
            let dp = in_legend("Dp", "µm", &fit.penetration_depth);
            let name = format!("{dp}, {}", in_legend("Ec", "mJ/cm²", &fit.critical_dose));
            let begins = begins(&fit.critical_dose);
            let curve = |dose| fit.depth(dose).value;
            vec![series(name, points, &doses, begins, curve, |dose| fit.depth(dose))]
        }
        DepthFit::TwoDepth(fit) => {
            let liquid = in_legend("DpL", "µm", &fit.liquid_depth);
            let solid = in_legend("DpS", "µm", &fit.solid_depth);
            let ec = in_legend("Ec", "mJ/cm²", &fit.critical_dose);
            let name = format!("{liquid}, {solid}, {ec}");
            let begins = begins(&fit.critical_dose);
            let curve = |dose| fit.depth(dose).value;
            vec![series(name, points, &doses, begins, curve, |dose| fit.depth(dose))]
        }
        DepthFit::Gray(fit) => of_levels(fit, points, &doses),
    };
    let x = PlotAxis { label: "dose of full white (mJ/cm²)".to_owned(), range, logarithmic: true };
    let depths = 0.0..1.08 * highest(&series);
    let y = PlotAxis { label: "cure depth (µm)".to_owned(), range: depths, logarithmic: false };
    Plot { title, x, y, series }
}

/// The curves of the gray model.
fn of_levels(fit: &GrayFit, points: &[DepthPoint], doses: &[Dose]) -> Vec<Series> {
    let (ec, dp) = (&fit.critical_dose, &fit.penetration_depth);
    let model = GrayCurve::new(
        StraightLine { at_zero: ec.at_zero.value, rise: ec.rise.value },
        StraightLine { at_zero: dp.at_zero.value, rise: dp.rise.value },
    )
    .expect("lines that fall are levelled, and begin above zero");
    let level = |level: &LevelFit| {
        let gray = level.gray;
        let of_level: Vec<_> = points.iter().filter(|p| p.gray == gray).copied().collect();
        let curve = |dose| model.gray_depth(gray, dose);
        let band = |dose| fit.depth(gray, dose);
        let name = format!("gray {}", gray.get());
        let critical = model.at(gray).critical_dose().mj_per_cm2() / gray.get();
        // The band ends where its upper end does.
        let cures = |dose: &&Dose| fit.depth(gray, **dose).high.um() > 0.0;
        let begins =
            [critical, doses.iter().find(cures).map_or(critical, |dose| dose.mj_per_cm2())];
        series(name, &of_level, doses, begins, curve, band)
    };
    fit.levels.iter().map(level).collect()
}

/// The doses at which the curve and its band begin.
fn begins(critical: &Estimate<Dose>) -> [f64; 2] {
    [critical.value, critical.low].map(Dose::mj_per_cm2)
}

/// Points with their curve, drawn where it is above zero.
fn series(
    name: String,
    points: &[DepthPoint],
    doses: &[Dose],
    begins: [f64; 2],
    curve: impl Fn(Dose) -> Length,
    band: impl Fn(Dose) -> Estimate<Length>,
) -> Series {
    let [curve_begins, band_begins] = begins;
    let least = doses[0].mj_per_cm2();
    let above = |begins: f64| doses.iter().copied().filter(move |dose| dose.mj_per_cm2() > begins);
    let curve = above(curve_begins).map(|dose| (dose.mj_per_cm2(), curve(dose).um()));
    let band = above(band_begins).map(|dose| {
        let Estimate { low, high, .. } = band(dose);
        [dose.mj_per_cm2(), low.um().max(0.0), high.um().max(0.0)]
    });
    let band_start = (band_begins > least).then_some([band_begins, 0.0, 0.0]);
    Series {
        name,
        points: points.iter().map(|p| (p.dose.mj_per_cm2(), p.depth.um())).collect(),
        // At the critical dose the depth is zero: there the curve begins.
        curve: std::iter::once((curve_begins, 0.0)).chain(curve).collect(),
        band: band_start.into_iter().chain(band).collect(),
    }
}
