//! Parts that are sliced: files, or meshes in memory.

use std::ffi::OsString;
use std::fs::File;
use std::io::BufWriter;
use std::ops::Range;
use std::path::PathBuf;

use lamp_machine::Machine;
use lamp_pipeline::documents::{document, is_stream};
use lamp_pipeline::heights::HeightSettings;
use lamp_pipeline::part_file::PartFile;
use lamp_pipeline::placement::{FiniteNumbers, parse_scale};
use lamp_pipeline::slice::SliceStage;
use lamp_pipeline::solid::name_of_all;
use lamp_pipeline::watcher::{Remark, Watcher};
use lamp_pipeline::{Error, SliceSettings};
use lamp_slicing::{Facet, write_stl};
use lamp_stack::{Length, PassingLayer, Size};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyString};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::chain::{Chain, Source};
use crate::error;
use crate::layers::PyLayers;
use crate::settings::{as_text, given, settings};
use crate::work::{Flow, Work};

/// A part, and how it is sliced.
pub(crate) struct PartSource {
    stage: SliceStage,
    /// The folder of a mesh that was in memory.
    mesh: Option<TempDir>,
}

/// The name of a mesh in memory, in stacks and messages.
const MESH: &str = "mesh";

impl PartSource {
    /// Returns the part's name, for messages.
    pub(crate) fn name(&self) -> String {
        match self.mesh {
            Some(_) => MESH.to_owned(),
            None => name_of_all(&self.stage.parts),
        }
    }

    /// Returns the stage as words of a command.
    pub(crate) fn words(&self) -> String {
        self.stage.canonical()
    }

    /// Slices the part, and returns the counts.
    pub(crate) fn run(
        self,
        work: &Work,
        then: &mut dyn FnMut(Flow<'_>) -> Result<(), Error>,
    ) -> Result<Vec<Value>, Error> {
        let watcher = work.watcher("slice");
        let slicing = self.stage.open(None, &watcher).map_err(|error| self.renamed(error))?;
        slicing.doubts().into_iter().for_each(|doubt| watcher.remark(Remark::warning(doubt)));
        let layers = slicing.layers(0..u32::MAX, |_| ());
        then(Box::new(
            layers.map(|layer| layer.map(PassingLayer::from).map_err(|error| self.renamed(error))),
        ))?;
        slicing.summary(None).into_iter().for_each(|remark| watcher.remark(remark));
        if slicing.is_blank() {
            let why = "no layer has a white pixel: check the part, its unit and the layers";
            watcher.remark(Remark::warning(why));
        }
        let mut report = json!({ "stage": "slice" });
        if let (Value::Object(report), Value::Object(counts)) =
            (&mut report, json!(slicing.counts()))
        {
            report.extend(counts);
        }
        Ok(vec![report])
    }

    /// Names a mesh in memory in place of its file.
    fn renamed(&self, error: Error) -> Error {
        let Some(folder) = &self.mesh else { return error };
        let kind = error.kind();
        let (cause, places) = error.into_parts();
        let folder = folder.path().to_string_lossy().into_owned();
        let names = places.into_iter().map(|place| match place.starts_with(&folder) {
            true => MESH.to_owned(),
            false => place,
        });
        names.fold(Error::new(kind, cause), Error::at)
    }
}

/// Slices a part: the path of a file, paths, `(vertices, faces)` or an object that has both.
#[pyfunction]
#[pyo3(signature = (part, keywords, *, name, machine, layers, memory_bytes, fallback))]
#[expect(clippy::too_many_arguments, reason = "each is a keyword")]
pub(crate) fn slice(
    py: Python<'_>,
    part: &Bound<'_, PyAny>,
    keywords: &Bound<'_, PyDict>,
    name: Option<String>,
    machine: Option<PathBuf>,
    layers: Option<Bound<'_, PyAny>>,
    memory_bytes: Option<u64>,
    fallback: Option<PathBuf>,
) -> PyResult<PyLayers> {
    let mut given = given(keywords)?;
    if let Some(machine) = &machine {
        let machine: Machine =
            py.detach(|| document(machine)).map_err(|error| error::exception(py, &error))?;
        let defaults = machine.slicing_defaults();
        let mut usual = |key: &str, of_machine: Option<Value>, others: &[&str]| {
            if let Some(value) = of_machine
                && !others.iter().any(|other| given.contains_key(*other))
            {
                given.entry(key).or_insert(value);
            }
        };
        usual("dpi", defaults.pitch.map(|pitch| pitch.to_string().into()), &[]);
        let thickness = defaults.thickness.map(|thickness| thickness.to_string().into());
        usual("thickness", thickness, &["adaptive"]);
        usual("margin", defaults.margin.map(|margin| margin.to_string().into()), &["origin"]);
    }
    if let Some(Value::String(text)) = given.get("scale").map(as_text)
        && let Ok(factors) = parse_scale(&text)
    {
        // One factor may stand for three.
        given.insert("scale".to_owned(), factors.to_string().into());
    }
    let settings: SliceSettings = settings(py, &given, probe)?;
    let (parts, mesh) = parts_of(part)?;
    if parts.is_empty() || parts.iter().any(|part| is_stream(&part.path)) {
        return Err(error::settings(py, "name the file of a part"));
    }
    let layers = layers.map(|layers| range_of(&layers)).transpose()?;
    let memory = memory_bytes;
    let stage = SliceStage { parts, name, settings, machine, layers, memory, fallback };
    Ok(PyLayers::new(Chain::of(Source::Part(Box::new(PartSource { stage, mesh })))))
}

/// Returns the layers of a `range`.
fn range_of(layers: &Bound<'_, PyAny>) -> PyResult<Range<u32>> {
    let number = |name: &str| layers.getattr(name).and_then(|number| number.extract::<u32>());
    match (number("start"), number("stop"), number("step")) {
        (Ok(start), Ok(end), Ok(1)) if start < end => Ok(start..end),
        _ => {
            let why = format!("layers: {layers} is no range of layers: give range(100, 200)");
            Err(error::settings(layers.py(), why))
        }
    }
}

/// Checks texts that several settings may take, so that these could not say what is wrong.
fn probe(key: &str, text: &str) -> Result<(), String> {
    fn parsed<T: std::str::FromStr<Err: std::fmt::Display>>(text: &str) -> Result<T, String> {
        text.parse().map_err(|error: T::Err| error.to_string())
    }
    match key {
        "thickness" | "plane-tolerance" => parsed::<Length>(text).map(drop),
        "origin" => parsed::<FiniteNumbers<2>>(text).map(drop),
        "size" => parsed::<Size>(text).map(drop),
        "margin" => match text.parse::<u32>() {
            Ok(_) => Ok(()),
            Err(_) => Err(format!("`{text}` is not a number of pixels")),
        },
        "scale" => parse_scale(text).map(drop),
        "overcure" => match text.parse::<f64>() {
            Ok(layers) if (0.1..=100.0).contains(&layers) => Ok(()),
            _ => Err(format!("`{text}` is not a depth in layers: write a number from 0.1 to 100")),
        },
        _ => {
            let one: Value = [(key.to_owned(), Value::from(text))].into_iter().collect();
            let alone = serde_json::from_value::<HeightSettings>(one);
            alone.map(drop).map_err(|error| error.to_string())
        }
    }
}

/// Returns the files of a part. A mesh in memory becomes an STL in a folder of its own.
fn parts_of(part: &Bound<'_, PyAny>) -> PyResult<(Vec<PartFile>, Option<TempDir>)> {
    let py = part.py();
    let file = |part: &Bound<'_, PyAny>| -> PyResult<PartFile> {
        let path: PathBuf = part.extract()?;
        // A text may have a placement behind it, as on the command line; a path is one.
        match part.is_instance_of::<PyString>() {
            true => PartFile::parse(OsString::from(path)).map_err(|why| error::settings(py, why)),
            false => Ok(PartFile { path, placement: None }),
        }
    };
    if let Ok(file) = file(part) {
        return Ok((vec![file], None));
    }
    if let Ok(files) = part.cast::<PyList>() {
        return Ok((files.iter().map(|part| file(&part)).collect::<PyResult<_>>()?, None));
    }
    let (vertices, faces) = match (part.getattr("vertices"), part.getattr("faces")) {
        (Ok(vertices), Ok(faces)) => (vertices, faces),
        _ => part.extract().map_err(|_| {
            let kind = part.get_type().to_string();
            let why = "give a part: the path of a file, a list of paths, (vertices, faces), or an \
                       object that has both";
            error::settings(py, format!("{kind} is no part: {why}"))
        })?,
    };
    let facets = facets_of(&vertices, &faces)?;
    let folder = py.detach(|| -> std::io::Result<TempDir> {
        let folder = TempDir::with_prefix("lamp-")?;
        let file = BufWriter::new(File::create(folder.path().join(MESH).with_extension("stl"))?);
        write_stl(facets.into_iter(), file)?;
        Ok(folder)
    })?;
    let path = folder.path().join(MESH).with_extension("stl");
    Ok((vec![PartFile { path, placement: None }], Some(folder)))
}

