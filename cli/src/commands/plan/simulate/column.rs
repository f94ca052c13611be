//! Simulates what bitmaps cure where doses add up, column by column (000).

use lamp_pipeline::glass::{measures_line, measures_report, unmeasured_heights};
use lamp_planning::MirrorSeconds;
use lamp_planning::column::{GlassLight, HeightCurve, Measures, Setup, Tracing};
use lamp_planning::target::HeightMap;
use lamp_stack::Length;

use super::{CuredColumns, ShownExposures, SimulatedBitmaps, SimulatedCure, SimulationOutcome};
use crate::exit::Exit;

/// Returns the heights that the doses of all bitmaps together cure.
pub(super) fn cured(shown: &ShownExposures, tracing: Tracing) -> Result<SimulationOutcome, Exit> {
    let ShownExposures { exposures, projector, material, target } = shown;
    let curve = HeightCurve::of(material).map_err(anyhow::Error::new)?;
    let voxel = projector.voxel.as_ref().map_or(projector.pitch.value, |voxel| voxel.value);
    let MirrorSeconds { mirrors, seconds } =
        MirrorSeconds::of(&exposures.bitmaps, |level| projector.share(level));
    let size = target.as_ref().map_or_else(|| lit(mirrors, projector.pitch.value), |to| to.size());
    let grid = Setup::grid_around(projector, size, voxel).map_err(anyhow::Error::new)?;
    let wanted = match target {
        Some(target) => Some(target.heights(&grid, projector)?),
        None => None,
    };
    // Dark margins were cut off on both sides alike, so the middle stays on the axis.
    let setup = Setup { mirrors, display: mirrors, ..Setup::of(projector, &grid, tracing) };
    let doses = GlassLight::new(setup).doses(&seconds);
    let heights_um = doses.iter().map(|&dose| curve.height_um(dose)).collect();
    let cured = HeightMap { grid, heights_um };
    let volume_mm3 = volume_mm3(&cured);
    let mut measures = None;
    let bitmaps = match exposures.bitmaps.len() {
        1 => "1 bitmap cures".to_owned(),
        count => format!("{count} bitmaps cure"),
    };
    let (seconds, highest) = (exposures.seconds(), cured.highest_um());
    let mut lines =
        vec![format!("in {seconds:.1} s {bitmaps} up to {highest:.1} um, {volume_mm3:.4} mm3")];
    if let Some(target) = &wanted {
        let measured = Measures::of(&doses, &target.heights_um, &curve);
        lines.push(measures_line(&measured));
        lines.extend(unmeasured_heights(target, &curve, material));
        measures = Some(measures_report(&measured));
    }
    let bitmaps = SimulatedBitmaps::Count(exposures.bitmaps.len());
    let report = SimulatedCure::Columns {
        cured: CuredColumns { highest_um: highest, volume_mm3 },
        measures,
    };
    Ok(SimulationOutcome { cured, wanted, lines, bitmaps, seconds, report })
}

/// Returns the rectangle of the images of mirrors, and of one more all round.
fn lit(mirrors: [usize; 2], pitch: Length) -> [Length; 2] {
    mirrors.map(|count| Length::from_um((count + 2) as f64 * pitch.um()))
}

fn volume_mm3(map: &HeightMap) -> f64 {
    let side_mm = map.grid.pitch_um / 1000.0;
    map.heights_um.iter().sum::<f64>() / 1000.0 * side_mm * side_mm
}
