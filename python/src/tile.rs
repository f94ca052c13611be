//! Builds: copies of parts on a machine's area.

use std::cell::RefCell;
use std::fmt;
use std::path::Path;
use std::vec;

use lamp_build::{
    BuildFinding, BuildWanted, Layout, LayoutFile, MeshOptions, MeshPattern, PartStack,
};
use lamp_grayscale::{DitherMethod, dither_image};
use lamp_machine::Machine;
use lamp_pipeline::build_findings::{
    NoMesh, StrayTotals, describe_stray, left_over, within_height,
};
use lamp_pipeline::documents::{document_and_word, read_text};
use lamp_pipeline::tile::TileSettings;
use lamp_pipeline::watcher::{Importance, Remark};
use lamp_pipeline::{Error, ErrorKind};
use lamp_stack::{Image, IndexedStack, Layer, PassingLayer, StackError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use serde_json::{Value, json};

use crate::chain::{Chain, Source};
use crate::error::{settings as wrong, stopped};
use crate::layers::{PyLayers, chain_of};
use crate::settings::{given, settings};
use crate::work::{Flow, Work};

/// Parts with the number of copies of each, and how they are laid out.
pub(crate) struct BuildSource {
    parts: Vec<(Chain, Option<u32>)>,
    settings: TileSettings,
}

/// Lays out copies: of layers, or of a list of layers or `(layers, copies)`.
#[pyfunction]
pub(crate) fn tile(parts: &Bound<'_, PyAny>, keywords: &Bound<'_, PyDict>) -> PyResult<PyLayers> {
    let py = parts.py();
    let mut given = given(keywords)?;
    // Settings have square millimeters, without the unit.
    if let Some(Value::String(area)) = given.get_mut("least-piece")
        && let Some(number) = area.strip_suffix("mm2")
    {
        *area = number.trim_end().to_owned();
    }
    let settings: TileSettings = settings(py, &given, |key, text| match key {
        "copies" if text.parse::<u32>().is_err() => Err(no_count(text)),
        _ => Ok(()),
    })?;
    let part = |part: Bound<'_, PyAny>| -> PyResult<(Chain, Option<u32>)> {
        if part.is_instance_of::<PyTuple>() {
            let pair = part.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>();
            let (layers, copies) = pair.map_err(|_| {
                wrong(py, format!("{part} is no part: give layers, or (layers, copies)"))
            })?;
            let count = copies.extract::<u32>();
            let count = count.map_err(|_| wrong(py, format!("copies: {}", no_count(&copies))))?;
            return Ok((chain_of(&layers)?, Some(count)));
        }
        Ok((chain_of(&part)?, None))
    };
    let parts = match parts.cast::<PyList>() {
        Ok(parts) => parts.iter().map(part).collect::<PyResult<Vec<_>>>()?,
        Err(_) => vec![part(parts.clone())?],
    };
    let counts = parts.iter().map(|(_, copies)| *copies).chain([settings.copies]);
    if parts.is_empty() || counts.into_iter().any(|copies| copies == Some(0)) {
        return Err(wrong(py, "give a part, and one copy of it or more"));
    }
    if let Some(turns) = settings.free_turns() {
        let why = format!(
            "turns: {turns} takes stacks that are yet to be sliced: run lamp tile by hand for it"
        );
        return Err(wrong(py, why));
    }
    Ok(PyLayers::new(Chain::of(Source::Build(Box::new(BuildSource { parts, settings })))))
}

fn no_count(given: impl fmt::Display) -> String {
    format!("{given} is no number of copies: give a whole number from 1")
}

/// A layout takes a line for each copy.
const MAX_LAYOUT_BYTES: u64 = 64 << 20;

/// A build as it is laid out before its parts come.
struct Plan {
    settings: TileSettings,
    machine: Option<Machine>,
    mesh: Option<MeshOptions>,
    file: Option<LayoutFile>,
    names: Vec<String>,
    counts: Vec<Option<u32>>,
}

impl BuildSource {
    /// Returns the stage as words of a command.
    pub(crate) fn words(&self) -> String {
        let parts = self.parts.iter().map(|(chain, _)| chain.words());
        format!("{} | {}", parts.collect::<Vec<_>>().join(" + "), self.settings.canonical())
    }

