//! The part that a stack was sliced from, opened again.

use anyhow::anyhow;
use lamp_slicer::Part;
use lamp_stack::StackInfo;

use crate::exit::Exit;
use crate::part_arg::PartArg;
use crate::part_options::{Reading, name_of_all};
use crate::slicing_options::SlicingOptions;

/// What a stack records of how its part was sliced.
pub(crate) struct RecordedSlicing<'a> {
    pub(crate) options: SlicingOptions,
    /// The part's files, with their placements.
    files: Vec<String>,
    digest: &'a str,
}

impl<'a> RecordedSlicing<'a> {
    /// Returns `None` if a stack does not record it.
    pub(crate) fn of(stack: Option<&'a StackInfo>) -> Option<Self> {
        let stack = stack?;
        let (files, options, _) = SlicingOptions::of_command(stack.commands.first()?)?;
        Some(Self { options, files, digest: &stack.digest })
    }

    /// Opens the part. `name` is the stack's; `say` takes notes about the part.
    ///
    /// # Errors
    /// Returns an error if the stack was not sliced from these files as they are and stand.
    pub(crate) fn open(
        &self,
        parts: &[PartArg],
        name: &str,
        say: &dyn Fn(&str),
    ) -> Result<Part, Exit> {
        let reading = Reading { dpi: self.options.dpi, may_be_open: false, say };
        let model = self.options.solid.open(parts, &reading)?;
        if model.digest() != self.digest {
            let part = name_of_all(parts);
            return Err(Exit::Failed(anyhow!(
                "{name} was not sliced from {part}, or the part has changed"
            )));
        }
        // Names of files may have changed since, but not where the parts stand.
        let recorded = self.files.iter().map(|file| PartArg::parse(file.into()));
        let recorded = recorded.collect::<Result<Vec<_>, _>>().unwrap_or_default();
        let same = recorded.iter().zip(parts).all(|(a, b)| a.stands_like(b));
        if recorded.len() != parts.len() || !same {
            let files = self.files.join(" ");
            return Err(Exit::Failed(anyhow!(
                "{name} was sliced from {files}: give --part with the same placements"
            )));
        }
        Ok(model)
    }
}
