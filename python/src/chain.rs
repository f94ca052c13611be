//! Chains of stages in one process: a source of layers, and the stages after it.

use std::fs::File;
use std::io::Seek;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lamp_pipeline::documents::input_name;
use lamp_pipeline::watcher::{Importance, KeptRemarks, Remark};
use lamp_pipeline::{Error, Stage, Working, named};
use lamp_stack::{
    IndexedStack, Layer, Page, PageFault, PageInfo, Pages, PassingLayer, Pitch, StackError,
    StackInfo, StackNote, map_in_order,
};
use pyo3::prelude::*;
use serde_json::{Value, json};

use crate::error::{raised, stopped};
use crate::layer::layer_of;
use crate::plan::PlanSource;
use crate::slice::PartSource;
use crate::tile::BuildSource;
use crate::work::{Flow, Work};

/// A source of layers.
pub(crate) enum Source {
    /// The path of a stack.
    Stack(PathBuf),
    /// Pages of a stack that is open, counted from its bottom.
    Opened(Arc<IndexedStack>, PathBuf, Range<usize>),
    /// A stack that is kept in a temporary file, and the name of what it was.
    Kept(File, String),
    /// A part, which is sliced.
    Part(Box<PartSource>),
    /// A build of other chains.
    Build(Box<BuildSource>),
    /// Layers for which times or levels are planned.
    Plan(Box<PlanSource>),
    /// Layers or arrays that Python code gives.
    Given(GivenLayers),
}

/// An iterator of Python over layers or arrays, and what arrays get as their metadata.
pub(crate) struct GivenLayers {
    pub(crate) iterator: Py<PyAny>,
    pub(crate) pitch: Option<Pitch>,
    pub(crate) thickness_um: Option<f64>,
    pub(crate) part: Option<String>,
}

/// A source of layers, and the stages after it.
pub(crate) struct Chain {
    pub(crate) source: Source,
    pub(crate) stages: Vec<Stage>,
}

impl Chain {
    /// Returns layers as they come.
    pub(crate) fn of(source: Source) -> Self {
        Self { source, stages: Vec::new() }
    }

    /// Returns the name of the source, for messages.
    pub(crate) fn name(&self) -> String {
        match &self.source {
            Source::Stack(path) | Source::Opened(_, path, _) => input_name(path),
            Source::Kept(_, name) => name.clone(),
            Source::Part(part) => part.name(),
            Source::Build(_) => "the build".to_owned(),
            Source::Plan(plan) => plan.name(),
            Source::Given(_) => "the layers".to_owned(),
        }
    }

    /// Returns the stages as words of a command.
    pub(crate) fn words(&self) -> String {
        let source = match &self.source {
            Source::Stack(path) => input_name(path),
            Source::Opened(stack, path, pages) if *pages == (0..stack.headers().len()) => {
                input_name(path)
            }
            Source::Opened(_, path, Range { start, end }) => {
                format!("{}[{start}:{end}]", path.display())
            }
            Source::Kept(_, name) => name.clone(),
            Source::Part(part) => part.words(),
            Source::Build(build) => build.words(),
            Source::Plan(plan) => plan.words(),
            Source::Given(_) => "layers".to_owned(),
        };
        let stages = self.stages.iter().map(Stage::canonical);
        [source].into_iter().chain(stages).collect::<Vec<_>>().join(" | ")
    }

