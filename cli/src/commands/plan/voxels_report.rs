//! The result of a plan of gray levels, in lines and as JSON.

use std::path::Path;

use lamp_planning::voxels::{
    DoseHistogram, LayerOutcome, Outcome, VoxelCounts, VoxelObjective, VoxelTally,
};
use serde_json::{Value, json};

use crate::exit::Exit;
use crate::output::json_report::JsonReport;

/// A plan, and what it was for.
pub(super) struct PlannedVoxels<'a> {
    pub(super) material: &'a str,
    pub(super) objective: VoxelObjective,
    pub(super) margin: f64,
    pub(super) outcome: &'a Outcome,
}

/// The lines that are printed.
pub(super) fn lines_of(planned: &PlannedVoxels<'_>) -> Vec<String> {
    let outcome = planned.outcome;
    let [before, after] = [&outcome.before, &outcome.after];
    let targets: u64 = outcome.layers.iter().map(|layer| layer.targets).sum();
    let mut lines = vec![format!(
        "{} to {} voxels overcured{}, {} to {} undercured; {} of {targets} are lost although \
         white light cures them",
        before.counts.overcured,
        after.counts.overcured,
        change(before.counts.overcured, after.counts.overcured),
        before.counts.undercured,
        after.counts.undercured,
        after.counts.lost,
    )];
    let of = |name: &str, counts: VoxelCounts| {
        format!("{name}: {} overcured, {} undercured", counts.overcured, counts.undercured)
    };
    lines.push(format!(
        "{}; {}",
        of("at 5% less light", after.dimmer),
        of("at 5% more", after.brighter)
    ));
    if let Some(line) = uncurable(&outcome.layers) {
        lines.push(line);
    }
    lines.push(format!(
        "the best plan is at most {:.2}% of the unplanned error better",
        100.0 * outcome.gap().max(0.0)
    ));
    lines
}

/// ` (-98.5%)`.
fn change(before: u64, after: u64) -> String {
    if before == 0 {
        return String::new();
    }
    let percent = 100.0 * (after as f64 / before as f64 - 1.0);
    // Enough decimals to distinguish the rest from nothing.
    let is_told =
        |&decimals: &usize| after == 0 || !format!("{percent:.decimals$}").starts_with("-100");
    let decimals = (1..8).find(is_told).unwrap_or(8);
    format!(" ({percent:+.decimals$}%)")
}

/// Describes wanted voxels that white light does not cure.
fn uncurable(layers: &[LayerOutcome]) -> Option<String> {
    let short = |layer: &&LayerOutcome| layer.targets < layer.wanted;
    let first = layers.iter().find(short)?.index;
    let last = layers.iter().rev().find(short)?.index;
    let count: u64 = layers.iter().map(|layer| layer.wanted - layer.targets).sum();
    let place =
        if first == last { format!("layer {first}") } else { format!("layers {first} to {last}") };
    Some(format!("white light does not cure {count} wanted voxels, in {place}"))
}

/// Writes the report.
pub(super) fn write_report(planned: &PlannedVoxels<'_>, path: &Path) -> Result<(), Exit> {
    let PlannedVoxels { material, objective, margin, outcome } = planned;
    let head = json!({
        "schema": "lamp-plan-voxels-1",
        "material": material,
        "objective": objective.name(),
        "margin": margin,
        "layers": outcome.layers.len(),
        "wanted": outcome.layers.iter().map(|layer| layer.wanted).sum::<u64>(),
        "targets": outcome.layers.iter().map(|layer| layer.targets).sum::<u64>(),
        "uncurable": outcome.uncurable(),
        "before": tally(&outcome.before),
        "after": tally(&outcome.after),
        "bound": outcome.bound,
        "gap": outcome.gap(),
        "exposure_s": outcome.exposure_ms / 1000.0,
    });
    let layers = outcome.layers.iter().map(|layer| {
        json!({
            "layer": layer.index,
            "wanted": layer.wanted,
            "targets": layer.targets,
            "before": counts(layer.before),
            "after": counts(layer.after),
        })
    });
    let [before, after] = [&outcome.before.doses, &outcome.after.doses];
    let doses = (0..DoseHistogram::STEPS).map(|step| {
        json!({
            "dose": step as f64 / DoseHistogram::PER_CRITICAL_DOSE as f64,
            "wanted_before": before.wanted[step],
            "other_before": before.other[step],
            "wanted_after": after.wanted[step],
            "other_after": after.other[step],
        })
    });
    let search =
        outcome.search.iter().map(|at| json!({ "iteration": at.iteration, "gap": at.gap }));
    JsonReport::new(&head)
        .list("by_layer", layers)
        .list("doses", doses)
        .list("search", search)
        .write(path)
}

fn tally(tally: &VoxelTally) -> Value {
    let mut value = counts(tally.counts);
    value["cost"] = tally.cost.into();
    value["at_less_light"] = counts(tally.dimmer);
    value["at_more_light"] = counts(tally.brighter);
    value
}

fn counts(counts: VoxelCounts) -> Value {
    let VoxelCounts { overcured, undercured, lost } = counts;
    json!({ "overcured": overcured, "undercured": undercured, "lost": lost })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_told_from_nothing() {
        assert_eq!(change(84, 0), " (-100.0%)");
        assert_eq!(change(61_503, 34), " (-99.9%)");
        assert_eq!(change(222_532, 2), " (-99.999%)");
        assert_eq!(change(100, 110), " (+10.0%)");
        assert_eq!(change(0, 5), "");
    }
}
