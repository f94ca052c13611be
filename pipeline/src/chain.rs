//! The stages that work layer by layer, for a range of a part's layers.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use lamp_edit::EditError;
use lamp_stack::{Layer, Pages, PassingLayer, StackInfo};

use crate::compensate::{self, CompensateSettings, Compensating, is_of_stage};
use crate::dither::{self, DitherSettings};
use crate::edit::{self, EditSettings, Editing};
use crate::error::Error;
use crate::findings::RangeFindings;
use crate::fix::{self, FixSettings, Fixing};
use crate::part_file::PartFile;
use crate::slice::{self, SliceStage};
use crate::survey::Survey;
use crate::watcher::{KeptRemarks, Remark, Watcher};

/// Layers on their way from stage to stage.
type Layers<'a> = Box<dyn Iterator<Item = Result<PassingLayer, Error>> + 'a>;

/// The stages that work layer by layer: slicing, then those from layers to layers.
#[derive(Clone, Debug)]
pub struct StageChain {
    /// Slicing; its part and range are left open.
    pub slice: SliceStage,
    /// The stages after it.
    pub stages: Vec<Stage>,
}

/// A stage from layers to layers.
#[derive(Clone, Debug)]
pub enum Stage {
    /// Stray rows are corrected.
    Fix(FixSettings),
    /// Edges are moved, and images enlarged.
    Compensate(CompensateSettings),
    /// Gray becomes dots.
    Dither(DitherSettings),
    /// Layers are changed by a list, or with another stack.
    Edit(EditSettings),
}

impl Stage {
    /// Returns its options as one text, equal for all options of the same meaning.
    pub fn canonical(&self) -> String {
        match self {
            Self::Fix(settings) => settings.canonical(),
            Self::Compensate(settings) => settings.canonical(),
            Self::Dither(settings) => settings.canonical(),
            Self::Edit(settings) => settings.canonical(),
        }
    }

    /// Returns its name, and the number that changes when its bytes do.
    pub fn code(&self) -> (&'static str, u32) {
        match self {
            Self::Fix(_) => ("fix", fix::CODE),
            Self::Compensate(_) => ("compensate", compensate::CODE),
            Self::Dither(_) => ("dither", dither::CODE),
            Self::Edit(_) => ("edit", edit::CODE),
        }
    }

    /// Returns the files that it reads, including files that a list of edits names.
    pub fn input_files(&self) -> Result<Vec<PathBuf>, Error> {
        Ok(match self {
            Self::Fix(_) | Self::Dither(_) => Vec::new(),
            Self::Compensate(settings) => settings.inputs().cloned().collect(),
            Self::Edit(settings) => Editing::new(settings)?.inputs().cloned().collect(),
        })
    }

    /// Returns the number of layers on each side that it looks at.
    fn reach(&self) -> u32 {
        if matches!(self, Self::Fix(_)) { lamp_fix::FIX_REACH } else { 0 }
    }

    /// Begins the stage; `remarks` takes its remarks.
    ///
    /// # Errors
    /// Returns an error if the settings contradict each other, or a file that they name is wrong.
    pub fn start<'a>(&'a self, remarks: &'a KeptRemarks) -> Result<Working<'a>, Error> {
        Ok(match self {
            Self::Fix(settings) => Working::Fix(Fixing::new(settings)),
            Self::Compensate(settings) => Working::Compensate(Compensating::new(settings)?),
            Self::Dither(settings) => Working::Dither(settings, Box::new(remarks.of("dither"))),
            Self::Edit(settings) => Working::Edit(Editing::new(settings)?, remarks.clone()),
        })
    }
}

/// A stage at work.
pub enum Working<'a> {
    /// Correction.
    Fix(Fixing),
    /// Compensation.
    Compensate(Compensating<'a>),
    /// Dots, and what takes warnings of them.
    Dither(&'a DitherSettings, Box<dyn Watcher + 'a>),
    /// Edits, and the lines to which notes on other stacks are added.
    Edit(Editing, KeptRemarks),
}

impl Working<'_> {
    /// Returns the layers made from `layers`. Findings in layers of `range` count. `is_end` states
    /// whether the first and the last are the first and the last of the whole stack.
    ///
    /// # Errors
    /// Returns an error if another file that it needs cannot be opened.
    pub fn layers<'b>(
        &'b self,
        layers: Layers<'b>,
        range: Range<u32>,
        is_end: [bool; 2],
    ) -> Result<Layers<'b>, Error> {
        Ok(match self {
            Self::Fix(fixing) => Box::new(fixing.layers(layers, range, |_| ())),
            Self::Compensate(compensating) => {
                let decoded = layers.map(|layer| Ok(layer?.decode()?));
                let moved = compensating.layers::<Error>(decoded, range);
                Box::new(moved.map(|layer| layer.map(PassingLayer::from)))
            }
            Self::Dither(settings, watcher) => Box::new(settings.layers(layers, &**watcher)?),
            Self::Edit(editing, remarks) => {
                let noting = |pages: Pages, path: &Path| {
                    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                    let remarks = remarks.clone();
                    pages.with_listener(move |note| remarks.keep(format!("edit: {name}: {note}")))
                };
                Box::new(editing.layers(layers, range, is_end, &noting)?)
            }
        })
    }

    /// Adds the findings; `stage` is the number of this stage.
    pub fn find(&self, stage: usize, name: &str, findings: &mut RangeFindings) {
        match self {
            Self::Fix(fixing) => findings.add_fixed(&fixing.report()),
            Self::Compensate(compensating) => {
                let lines = compensating.lines(name).into_iter();
                findings.of_range.extend(lines.map(|line| format!("compensate: {line}")));
            }
            Self::Dither(..) => {}
            Self::Edit(editing, _) => {
                for count in editing.counts().iter().filter(|count| count.pixels == 0) {
                    findings.unchanged_edits.insert((stage, count.edit));
                    if count.layers == 0 {
                        findings.unused_edits.insert((stage, count.edit));
                    }
                }
            }
        }
    }
}