    /// Makes the layers, and gives them to `then`, as pages have them unless they are wanted
    /// `decoded`. Returns what the source and each stage report.
    pub(crate) fn run(
        self,
        work: &Work,
        decoded: bool,
        then: &mut dyn FnMut(Flow<'_>) -> Result<(), Error>,
    ) -> Result<Vec<Value>, Error> {
        let name = self.name();
        let Self { source, stages } = self;
        let source_decoded = decoded && stages.is_empty();
        let mut reports = Vec::new();
        let of_source = source.run(work, source_decoded, &mut |layers| {
            let remarks = KeptRemarks::default();
            let working = stages.iter().map(|stage| stage.start(&remarks));
            let working = working.collect::<Result<Vec<Working<'_>>, _>>()?;
            let mut layers: Flow<'_> = work.watched(layers);
            let mut count = 0;
            if !stages.is_empty() {
                layers = Box::new(layers.inspect(|_| count += 1));
            }
            for stage in &working {
                layers = stage.layers(layers, 0..u32::MAX, [true, true])?;
            }
            if !stages.is_empty() {
                layers = Box::new(layers.inspect(|_| say_all(work, &remarks)));
                if decoded {
                    layers = decode(layers);
                }
                layers = Box::new(
                    layers.map(|layer| layer.map_err(|error| named(error, Path::new(&name)))),
                );
            }
            then(layers)?;
            say_all(work, &remarks);
            reports.extend(working.iter().map(|stage| report_of(stage, work, &name, count)));
            Ok(())
        })?;
        Ok(of_source.into_iter().chain(reports).collect())
    }

    /// Returns the chain twice, the first to be run before the second. Layers that come once are
    /// kept in a temporary file; then their reports come, too.
    pub(crate) fn twice(self, work: &Work) -> Result<(Self, Self, Vec<Value>), Error> {
        let again = match (&self.source, self.stages.is_empty()) {
            (Source::Stack(path), true) => Source::Stack(path.clone()),
            (Source::Opened(stack, path, pages), true) => {
                Source::Opened(stack.clone(), path.clone(), pages.clone())
            }
            _ => {
                let name = self.name();
                let (file, reports) = self.kept(work)?;
                let first = Source::Kept(file.try_clone()?, name.clone());
                let again = Source::Kept(file, name);
                return Ok((Self::of(first), Self::of(again), reports));
            }
        };
        Ok((self, Self::of(again), Vec::new()))
    }

    /// Keeps the layers in a temporary file.
    fn kept(self, work: &Work) -> Result<(File, Vec<Value>), Error> {
        let file = tempfile::tempfile()?;
        let to = file.try_clone()?;
        let mut to = Some(lamp_stack::Destination::Stream(Box::new(to)));
        let reports = self.run(work, false, &mut |layers| {
            let to = to.take().ok_or_else(stopped)?;
            lamp_stack::write_stack(layers, to, lamp_stack::Format::Big)
        })?;
        Ok((file, reports))
    }
}

fn say_all(work: &Work, remarks: &KeptRemarks) {
    remarks.take().into_iter().for_each(|line| work.say_line(line, Importance::Note));
}

/// Says what a stage found, and returns it as the program's report has it.
fn report_of(stage: &Working<'_>, work: &Work, name: &str, layers: usize) -> Value {
    let with = |stage: &str, head: Value, list: &str, items: Value| {
        let mut report = json!({ "stage": stage });
        if let (Value::Object(report), Value::Object(head)) = (&mut report, head) {
            report.extend(head);
            report.insert(list.to_owned(), items);
        }
        report
    };
    match stage {
        Working::Fix(fixing) => {
            let found = fixing.report();
            let corrected = found.text_of_corrected().map(Remark::note);
            let left = found.text_of_left().map(Remark::warning);
            corrected.into_iter().chain(left).for_each(|remark| work.say("fix", remark));
            with("fix", json!(found.head(layers)), "bands", json!(found.bands()))
        }
        Working::Compensate(compensating) => {
            for line in compensating.lines(name) {
                work.say("compensate", Remark::note(line));
            }
            let (walls, layers) = compensating.report();
            let (head, listed) = (walls.head(layers), walls.listed());
            with("compensate", json!(head), "walls", json!(listed))
        }
        Working::Dither(settings, _) => {
            json!({ "stage": "dither", "method": settings.method.name() })
        }
        Working::Edit(editing, _) => {
            let counts = editing.counts();
            let unused = counts.iter().filter(|count| count.layers == 0).map(|count| count.edit);
            json!({ "stage": "edit", "unused": unused.collect::<Vec<_>>(), "edits": counts })
        }
    }
}

/// Decodes layers on all threads.
pub(crate) fn decode(layers: Flow<'_>) -> Flow<'_> {
    Box::new(map_in_order(layers, |layer: PassingLayer| Ok(layer.decode()?.into())))
}

impl Source {
    fn run(
        self,
        work: &Work,
        decoded: bool,
        then: &mut dyn FnMut(Flow<'_>) -> Result<(), Error>,
    ) -> Result<Vec<Value>, Error> {
        match self {
            Self::Stack(path) => {
                let name = input_name(&path);
                let pages = Pages::open(&path).map_err(|error| at(&name, error))?;
                then(stack_layers(pages, &name, work, decoded))?;
                Ok(Vec::new())
            }
            Self::Opened(stack, path, range) => {
                then(some_layers(&stack, range, &input_name(&path), decoded))?;
                Ok(Vec::new())
            }
            Self::Kept(mut file, name) => {
                // A clone of it may have been read, and shares its position.
                file.rewind()?;
                let pages = Pages::from_file(file).map_err(|error| at(&name, error))?;
                then(stack_layers(pages, &name, work, decoded))?;
                Ok(Vec::new())
            }
            Self::Part(part) => part.run(work, then),
            Self::Build(build) => build.run(work, then),
            Self::Plan(plan) => plan.run(work, then),
            Self::Given(given) => {
                then(given.layers())?;
                Ok(Vec::new())
            }
        }
    }
}

fn at(name: &str, error: StackError) -> Error {
    Error::from(error).at(name)
}

/// Returns how much a note on a stack matters.
pub(crate) fn importance_of(note: &StackNote) -> Importance {
    if note.is_doubt() { Importance::Warning } else { Importance::Note }
}

/// Returns the layers of a stack, and has its notes said as they are found.
fn stack_layers<'a>(pages: Pages, name: &'a str, work: &Work, decoded: bool) -> Flow<'a> {
    let (listener, place) = (work.clone(), name.to_owned());
    let pages = pages.with_listener(move |note| {
        listener.say_line(format!("{place}: {note}"), importance_of(&note));
    });
    let pages = pages.map(move |page| page.map_err(|error| at(name, error)));
    Box::new(map_in_order(pages, move |page: Page| passing(page, name, decoded)))
}

/// Returns some layers of a stack. The first one gets the record of the stack.
fn some_layers<'a>(
    stack: &'a IndexedStack,
    range: Range<usize>,
    name: &'a str,
    decoded: bool,
) -> Flow<'a> {
    let headers = stack.headers();
    let record = headers.first().and_then(|first| {
        let of_stack: StackInfo = first.info.stack.clone()?;
        let wanted = headers.get(range.clone())?;
        let (from, to) = (wanted.first()?.info.index, wanted.last()?.info.index);
        Some(of_stack.of_range(first.info.index, &(from..to.saturating_add(1))))
    });
    let start = range.start;
    let pages = range.map(move |position| {
        let page = stack.page(position).map_err(|error| at(name, error))?;
        Ok((page, position))
    });
    Box::new(map_in_order(pages, move |(page, position): (Page, _)| {
        let mut layer = passing(page, name, decoded)?;
        layer.info_mut().stack = if position == start { record.clone() } else { None };
        Ok(layer)
    }))
}

