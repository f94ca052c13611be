//! A part where a stack may stand, too: it is sliced on the way.

use std::ops::Range;
use std::path::{Path, PathBuf};

use lamp_postprocess::machine::Machine;
use lamp_slicer::Part;
use lamp_stack::{Layer, Pages, StackError};

use crate::exit::Exit;
use crate::part_arg::PartArg;
use crate::part_options::{Reading, at_part};
use crate::progress::Progress;
use crate::slicing_options::SlicingOptions;
use crate::streams::{input_name, is_stream};

/// A part that is open.
pub(crate) struct SlicedPart {
    pub(crate) file: PartArg,
    pub(crate) model: Part,
}

/// Refuses options of slicing where there is nothing to slice. `machine` gives defaults.
///
/// # Errors
/// If an option is not as it is by default, and all inputs are stacks.
pub(crate) fn check_slicing(
    slicing: &SlicingOptions,
    inputs: &[PathBuf],
    machine: Option<&Machine>,
) -> Result<(), Exit> {
    let Some(option) = slicing.stated(machine) else { return Ok(()) };
    // What cannot be opened is told of later.
    if inputs.iter().any(|input| !is_stream(input) && Pages::open(input).is_err()) {
        return Ok(());
    }
    let [what, verb] = if inputs.len() == 1 { ["a stack", "is"] } else { ["stacks", "are"] };
    let names = inputs.iter().map(|input| input_name(input)).collect::<Vec<_>>().join(", ");
    Err(Exit::usage(format!(
        "{names} {verb} {what}, which {option} cannot change: leave it out, or name a part"
    )))
}

/// The layers of a part.
pub(crate) struct LayersOfPart<I> {
    pub(crate) layers: I,
    pub(crate) count: u64,
}

impl SlicedPart {
    /// Tells a stack from a part by how it begins, and opens a part. Of a stack there is none.
    pub(crate) fn open(
        path: &Path,
        slicing: &SlicingOptions,
        say: &dyn Fn(&str),
    ) -> Result<Option<Self>, Exit> {
        let is_part =
            !is_stream(path) && matches!(Pages::open(path), Err(StackError::NotTiff { .. }));
        if !is_part {
            return Ok(None);
        }
        let reading = Reading { dpi: slicing.dpi, may_be_open: false, say };
        let file = PartArg { path: path.to_owned(), placement: None };
        let model = slicing.solid.open(std::slice::from_ref(&file), &reading)?;
        Ok(Some(Self { file, model }))
    }

    /// Slices the part, or a range of its layers.
    pub(crate) fn layers(
        &self,
        slicing: &SlicingOptions,
        layers: Option<Range<u32>>,
        memory: Option<u64>,
        progress: &Progress,
    ) -> Result<LayersOfPart<impl Iterator<Item = Result<Layer, Exit>> + use<>>, Exit> {
        let (parts, _) = slicing.solid.files(std::slice::from_ref(&self.file));
        let (model, names) = (self.model.clone(), [self.file.recorded()]);
        let slices = slicing.slices(model, &names, layers, memory, slicing.exposure()?, progress);
        let (slices, name_command) = slices.map_err(|error| at_part(error, &parts))?;
        let count = slices.layer_count() as u64;
        let layers = slices.map(move |layer| {
            let mut layer = layer.map_err(|error| at_part(error.into(), &parts))?;
            name_command(&mut layer);
            Ok(layer)
        });
        Ok(LayersOfPart { layers, count })
    }
}
