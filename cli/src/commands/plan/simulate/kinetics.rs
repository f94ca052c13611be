//! Simulates what bitmaps of discs and rings cure by the kinetics of resin and oxygen (003).

use lamp_pipeline::glass::{CuredRings, RingsReport, kinetic_setting, map_grid, rings_shown};
use lamp_planning::ecpl::{RingSimulation, WantedProfile};
use lamp_planning::target::Round;

use super::{ShownExposures, SimulatedBitmaps, SimulatedCure, SimulationOutcome};
use crate::exit::Exit;

/// Returns the heights that all bitmaps cure, one after the other.
pub(super) fn cured(shown: &ShownExposures) -> Result<SimulationOutcome, Exit> {
    let ShownExposures { exposures, projector, material, target } = shown;
    let setting = kinetic_setting(projector, material)?;
    let place = || exposures.name.clone();
    let bitmaps = rings_shown(&exposures.bitmaps).map_err(|error| error.at(place()))?;
    let round = match target {
        Some(target) => Some(target.profile()?),
        None => None,
    };
    let radius_um = round.as_ref().map_or(0.0, Round::radius_um);
    let simulation = RingSimulation::of_plan(setting, &bitmaps, radius_um)
        .map_err(|error| failed(error).at(place()))?;
    let cured = simulation.cure(&bitmaps);
    let cells = simulation.reaction().cells();
    let grid = map_grid(&cured, radius_um);
    let wanted = round.as_ref().map(|round| WantedProfile::new(cells, |um| round.height_um(um)));
    let reported = CuredRings {
        simulation: &simulation,
        exposures: &bitmaps,
        cured: &cured,
        wanted: wanted.as_ref(),
    };
    let RingsReport { setting, bitmaps, exposure_s, outcome } = reported.report();
    Ok(SimulationOutcome {
        lines: reported.lines(),
        bitmaps: SimulatedBitmaps::Rings(bitmaps),
        seconds: exposure_s,
        report: SimulatedCure::Rings { setting, outcome: outcome.into() },
        wanted: round.map(|round| grid.round(|um| round.height_um(um))),
        cured: cured.on(&grid),
    })
}

fn failed(error: impl std::error::Error + Send + Sync + 'static) -> Exit {
    Exit::Failed(error.into())
}
