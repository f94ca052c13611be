//! Plots what a plan of gray levels reaches.

use lamp_pipeline::heights::significant;
use lamp_planning::voxels::{DoseHistogram, GapAt, LayerOutcome, Outcome, VoxelCounts, VoxelTally};

use super::voxels_report::PlannedVoxels;
use lamp_plots::{Plot, PlotAxis, Series, curve, linear};

/// The plots of a plan, one below the other.
pub(super) fn plots_of(planned: &PlannedVoxels<'_>) -> Vec<Plot> {
    let outcome = planned.outcome;
    vec![by_layer(planned), by_dose(outcome), by_light(outcome), by_iteration(outcome)]
}

/// Counts below one are drawn here, for a logarithm has no zero.
const NONE: f64 = 0.7;

fn drawn(count: u64) -> f64 {
    (count as f64).max(NONE)
}

/// A plot of counts of voxels over a logarithmic axis.
fn counts_plot(title: String, x: PlotAxis, series: Vec<Series>) -> Plot {
    let most = series.iter().flat_map(|series| &series.curve).map(|at| at.1).fold(10.0, f64::max);
    Plot { title, x, y: logarithmic("voxels", NONE, most), series }
}

fn logarithmic(label: &str, least: f64, most: f64) -> PlotAxis {
    // Room for the legend.
    let range = least..least * (most / least).powf(1.5);
    PlotAxis { label: label.to_owned(), range, logarithmic: true }
}

/// Voxels that are cured wrongly, by layer.
fn by_layer(planned: &PlannedVoxels<'_>) -> Plot {
    let outcome = planned.outcome;
    let of = |name: &str, count: &dyn Fn(&LayerOutcome) -> u64| {
        let at = |layer: &LayerOutcome| (f64::from(layer.index), drawn(count(layer)));
        curve(name, outcome.layers.iter().map(at).collect())
    };
    let series = vec![
        of("overcured by white light", &|layer| layer.before.overcured),
        of("overcured as planned", &|layer| layer.after.overcured),
        of("undercured by white light", &|layer| layer.before.undercured),
        of("undercured as planned", &|layer| layer.after.undercured),
    ];
    let [first, last] = [outcome.layers.first(), outcome.layers.last()]
        .map(|layer| layer.map_or(0.0, |layer| f64::from(layer.index)));
    let title = format!(
        "Voxels cured wrongly: {}, {} s of exposures",
        planned.material,
        significant(outcome.exposure_ms / 1000.0)
    );
    // A single layer needs an axis of some length.
    counts_plot(title, linear("layer", first..last.max(first + 1.0)), series)
}

/// Voxels by dose, in steps.
fn by_dose(outcome: &Outcome) -> Plot {
    let of = |name: &str, counts: &[u64]| {
        let step = |(step, &count): (usize, &u64)| {
            let dose = |edge: usize| edge as f64 / DoseHistogram::PER_CRITICAL_DOSE as f64;
            [(dose(step), drawn(count)), (dose(step + 1), drawn(count))]
        };
        curve(name, counts.iter().enumerate().flat_map(step).collect())
    };
    let [before, after] = [&outcome.before.doses, &outcome.after.doses];
    let series = vec![
        of("wanted, white light", &before.wanted),
        of("wanted, as planned", &after.wanted),
        of("others, white light", &before.other),
        of("others, as planned", &after.other),
    ];
    let doses = DoseHistogram::STEPS as f64 / DoseHistogram::PER_CRITICAL_DOSE as f64;
    counts_plot("Voxels by dose".to_owned(), linear("dose (critical doses)", 0.0..doses), series)
}

/// Voxels that are cured wrongly at a little less and more light.
fn by_light(outcome: &Outcome) -> Plot {
    let of = |name: &str, tally: &VoxelTally, count: fn(VoxelCounts) -> u64| {
        let all = [(95.0, tally.dimmer), (100.0, tally.counts), (105.0, tally.brighter)];
        let points: Vec<_> = all.map(|(light, counts)| (light, drawn(count(counts)))).into();
        Series { points: points.clone(), ..curve(name, points) }
    };
    let (before, after) = (&outcome.before, &outcome.after);
    let series = vec![
        of("overcured by white light", before, |counts| counts.overcured),
        of("overcured as planned", after, |counts| counts.overcured),
        of("undercured by white light", before, |counts| counts.undercured),
        of("undercured as planned", after, |counts| counts.undercured),
    ];
    let x = linear("light (%)", 94.0..106.0);
    counts_plot("Voxels cured wrongly at less and more light".to_owned(), x, series)
}

/// How far from the best the search was.
fn by_iteration(outcome: &Outcome) -> Plot {
    // Below this no gap is of interest.
    let at = |at: &GapAt| (at.iteration as f64, (100.0 * at.gap).max(1e-4));
    let gaps: Vec<_> = outcome.search.iter().map(at).collect();
    let last = gaps.iter().map(|gap| gap.0).fold(1.0, f64::max);
    let most = gaps.iter().map(|gap| gap.1).fold(1.0, f64::max);
    let least = gaps.iter().map(|gap| gap.1).fold(0.1, f64::min);
    let name = format!("in all blocks; {:.3}% in the whole stack", 100.0 * outcome.gap());
    let series = vec![Series { points: gaps.clone(), ..curve(&name, gaps) }];
    let y = logarithmic("gap (% of the unplanned error)", least / 2.0, most);
    let x = linear("iterations", 0.0..1.02 * last);
    Plot { title: "Gap to the best plan".to_owned(), x, y, series }
}
