//! The result of a plan of times, in lines and as JSON.

use std::path::Path;

use lamp_grayscale::resin::ExposureTime;
use lamp_pipeline::heights::{significant, time_text};
use lamp_planning::speed::{DOSE_BINS, SpeedPlan, Tally, TimedPart, Wrong, recorded_ms};
use serde::Serialize;

use super::voxels_report::DoseLine;
use crate::exit::Exit;
use crate::output::json_report::{JsonReport, schemas};

/// A plan, and what it is for.
pub(super) struct PlannedTimes<'a> {
    pub(super) material: &'a str,
    pub(super) part: &'a TimedPart,
    pub(super) plan: &'a SpeedPlan,
}

impl PlannedTimes<'_> {
    /// The seconds that all layers take.
    pub(super) fn seconds(&self) -> f64 {
        self.plan.times.iter().map(|time| time.ms() / 1000.0).sum()
    }

    /// The platform's speed in a layer, in micrometers a second.
    pub(super) fn speed(&self, layer: usize) -> f64 {
        1000.0 * self.part.layers()[layer].thickness.um() / self.plan.times[layer].ms()
    }
}

/// The lines that are printed.
pub(super) fn lines_of(planned: &PlannedTimes<'_>) -> Vec<String> {
    let plan = planned.plan;
    let counts = |wrong: Wrong| format!("{} overcured, {} undercured", wrong.over, wrong.under);
    let share = |tally: &Tally| 100.0 * tally.wrong().sum() as f64;
    let mut lines = vec![format!(
        "the best time for all layers, {} s: {}; as planned: {} ({:.1}% of it)",
        significant(plan.single.ms() / 1000.0),
        counts(plan.before.wrong()),
        counts(plan.after.wrong()),
        // Without a wrong voxel before, there is no share, and no division by zero.
        share(&plan.after) / plan.before.wrong().sum().max(1) as f64,
    )];
    let [_, less, more] = plan.after.at_light;
    lines.push(format!("at 5% less light: {}; at 5% more: {}", counts(less), counts(more)));
    let sample = match plan.sampled {
        1 => String::new(),
        some => format!(" (of one pixel in {some}, which the search sees)"),
    };
    lines.push(format!(
        "the best plan is at most {:.2}% of that time's error better{sample}; exposures take {}",
        100.0 * plan.gap(),
        time_text(planned.seconds())
    ));
    lines
}

/// Plan of exposure times, by `lamp plan speed --report`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct SpeedHead<'a> {
    /// Name of the material.
    material: &'a str,
    /// Share by which doses should be above or below the critical dose, by `--dose-margin`.
    margin: f64,
    /// Number of layers.
    layers: usize,
    /// Voxels of the part.
    wanted: u64,
    /// The best single time for all layers, in milliseconds.
    single_ms: f64,
    /// Voxels cured wrongly by the best single time.
    before: WrongTally,
    /// Voxels cured wrongly by the plan.
    after: WrongTally,
    /// Error of the best single time.
    single_error: f64,
    /// Error of the plan.
    error: Option<f64>,
    /// Lower bound on the error of any plan.
    bound: Option<f64>,
    /// Error of the plan less the bound, as a share of the best single time's error.
    gap: f64,
    /// The search, errors and bound use one pixel of this number.
    one_pixel_in: u32,
    /// Sum of the exposure times, in seconds.
    exposure_s: f64,
}

/// Numbers of voxels cured wrongly.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct WrongCounts {
    /// Voxels that are cured and not wanted.
    overcured: u64,
    /// Voxels that are wanted and not cured.
    undercured: u64,
}

/// Numbers of voxels cured wrongly, also by other light.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct WrongTally {
    #[serde(flatten)]
    counts: WrongCounts,
    /// The same with 5 % less light.
    at_less_light: WrongCounts,
    /// The same with 5 % more light.
    at_more_light: WrongCounts,
}

/// A layer.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct TimedLayer {
    /// Its index.
    layer: u32,
    /// Height of its bottom, in micrometers.
    z_um: f64,
    /// Its thickness, in micrometers.
    thickness_um: f64,
    /// Its exposure time, in milliseconds.
    exposure_ms: f64,
    /// Speed of the platform, in micrometers a second.
    speed_um_per_s: f64,
    /// Its voxels of the part.
    wanted: u64,
    /// Voxels cured wrongly by the best single time.
    before: WrongCounts,
    /// Voxels cured wrongly by the plan.
    after: WrongCounts,
}

/// A stage of the search.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct StageLine {
    /// Error after it.
    error: f64,
    /// Lower bound on the error of any plan after it.
    bound: f64,
}

schemas! {
    "lamp-plan-speed-1": SpeedHead<'_>,
        "by_layer": [TimedLayer],
        "doses": [DoseLine],
        "search": [StageLine];
}

/// Writes the report.
pub(super) fn write_report(
    planned: &PlannedTimes<'_>,
    margin: f64,
    path: &Path,
) -> Result<(), Exit> {
    let PlannedTimes { material, part, plan } = planned;
    let last = plan.stages.last();
    let head = SpeedHead {
        material,
        margin,
        layers: part.layers().len(),
        wanted: plan.after.wanted.iter().sum(),
        single_ms: recorded_ms(plan.single),
        before: tally(&plan.before),
        after: tally(&plan.after),
        single_error: plan.single_error,
        error: last.map(|last| last.error),
        bound: last.map(|last| last.bound),
        gap: plan.gap(),
        one_pixel_in: plan.sampled,
        exposure_s: planned.seconds(),
    };
    // Layers are counted from the light down, and reports go upward.
    let layers = part.layers().iter().enumerate().rev().map(|(at, layer)| TimedLayer {
        layer: layer.index,
        z_um: layer.z.to_whole_nm().um(),
        thickness_um: layer.thickness.to_whole_nm().um(),
        exposure_ms: recorded_ms(plan.times[at]),
        speed_um_per_s: planned.speed(at),
        wanted: plan.after.wanted[at],
        before: counts(plan.before.layers[at]),
        after: counts(plan.after.layers[at]),
    });
    let doses = (0..DOSE_BINS).map(|bin| {
        let [[wanted_before, other_before], [wanted_after, other_after]] =
            [&plan.before, &plan.after].map(|tally| tally.doses.map(|doses| doses[bin]));
        let dose = bin as f64 / 10.0;
        DoseLine { dose, wanted_before, other_before, wanted_after, other_after }
    });
    let search =
        plan.stages.iter().map(|stage| StageLine { error: stage.error, bound: stage.bound });
    JsonReport::of_schema("lamp-plan-speed-1", &head)
        .list("by_layer", layers)
        .list("doses", doses)
        .list("search", search)
        .write(path)
}

fn tally(tally: &Tally) -> WrongTally {
    let [counts, at_less_light, at_more_light] = tally.at_light.map(counts);
    WrongTally { counts, at_less_light, at_more_light }
}

fn counts(wrong: Wrong) -> WrongCounts {
    WrongCounts { overcured: wrong.over, undercured: wrong.under }
}

/// The time of a layer in seconds.
pub(super) fn seconds(time: ExposureTime) -> f64 {
    time.ms() / 1000.0
}
