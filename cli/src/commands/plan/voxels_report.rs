//! The result of a plan of gray levels, in lines and as JSON.

use std::path::Path;

use lamp_planning::voxels::{
    DoseHistogram, LayerOutcome, Outcome, VoxelCounts, VoxelObjective, VoxelTally,
};
use serde::Serialize;

use crate::exit::Exit;
use crate::output::json_report::{JsonReport, schemas};

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

/// Plan of gray levels, by `lamp plan voxels --report`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct VoxelsHead<'a> {
    /// Name of the material.
    material: &'a str,
    /// Aim of the plan, by `--objective`.
    objective: &'static str,
    /// Share by which doses should be above or below the critical dose, by `--dose-margin`.
    margin: f64,
    /// Number of layers.
    layers: usize,
    /// Wanted voxels.
    wanted: u64,
    /// Wanted voxels that white light cures.
    targets: u64,
    /// Wanted voxels that white light does not cure.
    uncurable: u64,
    /// Voxels cured wrongly by white light.
    before: VoxelTallyLine,
    /// Voxels cured wrongly as planned.
    after: VoxelTallyLine,
    /// Lower bound on any plan's cost.
    bound: f64,
    /// The plan's distance from the bound, as a share of the cost before.
    gap: f64,
    /// Sum of the exposure times, in seconds.
    exposure_s: f64,
}

/// Voxels cured wrongly, and what they cost.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct VoxelTallyLine {
    #[serde(flatten)]
    counts: VoxelCountsLine,
    /// The cost, which the plan minimizes.
    cost: f64,
    /// The same with 5 % less light.
    at_less_light: VoxelCountsLine,
    /// The same with 5 % more light.
    at_more_light: VoxelCountsLine,
}

/// Numbers of voxels cured wrongly.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct VoxelCountsLine {
    /// Voxels that are cured and not wanted.
    overcured: u64,
    /// Voxels that are wanted and not cured.
    undercured: u64,
    /// Voxels that white light would cure and that are wanted and not cured.
    lost: u64,
}

/// A layer.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct VoxelLayer {
    /// Its index.
    layer: u32,
    /// Its wanted voxels.
    wanted: u64,
    /// Its wanted voxels that white light cures.
    targets: u64,
    /// Voxels cured wrongly by white light.
    before: VoxelCountsLine,
    /// Voxels cured wrongly as planned.
    after: VoxelCountsLine,
}

/// Voxels by their dose.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct DoseLine {
    /// The least dose, in critical doses; the last line has all doses above.
    pub(super) dose: f64,
    /// Wanted voxels with such a dose before.
    pub(super) wanted_before: u64,
    /// Other voxels with such a dose before.
    pub(super) other_before: u64,
    /// Wanted voxels with such a dose as planned.
    pub(super) wanted_after: u64,
    /// Other voxels with such a dose as planned.
    pub(super) other_after: u64,
}

/// A step of the search.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct SearchLine {
    /// Its number.
    iteration: usize,
    /// The gap of all blocks after it, as a share of the cost before.
    gap: f64,
}

schemas! {
    "lamp-plan-voxels-1": VoxelsHead<'_>,
        "by_layer": [VoxelLayer],
        "doses": [DoseLine],
        "search": [SearchLine];
}

/// Writes the report.
pub(super) fn write_report(planned: &PlannedVoxels<'_>, path: &Path) -> Result<(), Exit> {
    let PlannedVoxels { material, objective, margin, outcome } = planned;
    let head = VoxelsHead {
        material,
        objective: objective.name(),
        margin: *margin,
        layers: outcome.layers.len(),
        wanted: outcome.layers.iter().map(|layer| layer.wanted).sum(),
        targets: outcome.layers.iter().map(|layer| layer.targets).sum(),
        uncurable: outcome.uncurable(),
        before: tally(&outcome.before),
        after: tally(&outcome.after),
        bound: outcome.bound,
        gap: outcome.gap(),
        exposure_s: outcome.exposure_ms / 1000.0,
    };
    let layers = outcome.layers.iter().map(|layer| VoxelLayer {
        layer: layer.index,
        wanted: layer.wanted,
        targets: layer.targets,
        before: counts(layer.before),
        after: counts(layer.after),
    });
    let [before, after] = [&outcome.before.doses, &outcome.after.doses];
    let doses = (0..DoseHistogram::STEPS).map(|step| DoseLine {
        dose: step as f64 / DoseHistogram::PER_CRITICAL_DOSE as f64,
        wanted_before: before.wanted[step],
        other_before: before.other[step],
        wanted_after: after.wanted[step],
        other_after: after.other[step],
    });
    let search =
        outcome.search.iter().map(|at| SearchLine { iteration: at.iteration, gap: at.gap });
    JsonReport::of_schema("lamp-plan-voxels-1", &head)
        .list("by_layer", layers)
        .list("doses", doses)
        .list("search", search)
        .write(path)
}

fn tally(tally: &VoxelTally) -> VoxelTallyLine {
    VoxelTallyLine {
        counts: counts(tally.counts),
        cost: tally.cost,
        at_less_light: counts(tally.dimmer),
        at_more_light: counts(tally.brighter),
    }
}

fn counts(counts: VoxelCounts) -> VoxelCountsLine {
    let VoxelCounts { overcured, undercured, lost } = counts;
    VoxelCountsLine { overcured, undercured, lost }
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
