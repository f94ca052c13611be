//! Stages on a folder of strips: they see its build, and what they make of it is cut again.

use std::path::Path;

use lamp_postprocess::{StripForm, StripWriter, StripsError, is_strips, join_strips};
use lamp_stack::Layer;

use crate::exit::Exit;
use crate::options::{Input, Output};
use crate::progress::Progress;
use crate::stages::Layers;
use crate::streams::{format, input_name, new_folder, read_layers, write_layers};

/// Reads the wanted layers of a stack, or those of the build that a folder of strips makes.
pub(crate) fn read_layers_or_strips(
    input: &Input,
    progress: &Progress,
) -> Result<Layers<'static>, Exit> {
    let folder = &input.stack;
    if !is_strips(folder) {
        return Ok(Box::new(read_layers(input, progress)?));
    }
    if input.layers.is_some() {
        return Err(Exit::usage(
            "--layers takes some layers of a stack, and strips stay whole: lamp join makes one stack \
             of them",
        ));
    }
    let name = input_name(folder);
    let failed = move |error| Exit::from(error).at(name.clone());
    let layers = join_strips(folder).map_err(&failed)?;
    let progress = progress.clone();
    Ok(Box::new(layers.map(move |layer| {
        let layer = layer.map_err(&failed)?;
        if let Some(layers) = layer.info.stack.as_ref().and_then(|stack| stack.layers) {
            progress.expect(layers.into());
        }
        Ok(layer)
    })))
}

/// Writes layers as a stack, or as strips if the input was a folder of them. `form` changes how
/// they were cut.
pub(crate) fn write_layers_or_strips(
    layers: impl Iterator<Item = Result<Layer, Exit>>,
    input: &Input,
    form: impl FnOnce(StripForm) -> StripForm,
    output: &Output,
    progress: &Progress,
) -> Result<(), Exit> {
    if !is_strips(&input.stack) {
        return write_layers(layers, output, progress);
    }
    let cut_as = StripForm::of(&input.stack).map_err(|error| failed(&input.stack, error))?;
    let StripForm { mirrors, overlap, seam } = form(cut_as);
    let to = &output.output;
    let folder = new_folder(to, output.force)?;
    let write = || -> Result<StripWriter, StripsError> {
        StripWriter::new(folder, mirrors, overlap, seam, format(output.classic))
    };
    let mut strips = write().map_err(|error| failed(to, error))?;
    for layer in layers {
        strips.push(&layer?).map_err(|error| failed(to, error))?;
        progress.layer_done();
    }
    progress.done();
    strips.finish().map_err(|error| failed(to, error))
}

fn failed(folder: &Path, error: StripsError) -> Exit {
    Exit::from(error).at(input_name(folder))
}
