//! Stages on a folder of strips or fields: they see its build, and what they make of it is cut again.

use std::path::Path;

use lamp_build::{FieldForm, FieldWriter, FieldsError, is_fields, join_fields};
use lamp_stack::{PassingLayer, is_stack_name, map_in_order};

use crate::args::options::{InputArgs, Output};
use crate::exit::Exit;
use crate::streams::{format, input_name, is_stream, new_folder, read_passing, write_layers};
use crate::terminal::progress::Progress;

/// Layers in order, coded or not.
pub(crate) type PassingLayers = Box<dyn Iterator<Item = Result<PassingLayer, Exit>>>;

/// Reads the wanted layers of a stack, undecoded where they can pass, or the layers of the build
/// that a folder of strips or fields makes.
pub(crate) fn read_stack_or_fields(
    input: &InputArgs,
    progress: &Progress,
) -> Result<PassingLayers, Exit> {
    let folder = &input.stack;
    if !is_fields(folder) {
        return Ok(Box::new(read_passing(input, progress)?));
    }
    if input.layers.is_some() {
        return Err(Exit::usage(
            "--layers is for one stack, and this is a folder of strips or fields: make one stack of \
             them with lamp join",
        ));
    }
    let name = input_name(folder);
    let failed = move |error| Exit::from(error).at(name.clone());
    let layers = join_fields(folder).map_err(&failed)?;
    let progress = progress.clone();
    Ok(Box::new(layers.map(move |layer| {
        let layer = layer.map_err(&failed)?;
        if let Some(layers) = layer.info.stack.as_ref().and_then(|stack| stack.layers) {
            progress.expect(layers.into());
        }
        Ok(layer.into())
    })))
}

/// Writes layers as a stack, or as strips or fields if the input was a folder of them. `form` changes how
/// they were cut.
pub(crate) fn write_stack_or_fields(
    layers: impl Iterator<Item = Result<PassingLayer, Exit>>,
    input: &InputArgs,
    form: impl FnOnce(FieldForm) -> FieldForm,
    output: &Output,
    progress: &Progress,
) -> Result<(), Exit> {
    if !is_fields(&input.stack) {
        return write_layers(layers, output, progress);
    }
    // Fields are cut from images, so no layer passes undecoded.
    let layers = map_in_order(layers, |layer: PassingLayer| Ok::<_, Exit>(layer.decode()?));
    let cut_as = FieldForm::of(&input.stack).map_err(|error| failed(&input.stack, error))?;
    let form = form(cut_as);
    let to = &output.output;
    if is_stream(to) || is_stack_name(to) || output.format.is_some() {
        return Err(Exit::usage(format!(
            "{}: the result of {kind}s is a folder of {kind}s: name one with -o, or make one stack \
             of them with lamp join first",
            to.display(),
            kind = form.kind()
        )));
    }
    let folder = new_folder(to, output.force)?;
    let fields = FieldWriter::new(folder, form, format(output.classic));
    let mut fields = fields.map_err(|error| failed(to, error))?;
    for layer in layers {
        let layer = layer?;
        fields.push(&layer).map_err(|error| failed(to, error))?;
        progress.layer_written(&layer);
    }
    progress.done();
    fields.finish().map_err(|error| failed(to, error))?;
    progress.wrote_layers(to);
    Ok(())
}

fn failed(folder: &Path, error: FieldsError) -> Exit {
    Exit::from(error).at(input_name(folder))
}
