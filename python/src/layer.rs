//! Layers as Python sees them: images as arrays and runs, and their pages' metadata.

use std::sync::Arc;

use lamp_pipeline::Error;
use lamp_planning::target::HeightMap;
use lamp_stack::{
    GrayMask, Image, Layer, LevelChange, MAX_SIDE, Mask, MaskBuilder, PageInfo, Pitch, gray_runs,
    white_runs,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyByteArray, PyBytes};

/// One layer: its image and the metadata of its page. It is not changed once made.
#[pyclass(frozen, name = "Layer", module = "lamp_slicer")]
pub(crate) struct PyLayer(Arc<Layer>);

impl From<Layer> for PyLayer {
    fn from(layer: Layer) -> Self {
        Self(Arc::new(layer))
    }
}

impl PyLayer {
    /// Returns the layer.
    pub(crate) fn layer(&self) -> Layer {
        Layer::clone(&self.0)
    }
}

#[pymethods]
impl PyLayer {
    /// The layer's index, 0 at the bottom.
    #[getter]
    fn index(&self) -> u32 {
        self.0.info.index
    }

    /// The height of the layer's bottom in micrometers, if it is known.
    #[getter]
    fn z_um(&self) -> Option<f64> {
        self.0.info.z_um
    }

    /// The layer's thickness in micrometers, if it is known.
    #[getter]
    fn thickness_um(&self) -> Option<f64> {
        self.0.info.thickness_um
    }

    /// The layer's exposure time in milliseconds, if it is known.
    #[getter]
    fn exposure_ms(&self) -> Option<f64> {
        self.0.info.exposure_ms
    }

    /// x and y of the image's top left corner in part coordinates in millimeters, if known.
    #[getter]
    fn origin_mm(&self) -> Option<(f64, f64)> {
        self.0.info.origin_mm.map(Into::into)
    }

    /// The resolution in dots per inch, if it is known: two numbers, along x and y, where pixels
    /// are not square.
    #[getter]
    fn dpi(&self) -> Option<PyDpi> {
        self.0.pitch.map(PyDpi::from)
    }

    /// The numbers of rows and columns, as of the array.
    #[getter]
    fn shape(&self) -> (u32, u32) {
        (self.0.image.height(), self.0.image.width())
    }

    /// Whether the image is gray; otherwise it is black and white.
    #[getter]
    fn is_gray(&self) -> bool {
        matches!(*self.0.image, Image::Gray(_))
    }

    /// The metadata of the page.
    #[getter]
    fn info<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        record_of(py, &self.0.info)
    }

    /// The image as a new array: bool if it is black and white, uint8 if it is gray.
    fn array<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, &self.0.image)
    }

    /// The image as an array, for numpy.
    #[pyo3(signature = (dtype = None, copy = None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if copy == Some(false) {
            let why = "a layer holds runs, not pixels: its array is always new";
            return Err(PyValueError::new_err(why));
        }
        let array = array_of(py, &self.0.image)?;
        match dtype {
            Some(dtype) => array.call_method1("astype", (dtype,)),
            None => Ok(array),
        }
    }

    /// The image as runs: where each row's changes start, and one entry more for where the last
    /// row's end; the columns of the changes; and of gray images the levels from there on.
    #[getter]
    fn runs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        runs_of(py, &self.0.image)
    }

    /// The number of pixels that are not black.
    #[getter]
    fn exposed_px(&self, py: Python<'_>) -> u64 {
        py.detach(|| match &*self.0.image {
            Image::Mask(mask) => mask.white_pixels(),
            Image::Gray(gray) => {
                let of_row = |row: &[LevelChange]| -> u64 {
                    gray_runs(row, gray.width()).map(|(from, to, _)| u64::from(to - from)).sum()
                };
                gray.rows().map(of_row).sum()
            }
        })
    }

    fn __repr__(&self) -> String {
        let (rows, columns) = self.shape();
        let kind = if self.is_gray() { "gray" } else { "black and white" };
        format!("<{}: {rows} x {columns}, {kind}>", self.0.info.name())
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

/// Returns what JSON has as objects of Python.
pub(crate) fn record_of<'py>(
    py: Python<'py>,
    value: &impl serde::Serialize,
) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value);
    let text = text.map_err(|error| PyValueError::new_err(error.to_string()))?;
    py.import("lamp_slicer._records")?.call_method1("records", (text,))
}

