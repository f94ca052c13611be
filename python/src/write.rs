//! Writes layers as stacks.

use std::path::{Path, PathBuf};

use lamp_pipeline::Error;
use lamp_stack::{
    Destination, FolderBeside, Format, PackLevel, PassingLayer, StackError, StackInfo,
    map_in_order, write_packed, write_stack,
};
use pyo3::prelude::*;

use crate::error::{settings, stopped};
use crate::layer::record_of;
use crate::layers::{chain_of, given_layers};
use crate::work::{Flow, Running};

/// The form of a stack.
#[derive(Clone, Copy)]
enum Kind {
    Tiff,
    Packed,
    Folder,
}

/// Writes layers as a stack: a TIFF, a packed stack or a folder of pages. Returns what the stages
/// report.
#[pyfunction]
#[pyo3(signature = (path, layers, *, dpi, thickness, name, classic, force))]
#[expect(clippy::too_many_arguments, reason = "each is a keyword")]
pub(crate) fn write<'py>(
    py: Python<'py>,
    path: PathBuf,
    layers: &Bound<'_, PyAny>,
    dpi: Option<&Bound<'_, PyAny>>,
    thickness: Option<&str>,
    name: Option<String>,
    classic: bool,
    force: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let is_for_arrays = dpi.is_some() || thickness.is_some() || name.is_some();
    let chain = match is_for_arrays {
        true => given_layers(layers, dpi, thickness, name)?,
        false => chain_of(layers)?,
    };
    let kind = kind_of(&path).map_err(|why| settings(py, why))?;
    let format = if classic { Format::Classic } else { Format::Big };
    let running = Running::start(move |work| {
        let failed = |error| at_output(error, &path);
        let mut to = Some(destination(&path, kind, force).map_err(failed)?);
        let reports = chain.run(work, false, &mut |layers| {
            let to = to.take().ok_or_else(stopped)?;
            written(layers, to, kind, format).map_err(failed)
        })?;
        Ok(reports.into())
    })?;
    record_of(py, &running.finish(py)?)
}

fn kind_of(path: &Path) -> Result<Kind, String> {
    if path.as_os_str().as_encoded_bytes().ends_with(b"/") || path.is_dir() {
        return Ok(Kind::Folder);
    }
    match path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase().as_str() {
        "tif" | "tiff" => Ok(Kind::Tiff),
        "lamp" => Ok(Kind::Packed),
        _ => Err(format!(
            "{}: a stack is a TIFF, a packed stack or a folder: end its name in .tif, .lamp or /",
            path.display()
        )),
    }
}

fn destination(path: &Path, kind: Kind, force: bool) -> Result<Destination, Error> {
    Ok(match kind {
        Kind::Folder if force => Destination::Folder(FolderBeside::replacing(path)?),
        Kind::Folder => Destination::Folder(FolderBeside::over_nothing(path)?),
        Kind::Tiff | Kind::Packed => Destination::File(path.to_owned()),
    })
}

fn written(layers: Flow<'_>, to: Destination, kind: Kind, format: Format) -> Result<(), Error> {
    match kind {
        Kind::Packed => {
            let layers = map_in_order(layers, |layer: PassingLayer| Ok(layer.decode()?));
            write_packed(layers, to, format, PackLevel::default())
        }
        Kind::Tiff => write_stack(layers, to, format),
        Kind::Folder => write_stack(in_folder(layers), to, format),
    }
}

/// Returns layers as readers of a folder want them: the first has the record of the stack, and
/// indices have no gap, which would be a lost file.
fn in_folder(layers: Flow<'_>) -> Flow<'_> {
    let mut last = None;
    Box::new(layers.map(move |layer| {
        let mut layer = layer?;
        let info = layer.info_mut();
        match last.replace(info.index) {
            None if info.z_um.is_some() && info.stack.is_none() => {
                info.stack = Some(StackInfo::default());
            }
            Some(before) if u32::checked_add(before, 1) != Some(info.index) => {
                return Err(StackError::MissingPage { layer: info.index }.into());
            }
            _ => {}
        }
        Ok(layer)
    }))
}

/// Names the output in an error that has no place yet, as errors of inputs have.
fn at_output(error: Error, path: &Path) -> Error {
    let kind = error.kind();
    let (cause, places) = error.into_parts();
    let is_bare = places.is_empty();
    let error = places.into_iter().fold(Error::new(kind, cause), Error::at);
    if is_bare { error.at(path.display().to_string()) } else { error }
}
