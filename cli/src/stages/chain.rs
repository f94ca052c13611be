//! The stages that work layer by layer, for a range of a part's layers.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use lamp_postprocess::EditError;
use lamp_stack::{Layer, StackInfo};

use super::compensate::{CompensateSettings, Compensating, is_of_stage};
use super::dither::DitherSettings;
use super::edit::{EditSettings, Editing};
use super::findings::RangeFindings;
use super::fix::{FixSettings, Fixing};
use super::slice::SliceSettings;
use super::survey::Survey;
use super::{Layers, compensate, dither, edit, fix, slice};
use crate::exit::Exit;
use crate::part_arg::PartArg;
use crate::progress::{Notes, Progress};

/// The stages that work layer by layer: slicing, then those from layers to layers.
#[derive(Clone)]
pub(crate) struct Chain {
    pub(super) slice: SliceSettings,
    pub(super) stages: Vec<Stage>,
}

/// A stage from layers to layers.
#[derive(Clone)]
pub(crate) enum Stage {
    Fix(FixSettings),
    Compensate(CompensateSettings),
    Dither(DitherSettings),
    Edit(EditSettings),
}

impl Stage {
    /// Returns its options as one text, the same for all that mean the same.
    pub(crate) fn canonical(&self) -> String {
        match self {
            Self::Fix(settings) => settings.canonical(),
            Self::Compensate(settings) => settings.canonical(),
            Self::Dither(settings) => settings.canonical(),
            Self::Edit(settings) => settings.canonical(),
        }
    }

    /// Returns its name, and the number that changes when its bytes do.
    pub(crate) fn code(&self) -> (&'static str, u32) {
        match self {
            Self::Fix(_) => ("fix", fix::CODE),
            Self::Compensate(_) => ("compensate", compensate::CODE),
            Self::Dither(_) => ("dither", dither::CODE),
            Self::Edit(_) => ("edit", edit::CODE),
        }
    }

    /// Returns the files that it reads, also those that a list of edits names.
    pub(crate) fn input_files(&self) -> Result<Vec<PathBuf>, Exit> {
        Ok(match self {
            Self::Fix(_) | Self::Dither(_) => Vec::new(),
            Self::Compensate(settings) => settings.inputs().cloned().collect(),
            Self::Edit(settings) => Editing::new(settings)?.inputs().cloned().collect(),
        })
    }

    /// Returns how many layers on each side it looks at.
    fn reach(&self) -> u32 {
        if matches!(self, Self::Fix(_)) { lamp_postprocess::FIX_REACH } else { 0 }
    }

    pub(super) fn start(&self, notes: &Notes) -> Result<Working<'_>, Exit> {
        Ok(match self {
            Self::Fix(settings) => Working::Fix(Fixing::new(settings)),
            Self::Compensate(settings) => Working::Compensate(Compensating::new(settings)?),
            Self::Dither(settings) => Working::Dither(settings, Progress::noting("dither", notes)),
            Self::Edit(settings) => Working::Edit(Editing::new(settings)?),
        })
    }
}

/// A stage at work.
pub(super) enum Working<'a> {
    Fix(Fixing),
    Compensate(Compensating<'a>),
    Dither(&'a DitherSettings, Progress),
    Edit(Editing),
}

impl Working<'_> {
    /// Returns the layers that come of `layers`. Findings in those of `range` count. `is_end` says
    /// whether the first and the last are those of the whole stack.
    pub(super) fn layers<'b>(
        &'b self,
        layers: Layers<'b>,
        range: Range<u32>,
        is_end: [bool; 2],
    ) -> Result<Layers<'b>, Exit> {
        Ok(match self {
            Self::Fix(fixing) => Box::new(fixing.layers(layers, range, |_| ())),
            Self::Compensate(compensating) => Box::new(compensating.layers(layers, range)),
            Self::Dither(settings, progress) => Box::new(settings.layers(layers, progress)),
            Self::Edit(editing) => Box::new(editing.layers(layers, range, is_end)?),
        })
    }

    /// Adds what was found; this is the stage of that number.
    pub(super) fn find(&self, stage: usize, name: &str, findings: &mut RangeFindings) {
        match self {
            Self::Fix(fixing) => findings.add_fixed(&fixing.report()),
            Self::Compensate(compensating) => {
                let notes = Notes::default();
                compensating.tell(name, &Progress::noting("compensate", &notes));
                findings.of_range.append(&mut taken(&notes));
            }
            Self::Dither(..) => {}
            Self::Edit(editing) => {
                findings.unused_edits.extend(editing.unused().map(|edit| (stage, edit)));
            }
        }
    }
}

/// Returns the lines that were noted.
pub(super) fn taken(notes: &Notes) -> Vec<String> {
    std::mem::take(&mut *notes.lock().expect("nobody panics while it is held"))
}