/// Returns an array of numpy over new memory, which `fill` fills without Python's lock.
fn filled<'py>(
    py: Python<'py>,
    bytes: usize,
    dtype: &str,
    fill: impl FnOnce(&mut [u8]) + Send,
) -> PyResult<Bound<'py, PyAny>> {
    let memory = PyByteArray::new_with(py, bytes, |memory| {
        py.detach(|| fill(memory));
        Ok(())
    })?;
    array_over(py, &memory, dtype)
}

/// Returns an array of numpy over memory.
fn array_over<'py>(
    py: Python<'py>,
    memory: &Bound<'py, PyByteArray>,
    dtype: &str,
) -> PyResult<Bound<'py, PyAny>> {
    static FROM_BUFFER: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    FROM_BUFFER.import(py, "numpy", "frombuffer")?.call1((memory, dtype))
}

/// Returns an image as an array.
pub(crate) fn array_of<'py>(py: Python<'py>, image: &Image) -> PyResult<Bound<'py, PyAny>> {
    let [width, height] = [image.width(), image.height()].map(|side| side as usize);
    let (dtype, white) = match image {
        Image::Mask(_) => ("bool", 1),
        Image::Gray(_) => ("uint8", u8::MAX),
    };
    let fill = |pixels: &mut [u8]| {
        for (row, pixels) in (0..).zip(pixels.chunks_exact_mut(width.max(1))) {
            match image {
                Image::Mask(mask) => {
                    for (start, end) in white_runs(mask.row(row), image.width()) {
                        pixels[start as usize..end as usize].fill(white);
                    }
                }
                Image::Gray(gray) => {
                    for (start, end, level) in gray_runs(gray.row(row), image.width()) {
                        pixels[start as usize..end as usize].fill(level);
                    }
                }
            }
        }
    };
    filled(py, width * height, dtype, fill)?.call_method1("reshape", ((height, width),))
}

/// Returns heights as an array of rows.
pub(crate) fn heights_of<'py>(py: Python<'py>, map: &HeightMap) -> PyResult<Bound<'py, PyAny>> {
    let memory = PyByteArray::new(py, bytemuck::cast_slice(&map.heights_um));
    let shape = (map.grid.rows, map.grid.columns);
    array_over(py, &memory, "float64")?.call_method1("reshape", (shape,))
}

/// Returns an image as arrays of runs.
pub(crate) fn runs_of<'py>(py: Python<'py>, image: &Image) -> PyResult<Bound<'py, PyAny>> {
    let numbers = |numbers: &[u32]| {
        let memory = PyByteArray::new(py, bytemuck::cast_slice(numbers));
        array_over(py, &memory, "uint32")
    };
    let (starts, columns, levels) = match image {
        Image::Mask(mask) => (numbers(mask.row_offsets())?, numbers(mask.changes())?, None),
        Image::Gray(gray) => {
            let changes = gray.changes();
            let columns: Vec<u32> = changes.iter().map(|change| change.column).collect();
            let levels = filled(py, changes.len(), "uint8", |memory| {
                memory.iter_mut().zip(changes).for_each(|(place, change)| *place = change.level);
            })?;
            (numbers(gray.row_offsets())?, numbers(&columns)?, Some(levels))
        }
    };
    static RUNS: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    RUNS.import(py, "lamp_slicer._records", "Runs")?.call1((starts, columns, levels))
}

/// A resolution in dots per inch, as Python shows it.
#[derive(IntoPyObject)]
pub(crate) enum PyDpi {
    /// Of square pixels.
    Square(f64),
    /// Along x and y.
    Two((f64, f64)),
}

