//! Stacks that Python opens: their pages in any order, from several threads.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use lamp_pipeline::Error;
use lamp_stack::{IndexedStack, Layer};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::PySlice;

use crate::chain::{Chain, Source, importance_of, other_size};
use crate::error::{exception, settings};
use crate::layer::{PyDpi, PyLayer, array_of, record_of, runs_of};
use crate::layers::PyLayers;
use crate::work::{WRAPPED, warn};

/// A stack of layers, bottom first. Images are read when they are asked for.
#[pyclass(frozen, name = "Stack", module = "lamp_slicer")]
pub(crate) struct PyStack {
    path: PathBuf,
    stack: Arc<IndexedStack>,
}

impl PyStack {
    /// Returns the layers.
    pub(crate) fn chain(&self) -> Chain {
        self.pages(0..self.stack.headers().len())
    }

    /// Returns the layers of a range of pages.
    fn pages(&self, range: Range<usize>) -> Chain {
        Chain::of(Source::Opened(self.stack.clone(), self.path.clone(), range))
    }

    /// Returns the position of a page; negative ones count from the top.
    fn position(&self, index: isize) -> PyResult<usize> {
        let count = self.stack.headers().len();
        let from_top = count.checked_add_signed(index).filter(|_| index < 0);
        let position = from_top.or_else(|| usize::try_from(index).ok());
        position.filter(|&position| position < count).ok_or_else(|| {
            PyIndexError::new_err(format!("the stack has {count} layers, and none at {index}"))
        })
    }

    fn read(&self, py: Python<'_>, index: isize) -> PyResult<Layer> {
        let position = self.position(index)?;
        let layer = py.detach(|| self.stack.layer(position));
        layer
            .map_err(|error| exception(py, &Error::from(error).at(self.path.display().to_string())))
    }
}

/// Opens a stack: a TIFF, a packed stack, a picture, or a folder of pages.
#[pyfunction]
pub(crate) fn open(py: Python<'_>, path: PathBuf) -> PyResult<PyStack> {
    let name = path.display().to_string();
    let stack = py.detach(|| IndexedStack::open(&path).and_then(IndexedStack::into_whole));
    let stack = stack.map_err(|error| exception(py, &Error::from(error).at(name.clone())))?;
    for note in stack.notes() {
        warn(py, &format!("{name}: {note}"), importance_of(note), WRAPPED)?;
    }
    Ok(PyStack { path, stack: Arc::new(stack) })
}

#[pymethods]
impl PyStack {
    /// The number of layers.
    fn __len__(&self) -> usize {
        self.stack.headers().len()
    }

    /// A layer by its place from the bottom, or the layers of a range.
    fn __getitem__<'py>(&self, index: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = index.py();
        if let Ok(slice) = index.cast::<PySlice>() {
            let range = slice.indices(self.stack.headers().len() as isize)?;
            if range.step != 1 {
                return Err(settings(
                    py,
                    "a range of layers goes up one by one: leave out the step",
                ));
            }
            let (start, length) = (range.start as usize, range.slicelength);
            let layers = PyLayers::new(self.pages(start..start + length));
            return Ok(Bound::new(py, layers)?.into_any());
        }
        let layer = self.read(py, index.extract()?)?;
        Ok(Bound::new(py, PyLayer::from(layer))?.into_any())
    }

    /// The layers in order, decoded on all threads.
    fn __iter__(&self) -> PyLayers {
        PyLayers::new(self.chain())
    }

    /// The image of a layer as a new array: bool if it is black and white, uint8 if it is gray.
    fn array<'py>(&self, py: Python<'py>, index: isize) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, &self.read(py, index)?.image)
    }

    /// The image of a layer as runs, as `Layer.runs` has them.
    fn runs<'py>(&self, py: Python<'py>, index: isize) -> PyResult<Bound<'py, PyAny>> {
        runs_of(py, &self.read(py, index)?.image)
    }

    /// The metadata of a layer's page. Its image is not read.
    #[pyo3(signature = (index = 0))]
    fn info<'py>(&self, py: Python<'py>, index: isize) -> PyResult<Bound<'py, PyAny>> {
        record_of(py, &self.stack.headers()[self.position(index)?].info)
    }

    /// The resolution of the first layer in dots per inch, if it is known: two numbers, along x and
    /// y, where pixels are not square.
    #[getter]
    fn dpi(&self) -> Option<PyDpi> {
        self.stack.headers()[0].pitch.map(PyDpi::from)
    }

    /// The numbers of layers, rows and columns. Raises an error if images differ in size.
    #[getter]
    fn shape(&self, py: Python<'_>) -> PyResult<(usize, u32, u32)> {
        let headers = self.stack.headers();
        let first = headers[0].size;
        match headers.iter().find(|header| header.size != first) {
            None => Ok((headers.len(), first[1], first[0])),
            Some(other) => {
                let error = other_size(&other.info, other.size, first);
                Err(exception(py, &error.at(self.path.display().to_string())))
            }
        }
    }

    /// Whether any image is gray; otherwise all are black and white.
    #[getter]
    fn is_gray(&self) -> bool {
        self.stack.headers().iter().any(|header| header.gray)
    }

    /// The path that was opened.
    #[getter]
    fn path(&self) -> &PathBuf {
        &self.path
    }

    fn __repr__(&self) -> String {
        format!("<lamp_slicer.Stack: {}, {} layers>", self.path.display(), self.__len__())
    }
}
