//! Layers as Python iterates over them, and the stages that take and give them.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use lamp_pipeline::Stage;
use lamp_pipeline::compensate::CompensateSettings;
use lamp_pipeline::dither::DitherSettings;
use lamp_pipeline::edit::EditSettings;
use lamp_pipeline::fix::FixSettings;
use lamp_stack::{Length, LengthError, Pitch};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::PyDict;
use serde_json::Value;

use crate::chain::{Chain, GivenLayers, Source};
use crate::error;
use crate::layer::{PyLayer, record_of};
use crate::settings::{given, settings};
use crate::stack::PyStack;
use crate::work::{Next, Running};

/// An iterator over layers, bottom first. Work begins with the first layer that is asked for.
#[pyclass(frozen, name = "Layers", module = "lamp_slicer")]
pub(crate) struct PyLayers {
    state: Mutex<State>,
    words: String,
}

enum State {
    Ready(Box<Chain>),
    Running(Running),
    Taken,
    Ended(Option<Value>),
}

impl PyLayers {
    /// Returns the layers of a chain.
    pub(crate) fn new(chain: Chain) -> Self {
        let words = chain.words();
        Self { state: Mutex::new(State::Ready(Box::new(chain))), words }
    }

    fn lock(&self, py: Python<'_>) -> MutexGuard<'_, State> {
        self.state.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the chain out, if its work has not begun.
    fn take(&self, py: Python<'_>) -> PyResult<Option<Chain>> {
        let mut state = self.lock(py);
        match std::mem::replace(&mut *state, State::Taken) {
            State::Ready(chain) => Ok(Some(*chain)),
            State::Taken => Err(taken(py)),
            // The rest is taken one by one.
            other => {
                *state = other;
                Ok(None)
            }
        }
    }
}

fn taken(py: Python<'_>) -> PyErr {
    error::settings(py, "another stage has taken these layers: use its layers instead")
}

#[pymethods]
impl PyLayers {
    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<PyLayer>> {
        let mut state = self.lock(py);
        if matches!(*state, State::Ready(_)) {
            let State::Ready(chain) = std::mem::replace(&mut *state, State::Ended(None)) else {
                return Ok(None);
            };
            *state = State::Running(Running::start(move |work| {
                let reports = chain.run(work, true, &mut |layers| work.give(layers))?;
                Ok(reports.into())
            })?);
        }
        let running = match &mut *state {
            State::Running(running) => running,
            State::Taken => return Err(taken(py)),
            State::Ready(_) | State::Ended(_) => return Ok(None),
        };
        match running.next(py) {
            Ok(Next::Layer(layer)) => Ok(Some((*layer).into())),
            Ok(Next::End(report)) => {
                *state = State::Ended(Some(report));
                Ok(None)
            }
            Err(error) => {
                *state = State::Ended(None);
                Err(error)
            }
        }
    }

    /// The reports of the stages, once the last layer is through.
    #[getter]
    fn reports<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        match &*self.lock(py) {
            State::Ended(Some(report)) => record_of(py, report).map(Some),
            _ => Ok(None),
        }
    }

    fn __repr__(&self) -> String {
        format!("<lamp_slicer.Layers: {}>", self.words)
    }
}

/// Returns the chain of layers that Python gives: layers of this module, the path of a stack, or
/// anything that iterates over layers or arrays.
pub(crate) fn chain_of(layers: &Bound<'_, PyAny>) -> PyResult<Chain> {
    let py = layers.py();
    if let Ok(layers) = layers.cast::<PyLayers>()
        && let Some(chain) = layers.get().take(py)?
    {
        return Ok(chain);
    }
    if let Ok(stack) = layers.cast::<PyStack>() {
        return Ok(stack.get().chain());
    }
    if let Ok(path) = layers.extract::<PathBuf>() {
        return Ok(Chain::of(Source::Stack(path)));
    }
    given_layers(layers, None, None, None)
}

/// Returns a chain of layers or arrays that Python gives.
pub(crate) fn given_layers(
    layers: &Bound<'_, PyAny>,
    dpi: Option<&Bound<'_, PyAny>>,
    thickness: Option<&str>,
    part: Option<String>,
) -> PyResult<Chain> {
    let py = layers.py();
    // A text would give its letters.
    if let Ok(path) = layers.extract::<PathBuf>() {
        let why = "is a path: for the layers of that stack, open it with lamp_slicer.open; dpi, \
                   thickness and name are for arrays";
        return Err(error::settings(py, format!("{} {why}", path.display())));
    }
    let iterator = layers.try_iter().map_err(|_| {
        let kind = layers.get_type().to_string();
        let why = "give a stack, a path of one, or what iterates over layers or arrays";
        error::settings(py, format!("{kind} has no layers: {why}"))
    })?;
    let pitch = dpi.map(|dpi| {
        let text = dpi.str()?.to_string();
        text.parse::<Pitch>().map_err(|why| error::settings(py, format!("dpi: {why}")))
    });
    let thickness_um = thickness.map(|text| match text.parse::<Length>() {
        Ok(length) if length.um() > 0.0 => Ok(length.um()),
        Ok(_) => Err(error::settings(py, "thickness: the length must be above zero")),
        Err(why) => Err(error::settings(py, format!("thickness: {why}"))),
    });
    Ok(Chain::of(Source::Given(GivenLayers {
        iterator: iterator.into_any().unbind(),
        pitch: pitch.transpose()?,
        thickness_um: thickness_um.transpose()?,
        part,
    })))
}

/// Returns layers of arrays, with their resolution and thickness.
#[pyfunction]
#[pyo3(signature = (arrays, *, dpi, thickness, name))]
pub(crate) fn layers(
    arrays: &Bound<'_, PyAny>,
    dpi: Option<&Bound<'_, PyAny>>,
    thickness: Option<&str>,
    name: Option<String>,
) -> PyResult<PyLayers> {
    given_layers(arrays, dpi, thickness, name).map(PyLayers::new)
}

/// Adds a stage behind layers.
fn staged(layers: &Bound<'_, PyAny>, stage: Stage) -> PyResult<PyLayers> {
    let mut chain = chain_of(layers)?;
    chain.stages.push(stage);
    Ok(PyLayers::new(chain))
}

fn no_probe(_: &str, _: &str) -> Result<(), String> {
    Ok(())
}

/// Corrects stray rows.
#[pyfunction]
pub(crate) fn fix(layers: &Bound<'_, PyAny>, keywords: &Bound<'_, PyDict>) -> PyResult<PyLayers> {
    let probe = |key: &str, text: &str| match (key, text.parse::<f64>()) {
        ("min-confidence", Ok(share)) if (0.0..=1.0).contains(&share) => Ok(()),
        ("min-confidence", _) => {
            Err(format!("`{text}` is not a share: write a number from 0 to 1"))
        }
        _ => Ok(()),
    };
    let mut given = given(keywords)?;
    // Stored results hold the older spelling.
    if let Some(value) = given.remove("use-neighbors") {
        given.insert("use-neighbours".to_owned(), value);
    }
    let settings: FixSettings = settings(layers.py(), &given, probe)?;
    staged(layers, Stage::Fix(settings))
}

/// Turns gray layers into dots.
#[pyfunction]
pub(crate) fn dither(
    layers: &Bound<'_, PyAny>,
    keywords: &Bound<'_, PyDict>,
) -> PyResult<PyLayers> {
    let settings: DitherSettings = settings(layers.py(), &given(keywords)?, no_probe)?;
    staged(layers, Stage::Dither(settings))
}

/// Moves edges, and enlarges images for shrinkage.
#[pyfunction]
pub(crate) fn compensate(
    layers: &Bound<'_, PyAny>,
    keywords: &Bound<'_, PyDict>,
) -> PyResult<PyLayers> {
    let distance = |key: &str, text: &str| match key {
        "min-feature" => match text.parse::<Length>() {
            Ok(length) if length.um() >= 0.0 => Ok(()),
            Ok(length) => Err(format!("{length} is below zero")),
            Err(error) => Err(LengthError::to_string(&error)),
        },
        _ => Ok(()),
    };
    let given = given(keywords)?;
    let py = layers.py();
    for (key, needs) in [("dose", "material"), ("lamp-intensity", "material")] {
        if given.contains_key(key) && !given.contains_key(needs) {
            let key = key.replace('-', "_");
            return Err(error::settings(py, format!("{key}: it needs {needs}")));
        }
    }
    if given.contains_key("uniform") && given.contains_key("material") {
        return Err(error::settings(py, "give uniform or material, not both"));
    }
    let settings: CompensateSettings = settings(py, &given, distance)?;
    staged(layers, Stage::Compensate(settings))
}

/// Changes layers by a list of edits.
#[pyfunction]
pub(crate) fn edit(layers: &Bound<'_, PyAny>, edits: PathBuf) -> PyResult<PyLayers> {
    staged(layers, Stage::Edit(EditSettings::List { edits }))
}