impl From<Pitch> for PyDpi {
    fn from(pitch: Pitch) -> Self {
        let [x, y] = pitch.dpi();
        if pitch.is_square() { Self::Square(x) } else { Self::Two((x, y)) }
    }
}

/// The rows of an array: a byte for each pixel.
struct Pixels {
    width: u32,
    height: u32,
    is_gray: bool,
    bytes: Vec<u8>,
}

/// Returns a layer that Python gives: a `Layer`, or an array, which gets the metadata `info`.
pub(crate) fn layer_of(
    given: &Bound<'_, PyAny>,
    info: impl FnOnce() -> PageInfo,
    pitch: Option<Pitch>,
) -> PyResult<Layer> {
    if let Ok(layer) = given.cast::<PyLayer>() {
        return Ok(layer.get().layer());
    }
    let py = given.py();
    let pixels = pixels_of(given)?;
    let image = py.detach(|| image_of(&pixels));
    let image = image.map_err(|error| crate::error::exception(py, &error))?;
    Ok(Layer { info: info(), pitch, image: image.into() })
}

fn pixels_of(given: &Bound<'_, PyAny>) -> PyResult<Pixels> {
    let py = given.py();
    let wrong = |what: String| {
        let why = format!(
            "{what} is no layer: give a lamp_slicer.Layer, or an array of two dimensions of bool \
             (black and white) or uint8 (gray)"
        );
        crate::error::settings(py, why)
    };
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("ascontiguousarray", (given,))?;
    let dtype: String = array.getattr("dtype")?.str()?.extract()?;
    let shape: Vec<u64> = array.getattr("shape")?.extract()?;
    let &[height, width] = &shape[..] else {
        return Err(wrong(match given.getattr("shape") {
            Ok(shape) => format!("an array of shape {shape}"),
            Err(_) => format!("an object of type {}", given.get_type().name()?),
        }));
    };
    let is_gray = match &*dtype {
        "bool" => false,
        "uint8" => true,
        _ => return Err(wrong(format!("an array of {dtype}"))),
    };
    let most = u64::from(MAX_SIDE);
    if width > most || height > most {
        return Err(wrong(format!(
            "an array of {height} x {width}, where a side has at most {most},"
        )));
    }
    let bytes = array.call_method0("tobytes")?.cast_into::<PyBytes>()?;
    let bytes = match is_gray {
        true => bytes.as_bytes().to_vec(),
        // True is 1 in arrays that numpy makes, and anything but 0 in a view of other bytes.
        false => bytes.as_bytes().iter().map(|&byte| u8::from(byte != 0)).collect(),
    };
    Ok(Pixels { width: width as u32, height: height as u32, is_gray, bytes })
}

fn image_of(pixels: &Pixels) -> Result<Image, Error> {
    let Pixels { width, height, is_gray, ref bytes } = *pixels;
    if width == 0 || height == 0 {
        return Ok(Mask::black(width, height).into());
    }
    let too_many = |error| Error::new(lamp_pipeline::ErrorKind::Work, error);
    let rows = bytes.chunks_exact(width as usize);
    if is_gray {
        let mut image = GrayMask::new(width);
        let mut changes = Vec::new();
        for row in rows {
            changes.clear();
            changes_of(row, |column, level| changes.push(LevelChange { column, level }));
            image.push_row(&changes).map_err(too_many)?;
        }
        return Ok(image.into());
    }
    let mut image = MaskBuilder::new(width);
    let mut transitions = Vec::new();
    for row in rows {
        transitions.clear();
        changes_of(row, |column, _| transitions.push(column));
        image.push_row(&transitions).map_err(too_many)?;
    }
    Ok(image.finish().into())
}

/// Calls `change` with each column where a row's value changes, and the new value.
fn changes_of(row: &[u8], mut change: impl FnMut(u32, u8)) {
    let (mut at, mut value) = (0, 0);
    while let Some(next) = row[at..].iter().position(|&pixel| pixel != value) {
        at += next;
        value = row[at];
        change(at as u32, value);
    }
}
