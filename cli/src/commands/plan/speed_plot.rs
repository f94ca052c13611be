//! Plots what a plan of times reaches.

use lamp_pipeline::heights::{significant, time_text};
use lamp_planning::speed::{DOSE_BINS, LIGHT_SHARES, Tally, Wrong};

use super::speed_report::{PlannedTimes, seconds};
use lamp_plots::{Plot, PlotAxis, Series, by_layer, curve, linear, stairs};

/// The plots of a plan, one below the other.
pub(super) fn plots_of(planned: &PlannedTimes<'_>) -> Vec<Plot> {
    vec![wrong(planned), times(planned), doses(planned), light(planned), search(planned)]
}

/// The layers' heights in millimeters, and a number for each.
fn over_z(planned: &PlannedTimes<'_>, number: impl Fn(usize) -> f64) -> Vec<(f64, f64)> {
    let layer = |(at, layer): (usize, &lamp_planning::speed::TimedLayer)| {
        [layer.z.mm(), layer.z.mm() + layer.thickness.mm()].map(|z| (z, number(at)))
    };
    planned.part.layers().iter().enumerate().rev().flat_map(layer).collect()
}

fn wrong(planned: &PlannedTimes<'_>) -> Plot {
    let of = |name: &str, tally: &Tally, count: fn(&Wrong) -> u64| {
        curve(name, over_z(planned, |at| count(&tally.layers[at]) as f64))
    };
    let (before, after) = (&planned.plan.before, &planned.plan.after);
    let series = vec![
        of("overcured at the best single time", before, |wrong| wrong.over),
        of("overcured as planned", after, |wrong| wrong.over),
        of("undercured at the best single time", before, |wrong| wrong.under),
        of("undercured as planned", after, |wrong| wrong.under),
    ];
    let title = format!(
        "Voxels cured wrongly: {}, {} of exposures",
        planned.material,
        time_text(planned.seconds())
    );
    by_layer(title, "voxels", series)
}

fn times(planned: &PlannedTimes<'_>) -> Plot {
    let plan = planned.plan;
    let single = seconds(plan.single);
    let series = vec![
        curve(&format!("{} s for all layers", significant(single)), over_z(planned, |_| single)),
        curve("as planned", over_z(planned, |at| seconds(plan.times[at]))),
    ];
    let all = || series.iter().flat_map(|series| &series.curve).map(|at| at.1);
    let (least, most) = (all().fold(f64::MAX, f64::min), all().fold(0.0, f64::max));
    let y = PlotAxis {
        label: "exposure (s)".to_owned(),
        // Room for the legend.
        range: least / 1.5..most * (most / least).powf(0.3) * 1.5,
        logarithmic: true,
    };
    Plot { y, ..by_layer("Time of each layer".to_owned(), "", series) }
}

fn doses(planned: &PlannedTimes<'_>) -> Plot {
    // A logarithm has no zero: counts of none are drawn just below one.
    const LEAST: f64 = 0.7;
    let of = |name: &str, tally: &Tally, other: usize| {
        let count = |bin: usize| (tally.doses[other][bin] as f64).max(LEAST);
        curve(name, stairs((0..DOSE_BINS).map(|bin| (bin as f64 / 10.0, count(bin))), 0.1))
    };
    let (before, after) = (&planned.plan.before, &planned.plan.after);
    let series = vec![
        of("wanted, best single time", before, 0),
        of("wanted, as planned", after, 0),
        of("others, best single time", before, 1),
        of("others, as planned", after, 1),
    ];
    let most = series.iter().flat_map(|series| &series.curve).map(|at| at.1).fold(10.0, f64::max);
    let y = PlotAxis {
        label: "voxels".to_owned(),
        range: LEAST..LEAST * (most / LEAST).powf(1.4),
        logarithmic: true,
    };
    let x =
        linear("dose (critical doses; the last step has all above)", 0.0..DOSE_BINS as f64 / 10.0);
    Plot { title: "Doses".to_owned(), x, y, series }
}

fn light(planned: &PlannedTimes<'_>) -> Plot {
    let of = |name: &str, tally: &Tally, count: fn(&Wrong) -> u64| {
        let shares = LIGHT_SHARES.iter().zip(&tally.at_light);
        let mut points: Vec<_> =
            shares.map(|(share, wrong)| (100.0 * share, count(wrong) as f64)).collect();
        // Full light comes first in the tally, and a curve goes from left to right.
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Series { points: points.clone(), ..curve(name, points) }
    };
    let (before, after) = (&planned.plan.before, &planned.plan.after);
    let series = vec![
        of("overcured at the best single time", before, |wrong| wrong.over),
        of("overcured as planned", after, |wrong| wrong.over),
        of("undercured at the best single time", before, |wrong| wrong.under),
        of("undercured as planned", after, |wrong| wrong.under),
    ];
    let title = "Voxels cured wrongly at less and more light".to_owned();
    Plot { x: linear("light (%)", 94.0..106.0), ..by_layer(title, "voxels", series) }
}

fn search(planned: &PlannedTimes<'_>) -> Plot {
    const LEAST: f64 = 1e-3;
    let plan = planned.plan;
    let of = |name: &str, error: fn(&lamp_planning::speed::SearchStage) -> f64| {
        let stage = |(number, stage): (usize, &_)| {
            // A part without errors must not divide by zero.
            ((number + 1) as f64, (100.0 * error(stage) / plan.single_error.max(1e-9)).max(LEAST))
        };
        let points: Vec<_> = plan.stages.iter().enumerate().map(stage).collect();
        Series { points: points.clone(), ..curve(name, points) }
    };
    let series = vec![
        of("the plan's error", |stage| stage.error),
        of("no plan has less", |stage| stage.bound),
        of("between them", |stage| stage.error - stage.bound),
    ];
    let y = PlotAxis {
        label: "% of the best single time's error".to_owned(),
        range: LEAST..1000.0,
        logarithmic: true,
    };
    let x = linear("stage of the search", 0.0..plan.stages.len() as f64 + 1.0);
    Plot { title: "Error and bound".to_owned(), x, y, series }
}
