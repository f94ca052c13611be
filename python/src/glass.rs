//! Plans of bitmaps on a fixed glass.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use lamp_pipeline::Error;
use lamp_pipeline::glass::{ColumnCureSettings, EcplSettings, GlassPlan};
use lamp_pipeline::watcher::Watcher;
use lamp_planning::target::HeightMap;
use lamp_stack::PassingLayer;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error;
use crate::layer::{PyLayer, heights_of, record_of};
use crate::settings::{given, settings};
use crate::work::Running;

/// Chooses bitmaps and times that cure a part through glass, by doses.
#[pyfunction]
pub(crate) fn plan_column_cure<'py>(keywords: &Bound<'py, PyDict>) -> PyResult<Bound<'py, PyAny>> {
    let py = keywords.py();
    let settings: ColumnCureSettings = settings(py, &given(keywords)?, |_, _| Ok(()))?;
    check_given(py, &settings.projector, &settings.material)?;
    planned(py, move |watcher| settings.plan(watcher)?.glass_plan())
}

/// Chooses bitmaps and times that cure a round part, by the kinetics of resin and oxygen.
#[pyfunction]
pub(crate) fn plan_ecpl<'py>(keywords: &Bound<'py, PyDict>) -> PyResult<Bound<'py, PyAny>> {
    let py = keywords.py();
    let settings: EcplSettings = settings(py, &given(keywords)?, |_, _| Ok(()))?;
    check_given(py, &settings.projector, &settings.material)?;
    planned(py, move |watcher| settings.plan(watcher)?.glass_plan())
}

fn check_given(py: Python<'_>, projector: &Path, material: &Path) -> PyResult<()> {
    for (path, key) in [(projector, "projector"), (material, "material")] {
        if path.as_os_str().is_empty() {
            return Err(error::settings(
                py,
                format!("give {key}, a built-in one's name or a file"),
            ));
        }
    }
    Ok(())
}

/// Plans in a thread, and returns the plan as an object of Python.
fn planned<'py>(
    py: Python<'py>,
    make: impl FnOnce(&dyn Watcher) -> Result<GlassPlan, Error> + Send + 'static,
) -> PyResult<Bound<'py, PyAny>> {
    let maps = Arc::new(OnceLock::<(Option<HeightMap>, HeightMap)>::new());
    let made = Arc::clone(&maps);
    let running = Running::start(move |work| {
        let plan = make(&work.watcher("plan"))?;
        let pages = plan.pages();
        work.give(Box::new(pages.layers().map(|page| Ok(PassingLayer::from(page?)))))?;
        let GlassPlan { report, wanted, cured, .. } = plan;
        // There is nobody else who fills it.
        let _ = made.set((wanted, cured));
        Ok(report)
    })?;
    let (layers, report) = running.finish_with_layers(py)?;
    let layers: Vec<PyLayer> = layers.into_iter().map(PyLayer::from).collect();
    let (wanted, cured) = maps.get().ok_or_else(|| error::exception(py, &error::stopped()))?;
    let wanted = wanted.as_ref().map(|map| heights_of(py, map)).transpose()?;
    let cured = (heights_of(py, cured)?, cured.grid.pitch_um);
    let plan = (record_of(py, &report)?, layers, wanted, cured.0, cured.1);
    py.import("lamp_slicer._records")?.getattr("Plan")?.call1(plan)
}
