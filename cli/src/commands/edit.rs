//! `lamp edit`: changes a stack at image level.

use clap::Args;
use lamp_edit::EditError;
use lamp_pipeline::edit::{EditSettings, Editing, unused_text};

use crate::args::options::{Common, InputArgs, Output};
use crate::args::stages::EditStageArgs;
use crate::exit::Exit;
use crate::streams::{
    check_not_input, input_name, is_stream, progress, read_passing, write_layers,
};
use crate::terminal::stack_notes::noting;

/// Edit the images of a part, without slicing it again
///
/// It adds or subtracts boxes, cylinders, cones, spheres, lofts, film-cooling holes, lines, polygons,
/// labels, pictures and other stacks in a range of heights, and can repeat them along lines and
/// circles. It crops, pads, mirrors and rotates all layers. Lengths and positions are in part coordinates, even in a build,
/// where you can choose copies. Serial numbers of labels may come from a CSV file. A TOML file
/// lists the edits, which are applied in order; docs/edit.md describes every key. Pages that no
/// edit changes are copied with their compressed images and checks, and are not decoded.
#[derive(Args)]
#[command(override_usage = "\
lamp edit [OPTIONS] <STACK> <EDITS.toml>
       lamp edit [OPTIONS] <STACK> <--union|--intersect|--difference|--xor> <STACK>")]
#[command(after_help = "\
Examples:
  lamp edit blade.tif edits.toml -o variant.tif
  slice blade.stl | fix | lamp edit - edits.toml | tile > build.tif
  lamp edit shell.tif --difference core.tif -o hollow.tif

An edits.toml:
  [[edit]]
  op = \"subtract\"
  label = { text = \"SN {n:04}\", start = 17, at = [[\"2mm\", \"1mm\"]], height = \"3mm\" }
  z = [\"0mm\", \"0.5mm\"]")]
pub(crate) struct EditArgs {
    #[command(flatten)]
    input: InputArgs,

    #[command(flatten)]
    settings: EditStageArgs,

    #[command(flatten)]
    output: Output,
}

impl EditArgs {
    fn check_streams(&self, settings: &EditSettings) -> Result<(), Exit> {
        let all = [settings.named(), &self.input.stack].into_iter();
        match all.filter(|path| is_stream(path)).count() {
            0 | 1 => Ok(()),
            _ => Err(Exit::usage(
                "only one input can be standard input (STACK is, unless it is named)",
            )),
        }
    }
}

pub(crate) fn run(args: &EditArgs, common: &Common) -> Result<(), Exit> {
    let settings = EditSettings::from(&args.settings);
    args.check_streams(&settings)?;
    let editing = Editing::new(&settings)?;
    check_not_input(&args.output.output, editing.inputs())?;
    let progress = progress("edit", common, &args.output);
    // Layers that are not wanted are no loss.
    let is_whole = [args.input.layers.is_none(); 2];
    let layers = read_passing(&args.input, &progress)?;
    let edited = editing.layers(layers, 0..u32::MAX, is_whole, &noting)?;
    write_layers(edited, &args.output, &progress).map_err(|error| match error {
        // A page that cannot be decoded names its stack.
        error if matches!(error.cause(), Some(EditError::Page(_))) => error,
        Exit::Failed(error) if error.is::<EditError>() => {
            Exit::Failed(error).at(input_name(&args.input.stack))
        }
        error => error,
    })?;
    editing.unused().for_each(|edit| progress.say(&unused_text(edit)));
    Ok(())
}
