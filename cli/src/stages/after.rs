//! Stages that need the whole stack, and those behind them.

use std::path::{Path, PathBuf};

use lamp_postprocess::machine::Machine;
use lamp_stack::Layer;

use super::chain::{Stage, named, taken};
use super::findings::RangeFindings;
use crate::catalogue::is_file;
use crate::commands::support::SupportArgs;
use crate::exit::Exit;
use crate::kept_stack::KeptStack;
use crate::mesh_report::Counts;
use crate::part_arg::PartArg;
use crate::progress::{Notes, Progress};
use crate::streams::{layers_of, open_pages};

/// Changes when `support` makes other bytes from the same options, stack and part.
pub(super) const SUPPORT_CODE: u32 = 3;

/// A stage that works on a whole stack.
#[derive(Clone)]
pub(crate) enum After {
    Support(Box<SupportArgs>),
    /// A stage from layers to layers, behind one that needs the whole stack.
    Layers(Stage),
}

impl After {
    /// Returns its options that matter to bytes as one text.
    pub(crate) fn canonical(&self) -> String {
        match self {
            Self::Support(args) => args.canonical(),
            Self::Layers(stage) => stage.canonical(),
        }
    }

    /// Returns the files that its options name.
    ///
    /// # Errors
    /// Returns an error if a list of edits cannot be read.
    pub(crate) fn input_files(&self) -> Result<Vec<PathBuf>, Exit> {
        match self {
            Self::Support(args) => {
                let machine = Some(args.machine.clone());
                Ok(machine.into_iter().filter(|path| is_file::<Machine>(path)).collect())
            }
            Self::Layers(stage) => stage.input_files(),
        }
    }

    /// Returns its name, and the number that changes when its bytes do.
    pub(crate) fn code(&self) -> (&'static str, u32) {
        match self {
            Self::Support(_) => ("support", SUPPORT_CODE),
            Self::Layers(stage) => stage.code(),
        }
    }

    /// Makes the layers that come of a stack of a part, and gives them to `write`.
    ///
    /// # Errors
    /// Returns the first error of the stage or of `write`.
    pub(crate) fn run(
        &self,
        part: &Path,
        stack: &Path,
        write: impl FnOnce(&mut dyn Iterator<Item = Result<Layer, Exit>>) -> Result<(), Exit>,
    ) -> Result<RangeFindings, Exit> {
        let notes = Notes::default();
        let mut findings = RangeFindings::new(Counts::default(), false);
        match self {
            Self::Support(args) => {
                let mut args = SupportArgs::clone(args);
                args.part = vec![PartArg { path: part.to_owned(), placement: None }];
                args.stack = stack.to_owned();
                let mut kept = KeptStack::new(stack);
                let mut layers = args.layers(&mut kept, &Progress::noting("support", &notes))?;
                write(&mut layers)?;
            }
            Self::Layers(stage) => {
                let working = stage.start(&notes)?;
                let layers = Box::new(layers_of(open_pages(stack)?, stack, None));
                let mut layers = working.layers(layers, 0..u32::MAX, [true; 2])?;
                write(&mut layers).map_err(|error| named(error, part))?;
                drop(layers);
                working.find(0, &part.display().to_string(), &mut findings);
            }
        }
        findings.of_part = taken(&notes);
        Ok(findings)
    }
}