fn passing(page: Page, name: &str, decoded: bool) -> Result<PassingLayer, Error> {
    let layer = match decoded {
        true => page.decode().map(PassingLayer::from),
        false => PassingLayer::of_page(page, name),
    };
    layer.map_err(|error| at(name, error))
}

impl GivenLayers {
    /// Returns what Python gives, a layer at a time, each under Python's lock.
    fn layers(self) -> Flow<'static> {
        let mut count = 0;
        let mut ended = false;
        let mut order = GivenOrder::default();
        Box::new(std::iter::from_fn(move || {
            if ended {
                return None;
            }
            // None once Python ends.
            let next = Python::try_attach(|py| self.next(py, count));
            let next = next.unwrap_or_else(|| Some(Err(stopped())));
            let next = next.map(|layer| {
                let layer = layer?;
                order.check(&layer, count)?;
                Ok(layer.into())
            });
            count += 1;
            ended = !matches!(next, Some(Ok(_)));
            next
        }))
    }

    fn next(&self, py: Python<'_>, count: u32) -> Option<Result<Layer, Error>> {
        let mut iterator = match self.iterator.bind(py).try_iter() {
            Ok(iterator) => iterator,
            Err(error) => return Some(Err(raised(error))),
        };
        let layer = iterator.next()?.and_then(|given| self.layer(&given, count));
        Some(layer.map_err(raised))
    }

    fn layer(&self, given: &Bound<'_, PyAny>, count: u32) -> PyResult<Layer> {
        let info = || PageInfo {
            index: count,
            z_um: self.thickness_um.map(|um| um * f64::from(count)),
            thickness_um: self.thickness_um,
            stack: self
                .part
                .clone()
                .filter(|_| count == 0)
                .map(|part| StackInfo { part, ..StackInfo::default() }),
            ..PageInfo::default()
        };
        layer_of(given, info, self.pitch)
    }
}

/// The order and size of the layers that were given. Readers of a stack refuse others.
#[derive(Default)]
struct GivenOrder {
    last: Option<u32>,
    first_size: Option<[u32; 2]>,
}

impl GivenOrder {
    /// Checks that a layer, which is `page` of those given, makes a stack with the ones before it.
    fn check(&mut self, layer: &Layer, page: u32) -> Result<(), Error> {
        let index = layer.info.index;
        if let Some(before) = self.last.replace(index).filter(|&before| index <= before) {
            return Err(StackError::Order { layer: index, before }.into());
        }
        let size = [layer.image.width(), layer.image.height()];
        if size.contains(&0) {
            return Err(StackError::Malformed { page, fault: PageFault::Side(0) }.into());
        }
        let first = *self.first_size.get_or_insert(size);
        if size == first { Ok(()) } else { Err(other_size(&layer.info, size, first)) }
    }
}

/// Returns the error of a layer whose width and height differ from the first layer's.
pub(crate) fn other_size(layer: &PageInfo, size: [u32; 2], first: [u32; 2]) -> Error {
    let ([width, height], [first_width, first_height]) = (size, first);
    Error::work(format!(
        "{} has {width} x {height} pixels, and the first layer has {first_width} x {first_height}",
        layer.name()
    ))
}