/// Returns the facets of arrays of n x 3 coordinates and m x 3 numbers of vertices.
fn facets_of(vertices: &Bound<'_, PyAny>, faces: &Bound<'_, PyAny>) -> PyResult<Vec<Facet>> {
    let py = vertices.py();
    let bytes = |array: &Bound<'_, PyAny>, dtype: &str, name: &str| -> PyResult<Vec<u8>> {
        let array = py.import("numpy")?.call_method1("ascontiguousarray", (array, dtype))?;
        let shape: Vec<usize> = array.getattr("shape")?.extract()?;
        if !matches!(shape[..], [_, 3]) {
            let why = format!("{name} of shape {shape:?}: give an array of n x 3 numbers");
            return Err(error::settings(py, why));
        }
        Ok(array.call_method0("tobytes")?.cast_into::<PyBytes>()?.as_bytes().to_vec())
    };
    // Coordinates are rounded to 32 bits, as in an STL.
    let vertices = bytes(vertices, "<f4", "vertices")?;
    let faces = bytes(faces, "<i8", "faces")?;
    let numbers: Vec<f32> =
        vertices.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let vertices = numbers.as_chunks::<3>().0;
    let corners: Vec<i64> =
        faces.as_chunks().0.iter().map(|bytes| i64::from_le_bytes(*bytes)).collect();
    let facet = |(number, corners): (usize, &[i64; 3])| -> PyResult<Facet> {
        let mut facet = Facet::default();
        for (place, &corner) in facet.iter_mut().zip(corners) {
            let vertex = usize::try_from(corner).ok().and_then(|corner| vertices.get(corner));
            *place = *vertex.ok_or_else(|| {
                let count = vertices.len();
                let why = format!(
                    "face {number} names vertex {corner}, but there are {count} vertices, from 0"
                );
                error::settings(py, why)
            })?;
        }
        Ok(facet)
    };
    corners.as_chunks::<3>().0.iter().enumerate().map(facet).collect()
}
