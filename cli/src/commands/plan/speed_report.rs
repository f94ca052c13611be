//! The result of a plan of times, in lines and as JSON.

use std::path::Path;

use lamp_grayscale::resin::ExposureTime;
use lamp_pipeline::heights::{significant, time_text};
use lamp_planning::speed::{DOSE_BINS, SpeedPlan, Tally, TimedPart, Wrong, recorded_ms};
use serde_json::{Value, json};

use crate::exit::Exit;
use crate::output::json_report::JsonReport;

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

/// Writes the report.
pub(super) fn write_report(
    planned: &PlannedTimes<'_>,
    margin: f64,
    path: &Path,
) -> Result<(), Exit> {
    let PlannedTimes { material, part, plan } = planned;
    let last = plan.stages.last();
    let head = json!({
        "schema": "lamp-plan-speed-1",
        "material": material,
        "margin": margin,
        "layers": part.layers().len(),
        "wanted": plan.after.wanted.iter().sum::<u64>(),
        "single_ms": recorded_ms(plan.single),
        "before": tally(&plan.before),
        "after": tally(&plan.after),
        "single_error": plan.single_error,
        "error": last.map(|last| last.error),
        "bound": last.map(|last| last.bound),
        "gap": plan.gap(),
        "one_pixel_in": plan.sampled,
        "exposure_s": planned.seconds(),
    });
    // Layers are counted from the light down, and reports go upward.
    let layers = part.layers().iter().enumerate().rev().map(|(at, layer)| {
        json!({
            "layer": layer.index,
            "z_um": layer.z.to_whole_nm().um(),
            "thickness_um": layer.thickness.to_whole_nm().um(),
            "exposure_ms": recorded_ms(plan.times[at]),
            "speed_um_per_s": planned.speed(at),
            "wanted": plan.after.wanted[at],
            "before": counts(plan.before.layers[at]),
            "after": counts(plan.after.layers[at]),
        })
    });
    let doses = (0..DOSE_BINS).map(|bin| {
        let [[wanted_before, other_before], [wanted_after, other_after]] =
            [&plan.before, &plan.after].map(|tally| tally.doses.map(|doses| doses[bin]));
        json!({
            "dose": bin as f64 / 10.0,
            "wanted_before": wanted_before,
            "other_before": other_before,
            "wanted_after": wanted_after,
            "other_after": other_after,
        })
    });
    let search =
        plan.stages.iter().map(|stage| json!({ "error": stage.error, "bound": stage.bound }));
    JsonReport::new(&head)
        .list("by_layer", layers)
        .list("doses", doses)
        .list("search", search)
        .write(path)
}

fn tally(tally: &Tally) -> Value {
    let [all, less, more] = tally.at_light.map(counts);
    let mut value = all;
    value["at_less_light"] = less;
    value["at_more_light"] = more;
    value
}

fn counts(wrong: Wrong) -> Value {
    json!({ "overcured": wrong.over, "undercured": wrong.under })
}

/// The time of a layer in seconds.
pub(super) fn seconds(time: ExposureTime) -> f64 {
    time.ms() / 1000.0
}
