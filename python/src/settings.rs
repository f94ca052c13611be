//! Keywords of Python as settings of stages. Keys and texts are as on the command line.

use lamp_pipeline::Error;
use lamp_stack::Length;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyInt, PyList, PyTuple};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::error::exception;

/// Keywords that were given: not `None`. Keys are the command line's, with `-`.
pub(crate) type Given = Map<String, Value>;

/// Returns the keywords that are not `None`.
pub(crate) fn given(keywords: &Bound<'_, PyDict>) -> PyResult<Given> {
    let mut given = Given::new();
    for (key, value) in keywords {
        if !value.is_none() {
            given.insert(key.extract::<String>()?.replace('_', "-"), value_of(&value)?);
        }
    }
    Ok(given)
}

fn value_of(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if let Ok(flag) = value.cast::<PyBool>() {
        return Ok(flag.is_true().into());
    }
    if value.is_instance_of::<PyInt>() {
        return Ok(match value.extract::<i64>() {
            Ok(number) => number.into(),
            Err(_) => value.str()?.to_string().into(),
        });
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let values = value.try_iter()?.map(|value| text_of(&value?));
        return Ok(values.collect::<PyResult<Vec<_>>>()?.into());
    }
    text_of(value).map(Value::from)
}

/// Returns a text, a number or a path as text.
fn text_of(value: &Bound<'_, PyAny>) -> PyResult<String> {
    Ok(value.str()?.to_string())
}

/// Checks the text of a keyword's value, where settings alone would not say what is wrong.
pub(crate) type Probe = fn(&str, &str) -> Result<(), String>;

/// Lengths that must be above zero.
const ABOVE_ZERO: [&str; 14] = [
    "thickness",
    "min",
    "max",
    "step",
    "cusp",
    "row-pitch",
    "tolerance",
    "cell",
    "wall",
    "break-pitch",
    "pixel",
    "full",
    "robust",
    "voxel",
];

/// Checks lengths: only edges move by less than zero.
fn check_length(key: &str, text: &str) -> Result<(), String> {
    match text.parse::<Length>() {
        Ok(length) if length.um() < 0.0 && key != "uniform" => {
            Err(format!("{length} is below zero"))
        }
        Ok(length) if length.um() == 0.0 && ABOVE_ZERO.contains(&key) => {
            Err("the length must be above zero".to_owned())
        }
        _ => Ok(()),
    }
}

/// Returns settings with the keywords that were given; `probe` looks at each text first.
///
/// # Errors
/// Returns an error of the settings that names the keyword, if a value is wrong, or if it has no
/// effect besides the others.
pub(crate) fn settings<S>(py: Python<'_>, given: &Given, probe: Probe) -> PyResult<S>
where
    S: Serialize + DeserializeOwned + Default,
{
    merged(given, probe).map_err(|error| exception(py, &error))
}

fn merged<S>(given: &Given, probe: Probe) -> Result<S, Error>
where
    S: Serialize + DeserializeOwned + Default,
{
    let usual = as_map(&S::default());
    let with = |key: &str, value: &Value| {
        let mut one = usual.clone();
        one.insert(key.to_owned(), value.clone());
        serde_json::from_value::<S>(Value::Object(one))
    };
    let mut all = usual.clone();
    for (key, value) in given {
        if let Value::String(text) = as_text(value) {
            let checked = check_length(key, &text).and_then(|()| probe(key, &text));
            checked.map_err(|why| wrong(key, &why))?;
        }
        // Alone, so that an error is of this one. Most settings are texts, of numbers and lists, too.
        let text = as_text(value);
        let forms = [text.clone(), value.clone(), Value::Array(vec![text])];
        let mut tried = forms.iter().map(|form| with(key, form).map(|_| form));
        let form = match tried.find_map(Result::ok) {
            Some(form) => form.clone(),
            None => {
                let why = with(key, &as_text(value)).err().map(|error| error.to_string());
                return Err(wrong(key, &why.unwrap_or_default()));
            }
        };
        all.insert(key.clone(), form);
    }
    let settings: S = serde_json::from_value(Value::Object(all.clone()))
        .map_err(|error| Error::settings(error.to_string()))?;
    let made = as_map(&settings);
    for key in given.keys().filter(|key| !made.contains_key(*key)) {
        // A default may go without its key; a value that nothing looks at may be anything.
        let mut other = all.clone();
        other.insert(key.clone(), Value::Array(vec![Value::Null]));
        if serde_json::from_value::<S>(Value::Object(other)).is_ok() {
            return Err(wrong(key, "it has no effect with these other settings"));
        }
    }
    Ok(settings)
}

/// Returns an error about a keyword.
pub(crate) fn wrong(key: &str, why: &str) -> Error {
    Error::settings(why).at(key.replace('-', "_"))
}

/// Returns a value as the command line has it: a list has commas between.
pub(crate) fn as_text(value: &Value) -> Value {
    match value {
        Value::Array(values) => {
            let texts = values.iter().filter_map(Value::as_str).collect::<Vec<_>>();
            texts.join(",").into()
        }
        Value::Number(number) => number.to_string().into(),
        other => other.clone(),
    }
}

fn as_map(settings: &impl Serialize) -> Given {
    match serde_json::to_value(settings) {
        Ok(Value::Object(map)) => map,
        _ => Given::new(),
    }
}
