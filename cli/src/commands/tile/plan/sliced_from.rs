//! How a stack was sliced, to slice its part again.

use std::fs::File;
use std::ops::Range;
use std::path::Path;

use anyhow::anyhow;
use lamp_build::{PartStack, TurnedSlicing};
use lamp_pipeline::part_file::{PartFile, names_of};
use lamp_pipeline::words::option;
use lamp_pipeline::{SliceSettings, SlicingRecord};
use lamp_stack::{digest_of, digest_of_digests, file_word, quoted};

use super::super::stacks::{InputStack, ReadLayers};
use crate::exit::Exit;

/// A stack's record of how it was sliced.
pub(super) struct SlicedFrom {
    settings: SliceSettings,
    /// The part's files, with their placements.
    files: Vec<PartFile>,
    /// The part's name, if it was given one.
    name: Option<String>,
    /// The part's files as the stack records them, if they were not found.
    pub(super) missing: Option<String>,
    /// The stages that changed pages since.
    pub(super) stages: Vec<&'static str>,
    layers: Range<u32>,
}

impl SlicedFrom {
    /// Reads what a stack records, and looks for the part's files next to the stack and in the
    /// current folder.
    ///
    /// # Errors
    /// Returns an error if the stack does not record how it was sliced, or more than that.
    pub(super) fn new(path: &Path, input: &InputStack, part: &PartStack) -> Result<Self, Exit> {
        let refused = |why: String| Exit::Failed(anyhow!("{}: {why}", part.name()));
        let stack = part.stack();
        let commands = stack.map_or(&[][..], |stack| &stack.commands);
        let record = stack.and_then(SlicingRecord::of);
        let (Some(stack), Some(mut record)) = (stack, record) else {
            let why = "it does not state how it was sliced, so it cannot be sliced at other \
                       angles: give --turns quarters";
            return Err(refused(why.to_owned()));
        };
        if record.fallback.is_some() {
            let why = "a fallback replaced some of its layers, which is not repeated at other \
                       angles: give --turns quarters";
            return Err(refused(why.to_owned()));
        }
        if let Some(more) = commands.get(1) {
            let name = more.split(' ').next().unwrap_or_default();
            return Err(refused(format!(
                "{name} changed it after slicing, and other angles would lose this change: give \
                 the stack before it, or --turns quarters"
            )));
        }
        let folders = [path.parent().unwrap_or(Path::new("")), Path::new("")];
        record.find_exposure(&folders).map_err(|error| error.at(part.name()))?;
        let SlicingRecord { parts: recorded, name, settings, .. } = record;
        let found = folders.iter().find_map(|folder| files_in(folder, &recorded, &stack.digest));
        let missing = found.is_none().then(|| names_of(&recorded));
        let files = found.unwrap_or(recorded);
        let ReadLayers { stages, range } = input.read_layers().clone();
        Ok(Self { settings, files, name, missing, stages, layers: range })
    }

    /// Returns the place about which the part turns, in the coordinates of its images.
    pub(super) fn centre_mm(&self) -> [f64; 2] {
        // It is moved after it is turned.
        let [x, y, _] = self.settings.solid.placement().at([0.0; 3]);
        [x, y]
    }

    /// Returns the command that slices the part for a plan.
    pub(super) fn command(&self, slicing: &TurnedSlicing, all_layers: bool, out: &str) -> String {
        let slice = self.settings.clone().turned(slicing).command(&self.files);
        let Range { start, end } = self.layers;
        let layers = if all_layers { format!(" --layers {start}..{end}") } else { String::new() };
        let name = self.name.as_ref().map(|name| option("name", name)).unwrap_or_default();
        format!("{slice}{name}{layers} -o {}", quoted(&file_word(out)))
    }
}

/// Returns the files of a part that are in a folder, with their placements, if their digest is this.
fn files_in(folder: &Path, recorded: &[PartFile], digest: &str) -> Option<Vec<PartFile>> {
    let file_in = |file: &PartFile| PartFile { path: folder.join(&file.path), ..file.clone() };
    let found: Vec<PartFile> = recorded.iter().map(file_in).collect();
    let digests = found.iter().map(|file| digest_of(File::open(&file.path).ok()?).ok());
    let digests: Vec<String> = digests.collect::<Option<_>>()?;
    let is_it = digest_of_digests(digests.iter().map(String::as_str)) == digest;
    is_it.then_some(found)
}
