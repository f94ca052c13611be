//! The folder that planners on a fixed glass write: bitmaps in order, a report and pictures.

use std::path::Path;

use lamp_pipeline::glass::GlassPlan;
use lamp_planning::target::HeightMap;
use lamp_planning::{MirrorSeconds, PlanFolder, PlanFolderError};

use crate::exit::Exit;
use crate::streams::new_folder;
use lamp_plots::{Colors, HeatMap, Plot, curve, drawn, heat_map, linear, stairs};

const REPORT: &str = "report.json";
const SECTION: [&str; 2] = ["section.svg", "section.csv"];
const RESIDUAL: &str = "residual.png";
const TIMES: &str = "times.png";

/// Creates a plan's folder, before the work. With `force` it will replace one that an earlier run
/// wrote.
pub(crate) fn plan_folder(path: &Path, force: bool) -> Result<PlanFolder, Exit> {
    Ok(PlanFolder::new(new_folder(path, force)?, path))
}

/// Writes all of a plan, and gives the folder its name.
pub(crate) fn write_plan(folder: PlanFolder, plan: &GlassPlan) -> Result<(), Exit> {
    folder.add_bitmaps(&plan.pages())?;
    let report = serde_json::to_string_pretty(&plan.report).expect("reports have text keys");
    folder.add(REPORT, (report + "\n").as_bytes())?;
    let section = [section(plan)];
    for name in SECTION {
        folder.add(name, &drawn(&section, name.as_ref())?)?;
    }
    if let Some(target) = &plan.wanted {
        folder.add(RESIDUAL, &heat_map(&residual(plan, target))?)?;
    }
    for (name, bytes) in &plan.inputs {
        folder.add(name, bytes)?;
    }
    folder.add(TIMES, &heat_map(&times(plan))?)?;
    Ok(folder.finish()?)
}

impl From<PlanFolderError> for Exit {
    fn from(error: PlanFolderError) -> Self {
        match error {
            PlanFolderError::Bitmaps { file, problem } => {
                Self::from(problem).at(file.display().to_string())
            }
            PlanFolderError::File { file, problem } => {
                Self::Failed(problem.into()).at(file.display().to_string())
            }
            error => Self::Failed(error.into()),
        }
    }
}

/// The section along the row nearest to the middle that holds a highest column.
fn section(plan: &GlassPlan) -> Plot {
    let seen = plan.wanted.as_ref().unwrap_or(&plan.cured);
    let grid = seen.grid;
    let row = seen.highest_row();
    let x_mm = |column: usize| grid.x_um(column) / 1000.0;
    let pitch_mm = grid.pitch_um / 1000.0;
    let cured = (0..grid.columns).map(|column| (x_mm(column), plan.cured.height_um(column, row)));
    let mut series = vec![curve("cured", cured.collect())];
    if let Some(target) = &plan.wanted {
        let steps = (0..grid.columns)
            .map(|column| (x_mm(column) - pitch_mm / 2.0, target.height_um(column, row)));
        series.push(curve("target", stairs(steps, pitch_mm)));
    }
    // An axis needs a length, also where nothing is cured.
    let most = series.iter().flat_map(|series| &series.curve).map(|at| at.1).fold(1e-9, f64::max);
    let half_mm = grid.columns as f64 * pitch_mm / 2.0;
    Plot {
        title: format!("{}: section at y = {:.3} mm", plan.part, grid.y_um(row) / 1000.0),
        x: linear("x (mm)", -half_mm..half_mm),
        // Room for the legend.
        y: linear("height (µm)", 0.0..1.3 * most),
        series,
    }
}

fn residual(plan: &GlassPlan, target: &HeightMap) -> HeatMap {
    HeatMap {
        title: format!("{}: cured less target", plan.part),
        label: "height (µm)".to_owned(),
        columns: target.grid.columns,
        values: plan.cured.less(target),
        pitch_mm: target.grid.pitch_um / 1000.0,
        colors: Colors::AboutZero,
    }
}

/// The time that each mirror is on; a gray level counts as its share of it.
fn times(plan: &GlassPlan) -> HeatMap {
    let sum = MirrorSeconds::of(&plan.bitmaps, |level| f64::from(level) / 255.0);
    HeatMap {
        title: format!("{}: time of each mirror", plan.part),
        label: "time (s)".to_owned(),
        columns: sum.mirrors[0],
        values: sum.seconds,
        pitch_mm: plan.pitch.mm(),
        colors: Colors::FromZero,
    }
}