impl Chain {
    /// Returns the options that matter to bytes, a text for each stage. Equal texts of equal input
    /// files, by the same code, give equal bytes of the same part.
    pub(crate) fn canonical(&self) -> Vec<String> {
        let stages = self.stages.iter().map(Stage::canonical);
        [self.slice.canonical()].into_iter().chain(stages).collect()
    }

    /// Returns the files that options name, in the order of the stages.
    ///
    /// # Errors
    /// Returns an error if a list of edits cannot be read.
    pub(crate) fn input_files(&self) -> Result<Vec<PathBuf>, Exit> {
        let mut files: Vec<_> = self.slice.clone().named_mut().map(|path| path.clone()).collect();
        for stage in &self.stages {
            files.extend(stage.input_files()?);
        }
        Ok(files)
    }

    /// Returns the stages' names, each with the number that changes when its bytes do.
    pub(crate) fn code(&self) -> Vec<(&'static str, u32)> {
        let stages = self.stages.iter().map(Stage::code);
        [("slice", slice::CODE)].into_iter().chain(stages).collect()
    }

    /// Reads the part once, for an estimate of the work.
    ///
    /// # Errors
    /// Returns the error that slicing it would begin with.
    pub(crate) fn survey(&self, part: &Path) -> Result<Survey, Exit> {
        let begun = Instant::now();
        let settings = self.settings(part, None);
        let slicing = settings.open(None, &Progress::noting("slice", &Notes::default()))?;
        slicing.with_slices(|slices| Ok(Survey::of(slices, self, begun)))
    }

    fn settings(&self, part: &Path, layers: Option<Range<u32>>) -> SliceSettings {
        let mut settings = self.slice.clone();
        settings.parts = vec![PartArg { path: part.to_owned(), placement: None }];
        settings.layers = layers;
        settings
    }

    /// Makes the layers of a range, and gives them to `write`. Layers around it are made, too, as
    /// far as stages look at them. A stack records `name` as that of the part's file.
    ///
    /// # Errors
    /// Returns the first error of a stage or of `write`.
    pub(crate) fn run(
        &self,
        part: &Path,
        name: &str,
        range: Range<u32>,
        write: impl FnOnce(&mut dyn Iterator<Item = Result<Layer, Exit>>) -> Result<(), Exit>,
    ) -> Result<RangeFindings, Exit> {
        let notes: Notes = Arc::new(Mutex::default());
        let reach: u32 = self.stages.iter().map(Stage::reach).sum();
        let around = range.start.saturating_sub(reach)..range.end.saturating_add(reach);
        let settings = self.settings(part, Some(around.clone()));
        let progress = Progress::noting("slice", &notes);
        let slicing = settings.open(Some(name), &progress)?;
        slicing.doubts().iter().for_each(|doubt| progress.say(doubt));
        let working = self.stages.iter().map(|stage| stage.start(&notes));
        let working = working.collect::<Result<Vec<_>, _>>()?;
        let is_end = [around.start == 0, around.end >= slicing.part_layers()];
        let mut layers: Layers<'_> = Box::new(slicing.layers(range.clone(), |_| ()));
        for stage in &working {
            layers = stage.layers(layers, range.clone(), is_end)?;
        }
        write(&mut only(layers, range.clone())).map_err(|error| named(error, part))?;
        let mut findings = RangeFindings::new(slicing.counts(), slicing.is_blank());
        findings.of_range.extend(slicing.remarks().iter().map(|line| format!("slice: {line}")));
        for (stage, working) in (1..).zip(&working) {
            working.find(stage, name, &mut findings);
        }
        findings.of_part = taken(&notes);
        Ok(findings.of(&range))
    }
}

/// Passes on the layers of a range. The first of them says what the first of all says of the stack.
fn only(
    layers: Layers<'_>,
    range: Range<u32>,
) -> impl Iterator<Item = Result<Layer, Exit>> + use<'_> {
    let mut stack: Option<StackInfo> = None;
    layers.filter_map(move |layer| {
        let mut layer = match layer {
            Ok(layer) => layer,
            Err(error) => return Some(Err(error)),
        };
        let index = layer.info.index;
        let of_page = layer.info.stack.take().map(|stack| stack.of_range(index, &range));
        stack = of_page.or(stack.take());
        range.contains(&index).then(|| {
            layer.info.stack = stack.take();
            Ok(layer)
        })
    })
}

/// Names the part in an error of a stage that does not.
pub(super) fn named(error: Exit, part: &Path) -> Exit {
    let is_of_edit = matches!(&error, Exit::Failed(error) if error.is::<EditError>());
    if is_of_edit || is_of_stage(&error) { error.at(part.display().to_string()) } else { error }
}
