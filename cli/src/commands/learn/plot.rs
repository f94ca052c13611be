//! Plots the errors and the times of a job's prints (004 figures 3.7 and 3.8).

use lamp_pipeline::glass::{GlassJob, GlassSettings};
use lamp_planning::learn::{
    AreaRow, Factor, GlassModel, GlassState, Job, JobPrint, LightState, PrintError,
    PrintMeasurements,
};
use lamp_planning::speed::TimedLayer;

use super::report::error_of;
use lamp_plots::{Plot, Series, by_layer, curve, linear};

/// The most prints that are drawn: the first, and the last.
const MOST: usize = 8;

/// The plots of a job, one below the other.
pub(super) fn plots_of(job: &Job) -> Vec<Plot> {
    // Later prints are compared with the first, so that is always drawn.
    let drawn: Vec<_> = job
        .prints
        .iter()
        .enumerate()
        .filter(|(number, _)| *number == 0 || number + MOST > job.prints.len())
        .collect();
    let mut plots = Vec::new();
    let errors: Vec<_> = job.prints.iter().map(error_of).collect();
    plots.extend(course(&errors));
    let states = job.prints.iter().map(|print| Some(print.state.as_ref()?.factors().to_vec()));
    plots.extend(state_plot(&LightState::NAMES, &states.collect::<Vec<_>>()));
    for (title, count) in AREAS {
        let areas = drawn.iter().filter_map(|&(n, print)| areas(job, n, print, count));
        let areas: Vec<_> = areas.collect();
        if !areas.is_empty() {
            plots.push(by_layer(title.to_owned(), "pixels", areas));
        }
    }
    let heights: Vec<_> = drawn.iter().filter_map(|&(n, print)| heights(n, print)).collect();
    if !heights.is_empty() {
        let title = "Measured heights minus the part's".to_owned();
        plots.push(by_layer(title, "error (µm)", heights));
    }
    let times = drawn.iter().map(|(number, print)| {
        let layers = job.part.layers().iter().zip(&print.times).rev();
        let ends = layers.flat_map(|(layer, time)| {
            [layer.z.mm(), layer.z.mm() + layer.thickness.mm()].map(|z| (z, *time))
        });
        curve(&format!("print {number}"), ends.collect())
    });
    plots.push(by_layer("Time of each layer".to_owned(), "exposure (s)", times.collect()));
    plots
}

/// The plots of a job of a plan on a glass, one below the other.
pub(super) fn plots_of_glass<S: GlassSettings>(job: &GlassJob<S>) -> Vec<Plot> {
    let prints = || job.prints.iter();
    let errors =
        prints().map(|print| print.measured.as_ref().map(|(measured, _)| measured.error()));
    let factors = |state: &GlassState| state.factors().map(|(_, factor)| factor).collect();
    let states: Vec<_> = prints().map(|print| print.state.as_ref().map(factors)).collect();
    let prior = job.model.prior();
    let names: Vec<_> = prior.factors().map(|(number, _)| number.name()).collect();
    let course = course(&errors.collect::<Vec<_>>());
    course.into_iter().chain(state_plot(&names, &states)).collect()
}

/// A count of a layer.
type Count = fn(&AreaRow) -> f64;

/// The counts of layers, each in a plot of its own.
const AREAS: [(&str, Count); 2] = [
    ("Pixels of the part that are not cured, by layer", |row| row.under),
    ("Pixels that are cured outside the part, by layer", |row| row.over),
];

/// The errors from print to print.
fn course(errors: &[Option<PrintError>]) -> Vec<Plot> {
    let of = |title: &str, label: &str, is_of: fn(PrintError) -> bool| {
        let points: Vec<_> = errors
            .iter()
            .enumerate()
            .filter_map(|(number, error)| Some((number, error.filter(|error| is_of(*error))?)))
            .map(|(number, error)| (number as f64, error.number()))
            .collect();
        // An axis needs a length, also where no print has an error.
        let most = points.iter().map(|point| point.1).fold(1e-9, f64::max);
        let series = vec![Series { points: points.clone(), ..curve("errors", points.clone()) }];
        let x = linear("print", -0.5..errors.len() as f64 - 0.5);
        let y = linear(label, 0.0..1.3 * most);
        (!points.is_empty()).then(|| Plot { title: title.to_owned(), x, y, series })
    };
    let is_of_areas = |error| matches!(error, PrintError::Pixels(_));
    let is_of_heights = |error| matches!(error, PrintError::Micrometers(_));
    let areas = of("Wrong pixels of each print", "pixels", is_of_areas);
    let heights = of("Errors of heights or places, root mean square", "error (µm)", is_of_heights);
    areas.into_iter().chain(heights).collect()
}

/// The states that prints were planned for, if prints had shown one.
fn state_plot(names: &[&str], of_prints: &[Option<Vec<Factor>>]) -> Option<Plot> {
    let states: Vec<(f64, &Vec<Factor>)> = of_prints
        .iter()
        .enumerate()
        .filter_map(|(number, factors)| Some((number as f64, factors.as_ref()?)))
        .collect();
    let of_number = |(at, name): (usize, &&str)| {
        let points: Vec<_> =
            states.iter().map(|(number, factors)| (*number, factors[at].value)).collect();
        let band = states.iter().map(|(number, factors)| {
            let [low, high] = factors[at].interval();
            [*number, low, high]
        });
        Series { points: points.clone(), band: band.collect(), ..curve(name, points) }
    };
    let series: Vec<_> = names.iter().enumerate().map(of_number).collect();
    let factors = || states.iter().flat_map(|(_, factors)| factors.iter());
    let ends = || factors().map(|factor| factor.interval());
    let low = ends().fold(1.0, |least: f64, ends| least.min(ends[0]));
    let high = ends().fold(1.0, |most: f64, ends| most.max(ends[1]));
    let title = "Light and resin that each print was planned for, with 95 % intervals".to_owned();
    let x = linear("print", -0.5..of_prints.len() as f64 - 0.5);
    let y = linear("times the material's", 0.9 * low..1.1 * high);
    (!states.is_empty()).then_some(Plot { title, x, y, series })
}

/// The table of a print, which may have sizes of places as well.
fn table_of(print: &JobPrint) -> Option<&PrintMeasurements> {
    match &print.measured.as_ref()?.0 {
        PrintMeasurements::Places { table, .. } => table.as_deref(),
        measured => Some(measured),
    }
}

fn areas(job: &Job, number: usize, print: &JobPrint, count: Count) -> Option<Series> {
    let PrintMeasurements::Areas(rows) = table_of(print)? else { return None };
    let layers = job.part.layers().iter().rev();
    let place = |layer: &TimedLayer| {
        let row = rows.iter().find(|row| row.layer == layer.index)?;
        Some((layer.z.mm(), count(row)))
    };
    Some(curve(&format!("print {number}"), layers.filter_map(place).collect()))
}

fn heights(number: usize, print: &JobPrint) -> Option<Series> {
    let PrintMeasurements::Heights(rows) = table_of(print)? else { return None };
    let mut points: Vec<_> =
        rows.iter().map(|row| (row.z_mm, 1000.0 * (row.measured_mm - row.z_mm))).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    Some(Series { points, ..curve(&format!("print {number}"), Vec::new()) })
}
