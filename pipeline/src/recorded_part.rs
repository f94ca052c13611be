//! The part that a stack was sliced from, opened again.

use lamp_slicing::Part;
use lamp_stack::StackInfo;

use crate::error::Error;
use crate::part_file::{PartFile, names_of};
use crate::slice_settings::{SliceSettings, SlicingRecord};
use crate::solid::{Reading, name_of_all};
use crate::watcher::Watcher;

/// A stack's record of how its part was sliced.
pub struct RecordedSlicing<'a> {
    /// The settings.
    pub settings: SliceSettings,
    /// The part's files, with their placements.
    files: Vec<PartFile>,
    digest: &'a str,
}

impl<'a> RecordedSlicing<'a> {
    /// Returns `None` if a stack does not record it.
    pub fn of(stack: Option<&'a StackInfo>) -> Option<Self> {
        let stack = stack?;
        let SlicingRecord { parts: files, settings, .. } = SlicingRecord::of(stack)?;
        Some(Self { settings, files, digest: &stack.digest })
    }

    /// Opens the part. `name` is the name of the stack; colors and painted regions of facets are kept
    /// on request.
    ///
    /// # Errors
    /// Returns an error if the stack was not sliced from these files as they are and stand.
    pub fn open(
        &self,
        parts: &[PartFile],
        name: &str,
        keep_marks: bool,
        watcher: &dyn Watcher,
    ) -> Result<Part, Error> {
        let (pitch, mask) = (self.settings.pitch, self.settings.uniform_thickness());
        let reading = Reading { pitch, may_be_open: false, keep_marks, mask, watcher };
        let model = self.settings.solid.open(parts, &reading)?;
        if model.digest() != self.digest {
            let part = name_of_all(parts);
            return Err(Error::work(format!(
                "{name} was not sliced from {part}, or the part has changed"
            )));
        }
        // Names of files may have changed since, but not where the parts stand.
        let same = self.files.iter().zip(parts).all(|(a, b)| a.stands_like(b));
        if self.files.len() != parts.len() || !same {
            let files = names_of(&self.files);
            return Err(Error::work(format!(
                "{name} was sliced from {files}: give --part with the same placements"
            )));
        }
        Ok(model)
    }
}