impl StageChain {
    /// Returns the options that matter to bytes, a text for each stage. Equal texts, with equal
    /// input files and the same code, give equal bytes of the same part.
    pub fn canonical(&self) -> Vec<String> {
        let stages = self.stages.iter().map(Stage::canonical);
        [self.slice.canonical()].into_iter().chain(stages).collect()
    }

    /// Returns the files that options name, in the order of the stages.
    ///
    /// # Errors
    /// Returns an error if a list of edits cannot be read.
    pub fn input_files(&self) -> Result<Vec<PathBuf>, Error> {
        let mut files: Vec<_> = self.slice.clone().named_mut().map(|path| path.clone()).collect();
        for stage in &self.stages {
            files.extend(stage.input_files()?);
        }
        Ok(files)
    }

    /// Returns the stages' names, each with the number that changes when its bytes do.
    pub fn code(&self) -> Vec<(&'static str, u32)> {
        let stages = self.stages.iter().map(Stage::code);
        [("slice", slice::CODE)].into_iter().chain(stages).collect()
    }

    /// Reads the part once, for an estimate of the work.
    ///
    /// # Errors
    /// Returns the error with which slicing would begin.
    pub fn survey(&self, part: &Path) -> Result<Survey, Error> {
        let begun = Instant::now();
        let settings = self.settings(part, None);
        // The survey's remarks are dropped: each range makes them again.
        let slicing = settings.open(None, &KeptRemarks::default().of("slice"))?;
        slicing.with_slices(|slices| Ok(Survey::of(slices, self, begun)))
    }

    fn settings(&self, part: &Path, layers: Option<Range<u32>>) -> SliceStage {
        let mut settings = self.slice.clone();
        // A part of a night is one file at its own coordinates.
        settings.parts = vec![PartFile { path: part.to_owned(), placement: None }];
        settings.layers = layers;
        settings
    }

    /// Makes the layers of a range, and gives them to `write`. Also makes the layers around it that
    /// stages look at. A stack records `name` as the name of the part's file.
    ///
    /// # Errors
    /// Returns the first error of a stage or of `write`.
    pub fn run<E: From<Error>>(
        &self,
        part: &Path,
        name: &str,
        range: Range<u32>,
        write: impl FnOnce(&mut dyn Iterator<Item = Result<Layer, Error>>) -> Result<(), E>,
    ) -> Result<RangeFindings, E> {
        let remarks = KeptRemarks::default();
        // A stage needs finished layers of the stage before around its own, so reaches add up.
        let reach: u32 = self.stages.iter().map(Stage::reach).sum();
        let around = range.start.saturating_sub(reach)..range.end.saturating_add(reach);
        let settings = self.settings(part, Some(around.clone()));
        let watcher = remarks.of("slice");
        let slicing = settings.open(Some(name), &watcher)?;
        let doubts = slicing.doubts().into_iter().map(Remark::note);
        doubts.for_each(|doubt| watcher.remark(doubt));
        let working = self.stages.iter().map(|stage| stage.start(&remarks));
        let working = working.collect::<Result<Vec<_>, _>>()?;
        // Beyond the ends of a range other layers follow, so another stack may go on there.
        let is_end = [around.start == 0, around.end >= slicing.part_layers()];
        let sliced = slicing.layers(range.clone(), |_| ());
        let mut layers: Layers<'_> = Box::new(sliced.map(|layer| layer.map(PassingLayer::from)));
        for stage in &working {
            layers = stage.layers(layers, range.clone(), is_end)?;
        }
        let decoded = layers.map(|layer| Ok(layer?.decode()?));
        let named =
            decoded.map(|layer: Result<Layer, Error>| layer.map_err(|error| named(error, part)));
        write(&mut only(named, range.clone()))?;
        let mut findings = RangeFindings::new(slicing.counts(), slicing.is_blank());
        findings.of_range.extend(slicing.remarks().iter().map(|line| format!("slice: {line}")));
        for (stage, working) in (1..).zip(&working) {
            working.find(stage, name, &mut findings);
        }
        // After the work: stages add remarks while layers pass.
        findings.of_part = remarks.take();
        Ok(findings.of(&(range.start..range.end.min(slicing.part_layers()))))
    }
}

/// Passes on the layers of a range. The first one gets the first page's record of the stack.
fn only(
    layers: impl Iterator<Item = Result<Layer, Error>>,
    range: Range<u32>,
) -> impl Iterator<Item = Result<Layer, Error>> {
    let mut stack: Option<StackInfo> = None;
    layers.filter_map(move |layer| {
        let mut layer = match layer {
            Ok(layer) => layer,
            Err(error) => return Some(Err(error)),
        };
        let index = layer.info.index;
        // A layer outside the range may carry the record: it moves to the first layer within.
        let of_page = layer.info.stack.take().map(|stack| stack.of_range(index, &range));
        stack = of_page.or(stack.take());
        range.contains(&index).then(|| {
            layer.info.stack = stack.take();
            Ok(layer)
        })
    })
}

/// Names the part in a stage's error that does not name it.
pub fn named(error: Error, part: &Path) -> Error {
    let is_of_edit = error.cause::<EditError>().is_some();
    if is_of_edit || is_of_stage(&error) { error.at(part.display().to_string()) } else { error }
}
