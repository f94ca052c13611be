//! A part in place of a stack: it is sliced on the way.

use std::ops::Range;
use std::path::{Path, PathBuf};

use lamp_machine::Machine;
use lamp_slicing::Part;
use lamp_stack::{Layer, Pages, StackError};

use crate::documents::{input_name, is_stream};
use crate::error::Error;
use crate::part_file::PartFile;
use crate::slice_settings::SliceSettings;
use crate::solid::{Reading, at_part};
use crate::watcher::Watcher;

/// A part that is open.
pub struct SlicedPart {
    /// Its file.
    pub file: PartFile,
    /// The part.
    pub model: Part,
    /// How it is sliced.
    pub settings: SliceSettings,
}

/// Refuses options of slicing if there is nothing to slice. `machine` gives defaults.
///
/// # Errors
/// If an option differs from its default, and all inputs are stacks.
pub fn check_slicing(
    slicing: &SliceSettings,
    inputs: &[PathBuf],
    machine: Option<&Machine>,
) -> Result<(), Error> {
    let Some(option) = slicing.stated(machine) else { return Ok(()) };
    // Inputs that cannot be opened are refused later.
    if inputs.iter().any(|input| !is_stream(input) && Pages::open(input).is_err()) {
        return Ok(());
    }
    let [what, verb] = if inputs.len() == 1 { ["a stack", "is"] } else { ["stacks", "are"] };
    let names = inputs.iter().map(|input| input_name(input)).collect::<Vec<_>>().join(", ");
    Err(Error::settings(format!(
        "{names} {verb} {what}, which --{option} cannot change: leave it out, or name a part"
    )))
}

/// The layers of a part.
pub struct LayersOfPart<I> {
    /// The layers.
    pub layers: I,
    /// The number of layers.
    pub count: u64,
}

impl SlicedPart {
    /// Opens a part; returns `None` for a stack, which begins otherwise.
    ///
    /// # Errors
    /// Returns an error if the part cannot be opened.
    pub fn open(
        path: &Path,
        slicing: &SliceSettings,
        watcher: &dyn Watcher,
    ) -> Result<Option<Self>, Error> {
        // Only the first bytes show whether a file is a stack, and a pipe cannot be read twice.
        let is_part =
            !is_stream(path) && matches!(Pages::open(path), Err(StackError::NotTiff { .. }));
        if !is_part {
            return Ok(None);
        }
        let (pitch, mask) = (slicing.pitch, slicing.uniform_thickness());
        let reading = Reading { pitch, may_be_open: false, keep_marks: false, mask, watcher };
        let file = PartFile { path: path.to_owned(), placement: None };
        let model = slicing.solid.open(std::slice::from_ref(&file), &reading)?;
        Ok(Some(Self { file, model, settings: slicing.clone() }))
    }

    /// Slices the part, or a range of its layers.
    ///
    /// # Errors
    /// Returns an error if settings contradict each other or the part.
    pub fn layers(
        &self,
        layers: Option<Range<u32>>,
        memory: Option<u64>,
        watcher: &dyn Watcher,
    ) -> Result<LayersOfPart<impl Iterator<Item = Result<Layer, Error>> + use<>>, Error> {
        let slicing = &self.settings;
        let (parts, _) = slicing.solid.files(std::slice::from_ref(&self.file));
        let (model, names) = (self.model.clone(), vec![self.file.named()]);
        let slices = slicing.slices(model, names, layers, memory, slicing.exposure()?, watcher);
        let (slices, words) = slices.map_err(|error| at_part(error, &parts))?;
        let count = slices.layer_count() as u64;
        let layers = slices.map(move |layer| {
            let mut layer = layer.map_err(|error| at_part(error.into(), &parts))?;
            words.write(&mut layer);
            Ok(layer)
        });
        Ok(LayersOfPart { layers, count })
    }
}