    /// Makes the layers of the build.
    pub(crate) fn run(
        self,
        work: &Work,
        then: &mut dyn FnMut(Flow<'_>) -> Result<(), Error>,
    ) -> Result<Vec<Value>, Error> {
        let Self { parts, settings } = self;
        let (mut chains, counts): (Vec<Chain>, Vec<_>) = parts.into_iter().unzip();
        settings.mesh.check()?;
        let plan = Plan {
            machine: settings.machine()?,
            mesh: settings.mesh.options(template)?,
            file: settings.layout.as_deref().map(read_layout).transpose()?,
            names: chains.iter().map(Chain::name).collect(),
            counts: counts.into_iter().map(|copies| copies.or(settings.copies)).collect(),
            settings,
        };
        let mut reports = Vec::new();
        let mut outlines = Vec::new();
        if plan.settings.needs_outlines() {
            let mut kept = Vec::new();
            for (chain, name) in chains.into_iter().zip(&plan.names) {
                let (part, chain) = outlined(chain, name, work, &mut reports)?;
                outlines.push(part);
                kept.push(chain);
            }
            chains = kept;
        }
        let mut outlines = Some(outlines);
        let mut report = Value::Null;
        let of_parts = with_all(chains.into_iter(), Vec::new(), work, &mut |flows| {
            let outlines = outlines.take().ok_or_else(stopped)?;
            report = plan.build(flows, outlines, work, then)?;
            Ok(())
        })?;
        reports.extend(of_parts);
        reports.push(report);
        Ok(reports)
    }
}

/// Runs all chains together, and gives the layers of each to `then`.
fn with_all<'a>(
    mut chains: vec::IntoIter<Chain>,
    flows: Vec<Flow<'a>>,
    work: &Work,
    then: &mut dyn FnMut(Vec<Flow<'_>>) -> Result<(), Error>,
) -> Result<Vec<Value>, Error> {
    let Some(chain) = chains.next() else {
        then(flows)?;
        return Ok(Vec::new());
    };
    let (mut state, mut of_others) = (Some((chains, flows)), Vec::new());
    // Within the run of one chain, for its layers borrow from it.
    let mut reports = chain.run(work, true, &mut |flow| {
        let (chains, mut flows) = state.take().ok_or_else(stopped)?;
        flows.push(flow);
        of_others = with_all(chains, flows, work, then)?;
        Ok(())
    })?;
    reports.append(&mut of_others);
    Ok(reports)
}

/// Reads a chain for the outline of its part. Layers that come once are kept, to come again.
fn outlined(
    chain: Chain,
    name: &str,
    work: &Work,
    reports: &mut Vec<Value>,
) -> Result<(PartStack, Chain), Error> {
    let (chain, again, of_chain) = chain.twice(work)?;
    reports.extend(of_chain);
    let mut part = None;
    chain.run(work, true, &mut |flow| {
        let layers = flow.map(|layer| Ok(layer?.decode()?));
        part = PartStack::of_outline::<Error>(name, layers)?;
        Ok(())
    })?;
    Ok((part.ok_or_else(|| no_layers(name))?, again))
}

fn no_layers(name: &str) -> Error {
    Error::from(StackError::NoLayers).at(name)
}

impl Plan {
    /// Lays the copies out, gives the layers of the build to `then`, and returns the report.
    fn build(
        &self,
        flows: Vec<Flow<'_>>,
        outlines: Vec<PartStack>,
        work: &Work,
        then: &mut dyn FnMut(Flow<'_>) -> Result<(), Error>,
    ) -> Result<Value, Error> {
        let mut stacks: Vec<_> = flows
            .into_iter()
            .zip(&self.names)
            .map(|(flow, name)| self.checked(flow, name).peekable())
            .collect();
        let mut parts = outlines;
        if parts.is_empty() {
            for (stack, name) in stacks.iter_mut().zip(&self.names) {
                let first = match stack.peek() {
                    Some(Ok(first)) => first,
                    // The error itself comes with the layer.
                    Some(Err(_)) => {
                        return Err(stack.next().and_then(Result::err).unwrap_or_else(stopped));
                    }
                    None => return Err(no_layers(name)),
                };
                parts.push(PartStack::of_image(name, first)?);
            }
        }
        let placed = self.placed(parts, work)?;
        let layout = match &self.mesh {
            Some(mesh) => placed.clone().with_mesh(mesh)?,
            None => placed.clone(),
        };
        let (stray, bare) = (RefCell::new(StrayTotals::default()), RefCell::new(NoMesh::default()));
        let wanted = BuildWanted { images: true, areas: false };
        let heights = self.settings.heights();
        let build = layout.build_telling(stacks, heights, wanted, |finding| match finding {
            BuildFinding::Stray(rows) => {
                let importance = Importance::Detail;
                work.say("tile", Remark { importance, text: describe_stray(&rows) });
                stray.borrow_mut().add(&rows);
            }
            BuildFinding::NoMesh(layer) => bare.borrow_mut().add(layer),
            BuildFinding::Loose(_) | BuildFinding::Areas(_) => {}
        });
        let build = within_height(build, self.machine.clone());
        then(Box::new(build.map(|layer| layer.map(PassingLayer::from))))?;
        let texts = [stray.borrow().text(), bare.borrow().text()];
        texts.into_iter().flatten().for_each(|text| work.say("tile", Remark::warning(text)));
        let file = placed.to_file().to_json();
        let places = serde_json::from_str::<Value>(&file).unwrap_or_default();
        Ok(json!({ "stage": "tile", "layout": places }))
    }

    /// Returns the layers of a part, each as the machine builds it.
    fn checked<'a>(
        &'a self,
        flow: Flow<'a>,
        name: &'a str,
    ) -> impl Iterator<Item = Result<Layer, Error>> + 'a {
        flow.map(move |layer| {
            let layer = layer?.decode()?;
            if let Some(machine) = &self.machine {
                machine.check(&layer).map_err(|limit| Error::from(limit).at(name))?;
            }
            Ok(layer)
        })
    }

