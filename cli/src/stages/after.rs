//! Stages that need the whole stack, and those behind them.

use std::path::{Path, PathBuf};

use lamp_batch::{Call, WriteLayers};
use lamp_machine::Machine;
use lamp_pipeline::documents::is_file;
use lamp_pipeline::part_file::PartFile;
use lamp_pipeline::slice::Counts;
use lamp_pipeline::support;
use lamp_pipeline::watcher::KeptRemarks;
use lamp_pipeline::{Error, RangeFindings, Stage, named};
use lamp_stack::{Page, Pages, PassingLayer, map_in_order};

use crate::commands::support::SupportArgs;
use crate::exit::Exit;
use crate::kept_stack::KeptStack;
use crate::terminal::progress::Progress;

/// A stage that works on a whole stack.
#[derive(Clone)]
pub(crate) enum After {
    Support(Box<SupportArgs>),
    /// A stage from layers to layers, behind one that needs the whole stack.
    Layers(Stage),
}

impl Call for After {
    fn canonical(&self) -> String {
        match self {
            Self::Support(args) => args.canonical(),
            Self::Layers(stage) => stage.canonical(),
        }
    }

    fn input_files(&self) -> Result<Vec<PathBuf>, Error> {
        match self {
            Self::Support(args) => {
                let machine = Some(args.machine.clone());
                Ok(machine.into_iter().filter(|path| is_file::<Machine>(path)).collect())
            }
            Self::Layers(stage) => stage.input_files(),
        }
    }

    fn code(&self) -> (&'static str, u32) {
        match self {
            Self::Support(_) => ("support", support::CODE),
            Self::Layers(stage) => stage.code(),
        }
    }
}

impl After {
    /// Makes the layers that come of a stack of a part, and gives them to `write`.
    ///
    /// # Errors
    /// Returns the first error of the stage or of `write`.
    pub(crate) fn run(
        &self,
        part: &Path,
        stack: &Path,
        write: &mut WriteLayers<'_, Exit>,
    ) -> Result<RangeFindings, Exit> {
        let kept = KeptRemarks::default();
        let mut findings = RangeFindings::new(Counts::default(), false);
        match self {
            Self::Support(args) => {
                let mut args = SupportArgs::clone(args);
                args.part = vec![PartFile { path: part.to_owned(), placement: None }];
                args.stack = stack.to_owned();
                let mut stack = KeptStack::new(stack);
                let progress = Progress::keeping("support", &kept);
                let mut layers = args.layers(&mut stack, &progress)?;
                write(&mut layers)?;
            }
            Self::Layers(stage) => {
                let working = stage.start(&kept)?;
                let failed = |error| Error::from(error).at(stack.display().to_string());
                let pages = Pages::open(stack).map_err(failed)?;
                let layers =
                    map_in_order(pages.map(move |page| page.map_err(failed)), move |page: Page| {
                        page.decode().map(PassingLayer::from).map_err(failed)
                    });
                // All of the stack is here, so both ends are its own.
                let layers = working.layers(Box::new(layers), 0..u32::MAX, [true; 2])?;
                let mut decoded = layers.map(|layer| {
                    let layer = layer.and_then(|layer| Ok(layer.decode()?));
                    layer.map_err(|error| Exit::from(named(error, part)))
                });
                write(&mut decoded)?;
                // It borrows the stage, whose findings come next.
                drop(decoded);
                working.find(0, &part.display().to_string(), &mut findings);
            }
        }
        findings.of_part = kept.take();
        Ok(findings)
    }
}