    fn placed(&self, parts: Vec<PartStack>, work: &Work) -> Result<Layout, Error> {
        let Self { settings, machine, mesh, file, counts, .. } = self;
        let area = settings.area_of(file.as_ref(), machine.as_ref());
        let placed = match file {
            Some(file) => {
                let name = settings.layout.as_deref().unwrap_or(Path::new("")).display();
                let placed = file.place(parts, area);
                placed.map_err(|error| Error::new(ErrorKind::Work, error).at(name.to_string()))?
            }
            None => {
                let gap = settings.gap_of(mesh.as_ref());
                Layout::packed(parts, counts, area, gap, settings.packing())?
            }
        };
        let of_parts = placed.parts().iter().enumerate();
        let of_parts =
            of_parts.map(|(part, stack)| (stack.name().to_owned(), placed.copies_of(part)));
        let of_parts: Vec<_> = of_parts.collect();
        if file.is_none()
            && !settings.shares
            && let Some(text) = left_over(&of_parts, counts)
        {
            work.say("tile", Remark::warning(text));
        }
        Ok(match &settings.machine {
            Some(machine) => placed.for_machine(&document_and_word::<Machine>(machine)?.1),
            None => placed,
        })
    }
}

fn read_layout(path: &Path) -> Result<LayoutFile, Error> {
    let text = read_text(path, MAX_LAYOUT_BYTES, "a layout");
    let at = |error: Error| error.at(path.display().to_string());
    let text = text.map_err(at)?;
    LayoutFile::from_json(&text).map_err(|error| at(Error::new(ErrorKind::Work, error)))
}

/// Reads the first image of a file; a gray one becomes white where it is at least half as bright as
/// white.
fn template(path: &Path) -> Result<MeshPattern, Error> {
    let place = path.display().to_string();
    if !path.exists() {
        return Err(Error::settings(format!(
            "mesh {place}: there is no such image: write hexagon, square, none, or the name of an \
             image file"
        )));
    }
    let first = IndexedStack::open(path).and_then(|stack| stack.layer(0));
    let layer = first.map_err(|error| Error::from(error).at(place.clone()))?;
    let image = match layer.image.into_image() {
        Image::Mask(image) => image,
        Image::Gray(gray) => dither_image(&gray, DitherMethod::Threshold, 0)
            .map_err(|error| Error::from(error).at(place))?,
    };
    // Without blanks, as the stack's commands are words.
    let name = path.file_name().unwrap_or_default().to_string_lossy().replace(' ', "_");
    Ok(MeshPattern::Image { name, image })
}
